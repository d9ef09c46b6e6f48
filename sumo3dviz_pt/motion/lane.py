"""Motion along the lanes that the log names; our best smoother.

Where a vehicle is comes from its lanes and its places on them: the path is the lanes'
centre line with rounded corners, the way along it is smooth in time and never falls, and
changes of lanes are moves that a vehicle can drive. What the samples lie off that path
(parking, sublane offsets, rounding) is kept, smooth in time. Steps whose lanes are missing
or contradict the places are bridged by `hermite`.

References:
    shared facts on motion, section 5, but for changes of lanes: the two tracks are
    blended as curves, so that lanes that are not parallel leave no step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.along import run_along, with_rests
from sumo3dviz_pt.motion.curves import Hermite, eased, monotone_slopes
from sumo3dviz_pt.motion.front import Chain, Front, FrontMotion, velocity
from sumo3dviz_pt.motion.hermite import bridge, hermite
from sumo3dviz_pt.motion.lane_path import Blend, LanePath, lane_path
from sumo3dviz_pt.motion.registry import register
from sumo3dviz_pt.motion.route import LaneRun, Switch, follow, is_astray, stretches_of
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.track import Tracks

_INSTANT = 1.2
"""A sideways step between two samples of at least this is no motion of the log's [m]."""

_STEEPEST = 0.35
"""Nor is a move further aside than this share of the way ahead meanwhile."""

_MOVING = 0.1
"""Samples of one move aside differ by more [m]."""

_ENDING = 10.0
"""Over so far what rounding misses at births and deaths is made up for [m]."""

_LONGEST = 5.0
"""A move aside is looked for so long before and after a switch [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class LaneFront:
    """The front along its lanes.

    Attributes:
        along: Stations over time.
        path: Points by station.
        beside: What it is off the path over time: along, to the left, up, (n, 3) [m].
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
        """Where the front is at times within [begin, end], (n,) [s]."""
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
    # Nearly all samples are where their lanes say: that is seen at the end, at no cost.
    for trusted in (True, False):
        known, failed = _known(samples, setting, tracks, trusted=trusted)
        if not any(is_astray(front.beside.values[:, :2]) for front, _ in known.values()):
            break
    remarks = _failures(samples, failed)
    if not known:
        return replace(bridge(samples, setting), remarks=remarks)
    return _joined(samples, setting, known, remarks)


def _known(
    samples: LoggedSamples, setting: Setting, tracks: Tracks, *, trusted: bool
) -> tuple[dict[int, tuple[LaneFront, int]], dict[int, str]]:
    """Motion where lanes are known, with its last sample, by its first; and what lacks lanes."""
    stretches = stretches_of(samples, setting, tracks.ways)
    # Lanes are as long as they are drawn; speeds are logged in SUMO's metres.
    placed = replace(samples, offsets=samples.offsets * stretches)
    runs, failed = follow(placed, setting, trusted=trusted)
    drawn = replace(samples, speeds=samples.speeds * stretches)
    known = {}
    for run in runs:
        part = drawn.part(slice(run.first, run.last + 1))
        known[run.first] = _lane_front(part, setting, tracks, run), run.last
    return known, failed


def _joined(
    samples: LoggedSamples,
    setting: Setting,
    known: Mapping[int, tuple[LaneFront, int]],
    remarks: tuple[Remark, ...],
) -> Front:
    """Motion along lanes, and `hermite` between them."""
    bounds = sorted({0, len(samples.times) - 1, *known, *(last for _, last in known.values())})
    fronts: list[Front] = []
    for first, last in pairwise(bounds):
        if first in known:
            fronts.append(known[first][0])
            continue
        after = known[last][0] if last in known else None
        part = samples.part(slice(first, last + 1))
        fronts.append(_gap(part, setting, fronts[-1] if fronts else None, after))
    return fronts[0] if len(fronts) == 1 else Chain(tuple(fronts), remarks)


def _failures(samples: LoggedSamples, failed: Mapping[int, str]) -> tuple[Remark, ...]:
    """Remarks on the steps that have no lanes, neighbours of one reason together."""
    found: list[Remark] = []
    for step, reason in sorted(failed.items()):
        begin, end = float(samples.times[step]), float(samples.times[step + 1])
        if found and found[-1].kind == reason and found[-1].end == begin:
            begin = found.pop().begin
        found.append(Remark(reason, begin, end, end - begin))
    return tuple(found)


def _gap(
    samples: LoggedSamples, setting: Setting, before: Front | None, after: Front | None
) -> Front:
    """Motion where no lanes are known, as fast at its ends as what it joins."""
    return bridge(
        samples,
        setting,
        first=None if before is None else velocity(before, before.end),
        last=None if after is None else velocity(after, after.begin),
    )


def _lane_front(
    samples: LoggedSamples, setting: Setting, tracks: Tracks, run: LaneRun
) -> LaneFront:
    """Motion along known lanes."""
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


