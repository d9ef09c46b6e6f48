"""Vehicles on the path that they drove: units that bend, and wheels that roll.

Each unit of a long vehicle has two pivots that stay on the path of the vehicle's front: the joints
of buses and lorries, the bogies of trains, so that their wheels stay on the rails. Units are rigid;
their pivots are as far apart as the body says, measured straight, not along the path.

Modules of a tram have one bogie each and meet at hinges. Where the two units that meet
disagree, in front of and behind a bend, the hinge lies half-way, and both turn to it.

Every wheel of a body in full detail is turned by the way that its hub makes along the direction in
which it rolls, so that outer wheels turn faster in a bend and none slips. Steered wheels point
where their axle goes relative to the body. That is found from the path around the place, and not
from the speed, so a car that waits in a turn keeps its wheels turned. The chord's rear end slides a
little sideways in bends, as SUMO's does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.vehicles.recipe import WheelPlace
from sumo3dviz_pt.model.geometry import Bools, Floats, arc_length
from sumo3dviz_pt.model.trajectory import MotionPiece

_SPACING = 0.5
"""Of the points between which the path is straight [m]: 3 mm off in a bend of 10 m."""

_LONG = 40.0
"""Longer vehicles run on rails, in wider bends: twice that spacing [m]."""

_ROUNDS = 10
"""To find where a rigid unit's second pivot lies; in wide bends each is 50 times nearer."""

_REST = 4.0
"""Path behind the last pivot, because it is longer in bends than straight [m]."""

_TIGHT = 1.5
"""And this many times as long where vehicles may turn on the spot."""


@dataclass(frozen=True, slots=True, eq=False)
class UnitLinks:
    """Where the units of a vehicle are held, as drawn.

    Attributes:
        starts: Of each unit's front behind the vehicle's front, (u,) [m].
        lengths: Of the units, (u,) [m].
        pivots: Of each unit behind its own front, (u, 2) [m].
        hinged: Whether the units' ends are kept together.
    """

    starts: Floats
    lengths: Floats
    pivots: Floats
    hinged: bool = False


def unit_frames(piece: MotionPiece, times: Floats, links: UnitLinks) -> Floats:
    """Return the placements of a vehicle's units, unscaled, (n, u, 4, 4).

    Args:
        piece: The vehicle's motion.
        times: Within its life, (n,) [s].
        links: Of u units.
    """
    reach = float(links.starts[-1] + links.pivots[-1, 1]) + _REST
    spacing = _SPACING * (1.0 if reach < _LONG else 2.0)
    count = int(np.ceil((_TIGHT if reach < _LONG else 1.0) * reach / spacing)) + 1
    distances = spacing * np.arange(count, dtype=np.float64)
    path = piece.trail(times, distances)
    fronts, headings = _rigid(path, spacing, links)
    if links.hinged:
        fronts, headings = _hinged(fronts, headings, links.lengths)
    return _matrices(fronts, headings)


def _rigid(path: Floats, spacing: float, links: UnitLinks) -> tuple[Floats, Floats]:
    """Fronts and unit headings of units with both pivots on a path, (n, u, 3) each."""
    fronts, headings = [], []
    place, rear = np.zeros(len(path)), 0.0
    for start, (first, second) in zip(links.starts, links.pivots, strict=True):
        # Between units, too, distances are straight: couplings are bars.
        place, ahead = _second(path, spacing, place, base=float(start + first) - rear)
        place, behind = _second(path, spacing, place, base=float(second - first))
        rear = float(start + second)
        heading = _unit(ahead - behind)
        fronts.append(ahead + first * heading)
        headings.append(heading)
    return np.stack(fronts, axis=1), np.stack(headings, axis=1)


def _second(path: Floats, spacing: float, place: Floats, *, base: float) -> tuple[Floats, Floats]:
    """Where on the path a pivot lies that is a straight distance behind another one.

    Returns:
        Distance behind the vehicle's front along the path, (n,) [m], and the points, (n, 3).
    """
    start = _points(path, spacing, place)
    if base <= 0.0:
        return place + base, _points(path, spacing, place + base)
    along = place + base
    for _ in range(_ROUNDS):
        points = _points(path, spacing, along)
        along = along + base - np.linalg.norm(points - start, axis=1)
    return along, _points(path, spacing, along)


