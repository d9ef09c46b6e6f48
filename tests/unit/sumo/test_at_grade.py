"""Roads that cross at one height without a junction are noted, with what to do about it."""

import logging

import pytest
from any_network.programs import call, why_missing

from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.sumo.repairs import crossings_at_grade

NET = """<net version="1.20">
    <location netOffset="0,0" convBoundary="0,0,300,300" origBoundary="0,0,1,1" projParameter="!"/>
    <edge id="we" from="w" to="e" priority="-1">
        <lane id="we_0" index="0" speed="30" length="300" shape="0,150,0 300,150,0"/>
        <lane id="we_1" index="1" speed="30" length="300" shape="0,153,0 300,153,0"/>
    </edge>
    <edge id="ns" from="{start}" to="s" priority="-1">
        <lane id="ns_0" index="0" speed="30" length="300" {allow} shape="{shape}"/>
    </edge>
    {junctions}
</net>"""
JUNCTION = '<junction id="{}" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0"/>'
ACROSS = "150,300,{z} 150,0,{z}"


def network(folder, *, shape="150,300,0 150,0,0", start="n", allow=""):
    path = folder / "net.net.xml"
    junctions = "".join(map(JUNCTION.format, "news"))
    path.write_text(NET.format(shape=shape, start=start, allow=allow, junctions=junctions))
    return path


@pytest.mark.parametrize(
    ("how", "count"),
    [
        ({}, 1),
        ({"shape": ACROSS.format(z=2)}, 1),
        ({"shape": ACROSS.format(z=6)}, 0),
        ({"shape": "150,300,0 150,200,8 150,100,8 150,0,0"}, 0),
        ({"shape": "0,151,0 300,152,0"}, 0),
        ({"start": "e"}, 0),
        ({"allow": 'allow="pedestrian"'}, 0),
        ({"allow": 'allow="ship"'}, 0),
    ],
    ids=["level", "2 m", "6 m", "a bridge", "along", "shared junction", "a path", "a canal"],
)
def test_roads_that_cross_in_plan_without_a_junction_have_three_metres_between(
    tmp_path, how, count
):
    found = crossings_at_grade(read_network(network(tmp_path, **how)))
    assert len(found) == count
    if count:
        assert found[0].place[:2].tolist() == pytest.approx([150.0, 150.0])


def test_the_note_says_where_and_what_to_do(tmp_path, caplog):
    with caplog.at_level(logging.WARNING):
        read_network(network(tmp_path))
    assert "`we` and `ns` cross at (150, 150) without a junction" in caplog.text
    assert "--osm.layer-elevation" in caplog.text and "join the two in a junction" in caplog.text


@pytest.mark.skipif(bool(why_missing()), reason=why_missing())
def test_netgenerates_networks_are_not_accused(tmp_path):
    options = ["--spider", "--spider.omit-center", "-o", "n.net.xml"]
    call("netgenerate", options, folder=tmp_path)
    assert crossings_at_grade(read_network(tmp_path / "n.net.xml")) == ()
