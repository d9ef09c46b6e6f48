"""Makes the mesh files of a vehicle asset from its recipe."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.mesh.ply import write_ply
from sumo3dviz_pt.library.vehicles.build import (
    BakedVehicle,
    Builder,
    FullVehicle,
    Meshes,
    builder_of,
)
from sumo3dviz_pt.library.vehicles.car.build import CAR
from sumo3dviz_pt.library.vehicles.cycles.build import CYCLE
from sumo3dviz_pt.library.vehicles.heavy.build import BOX
from sumo3dviz_pt.library.vehicles.rail.build import HULL
from sumo3dviz_pt.library.vehicles.variant import varied
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.vectors import area_vectors

_LOG = logging.getLogger(__name__)

_NO_AREA = 1e-9
"""Twice the area of faces that are left out [m2]."""

BUILDERS: Mapping[str, Builder] = {"car": CAR, "box": BOX, "cycle": CYCLE, "hull": HULL}
"""By the word that a recipe has under `build`."""


def bake_vehicle(recipe: Mapping[str, Any]) -> BakedVehicle:
    """Build the levels of a vehicle that travel with the package.

    Args:
        recipe: Content of an `asset.yaml`: length, width, height and `recipe`.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    made = builder_of(recipe, BUILDERS).bake(recipe)
    return replace(made, parts=_with_area(made.parts), far=_with_area(made.far))


def _with_area(meshes: Meshes) -> Meshes:
    """Meshes without the faces that lost their area on the grid of `settled`."""

    def kept(mesh: Mesh) -> Mesh:
        solid = np.linalg.norm(area_vectors(mesh.vertices, mesh.faces), axis=1) > _NO_AREA
        if solid.all():
            return mesh
        used, places = np.unique(mesh.faces[solid], return_inverse=True)
        normals = None if mesh.normals is None else mesh.normals[used]
        return Mesh(mesh.vertices[used], places.reshape(-1, 3), normals)

    return {material: kept(mesh) for material, mesh in meshes.items()}


def has_full_detail(recipe: Mapping[str, Any]) -> bool:
    """Return whether vehicles of this kind have a level for close views."""
    return "units" not in recipe and builder_of(recipe, BUILDERS).full is not None


def full_vehicle(recipe: Mapping[str, Any]) -> FullVehicle | None:
    """Build a vehicle's level for close views, or None if its kind has none.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    full = builder_of(recipe, BUILDERS).full
    return None if full is None else full(recipe)


def bake_folder(folder: Path) -> tuple[Path, ...]:
    """Write the files of a vehicle folder; the same recipe gives the same bytes.

    Args:
        folder: Holds `asset.yaml`; gets `<material>.ply`, `far_<material>.ply` and
            `baked.yaml`, which lists them with lamps and wheels. Others go. What `turns`
            another folder's vehicle round lists the files of that one.

    Returns:
        The files written.

    Raises:
        ConfigError: If the recipe is wrong; it names the file and the key.
    """
    recipe = completed_recipe(folder)
    try:
        baked = bake_vehicle(recipe)
    except ConfigError as error:
        raise ConfigError(str(error), file=folder / "asset.yaml") from error
    files = () if "turns" in recipe else _write_meshes(folder, baked)
    for old in set(folder.glob("*.ply")) - set(files):
        old.unlink()
    listing = folder / "baked.yaml"
    source = f"../{recipe['turns']}/" if "turns" in recipe else ""
    content = {"made_from": digest_of(recipe), **_listing(baked, source)}
    text = yaml.safe_dump(content, sort_keys=False)
    listing.write_text(text, encoding="utf-8")
    _LOG.info("%s: %d files", folder.name, len(files))
    return (*files, listing)


def _write_meshes(folder: Path, baked: BakedVehicle) -> tuple[Path, ...]:
    """Write both levels of a vehicle."""
    files = []
    for prefix, meshes in (("", baked.parts), ("far_", baked.far)):
        for material, mesh in meshes.items():
            path = folder / f"{prefix}{material}.ply"
            write_ply(path, mesh)
            files.append(path)
    return tuple(files)


def completed_recipe(folder: Path) -> dict[str, Any]:
    """Return a folder's recipe, completed by that of the asset which it varies."""
    own: dict[str, Any] = yaml.safe_load((folder / "asset.yaml").read_text(encoding="utf-8"))
    if "base" not in own:
        return own
    return varied(completed_recipe(folder.parent / str(own["base"])), own)


def digest_of(recipe: Mapping[str, Any]) -> str:
    """Return the digest of a completed recipe: `made_from` in `baked.yaml`.

    Where it differs, the recipe was changed after the files were made.
    """
    text = json.dumps(recipe, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _listing(baked: BakedVehicle, source: str) -> dict[str, Any]:
    """What `baked.yaml` says: meshes with materials and triangles, lamps, wheels."""
    return {
        "parts": [_entry(source, name, mesh.faces) for name, mesh in baked.parts.items()],
        "far": [_entry(f"{source}far_", name, mesh.faces) for name, mesh in baked.far.items()],
        "lamps": [_plain(asdict(lamp)) for lamp in baked.lamps],
        "wheels": [_plain(asdict(wheel)) for wheel in baked.wheels],
    }


def _entry(prefix: str, material: str, faces: Any) -> dict[str, Any]:
    """One mesh file."""
    return {"mesh": f"{prefix}{material}.ply", "material": material, "triangles": len(faces)}


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values as YAML writes them best: lists of numbers rounded to a tenth of a millimetre."""
    return {
        key: [round(float(item), 4) for item in value]
        if isinstance(value, tuple)
        else round(value, 4)
        if isinstance(value, float)
        else value
        for key, value in values.items()
    }
