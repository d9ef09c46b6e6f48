"""Ribbed slabs that tell the blind where a crossing begins."""

from __future__ import annotations

from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh
from sumo3dviz_pt.world.memory import digest_of
from sumo3dviz_pt.world.roads.cells import Polygons
from sumo3dviz_pt.world.roads.drops import Drops, rise_at
from sumo3dviz_pt.world.roads.heights import heights_near
from sumo3dviz_pt.world.roads.layers import Base
from sumo3dviz_pt.world.roads.markings.build import lifted
from sumo3dviz_pt.world.roads.mesh import KERB_WIDTH
from sumo3dviz_pt.world.roads.style import PAVING

_DEEP, _SLAB, _RIBS = 0.6, 0.3, 4
"""Depth of the strip, size of a slab [m], and ribs on each."""

_AFTER_KERB = 0.08
"""From the kerb stones to the slabs [m]."""

_LIFT, _STEP = 0.004, 0.1
"""Height above the paving, and distance at which the kerb is looked for [m]."""

_PALE: Colour = (0.55, 0.54, 0.50)
_GROOVE: Colour = (0.30, 0.295, 0.28)


def tactile_slabs(base: Base, drops: Drops) -> tuple[Mesh, Floats]:
    """Build slabs behind dropped kerbs, and the reflectance of their faces, (n, 3).

    Args:
        base: The roads.
        drops: Where kerbs are lowered.
    """
    layout = base.layout
    quads = [np.zeros((0, 4, 2))]
    tones = [np.zeros((0, 3))]
    footways = layout.memory.of(("footways",), lambda: shapely.STRtree(layout.raised))
    for k, name in enumerate(drops.names):
        near = footways.geometries[np.sort(footways.query(drops.ramps.geometries[k]))]
        made_of = ("tactile", name, digest_of(*near))
        found = layout.memory.by_content.of(made_of, partial(_at_end, k, drops, near))
        quads.append(found[0])
        tones.append(found[1])
    flat = np.concatenate(quads).reshape(-1, 2)
    if not len(flat):
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)), np.zeros((0, 3))
    heights = heights_near(layout.cells, flat) + rise_at(drops, flat)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = (4 * np.arange(len(flat) // 4)[:, None, None] + halves).reshape(-1, 3)
    paving = [mesh for key, mesh in base.surfaces.items() if key == PAVING]
    mesh = lifted(
        np.column_stack([flat, heights]), faces, layout=layout, surface=paving, lift=_LIFT
    )
    return mesh, np.repeat(np.concatenate(tones), 2, axis=0)


def _at_end(k: int, drops: Drops, footways: Polygons) -> tuple[Floats, Floats]:
    """Ribs and grooves along one end of a crossing, (n, 4, 2) [m], and their tones, (n, 3).

    Args:
        k: Number of the end.
        drops: Where kerbs are lowered.
        footways: The footways near it, (n,).
    """
    area = shapely.union_all(footways)
    shapely.prepare(area)
    count = int(2.0 * drops.halves[k] / _SLAB)
    half = 0.5 * count * _SLAB
    marks = np.linspace(-half, half, count * 2 * _RIBS + 1)
    begins = _kerb_at(k, marks, drops, area)
    quads, tones = [], []
    for i in range(len(marks) - 1):
        ends = begins[i : i + 2]
        if not np.isfinite(ends).all() or abs(ends[1] - ends[0]) > 0.3:
            continue
        # Slabs have joints where a groove lies twice.
        for row in range(round(_DEEP / _SLAB)):
            near = ends + KERB_WIDTH + _AFTER_KERB + row * _SLAB + 0.004
            far = near + _SLAB - 0.008
            corners = [
                (near[0], marks[i]), (far[0], marks[i]),
                (far[1], marks[i + 1]), (near[1], marks[i + 1]),
            ]  # fmt: skip
            quad = drops.frame(k, np.array(corners))
            if area.contains(shapely.Polygon(quad)):
                quads.append(quad)
                tones.append(_GROOVE if i % 2 else _PALE)
    return np.array(quads).reshape(-1, 4, 2), np.array(tones).reshape(-1, 3)


def _kerb_at(k: int, marks: Floats, drops: Drops, area: shapely.Geometry) -> Floats:
    """How far ahead of a crossing's end its kerb lies at places across it; NaN without one."""
    ahead = np.arange(-2.0, 2.5, _STEP)
    grid = np.stack(np.meshgrid(marks, ahead, indexing="ij")[::-1], axis=-1)
    inside = shapely.contains_xy(area, *drops.frame(k, grid).reshape(-1, 2).T)
    inside = inside.reshape(len(marks), len(ahead))
    first = np.argmax(inside, axis=1)
    at = np.full(len(marks), np.nan)
    for i in np.flatnonzero(inside.any(axis=1) & (first > 0)):
        step = shapely.LineString(
            drops.frame(k, np.array([[ahead[first[i] - 1], marks[i]], [ahead[first[i]], marks[i]]]))
        )
        outside = step.difference(area).length
        at[i] = ahead[first[i] - 1] + outside
    return at
