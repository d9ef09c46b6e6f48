"""Words on lanes that only buses may use."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sumo3dviz_pt.library.mesh.bands import on_lane
from sumo3dviz_pt.library.street.road_styles import BusLanePaint
from sumo3dviz_pt.library.street.strokes import lettering
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.world.rails.guards import only_rails
from sumo3dviz_pt.world.roads.markings.lines import PAINTS, Paint
from sumo3dviz_pt.world.roads.strips import Strip

_FIRST, _ENDS = 8.0, 12.0
"""From a lane's begin to the first word, and free length before its end [m]."""

_APART = 1.2
"""Between words of one text, as a share of a letter's height."""

_SHARE = 0.62
"""Width of a word, as a share of the lane's."""


def is_bus_lane(lane: Lane) -> bool:
    """Return whether buses may use a lane and cars may not."""
    return bool(lane.allowed & {"bus", "coach"}) and not (
        "passenger" in lane.allowed or only_rails(lane)
    )


def word_paint(strips: Mapping[str, tuple[Strip, ...]], style: BusLanePaint) -> list[Paint]:
    """Write a text on all bus lanes, upright for their drivers."""
    return [
        Paint(edge, PAINTS[style.colour], on_lane(quads, _middle(strip)))
        for edge, group in strips.items()
        for strip in group
        if strip.look.lines and is_bus_lane(strip.lane)
        for quads in _texts(strip, style)
    ]


def _middle(strip: Strip) -> Floats:
    """The middle line of a strip, (n, 3) [m]."""
    return 0.5 * (strip.right + strip.left)


def _texts(strip: Strip, style: BusLanePaint) -> list[Floats]:
    """Quads of all words on a strip: along it and to the left, (n, 4, 2) [m] each."""
    stations = arc_length(_middle(strip)[:, :2])
    words = style.word.split()
    room = len(words) * style.height * (1.0 + _APART)
    if np.min(np.diff(stations), initial=1.0) < 1e-6:
        return []
    starts = np.arange(_FIRST, stations[-1] - _ENDS - room, style.every)
    flat = [_word(word, style.height, _SHARE * strip.look.width) for word in words]
    each = style.height * (1.0 + _APART)
    return [
        quads + np.array([start + k * each, 0.0])
        for start in starts.tolist()
        for k, quads in enumerate(flat)
    ]


def _word(word: str, height: float, width: float) -> Floats:
    """Quads of a word that begins at the origin, (n, 4, 2) [m]; its letters are stretched."""
    flat = lettering(word, height=1.0, weight=0.17)
    low, high = flat.reshape(-1, 2).min(axis=0), flat.reshape(-1, 2).max(axis=0)
    share = (flat - low) / (high - low)
    along, left = height * share[..., 1], width * (0.5 - share[..., 0])
    triangles = np.stack([along, left], axis=-1)
    return np.concatenate([triangles, triangles[:, 2:]], axis=1)
