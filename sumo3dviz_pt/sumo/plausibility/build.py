"""Judge a vehicle log by a sample of its rows."""

from __future__ import annotations

from collections import Counter

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import TrafficLog
from sumo3dviz_pt.sumo.plausibility.movement import (
    movement_findings,
    stray_findings,
    time_findings,
)
from sumo3dviz_pt.sumo.plausibility.places import place_findings
from sumo3dviz_pt.sumo.plausibility.sample import Finding, sample_of

_MESOSCOPIC = 0.8
"""Share of vehicles' rows that name edges instead of lanes in a mesoscopic log."""


def findings(log: TrafficLog, network: Network) -> tuple[Finding, ...]:
    """Return what seems wrong with a log.

    Args:
        log: The log, or a window of it.
        network: The roads that it belongs to.
    """
    if _mesoscopic(log, network):
        text = (
            "this is a log of a mesoscopic simulation, which knows the edges of vehicles but"
            " neither their lanes nor their places; run SUMO without --mesosim"
        )
        return (Finding("mesoscopic", text, hopeless=True),)
    sample = sample_of(log)
    misplaced = place_findings(sample, log.lane_names, network)
    # Directions and speeds of misplaced vehicles follow from what is wrong with their places.
    found = misplaced or movement_findings(sample)
    if any(each.about in ("times", "leaps") for each in found):
        return found
    return (*found, *time_findings(log), *stray_findings(log))


def _mesoscopic(log: TrafficLog, network: Network) -> bool:
    """Return whether vehicles are logged with edges instead of lanes."""
    rows = Counter(
        log.lane_names[int(trace.lanes[0])]
        for trace in log.traces
        if trace.kind == "vehicle" and trace.lanes[0] >= 0
    )
    edges = sum(
        n for name, n in rows.items() if name in network.edges and name not in network.lanes
    )
    return edges > _MESOSCOPIC * rows.total()
