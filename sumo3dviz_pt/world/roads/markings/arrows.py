"""Arrows on lanes that lead different ways out of a junction."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sumo3dviz_pt.library.mesh.bands import band_along, on_lane
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.world.roads.markings.lines import WHITE, Paint
from sumo3dviz_pt.world.roads.strips import Strip
from sumo3dviz_pt.world.roads.wear.lanes import is_driven

_ENDS = (9.0, 34.0)
"""Distance of the arrows' tips from the lane's end [m]."""

_SHORTEST = 14.0
"""Length of free lane before an arrow's tip, at least [m]."""

_LENGTH, _SHAFT, _HEAD, _WING = 5.0, 0.16, 1.6, 0.42
"""Length, width of the shaft, length of the head and half its width [m]; towns."""

_TURN_ONLY = (
    ((0.0, 0.0), (2.3, 0.0), (2.8, 0.12), (3.1, 0.44)),
    ((2.70, 0.42), (3.50, 0.42), (3.30, 1.25)),
)
_TURN_TOO = (((1.0, 0.0), (1.7, 0.2), (2.0, 0.44)), ((1.60, 0.42), (2.40, 0.42), (2.25, 1.2)))
"""Shaft and head of arrows to the left: along the lane and to the left [m]."""

_SIDES = {"s": "s", "l": "l", "L": "l", "r": "r", "R": "r"}


def arrow_paint(network: Network, strips: Mapping[str, tuple[Strip, ...]]) -> list[Paint]:
    """Paint arrows before junctions where the lanes of an edge lead different ways."""
    ways = _directions(network)
    paint = []
    for edge, group in strips.items():
        lanes = [strip for strip in group if strip.look.lines and is_driven(strip)]
        shown = [ways.get(strip.lane.id, "") for strip in lanes]
        if len(lanes) < 2 or len(set(shown)) < 2:
            continue
        for strip, sides in zip(lanes, shown, strict=True):
            paint += [Paint(edge, WHITE, quads) for quads in _arrows(strip, sides) if len(quads)]
    return paint


def _directions(network: Network) -> dict[str, str]:
    """Where each lane leads: some of `l`, `r` and `s`, by lane id."""
    found: dict[str, set[str]] = {}
    for connection in network.connections:
        side = _SIDES.get(connection.direction)
        if side is not None:
            found.setdefault(connection.from_lane, set()).add(side)
    return {lane: "".join(sorted(sides)) for lane, sides in found.items()}


def _arrows(strip: Strip, sides: str) -> list[Floats]:
    """Quads of all arrows on a strip."""
    middle = 0.5 * (strip.right + strip.left)
    stations = arc_length(middle[:, :2])
    if not sides or np.min(np.diff(stations), initial=1.0) < 1e-6:
        return []
    tips = [stations[-1] - away for away in _ENDS if stations[-1] - away > _SHORTEST]
    flat = [quad for side in sides for quad in _arrow(side, alone=len(sides) == 1)]
    return [on_lane(np.array(flat) + np.array([tip - _LENGTH, 0.0]), middle) for tip in tips]


def _arrow(side: str, *, alone: bool) -> list[Floats]:
    """Quads of one arrow, each (4, 2) [m]: along the lane, to the left."""
    half = 0.5 * _SHAFT
    if side == "s":
        neck = _LENGTH - _HEAD
        shaft = [[0, -half], [neck, -half], [neck, half], [0, half]]
        head = [[neck, -_WING], [_LENGTH, 0], [_LENGTH, 0], [neck, _WING]]
        return [np.array(shaft, float), np.array(head, float)]
    bend, tip = _TURN_ONLY if alone else _TURN_TOO
    line = np.array([[along, aside, 0.0] for along, aside in bend])
    ribbon = band_along(line, right=-half, left=half).whole()[..., :2]
    quads = [*ribbon, np.array([*tip, tip[-1]])]
    return quads if side == "l" else [_mirrored(quad) for quad in quads]


def _mirrored(quad: Floats) -> Floats:
    """A quad on the other side of the lane's middle, still counter-clockwise."""
    return quad[[3, 2, 1, 0]] * [1.0, -1.0]
