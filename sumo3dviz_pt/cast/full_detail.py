"""Bodies in full detail: built when a shot first comes near them, then kept in the user's cache."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path, PurePosixPath

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.cast.kept_bodies import kept_files, kept_folder
from sumo3dviz_pt.files.kept import Files
from sumo3dviz_pt.library.mesh.ply import decoded, encoded
from sumo3dviz_pt.library.vehicles.bake import full_vehicle
from sumo3dviz_pt.library.vehicles.stretching import stretched
from sumo3dviz_pt.model.scene import Part, Prototype

_LOG = logging.getLogger(__name__)

_LEVELS = ("full", "wheel")


def full_prototypes(names: Iterable[str]) -> dict[str, Prototype]:
    """Return bodies and wheels in full detail of vehicles of the catalogue.

    Args:
        names: Of vehicles that have them.

    Returns:
        `<name>/full` and `<name>/wheel` by their names.
    """
    found = {}
    for name in sorted(names):
        folder = kept_folder(catalog.find("vehicles", name), "vehicles")
        files = kept_files(folder, partial(_built, name, folder.name))
        for level in _LEVELS:
            found[f"{name}/{level}"] = _prototype(name, level, files)
    return found


def full_bodies(units: Iterable[Unit]) -> dict[str, Prototype]:
    """Return bodies and wheels in full detail by the names that units give them, lamps included.

    Args:
        units: Of models that have full detail.
    """
    wanted = {unit.full: unit for unit in units}
    made = full_prototypes({unit.source for unit in wanted.values()})
    found = {}
    for name, unit in wanted.items():
        body = made[f"{unit.source}/full"]
        if unit.given is not None:
            body = stretched(body, unit.given, name=name)
        found[name] = replace(body, lamps=unit.prototype.lamps)
        found[unit.wheel] = made[unit.wheel]
    return found


@cache
def _built(name: str, known_as: str) -> Files:
    """Build a vehicle's mesh files; in memory for as long as we run, should they not be kept.

    Args:
        name: The vehicle's.
        known_as: In the cache: another recipe, and so another vehicle, is known by another name.
    """
    _LOG.info("building %s in full detail", name)
    made = full_vehicle(catalog.find("vehicles", name).meta)
    assert made is not None, known_as
    levels = zip(_LEVELS, (made.body, made.wheel), strict=True)
    return {
        f"{level}/{material}.ply": encoded(mesh)
        for level, meshes in levels
        for material, mesh in meshes.items()
    }


def _prototype(name: str, level: str, files: Files) -> Prototype:
    """One level of a vehicle."""
    parts = tuple(
        Part(decoded(files[path], file=Path(path)), PurePosixPath(path).stem)
        for path in sorted(files)
        if path.startswith(f"{level}/")
    )
    return Prototype(f"{name}/{level}", parts, ())
