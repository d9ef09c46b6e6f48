"""Joints between kerb stones near the camera."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.scene.roads_layout import RoadLayout
from sumo3dviz_pt.scene.roads_mesh import KERB_WIDTH, SIDEWALK_HEIGHT, area_rings
from sumo3dviz_pt.scene.roads_strips import BoundsXY
from sumo3dviz_pt.scene.roads_wear import distance_to
from sumo3dviz_pt.shapes.polyline import arc_length

JOINT = "kerb_joint"
"""The material of joints."""

_STONE = 1.0
"""Length of a kerb stone [m]."""

_GAP, _LIFT = 0.008, 0.0015
"""Width of a joint, and how far it lies before its stone [m]."""

_FARTHEST = 90.0
"""Kerbs farther from the camera's path [m] show none."""


def kerb_joints(layout: RoadLayout, *, focus: BoundsXY | None) -> Mesh:
    """Dark strips across tops and faces of kerbs; none without a focus."""
    quads = [np.zeros((0, 4, 3))]
    rings = area_rings(layout.raised, layout.cells, above=SIDEWALK_HEIGHT)
    for ring in rings if focus is not None else ():
        if distance_to(focus, ring).min() < _FARTHEST:
            quads.append(_of_ring(np.concatenate([ring, ring[:1]]), focus))
    corners = np.concatenate(quads)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = 4 * np.arange(len(corners))[:, None, None] + halves
    return Mesh(corners.reshape(-1, 3), faces.reshape(-1, 3))


def _of_ring(line: Floats, focus: BoundsXY | None) -> Floats:
    """Joints along a closed outline, the stones to its left, (n, 4, 3) [m]."""
    stations = arc_length(line)
    at = np.arange(0.5 * _STONE, stations[-1], _STONE)
    segment = np.clip(np.searchsorted(stations, at, side="right") - 1, 0, len(line) - 2)
    step = (line[1:] - line[:-1])[segment]
    length = np.maximum(np.linalg.norm(step[:, :2], axis=1, keepdims=True), 1e-9)
    ahead = step / length
    foot = line[segment] + (at - stations[segment])[:, None] * ahead
    near = (distance_to(focus, foot) < _FARTHEST) & (length[:, 0] > 2 * _GAP)
    foot, ahead = foot[near], ahead[near]
    out = np.column_stack([ahead[:, 1], -ahead[:, 0], np.zeros(len(ahead))])
    up = np.array([0.0, 0.0, 1.0])
    edge = foot + _LIFT * (out + up)
    before, after = edge - 0.5 * _GAP * ahead, edge + 0.5 * _GAP * ahead
    back = (KERB_WIDTH + _LIFT) * out
    top = np.stack([before, after, after - back, before - back], axis=1)
    down = (SIDEWALK_HEIGHT - 0.01) * up
    face = np.stack([before - down, after - down, after, before], axis=1)
    return np.concatenate([top, face])
