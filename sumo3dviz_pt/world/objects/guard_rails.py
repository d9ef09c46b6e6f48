"""Guard rails beside fast roads where a scenario brings no fences of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.library.mesh.polyline import densified
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.scene import LeftOut
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.plants.build import is_fast
from sumo3dviz_pt.world.street.places import borders_near

FAMILY = "guard rails"
"""What users call them."""

REACH = 520.0
"""Rails stand at most this far from a camera [m]."""

OFF = 0.85
"""Distance of rails from the asphalt [m]."""

SOURCE = "guard_rails"
"""The `source` of rails that are put up."""

_WEDGE = 1.0  # gaps between carriageways narrower than twice this hold none, beside `OFF` [m]
_SHORTEST = 40.0  # length of a rail, at least [m]
_STEP = 8.0  # distance between its points, at most [m]
_BRIDGE, _COVER = 0.9, 2.5  # roads so far above or below the ground have parapets or walls [m]


@dataclass(frozen=True, slots=True)
class Rails:
    """Guard rails that are put up.

    Attributes:
        polygons: Their lines.
        left_out: Why there are none.
    """

    polygons: tuple[Polygon, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def guard_rails(
    network: Network,
    paved: Sequence[shapely.Polygon],
    polygons: Sequence[Polygon],
    *,
    around: Surroundings,
) -> Rails:
    """Build rails along the fast roads around a shot's cameras, as lines.

    Args:
        network: Its fast edges get rails.
        paved: Outlines of all roads.
        polygons: The scenario's: where it has fences, there are no others.
        around: Cameras; without any there are no rails.
    """
    if any(kind_of(item.type, item.source) == "fences" for item in polygons):
        return Rails(left_out=(LeftOut(FAMILY, "the scenario has fences of its own"),))
    lanes = _fast_lanes(network, around)
    found = _rails_along(lanes, paved, around) if lanes else []
    if not found:
        return Rails(left_out=(LeftOut(FAMILY, "no fast road near the camera has a free side"),))
    order = np.argsort([float(item.shape[0].sum()) for item in found], kind="stable")
    return Rails(tuple(found[int(k)] for k in order))


def _fast_lanes(network: Network, around: Surroundings) -> list[Lane]:
    """Lanes of fast roads near the cameras."""
    near = borders_near(network, around, reach=REACH) if len(around.viewpoints) else []
    return [lane for border in near if is_fast(border) for lane in border.edge.lanes]


def _rails_along(
    lanes: Sequence[Lane], paved: Sequence[shapely.Polygon], around: Surroundings
) -> list[Polygon]:
    """Rails beside the asphalt where lanes are its border."""
    low, high = around.viewpoints[:, :2].min(axis=0), around.viewpoints[:, :2].max(axis=0)
    box = (*(low - REACH), *(high + REACH))
    near = [area for area in shapely.clip_by_rect(list(paved), *box) if not area.is_empty]
    fast = union(
        [
            shapely.LineString(line[:, :2]).buffer(lane.width / 2.0, cap_style="flat")
            for lane in lanes
            for line in _on_ground(lane.shape, around)
        ]
    )
    # Closing small gaps ends rails before the sharp wedges where ramps leave.
    sides = union(near).buffer(OFF + _WEDGE).buffer(-_WEDGE).boundary
    edge = shapely.box(*box).boundary.buffer(2.0)
    sides = shapely.difference(shapely.intersection(sides, fast.buffer(OFF + 0.6)), edge)
    lines = shapely.get_parts(shapely.line_merge(sides))
    found: list[Polygon] = []
    for line in lines:
        shape = shapely.get_coordinates(shapely.segmentize(line.simplify(0.04), _STEP))
        if line.length > _SHORTEST and len(shape) > 1:
            found.append(Polygon(f"rail:{len(found)}", "guard_rail", shape, False, None, SOURCE))
    return found


def _on_ground(line: Floats, around: Surroundings) -> list[Floats]:
    """The stretches of a lane that are on no bridge and in no tunnel, (n, 3) [m] each."""
    dense = densified(line, _STEP)
    above = around.height_at(dense[:, :2]) - dense[:, 2]
    free = (above > -_BRIDGE) & (above < _COVER)
    if free.all():
        return [line] * (len(line) > 1)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int64)))
    return [dense[a:b] for a, b in ends.reshape(-1, 2) if b - a > 1]
