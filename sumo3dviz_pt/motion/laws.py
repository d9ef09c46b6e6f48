"""Laws and measures of drawn motion: what breaks them, how fast, how hard, how far from the lane.

The laws compare what is drawn with the log alone, whatever the smoother: a body heads where its log
says, turns only as it drives, and stands still while it stands. Distances from the centres of lanes
are told as logged and as shown.

Measures take motion at uniform times and give one value for each time, in the horizontal plane. The
value is NaN where a neighbour is missing that the formula needs, so nothing is ever measured across
a gap. With the step h and positions p:

* velocity (p[i+1] - p[i-1]) / 2h, acceleration (p[i+1] - 2 p[i] + p[i-1]) / h^2 and
  jerk (p[i+2] - 2 p[i+1] + 2 p[i-1] - p[i-2]) / 2h^3 are central differences of second
  order (Fornberg, "Generation of finite difference formulas on arbitrarily spaced grids",
  Mathematics of Computation 51, 1988, table 1);
* jumps and heading rates are differences between one frame and the next, as films show
  them: a central difference would hide half of a leap.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Lane
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Trajectory
from sumo3dviz_pt.motion.driven import REAR_AXLE
from sumo3dviz_pt.motion.lanes import LaneGraph
from sumo3dviz_pt.motion.manoeuvres import (
    STEADY,
    calmed,
    resting,
    room_on_the_spot,
    sharpest,
    turning_room,
)
from sumo3dviz_pt.motion.samples import LoggedSamples, Places, absolute_times, split, wrapped

JUMP_FACTOR = 1.5
"""A frame may move by this many times the logged speed x time ..."""

JUMP_SLACK = 0.02
"""... and by two centimetres: SUMO rounds to one [m]."""

_SLOW = 0.3
"""Slower than this the velocity's direction is noise; the heading is used instead [m/s]."""

