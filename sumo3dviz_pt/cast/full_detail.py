"""Bodies in full detail: built when a shot first comes near them, then kept in the user's cache."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import shutil
import time
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path, PurePosixPath

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.files.kept import Files, keep, read_whole
from sumo3dviz_pt.library.mesh.ply import decoded, encoded
from sumo3dviz_pt.library.vehicles.bake import full_vehicle
from sumo3dviz_pt.library.vehicles.stretching import stretched
from sumo3dviz_pt.model.scene import Part, Prototype

_LOG = logging.getLogger(__name__)

_LEVELS = ("full", "wheel")
_DIGITS = 16  # of a digest
_KEPT = 30 * 86_400.0  # how long a body of another version stays [s]


def full_prototypes(names: Iterable[str]) -> dict[str, Prototype]:
    """Return bodies and wheels in full detail of vehicles of the catalogue.

    Args:
        names: Of vehicles that have them.

    Returns:
        `<name>/full` and `<name>/wheel` by their names.
    """
    found = {}
    for name in sorted(names):
        files = _files(name, _folder(name))
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


def _files(name: str, folder: Path) -> Files:
    """A vehicle's mesh files from the cache; built, and kept there, if they are not whole."""
    files = read_whole(folder)
    if files is None:
        files = _built(name, folder.name)
        try:
            keep(folder, files)
            _forget(name, folder)
        except OSError as error:
            _say_unkept(folder.parent, error.strerror or str(error))
    return files


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


@cache
def _say_unkept(root: Path, why: str) -> None:
    """Say once that nothing can be kept."""
    _LOG.warning(
        "%s cannot be written (%s): bodies in full detail are built anew each time;"
        " SUMO3DVIZ_PT_CACHE names another folder for them",
        root,
        why,
    )


def _prototype(name: str, level: str, files: Files) -> Prototype:
    """One level of a vehicle."""
    parts = tuple(
        Part(decoded(files[path], file=Path(path)), PurePosixPath(path).stem)
        for path in sorted(files)
        if path.startswith(f"{level}/")
    )
    return Prototype(f"{name}/{level}", parts, ())


def _forget(name: str, target: Path) -> None:
    """Remove what older recipes, older code or killed processes left; younger may be in use."""
    left = [*target.parent.glob(f"{name}-{'?' * _DIGITS}"), *target.parent.glob(".b*-*")]
    for folder in left:
        # Another process may have been faster.
        with contextlib.suppress(FileNotFoundError):
            if folder != target and time.time() - folder.stat().st_mtime > _KEPT:
                shutil.rmtree(folder, ignore_errors=True)


def _folder(name: str) -> Path:
    """Where a vehicle lies in the cache: its recipe and our code are in the name."""
    entry = catalog.find("vehicles", name)
    digest = hashlib.blake2b(_code(), digest_size=_DIGITS // 2)
    for path in catalog.recipe_files(entry):
        digest.update(path.read_bytes())
    return catalog.cache_root() / "vehicles" / f"{name}-{digest.hexdigest()}"


@cache
def _code() -> bytes:
    """A digest of the code that builds vehicles, wherever in the library it lies."""
    files = catalog.package_folder("library").rglob("*.py")
    digests = sorted(hashlib.blake2b(path.read_bytes()).digest() for path in files)
    return hashlib.blake2b(b"".join(digests)).digest()
