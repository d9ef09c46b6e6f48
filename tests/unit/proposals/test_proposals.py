"""What `init` proposes: a template by the roads, a place by who moves, cameras by what they see."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.inspection.checks import check_scene
from sumo3dviz_pt.job.cameras import CinematicCamera
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Poi, Polygon, Scenario, Trace, TrafficLog, VehicleType
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.proposals.busiest import Busiest, busiest, choose_rides, movement_of
from sumo3dviz_pt.proposals.eyes import (
    Subjects,
    ViewPoses,
    apart,
    meetings_of,
    not_looming,
    rated,
    riding_apart,
    shows_none,
    subjects_of,
    unblocked,
)
from sumo3dviz_pt.proposals.outdoors import Outdoors, near_network, outdoors
from sumo3dviz_pt.proposals.proposal import choose_template, propose
from sumo3dviz_pt.proposals.views import Scouting, corner, flight, overview
from sumo3dviz_pt.world.placement.lanes import build_lane_index

EXAMPLES = Path(__file__).parents[3] / "examples"

CARS = frozenset({"passenger", "bus", "truck", "delivery"})
CENTRE = np.zeros(3)
TYPES = {
    "car": VehicleType("car", "passenger", 4.5, 1.8, 1.5),
    "bus": VehicleType("bus", "bus", 12.0, 2.5, 3.2),
}


def road(name, ends, *, lanes=1, speed=13.9, type_="", height=0.0):
    """An edge in one direction through two points."""
    (x0, y0), (x1, y1) = ends
    way = np.array([x1 - x0, y1 - y0])
    right = np.array([way[1], -way[0]]) / np.hypot(*way)
    found = []
    for k in range(lanes):
        shift = right * (1.6 + 3.2 * (lanes - 1 - k))
        at = np.array([[x0, y0], [x1, y1]]) + shift
        shape = np.column_stack([at, [height, height]])
        length = float(np.hypot(*way))
        found.append(Lane(f"{name}_{k}", name, k, shape, 3.2, speed, length, CARS))
    return Edge(name, "normal", name.split(">")[0], name.split(">")[1], tuple(found), type_)


def cross(*, reach=150.0, links=(), height=0.0, **how):
    """A crossing of two roads at the origin."""
    ends = {"N": (0, reach), "E": (reach, 0), "S": (0, -reach), "W": (-reach, 0)}
    edges = {}
    for name, end in ends.items():
        edges[f"{name}>C"] = road(f"{name}>C", (end, (0, 0)), height=height, **how)
        edges[f"C>{name}"] = road(f"C>{name}", ((0, 0), end), height=height, **how)
    places = {**ends, "C": (0.0, 0.0)}
    junctions = {
        name: Junction(name, "priority", np.array([*at, 0.0]), np.zeros((0, 3)))
        for name, at in places.items()
    }
    return Network(edges, junctions, tuple(links), Location())


def trace(name, start, speed, *, span=(0.0, 40.0), kind="vehicle", type_="car", at=0.0):
    """A straight drive: where it is at the time `at`, and its velocity (x, y) [m/s]."""
    times = np.arange(span[0], span[1] + 0.5, 1.0)
    path = np.array([*start, 0.0])[:3] + np.outer(times - at, [*speed, 0.0])
    n = len(times)
    yaw = np.full(n, np.arctan2(speed[1], speed[0]))
    flat, none = np.zeros(n), np.full(n, -1)
    fast = np.full(n, np.hypot(*speed))
    return Trace(name, kind, type_, times, path, yaw, fast, flat, none, none)


def crossers(height=0.0):
    """Four cars that cross the origin one after the other."""
    return [
        trace(f"c{k}", (0.0, -1.6, height), (9.0, 0.0), at=12.0 + 2.0 * k) for k in range(4)
    ] + [trace(f"n{k}", (1.6, 0.0, height), (0.0, 8.0), at=13.0 + 2.0 * k) for k in range(4)]


def found_at(place=CENTRE, start=10.0):
    return Busiest(start, start + 10.0, np.array(place), "", 8)


def scouting(scenario, *, place=CENTRE, sun=None):
    """All that cameras are chosen by, for the middle of a log."""
    movement = movement_of(scenario.traffic.traces).during(10.0, 20.0)
    around = outdoors(scenario, np.array(place), movement)
    return Scouting(found_at(place), movement, around, sun)


def scenario_of(traces, network=None, **more):
    log = TrafficLog(tuple(traces), (), 0.0, 40.0, 1.0)
    return Scenario(network or cross(), log, TYPES, **more)


# Template -----------------------------------------------------------------------------------

TLS = Connection("N>C_0", "C>S_0", tls="t", link_index=0)


@pytest.mark.parametrize(
    ("network", "template", "word"),
    [
        (cross(speed=36.0, lanes=3), "highway_day", "100 %"),
        (cross(speed=13.9, type_="highway.motorway"), "highway_day", "motorways"),
        (cross(speed=27.8), "highway_day", "75 km/h"),
        (cross(links=[TLS]), "city_day", "a traffic light"),
        (cross(lanes=2), "city_day", "wide"),
        (cross(), "village_day", "narrow"),
        (replace(cross(), edges={}), "village_day", "no cars"),
    ],
)
def test_template_by_roads(network, template, word):
    chosen = choose_template(network, CENTRE)
    assert chosen.name == template and word in chosen.why


def test_many_narrow_streets_are_a_town_and_far_roads_do_not_count():
    edges = {}
    for k in range(20):
        edges |= {f"a{k}>b": road(f"a{k}>b", ((-400, 20 * k - 200), (400, 20 * k - 200)))}
    assert choose_template(replace(cross(), edges=edges), CENTRE).name == "city_day"
    far = road("x>y", ((-900, 2000), (900, 2000)), lanes=4, speed=36.0)
    assert choose_template(replace(cross(), edges=cross().edges | {"x>y": far}), CENTRE).name == (
        "village_day"
    )


STREET = CARS | {"pedestrian", "bicycle"}


def osm_crossing(*, allowed=STREET, lanes=2, reach=160.0, type_="highway.secondary"):
    """A crossing of which the map tells no limit: SUMO's type map takes 27.78 m/s."""
    network = cross(reach=reach, lanes=lanes, speed=27.78, type_=type_)
    edges = {
        name: replace(
            edge, lanes=tuple(replace(lane, allowed=frozenset(allowed)) for lane in edge.lanes)
        )
        for name, edge in network.edges.items()
    }
    return replace(network, edges=edges)


