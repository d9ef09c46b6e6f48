"""Networks with odd geometry or of any version are built, and one note says what is odd."""

import logging
import re

import numpy as np
import pytest
from damage import NETWORK, write_town

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.sumo import read_network

EAST = 'shape="5.00,-1.60,0.00 60.00,-1.60,0.50 120.00,-1.60,1.00"'
MIDDLE = 'shape="-5.00,0.00 5.00,0.00 5.00,-3.20 3.20,-6.00 0.00,-6.00 -5.00,-5.20"'
WALKING = 'shape="6.00,3.20 10.00,3.20 10.00,5.20 6.00,5.20"'
TURN = 'shape="-5.00,-1.60 0.00,-3.00 1.60,-6.00"'
CROSSING = 'shape="8.00,3.20 8.00,-3.20"'
SOUTH = 'length="54.00" width="3.20"'


def extra(lane):
    """One more edge, from `c` to `a`, apart from all others."""
    return "<tlLogic", f'<edge id="x" from="c" to="a">{lane}</edge><tlLogic'


ODD = {
    # kind: text of the network, what stands there instead, what the note says
    "a lane of 5 cm": (
        *extra('<lane id="x_0" length="0.05" shape="30,30 30.05,30"/>'),
        r"1 lane shorter than 10 cm, left as given \(first: `x_0`\)",
    ),
    "a lane of no length": (
        *extra('<lane id="x_0" length="0.10" shape="30,30 30,30"/>'),
        r"1 lane shorter than 10 cm, left as given \(first: `x_0`\)",
    ),
    "a lane that only rises": (
        *extra('<lane id="x_0" length="5" shape="30,30,0 30,30,5"/>'),
        r"1 lane shorter than 10 cm, left as given \(first: `x_0`\)",
    ),
    "two lanes of 5 cm": (
        *extra(
            '<lane id="x_0" shape="30,30 30.05,30"/><lane id="x_1" shape="30,33.2 30.05,33.2"/>'
        ),
        r"2 lanes shorter than 10 cm, left as given \(first: `x_0`\)",
    ),
    "a crossing of one point": (CROSSING, 'shape="8,3.2"', r"shorter than 10 cm.*`:m_c0_0`"),
    "a lane 5 cm wide": (SOUTH, 'length="54.00" width="0.05"', r"narrower than 10 cm, left.*`s_0`"),
    "a lane of width 0": (SOUTH, 'length="54" width="0"', r"without a width, drawn 3\.2 m.*`s_0`"),
    "a lane of length 0": (SOUTH, 'length="0"', r"without a length above 0, measured.*`s_0`"),
    "a lane without a shape": (EAST, "", r"1 lane without a shape, drawn straight.*`e_0`"),
    "a turn without a shape": (TURN, "", r"1 lane without a shape, drawn straight.*`:m_1_0`"),
    "a crossing without a shape": (CROSSING, 'shape=""', r"without a shape.*`:m_c0_0`"),
    "a lane with a spike": (
        EAST,
        'shape="5,-1.6 60,-1.6 60,40 60,-1.6 120,-1.6"',
        r"1 lane that doubles back on itself, drawn as given \(first: `e_0`\)",
    ),
    "an edge without lanes": (*extra(""), r"1 edge without lanes, left out \(first: `x`\)"),
    "a junction without a place": (
        'x="0.00" y="0.00" incLanes',
        "incLanes",
        r"1 junction without a place, put into its shape \(first: `m`\)",
    ),
    "a junction without a shape": (MIDDLE, "", r"1 junction without an outline.*`m`"),
    "a junction of two points": (MIDDLE, 'shape="-5,0 5,0"', r"without an outline.*`m`"),
    "a junction like a bow tie": (
        MIDDLE,
        'shape="-5,0 5,-5.2 5,0 -5,-5.2"',
        r"1 junction whose outline crosses itself, all that the lines enclose is drawn.*`m`",
    ),
    "a walking area like a bow tie": (
        WALKING,
        'shape="6,3.2 10,5.2 10,3.2 6,5.2"',
        r"1 walking area whose outline crosses itself.*`:m_w0_0`",
    ),
    "a walking area of two points": (
        WALKING,
        'shape="6,3.2 10,3.2"',
        r"1 walking area of fewer than 3 points, not drawn \(first: `:m_w0_0`\)",
    ),
    "a walking area without a shape": (WALKING, "", r"1 walking area of fewer than 3 points"),
}

