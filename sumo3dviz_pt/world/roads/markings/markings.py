"""Paint and rails as thin decals on the road surface.

Near the camera, paint has soft rims and is thin where wheels run over it. How it flakes and cracks
between these points is the material's business.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract, triangulate_many
from sumo3dviz_pt.library.mesh.shading import smooth_normals
from sumo3dviz_pt.library.street.road_styles import road_style
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, settled
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.world.roads.cells import Cells, Polygons, draped, quad_polygons, without_overlaps
from sumo3dviz_pt.world.roads.graded import Graded, columns, graded_on, joined, whole_quads
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.markings.lines import (
    YELLOW,
    Paint,
    SideColours,
    centre_paint,
    edge_paint,
    through_paint,
)
from sumo3dviz_pt.world.roads.markings.symbols import (
    arrow_paint,
    stop_paint,
    word_paint,
    zebra_paint,
)
from sumo3dviz_pt.world.roads.strips import BoundsXY, distance_to
from sumo3dviz_pt.world.roads.wear.lanes import way_lines, wheels_at
from sumo3dviz_pt.world.roads.wear.stains import patchy

_RIM, _RIM_SHARE = 0.03, 0.30
"""Width of the worn rim of paint [m], and the share of paint at the very edge."""

_STEP, _LONG_STEP, _THIN = 0.45, 2.5, 0.3
"""Distance of rows and columns, of rows along lines, and what counts as a line [m]."""

_THINNED, _PATCHY = 0.42, 0.12
"""Share of paint that wheels have taken, and by how much that differs from place to place."""

_DIRT = 0.16
"""Brightness that paint has lost to rubber and dust at the most."""


@dataclass(frozen=True, slots=True, eq=False)
class Coats:
    """Quads of paint that have one age and colour each.

    Attributes:
        quads: Corners, their borders along the paint, (n, 4, 3) [m].
        polygons: What is left of each quad from above, (n,).
        fresh: Share of paint that age has left, (n,).
        yellow: 1 for yellow paint, (n,).
        loose: Whether no other quad begins or ends at its beginning and at its end, (n, 2).
    """

    quads: Floats
    polygons: Polygons
    fresh: Floats
    yellow: Floats
    loose: Bools

    def __getitem__(self, chosen: slice | Bools) -> Coats:
        """Some of them."""
        return Coats(*(getattr(self, field.name)[chosen] for field in fields(self)))


def worn_paint(coats: Coats, ways: shapely.STRtree) -> Graded:
    """Paint with rows and columns of worn points.

    Args:
        coats: The paint.
        ways: Of motor vehicles; see `way_lines`.
    """
    quads = coats.quads
    width = _length(quads[:, [3, 2]] - quads[:, [0, 1]])
    length = _length(quads[:, [1, 2]] - quads[:, [0, 3]])
    loose = coats.loose
    whole = whole_quads(quads, coats.polygons)
    pieces = []
    for k, quad in enumerate(quads):
        # Cut the quad into rows and columns, with narrow rims where paint ends.
        step = _STEP if width[k] > _THIN else _LONG_STEP
        across, share = _stations(width[k], (True, True), _STEP)
        along, ending = _stations(length[k], (bool(loose[k, 0]), bool(loose[k, 1])), step)
        rows = _cut_along(quad, along)
        shares = np.tile(across, (len(rows), 1))
        # Wear its points down.
        points = columns(rows, shares)
        rim = np.stack([np.minimum.outer(ending[:-1], share), np.minimum.outer(ending[1:], share)])
        wear = _wear_at(points, ways)
        wear[..., 1] *= coats.fresh[k] * rim.transpose(1, 0, 2)
        wear[..., 2] = coats.yellow[k]
        left = quad_polygons(rows)
        if not whole[k]:
            left = shapely.intersection(left, coats.polygons[k])
        pieces.append(graded_on(rows, shares, wear, polygons=left))
    return joined(pieces)


def _wear_at(points: Floats, ways: shapely.STRtree) -> Floats:
    """Brightness and share of fresh paint at points, (n, 2, k, 3), as wear."""
    wheels = wheels_at(points, ways)
    spots = 0.6 * patchy(points, 1.3, salt=1) + 0.4 * patchy(points, 0.5, salt=2)
    wear = np.zeros(points.shape)
    wear[..., 0] = 1.0 - _DIRT * np.clip(0.45 * wheels + 0.4 + 0.6 * spots, 0.0, 1.0)
    wear[..., 1] = np.clip(1.0 - _THINNED * wheels + _PATCHY * (spots - 0.3), 0.0, 1.0)
    return wear


def _length(sides: Floats) -> Floats:
    """The longer of two sides, (n, 2, 3) [m], as (n,)."""
    return np.asarray(np.linalg.norm(sides[..., :2], axis=-1).max(axis=1))


def _stations(length: float, loose: tuple[bool, bool], step: float) -> tuple[Floats, Floats]:
    """Places from one end (0) to the other (1), and shares of paint there.

    Args:
        length: [m].
        loose: Whether paint ends at either end.
        step: About the distance of places [m].
    """
    rim = min(_RIM / max(length, 1e-3), 0.3)
    first, last = (rim if end else 0.0 for end in loose)
    inner = np.linspace(first, 1.0 - last, max(2, round(length / step) + 1))
    at = np.concatenate([[0.0] * loose[0], inner, [1.0] * loose[1]])
    share = np.ones(len(at))
    share[[0, -1]] = [_RIM_SHARE if end else 1.0 for end in loose]
    return at, share


def _cut_along(quad: Floats, at: Floats) -> Floats:
    """A quad, (4, 3), cut across at places along it, (k,), as (k - 1, 4, 3)."""
    right = quad[0] + at[:, None] * (quad[1] - quad[0])
    left = quad[3] + at[:, None] * (quad[2] - quad[3])
    return np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)


def loose_ends(quads: Floats) -> Bools:
    """Return whether no other quad begins or ends where one begins and ends, (n, 2)."""
    ends = 0.5 * np.stack([quads[:, 0] + quads[:, 3], quads[:, 1] + quads[:, 2]], axis=1)
    _, place, count = np.unique(
        np.round(settled(ends.reshape(-1, 3)), 2), axis=0, return_inverse=True, return_counts=True
    )
    return np.asarray((count[place.reshape(-1)] < 2).reshape(-1, 2))


_SOFT_EDGE = 0.03
"""Width of the worn rim of paint [m]."""

_EDGE_SHARE, _AGEING = 0.30, 0.42
"""Share of paint at the very edge, and how much of it the oldest paint has lost."""

_SOFT = (_EDGE_SHARE, 1.0, 1.0, _EDGE_SHARE)

_CLOSE = 60.0
"""Up to this distance wheels have thinned paint [m]."""

_FAR = 150.0
"""From this distance to the camera's path on, edges are hard [m]."""


