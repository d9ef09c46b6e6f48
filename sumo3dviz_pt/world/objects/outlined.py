"""Static objects with a shape of their own along lines: fences and barriers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.street import fence
from sumo3dviz_pt.library.street.barriers import MODELS as BARRIERS
from sumo3dviz_pt.model.geometry import Colour, Floats, belonging
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import FENCES, Kind, colour_in
from sumo3dviz_pt.world.objects.levels import Staging
from sumo3dviz_pt.world.placement.lane_index import LaneIndex
from sumo3dviz_pt.world.placement.things import thing_of

_PIECE = 20  # steps of a fence that share a level of detail
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
        flat = fence.resampled(np.vstack([shape, shape[:1]]) if item.fill else shape)
        line = np.column_stack([flat, around.height_at(flat)])
        # Build it piece by piece, each at its level of detail.
        sides, drop = guarded_sides(flat, around.index), fence.end_drop(line)
        model, thing = fence_model(item, settings), thing_of(f"{kind.name}:{item.id}")
        for first in range(0, len(line) - 1, _PIECE):
            piece = slice(first, first + _PIECE + 1)
            level = staging.level(kind, float(around.distances(flat[piece]).min()))
            if model == "guard_rail":
                mesh = fence.fence(line[piece], drop[piece], sides=sides, level=level)
                made = [Part(mesh, "steel")]
            else:
                ends = (first == 0, first + _PIECE >= len(line) - 1)
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
