"""Dropped kerbs, stones, gutters, stains, bicycles on the road, furniture on corners."""

from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.roads.drops import LOWEST, SIDEWALK_HEIGHT, find_drops, rise_at
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.roads.markings.symbols import cycle_paint
from sumo3dviz_pt.world.roads.roads import build_roads
from sumo3dviz_pt.world.roads.strips import BICYCLE
from sumo3dviz_pt.world.roads.wear.lanes import way_lines, wheels_at
from sumo3dviz_pt.world.roads.wear.stains import patchy
from sumo3dviz_pt.world.street.furniture import _doors, place_corners
from sumo3dviz_pt.world.street.places import Site, crossing_areas

EXAMPLES = Path(__file__).resolve().parents[4] / "examples"
FOCUS = (320.0, 280.0, 330.0, 290.0)
AWAY = (360.0, 300.0, 370.0, 310.0)


@cache
def network():
    return read_network(EXAMPLES / "crossing" / "crossing.net.xml.gz")


@cache
def roads():
    return build_roads(network(), RoadSettings(), textured=True, focus=FOCUS)


@cache
def drops():
    return find_drops(network(), roads().layout.cells, FOCUS)


def mesh_of(name):
    return next(part.part.mesh for part in roads().static if part.id == name)


def test_noise_is_smooth_even_and_its_own_for_each_salt():
    points = np.random.default_rng(1).uniform(-900.0, 900.0, (4000, 2))
    first, other = patchy(points, 3.0, salt=1), patchy(points, 3.0, salt=2)
    assert np.abs(first).max() <= 1.0 and abs(first.mean()) < 0.03 and first.std() > 0.3
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.06
    assert np.abs(patchy(points + 0.001, 3.0, salt=1) - first).max() < 0.01
    assert np.array_equal(first, patchy(points, 3.0, salt=1))


@pytest.mark.slow
def test_kerbs_drop_where_crossings_end_and_nowhere_else():
    found = drops()
    assert len(found.ends) >= 8
    ahead = found.ends + 0.05 * found.ahead
    assert np.median(rise_at(found, ahead)) < LOWEST + 0.02
    aside = found.ahead[:, ::-1] * [-1.0, 1.0]
    away = found.ends + (found.halves[:, None] + 6.0) * aside
    assert rise_at(found, away).max() == pytest.approx(SIDEWALK_HEIGHT)


def test_paving_ramps_without_steps():
    heights = mesh_of("road/paving").vertices[:, 2]
    assert heights.min() >= LOWEST - 1e-6 and heights.max() <= SIDEWALK_HEIGHT + 1e-6
    mesh = mesh_of("road/paving")
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normal, axis=1)
    slope = np.arccos(np.clip(0.5 * normal[:, 2] / area, -1.0, 1.0))
    # A ramp beside a crossing rises 9 cm on 1.2 m, and may do so on two sides at once;
    # crumbs at the rim may be steeper.
    assert slope[area > 0.005].max() < np.arctan(0.16)
    assert area[slope > np.arctan(0.16)].sum() < 0.02


def test_without_a_camera_no_kerb_drops():
    plain = build_roads(network(), RoadSettings(), textured=True)
    ids = {part.id for part in plain.static}
    assert not any("kerb_stone" in key for key in ids)
    paving = next(part.part.mesh for part in plain.static if part.id == "road/paving")
    assert paving.vertices[:, 2] == pytest.approx(SIDEWALK_HEIGHT)


@pytest.mark.parametrize("name", ["stones", "setts", "gutter", "tactile"])
def test_stones_have_tones_and_face_up_or_out(name):
    part = next(p.part for p in roads().static if p.id == f"road/{name}/kerb_stone")
    assert part.tint.shape == (len(part.mesh.faces), 3)
    assert part.tint.min() > 0.0 and part.tint.max() <= 0.85
    corners = part.mesh.vertices[part.mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normal[:, 2] > -1e-4).mean() > 0.999


