"""Makes the packed bodies of a vehicle asset from its recipe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bakery.build import BakedVehicle, Builder, FullVehicle, builder_of
from bakery.car.build import CAR
from bakery.cycles.build import CYCLE
from bakery.heavy.build import BOX
from bakery.packing import write_levels
from bakery.rail.build import HULL
from sumo3dviz_pt.catalog import digest_of
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.vehicles.packed import BODIES, FULL
from sumo3dviz_pt.library.vehicles.recipe import Meshes, varied
from sumo3dviz_pt.model.geometry import Mesh, area_vectors

_NO_AREA = 1e-9
"""Twice the area of faces that are left out [m2]."""

RECIPES = Path(__file__).with_name("recipes")
"""What vehicles are made from, by name: `recipes/<name>.yaml`."""

_KNOWN = ("stretch", "half_track")
"""What run time needs to know of a recipe, beside the height of a car's dashboard."""

BUILDERS: Mapping[str, Builder] = {"car": CAR, "box": BOX, "cycle": CYCLE, "hull": HULL}
"""By the word that a recipe has under `build`."""


def bake_vehicle(recipe: Mapping[str, Any]) -> BakedVehicle:
    """Build the levels of a vehicle that travel with the package.

    Args:
        recipe: From `completed_recipe`: length, width, height and `recipe`.

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


def full_vehicle(recipe: Mapping[str, Any]) -> FullVehicle | None:
    """Build a vehicle's level for close views, or None if its kind has none.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    full = builder_of(recipe, BUILDERS).full
    return None if full is None else full(recipe)


def bake_folder(folder: Path, recipes: Path = RECIPES) -> tuple[Path, ...]:
    """Write the files of a vehicle folder; the same recipe gives the same bytes.

    Args:
        folder: Holds `asset.yaml`; gets `bodies.xz`, `full.xz` where its kind has full detail, and
            `baked.yaml`, which lists their meshes with lamps, wheels and what else is to be known
            of the body. What `turns` another folder's vehicle round shows the bodies of that one.
        recipes: Holds the recipe under the folder's name.

    Returns:
        The files written.

    Raises:
        ConfigError: If the recipe is wrong; it names the file and the key.
    """
    recipe = completed_recipe(folder, recipes)
    try:
        baked, full = bake_vehicle(recipe), full_vehicle(recipe)
    except ConfigError as error:
        raise ConfigError(str(error), file=_recipe_file(folder, recipes)) from error
    levels = {BODIES: {"parts": baked.parts, "far": baked.far}}
    if full is not None:
        levels[FULL] = {"full": _sorted(full.body), "wheel": _sorted(full.wheel)}
    files = () if "turns" in recipe else tuple(folder / name for name in levels)
    for path in files:
        write_levels(path, levels[path.name])
    for old in set(folder.glob("*.xz")) - set(files):
        old.unlink()
    listing = folder / "baked.yaml"
    made = {level: meshes for some in levels.values() for level, meshes in some.items()}
    text = yaml.safe_dump(_listing(recipe, baked, made), sort_keys=False, width=100)
    listing.write_text(text, encoding="utf-8")
    return (*files, listing)


def _sorted(meshes: Meshes) -> Meshes:
    """Meshes in the order of their materials' names."""
    return dict(sorted(meshes.items()))


def completed_recipe(folder: Path, recipes: Path = RECIPES) -> dict[str, Any]:
    """Return all that a vehicle is made from, completed by the asset which it varies.

    Args:
        folder: Holds `asset.yaml`.
        recipes: Holds what is to stand under `recipe`, unless `asset.yaml` has it, as for bicycles:
            these are built at run time too, because their riders move.
    """
    own: dict[str, Any] = yaml.safe_load((folder / "asset.yaml").read_text(encoding="utf-8"))
    path = recipes / f"{folder.name}.yaml"
    if "recipe" not in own and path.is_file():
        own["recipe"] = yaml.safe_load(path.read_text(encoding="utf-8"))
    if "base" not in own:
        return own
    return varied(completed_recipe(folder.parent / str(own["base"]), recipes), own)


def _recipe_file(folder: Path, recipes: Path) -> Path:
    """Where a vehicle's recipe stands."""
    path = recipes / f"{folder.name}.yaml"
    return path if path.is_file() else folder / "asset.yaml"


def _listing(
    recipe: Mapping[str, Any], baked: BakedVehicle, levels: Mapping[str, Meshes]
) -> dict[str, Any]:
    """What `baked.yaml` says."""
    own = recipe["recipe"]
    known = {key: own[key] for key in _KNOWN if key in own}
    if "cowl" in own:
        known["dash"] = own["cowl"][1]
    return {
        "made_from": digest_of(recipe),
        **known,
        **{
            level: {name: len(m.faces) for name, m in some.items()}
            for level, some in levels.items()
        },
        "lamps": [_plain(asdict(lamp)) for lamp in baked.lamps],
        "wheels": [_plain(asdict(wheel)) for wheel in baked.wheels],
        **({"cabin": [round(value, 4) for value in baked.cabin]} if baked.cabin else {}),
    }


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