def _off_path(
    samples: LoggedSamples, path: LanePath, run: LaneRun, stations: Floats
) -> tuple[Floats, Bools, list[tuple[float, float]]]:
    """How far samples are off their path, which count, and when the log changes lanes.

    Returns:
        Along, to the left and up, (n, 3) [m]; which count, (n,); begins and ends [s].

    SUMO knows a place along a lane's polyline and an offset to its side; that offset is
    kept beside the rounded line, where corners throw nothing about. Along and up samples
    are held against their own lanes, as lanes beside each other are not equally long. To
    the side they are held against the path, but where no vehicle could drive a change of
    lanes as the log has it they stay on their own lanes too, and those amid it do not
    count: the move is ours.
    """
    lines = [track.corners_at(stations) for track in path.tracks]
    own, counts = np.array(run.own), np.ones(len(stations), dtype=np.bool_)
    sides, both = _Blended(lines[0]), _Blended(lines[0])
    moved: list[tuple[float, float]] = []
    for number, switch in enumerate(run.switches):
        lies = (own > number).astype(np.float64)
        weight = lies
        first, last = _change(samples, lines[number], switch)
        moved.append((float(samples.times[first]), float(samples.times[last])))
        if _undrivable(samples, lines[number], stations, (first, last), run, switch):
            counts[first + 1 : last] = False
        else:
            length = path.ends[number] - path.begins[number]
            weight = eased((stations - path.begins[number]) / length)
        sides = sides.toward(lines[number], lines[number + 1], weight)
        both = both.toward(lines[number], lines[number + 1], lies)
    off = both.off(samples.positions)
    off[:, 1] = sides.off(samples.positions)[:, 1]
    off += _ends_missed(samples, path, stations, off)
    return off, counts, moved


def _ends_missed(samples: LoggedSamples, path: LanePath, stations: Floats, off: Floats) -> Floats:
    """What makes births and deaths exact: rounding missed them, fading away from both, (n, 3)."""
    points, ahead, _ = path.at(stations[[0, -1]])
    missed = _Blended((points, ahead)).off(samples.positions[[0, -1]]) - off[[0, -1]]
    away = np.abs(stations[:, None] - stations[[0, -1]])
    shares = 1.0 - eased(away / _ENDING)
    shares /= np.maximum(shares.sum(axis=1), 1.0)[:, None]
    return np.asarray(shares @ missed)


@dataclass(frozen=True, slots=True, eq=False)
class _Blended:
    """Points with directions, (n, 3) each."""

    line: tuple[Floats, Floats]

    def toward(
        self, here: tuple[Floats, Floats], there: tuple[Floats, Floats], weight: Floats
    ) -> _Blended:
        """Moved by shares of the way from one line to another, (n,)."""
        points, ahead = (
            mine + weight[:, None] * (b - a)
            for mine, a, b in zip(self.line, here, there, strict=True)
        )
        return _Blended((points, ahead))

    def off(self, positions: Floats) -> Floats:
        """How far positions lie along, to the left and up, (n, 3) [m]."""
        points, ahead = self.line
        return _turned(positions - points, _level(ahead) * (1.0, -1.0))


def _change(
    samples: LoggedSamples, track: tuple[Floats, Floats], switch: Switch
) -> tuple[int, int]:
    """First and last sample of a move aside around a switch."""
    reach = np.abs(samples.times - samples.times[switch.step]) <= _LONGEST
    aside = np.where(reach, _aside(samples, track), 0.0)
    steps = np.diff(aside) * np.sign(aside[switch.step + 1] - aside[switch.step])
    first, last = switch.step, switch.step + 1
    while first > 0 and reach[first - 1] and steps[first - 1] > _MOVING:
        first -= 1
    while last < len(aside) - 1 and reach[last + 1] and steps[last] > _MOVING:
        last += 1
    return first, last


def _undrivable(
    samples: LoggedSamples,
    track: tuple[Floats, Floats],
    stations: Floats,
    ends: tuple[int, int],
    run: LaneRun,
    switch: Switch,
) -> bool:
    """Whether a change of lanes is a jump in the log, or a slide more aside than ahead."""
    aside = _aside(samples, track)
    together = sum(other.step == switch.step for other in run.switches)
    if abs(aside[switch.step + 1] - aside[switch.step]) / together > _INSTANT:
        return True
    first, last = ends
    return bool(abs(aside[last] - aside[first]) > _STEEPEST * (stations[last] - stations[first]))


def _aside(samples: LoggedSamples, track: tuple[Floats, Floats]) -> Floats:
    """How far samples are to the left of a track whose points and directions are given, (n,)."""
    return np.asarray(_Blended(track).off(samples.positions)[:, 1])


def _level(ahead: Floats) -> Floats:
    """Level unit directions, (n, 3) -> (n, 2)."""
    level = ahead.T[:2]
    return np.asarray((level / np.maximum(np.hypot(*level), 1e-9)).T)


def _turned(values: Floats, level: Floats) -> Floats:
    """Vectors turned about the vertical from east to level directions, (n, 3) and (n, 2)."""
    cos, sin = level.T
    x, y, z = values.T
    return np.array([x * cos - y * sin, x * sin + y * cos, z]).T


def _remark(blend: Blend, moved: tuple[float, float]) -> Remark:
    """What users should know of a change of lanes, ours and the log's."""
    begin, end = min(blend.times[0], moved[0]), max(blend.times[1], moved[1])
    return Remark("lane change", begin, end, blend.width)