def _points(path: Floats, spacing: float, along: Floats) -> Floats:
    """Points of n paths, (n, k, 3), at one distance each, (n,) [m]; (n, 3)."""
    place = np.clip(along / spacing, 0.0, path.shape[1] - 1.0)
    index = np.minimum(place.astype(np.int64), path.shape[1] - 2)
    share = (place - index)[:, None]
    rows = np.arange(len(path))
    return np.asarray((1.0 - share) * path[rows, index] + share * path[rows, index + 1])


def _hinged(fronts: Floats, headings: Floats, lengths: Floats) -> tuple[Floats, Floats]:
    """Units whose ends are pulled together, arguments and result as from `_rigid`."""
    rears = fronts - lengths[:, None] * headings
    hinges = (rears[:, :-1] + fronts[:, 1:]) / 2.0
    first = np.concatenate([fronts[:, :1], hinges], axis=1)
    last = np.concatenate([hinges, rears[:, -1:]], axis=1)
    turned = _unit(first - last)
    return (first + last) / 2.0 + 0.5 * lengths[:, None] * turned, turned


def _unit(vectors: Floats) -> Floats:
    """Vectors of length 1, (..., 3); of none, east."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-9, vectors / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])


def _matrices(fronts: Floats, headings: Floats) -> Floats:
    """Placements without roll, (n, u, 4, 4)."""
    level = np.maximum(np.hypot(headings[..., 0], headings[..., 1]), 1e-9)
    left = np.stack([-headings[..., 1] / level, headings[..., 0] / level, 0.0 * level], axis=-1)
    matrices = np.zeros((*fronts.shape[:2], 4, 4))
    matrices[..., :3, 0], matrices[..., :3, 1] = headings, left
    matrices[..., :3, 2] = np.cross(headings, left)
    matrices[..., :3, 3] = fronts
    matrices[..., 3, 3] = 1.0
    return matrices


def rigid_frames(positions: Floats, yaws: Floats, pitches: Floats) -> Floats:
    """Return the placements of bodies, (n, 4, 4): pitch, then yaw.

    Args:
        positions: Of their fronts, (n, 3) [m].
        yaws: (n,) [rad].
        pitches: Nose up, (n,) [rad].
    """
    cy, sy, cp, sp = np.cos(yaws), np.sin(yaws), np.cos(pitches), np.sin(pitches)
    zero = np.zeros(len(yaws))
    matrices = np.zeros((len(yaws), 4, 4))
    matrices[:, :3, 0] = np.stack([cy * cp, sy * cp, sp], axis=1)
    matrices[:, :3, 1] = np.stack([-sy, cy, zero], axis=1)
    matrices[:, :3, 2] = np.stack([-cy * sp, -sy * sp, cp], axis=1)
    matrices[:, :3, 3] = positions
    matrices[:, 3, 3] = 1.0
    return matrices


def joined(
    starts: Sequence[float],
    lengths: Sequence[float],
    pivots: Sequence[tuple[float, float]],
    *,
    hinged: bool,
) -> UnitLinks:
    """Return links from lists of numbers.

    Args:
        starts: Of each unit's front behind the vehicle's front, u of them [m].
        lengths: Of the units, u of them [m].
        pivots: Of each unit behind its own front, u pairs [m].
        hinged: Whether the units' ends are kept together.
    """
    return UnitLinks(np.array(starts), np.array(lengths), np.array(pivots).reshape(-1, 2), hinged)


_STEP = 0.05
"""Between the places of a hub that are added up [s]: at 3 m/s^2 the way is 1 mm off."""

_AROUND = 0.5
"""Path before and behind the axle that tells where it goes [m]."""

_MOST_STEERING = float(np.radians(40.0))
"""What the wheels of cars and lorries allow [rad]."""

_CHUNK = 2000

FramesAt = Callable[[Floats], Floats]
"""Placements of all units at times, (n,) [s]: (n, u, 4, 4), unscaled."""


@dataclass(frozen=True, slots=True, eq=False)
class Hub:
    """A wheel as drawn.

    Attributes:
        unit: The unit that it belongs to.
        at: Its centre in that unit's frame, scaled, (3,) [m].
        radius: As drawn [m].
        steered: Whether it steers.
    """

    unit: int
    at: Floats
    radius: float
    steered: bool

    @classmethod
    def of(cls, unit: int, place: WheelPlace, scale: Floats) -> Hub:
        """Return a wheel as drawn: round, and as high as the body is scaled upwards.

        Args:
            unit: The unit that it belongs to.
            place: Where it is on that unit.
            scale: Of the body, (3,).
        """
        radius = place.radius * float(scale[2])
        return cls(unit, scale * np.array(place.at), radius, place.steered)


@dataclass(frozen=True, slots=True, eq=False)
class Rolling:
    """The wheels of a road user over a stretch of motion.

    Attributes:
        times: Increasing, (n,) [s].
        turned: Of each wheel since the first time, (n, w) [rad].
        steered: Which wheels steer, (w,).
        ways: That the steered axle has made, never falling, (n,) [m].
        axle: Its middle, (n, 2) [m].
        headings: Of its unit, unwrapped, (n,) [rad].
    """

    times: Floats
    turned: Floats
    steered: Bools
    ways: Floats
    axle: Floats
    headings: Floats

    @classmethod
    def of(cls, begin: float, end: float, hubs: Sequence[Hub], frames: FramesAt) -> Rolling:
        """Follow all wheels over a stretch of motion.

        Args:
            begin: [s].
            end: [s].
            hubs: The wheels.
            frames: Placements of the units they belong to.
        """
        # Sample the units, a chunk at a time.
        count = max(2, int(np.ceil((end - begin) / _STEP)) + 1)
        times = np.linspace(begin, end, count)
        parts = [frames(times[k : k + _CHUNK]) for k in range(0, count, _CHUNK)]
        units = np.concatenate(parts)
        # Add up the ways of wheels and of the axle that steers.
        places = np.stack([_places(units, hub) for hub in hubs], axis=1)
        ways = _ways(places, units, hubs)
        steered = np.array([hub.steered for hub in hubs], dtype=np.bool_)
        leading = next((hub.unit for hub in hubs if hub.steered), 0)
        axle = places[:, steered if steered.any() else slice(None), :2].mean(axis=1)
        ahead = units[:, leading, :2, 0]
        return cls(
            times,
            ways / [hub.radius for hub in hubs],
            steered,
            arc_length(axle),
            axle,
            np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0])),
        )

    def at(self, time: float) -> Floats:
        """Return how far the wheels have turned and are steered to the left, (w, 2) [rad]."""
        turned = [np.interp(time, self.times, column) for column in self.turned.T]
        angle = self.steering(time) if self.steered.any() else 0.0
        return np.column_stack([np.mod(turned, 2.0 * np.pi), np.where(self.steered, angle, 0.0)])

    def steering(self, time: float) -> float:
        """Return where the axle goes relative to its unit, to the left [rad]."""
        way = float(np.interp(time, self.times, self.ways))
        behind, ahead = (self._axle_at(way + side * _AROUND) for side in (-1.0, 1.0))
        across = ahead - behind
        length = float(np.hypot(*across))
        heading = float(np.interp(time, self.times, self.headings))
        # Backwards is the same direction of a wheel; where it turns back there is none.
        off = (np.arctan2(across[1], across[0]) - heading + np.pi / 2) % np.pi - np.pi / 2
        trusted = float(np.clip(length / _AROUND, 0.0, 1.0))
        return float(np.clip(off, -_MOST_STEERING, _MOST_STEERING)) * trusted**2

    def _axle_at(self, way: float) -> Floats:
        """The axle's middle after a way [m], (2,)."""
        return np.array([np.interp(way, self.ways, column) for column in self.axle.T])


def _places(units: Floats, hub: Hub) -> Floats:
    """A wheel's centre over time, (n, 3) [m]."""
    frame = units[:, hub.unit]
    return np.asarray(frame[:, :3, :3] @ hub.at + frame[:, :3, 3])


def _ways(places: Floats, units: Floats, hubs: Sequence[Hub]) -> Floats:
    """Way of each hub in the direction in which its wheel rolls, (n, w) [m]."""
    moves = np.diff(places, axis=0)
    ahead = units[..., :3, 0][:, [hub.unit for hub in hubs]]
    along = np.einsum("nwc,nwc->nw", moves, (ahead[1:] + ahead[:-1]) / 2.0)
    free = np.sign(along) * np.linalg.norm(moves, axis=2)
    rolled = np.where([hub.steered for hub in hubs], free, along)
    return np.concatenate([np.zeros((1, len(hubs))), np.cumsum(rolled, axis=0)])