PLAIN = {
    # kind: text of the network, what stands there instead; nothing is said
    "the town itself": ("<net", "<net"),
    "repeated points": (EAST, 'shape="5,-1.6 5,-1.6 60,-1.6 60.00001,-1.6 120,-1.6 120,-1.6"'),
    "repeated corners": (
        MIDDLE,
        'shape="-5,0 -5,0 5,0 5,-3.2 5,-3.2 3.2,-6 0,-6 -5,-5.2 -5,-5.2 -5,0"',
    ),
    "a junction with a spike": (
        MIDDLE,
        'shape="-5,0 5,0 5,-3.2 40,-30 5,-3.2 3.2,-6 0,-6 -5,-5.2"',
    ),
    "a junction without any ground": (MIDDLE, 'shape="-5,0 0,0 5,0 0,0"'),
    "a turn of one point": (TURN, 'shape="0,-3 0,-3"'),
    "roads apart": extra('<lane id="x_0" length="40" shape="30,300 70,300"/>'),
    "a usual width": (SOUTH, 'length="54" width="-1"'),
}


def odd_town(folder, old, new):
    """The town with a changed network; returns its scene file."""
    assert old in NETWORK
    scene = write_town(folder)
    (folder / "net.net.xml").write_text(NETWORK.replace(old, new, 1), encoding="utf-8")
    return scene


def notes(caplog):
    """What is said of the network."""
    return [
        record.getMessage() for record in caplog.records if "net.net.xml" in record.getMessage()
    ]


def built(scene):
    """All vertices of what stands in a still's world, (n, 3) [m]."""
    production = prepare(load_job(scene), Request(camera="post"), np.array([4.0]))
    return np.concatenate([each.part.mesh.vertices for each in production.shot.data.static])


@pytest.mark.parametrize("kind", ODD)
def test_odd_geometry_is_read_and_said_once(kind, tmp_path, caplog):
    old, new, words = ODD[kind]
    with caplog.at_level(logging.WARNING, "sumo3dviz_pt"):
        network = read(tmp_path, old, new)
    (said,) = caplog.messages
    assert re.search(words, said)
    assert all(len(lane.shape) > 1 and lane.length > 0 for lane in network.lanes.values())


@pytest.mark.parametrize("kind", PLAIN)
def test_habits_of_netconvert_are_read_without_a_word(kind, tmp_path, caplog):
    with caplog.at_level(logging.WARNING, "sumo3dviz_pt"):
        read(tmp_path, *PLAIN[kind])
    assert not caplog.messages


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*ODD, *PLAIN])
def test_odd_geometry_is_built(kind, tmp_path, caplog):
    old, new = (ODD | PLAIN)[kind][:2]
    scene = odd_town(tmp_path, old, new)
    with caplog.at_level(logging.WARNING, "sumo3dviz_pt"):
        assert np.isfinite(built(scene)).all()
    # Whatever is made of the network, the note is not repeated.
    assert len(notes(caplog)) == (kind in ODD)


TOGETHER = (
    *("two lanes of 5 cm", "a lane 5 cm wide", "a lane with a spike", "a turn without a shape"),
    *("a junction like a bow tie", "a walking area like a bow tie", "a crossing without a shape"),
)


def test_all_of_it_together_is_built(tmp_path, caplog):
    scene, text = write_town(tmp_path), NETWORK
    for kind in TOGETHER:
        text = text.replace(*ODD[kind][:2], 1)
    (tmp_path / "net.net.xml").write_text(text, encoding="utf-8")
    with caplog.at_level(logging.WARNING, "sumo3dviz_pt"):
        assert np.isfinite(built(scene)).all()
    assert len(notes(caplog)) == 1


def read(folder, old="", new=""):
    odd_town(folder, old, new)
    return read_network(folder / "net.net.xml")


def test_several_oddities_are_one_note(tmp_path, caplog):
    write_town(tmp_path)
    text = NETWORK.replace(SOUTH, 'length="0" width="0"').replace(WALKING, "")
    (tmp_path / "net.net.xml").write_text(text, encoding="utf-8")
    with caplog.at_level(logging.WARNING, "sumo3dviz_pt"):
        read_network(tmp_path / "net.net.xml")
    (said,) = caplog.messages
    assert "without a width" in said and "without a length" in said and "walking area" in said
    assert caplog.records[0].once == f"oddities of {tmp_path / 'net.net.xml'}"


def test_lanes_without_a_shape_lie_between_their_junctions(tmp_path):
    lane = read(tmp_path, EAST, "").lanes["e_0"]
    assert np.allclose(lane.shape, [[0.0, -1.6, 0.0], [120.0, -1.6, 1.0]])


def test_lanes_without_a_shape_lie_on_the_side_that_traffic_keeps(tmp_path):
    text = NETWORK.replace(EAST, "").replace('lefthand="false"', 'lefthand="true"')
    (tmp_path / "left.net.xml").write_text(text, encoding="utf-8")
    lane = read_network(tmp_path / "left.net.xml").lanes["e_0"]
    assert np.allclose(lane.shape[:, 1], 1.6)