def test_an_unknown_limit_makes_no_motorway():
    assert choose_template(osm_crossing(), CENTRE).name == "city_day"
    assert choose_template(osm_crossing(lanes=1), CENTRE).name == "village_day"
    assert choose_template(osm_crossing(allowed=CARS), CENTRE).name == "highway_day"
    assert choose_template(osm_crossing(type_=""), CENTRE).name == "highway_day", "drawn by hand"


def test_footways_signals_and_houses_outvote_a_fast_limit():
    fast = cross(speed=25.0, links=[TLS])
    assert choose_template(fast, CENTRE).name == "highway_day", "a ramp may have a signal"
    assert choose_template(fast, CENTRE, [house("h", (20, 20), (40, 40))]).name == "city_day"
    ramp = cross(speed=33.3, links=[TLS], reach=80.0)
    assert choose_template(ramp, CENTRE, [house("h", (20, 20), (40, 40))]).name == "highway_day"
    named = cross(type_="highway.motorway", links=[TLS])
    assert choose_template(named, CENTRE, [house("h", (20, 20), (40, 40))]).name == "highway_day"


# Moment and place ---------------------------------------------------------------------------


def test_parked_cars_lose_against_movers():
    parked = [trace(f"p{k}", (500.0 + 3 * k, 500.0), (0.0, 0.0)) for k in range(30)]
    movement = movement_of([*parked, *crossers()])
    found = busiest(movement, cross(), span=(0.0, 40.0), length=10.0)
    assert found.junction == "C" and np.hypot(*found.place[:2]) < 1.0
    assert found.movers == 8
    assert found.start <= 14.0 and found.end >= 19.0 and found.end - found.start == 10.0


def test_persons_count_less_than_vehicles_but_count():
    walkers = [
        trace(f"w{k}", (300.0 + k, 300.0), (1.3, 0.0), kind="person", type_="") for k in range(4)
    ]
    drivers = [trace(f"d{k}", (-200.0, -200.0 + k), (3.0, 0.0), at=15.0) for k in range(4)]
    alone = busiest(movement_of(walkers), cross(), span=(0.0, 40.0), length=10.0)
    assert alone.place[0] > 250.0 and alone.movers == 4
    both = busiest(movement_of([*walkers, *drivers]), cross(), span=(0.0, 40.0), length=10.0)
    assert both.place[0] < 0.0


def test_a_log_of_parked_cars_or_of_a_moment_has_a_place():
    parked = movement_of([trace("p", (5.0, 7.0), (0.0, 0.0))])
    assert busiest(parked, cross(), span=(0.0, 40.0), length=10.0).movers == 0
    short = movement_of([trace("s", (0.0, 0.0), (9.0, 0.0), span=(0.0, 3.0))])
    found = busiest(short, cross(), span=(0.0, 3.0), length=10.0)
    assert (found.start, found.end) == (0.0, 3.0)


