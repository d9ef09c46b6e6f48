"""Where signal heads stand and what they show."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from builders import aspect_at

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.world.placement.lanes import build_lane_index
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.signals.signals import RADIANCE, Signals, build_signals

CAR, FOOT = frozenset({"passenger", "bus"}), frozenset({"pedestrian"})


def edge(name, y, *, lanes=1, x=(0.0, 100.0), left=False, function="normal", walk=False, z=0.0):
    """An edge to the east whose lane 0 lies at y; further lanes are inwards."""
    made = []
    for i in range(lanes):
        at = y + (-3.2 if left else 3.2) * i
        shape = np.array([(x[0], at, z), (x[1], at, z)])
        allowed = FOOT if walk or function == "walkingarea" or i < 0 else CAR
        made.append(Lane(f"{name}_{i}", name, i, shape, 3.2, 13.9, 100.0, allowed))
    return Edge(name, function, "A", "B", tuple(made))


def network(edges, connections, *, left=False):
    by_id = {e.id: e for e in edges}
    junction = Junction("B", "traffic_light", np.zeros(3), np.zeros((0, 3)))
    return Network(by_id, {"B": junction}, tuple(connections), Location(), left)


def link(index, lane="in_0", to="out_0", tls="J"):
    return Connection(lane, to, "", tls, index)


def phases(*states, step=10.0, tls="J"):
    return {tls: SignalPhases(tls, tuple(step * i for i in range(len(states))), states)}


def out():
    return edge("out", 0.0, x=(120.0, 200.0))


def lit(signals, head, time):
    """Colours of the lamps of a head that shine."""
    rows = signals.radiance_at(time)["signals"]
    first = sum(h.lamps for h in signals.heads[:head])
    names = signals.lamps[0].lamps
    return {
        names[i].split("/")[-1]
        for i in range(first, first + signals.heads[head].lamps)
        if rows[i].any()
    }


def build(edges, links, log, *, left=False, **settings):
    return build_signals(network(edges, links, left=left), log, SignalSettings(**settings))


def test_ramp_meter_is_one_head_beside_the_stop_line_facing_traffic():
    signals = build([edge("in", 0.0), out()], [link(0)], phases("G", "r"))
    (head,) = signals.heads
    assert head.position[1] == pytest.approx(-1.6 - 0.7)
    assert 102.5 < head.position[0] < 104.5
    assert 2.19 <= head.position[2] <= 2.6
    assert head.yaw == 0.0
    lens = signals.lamps[0].mesh
    assert (lens.normals[:, 0] < -0.8).all(), "lenses look at the traffic that arrives"
    assert signals.lamps[0].lamps == ("J/0/0/green", "J/0/0/yellow", "J/0/0/red")
    assert {part.family for part in signals.static} == {"signals"}


def test_lenses_face_outwards_by_their_winding_too():
    mesh = build([edge("in", 0.0), out()], [link(0)], phases("G")).lamps[0].mesh
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 0] < 0).all()


def test_left_hand_traffic_has_its_pole_on_the_left():
    signals = build([edge("in", 0.0, left=True), out()], [link(0)], phases("G"), left=True)
    assert signals.heads[0].position[1] == pytest.approx(1.6 + 0.7)


def test_links_that_show_the_same_share_a_head_and_others_stand_in_lane_order():
    edges = [edge("in", 0.0, lanes=2), out()]
    links = [link(0), link(1, "in_0"), link(2, "in_1"), link(3, "in_1")]
    signals = build(edges, links, phases("GgGr", "rrrG"))
    assert [head.links for head in signals.heads] == [(0, 1, 2), (3,)]
    right, left = (head.position[1] for head in signals.heads)
    assert left - right == pytest.approx(0.56)
    assert aspect_at(signals, "J", 3, 1.0) == {"red"}
    assert aspect_at(signals, "J", 2, 1.0) == {"green"}
    assert lit(signals, 0, 1.0) == {"green"}
    assert lit(signals, 1, 1.0) == {"red"}


def test_left_turn_stands_on_the_left_in_left_hand_traffic_reversed():
    edges = [edge("in", 0.0, lanes=2, left=True), out()]
    signals = build(edges, [link(0), link(1, "in_1")], phases("Gr"), left=True)
    outer, inner = (head.position[1] for head in signals.heads)
    assert outer > inner


def test_wide_edges_get_an_arm_with_heads_over_their_lanes():
    edges = [edge("in", 0.0, lanes=3), out()]
    links = [link(i, f"in_{i}") for i in range(3)]
    signals = build(edges, links, phases("GGr"))
    over = [head for head in signals.heads if head.position[2] > 4.0]
    assert [round(float(head.position[1]), 2) for head in over] == [0.0, 3.2, 6.4]
    assert all(head.position[2] >= 4.6 for head in over)
    pole = next(part.part.mesh for part in signals.static if "pole" in part.id)
    assert pole.vertices[:, 1].max() > 6.4
    assert len(set(signals.lamps[0].lamps)) == len(signals.lamps[0].lamps)


def test_poles_keep_off_the_carriageway_beside_them():
    edges = [edge("in", 0.0), edge("next", -3.4), out()]
    made = network(edges, [link(0)])
    signals = build_signals(made, phases("G"), SignalSettings())
    foot = signals.heads[0].position[:2]
    assert not build_lane_index(made).covers(foot[None], margin=0.25)[0]
    assert foot[1] < -3.4 - 1.6


def test_pole_stands_beyond_the_sidewalk():
    walk = Lane("in_0", "in", 0, np.array([(0, 0, 0), (100, 0, 0.0)]), 2.0, 5, 100, FOOT)
    road = Lane("in_1", "in", 1, np.array([(0, 2.6, 0), (100, 2.6, 0.0)]), 3.2, 14, 100, CAR)
    edges = [Edge("in", "normal", "A", "B", (walk, road)), out()]
    signals = build(edges, [link(0, "in_1")], phases("G"))
    assert signals.heads[0].position[1] == pytest.approx(-1.0 - 0.7)


def crossing_network():
    shape = np.array([(105.0, -8.0, 0.0), (105.0, 8.0, 0.0)])
    lane = Lane(":B_c0_0", ":B_c0", 0, shape, 4.0, 1, 16, FOOT)
    area = edge(":B_w0", -10.0, x=(100.0, 110.0), function="walkingarea")
    edges = [edge("in", 0.0), out(), area, Edge(":B_c0", "crossing", "", "", (lane,))]
    return network(edges, [link(0), link(1, ":B_w0_0", ":B_c0_0")])


def test_crossings_have_two_lamp_heads_at_both_ends_that_face_each_other():
    signals = build_signals(crossing_network(), phases("rG", "Gr", "ry"), SignalSettings())
    walk = [head for head in signals.heads if head.links == (1,)]
    assert [head.lamps for head in walk] == [2, 2]
    ends = [head.position[1] for head in walk]
    assert max(ends) > 8.0
    assert min(ends) < -8.0
    for head in walk:
        # People who come from the other end look along the head's yaw.
        assert np.sin(head.yaw) * head.position[1] > 0
    index = signals.heads.index(walk[0])
    assert [lit(signals, index, t) for t in (5, 15, 25)] == [{"green"}, {"red"}, {"red"}]


def test_people_never_see_interpolated_yellow_or_early_red():
    signals = build_signals(crossing_network(), phases("rG", "Gr", "rG"), SignalSettings())
    assert aspect_at(signals, "J", 1, 9.9) == {"green"}
    assert aspect_at(signals, "J", 0, 19.9) == {"yellow"}


@pytest.mark.parametrize(
    ("settings", "shown"),
    [
        ({}, {"yellow"}),
        ({"yellow": "log"}, {"green"}),
        ({"design": "two_heads"}, {"green"}),
        ({"yellow_time": 0.5}, {"green"}),
    ],
)
def test_yellow_as_the_settings_say(settings, shown):
    signals = build([edge("in", 0.0), out()], [link(0)], phases("G", "r"), **settings)
    assert aspect_at(signals, "J", 0, 9.0) == shown
    assert lit(signals, 0, 9.0) == shown
    assert lit(signals, 0, 10.0) == {"red"}


def test_radiance_is_that_of_the_table_and_zero_elsewhere():
    signals = build([edge("in", 0.0), out()], [link(0)], phases("u"))
    rows = signals.radiance_at(3.0)["signals"]
    assert np.array_equal(rows, [(0, 0, 0), RADIANCE["yellow"], RADIANCE["red"]])
    assert not signals.radiance_at(-1.0)["signals"].any()


def test_every_log_that_breaks_the_founding_software_works():
    edges = [edge("in", 0.0, lanes=2), out()]
    links = [link(i, f"in_{i // 2}") for i in range(4)]
    log = phases("GgyY", "rrus", "oOrr")
    signals = build(edges, links, log, yellow="log")
    seen = [[aspect_at(signals, "J", i, t) for i in range(4)] for t in (0.0, 10.0, 20.0, 1e6)]
    assert seen[0] == [{"green"}, {"green"}, {"yellow"}, {"yellow"}]
    assert seen[1] == [{"red"}, {"red"}, {"red", "yellow"}, {"red"}]
    assert seen[2] == [{"yellow"}, set(), {"red"}, {"red"}]
    assert seen[3] == seen[2]


@pytest.mark.parametrize(
    ("links", "log", "settings", "why"),
    [
        ([link(0)], phases("G"), {"show": False}, "signals.show"),
        ([Connection("in_0", "out_0")], phases("G"), {}, "the network has none"),
        ([Connection("in_0", "out_0", "", "J", -1)], phases("G"), {}, "the network has none"),
        ([link(0)], {}, {}, "no signal log"),
        ([link(0)], {"J": SignalPhases("J", (), ())}, {}, "no signal log"),
        ([link(0)], phases("G", tls="other"), {}, "does not know them: J"),
        ([link(5)], phases("G"), {}, "too short"),
    ],
)
def test_without_signals_nothing_is_built_and_it_says_why(links, log, settings, why):
    signals = build([edge("in", 0.0), out()], links, log, **settings)
    assert (signals.static, signals.lamps, signals.heads) == ((), (), ())
    assert signals.radiance_at(0.0) == {}
    assert aspect_at(signals, "J", 0, 0.0) == set()
    assert why in signals.left_out[0].why


def test_a_light_without_states_is_left_out_and_the_others_stay():
    edges = [edge("in", 0.0), edge("other", 50.0), out()]
    signals = build(edges, [link(0), link(0, "other_0", tls="K")], phases("G"))
    assert {head.tls for head in signals.heads} == {"J"}
    (item,) = signals.left_out
    assert "1 traffic light" in item.what and item.surprising


def test_poles_reach_into_the_ground_and_heads_follow_the_road_up():
    signals = build([edge("in", 0.0, z=30.0), out()], [link(0)], phases("G"))
    pole = next(part.part.mesh for part in signals.static if "pole" in part.id)
    assert pole.vertices[:, 2].min() == pytest.approx(29.5)
    assert signals.heads[0].position[2] == pytest.approx(32.2)


def test_housings_stand_off_the_lanes():
    made = network([edge("in", 0.0), out()], [link(0)])
    signals = build_signals(made, phases("G"), SignalSettings())
    road = shapely.box(0, -1.6, 100, 1.6)
    for part in signals.static:
        spots = shapely.points(part.part.mesh.vertices[:, :2])
        assert not shapely.contains(road, spots).any()


def test_links_of_internal_lanes_and_empty_values():
    inner = edge(":B_0", 0.0, x=(100.0, 110.0), function="internal")
    signals = build([edge("in", 0.0), inner, out()], [link(0, ":B_0_0")], phases("G"))
    assert signals.heads == ()
    assert Signals().radiance_at(0.0) == {}


def digits(signals, time):
    """What the counters of all heads show, two characters a head."""
    from sumo3dviz_pt.library.street.traffic_light import BARS, SEGMENTS

    rows = signals.radiance_at(time)["signals"][sum(head.lamps for head in signals.heads) :]
    bars = rows.any(axis=1).reshape(-1, 7)
    signs = {frozenset(segments): sign for sign, segments in SEGMENTS.items()}
    shown = [signs[frozenset(b for b, lit in zip(BARS, row, strict=True) if lit)] for row in bars]
    return ["".join(shown[k : k + 2]) for k in range(0, len(shown), 2)]


@pytest.mark.parametrize(
    ("time", "shown"),
    [(0.0, "27"), (0.5, "27"), (1.0, "26"), (26.5, " 1"), (27.0, " 3"), (29.5, " 1"),
     (30.0, "30"), (59.9, " 1"), (60.0, "  "), (95.0, "  "), (-1.0, "  ")],
)  # fmt: skip
def test_counters_count_down_to_the_next_change(time, shown):
    """Green until 27 s (then interpolated yellow), red from 30 s, green from 60 s on."""
    log = {"J": SignalPhases("J", (0.0, 30.0, 60.0), ("G", "r", "G"))}
    signals = build([edge("in", 0.0), out()], [link(0)], log, design="countdown")
    assert digits(signals, time) == [shown]


def test_counters_shine_in_the_colour_of_their_lamp_and_people_have_none():
    signals = build_signals(
        crossing_network(), phases("rG", "Gr", "ry"), SignalSettings(design="countdown")
    )
    assert [head.counter for head in signals.heads] == [not head.walks for head in signals.heads]
    rows = signals.radiance_at(3.0)["signals"]
    assert len(rows) == len(signals.lamps[0].lamps) == 3 + 2 * 2 + 14
    lit = rows[7:][rows[7:].any(axis=1)]
    assert np.array_equal(lit, np.tile(RADIANCE["red"], (len(lit), 1)))
    assert len(set(signals.lamps[0].lamps)) == len(rows)


@pytest.mark.parametrize(("ground", "lift"), [(0.12, 0.12), (0.6, 0.6), (-0.2, 0.0), (6.0, 0.0)])
def test_heads_stand_as_high_as_people_do_but_not_on_bridges_above(ground, lift):
    made = network([edge("in", 0.0), out()], [link(0)])
    flat = build_signals(made, phases("G"), SignalSettings())
    raised = build_signals(
        made, phases("G"), SignalSettings(), standing=lambda places: np.full(len(places), ground)
    )
    assert raised.heads[0].position[2] - flat.heads[0].position[2] == pytest.approx(lift)


def test_poles_leave_the_asphalt_of_junctions_between_lanes_but_stand_on_walking_areas():
    made = network([edge("in", 0.0), out()], [link(0)])
    corners = np.array([(100, 1.6), (100, -1.6), (102, -9), (118, -9), (120, -1.6), (120, 1.6)])
    wide = Junction("B", "traffic_light", np.zeros(3), np.column_stack([corners, np.zeros(6)]))
    bare = replace(made, junctions={"B": wide})
    head, *_ = build_signals(bare, phases("G"), SignalSettings()).heads
    assert shapely.Polygon(corners).distance(shapely.Point(head.foot[:2])) >= 0.3
    shape = np.array([(100, -1.6, 0), (108, -1.6, 0), (108, -9, 0), (100, -9, 0)], dtype=float)
    walk = Edge(":B_w0", "walkingarea", "", "", (Lane("w", ":B_w0", 0, shape, 1, 1, 1, FOOT),))
    paved = replace(made, junctions={"B": wide}, edges={**made.edges, walk.id: walk})
    head, *_ = build_signals(paved, phases("G"), SignalSettings()).heads
    assert head.foot[:2] == pytest.approx([104.5, -2.3])


def test_no_head_of_a_row_hangs_over_a_road_beside_it():
    lanes = 4
    beside = edge("beside", -6.4, x=(60.0, 106.0))
    edges = [edge("in", 0.0, lanes=lanes), beside, out()]
    links = [link(k, f"in_{k}") for k in range(lanes)]
    letters = ("Grrr", "rGrr", "rrGr", "rrrG")
    signals = build(edges, links, phases(*letters))
    row = [head for head in signals.heads if not head.over_road]
    assert len(row) == lanes
    roads = build_lane_index(network(edges, links)).areas.geometries
    for head in row:
        assert shapely.distance(roads, shapely.Point(head.position[:2])).min() > 0.1


def test_far_heads_are_plainer_and_signals_are_dimmed_by_night():
    made = network([edge("in", 0.0), out()], [link(0)])
    counts = []
    for x in (100.0, 2000.0):
        around = surroundings(made, seed=1, viewpoints=np.array([[x, 0.0, 2.0]]))
        signals = build_signals(made, phases("G"), SignalSettings(), around=around)
        counts.append(sum(len(part.part.mesh.faces) for part in signals.static))
    assert counts[1] < counts[0] / 3
    night = build_signals(
        made, phases("G"), SignalSettings(), around=replace(around, dark=True)
    ).radiance_at(0.0)["signals"]
    assert 0.2 < night.max() / signals.radiance_at(0.0)["signals"].max() < 0.6


def test_lenses_have_the_candelas_that_en_12368_asks_for():
    """100 to 400 cd on the axis (performance level 1, class 1), lens by lens."""
    signals = build_signals(
        network([edge("in", 0.0), out()], [link(0)]), phases("G"), SignalSettings()
    )
    lamps, head = signals.lamps[0], signals.heads[0]
    axis = -np.array([np.cos(head.yaw), np.sin(head.yaw), 0.0])
    a, b, c = (lamps.mesh.vertices[lamps.mesh.faces[:, k]] for k in range(3))
    shown = np.maximum(0.5 * np.cross(b - a, c - a) @ axis, 0.0)
    area = np.bincount(lamps.lamp_of_face, shown)
    for index, name in enumerate(lamps.lamps[: head.lamps]):
        luminance = np.dot(RADIANCE[name.rsplit("/", 1)[-1]], [0.2126, 0.7152, 0.0722]) * 32_000
        assert 100.0 <= luminance * area[index] <= 400.0
        assert area[index] == pytest.approx(np.pi * 0.1**2, rel=0.05)


def test_little_of_a_signal_reaches_the_pavement_below_it():
    """By night a lens gives below a tenth of its candelas 40 degrees from its axis."""
    signals = build_signals(
        network([edge("in", 0.0), out()], [link(0)]), phases("G"), SignalSettings()
    )
    lobe = signals.lamps[0].lobe
    low, half, ten = lobe.at(np.cos(np.radians([40.0, 10.0, 5.0])))
    assert 0.02 < low < 0.1 < 0.4 < half < 0.7 < ten < 1.0


def test_people_on_foot_share_the_pole_of_a_road_and_no_two_heads_of_a_pole_look_alike():
    made = crossing_network()
    (lane,) = made.edges[":B_c0"].lanes
    near = replace(lane, shape=np.array([(105.0, -2.6, 0.0), (105.0, 8.0, 0.0)]))
    short = Edge(":B_c0", "crossing", "", "", (near,))
    made = replace(made, edges={**made.edges, ":B_c0": short})
    signals = build_signals(made, phases("rG", "Gr", "ry"), SignalSettings())
    poles = {}
    for head in signals.heads:
        poles.setdefault(tuple(np.round(head.foot, 3)), []).append(head)
    assert sorted([head.kind for head in group] for group in poles.values()) == [
        ["foot"],
        ["vehicle", "foot"],
    ]
    vehicle, foot = next(group for group in poles.values() if len(group) == 2)
    assert np.cos(vehicle.yaw - foot.yaw) < 0.65
    assert np.hypot(*(vehicle.position - foot.position)[:2]) > 0.2


def test_lenses_shine_as_the_standard_lets_them_and_alike():
    """EN 12368, performance level 1, class 1: 100 to 400 cd on the axis of a lens of 200 mm."""
    area = np.pi * 0.1**2 * CANDELAS_PER_UNIT
    candelas = {
        colour: float(np.array(light) @ LUMINANCE) * area for colour, light in RADIANCE.items()
    }
    assert len(candelas) == 3
    assert all(100.0 < axis < 400.0 for axis in candelas.values())
    assert max(candelas.values()) < 1.5 * min(candelas.values()), "one head, one brightness"


@pytest.mark.parametrize(("ahead", "told"), [(4.0, True), (12.0, False)])
def test_a_head_right_before_a_camera_stays_and_that_is_said(ahead, told):
    made = network([edge("in", 0.0), edge("out", 0.0, x=(110.0, 200.0))], [link(0)])
    head = build_signals(made, phases("G"), SignalSettings()).heads[0]
    eye = head.position + np.array([-ahead, 0.0, 0.5])
    way = CameraPath(eye[None], np.array([[1.0, 0.0, 0.0]]), np.array([0.6]))
    around = surroundings(made, seed=1, camera_path=way)
    far = replace(made, location=Location(origin=(7000.0, 0.0)))
    signals = build_signals(far, phases("G"), SignalSettings(), around=around)
    assert len(signals.heads) == 1
    why = [item.why for item in signals.left_out if "before a camera" in item.why]
    assert bool(why) == told
    x, y = np.add(head.position[:2], (7000.0, 0.0))
    assert all(f"the first at ({x:.0f}, {y:.0f})" in said for said in why), "where its file has it"


@pytest.mark.parametrize("settings", [{}, {"yellow": "log"}, {"design": "two_heads"}])
def test_lights_follow_another_log_as_if_they_were_built_for_it(settings):
    first, other = phases("rG", "Gr", "rG"), phases("Gr", "rG", "yG", step=7.0)
    wish = SignalSettings(**settings)
    built = build_signals(crossing_network(), other, wish)
    followed = build_signals(crossing_network(), first, wish).following(other, wish)
    for time in np.arange(0.0, 30.0, 0.5):
        own, those = (each.radiance_at(time)["signals"] for each in (followed, built))
        np.testing.assert_array_equal(own, those)
    silent = followed.following({}, wish)
    np.testing.assert_array_equal(
        silent.radiance_at(3.0)["signals"], followed.radiance_at(3.0)["signals"]
    )
