"""What traffic does to lanes: polished wheel tracks and an oil stripe between them.

References:
    Places and strengths: docs/facts/look.md, "Roads", matched by eye to dash-cam pictures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.world.roads.cells import Polygons, quad_polygons
from sumo3dviz_pt.world.roads.graded import NOTHING, Graded, graded_on, joined, whole_quads
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, distance_to

TRACK_PLACE, TRACK_WIDTH, TRACK_LOSS = 0.85, 0.30, 0.17
"""Wheel tracks: distance from the lane's middle [m], Gaussian width [m], lost brightness."""

OIL_WIDTH, OIL_LOSS = 0.27, 0.34
"""Drips along the lane's middle: Gaussian width [m], lost brightness."""

_FINE = (0.0, 0.16, 0.34, 0.55, 0.85, 1.15, 1.5)
"""Distances from the middle [m] at which vertices stand, near the camera."""

_COARSE = (0.0, 0.38, 0.85, 1.5)
"""The same farther away."""

_FAR = 300.0
"""From this distance to the camera's path on, fewer vertices do [m]."""

_FARTHEST = 1200.0
"""Lanes farther from the camera's path [m] show no wear."""

_QUEUE, _WAITED = (40.0, 30.0, 22.0, 16.0, 11.0, 7.0, 4.0), 0.7
"""Where wear changes before stop lines [m], and how much more of it there is at the line."""

_DUST = ((0.01, 0.16, 0.34, 0.52), (0.62, 0.72, 0.9, 1.0))
"""Distance from the road's own border [m], and brightness that dirt leaves there."""

_MOST = 1.6  # strength of wear at the most

_EDGE = 0.06
"""Distance from the lane's border at which wear has ended [m]."""

_NARROWEST = 1.0
"""Lanes less than this from middle to border are left alone [m]."""


def wear_across(distance: Floats, *, strength: float | Floats = 1.0) -> Floats:
    """Return the factor of brightness at a distance from a lane's middle [m], any shape."""
    track = np.exp(-0.5 * ((np.abs(distance) - TRACK_PLACE) / TRACK_WIDTH) ** 2)
    oil = np.exp(-0.5 * (distance / OIL_WIDTH) ** 2)
    return np.asarray((1.0 - strength * TRACK_LOSS * track) * (1.0 - strength * OIL_LOSS * oil))


def lane_wear(
    layout: RoadLayout,
    *,
    surfaces: frozenset[str],
    focus: BoundsXY | None,
    stops: frozenset[str] = frozenset(),
) -> dict[str, Graded]:
    """Build the wear of all driven lanes, by surface key.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; None takes every lane as near.
        stops: Lanes that vehicles wait on.
    """
    chosen: dict[str, list[Graded]] = {}
    first = 0
    # Cells of carriageways come first, in the order of their strips.
    for key, group in layout.strips.items():
        for strip in (s for s in group if not s.look.raised):
            cells = layout.cells.polygons[first : first + len(strip.quads)]
            first += len(strip.quads)
            if strip.look.surface in surfaces and is_driven(strip):
                strength = _strength(key, strip)
                wear = np.full((len(cells), 2), strength)
                rows = _LaneRows(strip.quads, cells, wear, strip is group[0])
                if strip.lane.id in stops:
                    rows = _queued(rows)
                worn = _worn(rows, focus=focus)
                chosen.setdefault(strip.look.surface, []).append(worn)
    return {surface: joined(pieces) for surface, pieces in chosen.items()}


def is_driven(strip: Strip) -> bool:
    """Return whether motor vehicles drive on a strip."""
    allowed = strip.lane.allowed
    return not strip.look.rails and (not allowed or bool(allowed & {"passenger", "bus", "truck"}))


def _strength(edge: str, strip: Strip) -> float:
    """How worn a lane is: it varies, and slow lanes bear the lorries."""
    return 0.75 + 0.55 * share_of(0, "wear", edge, strip.lane.id)