def test_what_was_teleported_did_not_drive():
    jump = trace("j", (0.0, 0.0), (0.0, 0.0))
    places = jump.positions.copy()
    places[20:, 0] += 900.0
    movement = movement_of([replace(jump, positions=places)])
    assert movement.driven.sum() == 0.0


def with_crumbs():
    """A crossing in four pieces that edges of 8 m join, and a bend of crumbs in the west."""
    network = cross()
    spots = {"C": (-4.0, -4.0), "C1": (4.0, -4.0), "C2": (4.0, 4.0), "C3": (-4.0, 4.0)}
    spots |= {"B0": (-80.0, 0.0), "B1": (-76.0, 0.0), "B2": (-80.0, 4.0)}
    ring = ["C", "C1", "C2", "C3", "C"]
    pairs = [*pairwise(ring), ("B0", "B1"), ("B0", "B2"), ("B1", "B2")]
    edges = {f"{a}>{b}": road(f"{a}>{b}", (spots[a], spots[b])) for a, b in pairs}
    far = {"N": "C3", "E": "C2", "S": "C1", "W": "C"}
    for name, edge in network.edges.items():
        ends = [
            far.get(other, "C") if k == "C" else k
            for k, other in (
                (edge.from_junction, edge.to_junction),
                (edge.to_junction, edge.from_junction),
            )
        ]
        edges[name] = replace(edge, from_junction=ends[0], to_junction=ends[1])
    junctions = {
        name: Junction(name, "priority", np.array([*at, 0.0]), np.zeros((0, 3)))
        for name, at in spots.items()
    }
    return replace(network, edges=edges, junctions={**network.junctions, **junctions})


def test_pieces_of_a_crossing_are_one_and_crumbs_are_none():
    found = busiest(movement_of(crossers()), with_crumbs(), span=(0.0, 40.0), length=10.0)
    assert np.abs(found.place[:2]).max() < 0.5 and found.junction.startswith("C")
    west = [trace(f"w{k}", (-78.0, 1.0), (9.0, 0.0), at=12.0 + 2.0 * k) for k in range(6)]
    found = busiest(movement_of(west), with_crumbs(), span=(0.0, 40.0), length=10.0)
    assert not found.junction, "traffic only passes, and three crumbs are no crossing"


def level_crossers():
    """Two roads that cross at the origin without a junction, and cars on both."""
    edges = {
        "W>E": road("W>E", ((-300, 0), (300, 0)), speed=30.0),
        "N>S": road("N>S", ((0, 300), (0, -300)), speed=30.0),
    }
    junctions = {
        name: Junction(name, "dead_end", np.array([*at, 0.0]), np.zeros((0, 3)))
        for name, at in {"W": (-300, 0), "E": (300, 0), "N": (0, 300), "S": (0, -300)}.items()
    }
    cars = [trace(f"e{k}", (0.0, -1.6), (9.0, 0.0), at=4.0 * k) for k in range(12)]
    return Network(edges, junctions, (), Location()), cars + crossers()


def test_no_camera_is_proposed_where_roads_cross_without_a_junction():
    network, cars = level_crossers()
    meetings = meetings_of(network)
    assert len(meetings) == 1 and np.hypot(*meetings[0, :2]) < 3.0
    movement = movement_of(cars)
    found = busiest(apart(movement, meetings), network, span=(0.0, 40.0), length=10.0)
    assert np.hypot(*found.place[:2]) > 60.0
    there = movement.during(found.start, found.end)
    scenario = scenario_of(cars, network)
    around = outdoors(scenario, found.place, there)
    scouted = Scouting(found, there, around, None, meetings=meetings)
    stands = [overview(scouted), corner(scouted)]
    poses = [ViewPoses(s.eye[None], s.aim[None], s.fov) for s in stands if s is not None]
    assert all(shows_none(pose, meetings).all() for pose in poses)
    assert riding_apart(cars, meetings) == []


# Eyes ---------------------------------------------------------------------------------------


def towards_centre(*eyes):
    eyes = np.array(eyes, dtype=float)
    return ViewPoses(eyes, np.zeros_like(eyes), 60.0)


def value(pose, around=None, *, sun=None):
    movement = movement_of(crossers()).during(10.0, 20.0)
    bare = Outdoors(build_lane_index(cross()), shapely.STRtree([]), np.zeros(0), np.zeros((0, 5)))
    return rated(pose, subjects_of(movement, CENTRE), around or bare, sun=sun)


