"""Where a car can shine: flat ellipses just before the lenses that its recipe names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bakery.car.body import CarShape
from bakery.car.conform import land
from bakery.car.recipe import CarRecipe, Points
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import VehicleLamp

_CLEAR = 0.004
"""Distance of a lamp before the body [m]."""

_FARTHEST = 0.022
"""A lamp shrinks until the body at its rim is no farther ahead of its middle than this [m]."""

_SHARE = 0.85
"""Size of a lamp as a share of its piece's."""

_YAW = {"front": 0.0, "rear": np.pi, "side": np.pi / 2}
_NARROW = 0.3
"""Half width up to which a piece in the middle is one lamp; wider ones are two [m]."""

_OUTWARDS = {"turn": 0.9, "head": 0.1}
"""How far lamps at a corner look outwards at most, 0.35 for most [rad]."""

_SIDES = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)


@dataclass(frozen=True, slots=True)
class _LampLens:
    """A piece that can shine: what the recipe says about it.

    Attributes:
        role: One of its roles.
        view: As that of a panel.
        middle: As the points of an outline [m].
        size: Width and height [m].
        level: How far its face lies under the body, at most 0 [m].
    """

    role: str
    view: str
    middle: tuple[float, float]
    size: tuple[float, float]
    level: float


def car_lamps(shape: CarShape) -> tuple[VehicleLamp, ...]:
    """Return all lamps of a car in its body's frame; `turn` becomes `left` and `right`."""
    found: list[VehicleLamp] = []
    for lens in _lenses(shape.recipe):
        lamp = _before(shape, lens)
        left = "left" if lens.role == "turn" else lens.role
        found.append(replace(lamp, role=left))
        x, y, z = lamp.at
        if y != 0.0:
            right = "right" if lens.role == "turn" else lens.role
            found.append(replace(lamp, role=right, at=(x, -y, z), yaw=-lamp.yaw))
    return tuple(found)


def _lenses(recipe: CarRecipe) -> Iterator[_LampLens]:
    """The recipe's pieces with a role."""
    for panel in recipe.panels:
        middle, size = _extent(panel.view, panel.outline, 0.0)
        for role in panel.role:
            yield _LampLens(role, panel.view, middle, size, -panel.recess)
    for strip in recipe.strips:
        middle, size = _extent(strip.view, strip.path, strip.width)
        for role in strip.role:
            yield _LampLens(role, strip.view, middle, size, min(strip.height, 0.0))
    for disc in recipe.discs:
        size = (1.5 * disc.radius, 1.5 * disc.radius)
        for role in disc.role:
            yield _LampLens(role, disc.view, disc.at, size, min(disc.height, 0.0))


def _extent(
    view: str, line: Points, width: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Middle and size of a line with a width [m]."""
    low, high = np.min(line, axis=0), np.max(line, axis=0)
    if low[0] < 1e-6 and view != "side" and high[0] < _NARROW:
        low = low * [0.0, 1.0] - high * [1.0, 0.0]
    size = _SHARE * np.maximum(high - low, width)
    middle = (low + high) / 2
    return (float(middle[0]), float(middle[1])), (float(size[0]), float(size[1]))


def _before(shape: CarShape, lens: _LampLens) -> VehicleLamp:
    """An ellipse that clears the body and stays close to it."""
    spot = land(shape, lens.view, [lens.middle])
    place, normal = spot.points[0], spot.normals[0]
    yaw = _YAW[lens.view]
    if lens.view != "side" and abs(lens.middle[0]) > 1e-6:
        # Corner lamps look a little outwards, as their lenses do.
        turn = np.arctan2(normal[1], abs(normal[0]))
        turn = float(np.clip(turn, 0.0, _OUTWARDS.get(lens.role, 0.35)))
        yaw = turn if lens.view == "front" else np.pi - turn
    way = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    size = lens.size
    for _ in range(12):
        ahead = float(((_rim(shape, lens.view, lens.middle, size) - place) @ way).max())
        if ahead <= _FARTHEST:
            break
        size = (0.85 * size[0], 0.85 * size[1])
    x, y, z = place + (max(ahead, 0.0) + _CLEAR) * way + lens.level * normal
    central = lens.view != "side" and abs(lens.middle[0]) < 1e-6
    return VehicleLamp(lens.role, (float(x), 0.0 if central else float(y), float(z)), size, yaw)


def _rim(
    shape: CarShape, view: str, middle: tuple[float, float], size: tuple[float, float]
) -> Floats:
    """The body at the rim of an ellipse, (n, 3) [m]."""
    ring = np.stack([size[0] * np.cos(_SIDES), size[1] * np.sin(_SIDES)], axis=1) / 2
    return land(shape, view, np.asarray(middle) + ring).points
