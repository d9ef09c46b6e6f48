"""Bicycles painted on bicycle lanes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sumo3dviz_pt.library.mesh.bands import band_along, on_lane
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.world.roads.markings.lines import WHITE, Paint
from sumo3dviz_pt.world.roads.strips import Strip

_EACH, _FIRST, _ENDS = 48.0, 14.0, 8.0
"""Distance of symbols, of the last one from the lane's end, and what stays free [m]."""

_STROKE = 0.065
_REAR, _FRONT = (-0.30, 0.42), (0.30, 0.42)
_CRANK, _SEAT, _HEAD = (-0.05, 0.42), (-0.14, 1.08), (0.19, 1.12)
_STROKES = (
    (_REAR, _CRANK, _HEAD, (-0.11, 0.95), _CRANK),
    (_REAR, (-0.11, 0.95)),
    (_FRONT, _HEAD, (0.15, 1.32), (0.28, 1.36)),
    ((-0.11, 0.95), _SEAT),
    ((-0.26, 1.1), (-0.03, 1.1)),
)
"""A bicycle seen from its right, to the right and along the lane [m]; twice as long as wide."""

_WHEEL = (0.19, 0.36)
_NARROWEST = 1.15


def cycle_paint(strips: Mapping[str, tuple[Strip, ...]], surface: str) -> list[Paint]:
    """Paint a bicycle every 48 m on each bicycle lane of a surface, upright for cyclists on it."""
    return [
        Paint(edge, WHITE, quads)
        for edge, group in strips.items()
        for strip in group
        if strip.look.surface == surface and strip.look.lines and strip.look.width >= _NARROWEST
        for quads in _symbols(strip)
    ]


def _symbols(strip: Strip) -> list[Floats]:
    """Quads of all symbols on a strip."""
    middle = 0.5 * (strip.right + strip.left)
    stations = arc_length(middle[:, :2])
    if np.min(np.diff(stations), initial=1.0) < 1e-6:
        return []
    flat = _bicycle()
    at = np.arange(stations[-1] - _FIRST, _ENDS, -_EACH)
    return [on_lane(flat + np.array([start, 0.0]), middle) for start in at]


def _bicycle() -> Floats:
    """Quads of one symbol: along the lane and to the left, (n, 4, 2) [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, 17)
    ring = np.column_stack([_WHEEL[0] * np.cos(turn), _WHEEL[1] * np.sin(turn)])
    lines = [np.array(stroke) for stroke in _STROKES]
    lines += [ring + middle for middle in (_REAR, _FRONT)]
    quads = []
    for line in lines:
        path = np.column_stack([line[:, 1], -line[:, 0], np.zeros(len(line))])
        band = band_along(path, right=-0.5 * _STROKE, left=0.5 * _STROKE)
        quads.append(band.whole()[..., :2])
    return np.concatenate(quads)