def test_an_eye_that_sees_traffic_beats_one_that_looks_away():
    looks = towards_centre((30, -20, 10))
    away = ViewPoses(looks.eyes, np.array([[60.0, -40.0, 10.0]]), 60.0)
    assert value(looks)[0] > 1.0 and value(away)[0] == 0.0


@pytest.mark.parametrize(
    ("obstacle", "hidden"),
    [
        ("pole on the axis at 2 m", True),
        ("pole at 7 m", True),
        ("pole behind the eye", False),
        ("house between", True),
        ("flat house between", False),
    ],
)
def test_what_stands_before_the_lens_lowers_the_value(obstacle, hidden):
    pose = towards_centre((30, -30, 10))
    walls, tops, posts = [], [], []
    diagonal = np.array([1.0, -1.0]) / np.sqrt(2.0)
    for at in {"pole on the axis at 2 m": [40.4], "pole at 7 m": [35.4]}.get(obstacle, []):
        posts.append([*(at * diagonal), 0.5, 0.0, 12.0])
    if "behind" in obstacle:
        posts.append([*(50.0 * diagonal), 0.5, 0.0, 12.0])
    if "house" in obstacle:
        walls, tops = [shapely.box(10, -20, 20, -10)], [0.2 if "flat" in obstacle else 12.0]
    around = Outdoors(
        build_lane_index(cross()),
        shapely.STRtree(walls),
        np.array(tops, dtype=float),
        np.array(posts, dtype=float).reshape(-1, 5),
    )
    free, blocked = value(pose)[0], value(pose, around)[0]
    assert blocked < 0.9 * free if hidden else blocked == free
    if "axis" in obstacle:
        assert blocked == 0.0, "nothing stands within 3 m on the axis"


def test_the_sun_stands_behind_rather_than_before():
    sun = np.array([0.8, 0.0, 0.6])
    east, west = value(towards_centre((35, 0, 10), (-35, 0, 10)), sun=sun)
    assert east > west


@pytest.mark.parametrize("turn", range(0, 360, 30))
def test_a_corner_never_looks_against_the_sun(turn):
    low = np.radians(25.0)
    sun = np.array(
        [
            *(np.cos(low) * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])),
            np.sin(low),
        ]
    )
    stands = corner(scouting(scenario_of(crossers()), sun=sun))
    assert stands is not None
    ahead = (stands.aim - stands.eye)[:2]
    assert ahead @ sun[:2] <= 0.5 * np.hypot(*ahead) * np.hypot(*sun[:2]) + 1e-9


def test_a_corner_against_the_sun_is_none_rather_than_blind():
    """Houses leave room for an eye only where the sun is in front."""
    sun = np.array([0.9, 0.0, np.sqrt(1.0 - 0.81)])
    walls = [house("s", (-60, -60), (60, -9)), house("n", (-60, 9), (60, 60))]
    walls.append(house("e", (4, -60), (60, 60)))
    stands = corner(scouting(scenario_of(crossers(), polygons=tuple(walls)), sun=sun))
    if stands is not None:
        ahead = (stands.aim - stands.eye)[:2]
        assert ahead @ sun[:2] <= 0.5 * np.hypot(*ahead) * np.hypot(*sun[:2]) + 1e-9
    anywhere = corner(scouting(scenario_of(crossers(), polygons=tuple(walls))))
    assert anywhere is not None and (anywhere.aim - anywhere.eye)[0] > 0.0, "it looks to the east"


def test_vehicles_that_pass_right_before_an_eye_lower_its_value():
    movement = movement_of(crossers()).during(10.0, 20.0)
    low = ViewPoses(np.array([[20.0, -5.0, 1.7], [30.0, -20.0, 1.7]]), np.zeros((2, 3)), 65.0)
    near, far = unblocked(low, movement)
    assert far == 1.0 > near
    walkers = movement_of([trace("w", (19.0, -4.0), (0.3, 0.0), kind="person", type_="")])
    assert unblocked(low, walkers).tolist() == [1.0, 1.0], "people may be close"


def test_hills_hide():
    hill = {"h>i": road("h>i", ((15, -150), (15, 150)), height=9.0)}
    index = build_lane_index(replace(cross(), edges=cross().edges | hill))
    around = Outdoors(index, shapely.STRtree([]), np.zeros(0), np.zeros((0, 5)))
    assert around.clear(np.array([[40.0, 40.0, 5.0]]), np.zeros((1, 3)))[0] == 0.0
    assert around.clear(np.array([[-40.0, -40.0, 5.0]]), np.array([[0.0, 0.0, 1.0]]))[0] == 1.0


