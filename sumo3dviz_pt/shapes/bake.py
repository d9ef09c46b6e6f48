"""Makes the mesh files of a vehicle asset from its recipe."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from sumo3dviz_pt.shapes.car import BakedVehicle, build_car
from sumo3dviz_pt.shapes.car_recipe import read_recipe
from sumo3dviz_pt.shapes.ply import write_ply

_LOG = logging.getLogger(__name__)


def bake_vehicle(recipe: Mapping[str, Any]) -> BakedVehicle:
    """Build the meshes of a vehicle.

    Args:
        recipe: Content of an `asset.yaml`: length, width, height and `recipe`.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    return build_car(read_recipe(recipe))


def bake_folder(folder: Path) -> tuple[Path, ...]:
    """Write the PLY files of a vehicle folder; the same recipe gives the same bytes.

    Args:
        folder: Holds `asset.yaml`; files of the same names are replaced.

    Returns:
        The files written.

    Raises:
        ConfigError: If the recipe is wrong.
    """
    recipe = yaml.safe_load((folder / "asset.yaml").read_text(encoding="utf-8"))
    baked = bake_vehicle(recipe)
    files = []
    for prefix, meshes in (("", baked.parts), ("far_", baked.far)):
        for material, mesh in meshes.items():
            path = folder / f"{prefix}{material}.ply"
            write_ply(path, mesh)
            files.append(path)
    _LOG.info("%s: %d files", folder.name, len(files))
    return tuple(files)
