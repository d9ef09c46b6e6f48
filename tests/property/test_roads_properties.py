"""Laws of the road surface, whatever the lanes look like."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.mesh.bands import mitres, without_repeats
from sumo3dviz_pt.library.mesh.planar import triangulate
from sumo3dviz_pt.model.geometry import arc_length
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.world.roads.cells import overlaps
from sumo3dviz_pt.world.roads.layout import layout_roads

CARS = frozenset({"passenger"})
places = st.tuples(st.integers(-60, 60), st.integers(-60, 60))
lines = st.lists(places, min_size=2, max_size=6, unique=True)


def road(key: str, points: list[tuple[int, int]]) -> Edge:
    shape = np.array([[x, y, 0.0] for x, y in points], dtype=float)
    lane = Lane(f"{key}_0", key, 0, shape, 3.2, 13.9, 10.0, CARS)
    return Edge(key, "normal", "a", "b", (lane,))


@settings(max_examples=tries(40), deadline=None)
@given(lines, lines)
def test_crossing_roads_never_overlap_and_cover_their_lanes(one, other):
    edges = {key: road(key, points) for key, points in (("one", one), ("other", other))}
    cells = layout_roads(Network(edges, {}, (), Location()), RoadSettings()).cells
    assert len(overlaps(cells, above=1e-4).winners) == 0
    whole = shapely.union_all(cells.polygons, grid_size=1e-6)
    assert shapely.area(cells.polygons).sum() == pytest.approx(whole.area, rel=1e-3)
    for edge in edges.values():
        line = shapely.LineString(edge.lanes[0].shape[:, :2])
        assert line.difference(whole.buffer(0.01)).length < 0.01


@given(lines)
def test_mitres_are_finite_and_lean_to_the_left(points):
    line = without_repeats(np.array([[x, y, 0.0] for x, y in points], dtype=float))
    vectors = mitres(line)
    assert np.isfinite(vectors).all()
    assert np.linalg.norm(vectors, axis=1).max() <= 2.0 + 1e-9
    steps = np.diff(line[:, :2], axis=0)
    cross = steps[:, 0] * vectors[:-1, 1] - steps[:, 1] * vectors[:-1, 0]
    assert (cross >= -1e-6).all()
    assert (np.diff(arc_length(line)) > 0).all()


@given(st.floats(-1e6, 1e6), st.floats(0.5, 50.0), st.integers(3, 12))
def test_triangles_keep_the_area_wherever_the_polygon_lies(x, radius, corners):
    turns = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    ring = np.column_stack([x + radius * np.cos(turns), radius * np.sin(turns)])
    shape = shapely.Polygon(ring)
    vertices, faces = triangulate(shape)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert twice.sum() / 2 == pytest.approx(shape.area, rel=1e-6)