def test_no_corner_looks_at_a_crest_that_hides_the_place():
    """Nearly all drive in the east, and a ridge lies between them and the place."""

    def ridge(places):
        return 3.0 * np.exp(-(((places[:, 0] - 5.0) / 2.0) ** 2))

    busy = [trace(f"e{k}", (10.0 + 1.5 * k, -1.6), (1.0, 0.0), at=15.0) for k in range(8)]
    level = scouting(scenario_of([*busy, trace("w", (-20.0, -1.6), (2.0, 0.0), at=15.0)]))
    heights = np.zeros((len(level.around.index.points), 3))
    heights[0, 2] = 2.0  # somewhere else, but a network with hills
    index = replace(level.around.index, points=level.around.index.points + heights)
    stands = corner(replace(level, around=replace(level.around, index=index, land=ridge)))
    assert stands is not None
    way = np.array([0.0, 0.0, 1.0]) - stands.eye
    sight = stands.eye + np.linspace(0.0, 0.9, 40)[:, None] * way
    assert (sight[:, 2] > ridge(sight)).all(), "a crest hides the place"


# Cameras ------------------------------------------------------------------------------------


def house(name, low, high):
    ring = np.array(shapely.box(*low, *high).exterior.coords)[:-1]
    return Polygon(name, "building", ring, True, None, "f", {"height": "12"})


def test_a_house_or_a_tree_before_the_lens_moves_the_eye():
    first = overview(scouting(scenario_of(crossers())))
    between = 0.5 * first.eye[:2]
    polygon = house("h", between - 6.0, between + 6.0)
    moved = overview(scouting(scenario_of(crossers(), polygons=(polygon,))))
    assert np.hypot(*(moved.eye - first.eye)[:2]) > 5.0
    x, y = (first.eye[:2] * (1.0 - 8.0 / np.hypot(*first.eye[:2]))).tolist()
    tree = Poi("t", "tree", (x, y), None, None, "f")
    moved = overview(scouting(scenario_of(crossers(), pois=(tree,))))
    assert np.linalg.norm(moved.eye - first.eye) > 1.0


def test_eyes_stand_in_no_house_and_a_corner_on_no_carriageway():
    corners = [(x, y) for x in (-42.0, 10.0) for y in (-42.0, 10.0)]
    houses = tuple(house(f"{x}{y}", (x, y), (x + 32.0, y + 32.0)) for x, y in corners)
    scouted = scouting(scenario_of(crossers(), polygons=houses))
    stands = corner(scouted)
    assert stands is not None and not scouted.around.on_road(stands.eye[None], margin=0.5)[0]
    assert stands.eye[2] < 4.0
    flies = flight(scouted)
    eyes = [overview(scouted).eye, stands.eye, *(flies.eyes if flies else ())]
    for eye in eyes:
        assert all(
            eye[2] > 14.0 or not shapely.contains_xy(shapely.Polygon(h.shape), *eye[:2])
            for h in houses
        )


def test_eyes_stand_above_the_ground_of_the_place():
    network = cross(height=55.0)
    place = (0.0, 0.0, 55.0)
    scouted = scouting(scenario_of(crossers(55.0), network), place=place)
    assert overview(scouted).eye[2] > 60.0
    assert 56.0 < corner(scouted).eye[2] < 59.0
    flies = flight(scouted)
    assert flies.eyes[0, 2] > flies.eyes[-1, 2] > 60.0, "it descends"
    assert flies.times.tolist() == [10.0, 12.5, 15.0, 17.5, 20.0]


def test_nothing_is_found_where_everything_is_full():
    walls = (house("all", (-300, -300), (300, 300)),)
    scouted = scouting(scenario_of(crossers(), polygons=walls))
    assert corner(scouted) is None and flight(scouted) is None
    assert overview(scouted).eye[2] > 30.0


def test_a_network_near_a_place_keeps_edges_that_pass():
    passing = road("x>y", ((-5000, 40), (5000, 40)))
    far = road("u>v", ((-5000, 900), (5000, 900)))
    whole = replace(cross(), edges=cross().edges | {"x>y": passing, "u>v": far})
    assert set(near_network(whole, CENTRE, 100.0).edges) == set(cross().edges) | {"x>y"}


# Laws of every proposed camera -------------------------------------------------------------


