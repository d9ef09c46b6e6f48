"""Street lamps, signs and furniture: where they stand, what they show, how they shine."""

from dataclasses import replace
from itertools import pairwise

import colour
import numpy as np
import pytest
import shapely
from any_network.proposed import Pose, furnished

from sumo3dviz_pt.job.settings import StreetSettings
from sumo3dviz_pt.library.street import signs as shapes
from sumo3dviz_pt.library.street.furniture import LENS
from sumo3dviz_pt.library.street.road_styles import STYLES
from sumo3dviz_pt.library.street.signs import YELLOW
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Poi, Scenario, Stop, TrafficLog
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.surroundings import Tile, surroundings
from sumo3dviz_pt.world.street.lamps import FLUX, HIGH, LOBE, LOW, place_lamps, radiance
from sumo3dviz_pt.world.street.places import Site, border_of, borders_near, crossing_areas, spread
from sumo3dviz_pt.world.street.signs import limit_of, links_of, place_signs
from sumo3dviz_pt.world.street.street import _StreetTiles, build_street

CAR = frozenset({"passenger", "bus", "truck"})
FOOT, BIKE = frozenset({"pedestrian"}), frozenset({"bicycle"})
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
CANDELAS = 32_000.0


def edge(name, y, *, kinds, x=(0.0, 300.0), speed=13.9, type_="", ends=("A", "B"), left=False):
    """An edge to the east (west if x falls) whose lanes of kinds follow each other inwards."""
    lanes, at = [], 0.0
    east = 1.0 if x[1] > x[0] else -1.0
    inward = -east if left else east
    for i, kind in enumerate(kinds):
        width = {"f": 2.5, "b": 1.8, "c": 3.2}[kind]
        allowed = {"f": FOOT, "b": BIKE, "c": CAR}[kind]
        lateral = y + inward * (at + width / 2)
        shape = np.array([(x[0], lateral, 0.0), (x[1], lateral, 0.0)])
        lanes.append(Lane(f"{name}_{i}", name, i, shape, width, speed, abs(x[1] - x[0]), allowed))
        at += width
    return Edge(name, "normal", *ends, tuple(lanes), type_)


def network(*edges, links=(), left=False, junctions=()):
    by_id = {e.id: e for e in edges}
    return Network(by_id, {j.id: j for j in junctions}, tuple(links), Location(), left)


def site_on(net, *, viewpoints=((150.0, 0.0, 30.0),), taken=()):
    around = surroundings(net, seed=3, viewpoints=np.array(viewpoints) + np.array([0.0, 60.0, 0.0]))
    flat = lambda places: np.zeros(len(places))  # noqa: E731
    return Site(
        around,
        flat,
        crossing_areas(net),
        np.array(taken, float).reshape(-1, 2),
        shapely.STRtree([]),
    )


def built(net, *, pois=(), stops=(), dark=False, **settings):
    log = TrafficLog((), (), 0.0, 0.0, 0.0)
    scenario = Scenario(net, log, pois=tuple(pois), stops=tuple(stops))
    return build_street(scenario, StreetSettings(**settings), site=site_on(net), dark=dark)


def poi(name, type_, x, y):
    return Poi(name, type_, (x, y), None, None, "f.add.xml")


TOWN = network(
    edge("in", 0.0, kinds="fbc"),
    edge("back", 16.0, kinds="fc", x=(300.0, 0.0), ends=("B", "A")),
)


def families(parts):
    return {part.family for part in parts.static}


def test_borders_lie_between_sidewalk_and_carriageway():
    border = border_of(TOWN, TOWN.edges["in"])
    assert border.walk == 2.5 and border.road == pytest.approx(5.0)
    np.testing.assert_allclose(border.line[:, 1], 2.5)
    places, _, yaw = border.at(np.array([10.0]), 1.0)
    np.testing.assert_allclose(places, [(10.0, 1.5)])
    np.testing.assert_allclose(border.inward(yaw), np.pi / 2)


def test_left_hand_borders_lie_on_the_left():
    net = network(edge("in", 0.0, kinds="fc", left=True), left=True)
    border = border_of(net, net.edges["in"])
    np.testing.assert_allclose(border.line[:, 1], -2.5)
    np.testing.assert_allclose(border.at(np.array([5.0]), 1.0)[0], [(5.0, -1.5)])


