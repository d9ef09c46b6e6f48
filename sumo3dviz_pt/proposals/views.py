"""Proposes the cameras that stand or fly: an overview, a corner and a flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, unit
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.proposals.busiest import Busiest, Movement
from sumo3dviz_pt.proposals.eyes import (
    Subjects,
    ViewPoses,
    against,
    best_of,
    crowded,
    not_looming,
    rated,
    ring,
    shows_none,
    subjects_of,
    unblocked,
)
from sumo3dviz_pt.proposals.outdoors import Outdoors

SEED = 1
"""Of the ring's first azimuth, and of the proposed scene file."""

SHORTEST_FLIGHT = 0.1
"""No camera flies in a shorter moment [s]: its key frames need times of their own."""

_FOV, _CORNER_FOV = 60.0, 65.0
_MARGIN = 3.0  # eyes keep this distance from everything that stands [m]
_KERB = 0.9  # and those at the height of people this from carriageways [m]
_HEIGHTS = (7.0, 9.5, 13.0)  # of an overview's eye above the place [m]
_HIGHER = (0.85, 1.0, 1.0)  # factors of their values: from above, vehicles hide each other less
_AWAY = (7.0, 9.5, 12.0, 14.5, 17.0, 19.5, 22.0, 24.5, 27.0, 30.0)  # corners from the place [m]
_LOW = (2.2, 2.7, 3.6)  # heights of a corner's eye above the ground, the best first [m]
_LOWER = (1.0, 0.8, 0.6)  # factors of their values: the first is how people see a street
_BESIDE = 12.0  # corners stand at most this far from the middle of a lane [m]
_CLEAR = 2.0  # eyes are no nearer to the ground than this [m]


@dataclass(frozen=True, slots=True, eq=False)
class StandingEye:
    """A camera that stands.

    Attributes:
        eye: (3,) [m].
        aim: What it looks at, (3,) [m].
        fov: Horizontal opening angle [deg].
    """

    eye: Floats
    aim: Floats
    fov: float


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """A camera that flies.

    Attributes:
        times: Of its key frames, (n,) [s].
        eyes: (n, 3) [m].
        aims: What it looks at, (n, 3) [m].
        fov: Horizontal opening angle [deg].
    """

    times: Floats
    eyes: Floats
    aims: Floats
    fov: float


@dataclass(frozen=True, slots=True, eq=False)
class Scouting:
    """What cameras are chosen by.

    Attributes:
        spot: The moment and the place.
        movement: Everyone near the place, while the shots last.
        around: What stands there.
        sun: Unit vector to the sun, (3,), or None.
        types: Vehicle types by id.
        meetings: Where roads cross at one height without a junction, (n, 3) [m].
    """

    spot: Busiest
    movement: Movement
    around: Outdoors
    sun: Floats | None
    types: Mapping[str, VehicleType] = field(default_factory=dict)
    meetings: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def subjects(self) -> Subjects:
        """Whom cameras are to see."""
        return subjects_of(self.movement, self.spot.place)

    def rated(self, poses: ViewPoses, *, margin: float) -> Floats:
        """Return how good poses are, (n,); 0 for eyes in something or too near to the ground.

        Args:
            poses: n of them.
            margin: Distance that eyes keep from everything that stands [m].
        """
        above = poses.eyes[:, 2] - self.around.ground(poses.eyes)
        usable = (above >= _CLEAR) & ~self.around.within(poses.eyes, margin=margin)
        usable &= shows_none(poses, self.meetings)
        some = ViewPoses(poses.eyes[usable], poses.aims[usable], poses.fov, poses.focus)
        values = np.zeros(len(usable))
        values[usable] = rated(some, self.subjects, self.around, sun=self.sun)
        values[usable] *= not_looming(some, self.movement, self.types)
        return values


def overview(scouting: Scouting) -> StandingEye:
    """Return a camera above the place that sees much of its traffic."""
    place = scouting.spot.place
    spots = ring(place, azimuths=_azimuths("overview", 18), distances=(24.0, 32.0, 42.0))
    eyes = np.concatenate([_raised(spots, place, height, scouting) for height in _HEIGHTS])
    # Roads lead away behind the place, so that it may lie in the lower half of the picture.
    away = unit((place - eyes) * [1.0, 1.0, 0.0])
    aims = np.concatenate([place + beyond * away for beyond in (0.0, 14.0)])
    aims[:, 2] += 0.5
    eyes = np.tile(eyes, (2, 1))
    poses = ViewPoses(eyes, aims, _FOV)
    values = scouting.rated(poses, margin=_MARGIN)
    values *= np.tile(np.repeat(_HIGHER, len(spots)), 2)
    chosen = best_of(values)
    if chosen is None:
        # Everything is full: high above the place nothing stands.
        eye = place + np.array([-22.0, -12.0, 40.0])
        return StandingEye(eye, place, _FOV)
    return StandingEye(eyes[chosen], aims[chosen], _FOV)


