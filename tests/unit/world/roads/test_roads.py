"""Roads of small networks made by hand and of the bundled examples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import EdgeStyle, GroundSettings, RoadSettings
from sumo3dviz_pt.library.materials import colour_of, metres_per_tile, planar_uvs, surface_material
from sumo3dviz_pt.library.mesh.shading import smooth_normals
from sumo3dviz_pt.library.street.road_styles import STYLES
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.land.ground import build_ground
from sumo3dviz_pt.world.land.terrain import terrain
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.rails.tracks import GAUGE
from sumo3dviz_pt.world.roads.cells import overlaps
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.roads.markings.markings import road_paint
from sumo3dviz_pt.world.roads.markings.symbols import SETBACK, zebra_paint
from sumo3dviz_pt.world.roads.mesh import SIDEWALK_HEIGHT
from sumo3dviz_pt.world.roads.roads import RoadParts, build_roads

EXAMPLES = Path(__file__).resolve().parents[4] / "examples"
EUROPEAN = STYLES["european"]
CARS = frozenset({"passenger", "bus", "truck", "bicycle"})
PLAIN = RoadSettings()
WALK = frozenset({"pedestrian"})


def lane(edge: str, index: int, points, *, width=3.2, allowed=CARS, speed=13.9) -> Lane:
    shape = np.array([[*p, 0.0][:3] if len(p) == 2 else p for p in points], dtype=float)
    return Lane(f"{edge}_{index}", edge, index, shape, width, speed, 100.0, allowed)


def edge(key: str, ends: tuple[str, str], *lanes: Lane, function="normal") -> Edge:
    return Edge(key, function, *ends, tuple(lanes))


def junction(key: str, at, outline=(), kind="priority", incoming=()) -> Junction:
    points = np.array([[*p, 0.0] for p in outline], dtype=float).reshape(-1, 3)
    return Junction(key, kind, np.array([*at, 0.0]), points, tuple(incoming))


def network(edges, junctions=(), connections=(), **extra) -> Network:
    location = Location(boundary=(0.0, -20.0, 120.0, 20.0))
    return Network(
        {e.id: e for e in edges},
        {j.id: j for j in junctions},
        tuple(connections),
        location,
        **extra,
    )


def two_way(*, left_hand=False, speed=13.9, lanes=1) -> Network:
    """A straight road of 100 m with `lanes` lanes and a footway on each side."""
    side = -1.0 if left_hand else 1.0
    edges = []
    for key, ends, way in (("ab", ("a", "b"), 1.0), ("ba", ("b", "a"), -1.0)):

        def row(index, away, w=1.0, *, way=way, key=key, **kind):
            points = [(0.0, -side * way * away), (100.0, -side * way * away)]
            return lane(key, index, points[:: int(way)], **kind)

        outer = lanes * 3.2
        footway = row(0, outer + 1.0, width=2.0, allowed=WALK)
        driven = [row(1 + k, outer - 1.6 - 3.2 * k, speed=speed) for k in range(lanes)]
        edges.append(edge(key, ends, footway, *driven))
    return network(edges, [junction("a", (0, 0)), junction("b", (100, 0))], left_hand=left_hand)


@cache
def example(name: str) -> Network:
    return read_network(EXAMPLES / name / f"{name}.net.xml.gz")


@cache
def built(name: str) -> RoadParts:
    return build_roads(example(name), RoadSettings(), textured=True)


def paint_of(net: Network, settings: RoadSettings = PLAIN):
    return road_paint(net, settings, layout_roads(net, settings), region=None)


def part(parts, name: str):
    return next(p.part.mesh for p in parts.static if p.id == name)


def area_of(mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def lane_points(net: Network) -> np.ndarray:
    """Points on the middle and near both borders of all lanes, 1 m apart."""
    found = []
    for one in net.lanes.values():
        if net.edges[one.edge_id].function not in {"normal", "internal"}:
            continue
        line = shapely.LineString(one.shape[:, :2])
        for side in (-0.45, 0.0, 0.45):
            moved = line.offset_curve(side * one.width) if side else line
            at = np.arange(0.5, moved.length - 0.5, 1.0)
            found.append(shapely.get_coordinates(shapely.line_interpolate_point(moved, at)))
    return np.concatenate(found)


@pytest.mark.parametrize("name", [pytest.param("ronda", marks=pytest.mark.slow), "crossing"])
def test_surface_has_neither_overlaps_nor_gaps(name):
    net = example(name)
    cells = built(name).layout.cells
    assert len(overlaps(cells, above=1e-4).winners) == 0
    whole = shapely.union_all(cells.polygons, grid_size=1e-6).area
    assert shapely.area(cells.polygons).sum() == pytest.approx(whole, rel=1e-5)
    spots = shapely.points(lane_points(net))
    tree = shapely.STRtree(cells.polygons)
    hit = np.zeros(len(spots), dtype=bool)
    hit[tree.query(spots, predicate="dwithin", distance=0.002)[0]] = True
    assert (~hit).mean() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ronda", "crossing"])
def test_triangles_cover_the_layout_exactly(name):
    roads = built(name)
    level = [p.part.mesh for p in roads.static if p.id.startswith("road/") and p.id.count("/") == 1]
    total = sum(area_of(mesh) for mesh in level)
    assert total == pytest.approx(shapely.area(roads.layout.cells.polygons).sum(), rel=1e-4)
    assert {p.part.material for p in roads.static} == set(roads.materials)
    assert {p.family for p in roads.static} == {"roads", "markings"}


def test_every_horizontal_face_looks_up():
    roads = built("crossing")
    for one in roads.static:
        if one.id.startswith(("road/faces", "road/verge")):
            continue
        a, b, c = (one.part.mesh.vertices[one.part.mesh.faces[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a)[:, 2] >= 0).all()


@pytest.mark.parametrize("left_hand", [False, True])
def test_lanes_keep_their_widths_and_footways_are_raised(left_hand):
    roads = build_roads(two_way(left_hand=left_hand, lanes=2), RoadSettings(), textured=True)
    road = part(roads, "road/asphalt")
    assert area_of(road) == pytest.approx(100 * 4 * 3.2, rel=1e-4)
    assert np.ptp(road.vertices[:, 1]) == pytest.approx(12.8, abs=0.01)
    assert part(roads, "road/paving").vertices[:, 2] == pytest.approx(SIDEWALK_HEIGHT)
    footways = area_of(part(roads, "road/paving")) + area_of(part(roads, "road/kerb"))
    assert footways == pytest.approx(2 * 100 * 2.0, rel=1e-4)


def test_walkers_climb_the_kerb_smoothly():
    height = build_roads(two_way(), RoadSettings(), textured=True).surface_height_at
    across = np.column_stack([np.full(60, 50.0), np.linspace(0.0, 4.2, 60)])
    heights = height(across)
    assert heights[0] == 0.0
    assert heights[-1] == pytest.approx(SIDEWALK_HEIGHT)
    assert (np.diff(heights) >= 0).all() and np.diff(heights).max() < 0.05
    assert height(np.zeros((0, 2))).shape == (0,)


def test_opposite_directions_share_one_centre_line():
    narrow = [p for p in paint_of(two_way()) if len(p.quads)]
    middle = [p for p in narrow if np.abs(p.quads[..., 1]).max() < 0.1]
    assert len(middle) == 1
    # Single lanes: a dashed line, so its quads are many and 3 m long.
    assert len(middle[0].quads) > 10
    wide = [q for p in paint_of(two_way(lanes=2)) for q in p.quads if np.abs(q[:, 1]).max() < 0.4]
    assert len(wide) == 2 and np.ptp(wide[0][:, 0]) == pytest.approx(100.0)


def test_american_centre_lines_are_yellow_and_quiet_streets_bare():
    american = paint_of(two_way(), RoadSettings(marking_style="american"))
    assert {p.material for p in american if len(p.quads)} >= {"line_yellow"}
    assert sum(len(p.quads) for p in paint_of(two_way(speed=8.0))) == 0
    bare = RoadSettings(markings=False)
    assert sum(len(p.quads) for p in paint_of(example("crossing"), bare)) == 0
    assert sum(len(p.quads) for p in paint_of(two_way(lanes=2), bare)) == 0


def test_motorway_dashes_are_long_and_edge_lines_solid():
    lanes = [lane("m", k, [(0, 3.2 * k), (200, 3.2 * k)], speed=33.0) for k in range(2)]
    quads = np.concatenate([p.quads for p in paint_of(network([edge("m", ("a", "b"), *lanes)]))])
    lengths = np.sort(np.ptp(quads[..., 0], axis=1))
    assert lengths[-2:] == pytest.approx([200, 200])
    assert lengths[0] == pytest.approx(6.0, abs=1e-6) or lengths[0] < 6.0
    assert np.ptp(quads[..., 1], axis=1) == pytest.approx(0.15)


def test_stop_lines_lie_before_signalled_lane_ends():
    base = two_way()
    signal = Connection("ab_1", "ba_1", "", "tl", 0, "t", "O")
    net = replace_connections(base, [signal])
    stop = paint_of(net)[0]
    assert stop.owner == "ab"
    assert stop.quads[..., 0].max() == pytest.approx(100.0 - SETBACK)
    assert np.ptp(stop.quads[..., 0]) == pytest.approx(EUROPEAN.stop_line)
    assert np.ptp(stop.quads[..., 1]) == pytest.approx(3.2)


def replace_connections(net: Network, connections) -> Network:
    return Network(net.edges, net.junctions, tuple(connections), net.location, net.left_hand)


def test_minor_roads_end_in_a_give_way_line():
    side = edge("side", ("s", "b"), lane("side", 0, [(50, -60), (50, -4)]))
    main = edge("main", ("b", "e"), lane("main", 0, [(54, 0), (120, 0)]))
    ways = [Connection("side_0", "main_0", "", "", -1, "r", "m")]
    net = network([side, main], [junction("b", (50, 0))], ways)
    give_way = next(p for p in paint_of(net) if p.owner == "side")
    assert len(give_way.quads) == 3
    straight = [Connection("side_0", "main_0", "", "", -1, "s", "m")]
    merging = network([side, main], [junction("b", (50, 0))], straight)
    first = next(p for p in paint_of(merging) if p.owner == "side")
    assert np.ptp(first.quads[0, :, 1]) > 10.0  # an edge line


def test_zebra_bars_lie_along_the_traffic():
    zebra = edge(
        ":b_c0",
        ("", ""),
        lane(":b_c0", 0, [(0, 0), (0, 8)], width=4.0, allowed=WALK),
        function="crossing",
    )
    way = Connection(":b_w0_0", ":b_c0_0", "", "", -1, "s", "M")
    paint = zebra_paint(network([zebra], [], [way]), EUROPEAN.crossing, region=None)
    assert len(paint[0].quads) == 7
    assert np.ptp(paint[0].quads[..., 0], axis=1) == pytest.approx(4.0)
    assert np.ptp(paint[0].quads[..., 1], axis=1) == pytest.approx(0.5)
    minor = network([zebra], [], [replace(way, state="m")])
    assert zebra_paint(minor, EUROPEAN.crossing, region=None) == []


def test_paint_lies_five_millimetres_up_and_never_on_footways():
    roads = built("crossing")
    paint = part(roads, "markings/asphalt")
    assert paint.vertices[:, 2] == pytest.approx(0.005)
    middles = paint.vertices[paint.faces].mean(axis=1)
    inside = shapely.STRtree(shapely.buffer(roads.layout.raised, -0.02)).query(
        shapely.points(middles[:, :2]), predicate="within"
    )
    assert inside.shape[1] == 0


def test_rails_have_standard_gauge_and_trains_run_on_ballast():
    tram = edge("t", ("a", "b"), lane("t", 0, [(0, 0), (50, 0)], allowed=frozenset({"tram"})))
    rail = edge("r", ("a", "b"), lane("r", 0, [(0, 9), (50, 9)], allowed=frozenset({"rail"})))
    ship = edge("s", ("a", "b"), lane("s", 0, [(0, 30), (50, 30)], allowed=frozenset({"ship"})))
    roads = build_roads(network([tram, rail, ship]), RoadSettings(), textured=True)
    ids = {p.id for p in roads.static}
    wanted = {"rails/rail_head", "rails/sleeper", "road/ground_stone", "road/ground_grass"}
    assert wanted <= ids
    y = np.unique(part(roads, "rails/rail_head").vertices[:, 1].round(4))
    tram_heads = y[y < 4.0]
    assert tram_heads[2] - tram_heads[1] == pytest.approx(GAUGE, abs=0.03)
    assert max(p.part.mesh.vertices[:, 1].max() for p in roads.static) < 20


def test_bicycle_lanes_and_paths_differ():
    bike = lane("e", 0, [(0, 0), (50, 0)], width=1.5, allowed=frozenset({"bicycle"}))
    car = lane("e", 1, [(0, 2.35), (50, 2.35)])
    path = edge("p", ("a", "b"), lane("p", 0, [(0, 30), (50, 30)], allowed=WALK | {"bicycle"}))
    net = network([edge("e", ("a", "b"), bike, car), path])
    ids = {p.id for p in build_roads(net, RoadSettings(), textured=True).static}
    assert {"road/bicycle", "road/asphalt", "road/paving"} <= ids


def test_overrides_by_edge_change_surface_colour_width_and_lines():
    style = {
        "a*": EdgeStyle(surface="concrete", lane_width=2.0, markings=False),
        "ba": EdgeStyle(colour="#ff0000"),
    }
    roads = build_roads(two_way(), RoadSettings(per_edge=style), textured=True)
    assert area_of(part(roads, "road/concrete")) < 100 * 3.2 * 0.9
    red = roads.materials["surface:#ff0000"]
    assert red["reflectance"]["value"] == pytest.approx([0.85, 0.0, 0.0])


def test_untextured_roads_are_matt():
    roads = build_roads(two_way(), RoadSettings(lane_width=3.5), textured=False)
    assert roads.materials["surface:asphalt"]["type"] == "diffuse"
    assert np.ptp(part(roads, "road/asphalt").vertices[:, 1]) == pytest.approx(6.4 + 0.3, abs=0.31)


def test_a_region_builds_only_what_touches_it():
    net = example("ronda")
    whole = built("ronda")
    some = build_roads(net, RoadSettings(), textured=True, region=(600.0, 650.0, 700.0, 780.0))
    assert 0 < len(some.layout.strips) < len(whole.layout.strips)
    empty = build_roads(net, RoadSettings(), textured=True, region=(1e6, 1e6, 1e6 + 1, 1e6 + 1))
    assert empty.static == ()
    assert (empty.surface_height_at(np.zeros((3, 2))) == 0).all()


def test_what_is_built_on_roads_is_kept_in_the_memory_of_their_world():
    net, memory = two_way(), Memory()
    roads = build_roads(net, RoadSettings(), textured=True, memory=memory)
    again = build_roads(net, RoadSettings(), textured=True, memory=memory)
    assert again.layout is roads.layout
    thing = roads.layout.memory.of(("thing",), object)
    assert memory.within("roads", None).of(("thing",), object) is thing
    region = (-500.0, -500.0, 500.0, 500.0)
    other = build_roads(net, RoadSettings(), textured=True, memory=memory, region=region)
    assert other.layout.memory.of(("thing",), object) is not thing


def test_sharp_bends_leave_no_gap():
    hairpin = edge("h", ("a", "b"), lane("h", 0, [(0, 0), (40, 0), (10, 9), (60, 20)]))
    cells = layout_roads(network([hairpin]), RoadSettings()).cells
    covered = shapely.union_all(cells.polygons, grid_size=1e-6)
    line = shapely.LineString(hairpin.lanes[0].shape[:, :2])
    wanted = line.buffer(1.55, cap_style="flat", join_style="bevel")
    assert wanted.difference(covered).area < 0.05
    assert len(overlaps(cells, above=1e-4).winners) == 0


def bridge() -> Network:
    low = edge("low", ("a", "b"), lane("low", 0, [(0, 0, 0), (100, 0, 1)]))
    high = edge("high", ("c", "d"), lane("high", 0, [(50, -50, 8), (50, 50, 8)]))
    return network([low, high])


def test_bridges_are_not_cut_by_the_road_below():
    roads = build_roads(bridge(), RoadSettings(), textured=True)
    assert shapely.area(roads.layout.cells.polygons).sum() == pytest.approx(2 * 320.0, rel=1e-3)
    crossing = replace_height(bridge(), 0.5)
    cut = layout_roads(crossing, RoadSettings()).cells
    assert shapely.area(cut.polygons).sum() == pytest.approx(640.0 - 3.2**2, rel=1e-3)


def replace_height(net: Network, z: float) -> Network:
    one = net.lanes["high_0"]
    shape = one.shape * [1, 1, 0] + [0, 0, z]
    edges = dict(net.edges) | {"high": edge("high", ("c", "d"), replace(one, shape=shape))}
    return Network(edges, net.junctions, (), net.location)


def slope() -> Network:
    """A two-lane road with a footway that climbs ever more steeply into a junction."""
    ways = [(0, 0.0), (40, 1.0), (80, 4.0), (100, 8.0)]
    lanes = [
        lane("up", 0, [(x, -2.6, z) for x, z in ways], width=2.0, allowed=WALK),
        *(lane("up", 1 + k, [(x, 3.2 * k, z) for x, z in ways]) for k in range(2)),
    ]
    inner = lane(":b_0", 0, [(100, 0, 8.0), (110, 0, 9.0)])
    far = lane("on", 0, [(110, 0, 9.0), (150, 0, 9.0)])
    outline = [(100, -1.6), (110, -1.6), (110, 1.6), (100, 4.8)]
    corner = junction("b", (105, 0), outline, incoming=["up_1", "up_2"])
    corner = replace(corner, outline=corner.outline + np.array([0, 0, 8.5]))
    edges = [
        edge("up", ("a", "b"), *lanes),
        edge(":b_0", ("", ""), inner, function="internal"),
        edge("on", ("b", "c"), far),
    ]
    way = Connection("up_1", "on_0", ":b_0_0", "", -1, "s", "M")
    return network(edges, [corner], [way])


def test_slopes_follow_the_lanes_and_meet_the_junction():
    roads = build_roads(slope(), RoadSettings(), textured=True)
    road = part(roads, "road/asphalt")
    known_x = np.array([0, 40, 80, 100, 110, 150.0])
    known_z = np.array([0, 1, 4, 8, 9, 9.0])
    for x, z in zip(known_x, known_z, strict=True):
        here = road.vertices[np.abs(road.vertices[:, 0] - x) < 1e-6]
        assert len(here) and here[:, 2] == pytest.approx(z, abs=1e-6)
    assert road.normals[:, 2].min() > 0.9
    paint = part(roads, "markings/asphalt").vertices
    above = paint[:, 2] - np.interp(paint[:, 0], known_x, known_z)
    assert above == pytest.approx(0.015, abs=0.02)
    faces = part(roads, "road/faces/kerb").vertices
    drop = faces[:, 2] - np.interp(faces[:, 0], known_x, known_z)
    assert drop.max() == pytest.approx(SIDEWALK_HEIGHT, abs=0.01)


@pytest.mark.parametrize("focus", [(70.0, 0.0, 80.0, 4.0), (900.0, 0.0, 910.0, 4.0), None])
def test_slopes_without_footways_need_no_kerb_near_the_camera(focus):
    net = slope()
    edges = [e if e.id != "up" else replace(e, lanes=e.lanes[1:]) for e in net.edges.values()]
    roads = build_roads(
        replace(net, edges={e.id: e for e in edges}), RoadSettings(), textured=True, focus=focus
    )
    ids = {p.id for p in roads.static}
    assert "road/asphalt" in ids and not any("kerb" in key for key in ids)
    assert smooth_normals(np.zeros((0, 3)), np.zeros((0, 3), np.int64)).shape == (0, 3)


def test_terrain_stays_below_the_roads_and_meets_their_borders():
    roads = build_roads(slope(), RoadSettings(), textured=True)
    mesh, height_at = terrain(roads.layout, slope())
    for one in roads.static:
        if one.id.startswith("road/asphalt"):
            clearance = one.part.mesh.vertices[:, 2] - height_at(one.part.mesh.vertices[:, :2])
            assert clearance.min() > 0.05
    assert mesh.bounds[1, 0] > 20_000
    ground = build_ground(GroundSettings(), slope(), roads=roads.layout, textured=False)
    assert {p.id for p in ground.static} <= {"ground", "ground/walls"}, "nothing to fall from"
    high = build_roads(bridge(), RoadSettings(), textured=True)
    over = build_ground(GroundSettings(), bridge(), roads=high.layout, textured=True)
    assert {"ground", "ground/far", "ground/walls"} <= {p.id for p in over.static}


def test_level_ground_reaches_the_horizon_just_below_the_road():
    net = example("ronda")
    roads = built("ronda")
    plain = GroundSettings(scale=2.0, horizon="flat")
    ground = build_ground(plain, net, roads=roads.layout, textured=True)
    mesh = ground.static[0].part.mesh
    assert mesh.vertices[:, 2] == pytest.approx(-0.03)
    assert (mesh.bounds[1] - mesh.bounds[0])[:2].min() > 40_000
    spread = np.ptp(mesh.uvs[:, 0]) * metres_per_tile("ground_grass") * 2.0
    assert spread == pytest.approx(np.ptp(mesh.vertices[:, 0]))


def test_uvs_are_shifted_by_whole_tiles():
    points = np.array([[20017.0, 15003.5], [20029.0, 15003.5]])
    uvs = planar_uvs(points, tile=12.0, near=(20015.0, 15000.0))
    assert np.abs(uvs).max() < 3
    shift = points / 12.0 - uvs
    assert shift == pytest.approx(np.round(shift))
    assert uvs[1, 0] - uvs[0, 0] == pytest.approx(1.0)


def test_surfaces_by_name_colour_or_file(tmp_path):
    assert colour_of("#000000") == (0.0, 0.0, 0.0)
    for wrong in ("#12", "#gggggg"):
        with pytest.raises(ConfigError, match="#rrggbb"):
            colour_of(wrong)
    image = tmp_path / "own.png"
    with pytest.raises(ConfigError, match=r"no image file"):
        surface_material(str(image), textured=True)
    image.write_bytes(b"")
    own = surface_material(str(image), textured=True)
    assert own["reflectance"] == {"type": "bitmap", "filename": str(image.resolve())}
    assert metres_per_tile(str(image)) == 10.0
    with pytest.raises(ConfigError, match="asphalt"):
        surface_material("asphlat", textured=True)


def test_motorway_lines_go_on_through_merges():
    net = example("ronda")
    inner = [p for p in paint_of(net) if p.owner.startswith(":") and len(p.quads)]
    assert len(inner) >= 10
