"""Junctions whose arms differ in height: one surface that meets all of them, above the ground."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.geometry import Mesh, merge_meshes
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.world.land.terrain import terrain
from sumo3dviz_pt.world.roads.cells import fitted_heights
from sumo3dviz_pt.world.roads.drops import cut_small, is_uneven, points_within
from sumo3dviz_pt.world.roads.roads import build_roads

CARS = frozenset({"passenger"})
HALF = 12.0
"""Distance of the stop lines from the junction's middle [m]."""


def way(edge, points, function="normal"):
    """An edge of one lane along a line."""
    line = np.array(points, dtype=float)
    lane = Lane(f"{edge}_0", edge, 0, line, 3.2, 13.9, 50.0, CARS)
    ends = ("", "") if function == "internal" else (f"{edge}a", f"{edge}b")
    return Edge(edge, function, *ends, (lane,))


def saddle(*, height=3.0, apart=0.0):
    """Two roads over one junction: one over a hilltop, the other through a dip.

    Args:
        height: Of the hilltop's arms above the dip's, at 60 m [m].
        apart: Distance of a second junction beside the first, or 0 for none [m].
    """
    low, high = -0.5 * height, 0.5 * height
    share = HALF / 60.0
    west, east = ((x, 0, low * (abs(x) / 60.0)) for x in (-60, 60))
    south, north = ((0, y, high * (abs(y) / 60.0)) for y in (-60, 60))
    inner = {
        "west": (-HALF, 0, low * share),
        "east": (HALF, 0, low * share),
        "south": (0, -HALF, high * share),
        "north": (0, HALF, high * share),
    }
    edges = [
        way("w", [west, inner["west"]]),
        way("e", [inner["east"], east]),
        way("s", [south, inner["south"]]),
        way("n", [inner["north"], north]),
        way(":j_0", [inner["west"], (0, 0, 0), inner["east"]], "internal"),
        way(":j_1", [inner["south"], (0, 0, 0), inner["north"]], "internal"),
    ]
    ring = HALF * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    outline = np.column_stack([ring, np.zeros(4)])
    junctions = {"j": Junction("j", "priority", np.zeros(3), outline, ("w_0", "s_0"))}
    if apart:
        shifted = outline + np.array([2 * HALF + apart, 0.0, 0.4])
        junctions["k"] = Junction("k", "priority", shifted.mean(axis=0), shifted, ())
    found = {edge.id: edge for edge in edges}
    return Network(found, junctions, (), Location(boundary=(-60.0, -60.0, 60.0, 60.0)))


def drawn(roads):
    """The carriageways of roads as one mesh."""
    parts = [part.part.mesh for part in roads.static if part.id == "road/asphalt"]
    return merge_meshes([Mesh(mesh.vertices, mesh.faces) for mesh in parts])


def heights_of(mesh, places):
    """Height of a mesh at places, (n, 2), as (n,); NaN beside it."""
    corners = mesh.vertices[mesh.faces]
    tree = shapely.STRtree(shapely.polygons(corners[..., :2]))
    at, face = tree.query(shapely.points(places), predicate="intersects")
    a, b, c = (corners[face, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    found = np.full(len(places), np.nan)
    away = ((places[at] - a[:, :2]) * normal[:, :2]).sum(axis=1)
    found[at] = a[:, 2] - away / normal[:, 2]
    return found


def test_a_slope_stays_a_slope_between_scattered_points():
    rng = np.random.default_rng(3)
    flat = rng.uniform(-20, 20, (80, 2))
    knots = np.column_stack([flat, 0.08 * flat[:, 0] - 0.05 * flat[:, 1] + 7.0])
    places = rng.uniform(-15, 15, (1200, 2))
    wanted = 0.08 * places[:, 0] - 0.05 * places[:, 1] + 7.0
    assert fitted_heights(knots, places) == pytest.approx(wanted, abs=0.03)


@pytest.mark.parametrize("count", [1, 2, 9])
def test_heights_beside_a_row_of_points_stay_within_theirs(count):
    row = np.column_stack([np.linspace(0, 9, count), np.zeros(count), np.linspace(1, 4, count)])
    found = fitted_heights(row, np.array([[4.5, 30.0], [-80.0, 0.0], [0.0, 0.0]]))
    assert (found >= 1.0).all() and (found <= 4.0).all()


def test_ways_through_a_junction_lie_on_its_surface():
    net = saddle()
    mesh = drawn(build_roads(net, RoadSettings(), textured=False))
    for key in (":j_0", ":j_1"):
        line = net.edges[key].lanes[0].shape
        places = line[0] + np.linspace(0.01, 0.99, 15)[:, None] * (line[-1] - line[0])
        z = np.interp(np.linspace(0.01, 0.99, 15), [0.0, 0.5, 1.0], line[:, 2])
        assert heights_of(mesh, places[:, :2]) == pytest.approx(z, abs=0.05)


def test_the_ground_is_below_the_surface_that_is_drawn():
    net = saddle(height=8.0)
    roads = build_roads(net, RoadSettings(), textured=False)
    _, height_at = terrain(roads.layout, net)
    places = np.random.default_rng(4).uniform(-HALF, HALF, (3000, 2))
    assert np.nanmax(height_at(places) - heights_of(drawn(roads), places)) < 0.0


def test_junctions_that_touch_meet_without_a_step():
    roads = build_roads(saddle(apart=0.05), RoadSettings(), textured=False)
    cells = roads.layout.cells
    one, other = (cells.owners.index(key) for key in "jk")
    spots = np.column_stack([np.full(9, HALF + 0.02), np.linspace(-11, 11, 9)])
    found = [cells.heights(np.full(9, cell), spots) for cell in (one, other)]
    assert found[0] == pytest.approx(found[1], abs=0.01)


def test_only_areas_with_heights_are_cut():
    cells = build_roads(saddle(), RoadSettings(), textured=False).layout.cells
    level = build_roads(saddle(height=0.0), RoadSettings(), textured=False).layout.cells
    junction = cells.owners.index("j")
    assert is_uneven(cells, junction) and not is_uneven(cells, cells.owners.index("w"))
    assert not is_uneven(level, level.owners.index("j")) and not len(points_within(level)[0])
    pieces = cut_small(cells.polygons[junction])
    assert sum(piece.area for piece in pieces) == pytest.approx(cells.polygons[junction].area)
    assert max(piece.area for piece in pieces) < 5.0
    points, owners = points_within(cells)
    assert shapely.intersects_xy(cells.polygons[junction], *points[owners == junction].T).all()
