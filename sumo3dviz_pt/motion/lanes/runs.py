"""The lanes that a road user drove along, and how far along them each sample is.

A run is a row of samples whose lanes are known. It consists of chains: lanes that lead into one
another. A change of lanes begins the next chain. All chains of a run share one arc length, the
station, because SUMO counts positions alike on all lanes of an edge.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.motion.lanes.graph import LaneGraph, Route
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting

_BACKWARD = 0.3
"""Offsets along a lane may fall by this much without meaning anything [m]."""

_FARTHEST_ASIDE, _FARTHEST_ALONG = 4.0, 1.0
"""A sample is not on its lane if it is further than this from its place there [m]."""


class ChainLane(NamedTuple):
    """A lane of a chain.

    Attributes:
        name: SUMO's lane id.
        begin: Station of its beginning [m].
    """

    name: str
    begin: float


LaneChain = list[ChainLane]
"""Lanes that lead into one another, in order."""


@dataclass(frozen=True, slots=True)
class Switch:
    """A change of lanes between two samples.

    Attributes:
        step: Number of the sample before it.
        share: Its assumed time as a share of the step to the next sample, in (0, 1).
    """

    step: int
    share: float


@dataclass(slots=True, eq=False)
class LaneRun:
    """Samples whose lanes are known without a gap; it grows sample by sample.

    Attributes:
        first: Number of its first sample.
        stations: Stations of its samples [m].
        chains: Lanes that it drove along, at least one chain.
        own: Number of each sample's chain.
        switches: Changes of lanes, one between each chain and the next; their steps count
            from the run's first sample.
    """

    first: int
    stations: list[float]
    chains: list[LaneChain]
    own: list[int] = field(default_factory=lambda: [0])
    switches: list[Switch] = field(default_factory=list)

    def drive(self, station: float) -> None:
        """Add a sample on the current chain at a station [m]."""
        self.stations.append(max(station, self.stations[-1]))
        self.own.append(len(self.chains) - 1)

    def follow(self, graph: LaneGraph, route: Route, place: float) -> None:
        """Add a sample at the end of a route.

        Args:
            graph: The lanes.
            route: The route from the lane of the sample before to that of the new one.
            place: Place of the new sample along its lane [m].
        """
        step, changes = len(self.stations) - 1, sum(hop.beside for hop in route.hops)
        name, begin = self.chains[-1][-1]
        made = 0
        for number, hop in enumerate(route.hops[1:], 1):
            if hop.beside:
                made += 1
                if all(other.beside for other in route.hops[1:number]):
                    # Lanes beside each other inside a junction differ in length.
                    longer = graph.length(hop.lane) / max(graph.length(name), 1e-9)
                    begin += (self.stations[-1] - begin) * (1.0 - longer)
                self.chains.append([])
                self.switches.append(Switch(step, made / (changes + 1)))
            else:
                begin += graph.length(name)
            self.chains[-1].append(ChainLane(hop.lane, begin))
            name = hop.lane
        self.drive(begin + place)

    @property
    def last(self) -> int:
        """Number of its last sample."""
        return self.first + len(self.stations) - 1


def follow(
    samples: LoggedSamples, setting: Setting, *, trusted: bool = False
) -> tuple[list[LaneRun], dict[int, str]]:
    """Find the lanes that a stretch of samples drove along.

    Args:
        samples: Samples whose offsets count in metres of the drawn lanes.
        setting: What is known of the lanes.
        trusted: Whether samples are taken to be where their lanes and offsets say.

    Returns:
        Runs of two samples or more, in order; and for each step that lies in none of them the
        reason, by the number of the step's first sample.
    """
    graph = setting.graph
    if graph is None:
        return [], dict.fromkeys(range(len(samples.times) - 1), "no lanes")
    on = _named(samples, setting, graph)
    if not trusted:
        on &= _on_lanes(samples, setting, graph)
    runs: list[LaneRun] = []
    failed: dict[int, str] = {}
    run: LaneRun | None = None
    for step, reason, route in _steps(samples, setting, graph, on):
        if reason:
            failed[step] = reason
            run = None
            continue
        here, there = float(samples.offsets[step]), float(samples.offsets[step + 1])
        if run is None:
            name = setting.lane_names[samples.lanes[step]]
            run = LaneRun(step, [here], [[ChainLane(name, 0.0)]])
            runs.append(run)
        if route is None:
            run.drive(run.chains[-1][-1].begin + there)
        else:
            run.follow(graph, route, there)
    return runs, failed


def stretches_of(samples: LoggedSamples, setting: Setting, graph: LaneGraph) -> Floats:
    """Return the drawn length of each sample's lane as a multiple of SUMO's length, (n,).

    Args:
        samples: n samples.
        setting: Says what the samples' lanes are called.
        graph: The lanes.
    """
    found = np.ones(len(samples.times))
    for lane, which in _groups(samples.lanes):
        name = setting.lane_names[lane] if lane >= 0 else ""
        if name in graph:
            found[which] = graph.stretch(name)
    return found


class _Step(NamedTuple):
    """What leads from one sample to the next.

    Attributes:
        number: Number of the first of the two samples.
        reason: Why no route is known; empty where one is.
        route: The route to another lane; None where the step stays on its lane.
    """

    number: int
    reason: str
    route: Route | None = None


def _steps(
    samples: LoggedSamples, setting: Setting, graph: LaneGraph, on: Bools
) -> Iterator[_Step]:
    """Yield what leads from each sample to the next; `on` says which samples are on lanes."""
    moved = np.diff(samples.offsets)
    stays = (np.diff(samples.lanes) == 0) & (moved >= -_BACKWARD) & on[:-1] & on[1:]
    expected = expected_distances(samples, euler=setting.euler)
    for step in range(len(moved)):
        if stays[step]:
            yield _Step(step, "")
        elif samples.lanes[step] < 0 or samples.lanes[step + 1] < 0:
            yield _Step(step, "no lanes")
        elif not (on[step] and on[step + 1]):
            yield _Step(step, "off lane")
        else:
            route = _route(samples, setting, graph, step, float(expected[step]))
            yield _Step(step, "" if route else "no route", route)


def _route(
    samples: LoggedSamples, setting: Setting, graph: LaneGraph, step: int, expected: float
) -> Route | None:
    """Return the route from a sample to the next if its length fits the speeds, else None."""
    first, last = (setting.lane_names[samples.lanes[step + k]] for k in (0, 1))
    if first == last:
        return None
    places = (float(samples.offsets[step]), float(samples.offsets[step + 1]))
    found = graph.between(first, last, places=places, expected=expected)
    if found is None:
        return None
    route, length = found
    slack = 2.0 + 0.5 * expected + 1.5 * float(samples.times[step + 1] - samples.times[step]) ** 2
    return route if abs(length - expected) <= slack and length >= -_BACKWARD else None


def expected_distances(samples: LoggedSamples, *, euler: bool) -> Floats:
    """Return how long each step should be by its speeds, or else by its positions, (n - 1,) [m]."""
    straight = np.linalg.norm(np.diff(samples.positions[:, :2], axis=0), axis=1)
    speeds = samples.speeds[1:] if euler else (samples.speeds[1:] + samples.speeds[:-1]) / 2.0
    told = speeds * np.diff(samples.times)
    return np.where(np.isfinite(told), told, straight)


def is_astray(off: Floats) -> bool:
    """Return whether some samples are not where their lanes and offsets say.

    Args:
        off: How far samples are ahead and to the left of their places on their lanes, (n, 2) [m].
    """
    return bool((np.abs(off) > (_FARTHEST_ALONG, _FARTHEST_ASIDE)).any())


def _named(samples: LoggedSamples, setting: Setting, graph: LaneGraph) -> Bools:
    """Return which samples have a lane of the network and an offset along it, (n,)."""
    named = np.isfinite(samples.offsets)
    for lane, which in _groups(samples.lanes):
        named[which] &= lane >= 0 and setting.lane_names[lane] in graph
    return named


def _on_lanes(samples: LoggedSamples, setting: Setting, graph: LaneGraph) -> Bools:
    """Return which samples are where their lane and offset say, (n,)."""
    on = np.zeros(len(samples.times), dtype=np.bool_)
    for lane, which in _groups(samples.lanes):
        name = setting.lane_names[lane] if lane >= 0 else ""
        if name not in graph:
            continue
        # Find the place on the lane's polyline that each offset means.
        stations, shape = graph.stations(name), graph.lane(name).shape
        spots = samples.positions[which, :2] - shape[0, :2]
        places = samples.offsets[which]
        index = np.clip(np.searchsorted(stations, places, side="right") - 1, 0, len(shape) - 2)
        steps = np.diff(shape[:, :2], axis=0)[index]
        lengths = np.maximum(stations[index + 1] - stations[index], 1e-9)
        share = np.clip((places - stations[index]) / lengths, 0.0, 1.0)
        # Split the difference to that place into along and aside.
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
    """Yield the number of a lane and the samples on it, stretch by stretch."""
    cuts = [0, *(np.flatnonzero(np.diff(lanes)) + 1).tolist(), len(lanes)]
    for first, last in pairwise(cuts):
        yield int(lanes[first]), slice(first, last)
