"""Builds what has shells but no road wheels: trains on bogies, ships, containers.

The shells and what is fixed to them are those of `box.py`; bogies and pantographs are
written as pieces of the same kind, so that one builder makes both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from sumo3dviz_pt.library.vehicles.build import BakedVehicle, Builder
from sumo3dviz_pt.library.vehicles.heavy.build import build_box
from sumo3dviz_pt.library.vehicles.heavy.recipe import BoxRecipe, read_box
from sumo3dviz_pt.library.vehicles.rail.bogies import (
    bogie_pieces,
    pantograph_pieces,
    read_running_gear,
)
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.lamps import VehicleLamp

_NO_WHEEL = {"radius": 0.4, "width": 0.1}
_OWN_KEYS = frozenset(["bogies", "pantographs", "turned"])
_SWAPPED = {"head": "tail", "tail": "head", "left": "right", "right": "left"}


def read_hull_vehicle(asset: Mapping[str, Any]) -> BoxRecipe:
    """Read the recipe of a vehicle without road wheels.

    Args:
        asset: Content of `asset.yaml`: sizes, and under `recipe` the keys of
            `library/vehicles/heavy/recipe.py` but `wheel` and `axles`, and those of
            `library/vehicles/rail/bogies.py`; `turned` is read by `build_hull_vehicle`.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    own = asset.get("recipe", {})
    rest = {key: value for key, value in own.items() if key not in _OWN_KEYS}
    recipe = read_box({**asset, "recipe": {**rest, "wheel": _NO_WHEEL, "axles": ()}})
    bogies, pantographs = read_running_gear(own)
    gear = [piece for bogie in bogies for piece in bogie_pieces(bogie)]
    gear += [piece for item in pantographs for piece in pantograph_pieces(item)]
    return replace(recipe, pieces=(*recipe.pieces, *gear))


def build_hull_vehicle(asset: Mapping[str, Any]) -> BakedVehicle:
    """Build both levels; the same recipe gives the same meshes.

    With `turned`, the vehicle runs backwards: what was its front is its rear, and what
    were its head lamps are its tail lamps.

    Raises:
        ConfigError: If the recipe is wrong or a lamp lies beside the vehicle.
    """
    recipe = read_hull_vehicle(asset)
    baked = build_box(recipe)
    if not asset.get("recipe", {}).get("turned", False):
        return baked
    parts, far = (
        {name: turned_round(mesh, recipe.length) for name, mesh in level.items()}
        for level in (baked.parts, baked.far)
    )
    lamps = tuple(_turned_lamp(lamp, recipe.length) for lamp in baked.lamps)
    return BakedVehicle(parts, far, lamps)


def turned_round(mesh: Mesh, length: float) -> Mesh:
    """A mesh turned by half a circle about the middle of a length [m]."""
    turn = np.array([-1.0, -1.0, 1.0])
    normals = None if mesh.normals is None else mesh.normals * turn
    moved = mesh.vertices * turn - np.array([length, 0.0, 0.0])
    return replace(mesh, vertices=moved, normals=normals)


def _turned_lamp(lamp: VehicleLamp, length: float) -> VehicleLamp:
    """Likewise, a lamp; it has the role of the end where it now is."""
    x, y, z = lamp.at
    yaw = float(np.pi) - lamp.yaw
    role = _SWAPPED.get(lamp.role, lamp.role)
    return VehicleLamp(role, (-x - length, -y, z), lamp.size, yaw)


HULL = Builder(build_hull_vehicle)
"""Trains, trams, ships and containers."""