def test_edges_without_cars_have_no_border():
    net = network(edge("path", 0.0, kinds="fb"))
    assert border_of(net, net.edges["path"]) is None


@pytest.mark.parametrize(("length", "count"), [(10.0, 0), (40.0, 1), (100.0, 3), (318.0, 10)])
def test_spread_keeps_ends_clear(length, count):
    at = spread(length, 30.0, ends=(4.0, 14.0))
    assert len(at) == count
    assert not len(at) or (at.min() >= 4.0 and at.max() <= length - 14.0)


def test_lamps_stand_on_the_sidewalk_and_reach_over_the_road():
    site = site_on(TOWN)
    lamps = place_lamps(borders_near(TOWN, site.around, reach=500.0), (), site)
    assert 8 <= len(lamps) <= 22
    for lamp in lamps:
        assert 0.0 < lamp.place[1] < 2.5 or 13.5 < lamp.place[1] < 16.0
        towards = np.sin(lamp.yaw)
        assert towards == pytest.approx(1.0 if lamp.place[1] < 8.0 else -1.0)


def test_no_lamp_stands_right_before_a_camera_and_that_is_said():
    """Neither one that our code puts up nor one of the scenario's."""
    eye = np.array([[130.0, 2.0, 4.0]])
    way = CameraPath(eye, np.array([[0.97, 0.24, 0.0]]), np.array([0.6]))
    around = surroundings(TOWN, seed=3, camera_path=way)
    site = replace(site_on(TOWN), around=around)
    pois = [poi("near", "street_lamp", 139.0, 1.8), poi("far", "street_lamp", 250.0, 1.8)]
    log = TrafficLog((), (), 0.0, 0.0, 0.0)
    scenario = Scenario(TOWN, log, pois=tuple(pois))
    parts = build_street(scenario, StreetSettings(), site=site, dark=False)
    (said,) = [item for item in parts.left_out if "of the scenario" in item.what]
    assert said.what.startswith("1 street lamps") and "clear_view" in said.why
    lamps = place_lamps(borders_near(TOWN, around, reach=500.0), pois, site)
    places = np.array([lamp.place[:2] for lamp in lamps])
    assert not around.clearance.before_lens(
        places, np.zeros(len(places)), height=LOW, reach=2.0
    ).any()
    assert any(abs(x - 250.0) < 0.1 for x, _ in places) and len(places) > 4


def before(eye, forward, half=0.6):
    """A site of which a camera sees a part."""
    way = CameraPath(np.array([eye]), np.array([forward]), np.array([half]))
    return lambda net: replace(
        site_on(net), around=surroundings(net, seed=3, camera_path=way), tile=None
    )


def test_no_piece_of_furniture_fills_much_of_a_picture():
    """Low ones too, ours and the scenario's, and that is said."""
    site = before((136.0, 1.0, 1.6), (1.0, 0.0, 0.0))(TOWN)
    pois = [poi("near", "vending_machine", 139.0, 1.5), poi("far", "bench", 190.0, 1.2)]
    log = TrafficLog((), (), 0.0, 0.0, 0.0)
    scenario = Scenario(TOWN, log, pois=tuple(pois))
    parts = build_street(scenario, StreetSettings(), site=site, dark=False)
    things = [name for p in parts.static for name, _ in p.part.mesh.things]
    assert any(name.startswith("bench:190") for name in things)
    assert not any(name.startswith("parking_meter:139") for name in things)
    assert any("right before a camera" in item.what for item in parts.left_out)


@pytest.mark.parametrize("ahead", [6.0, 60.0])
def test_a_gantry_hangs_right_before_no_camera(ahead):
    eye = (120.0 - ahead, 5.0, 5.0)
    site = before(eye, (1.0, 0.0, 0.05))(motorway())
    log = TrafficLog((), (), 0.0, 0.0, 0.0)
    settings = StreetSettings(lamps="none", furniture="none")
    parts = build_street(Scenario(motorway(), log), settings, site=site, dark=False)
    spots = np.concatenate([p.part.mesh.vertices for p in parts.static if p.family == "signs"])
    high = spots[spots[:, 2] > 5.5]
    assert len(high), "it moves"
    assert not ((high[:, 0] > eye[0]) & (high[:, 0] < eye[0] + 14.0)).any()
    assert (abs(high[:, 0].mean() - 120.0) < 5.0) == (ahead == 60.0)


