"""Paint and rails as thin decals on the road surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from sumo3dviz_pt.job import RoadSettings
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.scene.chance import share_of
from sumo3dviz_pt.scene.markings_across import stop_paint, zebra_paint
from sumo3dviz_pt.scene.markings_arrows import arrow_paint
from sumo3dviz_pt.scene.markings_lines import YELLOW, Paint, centre_paint, edge_paint
from sumo3dviz_pt.scene.markings_through import through_paint
from sumo3dviz_pt.scene.roads_cells import Cells, quad_polygons, without_overlaps
from sumo3dviz_pt.scene.roads_graded import Graded, graded_on
from sumo3dviz_pt.scene.roads_heights import draped
from sumo3dviz_pt.scene.roads_layout import RoadLayout
from sumo3dviz_pt.scene.roads_mesh import smooth_normals
from sumo3dviz_pt.scene.roads_strips import BoundsXY
from sumo3dviz_pt.shapes.planar import polygon_parts, subtract
from sumo3dviz_pt.shapes.triangulate import triangulate_many

_SOFT_EDGE = 0.03
"""Width of the worn rim of paint [m]."""

_EDGE_SHARE, _AGEING = 0.30, 0.42
"""Share of paint at the very edge, and how much of it the oldest paint has lost."""


def road_paint(
    network: Network, settings: RoadSettings, layout: RoadLayout, *, region: BoundsXY | None
) -> list[Paint]:
    """All markings; earlier ones cover later ones."""
    centre, shared = centre_paint(network, settings, layout.strips)
    inner = "right" if network.left_hand else "left"
    lines = [
        paint
        for key, strips in layout.strips.items()
        for paint in edge_paint(
            network.edges[key], strips, settings, open_side=inner if key in shared else ""
        )
    ]
    across = [*stop_paint(network, layout.strips), *arrow_paint(network, layout.strips)]
    zebras = zebra_paint(network, region=region) if settings.markings else []
    return [*zebras, *across, *centre, *lines, *through_paint(network, settings, layout.insides)]


def decal_meshes(
    paint: Sequence[Paint], layout: RoadLayout, *, surface: Sequence[Mesh], lift: float
) -> dict[str, Mesh]:
    """Paint as meshes just above the surface, by material.

    Args:
        paint: What to draw, without regard to overlaps.
        layout: The roads.
        surface: Meshes that the paint lies on.
        lift: Height above the surface [m]; sloped roads take three times as much.
    """
    cells = _on_carriageway(without_overlaps(_paint_cells(paint)), layout.cells)
    meshes = {}
    for material in sorted(set(cells.surfaces)):
        index = np.flatnonzero(np.array(cells.surfaces) == material)
        parts = [(part, i) for i in index for part in polygon_parts(cells.polygons[i])]
        flat, faces, owner = triangulate_many([part for part, _ in parts])
        if not len(faces):
            continue
        heights = cells.heights(np.array([i for _, i in parts])[owner], flat)
        vertices = np.column_stack([flat, heights])
        meshes[material] = lifted(vertices, faces, layout=layout, surface=surface, lift=lift)
    return meshes


def graded_paint(paint: Sequence[Paint], layout: RoadLayout) -> Graded:
    """White and yellow paint with worn edges, at the height of the surface.

    Args:
        paint: As in `decal_meshes`.
        layout: The roads.
    """
    cells = _on_carriageway(without_overlaps(_paint_cells(paint)), layout.cells)
    yellow = np.array([name == YELLOW for name in cells.surfaces], dtype=np.float64)
    names = zip(cells.owners, cells.surfaces, strict=True)
    ages = [share_of(0, "paint", owner, name) for owner, name in names]
    quads = _lengthwise(cells.quads)
    width = np.linalg.norm((quads[:, [3, 2]] - quads[:, [0, 1]])[..., :2], axis=-1).max(axis=1)
    soft = np.minimum(_SOFT_EDGE / np.maximum(width, 1e-3), 0.3)
    shares = np.stack([0 * soft, soft, 1 - soft, 1 + 0 * soft], axis=1)
    wear = np.zeros((len(quads), 2, 4, 3))
    wear[..., 0] = 1.0
    fresh = 1.0 - _AGEING * np.array(ages)[:, None, None]
    wear[..., 1] = np.array([_EDGE_SHARE, 1.0, 1.0, _EDGE_SHARE]) * fresh
    wear[..., 2] = yellow[:, None, None]
    return graded_on(quads, shares, wear, polygons=cells.polygons)


def _lengthwise(quads: Floats) -> Floats:
    """Quads turned such that their borders are their long sides."""
    along = np.linalg.norm((quads[:, 1] - quads[:, 0])[:, :2], axis=1)
    across = np.linalg.norm((quads[:, 3] - quads[:, 0])[:, :2], axis=1)
    turned = np.roll(quads, 1, axis=1)
    # Pieces of lines in bends may be shorter than the line is wide: leave those.
    short = (along < across) & (across > 1.5)
    return np.where(short[:, None, None], turned, quads)


def lifted(
    vertices: Floats,
    faces: Ints,
    *,
    layout: RoadLayout,
    surface: Sequence[Mesh],
    lift: float,
) -> Mesh:
    """Decals above the surface that they lie on.

    Args:
        vertices: (n, 3) [m].
        faces: (m, 3).
        layout: The roads.
        surface: Meshes that the decals lie on.
        lift: As in `decal_meshes`.
    """
    if layout.cells.is_flat:
        return Mesh(vertices + np.array([0.0, 0.0, lift]), faces)
    vertices = draped(vertices, surface) + np.array([0.0, 0.0, 3.0 * lift])
    return Mesh(vertices, faces, smooth_normals(vertices, faces))


def _paint_cells(paint: Sequence[Paint]) -> Cells:
    """Paint as cells, in its order."""
    quads = np.concatenate([np.zeros((0, 4, 3)), *(one.quads for one in paint)])
    return Cells(
        quad_polygons(quads),
        quads,
        {},
        tuple(one.material for one in paint for _ in one.quads),
        np.zeros(len(quads), dtype=bool),
        tuple(one.owner for one in paint for _ in one.quads),
        {},
    )


def _on_carriageway(paint: Cells, roads: Cells) -> Cells:
    """Take paint off footways, and off other edges that took surface from its own."""
    covers: dict[str, set[int]] = {}
    for cell, winners in roads.cutters.items():
        covers.setdefault(roads.owners[cell], set()).update(int(w) for w in winners)
    tree = shapely.STRtree(roads.polygons)
    mark, cell = tree.query(paint.polygons, predicate="intersects")
    wrong = np.array(
        [
            bool(roads.raised[c])
            or (roads.owners[c] != paint.owners[m] and int(c) in covers.get(paint.owners[m], ()))
            for m, c in zip(mark, cell, strict=True)
        ],
        dtype=bool,
    )
    polygons = paint.polygons.copy()
    for m in np.unique(mark[wrong]):
        polygons[m] = subtract(polygons[m], roads.polygons[cell[wrong & (mark == m)]])
    return replace(paint, polygons=polygons)
