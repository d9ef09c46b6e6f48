"""Hedges along lines, with gaps where carriageways cross them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.plants.hedge import LEAF, HedgeSize, hedge
from sumo3dviz_pt.model.geometry import Bools, Floats, belonging
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import Kind, colour_in
from sumo3dviz_pt.world.objects.levels import Staging
from sumo3dviz_pt.world.placement.things import thing_of

_STEP = 2.0  # distance between the points of a hedge's line, at most [m]
_PIECE = 4  # steps that share a level of detail


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
            chance = share_of(around.seed, kind.name, item.id, str(first))
            line = np.column_stack([piece, around.height_at(piece)])
            rng = np.random.default_rng(int(chance * 2**48))
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
        share = np.linspace(0.0, 1.0, int(np.ceil(length / _STEP)) + 1)[1:, None]
        points.append(start + share * (end - start))
    return np.concatenate(points)


def _pieces(line: Floats, gap: Bools) -> Iterator[tuple[int, Floats]]:
    """Pieces of a line without its gaps, each with its first step's number."""
    for first in range(0, len(line) - 1, _PIECE):
        here = slice(first, first + _PIECE + 1)
        open_at = np.flatnonzero(gap[here])
        runs = np.split(np.arange(len(line))[here], open_at)
        for run in runs:
            kept = run[~gap[run]]
            if len(kept) > 1:
                yield int(kept[0]), line[kept]
