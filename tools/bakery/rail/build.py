"""Builds what has shells but no road wheels: trains on bogies, ships, containers.

The shells and what is fixed to them are those of heavy vehicles; bogies and pantographs are
written as pieces of the same kind, so that one builder makes both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bakery.build import BakedVehicle, Builder, with_sizes
from bakery.heavy.build import build_box
from bakery.heavy.recipe import Axle, BoxRecipe, HeavyWheel
from bakery.rail.bogies import Bogie, Pantograph, bogie_pieces, pantograph_pieces
from sumo3dviz_pt.library.vehicles.recipe import read_value
from sumo3dviz_pt.library.vehicles.stretching import turned_round
from sumo3dviz_pt.model.scene import VehicleLamp

_NO_WHEEL = HeavyWheel(0.4, 0.1)

_OTHER_END = {"head": "tail", "tail": "head", "left": "right", "right": "left"}
"""Roles of lamps on a vehicle that runs backwards."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HullRecipe(BoxRecipe):
    """A vehicle without road wheels.

    Attributes:
        wheel: Of no use where there are no axles.
        axles: None.
        bogies: Of a rail vehicle.
        pantographs: Of a rail vehicle.
        turned: Whether it runs backwards: what was its front is its rear, and what were its
            head lamps are its tail lamps.
    """

    wheel: HeavyWheel = _NO_WHEEL
    axles: tuple[Axle, ...] = ()
    bogies: tuple[Bogie, ...] = ()
    pantographs: tuple[Pantograph, ...] = ()
    turned: bool = False


def read_hull_vehicle(asset: Mapping[str, Any]) -> HullRecipe:
    """Read the recipe of a vehicle without road wheels; its running gear becomes pieces.

    Args:
        asset: Content of `asset.yaml`: sizes, and the rest under `recipe`.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    recipe = read_value(HullRecipe, with_sizes(asset))
    gear = [piece for bogie in recipe.bogies for piece in bogie_pieces(bogie)]
    gear += [piece for item in recipe.pantographs for piece in pantograph_pieces(item)]
    return replace(recipe, pieces=(*recipe.pieces, *gear))


def build_hull_vehicle(asset: Mapping[str, Any]) -> BakedVehicle:
    """Build both levels; the same recipe gives the same meshes.

    Args:
        asset: As in `read_hull_vehicle`.

    Raises:
        ConfigError: If the recipe is wrong or a lamp lies beside the vehicle.
    """
    recipe = read_hull_vehicle(asset)
    baked = build_box(recipe)
    if not recipe.turned:
        return baked
    parts, far = (
        {name: turned_round(mesh, recipe.length) for name, mesh in level.items()}
        for level in (baked.parts, baked.far)
    )
    lamps = tuple(_turned_lamp(lamp, recipe.length) for lamp in baked.lamps)
    return BakedVehicle(parts, far, lamps)


def _turned_lamp(lamp: VehicleLamp, length: float) -> VehicleLamp:
    """A lamp turned as in `turned_round`; it has the role of the end where it now is."""
    x, y, z = lamp.at
    yaw = float(np.pi) - lamp.yaw
    role = _OTHER_END.get(lamp.role, lamp.role)
    return VehicleLamp(role, (-x - length, -y, z), lamp.size, yaw)


HULL = Builder(build_hull_vehicle)
"""Trains, trams, ships and containers."""