def test_narrow_roads_have_lamps_on_both_sides_in_turn():
    net = network(
        edge("in", 0.0, kinds="fc"), edge("back", 11.4, kinds="fc", x=(300, 0), ends=("B", "A"))
    )
    site = site_on(net)
    lamps = place_lamps(borders_near(net, site.around, reach=500.0), (), site)
    xs = sorted((lamp.place[0], lamp.place[1] < 5.0) for lamp in lamps)
    sides = [side for _, side in xs]
    assert all(a != b for a, b in pairwise(sides))
    assert np.diff([x for x, _ in xs]).max() < 45.0


def test_few_lamps_light_a_junction_of_short_roads():
    ends = {"E": (40, 0), "W": (-40, 0), "N": (0, 40), "S": (0, -40)}
    edges = []
    for name, (x, y) in ends.items():
        away, aside = np.array([x, y]) / 40.0, np.array([-y, x]) / 40.0
        for key, side in ((f"{name}M", 1.6), (f"M{name}", -1.6)):
            line = np.array([away * 8, away * 38]) + side * aside
            shape = np.column_stack([line[::-1] if key[1] == "M" else line, np.zeros(2)])
            lane = Lane(f"{key}_0", key, 0, shape, 3.2, 13.9, 30.0, CAR)
            edges.append(Edge(key, "normal", key[0], key[1], (lane,)))
    net = network(*edges)
    site = site_on(net, viewpoints=((0.0, 900.0, 30.0),))
    borders = [border_of(net, e) for e in edges]
    places = np.array([lamp.place[:2] for lamp in place_lamps(borders, (), site)])
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    assert 3 <= len(places) <= 5
    assert apart[~np.eye(len(places), dtype=bool)].min() > 18.0


@pytest.mark.parametrize(
    ("kinds", "speed", "type_", "lit"),
    [
        ("fc", 27.8, "", True),
        ("c", 13.9, "", True),
        ("c", 27.8, "", False),
        ("c", 13.9, "highway.motorway_link", False),
    ],
)
def test_lamps_belong_to_towns(kinds, speed, type_, lit):
    net = network(edge("in", 0.0, kinds=kinds, speed=speed, type_=type_))
    assert ("street lamps" in families(built(net))) == lit


@pytest.mark.parametrize("height", [LOW, HIGH])
def test_below_a_lamp_it_is_as_bright_as_the_standard_asks(height):
    """Law 5: 5 to 30 lx; the lens's own closed form, a rectangle over a point below it.

    E = L * the projected solid angle of a rectangle seen from below its middle (four
    corner pieces), Siegel and Howell, Thermal Radiation Heat Transfer, configuration 4.
    """
    a, b = LENS[0] / 2 / height, LENS[1] / 2 / height
    corner = (
        a / np.sqrt(1 + a * a) * np.arctan(b / np.sqrt(1 + a * a))
        + b / np.sqrt(1 + b * b) * np.arctan(a / np.sqrt(1 + b * b))
    ) / 2
    lux = float(np.dot(radiance(height), LUMINANCE)) * CANDELAS * 4 * corner
    assert 10.0 < lux < 30.0
    assert lux == pytest.approx(FLUX[height] / LOBE.flux / height**2, rel=0.01)


def test_mean_light_on_a_street_is_that_of_its_class():
    """Twelve lamps along 360 m light the lanes with 10 to 20 lx on average (M2 to M4)."""
    net = network(edge("in", 0.0, kinds="fcc", x=(0.0, 378.0)))
    site = site_on(net)
    lamps = place_lamps(borders_near(net, site.around, reach=900.0), (), site)
    x, y = np.meshgrid(np.linspace(120, 260, 60), np.linspace(2.5, 8.9, 12))
    lux = np.zeros(x.shape)
    for lamp in lamps:
        over = np.array(lamp.place[:2]) + 1.5 * np.array([np.cos(lamp.yaw), np.sin(lamp.yaw)])
        square = (x - over[0]) ** 2 + (y - over[1]) ** 2 + lamp.height**2
        shine = LOBE.at(lamp.height / np.sqrt(square))
        lux += FLUX[lamp.height] / LOBE.flux * shine * lamp.height**2 / square**2
    assert 10.0 < lux.mean() < 20.0
    assert lux.max() < 31.0


