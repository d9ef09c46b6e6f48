"""The graph of lanes: lengths, neighbours, and the way that was driven."""

from dataclasses import replace

import numpy as np
import pytest
from drives import arc, corner, network_of, road, straight

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.motion.lanes import LaneGraph


def names_of(found):
    """Lanes of a way, `|` before those reached by a change of lanes."""
    way, _ = found
    return [f"|{hop.lane}" if hop.beside else hop.lane for hop in way.hops]


def with_length(network, name, length):
    """The network with another length of one lane [m], as SUMO writes it."""
    lane = network.lanes[name]
    edge = network.edges[lane.edge_id]
    lanes = tuple(replace(one, length=length) if one is lane else one for one in edge.lanes)
    edges = {**network.edges, edge.id: replace(edge, lanes=lanes)}
    return Network(edges, {}, network.connections, network.location)


def two_ways():
    """A fork whose straight branch is 100 m and whose detour is 260 m long."""
    shapes = {
        "a_0": [(0, 0), (50, 0)],
        "short_0": [(50, 0), (150, 0)],
        "long_0": [(50, 0), (50, 80), (150, 80), (150, 0)],
        "b_0": [(150, 0), (300, 0)],
    }
    links = [("a_0", "short_0", ""), ("a_0", "long_0", ""), ("short_0", "b_0", "")]
    return network_of(shapes, [*links, ("long_0", "b_0", "")])


# Lengths -----------------------------------------------------------------------------------


def test_lanes_inside_junctions_are_as_long_as_they_are_drawn():
    drawn = 4 * 2 * 6.0 * np.sin(np.radians(90 / 8))  # four chords of an arc
    graph = LaneGraph(with_length(corner(), ":j_0_0", 7.5))
    assert graph.stretch(":j_0_0") == pytest.approx(drawn / 7.5)
    assert graph.length(":j_0_0") == pytest.approx(drawn)
    assert graph.stations(":j_0_0")[-1] == pytest.approx(drawn)


def test_lanes_of_roads_keep_sumos_length():
    graph = LaneGraph(with_length(corner(), "a_0", 80.0))
    assert graph.stretch("a_0") == 1.0
    assert graph.length("a_0") == 80.0
    np.testing.assert_allclose(graph.stations("a_0"), [0.0, 80.0])


def test_stations_are_in_proportion_to_the_drawn_way():
    graph = LaneGraph(network_of({"a_0": [(0, 0), (30, 40), (30, 100)]}))
    np.testing.assert_allclose(graph.stations("a_0"), [0.0, 50.0, 110.0])


# Neighbours --------------------------------------------------------------------------------


def test_onward_and_before_go_through_the_junction():
    graph = LaneGraph(corner())
    assert graph.onward["a_0"] == (":j_0_0",)
    assert graph.onward[":j_0_0"] == ("b_0",)
    assert graph.before["b_0"] == (":j_0_0",)
    assert graph.before[":j_0_0"] == ("a_0",)
    assert "b_0" not in graph.onward and "a_0" not in graph.before


def test_internal_lanes_without_connections_of_their_own_lead_on():
    network = corner()
    without = tuple(c for c in network.connections if c.from_lane != ":j_0_0")
    assert len(without) < len(network.connections)
    assert LaneGraph(replace(network, connections=without)).onward[":j_0_0"] == ("b_0",)


def test_lanes_that_are_not_there_are_not_led_to():
    network = network_of({"a_0": [(0, 0), (9, 0)]}, [("a_0", "gone_0", "")])
    assert LaneGraph(network).onward["a_0"] == ()


def test_beside_are_the_next_lanes_on_the_edge():
    graph = LaneGraph(straight(lanes=3))
    assert graph.beside("a_0") == ("a_1",)
    assert set(graph.beside("a_1")) == {"a_0", "a_2"}
    assert graph.beside("a_2") == ("a_1",)
    assert "a_2" in graph and "a_3" not in graph
    assert LaneGraph(corner()).inside(":j_0_0") and not graph.inside("a_0")


# Routes ------------------------------------------------------------------------------------


def test_through_a_junction():
    network, way = road("corner")
    found = LaneGraph(network).between("a_0", "b_0", places=(95.0, 5.0), expected=20.0)
    assert names_of(found) == ["a_0", ":j_0_0", "b_0"]
    inside = way.starts[2] - way.starts[1]
    assert found[0].length == pytest.approx(100.0 + inside)
    assert found[1] == pytest.approx(5.0 + inside + 5.0)


@pytest.mark.parametrize("last", ["r1_0", "r2_0", "out_0"])
def test_round_a_roundabout(last):
    network, way = road("roundabout")
    place = way.names.index(last)
    found = LaneGraph(network).between("in_0", last, places=(90.0, 3.0), expected=20.0)
    assert names_of(found) == list(way.names[: place + 1])
    assert found[1] == pytest.approx(way.starts[place] + 3.0 - 90.0)


