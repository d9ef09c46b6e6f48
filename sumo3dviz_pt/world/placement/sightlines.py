"""Whether something would stand in a camera, or hide the roads that one looks at.

Houses and hedges are judged by their plans before cameras that stay; plants by the pictures of
all cameras that keep their view clear, those that fly too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Bools, Floats, settled, unit
from sumo3dviz_pt.world.objects.kinds import Space
from sumo3dviz_pt.world.placement.clearance import KEEP_CLEAR, Clearance
from sumo3dviz_pt.world.placement.lanes import LaneIndex
from sumo3dviz_pt.world.placement.surroundings import Surroundings

_FARTHEST = 110.0  # up to this distance roads must stay in sight [m]
_MOST = 0.12  # which share of them may be hidden by one thing
_ROOM = 2.0  # walls may stand out this far from their plan, for example balconies [m]

MIDDLE = 1.0 / 8.0
"""No plant fills more than this share of the middle of a picture, half as wide and high: a tree
within about 40 m there."""

VEILS = 0.03
"""No plant hides more than this share of the roads in a picture; of those in its middle that are
near, none hides anything, for a wood hides a road by trees that hide little each."""

_NEAR, _FILLS = 14.0, 0.03  # nothing nearer [m] fills a larger share of a picture
_GAP = 1.4  # between crowns and cameras [m]
_REACH = 90.0  # plants farther away hide less [m]
_CLOSE = 60.0  # roads that are nearer are what a picture shows [m]
_LEAST = 0.03  # a camera that shows less of roads looks at something else
_RAYS = (24, 14)  # of a picture, across and down
_POSES = 24  # that stand for a way


TREE, SHRUB = Space(4.6, 1.5, 12.5), Space(1.5, 0.0, 2.5)
"""What plants of a kind usually fill."""


def in_the_way(places: Floats, around: Surroundings, *, crown: Space) -> Bools:
    """Return at which places, (n, 2) [m], plants would spoil the view of a camera, (n,).

    They would stand right before its lens, fill much of the middle of its picture, or hide many of
    the roads that it shows.

    Args:
        places: Of the plants.
        around: Roads, ground and cameras.
        crown: The plants' size.
    """
    spoils = np.zeros(len(places), dtype=np.bool_)
    clearance = around.clearance
    near = np.flatnonzero(clearance.distances(places) < _REACH)
    if not len(near):
        return spoils
    some, ground = places[near], around.height_at(places[near])
    gone = clearance.distances(some) < crown.radius + _GAP
    gone |= clearance.before_lens(some, ground, height=crown.top, reach=crown.radius)
    feet = np.column_stack([some, ground])
    for sight in around.memory.of(("sights",), partial(_sights, clearance, around.index)):
        gone |= sight.spoilt_by(feet, crown)
    spoils[near] = gone
    return spoils


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """What a camera sees at a moment, as rays.

    Attributes:
        eye: (3,) [m].
        rays: Unit directions all over the picture, (r, 3).
        middle: Which of them are in its middle, (r,).
        roads: Distance along them to roads, (r,) [m]; 0 where there is none.
    """

    eye: Floats
    rays: Floats
    middle: Bools
    roads: Floats

    def spoilt_by(self, feet: Floats, crown: Space) -> Bools:
        """Return which plants at feet, (n, 3) [m], fill or hide too much, (n,)."""
        # Squeezed along z, crowns are balls.
        squeeze = np.array([1.0, 1.0, 2.0 * crown.radius / (crown.top - crown.bottom)])
        middle = np.array([0.0, 0.0, 0.5 * (crown.bottom + crown.top)])
        towards, rays = (feet + middle - self.eye) * squeeze, self.rays * squeeze
        stretch = np.linalg.norm(rays, axis=1)
        along = towards @ (rays / stretch[:, None]).T
        aside = (towards**2).sum(axis=1)[:, None] - along**2
        hit = (settled(aside - crown.radius**2) < 0.0) & (settled(along) > 0.0)
        veiled = hit & (settled(along - self.roads * stretch) < 0.0)
        spoilt = hit[:, self.middle].mean(axis=1) > MIDDLE
        away = np.linalg.norm(feet[:, :2] - self.eye[:2], axis=1) - crown.radius
        spoilt |= (settled(away - _NEAR) < 0.0) & (hit.mean(axis=1) > _FILLS)
        near = self.middle & (self.roads < _CLOSE)
        spoilt |= veiled[:, near].any(axis=1)
        seen = int((self.roads > 0.0).sum())
        if seen > _LEAST * len(self.roads):
            spoilt |= veiled.sum(axis=1) > VEILS * seen
        return np.asarray(spoilt)


def _sights(clearance: Clearance, index: LaneIndex) -> tuple[_Sight, ...]:
    """What cameras see that keep their view clear, all along their ways."""
    sights = []
    for way in clearance.ways:
        many = len(way.positions)
        some = np.unique(np.linspace(0, many - 1, min(many, _POSES)).round().astype(np.int64))
        for eye, ahead, half in zip(
            way.positions[some], way.forwards[some], way.half_angles[some], strict=True
        ):
            if half < np.pi / 2.0:  # others have no picture
                sights.append(_sight(eye, ahead, float(half), index))
    return tuple(sights)


def _sight(eye: Floats, ahead: Floats, half: float, index: LaneIndex) -> _Sight:
    """What a camera sees that has an opening angle, half the diagonal [rad]."""
    across, down = (2.0 * (np.arange(n) + 0.5) / n - 1.0 for n in _RAYS)
    x, y = (grid.ravel() for grid in np.meshgrid(across, down))
    flat = np.array([-ahead[1], ahead[0], 0.0])
    left = unit(flat) if np.hypot(*flat[:2]) > 1e-9 else np.array([0.0, 1.0, 0.0])
    size = np.tan(min(half, 1.4)) * np.array([16.0, 9.0]) / np.hypot(16.0, 9.0)
    up = np.cross(ahead, left)
    rays = unit(ahead - size[0] * x[:, None] * left + size[1] * y[:, None] * up)
    middle = (np.abs(x) < 0.5) & (np.abs(y) < 0.5)
    return _Sight(eye, rays, middle, _roads_along(eye, rays, index))


def _roads_along(eye: Floats, rays: Floats, index: LaneIndex) -> Floats:
    """Distance along rays to roads, (r,) [m]; 0 where there is none near."""
    level = index.heights(eye[None, :2])
    for _ in range(3):
        # Where the land rises or falls, the road is found in steps.
        away = np.minimum((level - eye[2]) / np.minimum(rays[:, 2], -1e-6), 2.0 * _FARTHEST)
        places = eye + away[:, None] * rays
        level = index.heights(places[:, :2])
    seen = (settled(away - _FARTHEST) < 0.0) & (away > 0.0)
    seen[seen] = index.covers(places[seen, :2])
    return np.where(seen, away, 0.0)


def hides(area: shapely.Polygon, around: Surroundings, *, over: float = np.inf) -> bool:
    """Return whether something stands in a camera, or before much of what a resting one looks at.

    Args:
        area: Its outline [m].
        around: Roads and cameras.
        over: Cameras higher than this above the roads look over it [m].
    """
    wide = area.buffer(KEEP_CLEAR + _ROOM)
    if shapely.intersects(around.clearance.tracks, wide).any():
        return True
    return any(
        _share(area, outlook, around) > _MOST
        for outlook in around.clearance.outlooks
        if _above_roads(outlook, around) <= over
    )


def _above_roads(outlook: CameraPath, around: Surroundings) -> float:
    """How high above the roads near it a resting camera stands [m]."""
    eye = outlook.positions[0]
    return float(eye[2] - around.index.heights(eye[None, :2])[0])


def _share(area: shapely.Polygon, outlook: CameraPath, around: Surroundings) -> float:
    """Which share of the roads that a camera looks at an area hides."""
    eye = outlook.positions[0, :2]
    if area.distance(shapely.Point(eye)) > _FARTHEST:
        return 0.0
    points = around.index.points[:, :2]
    away = np.hypot(*(points - eye).T)
    seen = points[(away < _FARTHEST) & (away > 3.0)]
    seen = seen[around.pictured(seen, radius=1.0, by=outlook)]
    if not len(seen):
        return 0.0
    rays = shapely.linestrings(np.stack([np.broadcast_to(eye, seen.shape), seen], axis=1))
    return float(shapely.intersects(rays, area).mean())
