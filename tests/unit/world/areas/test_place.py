"""Areas and stops of whole small scenes: nothing on carriageways, none where there are none."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import GroundSettings, Job
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Bay, ParkingArea, Polygon, Scenario, Stop, TrafficLog
from sumo3dviz_pt.world.areas.slabs import SlabGround, build_slabs, slabs_of
from sumo3dviz_pt.world.build import World, build_place
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.plants.trees import plot_of
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT

CARS = frozenset({"passenger", "bus", "truck", "delivery"})
EYE = CameraPath.all_round(np.array([[100.0, 20.0, 30.0]]))
BOX = (0.0, -120.0, 200.0, 120.0)


def lane(name, y, *, allowed=CARS):
    edge = name.rsplit("_", 1)[0]
    shape = np.array([(0.0, y, 0.0), (200.0, y, 0.0)])
    return Lane(name, edge, 0, shape, 3.2, 13.9, 200.0, allowed)


def network():
    lanes = (lane("road_0", -1.6), lane("rail_0", -60.0, allowed=frozenset({"rail"})))
    edges = {k.edge_id: Edge(k.edge_id, "normal", "a", "b", (k,)) for k in lanes}
    ends = {
        name: Junction(name, "dead_end", np.array([x, 0.0, 0.0]), np.zeros((0, 3)))
        for name, x in (("a", 0.0), ("b", 200.0))
    }
    return Network(
        edges=edges,
        junctions=ends,
        connections=(),
        location=Location((0.0, 0.0), BOX),
    )


def polygon(name, type_, x0, y0, x1, y1):
    ring = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=np.float64)
    return Polygon(name, type_, ring, True, None, "a.add.xml")


def scenario(*polygons, stops=(), parking=()):
    log = TrafficLog((), (), 0.0, 0.0, 0.0)
    return Scenario(network(), log, polygons=polygons, stops=stops, parking=parking)


PLAIN = {"planting": "none", "horizon": "flat"}
BARE = {"fronts": "none", "lamps": "none", "signs": "none", "furniture": "none"}


def place(given, **settings):
    settings = PLAIN | settings
    job = Job.model_validate(
        {"scenario": {"network": "n"}, "ground": settings, "street": BARE, "lights": "off"}
    )
    return build_place(World.of(given, job), EYE)


BAYS = tuple(Bay((30.0 + 6.0 * k, -4.8), 0.0, 6.0, 2.4) for k in range(4))
POND = polygon("w", "natural.water", 20, 10, 80, 60)


@pytest.fixture(scope="module")
def everything():
    """A place with areas and stops of all kinds."""
    return place(
        scenario(
            POND,
            polygon("f", "landuse.farmland", 100, -40, 150, 12),
            polygon("s", "place.square", 150, -40, 190, 12),
            polygon("n", "natural.wood", 90, 12, 140, 60),
            polygon("p", "natural.water", 100, 30, 120, 50),
            stops=(
                Stop("t", "rail_0", 50.0, 120.0, "train"),
                Stop("c", "rail_0", 140.0, 180.0, "container"),
                Stop("e", "road_0", 62.0, 74.0, "charging"),
            ),
            parking=(ParkingArea("p", "road_0", BAYS, 4),),
        )
    )


def parts_of(built, family="areas"):
    return {part.id: part.part for part in built.static if part.family == family}


def over(part, box):
    """Triangles of a part whose middle lies in a box, (k, 3, 3) [m]."""
    corners = part.mesh.vertices[part.mesh.faces]
    middle = corners.mean(axis=1)
    return corners[shapely.contains_xy(box, middle[:, :2])]


CARRIAGEWAY = shapely.box(0.5, -3.15, 199.5, -0.05)


def test_a_scene_without_areas_has_none_and_says_so():
    built = place(scenario())
    assert parts_of(built) == {}
    assert "water" not in built.materials
    assert [(o.what, o.why) for o in built.left_out if o.what == "areas"] == [
        ("areas", "the scenario has none in view")
    ]


def test_one_word_switches_them_off():
    built = place(scenario(POND), areas="none")
    assert parts_of(built) == {}
    assert ("areas", "switched off by `ground.areas`") in [(o.what, o.why) for o in built.left_out]


@pytest.mark.slow
def test_roads_lie_on_top_of_all_areas(everything):
    parts = parts_of(everything)
    assert {"areas/area:ground_grass", "areas/area:paving", "areas/water"} <= set(parts)
    for name, part in parts.items():
        assert len(over(part, CARRIAGEWAY)) == 0, name


def test_water_is_cut_into_the_ground(everything):
    pond = shapely.box(25, 15, 75, 55)
    ground = next(part.part for part in everything.static if part.id == "ground")
    assert over(parts_of(everything)["areas/water"], pond)[..., 2].max() < -0.3
    assert len(over(ground, pond)) == 0
    assert everything.materials["water"]["type"] == "normalmap"


def test_trees_grow_in_woods_and_nowhere_else(everything):
    stems = next(p.part for p in everything.static if p.id == "trees/bark")
    feet = stems.mesh.vertices[stems.mesh.vertices[:, 2] < 0.15, :2]
    assert len(feet) > 100
    assert shapely.contains_xy(shapely.box(89, 11, 141, 61), feet).all()
    assert not shapely.contains_xy(shapely.box(100, 30, 120, 50), feet).any()


def test_nothing_is_planted_on_squares_and_in_parking_areas():
    slab = Polygon("x", "slab", polygon("x", "", 0, 5, 50, 40).shape, True, None, "stops")
    plot = plot_of([], [], [polygon("s", "place.square", 60, 5, 100, 40), slab])
    places = np.array([(80.0, 20.0), (25.0, 20.0), (150.0, 20.0)])
    assert plot.free(places, margin=2.0).tolist() == [False, False, True]


def test_bays_lie_level_with_the_road_and_have_lines(everything):
    parts = parts_of(everything)
    asphalt, white = parts["areas/area:asphalt_old"], parts["areas/line_white"]
    tops = over(asphalt, shapely.box(25, -5.9, 47, -3.7))
    assert tops[..., 2] == pytest.approx(0.0, abs=0.01)
    marks = over(white, shapely.box(20, -7, 60, -2))
    assert len(marks) and marks[..., 2].min() > tops[..., 2].max()
    middles = marks.mean(axis=1)[:, 0]
    for x in (24.0, 30.0, 48.0):
        assert np.abs(middles - x).min() < 1.0


def test_platforms_stand_beside_their_rails(everything):
    paving = parts_of(everything)["areas/area:paving"]
    tops = over(paving, shapely.box(40, -70, 130, -55))
    low, high = tops.reshape(-1, 3).min(axis=0), tops.reshape(-1, 3).max(axis=0)
    assert low == pytest.approx((50.0, -64.68, 0.546), abs=0.01)
    assert high == pytest.approx((120.0, -61.68, 0.546), abs=0.01)


def test_charging_posts_stand_behind_the_kerb(everything):
    points = np.concatenate([p.mesh.vertices for p in parts_of(everything).values()])
    posts = points[(points[:, 2] > 1.2) & (points[:, 1] > -10.0) & (points[:, 1] < 0.0)]
    assert len(posts) and posts[:, 1].max() < -3.2
    assert np.ptp(posts[:, 0]) == pytest.approx(6.0, abs=1.0)


@pytest.mark.parametrize(("kind", "deep"), [("train", 3.0), ("container", 8.0)])
@pytest.mark.parametrize("left", [False, True])
def test_slabs_of_stops_lie_on_the_side_of_the_doors(kind, deep, left):
    given = scenario(stops=(Stop("s", "rail_0", -150.0, -80.0, kind),))
    given = replace(given, network=replace(given.network, left_hand=left))
    (slab,) = slabs_of(given)
    near, far = 1.6 + 0.08, 1.6 + 0.08 + deep
    sides = (-60.0 + near, -60.0 + far) if left else (-60.0 - far, -60.0 - near)
    assert slab.shape.bounds == pytest.approx((50.0, sides[0], 120.0, sides[1]))


def test_a_platform_without_room_is_left_out_and_named():
    given = scenario(stops=(Stop("s", "road_0", 50.0, 120.0, "train"),))
    wide = shapely.box(0, -20, 200, 20)
    around = surroundings(given.network, seed=1, camera_path=EYE)
    level = lambda places: np.zeros(len(places))  # noqa: E731
    ground = SlabGround([wide], [], level, level, around, (0.0, 0.0))
    found = build_slabs(given, ground)
    assert found.parts == ()
    assert [o.what for o in found.left_out] == ["1 platforms"]


def test_the_default_is_auto():
    assert GroundSettings().areas == "auto"


def test_people_stand_on_what_jupedsim_lets_them_walk_and_obstacles_rise_from_it():
    square = ((60, 10, 100, 40), "jupedsim.walkable_area")
    slim, wide = ((70, 20, 70.6, 20.6), (80, 20, 88, 22))
    given = scenario(
        polygon("plaza", square[1], *square[0]),
        polygon("slim", "jupedsim.obstacle", *slim),
        polygon("wide", "jupedsim.obstacle", *wide),
        polygon("gone", "jupedsim.vanishing_area", 95, 35, 99, 39),
    )
    built = place(given)
    on, off, edge = built.footway(np.array([[65.0, 30.0], [65.0, 42.0], [65.0, 40.2]]))
    assert on == pytest.approx(SIDEWALK_HEIGHT)
    # On a slope a lane far away gave them another height; on a bridge they are not on it.
    sunk, far = built.footway(np.array([[65.0, 30.0, -0.7], [65.0, 30.0, 8.0]]))
    assert sunk == pytest.approx(0.7 + SIDEWALK_HEIGHT, abs=0.01)
    assert far == 0.0
    assert off == 0.0
    assert 0.0 < edge < on
    top = np.concatenate(
        [
            p.part.mesh.vertices
            for p in built.static
            if p.id.startswith("areas/") and "paving" in p.id
        ]
    )
    assert top[:, 2] == pytest.approx(SIDEWALK_HEIGHT, abs=0.01)
    blocks = np.concatenate(
        [
            p.part.mesh.vertices
            for p in built.static
            if p.id.startswith("areas/") and "concr" in p.id
        ]
    )
    for (x0, _, x1, y1), high in ((slim, 2.6), (wide, 0.9)):
        inside = (blocks[:, 0] >= x0) & (blocks[:, 0] <= x1) & (blocks[:, 1] <= y1)
        assert blocks[inside, 2] == pytest.approx(SIDEWALK_HEIGHT + high, abs=0.01)
    assert not any("jupedsim" in out.what for out in built.left_out)


def test_people_wait_on_platforms_not_in_them():
    stop = Stop("s", "rail_0", 40.0, 90.0, "train")
    given = scenario(stops=(stop,))
    lane_ = given.network.lanes["rail_0"]
    beside = np.array([[60.0, -60.0 - lane_.width / 2 - 1.0], [150.0, -63.0]])
    on, off = place(given).footway(beside)
    assert (on, off) == (pytest.approx(0.55), 0.0)
