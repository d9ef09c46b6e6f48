"""Rails of trams and trains, and sleepers where trains run on ballast."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.library.materials.by_key import KERB
from sumo3dviz_pt.library.mesh.bands import band_along
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.markings.lines import Paint
from sumo3dviz_pt.world.roads.strips import Strip, lane_line
from sumo3dviz_pt.world.roads.style import BALLAST

STEEL = "steel"

GAUGE = 1.435
"""Standard gauge between the rails' inner faces [m] (UIC 510)."""

_HEAD = 0.07
"""Width of a rail's head [m]."""

_SLEEPER = (0.26, 0.34)
"""Width of a sleeper and of the gap to the next one [m]."""

_SLEEPER_LENGTH = 2.6
"""[m]"""


def rail_strips(layout: RoadLayout) -> list[Strip]:
    """Return all lanes with rails, inside junctions too."""
    strips = [strip for group in layout.strips.values() for strip in group]
    strips += [strip for inside in layout.insides.values() for strip in inside.ways]
    return [strip for strip in strips if strip.look.rails]


def rail_paint(layout: RoadLayout) -> list[Paint]:
    """Paint two flush rails per lane."""
    inner, outer = 0.5 * GAUGE, 0.5 * GAUGE + _HEAD
    paint = []
    for strip in rail_strips(layout):
        line = lane_line(strip.lane)
        sides = [(-outer, -inner), (inner, outer)]
        quads: list[Floats] = [band_along(line, right=r, left=g).whole() for r, g in sides]
        paint.append(Paint(strip.lane.edge_id, STEEL, np.concatenate(quads)))
    return paint


def sleeper_paint(layout: RoadLayout) -> list[Paint]:
    """Paint sleepers under rails on ballast."""
    width, gap = _SLEEPER
    half = 0.5 * _SLEEPER_LENGTH
    return [
        Paint(
            strip.lane.edge_id,
            KERB,
            band_along(lane_line(strip.lane), right=-half, left=half).dashes(dash=width, gap=gap),
        )
        for strip in rail_strips(layout)
        if strip.look.surface == BALLAST and not strip.lane.id.startswith(":")
    ]