@dataclass(frozen=True, slots=True, eq=False)
class _LaneRows:
    """Pieces of a lane.

    Attributes:
        quads: Their corners, (n, 4, 3) [m].
        cells: What is left of each from above, (n,).
        strength: Wear at both ends, (n, 2).
        dusty: Whether the right border is the road's.
    """

    quads: Floats
    cells: Polygons
    strength: Floats
    dusty: bool

    def __getitem__(self, chosen: Bools) -> _LaneRows:
        """Some of them."""
        kept = (self.quads[chosen], self.cells[chosen], self.strength[chosen])
        return _LaneRows(*kept, self.dusty)


def _queued(rows: _LaneRows) -> _LaneRows:
    """Rows cut near the lane's end, where engines drip and tyres brake."""
    sides = rows.quads[:, [1, 2]] - rows.quads[:, [0, 3]]
    lengths = np.linalg.norm(sides[..., :2], axis=-1).mean(axis=1)
    togo = np.append(np.cumsum(lengths[::-1])[::-1], 0.0)
    whole = whole_quads(rows.quads, rows.cells)
    quads, cells, strength = [], [], []
    for k, quad in enumerate(rows.quads):
        cuts = [mark for mark in _QUEUE if togo[k + 1] + 0.05 < mark < togo[k] - 0.05]
        marks = np.array([togo[k], *(cuts if whole[k] else ()), togo[k + 1]])
        at = (togo[k] - marks) / max(lengths[k], 1e-6)
        right = quad[0] + at[:, None] * (quad[1] - quad[0])
        left = quad[3] + at[:, None] * (quad[2] - quad[3])
        pieces = np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)
        quads.append(pieces)
        cells.append(quad_polygons(pieces) if len(pieces) > 1 else rows.cells[k : k + 1])
        more = rows.strength[k, 0] * (1.0 + _WAITED * np.exp(-np.maximum(marks - 4.0, 0.0) / 14.0))
        more = np.minimum(more, _MOST)
        strength.append(np.stack([more[:-1], more[1:]], axis=1))
    return _LaneRows(
        np.concatenate(quads), np.concatenate(cells), np.concatenate(strength), rows.dusty
    )


def _worn(rows: _LaneRows, *, focus: BoundsXY | None) -> Graded:
    """One strip's wear: fine columns near, coarse ones farther away, none beyond."""
    away = distance_to(focus, rows.quads.mean(axis=1))
    pieces = []
    for stations, chosen in (
        (_FINE, away < _FAR),
        (_COARSE, (away >= _FAR) & (away < _FARTHEST)),
    ):
        if chosen.any():
            pieces.append(_columned(rows[chosen], stations))
    return joined(pieces)


def _columned(rows: _LaneRows, stations: tuple[float, ...]) -> Graded:
    """Quads with columns at distances from their middle."""
    # Leave out what is too narrow.
    quads = rows.quads
    width = np.linalg.norm((quads[:, [3, 2]] - quads[:, [0, 1]])[..., :2], axis=-1).min(axis=1)
    half = np.minimum(0.5 * width - (_DUST[0][-1] if rows.dusty else _EDGE), stations[-1])
    keep = half > _NARROWEST
    if not keep.any():
        return NOTHING
    rows, width, half = rows[keep], width[keep], half[keep]
    # Wear on both sides of the middle.
    out = np.array(stations)[None] * (half / stations[-1])[:, None]
    place = np.concatenate([-out[:, :0:-1], out], axis=1)
    wear = np.zeros((len(place), 2, place.shape[1], 3))
    wear[..., 0] = wear_across(place[:, None], strength=rows.strength[..., None])
    wear[:, :, [0, -1], 0] = 1.0
    # Dust along the road's own border.
    if rows.dusty:
        away, factor = (np.array(values) for values in _DUST)
        place = np.concatenate([away[:-1] - 0.5 * width[:, None], place], axis=1)
        dust = np.zeros((len(place), 2, len(away) - 1, 3))
        dust[..., 0] = factor[:-1]
        wear = np.concatenate([dust, wear], axis=2)
    shares = 0.5 + place / width[:, None]
    return graded_on(rows.quads, shares, wear, polygons=rows.cells)
