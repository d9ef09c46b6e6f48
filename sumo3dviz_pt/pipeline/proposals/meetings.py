"""Keeps proposed cameras away from roads that cross at one height without a junction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.model.vectors import unit
from sumo3dviz_pt.pipeline.proposals.eyes import RATIO, Poses, frame
from sumo3dviz_pt.pipeline.proposals.movement import Movement
from sumo3dviz_pt.sumo.repairs.at_grade import crossings_at_grade

_AVOIDED = 60.0
"""Who drives nearer than this to such a crossing plays no part [m]."""

_SEEN = 150.0
"""Cars that pass through each other farther away than this are small in a picture [m]."""


def meetings_of(network: Network) -> Floats:
    """Return where roads cross at one height without a junction, (n, 3) [m]."""
    return np.array([each.place for each in crossings_at_grade(network)]).reshape(-1, 3)


def apart(movement: Movement, meetings: Floats) -> Movement:
    """Return the rows away from places where roads meet, (n, 3) [m]; all if none are."""
    if not len(meetings) or not len(movement.times):
        return movement
    away = movement.where(_away(movement.places, meetings))
    return away if len(away.times) else movement


def riding_apart(traces: Sequence[Trace], meetings: Floats) -> list[Trace]:
    """Return those who never come to places where roads meet, (n, 3) [m]."""
    if not len(meetings):
        return list(traces)
    return [trace for trace in traces if _away(trace.positions, meetings).all()]


def shows_none(poses: Poses, meetings: Floats) -> Bools:
    """Return which pictures show none of the places where roads meet, (k,).

    Args:
        poses: k of them.
        meetings: (n, 3) [m].
    """
    forwards = unit(poses.aims - poses.eyes)
    rights, ups = frame(forwards)
    way = meetings[None] - poses.eyes[:, None]
    ahead, x, y = (np.einsum("knc,kc->kn", way, axis) for axis in (forwards, rights, ups))
    half = np.tan(np.radians(poses.fov) / 2.0) * np.maximum(ahead, 0.0)
    near = (ahead > 0.0) & (np.linalg.norm(way, axis=2) < _SEEN)
    shown = near & (np.abs(x) < half) & (np.abs(y) < RATIO * half)
    return np.asarray(~shown.any(axis=1))


def _away(places: Floats, meetings: Floats) -> Bools:
    """Which places, (k, 3), are away from all of some others, (n, 3) [m], in plan."""
    far, _ = cKDTree(meetings[:, :2]).query(places[:, :2])
    return np.asarray(far > _AVOIDED)
