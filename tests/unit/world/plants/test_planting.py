"""Planting: never on what is paved or built, nor in a camera's sight; always the same."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from any_network.proposed import Plants, Pose
from any_network.proposed import planted as planted_before
from any_network.shared import unshared
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.job.settings import ObjectsSettings
from sumo3dviz_pt.library.plants.tree import SHRUBS, SPECIES
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Poi
from sumo3dviz_pt.world.areas.covers import Area, Cover
from sumo3dviz_pt.world.areas.planting import Stand, grow
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.objects.objects import build_scenery
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.plants.trees import (
    CLEAR,
    MARGIN,
    MOST,
    MOST_SHRUBS,
    MOST_TREES,
    SHRUB_OFF,
    TREE_OFF,
    Plot,
    before_cameras,
    in_sight,
    plant,
    plant_far,
    why_bare,
    why_nowhere,
)
from sumo3dviz_pt.world.plants.wayside import wayside, yard_trees
from sumo3dviz_pt.world.rows.fronts import Yard

EMPTY = Network({}, {}, (), Location())
ROAD = shapely.box(-900.0, -6.0, 900.0, 6.0)
HOUSE = shapely.box(60.0, 60.0, 90.0, 80.0)


def camera_path(eye=(0.0, 0.0, 10.0), way=(1.0, 0.0, 0.0), half=0.6):
    return CameraPath(np.array([eye]), np.array([way]), np.array([half]))


def around(seed=1, **kw):
    return surroundings(
        EMPTY, seed=seed, camera_path=camera_path(**kw), height_at=lambda at: np.zeros(len(at))
    )


def spots(pois, kind):
    at = [poi.position for poi in pois if poi.type == kind]
    return np.array(at, dtype=float).reshape(-1, 2)


@settings(max_examples=tries(4), deadline=None)
@given(
    st.integers(0, 99),
    st.floats(-400, 400),
    st.lists(st.tuples(*[st.floats(-400, 400)] * 2, st.floats(3, 60)), max_size=4),
)
def test_nothing_stands_on_roads_or_in_footprints(seed, y, discs):
    paved = [ROAD, *(shapely.Point(a, b).buffer(r) for a, b, r in discs)]
    plot = Plot(paved, [HOUSE], np.array([(100.0, 100.0)]))
    found = plant(EMPTY, plot, around=around(seed, eye=(0.0, y, 10.0))).pois
    for kind, margin in (("tree", TREE_OFF), ("shrub", SHRUB_OFF)):
        places = spots(found, kind)
        if not len(places):
            continue
        points = shapely.points(places)
        assert min(shapely.distance(area, points).min() for area in paved) >= margin - 1e-6
        assert shapely.distance(HOUSE, points).min() >= MARGIN - 1e-6
        assert np.hypot(*(places - [100.0, 100.0]).T).min() >= MARGIN


def test_land_that_roads_enclose_is_free_in_its_middle():
    corners = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)])
    ring = shapely.Polygon(300.0 * corners, [290.0 * np.roll(corners, 2, axis=0)])
    places = np.stack(np.meshgrid(*[np.linspace(-400.0, 400.0, 81)] * 2), axis=-1).reshape(-1, 2)
    free = Plot([ring]).free(places, margin=TREE_OFF)
    away = shapely.distance(ring, shapely.points(places))
    np.testing.assert_array_equal(free, away > TREE_OFF)


def test_planting_depends_on_the_seed_only():
    one, again, other = (plant(EMPTY, Plot([ROAD]), around=around(seed)).pois for seed in (1, 1, 2))
    assert one == again != other
    assert len({poi.id for poi in one}) == len(one)
    assert {poi.params["model"] for poi in one} <= {*SPECIES, *SHRUBS}
    assert all(kind_of(poi.type, poi.source) in ("trees", "shrubs") for poi in one)


def test_there_are_enough_and_not_too_many():
    found = plant(EMPTY, Plot([ROAD]), around=around(half=3.0)).pois
    assert 100 < len(spots(found, "tree")) <= MOST_TREES
    assert 20 < len(spots(found, "shrub")) <= MOST_SHRUBS


def test_no_tree_hides_the_roads_before_a_camera_that_stays():
    trees = spots(plant(EMPTY, Plot([ROAD]), around=around()).pois, "tree")
    angle = np.abs(np.arctan2(trees[:, 1], trees[:, 0]))
    assert np.hypot(*trees[angle < 0.5].T).min() > CLEAR


def test_a_high_camera_sees_crowns_whose_feet_lie_below_its_picture():
    looks = around(eye=(0.0, 0.0, 19.0), way=(np.cos(0.33), 0.0, -np.sin(0.33)), half=0.585)
    assert in_sight(np.array([[6.7, 0.0], [-6.7, 0.0]]), looks).tolist() == [True, False]


def test_no_shrub_stands_right_before_a_low_lens():
    far = plant(EMPTY, Plot([ROAD]), around=around()).pois
    shrubs = spots(far, "shrub")
    x, y = shrubs[np.hypot(*shrubs.T).argmin()].tolist()
    near = plant(EMPTY, Plot([ROAD]), around=around(eye=(x - 8.0, y, 2.2))).pois
    left = spots(near, "shrub") - [x, y]
    assert len(left) and np.hypot(*left.T).min() > 0.5
    above = plant(EMPTY, Plot([ROAD]), around=around(eye=(x - 8.0, y, 12.0))).pois
    assert np.hypot(*(spots(above, "shrub") - [x, y]).T).min() < 0.1, "it is far below that picture"


def test_what_lies_far_stands_free_too_and_keeps_its_budget():
    parts = plant_far(Plot([ROAD]), around=around(half=3.0))
    for part in parts:
        assert not shapely.contains_xy(ROAD, part.part.mesh.vertices[:, :2]).any()
    trees = sum(len(part.part.mesh.faces) for part in parts if part.part.material == "leaf")
    assert 0.3 * MOST < trees <= MOST
    again = plant_far(Plot([ROAD]), around=around(half=3.0))
    pairs = zip(parts, again, strict=True)
    assert all((a.part.mesh.vertices == b.part.mesh.vertices).all() for a, b in pairs)


@pytest.mark.parametrize(
    ("pois", "bare"),
    [((), False), (("tree", 60.0), True), (("tree", -300.0), False), (("bench", 60.0), False)],
)
def test_only_land_without_trees_in_view_is_planted(pois, bare):
    given = [Poi("a", pois[0], (pois[1], 0.0), None, None, "a.xml")] if pois else []
    assert (why_bare(given, (), around()) is not None) == bare


@pytest.mark.parametrize(("surface", "bare"), [("ground_grass", False), ("ground_sand", True)])
def test_only_green_land_is_planted(surface, bare):
    assert (why_nowhere(surface) is not None) == bare


def street(speed=13.9):
    """A straight road of three lanes along the x axis."""
    places = [np.array([[-400.0, 3.5 * k, 0.0], [400.0, 3.5 * k, 0.0]]) for k in (-1, 0, 1)]
    lanes = tuple(
        Lane(f"e_{k}", "e", k, line, 3.5, speed, 800.0, frozenset({"passenger"}))
        for k, line in enumerate(places)
    )
    return Network({"e": Edge("e", "normal", "A", "B", lanes)}, {}, (), Location())


def in_woods(_, around):
    """A wood beside the street."""
    shape = shapely.box(-90.0, 10.0, 90.0, 60.0)
    cover = Cover(surface="ground", trees=250.0, shrubs=120.0, species={"oak": 1.0, "pine": 1.0})
    return grow(
        [Stand(Area("wood", "wood", shape), cover, shape)], Plot([ROAD]), around=around
    ).pois


def in_yards(_, around):
    """Gardens beside the street, in a row."""
    plans = [shapely.box(x, 10.0, x + 19.0, 30.0) for x in np.arange(-80.0, 80.0, 20.0)]
    corners = [shapely.get_coordinates(plan)[:4] for plan in plans]
    return yard_trees([Yard(f"{k}:0", plan, 1) for k, plan in enumerate(corners)], around)


PLANTERS = {
    "country": lambda network, around: plant(network, Plot([ROAD]), around=around).pois,
    "belts": lambda network, around: wayside(network, Plot([ROAD]), (), around=around)[0],
    "woods": in_woods,
    "yards": in_yards,
}


def flight_past(pois):
    """Somebody who knows nothing of plants flies a camera past them, at the road or at them."""
    rng = np.random.default_rng(33)
    spots = np.array([poi.position for poi in pois if np.hypot(*poi.position) < 100.0])
    for number, place in enumerate(spots[rng.permutation(len(spots))[:6]]):
        away, turn = rng.uniform(3.0, 24.0), rng.uniform(0.3, np.pi - 0.3)
        eye = np.array([*(place + away * np.array([np.cos(turn), np.sin(turn)])), 0.0])
        eye[2] = rng.uniform(1.8, 16.0)
        aim = [place[0], 0.0, 0.5] if number % 2 else [*place, 2.0]
        yield Pose(eye, np.array(aim), 60.0)


@pytest.mark.slow
@pytest.mark.parametrize("planter", PLANTERS)
def test_no_plant_of_ours_hides_much_of_a_picture_whoever_chose_the_camera(planter):
    """What grows is looked at through pictures, not by the rule that planted it."""
    network = street(speed=36.0 if planter == "belts" else 13.9)
    bare = surroundings(network, seed=1, viewpoints=np.zeros((1, 3)), clearance=Clearance())
    poses = list(flight_past(PLANTERS[planter](network, bare)))
    half = np.arctan(np.tan(np.radians(30.0)) * np.hypot(1.0, 9.0 / 16.0))
    way = CameraPath(
        np.array([pose.eye for pose in poses]),
        np.array([pose.axes()[0] for pose in poses]),
        np.full(len(poses), half),
    )
    faults = {}
    for clear in (False, True):
        clearance = Clearance((way,) if clear else ())
        here = surroundings(network, seed=1, camera_path=way, clearance=clearance)
        pois = [
            poi
            for poi in PLANTERS[planter](network, here)
            if np.hypot(*(way.positions[:, :2] - poi.position).T).min() < 60.0
        ]
        built = build_scenery(pois, (), ObjectsSettings(), around=here, budget=90_000)
        plants = Plants.among([*built.static, *unshared(built.stands)])
        faults[clear] = [
            fault for pose in poses for fault in planted_before(pose, plants, here.index)
        ]
    assert len(faults[False]) > 5, "the law sees what stands in the way"
    assert not faults[True], "\n".join(faults[True])


def test_trees_of_the_scenario_stay_before_a_camera_and_that_is_said_where_its_file_has_them():
    far = replace(street(), location=Location(origin=(400_000.0, 5_000_000.0)))
    own = [
        Poi(name, kind, (x, 1.0), None, None, "a.xml")
        for name, kind, x in (("a", "tree", 12.0), ("b", "tree", -30.0), ("c", "shrub", 300.0))
    ]
    (said,) = before_cameras(own, far, around(eye=(0.0, 0.0, 3.0)))
    assert said.what == "a clear view past 1 trees of the scenario"
    assert "(400012, 5000001)" in said.why
    assert not before_cameras(own[1:], far, around(eye=(0.0, 0.0, 3.0)))