def road_paint(
    network: Network, settings: RoadSettings, layout: RoadLayout, *, region: BoundsXY | None
) -> list[Paint]:
    """Paint all markings; earlier ones cover later ones.

    Args:
        network: The network.
        settings: Line width, style and whether there are markings.
        layout: The roads.
        region: Only crossings that touch this box get a zebra [m].
    """
    style = road_style(settings.marking_style, network)
    sides = SideColours.of(style, left_hand=network.left_hand)
    centre, shared = centre_paint(network, settings, layout.strips, centre=style.centre)
    inner = "right" if network.left_hand else "left"
    lines = [
        paint
        for key, strips in layout.strips.items()
        for paint in edge_paint(
            network.edges[key],
            strips,
            settings,
            sides=sides,
            open_side=inner if key in shared else "",
        )
    ]
    across = [*stop_paint(network, layout.strips, style), *arrow_paint(network, layout.strips)]
    words = word_paint(layout.strips, style.bus_lane)
    zebras = zebra_paint(network, style.crossing, region=region) if settings.markings else []
    through = through_paint(network, settings, layout.insides, sides=sides)
    return [*zebras, *across, *words, *centre, *lines, *through]


def decal_meshes(
    paint: Sequence[Paint],
    layout: RoadLayout,
    *,
    surface: Sequence[Mesh],
    lift: float,
    own_surface: bool = True,
) -> dict[str, Mesh]:
    """Build meshes of paint just above the surface, by material.

    Args:
        paint: What to draw, without regard to overlaps.
        layout: The roads.
        surface: Meshes that the paint lies on.
        lift: Height above the surface [m]; sloped roads take three times as much.
        own_surface: Whether paint stays off other edges that took surface from its own.
    """
    painted = without_overlaps(_paint_cells(paint))
    cells = _on_carriageway(painted, layout.cells, own_surface=own_surface)
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


