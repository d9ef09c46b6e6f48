"""Where a car can shine: flat ellipses just before the lenses that its recipe names."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import VehicleLamp
from sumo3dviz_pt.shapes.car_body import CarShape
from sumo3dviz_pt.shapes.car_conform import land
from sumo3dviz_pt.shapes.car_recipe import CarRecipe

_CLEAR = 0.004
_FARTHEST = 0.022
_YAW = {"front": 0.0, "rear": np.pi, "side": np.pi / 2}
_SIDES = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)

Spot = tuple[str, str, tuple[float, float], tuple[float, float]]
"""Role, view, middle as in an outline, width and height [m]."""


def car_lamps(shape: CarShape) -> tuple[VehicleLamp, ...]:
    """All lamps of a car in its body's frame; `turn` becomes `left` and `right`."""
    found: list[VehicleLamp] = []
    for role, view, middle, size in _spots(shape.recipe):
        at, size, yaw = _before(shape, view, middle, size)
        left = "left" if role == "turn" else role
        found.append(VehicleLamp(left, at, size, yaw))
        if abs(at[1]) > 1e-6:
            right = "right" if role == "turn" else role
            found.append(VehicleLamp(right, (at[0], -at[1], at[2]), size, -yaw))
    return tuple(found)


def _spots(recipe: CarRecipe) -> Iterator[Spot]:
    """Where the recipe's pieces with a role lie."""
    for piece in (*recipe.panels, *recipe.strips):
        line = piece.outline if hasattr(piece, "outline") else piece.path
        low, high = np.min(line, axis=0), np.max(line, axis=0)
        if low[0] < 1e-6 and piece.view != "side":
            low = high * [-1.0, 0.0] + low * [0.0, 1.0]
        thick = 0.0 if hasattr(piece, "outline") else piece.width
        size = (float(high[0] - low[0]) or thick, float(high[1] - low[1]) or thick)
        middle = (float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2)
        for role in piece.role:
            yield role, piece.view, middle, (0.85 * size[0], 0.85 * max(size[1], thick))
    for disc in recipe.discs:
        for role in disc.role:
            wide = 1.5 * disc.radius
            yield role, disc.view, disc.at, (wide, wide)


def _before(
    shape: CarShape, view: str, middle: tuple[float, float], size: tuple[float, float]
) -> tuple[tuple[float, float, float], tuple[float, float], float]:
    """Place, size and yaw of an ellipse that clears the body and stays close to it."""
    spot = land(shape, view, [middle])
    yaw = _YAW[view]
    if view != "side" and abs(middle[0]) > 1e-6:
        # Corner lamps look a little outwards, as their lenses do.
        turn = np.arctan2(spot.normals[0, 1], abs(spot.normals[0, 0]))
        yaw = np.clip(turn, 0.0, 0.35) if view == "front" else np.pi - np.clip(turn, 0.0, 0.35)
    way = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    for _ in range(12):
        ahead = float(((_rim(shape, view, middle, size) - spot.points[0]) @ way).max())
        if ahead <= _FARTHEST:
            break
        size = (0.85 * size[0], 0.85 * size[1])
    x, y, z = spot.points[0] + (max(ahead, 0.0) + _CLEAR) * way
    return (
        (float(x), float(y) if abs(middle[0]) > 1e-6 or view == "side" else 0.0, float(z)),
        (size),
        float(yaw),
    )


def _rim(
    shape: CarShape, view: str, middle: tuple[float, float], size: tuple[float, float]
) -> Floats:
    """The body at the rim of an ellipse, (n, 3) [m]."""
    ring = np.stack([size[0] * np.cos(_SIDES), size[1] * np.sin(_SIDES)], axis=1) / 2
    return land(shape, view, np.asarray(middle) + ring).points