def distance(post, stand):
    """How far an upright cylinder is from a camera's axis, as far as that is above heads [m]."""
    x, y, radius, bottom, top = post
    way = stand.eye + np.linspace(0.0, 1.0, 400)[:, None] * (stand.aim - stand.eye)
    way = way[way[:, 2] > stand.aim[2] + 3.0]
    level = np.maximum(np.maximum(bottom - way[:, 2], way[:, 2] - top), 0.0)
    return np.hypot(level, np.hypot(way[:, 0] - x, way[:, 1] - y) - radius).min()


def test_nothing_upright_stands_beside_the_axis_of_an_overview():
    free = scouting(scenario_of(crossers()))
    first = overview(free)
    # A pole 2 m beside the axis, half the way down.
    ahead = (first.aim - first.eye)[:2] / np.hypot(*(first.aim - first.eye)[:2])
    x, y = 0.6 * first.eye[:2] + 2.0 * np.array([-ahead[1], ahead[0]])
    posts = np.array([[x, y, 0.15, 0.0, 12.0]])
    beside = overview(replace(free, around=replace(free.around, posts=posts)))
    assert distance(posts[0], first) < 3.0 <= distance(posts[0], beside)


def test_the_room_beside_an_axis_is_measured_to_poles_and_houses():
    tree = shapely.STRtree([shapely.box(10.0, 4.0, 20.0, 9.0)])
    pole = np.array([[5.0, -2.0, 0.5, 0.0, 6.0]])
    around = Outdoors(build_lane_index(cross()), tree, np.array([12.0]), pole)
    eyes = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, 9.0], [0.0, 0.0, 40.0]])
    room = around.room(eyes, eyes + np.array([30.0, 0.0, 0.0]))
    assert room[:2] == pytest.approx([1.5, np.hypot(1.5, 3.0)], abs=0.05)
    assert room[2] > 20.0, "far above all of it"


def test_eyes_are_two_metres_above_roads_and_slopes():
    hill = {"h>i": road("h>i", ((-60, 12), (60, 12)), height=6.0)}
    network = replace(cross(reach=60.0), edges=cross(reach=60.0).edges | hill)
    scouted = scouting(scenario_of(crossers(), network))
    assert scouted.around.land is not None
    stands, flies = corner(scouted), flight(scouted)
    eyes = [overview(scouted).eye, *([stands.eye] if stands else [])]
    eyes = np.array([*eyes, *(flies.eyes if flies else ())])
    assert (eyes[:, 2] - scouted.around.ground(eyes) > 2.0 - 1e-6).all()
    assert (eyes[:, 2] - scouted.around.land(eyes[:, :2]) > 2.0 - 1e-6).all()


def test_eyes_keep_out_of_the_rows_of_houses_that_our_code_adds():
    walks = cross(lanes=2)
    edges = {
        name: replace(
            edge, lanes=(replace(edge.lanes[0], allowed=frozenset({"pedestrian"})), edge.lanes[1])
        )
        for name, edge in walks.edges.items()
    }
    scouted = scouting(scenario_of(crossers(), replace(walks, edges=edges)))
    assert len(scouted.around.walls.geometries) > 8
    stands = overview(scouted), corner(scouted)
    for stand in filter(None, stands):
        away = shapely.distance(scouted.around.walls.geometries, shapely.Point(stand.eye[:2]))
        assert away.min() >= (3.0 if stand is stands[0] else 1.2)
    plain = outdoors(scouted_scenario(edges), CENTRE, scouted.movement, textured=False)
    assert not len(plain.walls.geometries)


def scouted_scenario(edges):
    return scenario_of(crossers(), replace(cross(), edges=edges))


def test_somebody_is_in_view_for_most_of_the_time():
    # A crowd passes in the north for three seconds; in the south one car after the other.
    crowd = [trace(f"n{k}", (0.4 * k, 60.0), (0.0, 25.0), at=11.0) for k in range(20)]
    row = [trace(f"s{k}", (-30.0, -40.0), (8.0, 0.0), at=10.0 + 2.0 * k) for k in range(6)]
    movement = movement_of([*crowd, *row]).during(10.0, 20.0)
    bare = Outdoors(build_lane_index(cross()), shapely.STRtree([]), np.zeros(0), np.zeros((0, 5)))
    eyes = np.array([[0.0, 20.0, 9.0], [0.0, -80.0, 9.0]])
    aims = np.array([[0.0, 60.0, 1.0], [0.0, -40.0, 1.0]])
    subjects = subjects_of(movement, CENTRE)
    north, south = rated(ViewPoses(eyes, aims, 60.0), subjects, bare, sun=None)
    assert south > north


