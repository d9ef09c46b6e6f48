"""What traffic does to lanes: polished wheel tracks and an oil stripe between them.

References:
    Places and strengths: facts/look.md section 2.2, matched by eye to dash-cam pictures.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.scene.chance import share_of
from sumo3dviz_pt.scene.roads_cells import Polygons
from sumo3dviz_pt.scene.roads_graded import NOTHING, Graded, graded_on, joined
from sumo3dviz_pt.scene.roads_layout import RoadLayout
from sumo3dviz_pt.scene.roads_strips import BoundsXY, Strip

TRACK_PLACE, TRACK_WIDTH, TRACK_LOSS = 0.85, 0.30, 0.17
"""Wheel tracks: distance from the lane's middle [m], Gaussian width [m], lost brightness."""

OIL_WIDTH, OIL_LOSS = 0.27, 0.34
"""Drips along the lane's middle: Gaussian width [m], lost brightness."""

_FINE = (0.0, 0.16, 0.34, 0.55, 0.85, 1.15, 1.5)
"""Distances from the middle [m] at which vertices stand, near the camera."""

_COARSE = (0.0, 0.38, 0.85, 1.5)
_FAR = 300.0
"""From this distance to the camera's path on, fewer vertices do [m]."""

_FARTHEST = 1200.0
_EDGE = 0.06
"""Distance from the lane's border at which wear has ended [m]."""

_NARROWEST = 1.0
"""Lanes less than this from middle to border are left alone [m]."""


def wear_across(distance: Floats, *, strength: float = 1.0) -> Floats:
    """Factor of brightness at a distance from a lane's middle [m], any shape."""
    track = np.exp(-0.5 * ((np.abs(distance) - TRACK_PLACE) / TRACK_WIDTH) ** 2)
    oil = np.exp(-0.5 * (distance / OIL_WIDTH) ** 2)
    return np.asarray((1.0 - strength * TRACK_LOSS * track) * (1.0 - strength * OIL_LOSS * oil))


def lane_wear(
    layout: RoadLayout, *, surfaces: frozenset[str], focus: BoundsXY | None
) -> dict[str, Graded]:
    """Wear of all driven lanes, by surface key.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; None takes every lane as near.
    """
    chosen: dict[str, list[Graded]] = {}
    first = 0
    # Cells of carriageways come first, in the order of their strips.
    for key, group in layout.strips.items():
        for strip in (s for s in group if not s.look.raised):
            cells = layout.cells.polygons[first : first + len(strip.quads)]
            first += len(strip.quads)
            if strip.look.surface in surfaces and is_driven(strip):
                worn = _worn(strip, cells, focus=focus, strength=_strength(key, strip))
                chosen.setdefault(strip.look.surface, []).append(worn)
    return {surface: joined(pieces) for surface, pieces in chosen.items()}


def is_driven(strip: Strip) -> bool:
    """Whether motor vehicles drive on a strip."""
    allowed = strip.lane.allowed
    return not strip.look.rails and (not allowed or bool(allowed & {"passenger", "bus", "truck"}))


def distance_to(box: BoundsXY | None, points: Floats) -> Floats:
    """Distance from points, (n, 2 or 3), to a box [m], (n,); 0 without a box."""
    if box is None:
        return np.zeros(len(points))
    low, high = np.array(box[:2]), np.array(box[2:])
    outside = np.maximum(np.maximum(low - points[:, :2], points[:, :2] - high), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=1))


def _strength(edge: str, strip: Strip) -> float:
    """How worn a lane is: it varies, and slow lanes bear the lorries."""
    return 0.75 + 0.55 * share_of(0, "wear", edge, strip.lane.id)


def _worn(strip: Strip, cells: Polygons, *, focus: BoundsXY | None, strength: float) -> Graded:
    """One strip's wear: fine columns near, coarse ones farther away, none beyond."""
    away = distance_to(focus, strip.quads.mean(axis=1))
    pieces = []
    for stations, chosen in (
        (_FINE, away < _FAR),
        (_COARSE, (away >= _FAR) & (away < _FARTHEST)),
    ):
        quads = strip.quads[chosen]
        if len(quads):
            pieces.append(_columned(quads, cells[chosen], stations, strength))
    return joined(pieces)


def _columned(
    quads: Floats, cells: Polygons, stations: tuple[float, ...], strength: float
) -> Graded:
    """Quads with columns at distances from their middle."""
    width = np.linalg.norm((quads[:, [3, 2]] - quads[:, [0, 1]])[..., :2], axis=-1).min(axis=1)
    half = np.minimum(0.5 * width - _EDGE, stations[-1])
    keep = half > _NARROWEST
    if not keep.any():
        return NOTHING
    quads, cells, width, half = quads[keep], cells[keep], width[keep], half[keep]
    out = np.array(stations)[None] * (half / stations[-1])[:, None]
    place = np.concatenate([-out[:, :0:-1], out], axis=1)
    factor = wear_across(place, strength=strength)
    factor[:, [0, -1]] = 1.0
    wear = np.zeros((*place.shape, 3))
    wear[..., 0] = factor
    shares = 0.5 + place / width[:, None]
    return graded_on(quads, shares, np.stack([wear, wear], axis=1), polygons=cells)
