"""Motion along the lanes that the log names; our best smoother.

A vehicle's position comes from its lanes and its offsets along them. The path is the lanes'
centre line with rounded corners. The station along it is smooth in time and never falls. A change
of lanes is a move that a vehicle can drive: the two tracks are blended as curves, so that lanes
that are not parallel leave no step. What the samples lie off that path (parking, sublane
offsets, rounding) is kept and made smooth in time. Steps whose lanes are missing or contradict
the positions are bridged by `hermite`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.front import (
    Front,
    FrontMotion,
    Hermite,
    JoinedFronts,
    eased,
    monotone_slopes,
    velocity,
)
from sumo3dviz_pt.motion.lanes import Tracks
from sumo3dviz_pt.motion.path import (
    Blend,
    LanePath,
    LaneRun,
    Switch,
    follow,
    is_astray,
    lane_path,
    stretches_of,
)
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.hermite import bridge, hermite, run_along, with_rests
from sumo3dviz_pt.motion.smoothers.registry import register

_INSTANT = 1.2
"""A sideways step of more than this between two samples is a jump, not a logged move [m]."""

_STEEPEST = 0.35
"""Nor is a move whose width exceeds this share of the distance driven meanwhile a logged move."""

_MOVING, _USUAL = 0.1, 0.25
"""Samples that differ sideways by more than this belong to one move aside [m]; by less where they
are nearer in time than this [s]."""

_ENDING = 10.0
"""Distance over which rounding's error at the first and last sample fades out [m]."""

_LONGEST = 5.0
"""A move aside is looked for this long before and after a switch [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class LaneFront:
    """The front of a road user along its lanes.

    Attributes:
        along: Stations over time.
        path: The path by station.
        beside: Offset from the path over time: along, to the left, up, (n, 3) [m].
        remarks: Its changes of lanes.
    """

    along: Hermite
    path: LanePath
    beside: Hermite
    remarks: tuple[Remark, ...]

    @property
    def begin(self) -> float:
        """First sample's time [s]."""
        return float(self.along.knots[0])

    @property
    def end(self) -> float:
        """Last sample's time [s]."""
        return float(self.along.knots[-1])

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""
        stations, speeds = self.along.at(times)
        points, ahead, rates = self.path.at(stations)
        offsets, drifts = self.beside.at(times)
        level = _level(ahead)
        velocities = (rates.T * speeds).T + _turned(drifts, level)
        return FrontMotion(points + _turned(offsets, level), np.linalg.norm(velocities, axis=1))


@register("lane")
def lane(samples: LoggedSamples, setting: Setting) -> Front:
    """Follow the lanes where they are known, and `hermite` between them."""
    tracks = setting.tracks
    if tracks is None:
        return hermite(samples, setting)
    # Nearly all samples are where their lanes say. Assume it first: the result shows whether
    # it was true, and checking each sample beforehand would cost more.
    for trusted in (True, False):
        known, failed = _known(samples, setting, tracks, trusted=trusted)
        if not any(is_astray(front.beside.values[:, :2]) for front, _ in known.values()):
            break
    remarks = _failures(samples, failed)
    if not known:
        return replace(bridge(samples, setting), remarks=remarks)
    return _joined(samples, setting, known, remarks)


class _Known(NamedTuple):
    """Motion along known lanes, and the number of its last sample."""

    front: LaneFront
    last: int


def _known(
    samples: LoggedSamples, setting: Setting, tracks: Tracks, *, trusted: bool
) -> tuple[dict[int, _Known], dict[int, str]]:
    """Return the motion where lanes are known, and the reasons where they are not.

    Args:
        samples: The samples.
        setting: What is known besides them.
        tracks: Lines along the lanes.
        trusted: Whether samples are taken to be where their lanes and offsets say.

    Returns:
        Motions by the number of their first sample; and for each step without known lanes the
        reason, by the number of its first sample.
    """
    stretches = stretches_of(samples, setting, tracks.graph)
    # Lanes are as long as they are drawn; speeds are logged in SUMO's metres.
    placed = replace(samples, offsets=samples.offsets * stretches)
    runs, failed = follow(placed, setting, trusted=trusted)
    drawn = replace(samples, speeds=samples.speeds * stretches)
    known = {}
    for run in runs:
        part = drawn.part(slice(run.first, run.last + 1))
        known[run.first] = _Known(_lane_front(part, setting, tracks, run), run.last)
    return known, failed


