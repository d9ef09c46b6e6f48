"""Cameras that must keep a clear view: nothing grows into them or in front of them.

Trees, houses and street furniture that a scenario does not contain keep clear of cameras.
All cameras of a scene file count in each of its shots, so that every shot, and the viewer,
shows the same world. Cameras that ride do not count: nothing stands where vehicles drive.
Nothing is cleared for a camera that was found by walking through the scene: it shows what
was seen then.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Bools, Floats, settled

KEEP_CLEAR = 1.0
"""Distance that objects keep from cameras [m]."""

_LENS, _AXIS = 14.0, 32.0
"""What stands nearer than this before a camera fills much of its picture: anywhere in the
picture, and in its middle [m]."""

_MIDDLE = np.radians(7.0)  # half the angle of a picture's middle
_LOWER = 0.25  # things whose tops stay below this share of the picture's half height do not hide

_ROOM, _REACH = 3.0, 60.0
"""What stands no nearer than the one to an axis that is above heads does not hang before the lens;
up to the other along it [m]."""

_FILLS = 0.02
"""Nothing that stands nearer than `_LENS` fills more than this share of a picture."""

_FRAME = 4.0 * (9.0 / 16.0) / (1.0 + (9.0 / 16.0) ** 2)
"""Area of a picture of 16:9, by the square of half its diagonal."""

_STAYS = 60.0
"""A camera that moves less shows one place only [m]."""


@dataclass(frozen=True, eq=False)
class Clearance:
    """Cameras that nothing grows into or before.

    Attributes:
        ways: Where each camera is and looks, over its whole way.
    """

    ways: tuple[CameraPath, ...] = ()

    @cached_property
    def places(self) -> Floats:
        """Where cameras are, (n, 3) [m]."""
        return np.concatenate([np.zeros((0, 3)), *(way.positions for way in self.ways)])

    @cached_property
    def tracks(self) -> NDArray[shapely.Geometry]:
        """The ways in plan, as lines, (n,) [m]."""
        lines = [np.repeat(way.positions[:, :2], 2, axis=0) for way in self.ways]
        return np.array([shapely.LineString(line) for line in lines], dtype=object)

    def distances(self, places: Floats) -> Floats:
        """Return the distance in plan of places, (k, 2) [m], to the nearest camera, (k,) [m].

        It is infinite without cameras.
        """
        if not self.ways:
            return np.full(len(places), np.inf)
        away, _ = cKDTree(self.places[:, :2]).query(places)
        return settled(away)

    @cached_property
    def outlooks(self) -> tuple[CameraPath, ...]:
        """The ways of cameras that stay: what they look at must not be hidden."""
        return tuple(w for w in self.ways if np.ptp(w.positions[:, :2], axis=0).max() <= _STAYS)

    def before_lens(self, places: Floats, ground: Floats, *, height: float, reach: float) -> Bools:
        """Return which upright things would stand right before a camera, (k,).

        Args:
            places: Of the things, (k, 2) [m].
            ground: Height of the ground there, (k,) [m].
            height: Of the things [m].
            reach: How far parts of them stand out, such as a lamp's arm [m].
        """
        hides = np.zeros(len(places), dtype=np.bool_)
        for way in self.ways:
            towards = places[:, None] - way.positions[None, :, :2]
            away = settled(np.maximum(np.hypot(towards[..., 0], towards[..., 1]), 1e-6))
            flat = np.maximum(np.hypot(way.forwards[:, 0], way.forwards[:, 1]), 1e-6)
            cosine = (towards * way.forwards[:, :2]).sum(axis=-1) / (away * flat)
            aside = np.arccos(np.clip(cosine, -1.0, 1.0))
            # Compare the top with the lower part of the picture.
            lowest = np.arctan2(way.forwards[:, 2], flat) - _LOWER * way.half_angles
            top = np.arctan2(ground[:, None] + height - way.positions[:, 2], away)
            wide = np.arctan2(reach, away)
            pictured = settled(aside - wide - way.half_angles) < 0.0
            middle = settled(aside - _MIDDLE) < 0.0
            seen = ((away < _LENS) & pictured) | ((away < _AXIS) & middle)
            seen &= settled(top - lowest) > 0.0
            seen |= _beside_axis(way, towards, ground, height=height, reach=reach)
            seen &= way.half_angles < np.pi / 2.0  # others have no picture
            hides |= seen.any(axis=1)
        return hides

    def filled(self, places: Floats, ground: Floats, *, height: float, radius: float) -> Bools:
        """Return which upright things, low ones too, would fill much of a picture, (k,).

        Args:
            places: Of the things, (k, 2) [m].
            ground: Height of the ground there, (k,) [m].
            height: Of the things [m].
            radius: Half of how wide they are [m].
        """
        fills = np.zeros(len(places), dtype=np.bool_)
        for way in self.ways:
            near = way.half_angles < np.pi / 2.0  # others have no picture
            share = shares(way, places, ground, height=height, radius=radius)
            fills |= (settled(share - _FILLS) > 0.0)[:, near].any(axis=1)
        return fills


def shares(
    way: CameraPath,
    places: Floats,
    ground: Floats,
    *,
    height: float | Floats,
    radius: float | Floats,
) -> Floats:
    """Return which shares of pictures upright things near the lens fill, (k, n).

    Args:
        way: Where a camera is and looks at n times.
        places: Of the things, (k, 2) [m].
        ground: Height of the ground there, (k,) [m].
        height: Of the things, one or (k, 1) [m].
        radius: Half of how wide they are, one or (k, 1) [m].
    """
    towards = places[:, None] - way.positions[None, :, :2]
    away = np.maximum(np.hypot(towards[..., 0], towards[..., 1]), np.maximum(radius, 0.3))
    flat = np.maximum(np.hypot(way.forwards[:, 0], way.forwards[:, 1]), 1e-6)
    cosine = (towards * way.forwards[:, :2]).sum(axis=-1) / (away * flat)
    aside = np.arccos(np.clip(cosine, -1.0, 1.0)) - np.arctan2(radius, away)
    # What reaches over the lower or upper border of the picture fills no more of it.
    half = np.tan(np.minimum(way.half_angles, 1.4))
    upper = half * np.sin(np.arctan(9.0 / 16.0))
    level = np.arctan2(way.forwards[:, 2], flat)
    edges = []
    for z in (ground[:, None], ground[:, None] + height):
        rise = np.arctan2(z - way.positions[:, 2], away) - level
        edges.append(np.clip(np.tan(np.clip(rise, -1.4, 1.4)), -upper, upper))
    share = 2.0 * radius / away * (edges[1] - edges[0]) / (_FRAME * half**2)
    pictured = (away < _LENS) & (aside < way.half_angles)
    return np.asarray(np.where(pictured, share, 0.0))


def _beside_axis(
    way: CameraPath, towards: Floats, ground: Floats, *, height: float, reach: float
) -> Bools:
    """Which upright things come near the axes of cameras, where those are above heads, (k, n).

    Args:
        way: Where a camera is and looks at n times.
        towards: Plan vectors from it to the things, (k, n, 2) [m].
        ground: Height of the ground at the things, (k,) [m].
        height: Of the things [m].
        reach: How far parts of them stand out [m].
    """
    flat = np.maximum(np.hypot(way.forwards[:, 0], way.forwards[:, 1]), 1e-6)
    ahead = way.forwards[:, :2] / flat[:, None]
    along = (towards * ahead).sum(axis=-1)
    aside = np.abs(towards[..., 0] * ahead[:, 1] - towards[..., 1] * ahead[:, 0])
    # A pole that stands beside the axis reaches up to it or nearly.
    axis = way.positions[:, 2] + along * way.forwards[:, 2] / flat - ground[:, None]
    near = (settled(aside) < _ROOM + reach) & (settled(along) > 0.0) & (settled(along) < _REACH)
    return np.asarray(near & (settled(axis) > _ROOM) & (settled(axis) < height + _ROOM))
