"""The town that is invented beside the roads of a network without polygons."""

from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from any_network.programs import call, why_missing

from sumo3dviz_pt.job.settings import Job, ObjectSettings, ObjectsSettings, RoadSettings
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import merge_meshes
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.traffic import Polygon, Scenario, TrafficLog
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.build import World, build_place
from sumo3dviz_pt.world.objects.houses import plan_of, rectangles
from sumo3dviz_pt.world.objects.kinds import INVENTED, KINDS
from sumo3dviz_pt.world.objects.objects import build_scenery
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.rows.fronts import Given, grow_rows
from sumo3dviz_pt.world.town.character import characters_of
from sumo3dviz_pt.world.town.layout import invented, lacks_town

pytestmark = pytest.mark.skipif(bool(why_missing()), reason=why_missing())

GRID = "--grid --grid.number 4 --grid.length 110 --grid.attach-length 80"
CROSSING = (
    "--grid --grid.number 1 --grid.attach-length 160 -L 2 --sidewalks.guess --crossings.guess"
    " --default-junction-type traffic_light"
)
RANDOM = "--rand --rand.iterations 30 --rand.min-distance 60 --rand.max-distance 180"
NETS = {
    "grid": GRID,
    "walks": f"{GRID} --sidewalks.guess --crossings.guess --walkingareas",
    "spider": "--spider --spider.arm-number 6 --spider.circle-number 3 --spider.space-radius 90",
    "random": f"{RANDOM} --seed 5",
    "left": f"{RANDOM} --lefthand --seed 9",
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Networks by options of netgenerate, each made once."""
    folder = tmp_path_factory.mktemp("town")

    @cache
    def make(options):
        name = f"{abs(hash(options))}.net.xml"
        call("netgenerate", [*options.split(), "--no-warnings", "-o", name], folder=folder)
        return read_network(folder / name)

    return make


def scenario_of(network, **more):
    return Scenario(network, TrafficLog((), (), 0.0, 10.0, 1.0), **more)


def town_of(network, *, seed=3, cameras=(), parked=True, **more):
    around = surroundings(network, seed=seed, clearance=Clearance(tuple(cameras)))
    return invented(scenario_of(network, **more), around, parked=parked)


def roads_of(network):
    """Everything on which people drive or walk, a little smaller."""
    shapes = []
    for edge in network.edges.values():
        for lane in edge.lanes:
            if edge.function == "walkingarea":
                shapes.append(shapely.make_valid(shapely.Polygon(lane.shape[:, :2])))
            else:
                line = shapely.LineString(lane.shape[:, :2])
                shapes.append(line.buffer(lane.width / 2.0, cap_style="flat"))
    shapes += [
        shapely.make_valid(shapely.Polygon(junction.outline[:, :2]))
        for junction in network.junctions.values()
        if len(junction.outline) > 2
    ]
    return shapely.union_all(shapes).buffer(-0.02)


def houses_of(town, seed=3):
    """Plans of houses as they are built, of their own sizes."""
    kinds = {kind.name: kind for kind in KINDS}
    plans = []
    for poi in town.pois:
        if poi.type not in ("home", "block"):
            continue
        name = f"{poi.type}s:{poi.id}"
        plan = plan_of(kinds[f"{poi.type}s"], ObjectSettings(), seed=seed, name=name)
        plans.extend(
            rectangles(
                np.array([poi.position]), np.array([poi.yaw]), _size(name, seed) * plan[None]
            )
        )
    return plans


def _size(name, seed):
    return 1.0 + ObjectSettings().variation * (2.0 * share_of(seed, name, "size") - 1.0)


@pytest.mark.parametrize("name", NETS)
def test_nothing_invented_stands_on_a_road_a_footway_or_a_junction(made, name):
    network = made(NETS[name])
    town, roads = town_of(network), roads_of(network)
    assert len(houses_of(town)) > 20
    assert not shapely.intersects(roads, houses_of(town)).any()
    plants = [shapely.Point(k.position) for k in town.pois if k.type in ("tree", "shrub")]
    assert min(shapely.distance(roads, plants)) > 0.5
    for item in town.polygons:
        shape = shapely.Polygon(item.shape) if item.fill else shapely.LineString(item.shape)
        assert shape.is_valid, item.id
        assert not shape.intersects(roads), item.id
    bays = [shapely.Polygon(bay.corners()) for area in town.parking for bay in area.bays]
    assert not shapely.intersects(roads, bays).any()
    cars = [shapely.Point(car.middle).buffer(0.9) for car in town.cars]
    assert cars
    assert not shapely.intersects(roads, cars).any()


@pytest.mark.parametrize("name", NETS)
def test_houses_stand_apart_and_in_their_own_gardens(made, name):
    town = town_of(made(NETS[name]))
    plans = houses_of(town)
    one, other = shapely.STRtree(plans).query(plans, predicate="intersects")
    assert (one == other).all()
    gardens = [shapely.Polygon(k.shape) for k in town.polygons if k.type == "residential"]
    shared = shapely.union_all(gardens).area / sum(garden.area for garden in gardens)
    assert shared > 0.995


def test_gardens_of_a_suburb_have_neighbours_behind_them_and_no_meadow(made):
    network = made("--grid --grid.number 3 --grid.length 240 -L 1")
    town = town_of(network)
    behind = [k for k in town.pois if k.type in ("home", "block") and ":row" in k.id]
    assert len(behind) > 0.15 * len(houses_of(town))
    drives = {k.id.split(":", 1)[-1] for k in town.polygons if ":drive:" in f":{k.id}"}
    assert drives
    assert not any(":row" in name for name in drives)


@pytest.mark.parametrize("name", ["grid", "left"])
def test_pavements_lie_beside_roads_and_bays_and_on_neither(made, name):
    network = made(NETS[name])
    town = town_of(network)
    middle = np.mean([k.position for k in network.junctions.values()], axis=0)[None] + [0, 0, 1.5]
    around = surroundings(network, seed=3, viewpoints=middle)
    layout = layout_roads(network, RoadSettings())
    rows = grow_rows(network, layout.paved, Given((), (), town.characters), around=around)
    courts = shapely.union_all(list(rows.forecourts))
    assert courts.area > 300.0
    assert courts.intersection(shapely.union_all(list(layout.paved))).area < 0.2
    assert courts.distance(shapely.union_all(list(layout.paved))) < 0.01


def test_a_town_is_the_same_again_and_another_one_with_another_seed(made):
    network = made(NETS["random"])
    one, again, other = town_of(network), town_of(network), town_of(network, seed=4)
    assert one.pois == again.pois
    assert one.cars == again.cars
    assert [k.id for k in one.polygons] == [k.id for k in again.polygons]
    assert one.pois != other.pois


def test_a_change_at_one_place_shuffles_nothing_far_from_it(made):
    network = made("--grid --grid.number 8 --grid.length 120")

    corner = min(
        (k for k in network.edges.values() if k.function == "normal"),
        key=lambda k: k.lanes[0].shape[:, :2].sum(),
    )
    edges = {key: edge for key, edge in network.edges.items() if key != corner.id}
    less = Network(edges, network.junctions, (), network.location)

    def far(town):
        away = corner.lanes[0].shape[:, :2].mean(axis=0)
        return [k for k in town.pois if np.hypot(*(np.array(k.position) - away)) > 450.0]

    before, after = far(town_of(network)), far(town_of(less))
    assert len(before) > 100
    assert before == after


@pytest.mark.parametrize(
    ("options", "most"),
    [
        pytest.param(f"{GRID} -L 2 --default-junction-type traffic_light", "centre", id="lit"),
        pytest.param(CROSSING, "centre", id="one crossing of main streets"),
        pytest.param(f"{GRID.replace('110', '150')} -L 1", "suburb", id="wide grid"),
        pytest.param("--grid --grid.number 3 --grid.length 320 -L 1", "village", id="sparse"),
        pytest.param(f"{GRID} -L 1 --default.speed 27.8", "country", id="fast and narrow"),
        pytest.param(f"{GRID} -L 3 --default.speed 33.3", "motorway", id="fast and wide"),
    ],
)
def test_a_network_tells_what_lies_around_its_roads(made, options, most):
    counts = Counter(characters_of(made(options)).values())
    assert counts.most_common(1)[0][0] == most, counts


def test_nothing_is_invented_where_the_word_does_not_ask_for_it(made):
    scenario = scenario_of(made(NETS["grid"]))
    world = World.of(scenario, Job.model_validate(job()))
    assert world.town is None
    assert world.scenario is scenario
    asked = World.of(scenario, Job.model_validate(job(street={"town": "auto"})))
    assert asked.town is not None
    assert {k.source for k in asked.scenario.pois} == {INVENTED}
    origin = asked.town.origin(asked.scenario)
    # Only what files really brought is said to be from files.
    assert origin["from files"] == ", ".join(
        ["roads", "traffic", *(["signals"] if asked.scenario.signals else [])]
    )
    bare = World.of(scenario, Job.model_validate(job(street={"town": "auto", "parked": "none"})))
    assert bare.town is not None
    assert not bare.town.cars
    assert not bare.scenario.parking


def job(**more):
    camera = {"mode": "eulerian", "position": [0, 0, 2], "heading": 90}
    return {"scenario": {"network": "a.net.xml"}, "cameras": {"c": camera}, **more}


def test_nothing_tall_stands_before_a_camera(made):
    network = made(NETS["grid"])
    free = town_of(network)
    home = next(k for k in free.pois if k.type == "home")
    eye = np.array([[*home.position, 1.6]])
    town = town_of(network, cameras=[CameraPath.all_round(eye)])
    assert home.id not in {k.id for k in town.pois}
    assert len(town.pois) > 0.8 * len(free.pois)


def test_what_a_scenario_brings_keeps_its_place(made):
    network = made(NETS["grid"])
    home = next(k for k in town_of(network).pois if k.type == "home")
    spot = shapely.Point(home.position).buffer(10.0)
    lake = Polygon("lake", "natural.water", shapely.get_coordinates(spot), True, None, "own")
    town = town_of(network, polygons=(lake,))
    assert not shapely.intersects(spot, houses_of(town)).any()


def test_only_scenarios_without_a_town_of_their_own_lack_one(made):
    empty = scenario_of(made(NETS["grid"]))
    square = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]])
    houses = tuple(Polygon(str(k), "building", square, True, None, "own") for k in range(9))
    assert lacks_town(empty)
    assert lacks_town(replace(empty, polygons=houses[:2]))
    assert not lacks_town(replace(empty, polygons=houses))


def test_houses_on_a_slope_stand_on_their_lowest_corner(made):
    network = made(NETS["grid"])
    home = next(k for k in town_of(network).pois if k.type == "home")
    around = surroundings(network, seed=3, height_at=lambda places: 0.1 * places[:, 0])
    scenery = build_scenery([home], (), ObjectsSettings(), around=around)
    mesh = merge_meshes([part.part.mesh for part in scenery.static])
    low = mesh.vertices[:, 2] < mesh.vertices[:, 2].min() + 0.5
    assert (mesh.vertices[low, 2] <= 0.1 * mesh.vertices[low, 0] + 0.35).all()


@pytest.mark.slow
def test_footpaths_alone_have_no_town_and_no_paint(made, tmp_path):
    whole = made("--grid --grid.number 2 --grid.length 60 --walkingareas")
    paths = {
        key: replace(
            edge,
            lanes=tuple(replace(k, allowed=frozenset({"pedestrian"})) for k in edge.lanes),
        )
        for key, edge in whole.edges.items()
    }
    network = replace(whole, edges=paths)
    scenario = Scenario(network, TrafficLog((), (), 0.0, 0.0, 0.0))
    job = Job.model_validate({"scenario": {"network": "n"}, "street": {"town": "auto"}})
    world = World.of(scenario, job)
    assert world.town is not None and not any(world.town.counts().values())
    built = build_place(world, CameraPath.all_round(np.array([[30.0, -10.0, 9.0]])))
    families = {part.family for part in built.static}
    assert "roads" in families and not families & {"markings", "signals", "signs"}