def test_gutters_lie_on_carriageways_and_setts_on_footways():
    cells = roads().layout.cells
    for name, raised in (("gutter", False), ("setts", True)):
        area = shapely.union_all(cells.polygons[cells.raised == raised]).buffer(0.05)
        shapely.prepare(area)
        mesh = mesh_of(f"road/{name}/kerb_stone")
        middles = mesh.vertices[mesh.faces].mean(axis=1)
        assert shapely.contains_xy(area, *middles[:, :2].T).mean() > 0.995, name


def test_stains_darken_footways_near_the_camera_only():
    mesh = mesh_of("road/paving")
    away = np.hypot(*(mesh.vertices[:, :2] - [325.0, 285.0]).T)
    assert mesh.wear[away < 25.0, 0].std() > 0.02 and mesh.wear[:, 0].min() > 0.4
    assert mesh.wear[away > 80.0, 0] == pytest.approx(1.0)


def test_wheels_run_beside_the_middle_of_ways():
    layout = roads().layout
    ways = way_lines(layout)
    line = max(ways.geometries, key=lambda one: one.length)
    at = np.array(line.interpolate(0.5 * line.length).coords)
    ahead = np.array(line.interpolate(0.5 * line.length + 0.1).coords) - at
    aside = np.array([[-ahead[0, 1], ahead[0, 0]]]) / np.linalg.norm(ahead)
    assert wheels_at(at + 0.85 * aside, ways)[0] > 0.95
    assert wheels_at(np.array([[0.0, 5000.0]]), ways)[0] == 0.0


def test_bicycles_are_painted_on_bicycle_lanes():
    layout = layout_roads(network(), RoadSettings())
    paint = cycle_paint(layout.strips, "bicycle")
    assert paint
    for one in paint[:6]:
        lanes = [s.polygon for s in layout.strips[one.owner] if s.look.surface == BICYCLE]
        area = shapely.union_all(lanes).buffer(0.01)
        assert all(area.contains(shapely.Polygon(quad[:, :2])) for quad in one.quads)


def test_corners_get_furniture_out_of_the_way():
    net = network()
    around = surroundings(net, seed=7, viewpoints=np.array([[328.0, 280.0, 7.0]]))
    nothing = np.zeros((0, 2))
    flat = lambda places: np.zeros(len(places))  # noqa: E731
    site = Site(around, flat, crossing_areas(net), nothing, shapely.STRtree([]))
    pieces = place_corners(list(net.edges.values()), net, site)
    assert len(pieces) > 5
    spots = np.array([piece.place[:2] for piece in pieces])
    assert not around.index.covers(spots, margin=0.3).any()
    paths = [
        shapely.LineString(pair)
        for edge in net.edges.values()
        if edge.function == "walkingarea" and len(edge.lanes[0].shape) > 2
        for pair in combinations(_doors(edge, net), 2)
    ]
    assert shapely.distance(shapely.points(spots), shapely.union_all(paths)).min() > 0.5
    again = Site(around, flat, crossing_areas(net), nothing, shapely.STRtree([]))
    assert place_corners(list(net.edges.values()), net, again) == pieces


def tones_of(made, name):
    """Tone of every face of stones by its middle, to a millimetre."""
    part = next(p.part for p in made.static if p.id == f"road/{name}/kerb_stone")
    places = np.round(part.mesh.vertices[part.mesh.faces].mean(axis=1), 3)
    return dict(zip(map(tuple, places.tolist()), part.tint.tolist(), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stones", "gutter"])
def test_stones_do_not_hang_on_where_the_camera_is(name):
    aside = build_roads(network(), RoadSettings(), textured=True, focus=AWAY)
    here, there = tones_of(roads(), name), tones_of(aside, name)
    both = here.keys() & there.keys()
    assert len(both) > 200 and len(there) > len(both)
    assert all(here[place] == there[place] for place in both)
