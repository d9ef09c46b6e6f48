"""Objects along lines: guard rails, hedges, fences, barriers.

Guard rails stand beside fast roads where a scenario brings no fences of its own. Hedges have gaps
where carriageways cross them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.mesh.bands import densified
from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.library.plants.greenery import LEAF, HedgeSize, hedge
from sumo3dviz_pt.library.street import barriers
from sumo3dviz_pt.library.street.barriers import MODELS as BARRIERS
from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, belonging
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.random import dice_of, share_of
from sumo3dviz_pt.model.scene import LeftOut, Part
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import FENCES, INVENTED, Kind, Staging, colour_in, kind_of
from sumo3dviz_pt.world.placement.lanes import LaneIndex
from sumo3dviz_pt.world.placement.surroundings import Surroundings, thing_of
from sumo3dviz_pt.world.plants.trees import is_fast
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
_GUARD_RAILS_STEP = 8.0  # distance between its points, at most [m]
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
    own = [item for item in polygons if item.source != INVENTED]
    if any(kind_of(item.type, item.source) == "fences" for item in own):
        return Rails(left_out=(LeftOut(FAMILY, "the scenario has fences of its own"),))
    lanes = _fast_lanes(network, around)
    rails = _rails_along(lanes, paved, around) if lanes else []
    if not rails:
        return Rails(left_out=(LeftOut(FAMILY, "no fast road near the camera has a free side"),))
    order = np.argsort([float(item.shape[0].sum()) for item in rails], kind="stable")
    return Rails(tuple(rails[int(k)] for k in order))


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
    rails: list[Polygon] = []
    for line in lines:
        shape = shapely.get_coordinates(shapely.segmentize(line.simplify(0.04), _GUARD_RAILS_STEP))
        if line.length > _SHORTEST and len(shape) > 1:
            rails.append(Polygon(f"rail:{len(rails)}", "guard_rail", shape, False, None, SOURCE))
    return rails


def _on_ground(line: Floats, around: Surroundings) -> list[Floats]:
    """The stretches of a lane that are on no bridge and in no tunnel, (n, 3) [m] each."""
    dense = densified(line, _GUARD_RAILS_STEP)
    above = around.height_at(dense[:, :2]) - dense[:, 2]
    free = (above > -_BRIDGE) & (above < _COVER)
    if free.all():
        return [line] * (len(line) > 1)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int64)))
    return [dense[a:b] for a, b in ends.reshape(-1, 2) if b - a > 1]


_HEDGES_STEP = 2.0  # distance between the points of a hedge's line, at most [m]
_HEDGES_PIECE = 4  # steps that share a level of detail


def hedge_parts(
    kind: Kind, settings: ObjectSettings, items: Sequence[Polygon], staging: Staging
) -> list[Part]:
    """Build hedges along polylines and around areas.

    Args:
        kind: Gives the distances of the levels of detail.
        settings: Size factor, its spread, and colour.
        items: Lines and areas.
        staging: Roads, ground, cameras and seed, and the factor of those distances.
    """
    around, colour = staging.around, colour_in(settings)
    parts: list[Part] = []
    for item in items:
        shape = item.shape[:, :2]
        if np.ptp(shape, axis=0).max() < 1.0:
            continue
        flat = _resampled(np.vstack([shape, shape[:1]]) if item.fill else shape)
        thing = thing_of(f"{kind.name}:{item.id}")
        # Choose its size.
        share = share_of(around.seed, kind.name, item.id, "size")
        size = settings.scale * (1.0 + settings.variation * (2.0 * share - 1.0))
        section = HedgeSize(0.8 * size, 1.35 * size)
        margin = 0.5 * section.width + 0.3
        # Build it piece by piece, each at its level of detail.
        for first, piece in _pieces(flat, around.index.covers(flat, margin=margin)):
            level = staging.level(kind, float(around.distances(piece).min()))
            line = np.column_stack([piece, around.height_at(piece)])
            rng = dice_of(around.seed, kind.name, item.id, str(first))
            core, leaves = hedge(line, section, level=level, rng=rng)
            tint = leaves.tint
            if colour is not None and tint is not None:
                tint = np.clip(tint / np.array(LEAF) * np.array(colour), 0.004, 0.8)
            whole = (core, Part(leaves.mesh, leaves.material, tint))
            parts += [replace(part, mesh=belonging(part.mesh, thing)) for part in whole]
    return parts


def _resampled(line: Floats) -> Floats:
    """The polyline with its own corners and no step longer than `_STEP`, (m, 2) [m]."""
    points = [line[:1]]
    for start, end in pairwise(line):
        length = float(np.hypot(*(end - start)))
        if length < 0.05:
            continue
        share = np.linspace(0.0, 1.0, int(np.ceil(length / _HEDGES_STEP)) + 1)[1:, None]
        points.append(start + share * (end - start))
    return np.concatenate(points)


def _pieces(line: Floats, gap: Bools) -> Iterator[tuple[int, Floats]]:
    """Pieces of a line without its gaps, each with its first step's number."""
    for first in range(0, len(line) - 1, _HEDGES_PIECE):
        here = slice(first, first + _HEDGES_PIECE + 1)
        open_at = np.flatnonzero(gap[here])
        runs = np.split(np.arange(len(line))[here], open_at)
        for run in runs:
            free = run[~gap[run]]
            if len(free) > 1:
                yield int(free[0]), line[free]