def corner(scouting: Scouting) -> StandingEye | None:
    """Return a camera at the height of people beside the road, or None without room for it.

    It never looks against the sun.
    """
    place = scouting.spot.place
    spots = ring(place, azimuths=_azimuths("corner", 36), distances=_AWAY)
    near = scouting.around.off_road(spots) < _BESIDE
    spots = spots[near & ~scouting.around.on_road(spots, margin=_KERB)]
    if not len(spots):
        return None
    ground = scouting.around.ground(spots)
    level = np.abs(ground - place[2]) < 2.5
    spots, ground = spots[level], ground[level]
    eyes = np.concatenate([np.column_stack([spots, ground + height]) for height in _LOW])
    factors = np.repeat(_LOWER, len(spots))
    # Looking over the junction, a little below the horizon.
    aims = np.tile(place, (len(eyes), 1))
    aims[:, 2] = np.maximum(place[2] + 1.0, 0.75 * (eyes[:, 2] - place[2]) + place[2] - 0.3)
    poses = ViewPoses(eyes, aims, _CORNER_FOV, focus=12.0)
    values = scouting.rated(poses, margin=1.2) * factors
    values *= unblocked(poses, scouting.movement) * ~against(poses, scouting.sun)
    values *= ~(crowded(eyes, scouting.movement) & (factors == 1.0))
    # Whatever else drives before a crest, the place itself is what the picture is of.
    roofs = place + np.array([0.0, 0.0, 1.0])
    values *= scouting.around.over_land(eyes, np.tile(roofs, (len(eyes), 1)))
    chosen = best_of(values)
    return None if chosen is None else StandingEye(eyes[chosen], aims[chosen], _CORNER_FOV)


def flight(scouting: Scouting) -> Flight | None:
    """Return a gentle descent along the main road or around the place, or None without room."""
    spot = scouting.spot
    if spot.end - spot.start < SHORTEST_FLIGHT:
        return None
    ways = _ways(scouting)
    # Rate each way by all of its key frames; one bad frame spoils a film.
    place = spot.place
    eyes = np.concatenate(ways)
    aims = np.tile(place + np.array([0.0, 0.0, 1.0]), (len(eyes), 1))
    poses = ViewPoses(eyes, aims, _FOV)
    values = scouting.rated(poses, margin=_MARGIN + 1.0)
    values = (values).reshape(len(ways), -1)
    chosen = best_of(0.5 * values.mean(axis=1) + 0.5 * values.min(axis=1))
    if chosen is None:
        return None
    way = ways[chosen]
    times = np.linspace(spot.start, spot.end, len(way))
    return Flight(times, way, aims[: len(way)], _FOV)


def _ways(scouting: Scouting) -> list[Floats]:
    """Ways around the place, and along the roads that lead to it, (5, 3) [m] each."""
    place = scouting.spot.place
    share = np.linspace(0.0, 1.0, 5)
    # Slow at the begin and at the end.
    along = eased(share)
    heights = 19.0 - 10.5 * along
    ways = []
    for azimuth in _azimuths("flight", 16):
        for sweep in (-0.9, 0.9):
            turn = azimuth + sweep * along
            away = 52.0 - 20.0 * along
            spots = place[:2] + (away * np.stack([np.cos(turn), np.sin(turn)])).T
            ways.append(_raised(spots, place, heights, scouting))
    for azimuth in _headings(scouting):
        towards = np.array([np.cos(azimuth), np.sin(azimuth)])
        for side in (-3.0, 3.0):
            aside = side * np.array([-towards[1], towards[0]])
            spots = place[:2] - (78.0 - 48.0 * along)[:, None] * towards + aside
            ways.append(_raised(spots, place, heights - 1.0, scouting))
    return ways


def _headings(scouting: Scouting) -> list[float]:
    """Directions in which most drive through the place, and against them [rad]."""
    movement = scouting.movement.near(scouting.spot.place, 40.0)
    if not len(movement.yaws):
        return [0.0]
    bins = np.floor(np.mod(movement.yaws, np.pi) / (np.pi / 12.0)).astype(np.int64) % 12
    weight = np.bincount(bins, weights=movement.driven + 1e-6, minlength=12)
    best = np.argsort(-np.round(weight, 6), kind="stable")[:2]
    middles = [(float(k) + 0.5) * np.pi / 12.0 for k in best]
    return [turn + back for turn in middles for back in (0.0, np.pi)]


def _raised(spots: Floats, place: Floats, heights: float | Floats, scouting: Scouting) -> Floats:
    """Eyes above spots, (n, 3) [m].

    Args:
        spots: (n, 2) [m].
        place: What they look at, (3,) [m].
        heights: Above the place, one or (n,) [m]; where the ground is higher, above that.
        scouting: Knows the ground.
    """
    ground = scouting.around.ground(spots)
    least = ground + 0.75 * np.asarray(heights)
    return np.column_stack([spots, np.maximum(place[2] + heights, least)])


def _azimuths(name: str, count: int) -> Sequence[float]:
    """Evenly spread directions, the first by chance [rad]."""
    turn = share_of(SEED, "azimuth", name)
    return [2.0 * np.pi * (k + turn) / count for k in range(count)]