def test_a_moment_is_shortened_to_when_somebody_is_there():
    brief = trace("b", (0.0, 0.0), (13.0, 0.0), span=(23.0, 23.5), at=23.0)
    found = busiest(movement_of([brief]), cross(), span=(0.0, 40.0), length=10.0)
    assert found.start <= 23.0 < found.end <= found.start + 2.0


def test_a_lorry_that_the_lower_edge_cuts_lowers_the_value():
    lorry = VehicleType("lorry", "truck", 12.0, 2.5, 4.0)
    movement = movement_of([trace("l", (20.0, 0.0), (0.1, 0.0), type_="lorry")]).during(10.0, 20.0)
    eyes = np.array([[24.0, 0.0, 8.0], [60.0, 0.0, 8.0]])
    poses = ViewPoses(eyes, np.zeros((2, 3)), 60.0)
    near, far = not_looming(poses, movement, {"lorry": lorry})
    assert near < 0.2 and far == 1.0
    assert not_looming(poses, movement, {}).tolist() == [1.0, 1.0], "a car is low"


# Rides --------------------------------------------------------------------------------------


def rides(*traces):
    return choose_rides(traces, TYPES, found_at(), step=1.0)


def test_a_ride_lasts_moves_and_passes_the_place():
    passes = trace("passes", (0.0, 0.0), (9.0, 0.0), at=15.0)
    far = trace("far", (0.0, 900.0), (10.0, 0.0), at=15.0)
    brief = trace("brief", (0.0, 0.0), (14.0, 0.0), span=(12.0, 40.0), at=15.0)
    (ride,), notes = rides(passes, far, brief)
    assert (ride.camera, ride.vehicle, ride.view) == ("driver", "passes", "driver")
    assert (ride.start, ride.end) == (10.0, 20.0) and notes == []


def test_who_waits_most_of_the_time_is_no_ride():
    waits = trace("waits", (0.0, 0.0), (12.0, 0.0), at=15.0)
    places = waits.positions.copy()
    places[10:16] = places[10]
    found, _ = rides(replace(waits, positions=places, times=waits.times))
    assert not found or found[0].start > 10.0
    assert rides(trace("parked", (0.0, 0.0), (0.0, 0.0)))[0] == []
    assert "no camera `driver`" in rides(trace("parked", (0.0, 0.0), (0.0, 0.0)))[1][0]


def test_a_bus_has_a_camera_of_its_own_and_its_own_time_if_need_be():
    car = trace("car", (0.0, 0.0), (9.0, 0.0), at=15.0)
    later = trace("later", (0.0, 0.0), (8.0, 0.0), span=(22.0, 40.0), at=25.0, type_="bus")
    (driver, bus), _ = rides(car, later)
    assert driver.start == 10.0 and bus.camera == "bus" and bus.view == "chase"
    assert bus.start >= 22.0 and bus.end <= 40.0


def test_where_only_people_walk_one_of_them_is_gone_with():
    walks = replace(trace("w", (0.0, 0.0), (1.2, 0.0), at=15.0), kind="person")
    (ride,), notes = rides(walks)
    assert (ride.camera, ride.vehicle, ride.view) == ("walk", "w", "pedestrian") and notes == []
    stands = replace(trace("s", (0.0, 0.0), (0.0, 0.0)), kind="person")
    found, (note,) = rides(stands)
    assert found == [] and "no camera `walk`: none of 1 people walks" in note
    assert {ride.camera for ride in rides(walks, trace("c", (0.0, 0.0), (9.0, 0.0)))[0]} == {
        "driver"
    }


def test_eyes_stand_beside_footpaths_where_nothing_drives():
    net = cross()
    walked = frozenset({"pedestrian"})
    edges = {
        key: replace(edge, lanes=tuple(replace(k, allowed=walked) for k in edge.lanes))
        for key, edge in net.edges.items()
    }
    paths = Network(edges, net.junctions, (), net.location)
    log = TrafficLog((), (), 0.0, 40.0, 1.0)
    movement = movement_of([trace("p", (0.0, 0.0), (0.5, 0.0))]).during(10.0, 20.0)
    around = outdoors(Scenario(paths, log), CENTRE, movement, textured=False)
    assert around.off_road(np.array([[7.0, 8.0]]))[0] < 12.0
    assert corner(Scouting(found_at(), movement, around, None)) is not None


def test_a_gap_in_the_log_is_no_ride():
    whole = trace("gap", (0.0, 0.0), (9.0, 0.0), at=15.0)
    kept = np.r_[0:13, 16:30]
    arrays = ("times", "positions", "yaws", "speeds", "slopes", "lanes", "signals")
    torn = replace(whole, **{name: getattr(whole, name)[kept] for name in arrays})
    found, _ = rides(torn)
    assert not found or found[0].start != 10.0


