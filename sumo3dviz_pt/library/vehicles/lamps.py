"""Lamps of a vehicle: where they are on its surface, and the beam of the head lamps.

They are placed on the surface that was built. The low beam is a map of luminous intensity. Only its
upper edge is sharp. To the sides it fades over tens of degrees. Downwards it falls so fast that the
road gets about 10 to 15 lx from 2 to 10 m ahead, and less nearer to the car.

References:
    UN Regulation No. 112, class B, tables of the passing beam: the limits at the points that
    tests/unit/library/vehicles/test_beam.py checks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.model.geometry import Floats, Image, Mesh
from sumo3dviz_pt.model.scene import VehicleLamp

PEAK = 18_000.0
"""Largest intensity of one lamp [cd]: usual for halogen and LED lamps on the market."""

HALF_ANGLE = float(np.radians(52.0))
"""From straight ahead to the map's edge [rad]."""

_FADE = (34.0, 51.0)
"""Between these angles from straight ahead all light fades out [deg]."""

_CUTOFF = -0.57
"""Below straight ahead: one per cent [deg]."""


def low_beam(across: Floats, up: Floats) -> Floats:
    """Return the luminous intensity of one lamp in right-hand traffic.

    Args:
        across: Angles to the right of straight ahead [deg].
        up: Angles above straight ahead, of the same shape [deg].

    Returns:
        [cd], of that shape.
    """
    rise = np.clip(across * np.tan(np.radians(15.0)), 0.0, 2.0)
    below = _CUTOFF + rise - up
    edge = smoothstep(0.0, 0.25, below)
    deep = np.maximum(below, 0.0)
    depth = 0.8 * np.exp(-deep / 2.2) + 0.2 * np.exp(-deep / 5.0)
    spread = 0.6 * np.exp(-((across / 7.0) ** 2)) + 0.4 * np.exp(-((across / 26.0) ** 2))
    # Less light goes to the left, where oncoming drivers sit.
    shielded = 1.0 - 0.42 / (1.0 + np.exp((across + 1.5) / 0.5))
    stray = 170.0 * np.exp(-np.abs(below) / 5.0) * np.exp(-((across / 26.0) ** 2))
    return np.asarray((PEAK * edge * depth * spread * shielded + stray) * _faded(across, up))


def beam_pattern(size: int = 1024, *, left_hand: bool = False) -> Image:
    """Return the beam as a share of its peak on a grid of equal steps of the angles' tangents.

    Args:
        size: Rows and columns; rows from above to below, columns from left to right.
        left_hand: Whether oncoming traffic is on the right.

    Returns:
        (size, size), in [0, 1].
    """
    edge = np.tan(HALF_ANGLE)
    steps = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    right, high = np.meshgrid(edge * steps, -edge * steps)
    across = np.degrees(np.arctan(right))
    up = np.degrees(np.arctan2(high, np.hypot(1.0, right)))
    pattern = low_beam(-across if left_hand else across, up) / PEAK
    return np.asarray(pattern, dtype=np.float32)


def _faded(across: Floats, up: Floats) -> Floats:
    """How much of the light is left at an angle from straight ahead, [0, 1]."""
    cosine = np.cos(np.radians(across)) * np.cos(np.radians(up))
    low, high = _FADE
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return 1.0 - smoothstep(low, high, angle)


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
    depths = [_surface(corners, at[0] + dy, at[1] + dz, front=front) for dy, dz in shifts]
    return float(np.nanmax(depths) if front else np.nanmin(depths))


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