def graded_paint(
    name: str,
    paint: Callable[[], Sequence[Paint]],
    layout: RoadLayout,
    *,
    focus: BoundsXY | None = None,
) -> Graded:
    """Build white and yellow paint at the height of the surface, near the camera with worn edges.

    Args:
        name: Of what is painted.
        paint: Makes the paint, as in `decal_meshes`; called once for each name.
        layout: The roads.
        focus: Box around the camera's path [m]; None takes all paint as near.
    """
    coats = layout.memory.of(("paint", name), lambda: _coats(paint(), layout))
    # Sort the quads by distance.
    quads, fresh, yellow = coats.quads, coats.fresh, coats.yellow
    width = np.linalg.norm((quads[:, [3, 2]] - quads[:, [0, 1]])[..., :2], axis=-1).max(axis=1)
    rim = np.minimum(_SOFT_EDGE / np.maximum(width, 1e-3), 0.3)
    away = distance_to(focus, quads.mean(axis=1))
    close, soft = away < _CLOSE, (away >= _CLOSE) & (away < _FAR)
    pieces = [] if focus is None else _worn(name, coats, np.flatnonzero(close), layout)
    soft |= close & (focus is None)
    # Farther away, rims are soft and then hard.
    for chosen, places, share in (
        (soft, ((0.0, 0.0), (0.0, 1.0), (1.0, -1.0), (1.0, 0.0)), _SOFT),
        # Half a rim narrower, hard edges cover as much.
        (~soft & ~close, ((0.0, 0.5), (1.0, -0.5)), (1.0, 1.0)),
    ):
        shares = np.array([[side + k * one for side, k in places] for one in rim[chosen]])
        wear = np.ones((int(chosen.sum()), 2, len(share), 3))
        wear[..., 1] = np.array(share) * fresh[chosen, None, None]
        wear[..., 2] = yellow[chosen, None, None]
        if chosen.any():
            pieces.append(graded_on(quads[chosen], shares, wear, polygons=coats.polygons[chosen]))
    return joined(pieces)


def _coats(paint: Sequence[Paint], layout: RoadLayout) -> Coats:
    """Paint without what lies under other paint or off its road."""
    cells = _on_carriageway(without_overlaps(_paint_cells(paint)), layout.cells)
    names = zip(cells.owners, cells.surfaces, strict=True)
    ages = np.array([share_of(0, "paint", owner, name) for owner, name in names])
    yellow = np.array([name == YELLOW for name in cells.surfaces], dtype=np.float64)
    quads = _lengthwise(cells.quads)
    return Coats(quads, cells.polygons, 1.0 - _AGEING * ages, yellow, loose_ends(quads))


def _worn(name: str, coats: Coats, near: Ints, layout: RoadLayout) -> list[Graded]:
    """Paint that wheels have thinned, piece by piece."""
    ways = way_lines(layout)
    return [
        layout.memory.of(("worn", name, k), partial(worn_paint, coats[slice(k, k + 1)], ways))
        for k in near.tolist()
    ]


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
    """Build decals above the surface that they lie on.

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


def _on_carriageway(paint: Cells, roads: Cells, *, own_surface: bool = True) -> Cells:
    """Take paint off footways, and off other edges that took surface from its own."""
    covers: dict[str, set[int]] = {}
    for cell, winners in roads.cutters.items() if own_surface else ():
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