def test_a_gap_of_coarse_rows_is_one_too():
    """Of rows every 7 s, a shot holds two or three, which tell nothing of the usual step."""
    whole = trace("gap", (0.0, 0.0), (9.0, 0.0), at=15.0)
    arrays = ("times", "positions", "yaws", "speeds", "slopes", "lanes", "signals")
    coarse = [k for k, t in enumerate(whole.times) if t % 7.0 == 3.0 and t != 17.0]
    torn = replace(whole, **{name: getattr(whole, name)[coarse] for name in arrays})
    found, _ = choose_rides([torn], TYPES, found_at(), step=7.0)
    assert not found or found[0].end <= 10.0 or found[0].start >= 24.0


# Whole examples -----------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "template", "cameras"),
    [
        ("crossing", "city_day", {"overview", "corner", "driver", "bus", "bicycle", "flight"}),
        ("ronda", "highway_day", {"overview", "driver", "flight"}),
    ],
)
def test_each_proposed_camera_of_an_example_can_be_built(example, template, cameras, tmp_path):
    text, notes = propose(EXAMPLES / example, output=tmp_path / "s.yaml")
    (tmp_path / "s.yaml").write_text(text, encoding="utf-8")
    job = load_job(tmp_path / "s.yaml")
    assert job.template == template and any(template in note for note in notes)
    assert {shot.camera for shot in job.shots} >= cameras
    report = check_scene(job, presets=["draft"])
    assert len(report["shots"]) == len(job.shots)
    for shot in report["shots"]:
        assert shot["triangles"]["road users"] > 0, "somebody is in the picture"


def test_a_template_that_was_asked_for_wins(tmp_path):
    write_scenario(tmp_path, vehicles=2, end=15.0)
    chosen, notes = propose(tmp_path, output=tmp_path / "s.yaml", template="overcast")
    assert "template: overcast" in chosen and any("overcast" in note for note in notes)
    again, _ = propose(tmp_path, output=tmp_path / "s.yaml")
    assert "template: overcast" not in again and "# Chosen because:" in again
    assert propose(tmp_path, output=tmp_path / "s.yaml")[0] == again, "the same each time"


@pytest.mark.parametrize(
    ("begin", "end"),
    [
        pytest.param(1e7, 1e7 + 15, id="late", marks=pytest.mark.slow),
        pytest.param(-12345.5, -12330.5, id="early", marks=pytest.mark.slow),
        pytest.param(5.0, 5.0, id="once"),
    ],
)
def test_times_of_any_log_are_written_to_the_millisecond(tmp_path, capsys, begin, end):
    """What is proposed can be read, and its shots lie where the log does."""
    scene = write_scenario(tmp_path, vehicles=2, begin=begin, end=end)
    text, notes = propose(tmp_path, output=scene)
    scene.write_text(text, encoding="utf-8")
    job = load_job(scene)
    assert bool(job.shots) == (end > begin)
    assert all(begin <= shot.start < shot.end <= end for shot in job.shots)
    flies = [camera for camera in job.cameras.values() if isinstance(camera, CinematicCamera)]
    assert bool(flies) == (end > begin) or any("`flight`" in note for note in notes)
    for camera in flies:
        assert [key.time for key in camera.keyframes] == sorted({k.time for k in camera.keyframes})
    assert check_scene(job, presets=["draft"])["log"]["begin"] == begin
    if job.shots:
        film = ["-o", str(tmp_path / "{shot}.mp4")]
        assert main(["render", str(scene), "--dry-run", *film]) == 0
        said = capsys.readouterr().out
        assert f"{job.shots[0].start:.1f}".removesuffix(".0") in said and "e+0" not in said


@pytest.mark.parametrize(("ahead", "good"), [(3.0, False), (13.0, True)])
def test_no_eye_looks_at_the_back_of_a_signal_from_near_by(ahead, good):
    """At the border of the picture, where no line of sight to the traffic passes."""
    poses = ViewPoses(np.array([[0.0, 0.0, 2.2]]), np.array([[30.0, 0.0, 1.0]]), 65.0)
    head = np.array([[ahead, -0.5 * ahead, 0.35, 2.4, 3.5]])
    nobody = Subjects(np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
    index = build_lane_index(Network({}, {}, (), Location(), False))
    values = [
        rated(poses, nobody, Outdoors(index, shapely.STRtree([]), np.zeros(0), posts), sun=None)[0]
        for posts in (np.zeros((0, 5)), head)
    ]
    assert (values[1] > 0.3 * values[0]) == good
