"""Wear, details and graded paint: where they lie and what they say."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.roads.graded import Graded, clipped, graded_on, graded_quads
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.roads.markings.symbols import arrow_paint
from sumo3dviz_pt.world.roads.roads import RoadParts, build_roads
from sumo3dviz_pt.world.roads.strips import distance_to
from sumo3dviz_pt.world.roads.wear.lanes import TRACK_PLACE, wear_across

EXAMPLES = Path(__file__).resolve().parents[5] / "examples"
FOCI = {"crossing": (320.0, 290.0, 330.0, 300.0), "ronda": (450.0, 700.0, 720.0, 715.0)}
NAMES = ["crossing", pytest.param("ronda", marks=pytest.mark.slow)]
QUAD = np.array([[[0.0, 0.0, 1.0], [50.0, 0.0, 1.0], [50.0, 3.0, 1.0], [0.0, 3.0, 1.0]]])
SHARES = np.array([[0.0, 0.02, 0.5, 1.0]])
WEAR = np.tile([1.0, 0.0, 0.0], (1, 2, 4, 1))


@cache
def built(name: str, *, near: bool = True) -> RoadParts:
    network = read_network(EXAMPLES / name / f"{name}.net.xml.gz")
    focus = FOCI[name] if near else None
    return build_roads(network, RoadSettings(), textured=True, focus=focus)


def layers(name: str):
    """Ids and meshes of everything thin that has wear."""
    thin = ("road/wear", "road/tracks", "road/details", "road/repairs", "markings")
    return [(p.id, p.part.mesh) for p in built(name).static if p.id.startswith(thin)]


def corners_of(mesh):
    return mesh.vertices[mesh.faces]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_layer_is_there(name):
    ids = {key for key, _ in layers(name)}
    assert {"road/wear/asphalt", "road/details/asphalt", "markings/asphalt"} <= ids
    assert "road/tracks/asphalt" in ids or name == "ronda"


@pytest.mark.parametrize("name", NAMES)
def test_no_triangle_of_a_layer_is_a_sliver_or_faces_down(name):
    for key, mesh in layers(name):
        corners = corners_of(mesh)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        height = np.linalg.norm(normal, axis=1) / longest
        assert (height > longest / 500).all(), key
        assert normal[:, 2].min() > 0, key


@pytest.mark.parametrize("name", NAMES)
def test_wear_is_within_its_range(name):
    for key, mesh in layers(name):
        factor, paint, yellow = mesh.wear.T
        assert np.isfinite(mesh.wear).all()
        # The darkest is the joint of a manhole (0.3) in the dirtiest track of a junction (0.6).
        assert factor.min() > 0.3 * 0.6 and factor.max() < 1.2, key
        assert paint.min() >= 0.0 and paint.max() <= 1.0, key
        assert set(np.unique(yellow)) <= {0.0, 1.0}, key


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.slow
def test_layers_lie_on_the_carriageway(name):
    cells = built(name).layout.cells
    road = shapely.union_all(cells.polygons[~cells.raised]).buffer(0.02)
    shapely.prepare(road)
    for key, mesh in layers(name):
        middles = corners_of(mesh).mean(axis=1)
        outside = ~shapely.contains(road, shapely.points(middles[:, :2]))
        assert outside.mean() < 0.002, key


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.slow
def test_layers_of_wear_do_not_cover_each_other(name):
    for key, mesh in layers(name):
        corners = corners_of(mesh)[..., :2]
        single = shapely.area(shapely.polygons(corners)).sum()
        assert shapely.unary_union(shapely.polygons(corners)).area == pytest.approx(
            single, rel=2e-3
        ), key


def test_layers_lie_in_their_order():
    heights = {key: mesh.vertices[:, 2] for key, mesh in layers("crossing")}
    order = ["road/wear/asphalt", "road/details/asphalt", "markings/asphalt"]
    levels = [heights[key].max() for key in order]
    assert all(low + 0.001 < high for low, high in pairwise(levels))
    assert heights["road/tracks/asphalt"].min() > 0.001


def test_without_a_camera_nothing_near_is_built():
    ids = {p.id for p in built("crossing", near=False).static}
    assert not {"road/tracks/asphalt", "road/details/asphalt", "road/joints/kerb_joint"} & ids
    assert "road/wear/asphalt" in ids


@pytest.mark.slow
def test_a_plain_colour_shows_no_wear():
    network = read_network(EXAMPLES / "crossing" / "crossing.net.xml.gz")
    for settings, textured in ((RoadSettings(colour="#808080"), True), (RoadSettings(), False)):
        roads = build_roads(network, settings, textured=textured, focus=FOCI["crossing"])
        paved = ("road/paving", "road/bicycle", "markings/bicycle")
        worn = [p.id for p in roads.static if p.part.mesh.wear is not None]
        assert set(worn) <= (set(paved) if textured else set())
        assert any(p.part.material == "line_white" for p in roads.static)


def test_wear_is_darkest_in_tracks_and_middle():
    at = wear_across(np.array([0.0, 0.45, TRACK_PLACE, 1.5]))
    assert at[0] < at[1] and at[2] < at[1] < at[3]
    assert at[3] == pytest.approx(1.0, abs=0.03)
    assert wear_across(np.array([0.3, 1.0])) == pytest.approx(wear_across(np.array([-0.3, -1.0])))


def test_long_quads_are_cut_until_they_are_not_slim():
    piece = graded_on(QUAD, SHARES, WEAR, polygons=np.array([shapely.box(0, 0, 50, 3)]))
    corners = piece.vertices[piece.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    assert longest < 10.0
    assert piece.vertices[:, 2] == pytest.approx(1.0)


def test_cut_quads_keep_the_wear_of_their_places():
    wear = WEAR.copy()
    wear[:, 1, :, 0] = 0.5
    whole = graded_quads(QUAD, SHARES, wear)
    left = clipped(whole, shapely.box(10, 1, 20, 2))
    assert left.vertices[:, 0].min() == pytest.approx(10) and left.vertices[:, 0].max() <= 20.001
    assert left.wear[:, 0] == pytest.approx(1.0 - 0.01 * left.vertices[:, 0], abs=1e-6)
    assert isinstance(clipped(whole, shapely.box(90, 1, 95, 2)), Graded)


def test_arrows_stand_on_lanes_that_lead_different_ways():
    network = read_network(EXAMPLES / "crossing" / "crossing.net.xml.gz")
    paint = arrow_paint(network, layout_roads(network, RoadSettings()).strips)
    assert paint
    lanes = shapely.union_all(
        [shapely.LineString(one.shape[:, :2]).buffer(1.5) for one in network.lanes.values()]
    )
    for one in paint:
        x, y = one.quads[..., 0], one.quads[..., 1]
        area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
        assert (area > 0).all()
        assert shapely.contains(lanes, shapely.points(one.quads[..., :2].reshape(-1, 2))).all()


@pytest.mark.slow
def test_far_paint_has_hard_edges_and_covers_as_much():
    """Ronda's rims were 66,000 triangles; from afar nobody sees them."""
    few, many = (part_of(built("ronda", near=near), "markings/asphalt") for near in (True, False))
    assert len(few.faces) < 0.5 * len(many.faces)
    far = [distance_to(FOCI["ronda"], mesh.vertices) > 250.0 for mesh in (few, many)]
    hard, soft = (mesh.wear[away, 1] for mesh, away in zip((few, many), far, strict=True))
    assert hard.min() > 0.5 > soft.min()
    # A rim fades from all to nothing: half of it counts.
    areas = [far_area(mesh, away) for mesh, away in zip((few, many), far, strict=True)]
    assert 0.7 < areas[0] / areas[1] < 0.95


def part_of(roads: RoadParts, name: str):
    """Mesh of a static part."""
    return next(part.part.mesh for part in roads.static if part.id == name)


def far_area(mesh, away):
    """Area of the triangles whose corners are all far [m2]."""
    corners = corners_of(mesh)[away[mesh.faces].all(axis=1)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * float(np.linalg.norm(normal, axis=1).sum())


def test_distance_to_a_box():
    points = np.array([[0.5, 0.5], [4.0, 5.0], [-3.0, 0.5]])
    assert distance_to((0.0, 0.0, 1.0, 1.0), points) == pytest.approx([0.0, 5.0, 3.0])
    assert (distance_to(None, points) == 0).all()