def _joined(
    samples: LoggedSamples,
    setting: Setting,
    known: Mapping[int, _Known],
    remarks: tuple[Remark, ...],
) -> Front:
    """Return the motion along lanes, joined by `hermite` between them."""
    bounds = sorted({0, len(samples.times) - 1, *known, *(some.last for some in known.values())})
    fronts: list[Front] = []
    for first, last in pairwise(bounds):
        if first in known:
            fronts.append(known[first].front)
            continue
        after = known[last].front if last in known else None
        part = samples.part(slice(first, last + 1))
        fronts.append(_gap(part, setting, fronts[-1] if fronts else None, after))
    return fronts[0] if len(fronts) == 1 else JoinedFronts(tuple(fronts), remarks)


def _failures(samples: LoggedSamples, failed: Mapping[int, str]) -> tuple[Remark, ...]:
    """Return remarks on steps without lanes; neighbours of one reason become one remark."""
    remarks: list[Remark] = []
    for step, reason in sorted(failed.items()):
        begin, end = float(samples.times[step]), float(samples.times[step + 1])
        if remarks and remarks[-1].kind == reason and remarks[-1].end == begin:
            begin = remarks.pop().begin
        remarks.append(Remark(reason, begin, end, end - begin))
    return tuple(remarks)


def _gap(
    samples: LoggedSamples, setting: Setting, before: Front | None, after: Front | None
) -> Front:
    """Return motion where no lanes are known, as fast at its ends as the motion that it joins."""
    return bridge(
        samples,
        setting,
        first=None if before is None else velocity(before, before.end),
        last=None if after is None else velocity(after, after.begin),
    )


def _lane_front(
    samples: LoggedSamples, setting: Setting, tracks: Tracks, run: LaneRun
) -> LaneFront:
    """Return motion along the known lanes of a run."""
    stations = np.array(run.stations)
    along = run_along(
        samples.times, stations, samples.speeds, euler=setting.euler, rests=setting.rests
    )
    path, blends = lane_path(tracks, run, along)
    off, counts, moved = _off_path(samples, path, run, stations)
    times = samples.times[counts]
    beside = Hermite(times, off[counts], monotone_slopes(times, off[counts]))
    shown = with_rests(along, samples.speeds, euler=setting.euler)
    remarks = tuple(_remark(*both) for both in zip(blends, moved, strict=True))
    return LaneFront(shown, path, beside, remarks)


class _OffPath(NamedTuple):
    """How far n samples are off their path.

    Attributes:
        offsets: Along, to the left and up, (n, 3) [m].
        counts: Which samples count, (n,).
        moved: When the log begins and ends each change of lanes [s].
    """

    offsets: Floats
    counts: Bools
    moved: list[tuple[float, float]]


def _off_path(samples: LoggedSamples, path: LanePath, run: LaneRun, stations: Floats) -> _OffPath:
    """Return how far samples are off their path.

    A sample has an offset along its lane's polyline, and one to its side. The offset to the
    side is kept beside the rounded line, so that the polyline's corners do not show in it.
    Along and up, samples are compared with their own lanes, because lanes beside each other
    are not equally long. To the side they are compared with the path. The exception is a change
    of lanes that no vehicle could drive as the log has it: there samples are compared with
    their own lanes, and those amid the change do not count, because the move is ours.
    """
    # Begin on the first lane, and go over to the next lane at each change.
    lines = [track.corners_at(stations) for track in path.tracks]
    own, counts = np.array(run.own), np.ones(len(stations), dtype=np.bool_)
    sides, both = _Blended(lines[0]), _Blended(lines[0])
    moved: list[tuple[float, float]] = []
    for number, switch in enumerate(run.switches):
        lies = (own > number).astype(np.float64)
        weight = lies
        first, last = _change(samples, lines[number], switch)
        moved.append((float(samples.times[first]), float(samples.times[last])))
        both_lines = lines[number], lines[number + 1]
        if _undrivable(samples, both_lines, stations, (first, last), run, switch):
            counts[first + 1 : last] = False
        else:
            length = path.ends[number] - path.begins[number]
            weight = eased((stations - path.begins[number]) / length)
        sides = sides.toward(lines[number], lines[number + 1], weight)
        both = both.toward(lines[number], lines[number + 1], lies)
    # Compare the samples with those lines.
    off = both.off(samples.positions)
    off[:, 1] = sides.off(samples.positions)[:, 1]
    off += _ends_missed(samples, path, stations, off)
    return _OffPath(off, counts, moved)


