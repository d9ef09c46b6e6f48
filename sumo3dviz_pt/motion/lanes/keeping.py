"""How far road users are from the centres of their lanes, as logged and as shown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Lane
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.motion import measures
from sumo3dviz_pt.motion.lanes.graph import LaneGraph

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
        found = np.full(len(times), np.nan)
        lines = [lane.shape[:, :2] for lane in self.lanes_of(trace)]
        if len(trace.times) < 2 or not lines:
            return found
        logged = np.abs(measures.offsets(trace.positions[:, :2], lines))
        step = np.clip(np.searchsorted(trace.times, times, side="right") - 1, 0, len(logged) - 2)
        asked = self._linked(trace)[step] & ~_aside(trajectory, times)
        shown = np.abs(measures.offsets(places[asked], lines))
        around = np.maximum(logged[:-1], logged[1:])[step[asked]]
        found[asked] = np.maximum(shown - around, 0.0)
        return found

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
    found = np.zeros(len(times), dtype=np.bool_)
    for remark in trajectory.remarks:
        if remark.kind in _ASIDE:
            found |= (times >= remark.begin) & (times <= remark.end)
    return found
