"""The lanes that a road user drove along, and how far along them each sample is.

Chains are lanes that lead into one another; a change of lanes begins the next chain.
All chains of a run share one arc length, the station: SUMO's places on lanes are common
to the lanes of an edge.

References:
    shared facts on motion, section 5.1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.ways import Way, Ways

_BACKWARD = 0.3
"""Places may fall by so much without meaning anything [m]."""

_FARTHEST_ASIDE, _FARTHEST_ALONG = 4.0, 1.0
"""A sample further from its place on its lane is not on it [m]."""

Chain = list[tuple[str, float]]
"""Lanes and the stations of their beginnings, in order."""


@dataclass(frozen=True, slots=True)
class Switch:
    """A change of lanes between two samples.

    Attributes:
        step: Number of the sample before it.
        share: Where between the samples it is taken to lie, in (0, 1).
    """

    step: int
    share: float


@dataclass(slots=True, eq=False)
class LaneRun:
    """Samples whose lanes are known from one to the next; filled sample by sample.

    Attributes:
        first: Number of its first sample.
        stations: Of its samples [m].
        chains: At least one.
        own: Number of each sample's chain.
        switches: One between each chain and the next; steps count from the run's first sample.
    """

    first: int
    stations: list[float]
    chains: list[Chain]
    own: list[int] = field(default_factory=lambda: [0])
    switches: list[Switch] = field(default_factory=list)

    def drive(self, station: float) -> None:
        """Add a sample on the chain of the one before."""
        self.stations.append(max(station, self.stations[-1]))
        self.own.append(len(self.chains) - 1)

    def follow(self, ways: Ways, way: Way, places: tuple[float, float]) -> None:
        """Add a sample at the end of a way."""
        step, changes = len(self.stations) - 1, sum(hop.beside for hop in way.hops)
        name, begin = self.chains[-1][-1]
        made = 0
        for number, hop in enumerate(way.hops[1:], 1):
            if hop.beside:
                made += 1
                if all(other.beside for other in way.hops[1:number]):
                    # Lanes beside each other inside a junction differ in length.
                    longer = ways.length(hop.lane) / max(ways.length(name), 1e-9)
                    begin += (self.stations[-1] - begin) * (1.0 - longer)
                self.chains.append([])
                self.switches.append(Switch(step, made / (changes + 1)))
            else:
                begin += ways.length(name)
            self.chains[-1].append((hop.lane, begin))
            name = hop.lane
        self.drive(begin + places[1])

    @property
    def last(self) -> int:
        """Number of its last sample."""
        return self.first + len(self.stations) - 1


def follow(
    samples: LoggedSamples, setting: Setting, *, trusted: bool = False
) -> tuple[list[LaneRun], dict[int, str]]:
    """Find the lanes that a stretch of samples drove along.

    Args:
        samples: With places in metres as lanes are drawn.
        setting: Knows the lanes.
        trusted: Whether samples are taken to be where their lanes and places say.

    Returns:
        Runs of two samples or more, in order; and why a step lies in none of them, by the
        number of its first sample.
    """
    ways = setting.ways
    if ways is None:
        return [], dict.fromkeys(range(len(samples.times) - 1), "no lanes")
    on = _named(samples, setting, ways)
    if not trusted:
        on &= _on_lanes(samples, setting, ways)
    runs: list[LaneRun] = []
    failed: dict[int, str] = {}
    run: LaneRun | None = None
    for step, reason, way in _steps(samples, setting, ways, on):
        if reason:
            failed[step] = reason
            run = None
            continue
        places = (float(samples.offsets[step]), float(samples.offsets[step + 1]))
        if run is None:
            run = LaneRun(step, [places[0]], [[(setting.lane_names[samples.lanes[step]], 0.0)]])
            runs.append(run)
        if way is None:
            run.drive(run.chains[-1][-1][1] + places[1])
        else:
            run.follow(ways, way, places)
    return runs, failed


def stretches_of(samples: LoggedSamples, setting: Setting, ways: Ways) -> Floats:
    """How much longer the lane of each sample is than SUMO says, (n,)."""
    found = np.ones(len(samples.times))
    for lane, which in _groups(samples.lanes):
        name = setting.lane_names[lane] if lane >= 0 else ""
        if name in ways:
            found[which] = ways.stretch(name)
    return found


def _steps(
    samples: LoggedSamples, setting: Setting, ways: Ways, on: Bools
) -> Iterator[tuple[int, str, Way | None]]:
    """For each step why it has no way, or its way; None where it stays on its lane."""
    moved = np.diff(samples.offsets)
    stays = (np.diff(samples.lanes) == 0) & (moved >= -_BACKWARD) & on[:-1] & on[1:]
    expected = expected_ways(samples, euler=setting.euler)
    for step in range(len(moved)):
        if stays[step]:
            yield step, "", None
        elif samples.lanes[step] < 0 or samples.lanes[step + 1] < 0:
            yield step, "no lanes", None
        elif not (on[step] and on[step + 1]):
            yield step, "off lane", None
        else:
            way = _way(samples, setting, ways, step, float(expected[step]))
            yield step, "" if way else "no way", way


def _way(
    samples: LoggedSamples, setting: Setting, ways: Ways, step: int, expected: float
) -> Way | None:
    """The way from a sample to the next, if its length fits the speeds."""
    first, last = (setting.lane_names[samples.lanes[step + k]] for k in (0, 1))
    if first == last:
        return None
    places = (float(samples.offsets[step]), float(samples.offsets[step + 1]))
    found = ways.between(first, last, places=places, expected=expected)
    if found is None:
        return None
    way, length = found
    slack = 2.0 + 0.5 * expected + 1.5 * float(samples.times[step + 1] - samples.times[step]) ** 2
    return way if abs(length - expected) <= slack and length >= -_BACKWARD else None


def expected_ways(samples: LoggedSamples, *, euler: bool) -> Floats:
    """How far each step should lead, from the speeds or else from the places, (n - 1,) [m]."""
    straight = np.linalg.norm(np.diff(samples.positions[:, :2], axis=0), axis=1)
    speeds = samples.speeds[1:] if euler else (samples.speeds[1:] + samples.speeds[:-1]) / 2.0
    told = speeds * np.diff(samples.times)
    return np.where(np.isfinite(told), told, straight)


def is_astray(off: Floats) -> bool:
    """Whether samples are not where their lanes and places say.

    Args:
        off: How far they are along and aside of them, (n, 2) [m].
    """
    return bool((np.abs(off) > (_FARTHEST_ALONG, _FARTHEST_ASIDE)).any())


def _named(samples: LoggedSamples, setting: Setting, ways: Ways) -> Bools:
    """Which samples have a lane of the network and a place, (n,)."""
    named = np.isfinite(samples.offsets)
    for lane, which in _groups(samples.lanes):
        named[which] &= lane >= 0 and setting.lane_names[lane] in ways
    return named


def _on_lanes(samples: LoggedSamples, setting: Setting, ways: Ways) -> Bools:
    """Which samples are where their lane and place say, (n,)."""
    on = np.zeros(len(samples.times), dtype=np.bool_)
    for lane, which in _groups(samples.lanes):
        name = setting.lane_names[lane] if lane >= 0 else ""
        if name not in ways:
            continue
        stations, shape = ways.stations(name), ways.lane(name).shape
        spots = samples.positions[which, :2] - shape[0, :2]
        places = samples.offsets[which]
        index = np.clip(np.searchsorted(stations, places, side="right") - 1, 0, len(shape) - 2)
        steps = np.diff(shape[:, :2], axis=0)[index]
        lengths = np.maximum(stations[index + 1] - stations[index], 1e-9)
        share = np.clip((places - stations[index]) / lengths, 0.0, 1.0)
        away = spots - (shape[index, :2] - shape[0, :2] + share[:, None] * steps)
        steps = steps / np.maximum(np.linalg.norm(steps, axis=1), 1e-9)[:, None]
        along = np.abs((away * steps).sum(axis=1))
        aside = np.abs(steps[:, 0] * away[:, 1] - steps[:, 1] * away[:, 0])
        # Near a corner what is aside of one stretch is along the next.
        near = np.linalg.norm(away, axis=1) <= _FARTHEST_ALONG
        on[which] = (near | ((along <= _FARTHEST_ALONG) & (aside <= _FARTHEST_ASIDE))) & (
            np.isfinite(places)
        )
    return on


def _groups(lanes: Ints) -> Iterator[tuple[int, slice]]:
    """Stretches of samples on one lane."""
    cuts = [0, *(np.flatnonzero(np.diff(lanes)) + 1).tolist(), len(lanes)]
    for first, last in pairwise(cuts):
        yield int(lanes[first]), slice(first, last)
