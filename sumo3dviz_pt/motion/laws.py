"""Laws of drawn motion, as functions that yield what breaks them.

A body heads where its log says, turns only as it drives, and stands still while it stands. The
laws compare what is drawn with the log alone, whatever the smoother.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Trajectory
from sumo3dviz_pt.motion.alignment import STEADY, calmed, room_on_the_spot, sharpest, turning_room
from sumo3dviz_pt.motion.resting import resting
from sumo3dviz_pt.motion.samples import LoggedSamples, Places, absolute_times, wrapped
from sumo3dviz_pt.motion.splitting import split

HEADING, TURNING, MOVING, SWINGING = (
    "heads elsewhere than logged",
    "turns more than it drives",
    "moves while it stands",
    "turns while it stands",
)

_GRID, _BEAT = 0.1, 0.2
"""Motion is looked at at multiples of this time, and at all samples; turns over the second [s]."""

_ASTRAY = np.radians(20.0)
"""Where two logged angles are steady, the drawn one is within this of them [rad]."""

_FASTEST, _FREE = np.radians(200.0), np.radians(2.0)
"""No body turns faster than this [rad/s]; nor by more than its way allows and this [rad]."""

_STILL, _LEVEL = 1e-3, np.radians(0.1)
"""A body that stands moves and turns by no more than this [m, rad]."""

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
    found: dict[str, Breach] = {}
    for samples, piece in zip(split(trace, step=step), trajectory.pieces, strict=True):
        if len(samples.times) < 2 or min(piece.end, span[1]) <= max(piece.begin, span[0]):
            continue
        # A body may stand askew for long, because it had no room to turn before the span begins.
        look = _Look.at(samples, piece, (piece.begin, piece.end))
        own = _within(trajectory, look.times)
        asked = (look.times >= span[0]) & (look.times <= span[1])
        if not asked.any():
            continue
        for law, sizes in _excesses(look, trace.kind, own, length=length, blur=blur).items():
            worst = int(np.argmax(np.where(asked, sizes, -np.inf)))
            if sizes[worst] > 0.0:
                new = Breach(law, trajectory.id, float(look.times[worst]), float(sizes[worst]))
                old = found.setdefault(law, new)
                found[law] = max(old, new, key=lambda each: each.value)
    yield from found.values()


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
    found: dict[str, Floats] = {}
    if kind == "person":
        room = room_on_the_spot(look.times, look.samples)
    else:
        found[TURNING] = np.where(own, 0.0, _turned_too_far(look, length))
        travelled = np.concatenate([[0.0], np.cumsum(_ways(look.motion))])
        room = turning_room(look.times, travelled, length)
    # Where the log turns a body faster than it could, the film may lag behind, for a tenth of a
    # second more than straight lines between the angles tell.
    lag = np.pad(np.abs(calmed(room, look.logged) - look.logged), 1, mode="edge")
    lag = np.maximum(np.maximum(lag[:-2], lag[1:-1]), lag[2:])
    moved, swung = _stirred(look, ~own, blur)
    astray = np.where(own, 0.0, _astray(look) - lag)
    return found | {HEADING: astray, MOVING: moved, SWINGING: swung}


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
    found = np.zeros(len(look.times))
    found[beats[:-1]] = turned - allowed - np.where(around > STEADY, around, 0.0) - _FREE
    return found


def _ways(motion: Motion) -> Floats:
    """Return the level distances from each time to the next, (n - 1,) [m]."""
    return np.asarray(np.linalg.norm(np.diff(motion.positions[:, :2], axis=0), axis=1))


def _stirred(look: _Look, asked: Bools, blur: float) -> tuple[Floats, Floats]:
    """Return how much farther than allowed standing bodies move and turn, (n,) each [m, rad].

    Args:
        look: Motion and log.
        asked: Which times count, (n,).
        blur: Time over which the smoother averages to each side [s].
    """
    samples, motion = look.samples, look.motion
    # A body rests from the second step of a rest on, because it may stop within the first.
    rest = resting(samples)
    rest[1:] &= rest[:-1].copy()
    moved, swung = np.zeros(len(look.times)), np.zeros(len(look.times))
    for first, last in _spans(rest):
        begin, end = samples.times[first] + blur, samples.times[last] - blur
        inside = np.flatnonzero((look.times >= begin) & (look.times <= end) & asked)
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
    found = np.zeros(len(times), dtype=np.bool_)
    for remark in trajectory.remarks:
        if remark.kind in _OWN:
            found |= (times >= remark.begin - _BEAT) & (times <= remark.end + _BEAT)
    return found
