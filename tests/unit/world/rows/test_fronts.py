"""Rows of houses along city streets: where they stand, and what they are made of."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from any_network.paving import (
    faces_up,
    ground_over_paving,
    highest,
    paved_beside,
    paved_twice,
    plan_of,
    points_on,
)
from coincident import shared_area

from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.job.settings import Job, RoadSettings
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Bay, ParkingArea, Poi, Polygon, Scenario, Stop, TrafficLog
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.build import World, build_place
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.roads.roads import build_roads
from sumo3dviz_pt.world.rows.courts import court_meshes
from sumo3dviz_pt.world.rows.fronts import REACH, SOURCE, Given, grow_rows, in_view, why_none
from sumo3dviz_pt.world.rows.houses import BUDGET, build_fronts

EYES = np.array([[0.0, 0.0, 1.5]])
CARS = frozenset({"passenger", "bus", "bicycle", "truck", "delivery"})


def street(name, ends, *, speed=13.9, walk=2.5, lanes=1, rise=0.0, bend=0.0):
    """Both directions of a straight or bent street through points, with footways."""
    (x0, y0), (x1, y1) = ends
    at = np.linspace(0.0, 1.0, 15)
    way = np.array([x1 - x0, y1 - y0])
    side = np.array([-way[1], way[0]]) / np.hypot(*way)
    middle = np.array([x0, y0]) + at[:, None] * way + bend * (4 * at * (1 - at))[:, None] * side
    heights = rise * middle[:, :1]
    found = {}
    for sign, key in ((1, name), (-1, f"-{name}")):
        line = (middle if sign > 0 else middle[::-1]).copy()
        row = []
        widths = ([walk] if walk else []) + [3.2] * lanes
        offset = sum(widths)
        for index, width in enumerate(widths):
            offset -= width
            shape = line - sign * side * (offset + width / 2)
            level = heights if sign > 0 else heights[::-1]
            own = frozenset({"pedestrian"}) if walk and index == 0 else CARS
            points = np.column_stack([shape, level])
            row.append(Lane(f"{key}_{index}", key, index, points, width, speed, 100.0, own))
        found[key] = Edge(key, "normal", "A", "B", tuple(row))
    return found


def network(*streets):
    ends = {n: Junction(n, "dead_end", np.zeros(3), np.zeros((0, 3))) for n in ("A", "B")}
    edges = {key: edge for some in streets for key, edge in some.items()}
    return Network(edges, ends, (), Location(boundary=(-200, -200, 200, 200)))


def grown(net, *, pois=(), polygons=(), eyes=EYES, seed=3, clearance=None):
    layout = layout_roads(net, RoadSettings())
    around = surroundings(net, seed=seed, viewpoints=eyes, clearance=clearance)
    rows = grow_rows(net, list(layout.outline), Given(pois, polygons), around=around)
    return rows, layout, around


def plans_of(rows):
    return [shapely.Polygon(house.plan) for house in rows.houses]


TOWN = network(street("e", ((-200, 0), (200, 0))))


@pytest.mark.parametrize("bend", [0.0, 40.0])
def test_houses_stand_side_by_side_behind_the_pavements_of_a_town(bend):
    net = network(street("e", ((-200, 0), (200, 0)), bend=bend))
    rows, layout, _ = grown(net)
    paved = shapely.union_all(list(layout.outline))
    plans = plans_of(rows)
    assert len(plans) > 30
    assert all(1.2 < plan.distance(paved) < 6.0 for plan in plans)
    assert shapely.union_all(plans).area > 0.995 * sum(plan.area for plan in plans)
    # Where two tiles meet, neighbours' walls touch, too, but have windows that nobody sees.
    tree = shapely.STRtree(plans)
    shared = [
        sum(
            len(tree.query(shapely.Point(wall), predicate="dwithin", distance=1.5)) > 1
            for wall in 0.5 * (house.plan + np.roll(house.plan, -1, axis=0))[house.fronts :]
        )
        for house in rows.houses
    ]
    assert np.mean(shared) > 1.6


def test_fronts_look_at_the_street_and_blind_walls_at_neighbours():
    rows, _, around = grown(TOWN)
    plans = plans_of(rows)
    for house, plan in zip(rows.houses, plans, strict=True):
        assert plan.exterior.is_ccw
        after = np.roll(house.plan, -1, axis=0)
        for wall in range(house.fronts):
            middle = 0.5 * (house.plan[wall] + after[wall])
            assert abs(middle[1]) < abs(house.plan[:, 1]).min() + 1.0
        for wall in house.blind:
            middle = shapely.Point(0.5 * (house.plan[wall] + after[wall]))
            assert sum(other.distance(middle) < 1.6 for other in plans) >= 2
    shown = in_view(rows, around).houses
    assert around.distances(np.array([h.plan.mean(axis=0) for h in shown])).max() < REACH


@pytest.mark.parametrize(
    "net",
    [
        pytest.param(network(street("m", ((-200, 0), (200, 0)), speed=27.8)), id="motorway"),
        pytest.param(network(street("c", ((-200, 0), (200, 0)), walk=0.0)), id="country road"),
        pytest.param(network(), id="no roads"),
    ],
)
def test_no_houses_close_in_where_nobody_would_live_at_the_kerb(net):
    layout = layout_roads(net, RoadSettings())
    around = surroundings(net, seed=1, viewpoints=EYES)
    rows = grow_rows(net, list(layout.outline), Given(), around=around)
    assert not rows.houses and not rows.forecourts
    fronts = build_fronts(rows, layout, around=around, near=(0.0, 0.0))
    assert not fronts.static and not fronts.lamps
    assert [item.what for item in fronts.left_out] == ["street_fronts"]


def test_a_dense_net_is_a_town_without_footways_too():
    every = (-3, -2, -1, 0, 1, 2, 3)
    streets = [street(f"e{k}", ((-300, 80 * k), (300, 80 * k)), walk=0.0) for k in every]
    streets += [street(f"n{k}", ((80 * k, -300), (80 * k, 300)), walk=0.0) for k in every]
    assert len(grown(network(*streets))[0].houses) > 40


def test_what_the_scenario_brings_keeps_its_place():
    home = Poi("h", "home", (50.0, 20.0), None, None, "x.add.xml")
    pond = Polygon(
        "p", "water", np.array([(-60, 5), (-20, 5), (-20, 40), (-60, 40)]), True, None, ""
    )
    land = Polygon(
        "l",
        "landuse.residential",
        np.array([(-300, -300), (300, -300), (300, 300)]),
        True,
        None,
        "",
    )
    rows, _, _ = grown(TOWN, pois=(home,), polygons=(pond, land))
    plans = plans_of(rows)
    assert len(plans) > 20
    assert min(plan.distance(shapely.Point(home.position)) for plan in plans) > 9.0
    assert all(not plan.intersects(shapely.Polygon(pond.shape)) for plan in plans)


def test_houses_stand_behind_a_row_of_street_trees():
    places = [(x, s * 10.5) for x in range(-190, 191, 12) for s in (1, -1)]
    trees = [Poi(f"t{k}", "tree", place, None, None, "") for k, place in enumerate(places)]
    bare, _, _ = grown(TOWN)
    rows, _, _ = grown(TOWN, pois=trees)
    nearest = [
        np.median([np.abs(house.plan[:, 1]).min() for house in some.houses])
        for some in (bare, rows)
    ]
    assert nearest[0] < 8.5 and nearest[1] > 12.5
    assert len(rows.houses) > 30


def test_no_house_stands_in_a_camera_or_before_what_it_looks_at():
    eyes = np.array([[0.0, 14.0, 6.0]])
    rows, _, _ = grown(TOWN, eyes=eyes)
    assert min(plan.distance(shapely.Point(eyes[0, :2])) for plan in plans_of(rows)) > 2.9


def test_building_polygons_of_the_scenario_stand_alone():
    shape = np.array([(30.0, 12.0), (44.0, 12.0), (44.0, 24.0)])
    assert why_none([Polygon("b", "building", shape, True, None, "")])
    assert why_none([Polygon("b", "water", shape, True, None, "")]) is None


def test_the_same_town_is_built_again_and_another_seed_builds_another():
    one, again, other = (grown(TOWN, seed=seed)[0] for seed in (3, 3, 4))
    assert [h.id for h in one.houses] == [h.id for h in again.houses]
    assert all(
        np.array_equal(a.plan, b.plan) for a, b in zip(one.houses, again.houses, strict=True)
    )
    assert {h.plan.tobytes() for h in one.houses} != {h.plan.tobytes() for h in other.houses}


def test_areas_tell_others_where_not_to_stand():
    rows, _, _ = grown(TOWN)
    areas = rows.polygons()
    assert {item.source for item in areas} == {SOURCE}
    assert {item.type for item in areas} == {"building", "forecourt"}
    assert len(areas) == len(rows.houses) + len(rows.forecourts)


def test_forecourts_fill_what_is_left_between_pavements_and_houses():
    rows, layout, _ = grown(TOWN)
    paved = shapely.union_all(list(layout.outline))
    courts = shapely.union_all(rows.forecourts)
    assert courts.intersection(paved.buffer(-0.2)).area < 0.01
    for house in rows.houses:
        front = shapely.LineString(house.plan[: house.fronts + 1])
        gap = front.buffer(-1.5, single_sided=True).difference(paved)
        assert courts.intersection(gap).area > 0.97 * gap.area


@pytest.mark.parametrize("rise", [0.0, 0.06])
def test_parts_keep_the_budget_and_stand_on_the_ground(rise):
    net = network(street("e", ((-200, 0), (200, 0)), rise=rise))
    rows, layout, around = grown(net)
    fronts = build_fronts(rows, layout, around=around, near=(0.0, 0.0))
    assert sum(len(item.part.mesh.faces) for item in fronts.static) < 1.25 * BUDGET
    assert {item.part.material for item in fronts.static} <= set(fronts.materials)
    assert not fronts.lamps
    for item in fronts.static:
        if "court" in item.id:
            x, _, z = item.part.mesh.vertices.T
            assert (np.abs(z - rise * x) < 1.0).all()


@pytest.mark.slow
def test_no_court_lies_in_one_plane_with_what_it_covers():
    """Architecture, law 10: which of two surfaces a ray meets must not hang on anything else.

    Courts cover the rim of pavements, where small stones lie a little above the paving.
    """
    net = read_network(data_root("examples") / "crossing" / "crossing.net.xml.gz")
    rows, layout, _ = grown(net, eyes=np.array([[268.0, 290.0, 1.3]]))
    courts = enumerate(court_meshes(rows.forecourts, layout, (0.0, 0.0)))
    roads = build_roads(net, RoadSettings(), textured=True, focus=(255.0, 280.0, 280.0, 300.0))
    static = {item.id: item.part.mesh for item in roads.static}
    covered = {name: static[name] for name in ("road/setts/kerb_stone", "road/stones/kerb_stone")}
    shared = shared_area(covered | {f"court/{n}": mesh for n, mesh in courts})
    assert not {pair: area for pair, area in shared.items() if covered.keys() & set(pair)}


def test_at_night_windows_and_shops_shine():
    rows, layout, around = grown(TOWN)
    dark = replace(around, dark=True)
    fronts = build_fronts(rows, layout, around=dark, near=(0.0, 0.0))
    names = [lamp.id for lamp in fronts.lamps]
    assert names and len(set(names)) == len(names)
    assert all(name.startswith("street_fronts_") for name in names)


EYE = np.array([[-14.0, 16.0, 3.0]])
"""Behind the pavement, where a house would stand."""


def test_a_house_that_any_camera_stands_in_is_missing_for_all_of_them():
    stands = Clearance((CameraPath.all_round(EYE), CameraPath.all_round(EYES)))
    seen = {}
    for name, eyes in (("in", EYE), ("street", EYES), ("both", np.concatenate([EYE, EYES]))):
        rows, _, _ = grown(TOWN, eyes=eyes, clearance=stands)
        seen[name] = {house.id: house.plan.tobytes() for house in rows.houses}
    assert seen["in"] == seen["street"] == seen["both"]
    whole = {house.id: shapely.Polygon(house.plan) for house in grown(TOWN)[0].houses}
    gone = [plan for name, plan in whole.items() if name not in seen["street"]]
    assert 0 < len(gone) < 7
    yards = [shapely.Polygon(yard.plan) for yard in rows.yards]
    assert all(any(yard.intersects(plan) for yard in yards) for plan in gone)
    assert not any(yard.buffer(-0.5).intersects(plan) for yard in yards for plan in plans_of(rows))
    assert any(plan.covers(shapely.Point(EYE[0, :2])) for plan in gone)


def test_no_house_stands_in_the_way_of_a_flight_that_another_camera_does_not_see():
    flight = np.column_stack([np.linspace(-120.0, 120.0, 40), np.full(40, 16.0), np.full(40, 3.0)])
    rows, _, _ = grown(TOWN, clearance=Clearance((CameraPath.all_round(flight),)))
    way = shapely.LineString(flight[:, :2])
    assert min(plan.distance(way) for plan in plans_of(rows)) > 2.9
    sides = [plan.centroid.y for plan in plans_of(rows) if abs(plan.centroid.x) < 100.0]
    assert max(sides) < 0.0 and len(sides) > 5  # the other side of the street is whole


def test_no_house_hides_what_a_camera_looks_at_though_another_one_films():
    ahead = CameraPath(
        np.array([[-20.0, 30.0, 3.0]]), np.array([[0.0, -1.0, 0.0]]), np.array([0.5])
    )
    behind = CameraPath(ahead.positions, -ahead.forwards, ahead.half_angles)
    row = [shapely.LineString([(-20.0, 24.0), (-20.0, 5.0)])]
    for outlook, hidden in ((ahead, False), (behind, True)):
        rows, _, _ = grown(TOWN, clearance=Clearance((outlook,)))
        assert bool(shapely.intersects(plans_of(rows), row).any()) == hidden


EVERY = (-480, -240, 0, 240, 480)
QUARTER = network(
    *(street(f"e{y}", ((-600, y), (600, y + 40))) for y in EVERY),
    *(street(f"n{x}", ((x, -600), (x + 30, 600))) for x in EVERY if x != 240),
)
"""Blocks of 220 m and, where a street is missing, of 460 m; no street runs along a tile."""


@pytest.mark.slow
def test_two_cameras_far_apart_see_the_same_houses_and_none_overlaps():
    nothing = Clearance()
    west, _, _ = grown(QUARTER, eyes=np.array([[-300.0, 0.0, 1.5]]), clearance=nothing)
    east, _, _ = grown(QUARTER, eyes=np.array([[300.0, 0.0, 1.5]]), clearance=nothing)
    there = {house.id: house.name for house in east.houses}
    shared = [house for house in west.houses if house.id in there]
    assert len(shared) > 150
    assert all(house.name == there[house.id] for house in shared)
    # Whatever stands between both cameras is in the worlds of both.
    between = {h.id for h in west.houses if np.abs(h.plan.mean(axis=0)).max() < 280.0}
    assert len(between) > 60 and between <= set(there)
    plans = plans_of(west)
    assert sum(p.area for p in plans) - shapely.union_all(plans).area < 1.0


def test_mitred_corners_leave_no_paved_place_to_houses():
    from sumo3dviz_pt.world.rows.fronts import _kept_free

    # A junction of a generated network, at which a corner was cut off.
    outline = (
        *((171.7, 215.8), (155, 218.8), (155, 225.1), (172.8, 222), (173.4, 225.1)),
        *((155, 228.3), (155, 234.6), (174.5, 231.2), (182.5, 234.1), (169.8, 257), (176.9, 257)),
        *((188, 237.1), (189.6, 240.7), (180.6, 257), (187.6, 257), (196.2, 241.7)),
        *((197.7, 241.6), (205, 253), (205, 207), (162.5, 207), (172, 214.6)),
    )
    paved = shapely.Polygon(outline)
    free = _kept_free(paved, 2.2)
    assert shapely.difference(paved.buffer(1.8), free).area < 1e-6


BAYS = tuple(Bay((-70.0 + 6.0 * k, -8.2), 0.0, 6.0, 2.4) for k in range(8))
"""Behind the pavement of a street, where forecourts lie."""


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(0.0, id="flat", marks=pytest.mark.slow),
        pytest.param(0.31, id="steep"),
    ],
)
def shops(request):
    """A place with two streets, one as steep as a stair and one less so, with bays and a yard."""
    rise = request.param
    ends = [((-110, y), (110, y)) for y in (0, 45)]
    net = network(street("e", ends[0], rise=rise), street("f", ends[1], rise=0.65 * rise))
    # Two parking areas want the same bays.
    parking = (ParkingArea("p", "e_1", BAYS, 8), ParkingArea("q", "e_1", BAYS[4:], 4))
    stops = (Stop("c", "-f_1", 60.0, 90.0, "container"),)
    given = Scenario(net, TrafficLog((), (), 0.0, 0.0, 0.0), stops=stops, parking=parking)
    bare = {"lamps": "none", "signs": "none", "furniture": "none"}
    job = Job.model_validate(
        {
            "scenario": {"network": "n"},
            "ground": {"horizon": "flat"},
            "street": bare,
            "lights": "off",
        }
    )
    return build_place(World.of(given, job), CameraPath.all_round(EYES)).static


@pytest.mark.slow
def test_the_ground_and_its_grass_never_lie_above_what_is_paved(shops):
    assert set(paved_beside(shops)) == {"forecourts", "slabs"}
    assert not list(ground_over_paving(shops, step=0.45))


def roads_of(static):
    """Carriageways and footways."""
    return [part for part in static if part.id in ("road/asphalt", "road/paving")]


@pytest.mark.slow
def test_forecourts_follow_the_footways_that_they_join(shops):
    tops = faces_up(paved_beside(shops)["forecourts"])
    places = points_on(tops, 0.11)
    gap = highest(tops, places) - highest(faces_up(roads_of(shops)), places)
    gap = gap[np.isfinite(gap)]
    assert len(gap) > 100 and gap.min() > -0.02 and gap.max() < 0.03


@pytest.mark.slow
def test_two_things_never_pave_one_place(shops):
    paved, roads = paved_beside(shops), plan_of(roads_of(shops))
    assert not list(paved_twice(shops))
    assert plan_of(paved["slabs"]).intersection(roads).area < 0.01
    # Forecourts cover the stones at the back of pavements and nothing more.
    assert plan_of(paved["forecourts"]).intersection(roads.buffer(-0.25)).area < 0.01
    beside = {part.id: part.part.mesh for parts in paved.values() for part in parts}
    meshes = beside | {part.id: part.part.mesh for part in roads_of(shops)}
    assert not {pair for pair in shared_area(meshes) if beside.keys() & set(pair)}


def test_forecourts_go_over_from_one_street_to_another_at_corners():
    ends = ((-110.0, 0.0), (110.0, 0.0)), ((0.0, -110.0), (0.0, 110.0))
    net = network(*(street(name, way, rise=0.31) for name, way in zip("en", ends, strict=True)))
    rows, layout, _ = grown(net)
    meshes = court_meshes(rows.forecourts, layout, (0.0, 0.0))
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1)
    steep = np.hypot(across[:, 0], across[:, 1]) > 1.5 * np.abs(across[:, 2])
    assert area.sum() > 1000.0
    assert area[steep].sum() < 10.0, f"{area[steep].sum():.1f} m2"