def test_by_night_every_lamp_near_the_camera_shines_and_by_day_none():
    night, day = built(TOWN, dark=True), built(TOWN)
    assert day.lamps == ()
    assert len(night.lamps) == 2, "a set for each ring of distance"
    assert len({lamps.id for lamps in night.lamps}) == 2
    for lamps in night.lamps:
        assert lamps.sampled and lamps.radiance.shape == (len(lamps.lamps), 3)
        assert len(lamps.mesh.faces) == 2 * len(lamps.lamps)
        a, b, c = (lamps.mesh.vertices[lamps.mesh.faces[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a)[:, 2] < 0).all(), "lenses look down"
    assert any("lens" in part.id for part in day.static)
    assert not any("lens" in part.id for part in night.static)


def test_everything_can_be_switched_off_and_says_so():
    off = built(TOWN, lamps="none", signs="none", furniture="none", dark=True)
    assert (off.static, off.lamps) == ((), ())
    assert [item.what for item in off.left_out] == ["street lamps", "signs", "furniture"]
    assert all("switched off" in item.why for item in off.left_out)


def test_pois_are_drawn_even_if_nothing_else_is():
    given = [poi("a", "street_lamp", 50, -1), poi("b", "bench", 70, -1), poi("c", "bin", 70, 4)]
    parts = built(TOWN, pois=given, lamps="none", signs="none", furniture="none")
    assert families(parts) == {"street lamps", "furniture"}
    xs = np.concatenate([part.part.mesh.vertices for part in parts.static])[:, :2]
    assert not (np.abs(xs[:, 0] - 70.0) < 0.5).all()
    assert not ((xs[:, 1] > 3.5) & (xs[:, 1] < 4.5) & (xs[:, 0] > 69)).any(), "no bin on the road"


def test_no_end_of_a_bench_reaches_over_a_lane():
    """The POI itself stands beside the lane that begins half a metre away."""
    net = network(edge("in", 0.0, kinds="c"), edge("late", 20.0, kinds="c", x=(100.5, 300.0)))
    given = [poi("a", "bench", 100.0, 20.5), poi("b", "bench", 98.0, 20.5)]
    parts = built(net, pois=given, lamps="none", signs="none", furniture="none")
    spots = np.concatenate([part.part.mesh.vertices for part in parts.static])
    assert spots[:, 0].min() > 96.0 and spots[:, 0].max() < 100.0


def test_a_stop_gets_a_shelter_beside_the_lane_and_a_sign():
    stop = Stop("s", "in_2", 100.0, 120.0)
    parts = built(TOWN, stops=[stop], lamps="none", signs="none", furniture="none")
    roof = np.concatenate([p.part.mesh.vertices for p in parts.static if p.family == "furniture"])
    low, high = roof.min(axis=0), roof.max(axis=0)
    assert 104.0 < (low[0] + high[0]) / 2 < 116.0
    assert high[1] < 2.5 and low[1] > -2.5, "on the right, off the carriageway"
    assert 2.4 < high[2] < 2.8
    sign = np.concatenate([p.part.mesh.vertices for p in parts.static if p.family == "signs"])
    assert abs(sign[:, 0].mean() - 119.5) < 4.0


@pytest.mark.parametrize(
    ("start", "end", "span"),
    [(None, None, (0.0, 1.0)), (-20.0, -10.0, (0.8, 0.9)), (30.0, 10.0, (0.1, 0.3)),
     (10.0, 500.0, (0.1, 1.0))],
)  # fmt: skip
def test_spans_of_stops(start, end, span):
    assert Stop("s", "l", start, end).span(100.0) == pytest.approx(span)


def junction_of(states, *, tls=""):
    """A road to the east that a side road joins; states of its links."""
    main, side, out = (
        edge("main", 0.0, kinds="c", x=(0, 100), ends=("A", "M")),
        edge("side", -30.0, kinds="c", x=(0, 90), ends=("S", "M")),
        edge("out", 0.0, kinds="c", x=(110, 200), ends=("M", "B")),
    )
    links = [
        Connection("main_0", "out_0", "", tls, 0, "s", states[0]),
        Connection("side_0", "out_0", "", tls, 1, "r", states[1]),
    ]
    return network(main, side, out, links=links)


@pytest.mark.parametrize(
    ("states", "tls", "colours"),
    [
        ("Mm", "", {"red", "white", "yellow"}),
        ("Ms", "", {"red", "white", "yellow"}),
        ("Mm", "t", set()),
        ("==", "", {"red", "white"}),
    ],
)
def test_signs_of_priority(states, tls, colours):
    names = {(0.5, 0.012, 0.015): "red", (0.72, 0.72, 0.7): "white", (0.72, 0.4, 0.01): "yellow"}
    net = junction_of(states, tls=tls)
    limits = {e.id: limit_of(e, STYLES["european"].signs) for e in net.edges.values()}
    assert set(limits.values()) == {50}
    parts = built(net, lamps="none", furniture="none")
    ends = [p.part for p in parts.static if p.family == "signs" and p.part.tint is not None]
    # Begins of edges carry speed limits, which are no matter here.
    found = set()
    for part in ends:
        x = part.mesh.vertices[part.mesh.faces[:, 0], 0]
        late = (x > 40.0) & (x < 100.0)
        found |= {names.get(tuple(np.round(t, 3)), "other") for t in part.tint[late]}
    assert found - {"other"} == colours


@pytest.mark.parametrize(
    ("name", "limit", "yellow"),
    [("european", 50, True), ("american", 30, False), ("british", 30, False)],
)
def test_signs_have_the_unit_and_shapes_of_the_style(name, limit, yellow):
    style, net = STYLES[name].signs, junction_of("Mm", tls="")
    assert limit_of(net.edges["main"], style) == limit
    site = site_on(net)
    borders = [border_of(net, net.edges[key]) for key in ("main", "side")]
    signs = place_signs(net, borders, site, links_of(net), style)
    tints = np.concatenate([p.tint for s in signs for p in s.body(level=0) if p.tint is not None])
    assert ((tints == YELLOW).all(axis=1)).any() == yellow
    assert len(signs) == 4 - (not yellow)


def test_limits_stand_where_they_change():
    net = network(
        edge("a", 0.0, kinds="c", x=(0, 100), speed=13.9, ends=("A", "M")),
        edge("b", 0.0, kinds="c", x=(101, 200), speed=13.9, ends=("M", "N")),
        edge("c", 0.0, kinds="c", x=(201, 300), speed=8.33, ends=("N", "B")),
        links=[Connection("a_0", "b_0", "", "", -1, "s", "M"),
               Connection("b_0", "c_0", "", "", -1, "s", "M")],
    )  # fmt: skip
    parts = built(net, lamps="none", furniture="none")
    x = np.concatenate([p.part.mesh.vertices[:, 0] for p in parts.static if p.family == "signs"])
    groups = {int(value // 100) for value in x}
    assert groups == {0, 2}


def motorway(exits=True):
    main = edge("m", 0.0, kinds="ccc", x=(0, 300), speed=27.8, type_="highway.motorway",
                ends=("A", "M"))  # fmt: skip
    on = edge("n", 0.0, kinds="ccc", x=(305, 600), speed=27.8, type_="highway.motorway",
              ends=("M", "B"))  # fmt: skip
    ramp = edge("x", -8.0, kinds="c", x=(305, 450), type_="highway.motorway_link", ends=("M", "C"))
    links = [Connection(f"m_{i}", f"n_{i}", "", "", -1, "s", "M") for i in range(3)]
    if exits:
        links.append(Connection("m_0", "x_0", "", "", -1, "r", "M"))
    return network(main, on, ramp, links=links)


@pytest.mark.parametrize("exits", [True, False])
def test_motorways_have_a_gantry_before_exits_only(exits):
    parts = built(motorway(exits), lamps="none", furniture="none")
    tall = [p.part.mesh.vertices for p in parts.static if p.family == "signs"]
    high = np.concatenate(tall)[:, 2].max()
    assert (high > 5.5) == exits
    if exits:
        points = np.concatenate(tall)
        over = points[points[:, 2] > 5.0]
        assert 100.0 < over[:, 0].mean() < 140.0
        assert over[:, 1].min() < -1.0 and over[:, 1].max() > 9.6, "it spans the carriageway"
        posts = points[(points[:, 2] < 5.0) & (points[:, 0] < 140) & (points[:, 0] > 100)]
        assert not ((posts[:, 1] > 0.0) & (posts[:, 1] < 9.6)).any()


def test_boards_show_the_names_of_the_streets_that_an_exit_leads_to():
    """The exit's own name, or that of the next street with one; long ones are cut at a word."""
    net = motorway()
    bridge = edge("y", -8.0, kinds="c", x=(455, 600), ends=("C", "D"))
    further = [*net.connections, Connection("x_0", "y_0", "", "", -1, "s", "M")]

    def faces(ramp: str, after: str) -> int:
        edges = {**net.edges, "y": replace(bridge, name=after)}
        edges["x"] = replace(edges["x"], name=ramp)
        named = replace(net, edges=edges, connections=tuple(further))
        parts = built(named, lamps="none", furniture="none").static
        return sum(len(p.part.mesh.faces) for p in parts if p.family == "signs")

    def board(word: str) -> int:
        return sum(len(part.mesh.faces) for part in shapes.board((word,), "exit"))

    short = faces("Calle Ñ", "")
    assert faces("Via Łódź", "") - short == board("Via Łódź") - board("Calle Ñ")
    assert faces("", "Calle Ñ") == faces("Calle Ñ", "Other") == short
    long = faces("Allee der Kosmonauten und Astronauten", "")
    assert long - short == board("Allee der Kosmonauten") - board("Calle Ñ")
    # Both boards never say the same, even if only their first words are shown.
    ahead = "Allee der Kosmonauten und so weiter"
    net = replace(net, edges={**net.edges, "n": replace(net.edges["n"], name=ahead)})
    both = faces("Allee der Kosmonauten und Astronauten", "")
    one = faces("Calle Ñ", "")
    assert both - one != board("Allee der Kosmonauten") - board("Calle Ñ")
    net = motorway()
    # What no hand can write is left out, and a place by chance stands there.
    assert faces("東京", "") == faces("", "")


def test_the_same_seed_gives_the_same_things():
    one, other = built(TOWN), built(TOWN)
    for a, b in zip(one.static, other.static, strict=True):
        np.testing.assert_array_equal(a.part.mesh.vertices, b.part.mesh.vertices)


def test_junctions_and_empty_networks_are_no_trouble():
    net = network(junctions=[Junction("J", "priority", np.zeros(3), np.zeros((0, 3)))])
    assert built(net).static == ()


def grid_town(step=90.0, count=7):
    """Streets with footways both ways, and no tile's border along any of them."""
    edges = {}
    for k in range(count):
        for name, kinds, ends in (
            (f"e{k}", "fc", ((0.0, count * step), (count * step, 0.0))),
            (f"w{k}", "fc", ((0.0, count * step), (count * step, 0.0))),
        ):
            there = ends[0] if name.startswith("e") else ends[1]
            y = step * k + (0.0 if name.startswith("e") else 11.4)
            edges[name] = edge(name, y, kinds=kinds, x=there, ends=("A", "B"))
    return network(*edges.values())


def stood(net, eye):
    """Whatever stands along streets in all tiles, as one camera's shot finds it."""
    site = site_on(net, viewpoints=(eye,))
    site = replace(site, around=replace(site.around, clearance=Clearance()))
    town = Scenario(net, TrafficLog((), (), 0.0, 0.0, 0.0))
    streets = _StreetTiles(town, StreetSettings(), site, STYLES["european"].signs)
    tiles = [Tile(250.0, x, y) for x in range(-1, 4) for y in range(-1, 4)]
    found = []
    for tile in tiles:
        kerbs = streets.kerbs(tile)
        found += [lamp.place for lamp in kerbs.lamps]
        found += [tuple(sign.stand.matrix[:3, 3]) for sign in kerbs.signs]
        found += [piece.place for piece in streets.walks(tile).pieces]
    return np.array(found)


def test_what_stands_hangs_on_no_camera_and_nothing_touches_across_tiles():
    net = grid_town()
    west, east = stood(net, (0.0, 0.0, 30.0)), stood(net, (600.0, 300.0, 2.0))
    assert len(west) > 150
    np.testing.assert_array_equal(west, east)
    away = np.hypot(*(west[:, None, :2] - west[None, :, :2]).transpose(2, 0, 1))
    # Bollards stand in rows of their own.
    assert away[~np.eye(len(west), dtype=bool)].min() > 1.0


GIVEN = [
    *(poi(f"lamp{x}", "street_lamp", x, 1.8) for x in (40.0, 210.0)),
    *(poi(f"meter{x}", "vending_machine", x, 0.6) for x in (75.0, 255.0)),
    *(poi(f"shelter{x}", "bus_shelter", x, -0.4) for x in (120.0, 180.0)),
]


def street_before(poses, *, clear):
    """What stands along a street that cameras look at, with or without a clear view."""
    ways = []
    for pose in poses:
        half = np.arctan(np.tan(np.radians(pose.fov) / 2.0) * np.hypot(1.0, 9.0 / 16.0))
        ways.append(CameraPath(pose.eye[None], pose.axes()[0][None], np.array([half])))
    clearance = Clearance(tuple(ways) if clear else ())
    around = surroundings(TOWN, seed=3, camera_path=CameraPath.joined(ways), clearance=clearance)
    town = Scenario(TOWN, TrafficLog((), (), 0.0, 0.0, 0.0), pois=tuple(GIVEN))
    site = replace(site_on(TOWN), around=around)
    return build_street(town, StreetSettings(), site=site, dark=False).static


def poses_at(names):
    """Somebody who knows nothing of furniture puts cameras right before things of a street."""
    rng = np.random.default_rng(33)
    for name in names:
        place = np.array([float(word) for word in name.split(":")[1].split(",")])
        turn, away = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(2.0, 6.0)
        eye = place + np.array([away * np.cos(turn), away * np.sin(turn), rng.uniform(1.6, 3.0)])
        yield Pose(eye, place + np.array([0.0, 0.0, 1.3]), float(rng.choice([40.0, 60.0])))


@pytest.mark.slow
def test_whoever_chose_a_camera_nothing_along_streets_hides_much():
    """What stands is looked at through pictures, not by the rule that placed it."""
    far = Pose(np.array([150.0, 8.0, 60.0]), np.array([150.0, 9.0, 0.0]), 170.0)
    parts = street_before([far], clear=False)
    names = sorted({name for part in parts for name, _ in part.part.mesh.things})
    assert len({name.split(":")[0] for name in names}) >= 5
    hidden = 0
    for pose in poses_at(names[:: max(1, len(names) // 16)]):
        hidden += bool(list(furnished(pose, street_before([pose], clear=False))))
        faults = list(furnished(pose, street_before([pose], clear=True)))
        assert not faults, f"{pose}\n" + "\n".join(faults)
    assert hidden > 5, "the law sees what stands in the way"


def test_lamps_have_the_colour_of_a_black_body_of_4000_kelvin():
    """Seen by a camera whose white is one of 5000 K, by Bradford's adaptation."""

    def black_body(kelvin):
        found = colour.sd_to_XYZ(colour.sd_blackbody(kelvin, colour.SpectralShape(360, 780, 10)))
        return found / found[1]

    space = colour.RGB_COLOURSPACES["sRGB"]
    white = colour.xy_to_XYZ(space.whitepoint)
    seen = colour.adaptation.chromatic_adaptation_VonKries(
        black_body(4000.0), black_body(5000.0), white, transform="Bradford"
    )
    expected = space.matrix_XYZ_to_RGB @ seen
    found = np.array(radiance(LOW))
    np.testing.assert_allclose(found / found.max(), expected / expected.max(), atol=0.05)