_OUTLINED_PIECE = 20  # steps of a fence that share a level of detail
_FACES = 15.0  # how far a fence looks for the lanes it guards [m]


def line_parts(
    kind: Kind, settings: ObjectSettings, items: Sequence[Polygon], staging: Staging
) -> list[Part]:
    """Build rails and barriers along polylines, always of their real size.

    Args:
        kind: Gives the distances of the levels of detail.
        settings: The model of lines whose type names none, and a colour that paints them all.
        items: The lines.
        staging: Roads, ground and cameras, and the factor of those distances.
    """
    around, colour = staging.around, colour_in(settings)
    parts: list[Part] = []
    for item in items:
        shape = item.shape[:, :2]
        if np.ptp(shape, axis=0).max() < 1.0:
            continue
        flat = barriers.resampled(np.vstack([shape, shape[:1]]) if item.fill else shape)
        line = np.column_stack([flat, around.height_at(flat)])
        # Build it piece by piece, each at its level of detail.
        sides, drop = guarded_sides(flat, around.index), barriers.end_drop(line)
        model, thing = fence_model(item, settings), thing_of(f"{kind.name}:{item.id}")
        for first in range(0, len(line) - 1, _OUTLINED_PIECE):
            piece = slice(first, first + _OUTLINED_PIECE + 1)
            level = staging.level(kind, float(around.distances(flat[piece]).min()))
            if model == "guard_rail":
                mesh = barriers.fence(line[piece], drop[piece], sides=sides, level=level)
                made = [Part(mesh, "steel")]
            else:
                ends = (first == 0, first + _OUTLINED_PIECE >= len(line) - 1)
                made = BARRIERS[model](line[piece], level=level, ends=ends)
            made = [replace(part, mesh=belonging(part.mesh, thing)) for part in made]
            parts += made if colour is None else [_painted(part, colour) for part in made]
    return parts


def fence_model(item: Polygon, settings: ObjectSettings) -> str:
    """Return what a line is: as its type says, else the settings' model, else a guard rail."""
    word = item.type.lower().split(".")[0].strip()
    if word in FENCES:
        return word
    return settings.model[0] if settings.model else FENCES[0]


def _painted(part: Part, colour: Colour) -> Part:
    """A part in one colour."""
    return Part(part.mesh, "sign", np.tile(colour, (len(part.mesh.faces), 1)))


def guarded_sides(line: Floats, index: LaneIndex) -> tuple[int, ...]:
    """Return on which sides of a fence, (n, 2) [m], lanes run: 1 left, -1 right."""
    nearest, distance = index.nearest(line)
    if index.tree is None or not (distance < _FACES).any():
        return (1,)
    along = np.gradient(line, axis=0)
    towards = index.points[nearest, :2] - line
    cross = along[:, 0] * towards[:, 1] - along[:, 1] * towards[:, 0]
    left = float((cross[distance < _FACES] > 0).mean())
    if left > 0.8:
        return (1,)
    return (-1,) if left < 0.2 else (1, -1)
