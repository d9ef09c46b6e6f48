"""Markings of national styles: words, give-way lines, crossings, colours."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.street.road_styles import STYLES
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.roads.markings.lines import SideColours, edge_paint
from sumo3dviz_pt.world.roads.markings.markings import road_paint
from sumo3dviz_pt.world.roads.markings.symbols import (
    is_bus_lane,
    stop_paint,
    word_paint,
    zebra_paint,
)
from sumo3dviz_pt.world.roads.strips import edge_strips

CAR, BUS = frozenset({"passenger", "bus"}), frozenset({"bus", "taxi"})
WALK, CYCLE = frozenset({"pedestrian"}), frozenset({"bicycle"})


def lane(edge, index, y, allowed=CAR, *, length=100.0, width=3.2) -> Lane:
    shape = np.array([(0.0, y, 0.0), (length, y, 0.0)])
    return Lane(f"{edge}_{index}", edge, index, shape, width, 13.9, length, allowed)


def network(lanes, *, kind="priority", connections=(), left=False, more=()) -> Network:
    edges = {"e": Edge("e", "normal", "a", "b", tuple(lanes)), **{e.id: e for e in more}}
    junction = Junction("b", kind, np.array([100.0, 0, 0]), np.zeros((0, 3)))
    return Network(edges, {"b": junction}, tuple(connections), Location(), left)


def strips_of(net, style="auto"):
    return layout_roads(net, RoadSettings(marking_style=style)).strips


@pytest.mark.parametrize("name", sorted(STYLES))
def test_bus_lanes_carry_their_word_within_the_lane(name):
    net = network([lane("e", 0, 0, BUS), lane("e", 1, 3.2)])
    words = word_paint(strips_of(net), STYLES[name].bus_lane)
    assert words
    across = np.concatenate([paint.quads[..., 1].ravel() for paint in words])
    assert np.abs(across).max() < 1.6
    along = np.concatenate([paint.quads[..., 0].ravel() for paint in words])
    assert 0.0 < along.min() < along.max() < 100.0


def test_letters_are_upright_for_drivers_of_the_lane():
    net = network([lane("e", 0, 0, BUS)])
    (word,) = word_paint(strips_of(net), STYLES["european"].bus_lane)[:1]
    # B begins at the driver's left, S ends at the right: more paint of B's stem at the left.
    stem = word.quads[(word.quads[..., 1] > 0.8).all(axis=1)]
    assert np.ptp(stem[..., 0]) > 3.0
    assert word.quads[..., 0].max() - word.quads[..., 0].min() == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize(
    ("allowed", "expected"),
    [(BUS, True), (CAR, False), (CYCLE, False), (WALK, False), (frozenset({"tram"}), False)],
)
def test_bus_lanes_are_those_that_cars_may_not_use(allowed, expected):
    assert is_bus_lane(lane("e", 0, 0, allowed)) is expected


@pytest.mark.parametrize(("name", "narrows"), [("european", 1), ("american", 0), ("british", 1)])
def test_give_way_lines_have_the_shape_of_the_style(name, narrows):
    ways = [Connection("e_0", "f_0", "", "", -1, "r", "m")]
    other = Edge("f", "normal", "b", "c", (lane("f", 0, 30),))
    net = network([lane("e", 0, 0)], connections=ways, more=[other])
    quads = next(p.quads for p in stop_paint(net, strips_of(net), STYLES[name]) if p.owner == "e")
    style = STYLES[name].give_way
    near = np.linalg.norm(quads[:, 0] - quads[:, 3], axis=1)
    far = np.linalg.norm(quads[:, 1] - quads[:, 2], axis=1)
    assert far == pytest.approx(style.width)
    assert near == pytest.approx(narrows * style.width, abs=1e-9)
    polygons = shapely.polygons(quads[..., :2])
    assert np.abs(shapely.bounds(polygons)[:, [1, 3]]).max() <= 1.6
    rows = len(np.unique(quads[..., 0].max(axis=1).round(3)))
    assert rows == (2 if style.shape == "two_lines" else 1)


@pytest.mark.parametrize(
    ("state", "tls", "line"),
    [("m", "", "dashes"), ("s", "", "whole"), ("w", "", "whole"), ("=", "", None), ("M", "", None)],
)
def test_stop_and_give_way_lines_follow_the_junctions_logic(state, tls, line):
    ways = [Connection("e_0", "f_0", "", tls, -1, "r", state)]
    other = Edge("f", "normal", "b", "c", (lane("f", 0, 30),))
    net = network([lane("e", 0, 0)], connections=ways, more=[other])
    own = [p for p in stop_paint(net, strips_of(net), STYLES["european"]) if p.owner == "e"]
    assert (len(own[0].quads) if own else 0) == {None: 0, "whole": 1, "dashes": 3}[line]


def crossing(kind="traffic_light", tls="b") -> Network:
    area = Lane(":b_c0_0", ":b_c0", 0, np.array([(101.0, -8, 0), (101, 8, 0)]), 4, 1, 16, WALK)
    walk = Edge(":b_c0", "crossing", "", "", (area,), crossed_edges=("e",))
    ways = [Connection(":b_w0_0", ":b_c0_0", "", tls, 0, "s", "M")]
    return network([lane("e", 0, 0)], kind=kind, connections=ways, more=[walk])


@pytest.mark.parametrize(
    ("name", "signalled", "plain"), [("european", 15, 15), ("american", 2, 13), ("british", 64, 13)]
)
def test_crossings_are_painted_as_the_style_says(name, signalled, plain):
    counts = [
        sum(len(p.quads) for p in zebra_paint(net, STYLES[name].crossing, region=None))
        for net in (crossing(), crossing("priority", ""))
    ]
    assert counts == [pytest.approx(signalled, abs=2), pytest.approx(plain, abs=1)]


def test_nothing_is_painted_for_people_at_level_crossings():
    net = crossing("rail_crossing")
    assert zebra_paint(net, STYLES["european"].crossing, region=None) == []


def test_nothing_is_painted_for_people_over_tracks_of_trams():
    net = crossing()
    track = Edge("e", "normal", "a", "b", (lane("e", 0, 0, frozenset({"tram"})),))
    rails = replace(net, edges={**net.edges, "e": track})
    assert zebra_paint(rails, STYLES["european"].crossing, region=None) == []
    assert zebra_paint(net, STYLES["european"].crossing, region=None)


def test_lines_do_not_cross_where_a_turn_lane_begins():
    straight = Lane(":b_0_0", ":b_0", 0, np.array([(100.0, 0, 0), (114, 0, 0)]), 3.2, 13.9, 14, CAR)
    bent = np.array([(100.0, 0, 0), (104, 0.6, 0), (110, 2.8, 0), (114, 3.2, 0)])
    turn = Lane(":b_0_1", ":b_0", 1, bent, 3.2, 13.9, 14, CAR)
    strips = edge_strips(Edge(":b_0", "internal", "", "", (straight, turn)), RoadSettings())
    sides = SideColours("line_white", "line_white")
    edge = Edge(":b_0", "internal", "", "", (straight, turn))
    paint = edge_paint(edge, strips, RoadSettings(), sides=sides)
    middles = np.concatenate([p.quads for p in paint]).mean(axis=1)[:, :2]
    # Nothing lies inside the new lane but near its borders.
    inner = strips[1].polygon.buffer(-0.4)
    assert not shapely.intersects_xy(inner, middles).any()
    lines = shapely.polygons(np.concatenate([p.quads for p in paint])[..., :2])
    assert all(not a.crosses(b) and not a.overlaps(b) for a, b in combinations(lines, 2))


@pytest.mark.parametrize("left", [False, True])
def test_american_lines_are_yellow_on_the_side_of_oncoming_traffic(left):
    net = network([lane("e", 0, 0), lane("e", 1, -3.2 if left else 3.2)], left=left)
    settings = RoadSettings(marking_style="american")
    paint = road_paint(net, settings, layout_roads(net, settings), region=None)
    middle = -1.6 if left else 1.6
    yellow = np.concatenate([p.quads[..., 1].ravel() for p in paint if p.material == "line_yellow"])
    assert (np.sign(yellow - middle) == np.sign(middle)).all()
    plain = RoadSettings(marking_style="european")
    white = road_paint(net, plain, layout_roads(net, plain), region=None)
    assert {p.material for p in white} == {"line_white"}


@pytest.mark.parametrize(("name", "surface"), [("auto", "bicycle"), ("american", "bicycle_green")])
def test_bicycle_lanes_have_the_colour_of_the_style(name, surface):
    net = network([lane("e", 0, 0, CYCLE, width=1.6), lane("e", 1, 2.4)])
    assert strips_of(net, name)["e"][0].look.surface == surface


@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize(
    ("up", "down", "share"),
    [
        # Who may go from the outer to the inner lane, back, and how much of each line is painted.
        (None, None, (0.5,)),
        (frozenset(), frozenset(), (1.0,)),
        (frozenset({"bus"}), None, (1.0, 0.5)),
        (None, frozenset({"emergency"}), (0.5, 1.0)),
        (frozenset({"passenger"}), None, (0.5,)),
    ],
)
def test_lines_are_solid_for_who_may_not_change_lanes(up, down, share, left):
    side = -1.0 if left else 1.0
    outer, inner = lane("e", 0, 0), lane("e", 1, 3.2 * side)
    net = network([replace(outer, up=up), replace(inner, down=down)], left=left)
    strips = strips_of(net)["e"]
    sides = SideColours.of(STYLES["european"], left_hand=left)
    paint = edge_paint(net.edges["e"], strips, RoadSettings(), sides=sides)
    quads = np.concatenate([one.quads for one in paint])
    across = quads[..., 1].mean(axis=1) * side
    lines = quads[np.abs(across - 1.6) < 0.4]
    middles = lines[..., 1].mean(axis=1) * side
    painted = np.ptp(lines[..., 0], axis=1)
    found = [
        painted[np.abs(middles - at) < 0.01].sum() / 100.0 for at in np.unique(middles.round(3))
    ]
    assert found == pytest.approx(share, abs=0.02)
