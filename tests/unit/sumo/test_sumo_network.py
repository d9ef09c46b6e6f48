"""The road network reader."""

import gzip

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.sumo.types import ALL_CLASSES, allowed_classes

NET = """<net version="1.20" lefthand="true">
<location netOffset="-10.5,20" convBoundary="0,0,100,50" origBoundary="9,50,10,51"
 projParameter="+proj=utm +zone=32"/>
<edge id=":j_0" function="internal">
 <lane id=":j_0_0" index="0" speed="5" length="0.1" shape="100,0 100,0"/></edge>
<edge id=":j_c0" function="crossing" crossingEdges="a b">
 <lane id=":j_c0_0" index="0" allow="pedestrian" width="4" speed="1" shape="1,1 1,9"
  outlineShape="0,1 2,1 2,9 0,9"/></edge>
<edge id=":j_w0" function="walkingarea">
 <lane id=":j_w0_0" index="0" allow="pedestrian" width="2" speed="1" shape="0,0 2,0 2,2"/></edge>
<edge id="a" from="i" to="j" priority="7" type="highway.primary">
 <lane id="a_1" index="1" disallow="tram pedestrian" speed="13.9" length="101" width="3.5"
  shape="0,3,1 50,3,1 50,3,1 100,3,4"/>
 <lane id="a_0" index="0" disallow="all" speed="13.9" shape="0,0 100,0" width="-1"/></edge>
<edge id="b" from="j" to="k">
 <lane id="b_0" index="0" speed="13.9" shape="104,0 200,0"/></edge>
<junction id="j" type="traffic_light" x="100" y="0" z="4" incLanes="a_0 a_1"
 shape="100,-2,4 100,5,4 104,0,4"/>
<junction id="k" type="dead_end" x="0" y="0" shape=""/>
<connection from="a" to="b" fromLane="1" toLane="0" via=":j_0_0" tl="t" linkIndex="3"
 dir="l" state="o"/>
<connection from=":j_w0" to=":j_c0" fromLane="0" toLane="0" dir="s" state="M"/>
</net>"""


def read(tmp_path, text=NET):
    path = tmp_path / "n.net.xml"
    path.write_text(text, encoding="utf-8")
    return read_network(path)


def test_reads_all_kinds_of_edges(tmp_path):
    network = read(tmp_path)
    assert {e.id: e.function for e in network.edges.values()} == {
        ":j_0": "internal",
        ":j_c0": "crossing",
        ":j_w0": "walkingarea",
        "a": "normal",
        "b": "normal",
    }
    edge = network.edges["a"]
    assert (edge.from_junction, edge.to_junction, edge.priority) == ("i", "j", 7)
    assert edge.type == "highway.primary"
    assert [lane.id for lane in edge.lanes] == ["a_0", "a_1"]
    assert network.edges[":j_c0"].crossed_edges == ("a", "b")
    assert network.left_hand


def test_lane_values(tmp_path):
    lanes = read(tmp_path).lanes
    lane = lanes["a_1"]
    np.testing.assert_array_equal(lane.shape, [[0, 3, 1], [50, 3, 1], [100, 3, 4]])
    assert (lane.width, lane.speed, lane.length, lane.index) == (3.5, 13.9, 101, 1)
    assert lane.allowed == ALL_CLASSES - {"tram", "pedestrian"}
    assert lane.edge_id == "a"
    assert not lane.shape.flags.writeable
    assert lanes["a_0"].allowed == frozenset()
    assert lanes["a_0"].width == 3.2
    assert lanes["a_0"].length == pytest.approx(100)
    assert lanes[":j_c0_0"].allowed == {"pedestrian"}
    assert lanes[":j_c0_0"].outline.shape == (4, 3)
    assert lanes[":j_w0_0"].outline is None


def test_single_point_lane_keeps_a_direction(tmp_path):
    shape = read(tmp_path).lanes[":j_0_0"].shape
    assert shape.shape == (2, 3)
    assert 0 < np.linalg.norm(shape[1] - shape[0]) < 0.05


@pytest.mark.parametrize("shape", ["100,3,0 100,3,5 100,3,9", "100,3,0 100.0000001,3,9"])
def test_a_lane_straight_up_keeps_a_direction_and_its_ends(tmp_path, shape):
    old = "0,3,1 50,3,1 50,3,1 100,3,4"
    line = read(tmp_path, NET.replace(old, shape)).lanes["a_1"].shape
    assert 0.005 < np.hypot(*(line[-1] - line[0])[:2]) < 0.05
    assert line[[0, -1], 2].tolist() == [0.0, 9.0]


def test_junctions_connections_location(tmp_path):
    network = read(tmp_path)
    junction = network.junctions["j"]
    assert junction.type == "traffic_light"
    np.testing.assert_array_equal(junction.position, [100, 0, 4])
    assert junction.outline.shape == (3, 3)
    assert junction.incoming_lanes == ("a_0", "a_1")
    assert network.junctions["k"].outline.shape == (0, 3)
    first, second = network.connections
    assert (first.from_lane, first.to_lane, first.via) == ("a_1", "b_0", ":j_0_0")
    assert (first.tls, first.link_index, first.direction, first.state) == ("t", 3, "l", "o")
    assert (second.tls, second.link_index, second.via) == ("", -1, "")
    assert network.location.net_offset == (-10.5, 20)
    assert network.location.boundary == (0, 0, 100, 50)
    assert network.location.projection.startswith("+proj")


def test_gzipped_and_without_location(tmp_path):
    path = tmp_path / "n.xml"
    text = '<net><edge id="a"><lane id="a_0" index="0" shape="0,0 1,0"/></edge></net>'
    path.write_bytes(gzip.compress(text.encode()))
    network = read_network(path)
    assert network.location.projection == "!"
    assert not network.left_hand
    assert network.lanes["a_0"].allowed == ALL_CLASSES


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('shape="1,1 1,9"', 'shape="1,1 1,x"', "must hold points"),
        ('width="4"', 'width="nan"', "finite"),
        ('x="0" y="0" shape=""', 'shape=""', "missing"),
        ('id="a_1"', "", '"id" is missing'),
        ("-10.5,20", "-10.5", "2 numbers"),
        ("0,0,100,50", "0,0,100,y", "4 numbers"),
        ('fromLane="1"', "", "missing"),
    ],
)
def test_damage_is_named_with_line(tmp_path, old, new, words):
    assert old in NET
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, NET.replace(old, new, 1))
    assert caught.value.line is not None


def test_no_lane_and_wrong_file(tmp_path):
    with pytest.raises(InputError, match="no lane"):
        read(tmp_path, "<net/>")
    with pytest.raises(InputError, match="not a SUMO network"):
        read(tmp_path, "<routes/>")


@pytest.mark.parametrize(
    ("allow", "disallow", "expected"),
    [
        ("", "", ALL_CLASSES),
        ("all", "", ALL_CLASSES),
        ("bus taxi", "", {"bus", "taxi"}),
        ("bus|taxi", "", {"bus", "taxi"}),
        ("lightrail spaceship", "", {"tram"}),
        ("bus", "all", {"bus"}),
        ("", "all", frozenset()),
        ("", "bus", ALL_CLASSES - {"bus"}),
    ],
)
def test_permissions(allow, disallow, expected):
    assert allowed_classes(allow, disallow) == expected