_CHUNK = 32
"""Number of places that are measured together; they lie on a short stretch of road."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionMeasures:
    """What motion does at n times; NaN where unknown.

    Attributes:
        speeds: Of the front, (n,) [m/s], >= 0.
        accelerations: Change of speed along the path, (n,) [m/s2]; braking is negative.
        sideways: Acceleration across the path, to the left, (n,) [m/s2].
        jerks: Size of the change of acceleration, (n,) [m/s3], >= 0.
        heading_rates: To the next frame, counter-clockwise, (n,) [rad/s].
        crabs: Sideways speed of the rear axle, to the left, (n,) [m/s]; 0 for real tyres.
        jumps: Distance to the next frame, (n,) [m], >= 0.
    """

    speeds: Floats
    accelerations: Floats
    sideways: Floats
    jerks: Floats
    heading_rates: Floats
    crabs: Floats
    jumps: Floats


@dataclass(frozen=True, slots=True)
class Peak:
    """A largest value.

    Attributes:
        value: The value with its sign.
        time: Its time [s].
    """

    value: float
    time: float


def measure(motion: Motion, *, step: float, length: float) -> MotionMeasures:
    """Return all measures of motion at uniform times.

    Args:
        motion: Motion at n times that are `step` apart.
        step: Time between them [s], > 0.
        length: Length of the body [m].
    """
    places, yaws = motion.positions[:, :2], motion.yaws
    moving = velocities(places, step=step)
    along, across = accelerations(places, yaws, step=step)
    return MotionMeasures(
        np.asarray(np.linalg.norm(moving, axis=1)),
        along,
        across,
        jerks(places, step=step),
        heading_rates(yaws, step=step),
        crabs(places, yaws, step=step, axle=REAR_AXLE * length),
        jumps(places),
    )


def velocities(places: Floats, *, step: float) -> Floats:
    """Return central differences of places, (n, 2) [m] to (n, 2) [m/s]."""
    velocity = np.full(places.shape, np.nan)
    velocity[1:-1] = (places[2:] - places[:-2]) / (2.0 * step)
    return velocity


def accelerations(places: Floats, yaws: Floats, *, step: float) -> tuple[Floats, Floats]:
    """Return the acceleration along and across the path, (n,) [m/s2] each.

    Along is the direction of the velocity, or that of the heading where it hardly moves.

    Args:
        places: (n, 2) [m].
        yaws: (n,) [rad].
        step: Time between them [s].
    """
    changes = np.full(places.shape, np.nan)
    changes[1:-1] = (places[2:] - 2.0 * places[1:-1] + places[:-2]) / step**2
    moving = velocities(places, step=step)
    speeds = np.linalg.norm(moving, axis=1)
    heading = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    with np.errstate(invalid="ignore"):
        along = np.where(
            (speeds < _SLOW)[:, None], heading, moving / np.maximum(speeds, 1e-12)[:, None]
        )
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    return np.asarray((changes * along).sum(axis=1)), np.asarray((changes * across).sum(axis=1))


def jerks(places: Floats, *, step: float) -> Floats:
    """Return the size of the third derivative of places, (n, 2) [m] to (n,) [m/s3]."""
    sizes = np.full(len(places), np.nan)
    if len(places) >= 5:
        third = places[4:] - 2.0 * places[3:-1] + 2.0 * places[1:-3] - places[:-4]
        sizes[2:-2] = np.linalg.norm(third, axis=1) / (2.0 * step**3)
    return sizes


def heading_rates(yaws: Floats, *, step: float) -> Floats:
    """Return the turn to the next frame, the shorter way round, (n,) [rad] to (n,) [rad/s]."""
    rates = np.full(yaws.shape, np.nan)
    rates[:-1] = wrapped(np.diff(yaws)) / step
    return rates


def crabs(places: Floats, yaws: Floats, *, step: float, axle: float) -> Floats:
    """Return the speed of the rear axle across the body, (n,) [m/s].

    Args:
        places: Positions of the front, (n, 2) [m].
        yaws: (n,) [rad].
        step: Time between them [s].
        axle: Distance of the axle behind the front [m].
    """
    heading = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    moving = velocities(places - axle * heading, step=step)
    return np.asarray(moving[:, 1] * heading[:, 0] - moving[:, 0] * heading[:, 1])


def jumps(places: Floats) -> Floats:
    """Return the distance to the next frame, (n, 2) [m] to (n,) [m]."""
    lengths = np.full(len(places), np.nan)
    lengths[:-1] = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return lengths


def excess(jumped: Floats, speeds: Floats, *, step: float) -> Floats:
    """Return how much further frames jump than 1.5 x logged speed x step + 2 cm, (n,) [m].

    Args:
        jumped: Distances from `jumps`, (n,) [m].
        speeds: The larger logged speed of the samples around each frame, (n,) [m/s].
        step: Time between the frames [s].
    """
    return np.asarray(jumped - (JUMP_FACTOR * speeds * step + JUMP_SLACK))


def largest(values: Floats, times: Floats, *, count: int = 1, apart: float = 1.0) -> list[Peak]:
    """Return the largest values by size, each as one peak.

    Args:
        values: (n,), may hold NaN.
        times: (n,) [s].
        count: Largest number of peaks.
        apart: Values nearer than this to a larger peak belong to it [s].
    """
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0)
    peaks: list[Peak] = []
    while len(peaks) < count and sizes.size:
        best = int(np.argmax(sizes))
        if sizes[best] < 0.0:
            break
        peaks.append(Peak(float(values[best]), float(times[best])))
        near: Bools = np.abs(times - times[best]) < apart
        sizes[near] = -1.0
        sizes[best] = -1.0
    return peaks


def offsets(places: Floats, lines: Sequence[Floats]) -> Floats:
    """Return distances from the nearest of some lines, positive to its left, (n,) [m].

    Args:
        places: (n, 2) [m].
        lines: Polylines, (k, 2) [m] each, k >= 2; without any the result is NaN.
    """
    if not lines:
        return np.full(len(places), np.nan)
    starts = np.concatenate([line[:-1] for line in lines])
    along = np.concatenate([np.diff(line, axis=0) for line in lines])
    distances = np.empty(len(places))
    for first in range(0, len(places), _CHUNK):
        some = places[first : first + _CHUNK]
        near = _candidates(some, starts, along)
        distances[first : first + _CHUNK] = _nearest(some, starts[near], along[near])
    return distances


def _candidates(places: Floats, starts: Floats, along: Floats) -> Bools:
    """Return which stretches can be the nearest of any place; the places lie together, (m,)."""
    middle = (places.min(axis=0) + places.max(axis=0)) / 2.0
    reach = float(np.linalg.norm(places - middle, axis=1).max())
    half = np.linalg.norm(along, axis=1) / 2.0
    away = np.linalg.norm(starts + along / 2.0 - middle, axis=1)
    return np.asarray(away - half <= (away + half).min() + 2.0 * reach)


def _nearest(places: Floats, starts: Floats, along: Floats) -> Floats:
    """Return signed distances from the nearest of some stretches, (n,) [m]."""
    lengths = np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    units = along / lengths[:, None]
    part = places[:, None, :] - starts
    ahead = (part * units).sum(axis=2)
    left = part[:, :, 1] * units[:, 0] - part[:, :, 0] * units[:, 1]
    away = np.hypot(left, ahead - np.clip(ahead, 0.0, lengths))
    nearest = np.argmin(away, axis=1)
    rows = np.arange(len(part))
    signs = np.where(left[rows, nearest] < 0.0, -1.0, 1.0)
    return np.asarray(signs * away[rows, nearest])


_ASIDE = ("lane change", "parking", "reversing", "teleport", "gap")
"""Remarks which say that a smoother leaves the centres of lanes on purpose."""

_INSIDE = 2
"""Most internal lanes of a connection through a junction."""


@dataclass(frozen=True, slots=True, eq=False)
class LaneKeeping:
    """The lanes that a log's samples refer to.

    Attributes:
        graph: The lanes of the network.
        names: Lane ids; the lane numbers of samples index them.
    """

    graph: LaneGraph
    names: Sequence[str]

    def lanes_of(self, trace: Trace) -> list[Lane]:
        """Return the lanes that a road user is logged on, and those in junctions between them."""
        numbers = np.unique(trace.lanes)
        between = {self.names[number] for number in numbers.tolist() if number >= 0}
        for _ in range(_INSIDE):
            between |= self._inside_after(between)
        return [self.graph.lane(name) for name in sorted(between) if name in self.graph]

    def strays(self, trace: Trace, trajectory: Trajectory, times: Floats, places: Floats) -> Floats:
        """Return how much farther from the lanes' centres the front is than the samples around it.

        Args:
            trace: The logged samples.
            trajectory: The motion made of them; its remarks count.
            times: (n,) [s].
            places: Positions of the front at those times, (n, 2) [m].

        Returns:
            Distances, (n,) [m], at least 0; NaN in changes of lanes, and where the log does not
            tell the lanes.
        """
        away = np.full(len(times), np.nan)
        lines = [lane.shape[:, :2] for lane in self.lanes_of(trace)]
        if len(trace.times) < 2 or not lines:
            return away
        logged = np.abs(offsets(trace.positions[:, :2], lines))
        step = np.clip(np.searchsorted(trace.times, times, side="right") - 1, 0, len(logged) - 2)
        judged = self._linked(trace)[step] & ~_aside(trajectory, times)
        shown = np.abs(offsets(places[judged], lines))
        around = np.maximum(logged[:-1], logged[1:])[step[judged]]
        away[judged] = np.maximum(shown - around, 0.0)
        return away

    def _linked(self, trace: Trace) -> Bools:
        """Return which steps between samples stay on a lane or lead to the next, (n - 1,)."""
        known = [self._follows(a, b) for a, b in pairwise(trace.lanes.tolist())]
        return np.array(known, dtype=np.bool_)

    def _follows(self, first: int, last: int) -> bool:
        """Whether a lane leads to another with at most a junction between them."""
        if min(first, last) < 0:
            return False
        if first == last:
            return True
        reached, goal = {self.names[first]}, self.names[last]
        for _ in range(_INSIDE):
            if any(goal in self.graph.onward.get(name, ()) for name in reached):
                return True
            reached = self._inside_after(reached)
        return any(goal in self.graph.onward.get(name, ()) for name in reached)

    def _inside_after(self, names: Iterable[str]) -> set[str]:
        """Return the lanes inside junctions that follow some lanes."""
        onward = (self.graph.onward.get(name, ()) for name in names)
        return {name for some in onward for name in some if self.graph.inside(name)}


def _aside(trajectory: Trajectory, times: Floats) -> Bools:
    """Return which times lie in remarks that lead away from the centre of a lane, (n,)."""
    aside = np.zeros(len(times), dtype=np.bool_)
    for remark in trajectory.remarks:
        if remark.kind in _ASIDE:
            aside |= (times >= remark.begin) & (times <= remark.end)
    return aside


HEADING, TURNING, MOVING, SWINGING, LEAPING = (
    "heads elsewhere than logged",
    "turns more than it drives",
    "moves while it stands",
    "turns while it stands",
    "leaps",
)

_GRID, _BEAT = 0.1, 0.2
"""Motion is looked at at multiples of this time, and at all samples; turns over the second [s]."""

_ASTRAY = np.radians(20.0)
"""Where two logged angles are steady, the drawn one is within this of them [rad]."""

_FASTEST, _FREE = np.radians(200.0), np.radians(2.0)
"""No body turns faster than this [rad/s]; nor by more than its way allows and this [rad]."""

_STILL, _LEVEL = 1e-3, np.radians(0.1)
"""A body that stands moves and turns by no more than this [m, rad]."""

_LEAP, _SIDEWAYS = 0.1, 2.5
"""From one look to the next a front goes no farther than its speed allows, by half as much again,
than this [m], and than moves aside that are ours add [m/s]."""

_BENT = np.radians(45.0)
"""A step that turns farther, or is longer than its speeds explain, as over a junction without
lanes, says nothing of how fast a front is."""

_AROUND = 1.0
"""Rows this long before and after tell how fast a front may be [s]."""

_OWN = ("parking", "reversing")
"""Remarks on manoeuvres in which a body turns otherwise than its front leads it."""


@dataclass(frozen=True, slots=True)
class Breach:
    """Where drawn motion breaks a law.

    Attributes:
        law: What it does, as a clause whose subject is the road user.
        id: The road user.
        time: When it is worst [s].
        value: By how much there [rad or m].
    """

    law: str
    id: str
    time: float
    value: float


def breaches(
    trace: Trace,
    trajectory: Trajectory,
    *,
    step: float,
    length: float,
    blur: float = 0.0,
    span: tuple[float, float] = (-np.inf, np.inf),
) -> Iterator[Breach]:
    """Yield where the motion of a road user breaks a law, each law at most once.

    Args:
        trace: Its logged samples.
        trajectory: What is drawn.
        step: Median step of the whole log [s].
        length: Length over which its body follows its front [m].
        blur: Time over which the smoother averages to each side [s].
        span: First and last time to look at [s].
    """
    worst_of: dict[str, Breach] = {}
    for samples, piece in zip(split(trace, step=step), trajectory.pieces, strict=True):
        if len(samples.times) < 2 or min(piece.end, span[1]) <= max(piece.begin, span[0]):
            continue
        # A body may stand askew for long, because it had no room to turn before the span begins.
        look = _Look.at(samples, piece, (piece.begin, piece.end))
        own = _within(trajectory, look.times)
        inside = (look.times >= span[0]) & (look.times <= span[1])
        if not inside.any():
            continue
        for law, sizes in _excesses(look, trace.kind, own, length=length, blur=blur).items():
            worst = int(np.argmax(np.where(inside, sizes, -np.inf)))
            if sizes[worst] > 0.0:
                new = Breach(law, trajectory.id, float(look.times[worst]), float(sizes[worst]))
                old = worst_of.setdefault(law, new)
                worst_of[law] = max(old, new, key=lambda each: each.value)
    yield from worst_of.values()


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """A piece of motion beside its log.

    Attributes:
        samples: The log.
        times: When it is looked at, (n,) [s].
        motion: What is drawn then.
        step: Number of the step between samples that each time lies in, (n,).
    """

    samples: LoggedSamples
    times: Floats
    motion: Motion
    step: Places

    @classmethod
    def at(cls, samples: LoggedSamples, piece: MotionPiece, span: tuple[float, float]) -> _Look:
        """Look at a piece at the samples and on a grid within a span [s]."""
        inside = samples.times[(samples.times > span[0]) & (samples.times < span[1])]
        times = np.union1d(absolute_times(*span, step=_GRID), inside)
        # Times that differ by rounding only are one.
        times = times[np.concatenate([[True], np.diff(times) > 1e-6])]
        step = np.searchsorted(samples.times, times + 1e-9, side="right") - 1
        return cls(samples, times, piece.sample(times), np.clip(step, 0, len(samples.times) - 2))

    @property
    def logged(self) -> Floats:
        """Logged yaws between samples, unwrapped, (n,) [rad]."""
        return np.interp(self.times, self.samples.times, self.samples.yaws)


def _excesses(
    look: _Look, kind: str, own: Bools, *, length: float, blur: float
) -> dict[str, Floats]:
    """Return by how much each law is broken at each time, (n,); at most 0 where kept.

    Args:
        look: Motion and log.
        kind: Kind of the road user; persons turn on the spot.
        own: Times of manoeuvres, (n,).
        length: Length over which its body follows its front [m].
        blur: Time over which the smoother averages to each side [s].
    """
    excesses: dict[str, Floats] = {}
    if kind == "person":
        room = room_on_the_spot(look.times, look.samples)
    else:
        excesses[TURNING] = np.where(own, 0.0, _turned_too_far(look, length))
        travelled = np.concatenate([[0.0], np.cumsum(_ways(look.motion))])
        room = turning_room(look.times, travelled, length)
    # Where the log turns a body faster than it could, the film may lag behind, for a tenth of a
    # second more than straight lines between the angles tell.
    lag = np.pad(np.abs(calmed(room, look.logged) - look.logged), 1, mode="edge")
    lag = np.maximum(np.maximum(lag[:-2], lag[1:-1]), lag[2:])
    moved, swung = _stirred(look, ~own, blur)
    astray = np.where(own, 0.0, _astray(look) - lag)
    return excesses | {HEADING: astray, MOVING: moved, SWINGING: swung, LEAPING: _leaps(look, blur)}


def _leaps(look: _Look, blur: float) -> Floats:
    """Return how much farther than allowed fronts go until the next time, (n,) [m]."""
    samples = look.samples
    gone = np.linalg.norm(np.diff(samples.positions[:, :2], axis=0), axis=1)
    spans = np.maximum(np.diff(samples.times), 1e-9)
    speeds = np.fmax(np.abs(samples.speeds[1:]), np.abs(samples.speeds[:-1]))
    paces = np.fmax(gone / spans, speeds)
    odd = (gone > JUMP_FACTOR * speeds * spans + 1.0) & np.isfinite(speeds)
    paces[odd | (np.abs(np.diff(samples.yaws)) > _BENT)] = np.inf
    # A smoother may take the pace of rows a little before and after.
    first = np.searchsorted(samples.times, look.times[:-1] - blur - _AROUND, side="right") - 1
    last = np.searchsorted(samples.times, look.times[1:] + blur + _AROUND, side="left")
    first, last = np.clip(first, 0, len(paces) - 1), np.clip(last, 1, len(paces))
    ends = np.stack([first, last], axis=1).ravel()
    fastest = np.maximum.reduceat(np.append(paces, -np.inf), ends)[::2]
    beyond = np.zeros(len(look.times))
    allowed = (JUMP_FACTOR * fastest + _SIDEWAYS) * np.diff(look.times) + _LEAP
    beyond[:-1] = _ways(look.motion) - allowed
    return beyond


def _astray(look: _Look) -> Floats:
    """Return how much farther than allowed headings are from logged ones, (n,) [rad]."""
    steady = np.abs(np.diff(look.samples.yaws)) <= STEADY
    away = np.abs(wrapped(look.motion.yaws - look.logged))
    return np.where(steady[look.step], away - _ASTRAY, 0.0)


def _turned_too_far(look: _Look, length: float) -> Floats:
    """Return how much farther bodies turn than time and way allow, (n,) [rad]."""
    motion, samples = look.motion, look.samples
    # A heading is known every tenth of a second, so the rows of a quicker log are skipped.
    beats = np.unique(np.floor(look.times / _BEAT + 1e-6), return_index=True)[1]
    beats = np.union1d(beats, [len(look.times) - 1])
    turned = np.abs(wrapped(np.diff(motion.yaws[beats])))
    way = np.concatenate([[0.0], np.cumsum(_ways(motion))])
    allowed = np.minimum(
        sharpest(length) * np.diff(way[beats]), _FASTEST * np.diff(look.times[beats])
    )
    # Where the log itself turns a body on the spot, so does the film.
    turns = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(samples.yaws)))])
    first = np.maximum(look.step[beats[:-1]] - 1, 0)
    last = np.minimum(look.step[beats[1:]] + 2, len(turns) - 1)
    around = turns[last] - turns[first]
    beyond = np.zeros(len(look.times))
    beyond[beats[:-1]] = turned - allowed - np.where(around > STEADY, around, 0.0) - _FREE
    return beyond


def _ways(motion: Motion) -> Floats:
    """Return the level distances from each time to the next, (n - 1,) [m]."""
    return np.asarray(np.linalg.norm(np.diff(motion.positions[:, :2], axis=0), axis=1))


def _stirred(look: _Look, counted: Bools, blur: float) -> tuple[Floats, Floats]:
    """Return how much farther than allowed standing bodies move and turn, (n,) each [m, rad].

    Args:
        look: Motion and log.
        counted: Which times count, (n,).
        blur: Time over which the smoother averages to each side [s].
    """
    samples, motion = look.samples, look.motion
    # A body rests from the second step of a rest on, because it may stop within the first.
    rest = resting(samples)
    rest[1:] &= rest[:-1].copy()
    moved, swung = np.zeros(len(look.times)), np.zeros(len(look.times))
    for first, last in _spans(rest):
        begin, end = samples.times[first] + blur, samples.times[last] - blur
        inside = np.flatnonzero((look.times >= begin) & (look.times <= end) & counted)
        if len(inside) > 1:
            away = motion.positions[inside] - motion.positions[inside[0]]
            moved[inside] = np.abs(away).max(axis=1) - _STILL
            swung[inside] = np.abs(wrapped(motion.yaws[inside] - motion.yaws[inside[0]])) - _LEVEL
    return moved, swung


def _spans(flags: Bools) -> Sequence[tuple[int, int]]:
    """Return first and last sample of each row of true steps."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def _within(trajectory: Trajectory, times: Floats) -> Bools:
    """Return which times lie in manoeuvres, (n,)."""
    within = np.zeros(len(times), dtype=np.bool_)
    for remark in trajectory.remarks:
        if remark.kind in _OWN:
            within |= (times >= remark.begin - _BEAT) & (times <= remark.end + _BEAT)
    return within
