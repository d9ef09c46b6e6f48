"""Bodies in full detail: built when a shot first comes near them, then kept in the user's cache."""

from __future__ import annotations

import hashlib
import logging
import shutil
import tempfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype
from sumo3dviz_pt.scene.drawing import Unit
from sumo3dviz_pt.shapes.bake import hero_vehicle
from sumo3dviz_pt.shapes.ply import read_ply, write_ply
from sumo3dviz_pt.shapes.stretching import stretched

_LOG = logging.getLogger(__name__)

_LEVELS = ("hero", "wheel")
_DIGITS = 16  # of a digest
_KEPT = 30 * 86_400.0  # how long a body of another version stays [s]


def hero_prototypes(names: Iterable[str]) -> dict[str, Prototype]:
    """Bodies and wheels in full detail of vehicles of the catalogue.

    Args:
        names: Of vehicles that have them.

    Returns:
        `<name>/hero` and `<name>/wheel` by their names.
    """
    wanted = sorted(names)
    missing = [name for name in wanted if not _folder(name).is_dir()]
    for number, name in enumerate(missing):
        _LOG.info("building %s in full detail (%d of %d)", name, number + 1, len(missing))
        _build(name)
    found = {}
    for name in wanted:
        for level in _LEVELS:
            found[f"{name}/{level}"] = _read(name, level)
    return found


def heroes_of(units: Iterable[Unit]) -> dict[str, Prototype]:
    """Bodies and wheels in full detail by the names that units give them, lamps included.

    Args:
        units: Of models that have full detail.
    """
    wanted = {unit.hero: unit for unit in units}
    made = hero_prototypes({unit.source for unit in wanted.values()})
    found = {}
    for name, unit in wanted.items():
        body = made[f"{unit.source}/hero"]
        if unit.given is not None:
            body = stretched(body, unit.given, name=name)
        found[name] = replace(body, lamps=unit.prototype.lamps)
        found[unit.wheel] = made[unit.wheel]
    return found


def _read(name: str, level: str) -> Prototype:
    """One level from the cache."""
    parts = tuple(
        Part(read_ply(path), path.stem) for path in sorted((_folder(name) / level).glob("*.ply"))
    )
    return Prototype(f"{name}/{level}", parts, ())


def _build(name: str) -> None:
    """Build a vehicle into the cache; a half-built one never shows up there."""
    made = hero_vehicle(catalog.find("vehicles", name).meta)
    assert made is not None, name
    target = _folder(name)
    target.parent.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(dir=target.parent, prefix=".building-"))
    try:
        for level, meshes in zip(_LEVELS, (made.body, made.wheel), strict=True):
            _write(work / level, meshes)
        _put(work, target)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    _forget(name, target)


def _put(work: Path, target: Path) -> None:
    """Name a built vehicle, unless another process was faster."""
    try:
        work.rename(target)
    except OSError:
        if not target.is_dir():
            raise


def _forget(name: str, target: Path) -> None:
    """Remove what an older recipe or older code left; a running film may still read younger."""
    for folder in target.parent.glob(f"{name}-{'?' * _DIGITS}"):
        if folder != target and time.time() - folder.stat().st_mtime > _KEPT:
            shutil.rmtree(folder, ignore_errors=True)


def _write(folder: Path, meshes: Mapping[str, Mesh]) -> None:
    """Meshes by material as files."""
    folder.mkdir()
    for material, mesh in meshes.items():
        write_ply(folder / f"{material}.ply", mesh)


def _folder(name: str) -> Path:
    """Where a vehicle lies in the cache: its recipe and our code are in the name."""
    entry = catalog.find("vehicles", name)
    digest = hashlib.blake2b(_code(), digest_size=_DIGITS // 2)
    for path in catalog.recipe_files(entry):
        digest.update(path.read_bytes())
    return catalog.cache_root() / "vehicles" / f"{name}-{digest.hexdigest()}"


@cache
def _code() -> bytes:
    """A digest of the code that builds vehicles."""
    digest = hashlib.blake2b()
    for path in sorted(catalog.package_folder("shapes").glob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()