def test_inner_lanes_leave_room_for_outer_ones(tmp_path):
    lanes = '<lane id="x_0" index="0" width="2"/><lane id="x_1" index="1" width="3"/>'
    lanes = read(tmp_path, *extra(lanes)).edges["x"].lanes
    start = np.array([0.0, -60.0])
    offsets = [np.linalg.norm(lane.shape[0, :2] - start) for lane in lanes]
    assert offsets == pytest.approx([4.0, 1.5])
    assert lanes[0].length == pytest.approx(np.hypot(120.0, 60.0))


def test_turns_without_a_shape_join_their_lanes(tmp_path):
    lane = read(tmp_path, TURN, "").lanes[":m_1_0"]
    assert np.allclose(lane.shape[:, :2], [[-5.0, -1.6], [1.6, -6.0]])


def test_a_lane_of_which_nothing_tells_the_place_is_refused(tmp_path):
    nowhere = '<edge id="x"><lane id="x_0"/></edge><tlLogic'
    with pytest.raises(InputError, match='edge "x": the edge has a lane without a shape') as caught:
        read(tmp_path, "<tlLogic", nowhere)
    assert caught.value.line is not None


def test_a_lane_of_length_0_has_that_of_its_shape(tmp_path):
    assert read(tmp_path, SOUTH, 'length="-3"').lanes["s_0"].length == pytest.approx(54.0)


# Versions ----------------------------------------------------------------------------------

OLD = """<net version="0.27">
<location netOffset="0.00,0.00" convBoundary="0,0,100,0" origBoundary="0,0,100,0"
 projParameter="!"/>
<edge id="a" from="i" to="j" priority="-1">
<lane id="a_0" index="0" allow="public_transport taxi" speed="13.90" length="100.00"
 shape="0.00,-1.65 100.00,-1.65"/></edge>
<junction id="i" type="unregulated" x="0.00" y="0.00" incLanes="" intLanes="" shape=""/>
<junction id="j" type="unregulated" x="100.00" y="0.00" incLanes="a_0" intLanes=""
 shape="100,0 100,-3.3"/>
</net>"""
"""As SUMO 0.27 wrote: no widths, no function, classes of old names."""

NEW = """<net version="1.20" junctionCornerDetail="5" limitTurnSpeed="5.50" avoidOverlap="0"
 spreadType="roadCenter" geometryBidiOverlap="1">
<location netOffset="0.00,0.00" convBoundary="0,0,100,0" origBoundary="0,0,100,0"
 projParameter="!"/>
<type id="t" priority="1"><restriction vClass="bus" speed="5"/></type>
<edge id="a" from="i" to="j" priority="1" type="t" bidi="" distance="3" routingType="x">
<param key="k" value="v"/><stopOffset value="2" vClasses="bus"/>
<lane id="a_0" index="0" allow="bus drone tomorrow" changeLeft="bus" changeRight="" friction="0.9"
 acceleration="0" type="asphalt" customShape="1" speed="13.90" length="100.00"
 shape="0.00,-1.60 100.00,-1.60"><neigh lane="a_0"/><stopOffset value="1"/>
<param key="origId" value="1"/></lane></edge>
<junction id="i" type="right_before_left" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-3 1,-3"
 radius="4" customShape="1" fringe="outer" roadType="x"><param key="k" value="v"/></junction>
<junction id="j" type="allway_stop" x="100" y="0" incLanes="a_0" intLanes=""
 shape="100,0 100,-3 99,-3">
<request index="0" response="0" foes="0" cont="0"/></junction>
<roundabout nodes="i j" edges="a"/><walkingAreaCustom/><future a="b"/>
</net>"""
"""As SUMO 1.28 writes, with every optional thing, and some that no version knows yet."""


@pytest.mark.parametrize(("text", "classes"), [(OLD, {"bus", "taxi"}), (NEW, {"bus", "drone"})])
def test_networks_of_all_versions(text, classes, tmp_path, caplog):
    path = tmp_path / "n.net.xml"
    path.write_text(text, encoding="utf-8")
    with caplog.at_level(logging.WARNING, "sumo3dviz_pt"):
        network = read_network(path)
    lane = network.lanes["a_0"]
    assert (lane.width, lane.length, lane.allowed) == (3.2, 100.0, classes)
    assert (lane.up, lane.down) == (frozenset({"bus"}) if text == NEW else None, None)
    assert network.edges["a"].function == "normal"
    assert not [said for said in caplog.messages if "lane" in said]


MISSING = ("version", "lefthand", "index", "width", "length", "speed", "priority", "type", "dir")
MISSING += ("state", "incLanes", "intLanes", "crossingEdges", "disallow", "allow", "via", "name")


@pytest.mark.slow
def test_networks_without_any_optional_attribute(tmp_path):
    scene = write_town(tmp_path)
    text = re.sub(rf'\s(?:{"|".join(MISSING)})="[^"]*"', "", NETWORK)
    (tmp_path / "net.net.xml").write_text(text, encoding="utf-8")
    assert np.isfinite(built(scene)).all()