def test_over_a_change_of_lanes():
    found = LaneGraph(straight()).between("a_0", "a_1", places=(100.0, 125.0), expected=25.0)
    assert names_of(found) == ["a_0", "|a_1"]
    assert found[0].length == 0.0
    assert found[1] == pytest.approx(25.0)


def test_over_two_changes_of_lanes_and_back():
    graph = LaneGraph(straight(lanes=3))
    found = graph.between("a_0", "a_2", places=(10.0, 30.0), expected=20.0)
    assert names_of(found) == ["a_0", "|a_1", "|a_2"]
    found = graph.between("a_2", "a_0", places=(10.0, 30.0), expected=20.0)
    assert names_of(found) == ["a_2", "|a_1", "|a_0"]


def test_over_a_change_of_lanes_and_a_junction():
    shapes = {
        "a_0": [(0, 0), (100, 0)],
        "a_1": [(0, 3.2), (100, 3.2)],
        ":j_0_0": [(100, 3.2), (110, 3.2)],
        "b_0": [(110, 3.2), (200, 3.2)],
    }
    graph = LaneGraph(network_of(shapes, [("a_1", "b_0", ":j_0_0")]))
    found = graph.between("a_0", "b_0", places=(95.0, 2.0), expected=17.0)
    assert names_of(found) == ["a_0", "|a_1", ":j_0_0", "b_0"]
    assert found[1] == pytest.approx(17.0)


@pytest.mark.parametrize(
    ("expected", "branch", "length"), [(100.0, "short_0", 100.0), (260.0, "long_0", 260.0)]
)
def test_of_two_ways_the_one_that_the_speeds_tell(expected, branch, length):
    found = LaneGraph(two_ways()).between(
        "a_0", "b_0", places=(45.0, 5.0), expected=expected + 10.0
    )
    assert names_of(found) == ["a_0", branch, "b_0"]
    assert found[1] == pytest.approx(length + 10.0)


@pytest.mark.parametrize(("first", "last"), [("b_0", "a_0"), ("a_0", "alone_0")])
def test_where_no_lane_leads_there_is_no_route(first, last):
    shapes = {"a_0": [(0, 0), (9, 0)], "b_0": [(9, 0), (90, 0)], "alone_0": [(0, 50), (90, 50)]}
    graph = LaneGraph(network_of(shapes, [("a_0", "b_0", "")]))
    assert graph.between(first, last, places=(1.0, 1.0), expected=9.0) is None


def test_far_beyond_what_was_driven_nothing_is_looked_for():
    shapes = {f"r{k}_0": [(100.0 * k, 0), (100.0 * k + 100, 0)] for k in range(40)}
    graph = LaneGraph(network_of(shapes, [(f"r{k}_0", f"r{k + 1}_0", "") for k in range(39)]))
    assert graph.between("r0_0", "r39_0", places=(50.0, 50.0), expected=14.0) is None
    found = graph.between("r0_0", "r39_0", places=(50.0, 50.0), expected=3900.0)
    assert found is not None and found[1] == pytest.approx(3900.0)


def test_twice_round_if_the_speeds_tell_so():
    shapes = {
        "in_0": [(20, -90), (20, 0)],
        "x_0": arc((0, 0), 20.0, 0, 180, 30),
        "y_0": arc((0, 0), 20.0, 180, 360, 30),
        "out_0": [(-20, 0), (-20, -90)],
    }
    links = [("in_0", "x_0", ""), ("x_0", "y_0", ""), ("y_0", "x_0", ""), ("x_0", "out_0", "")]
    graph = LaneGraph(network_of(shapes, links))
    around = graph.length("x_0") + graph.length("y_0")
    once = graph.between("in_0", "out_0", places=(88.0, 10.0), expected=74.0)
    twice = graph.between("in_0", "out_0", places=(88.0, 10.0), expected=74.0 + around)
    assert names_of(once) == ["in_0", "x_0", "out_0"]
    assert names_of(twice) == ["in_0", "x_0", "y_0", "x_0", "out_0"]
    assert twice[1] - once[1] == pytest.approx(around)


def test_beside_inside_a_junction_the_share_of_the_lane_is_kept():
    # Of two lanes round a bend the outer one is longer; a tenth of one is a tenth of the other.
    shapes = {
        ":j_0_0": arc((0, 0), 20.0, -90, 0, 40),
        ":j_0_1": arc((0, 0), 10.0, -90, 0, 40),
        "b_1": [(10, 0), (10, 100)],
    }
    graph = LaneGraph(network_of(shapes, [(":j_0_1", "b_1", "")]))
    outer, inner = graph.length(":j_0_0"), graph.length(":j_0_1")
    found = graph.between(":j_0_0", "b_1", places=(outer / 4.0, 2.0), expected=14.0)
    assert names_of(found) == [":j_0_0", "|:j_0_1", "b_1"]
    assert found[1] == pytest.approx(0.75 * inner + 2.0)