def _ends_missed(samples: LoggedSamples, path: LanePath, stations: Floats, off: Floats) -> Floats:
    """Return what makes the first and the last position exact despite rounding, (n, 3) [m]."""
    points, ahead, _ = path.at(stations[[0, -1]])
    missed = _Blended((points, ahead)).off(samples.positions[[0, -1]]) - off[[0, -1]]
    away = np.abs(stations[:, None] - stations[[0, -1]])
    shares = 1.0 - eased(away / _ENDING)
    shares /= np.maximum(shares.sum(axis=1), 1.0)[:, None]
    return np.asarray(shares @ missed)


@dataclass(frozen=True, slots=True, eq=False)
class _Blended:
    """Points of a line and their directions, between one lane and the next.

    Attributes:
        line: Points [m] and derivatives, (n, 3) each.
    """

    line: tuple[Floats, Floats]

    def toward(
        self, here: tuple[Floats, Floats], there: tuple[Floats, Floats], weight: Floats
    ) -> _Blended:
        """Return points moved by shares, (n,), of the difference between two lines.

        Args:
            here: Points and derivatives of one line, (n, 3) each.
            there: Points and derivatives of the other line, (n, 3) each.
            weight: Shares, (n,).
        """
        points, ahead = (
            mine + weight[:, None] * (b - a)
            for mine, a, b in zip(self.line, here, there, strict=True)
        )
        return _Blended((points, ahead))

    def off(self, positions: Floats) -> Floats:
        """Return how far positions lie ahead, to the left and up, (n, 3) [m]."""
        points, ahead = self.line
        return _turned(positions - points, _level(ahead) * (1.0, -1.0))


def _change(
    samples: LoggedSamples, track: tuple[Floats, Floats], switch: Switch
) -> tuple[int, int]:
    """Return the first and the last sample of the log's move aside around a switch."""
    reach = np.abs(samples.times - samples.times[switch.step]) <= _LONGEST
    aside = np.where(reach, _aside(samples, track), 0.0)
    steps = np.diff(aside) * np.sign(aside[switch.step + 1] - aside[switch.step])
    least = _MOVING * np.minimum(np.diff(samples.times) / _USUAL, 1.0)
    first, last = switch.step, switch.step + 1
    while first > 0 and reach[first - 1] and steps[first - 1] > least[first - 1]:
        first -= 1
    while last < len(aside) - 1 and reach[last + 1] and steps[last] > least[last]:
        last += 1
    return first, last


def _undrivable(
    samples: LoggedSamples,
    tracks: tuple[tuple[Floats, Floats], tuple[Floats, Floats]],
    stations: Floats,
    ends: tuple[int, int],
    run: LaneRun,
    switch: Switch,
) -> bool:
    """Whether no vehicle could drive a change of lanes as the log has it.

    That is a jump within one step, or a move too far aside for the distance driven meanwhile. If
    the samples around it lie farther apart by their own lanes than they are, they count as they
    are: a slow slide over a line between lanes is none of our moves.

    Args:
        samples: The samples.
        tracks: Points and derivatives of both lanes at the samples, (n, 3) each.
        stations: Stations of the samples, (n,) [m].
        ends: First and last sample of the move.
        run: The run that the change is part of.
        switch: The change.
    """
    aside, beyond = (_aside(samples, track) for track in tracks)
    together = sum(other.step == switch.step for other in run.switches)
    if abs(aside[switch.step + 1] - aside[switch.step]) / together > _INSTANT:
        return True
    first, last = ends
    if abs(beyond[last] - aside[first]) > abs(aside[last] - aside[first]):
        return False
    return bool(abs(aside[last] - aside[first]) > _STEEPEST * (stations[last] - stations[first]))


def _aside(samples: LoggedSamples, track: tuple[Floats, Floats]) -> Floats:
    """Return how far samples are left of a track's points and derivatives, (n,) [m]."""
    return np.asarray(_Blended(track).off(samples.positions)[:, 1])


def _level(ahead: Floats) -> Floats:
    """Return level unit directions, (n, 3) -> (n, 2)."""
    level = ahead.T[:2]
    return np.asarray((level / np.maximum(np.hypot(*level), 1e-9)).T)


def _turned(values: Floats, level: Floats) -> Floats:
    """Return vectors, (n, 3), turned about the vertical from east to directions, (n, 2)."""
    cos, sin = level.T
    x, y, z = values.T
    return np.array([x * cos - y * sin, x * sin + y * cos, z]).T


def _remark(blend: Blend, moved: tuple[float, float]) -> Remark:
    """Return the remark on a change of lanes; it covers the shown move and the logged one."""
    begin, end = min(blend.times[0], moved[0]), max(blend.times[1], moved[1])
    return Remark("lane change", begin, end, blend.width)
