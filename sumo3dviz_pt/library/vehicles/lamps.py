"""Places the lamps of a vehicle on the surface that was built."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.lamps import VehicleLamp

_BEFORE = 0.004
_PROBED = 0.3  # of a lamp's size, to either side of its middle
_OTHER_SIDE = {"left": "right", "right": "left"}

End = Literal["front", "rear"]
"""End of a vehicle."""


@dataclass(frozen=True, slots=True)
class LampSpot(RecipeValue):
    """A lamp's place on the finished vehicle.

    Attributes:
        role: What lights it; one at y > 0 that is `left` is `right` on the other side.
        view: `front` or `rear`: where it shines.
        at: (y, z) of its middle [m]; a lamp away from the middle has a twin.
        size: Its width and height [m].
    """

    role: str
    view: End
    at: tuple[float, float]
    size: tuple[float, float]


def find_lamps(spots: Iterable[LampSpot], meshes: Iterable[Mesh]) -> Iterator[VehicleLamp]:
    """Place lamps a few millimetres before what a ray along the vehicle meets first.

    Args:
        spots: From the recipe.
        meshes: The whole vehicle in the body's frame.

    Raises:
        ConfigError: If there is nothing behind a lamp.
    """
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes])
    for number, spot in enumerate(spots):
        sides = (1.0, -1.0) if abs(spot.at[0]) > 0.02 else (1.0,)
        for side in sides:
            y, z = side * spot.at[0], spot.at[1]
            x = _foremost(corners, (y, z), spot)
            if not np.isfinite(x):
                raise ConfigError("lies beside the vehicle", key=f"recipe.lamps[{number}]")
            role = spot.role if y * spot.at[0] >= 0.0 else _OTHER_SIDE.get(spot.role, spot.role)
            yaw = 0.0 if spot.view == "front" else float(np.pi)
            x += _BEFORE if spot.view == "front" else -_BEFORE
            yield VehicleLamp(role, (x, y, z), spot.size, yaw)


def _foremost(corners: Floats, at: tuple[float, float], spot: LampSpot) -> float:
    """Foremost x of a surface behind a flat lamp [m]; not a number beside the vehicle."""
    front = spot.view == "front"
    if not np.isfinite(_surface(corners, *at, front=front)):
        return float("nan")
    width, height = (_PROBED * size for size in spot.size)
    shifts = ((0.0, 0.0), (width, 0.0), (-width, 0.0), (0.0, height), (0.0, -height))
    found = [_surface(corners, at[0] + dy, at[1] + dz, front=front) for dy, dz in shifts]
    return float(np.nanmax(found) if front else np.nanmin(found))


def _surface(corners: Floats, y: float, z: float, *, front: bool) -> float:
    """Where (x) a ray along the vehicle first meets one of its faces, (m, 3, 3) [m]."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    (ay, az), (by, bz), (cy, cz) = a[:, 1:].T, b[:, 1:].T, c[:, 1:].T
    area = (by - ay) * (cz - az) - (bz - az) * (cy - ay)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = ((y - ay) * (cz - az) - (z - az) * (cy - ay)) / area
        v = ((by - ay) * (z - az) - (bz - az) * (y - ay)) / area
        hit = (np.abs(area) > 1e-10) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
        x = a[:, 0] + u * (b[:, 0] - a[:, 0]) + v * (c[:, 0] - a[:, 0])
    if not hit.any():
        return float("nan")
    return float(x[hit].max() if front else x[hit].min())
