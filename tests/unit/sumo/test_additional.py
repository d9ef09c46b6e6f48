"""POIs and polygons."""

import logging
import math

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import read_additional

FILE = """<additional>
<poi id="tree" type="maple" x="1.5" y="2" color="red" angle="90" layer="3">
 <param key="height" value="7"/></poi>
<busStop id="bs" lane="a_0"><param key="height" value="9"/></busStop>
<poi id="plain" x="0" y="0"/>
<poi id="geo" lon="9" lat="50"/>
<poi id="onlane" lane="a_0" pos="3"/>
<poly id="house" type="building" color="255,0,0" fill="1" shape="0,0 4,0 4,0 4,4 0,0"
 lineWidth="2"/>
<poly id="fence" shape="0,0,1 9,9,1"/>
<poly id="far" geo="true" shape="9,50 9,51"/>
<poly id="dot" shape="1,1"/>
</additional>"""


def read(tmp_path, text=FILE):
    path = tmp_path / "a.add.xml"
    path.write_text(text, encoding="utf-8")
    return read_additional([path])


def test_pois(tmp_path):
    pois, _ = read(tmp_path)
    tree, plain = pois
    assert (tree.id, tree.type, tree.position) == ("tree", "maple", (1.5, 2.0))
    assert tree.yaw == pytest.approx(0)
    assert tree.colour == (1, 0, 0)
    assert tree.params == {"layer": "3", "height": "7"}
    assert tree.source.endswith("a.add.xml")
    assert (plain.yaw, plain.colour, plain.type, plain.params) == (None, None, "", {})


def test_polygons(tmp_path):
    _, polygons = read(tmp_path)
    house, fence = polygons
    assert (house.id, house.type, house.fill) == ("house", "building", True)
    np.testing.assert_array_equal(house.shape, [[0, 0], [4, 0], [4, 4], [0, 0]])
    assert house.params == {"lineWidth": "2"}
    assert not fence.fill
    assert fence.shape.shape == (2, 2)


def test_what_cannot_be_placed_is_counted(tmp_path, caplog):
    with caplog.at_level(logging.WARNING):
        read(tmp_path)
    assert caplog.text.count("1 POIs left out") == 2
    assert caplog.text.count("1 polygons left out") == 2


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('color="red"', 'color="reddish"', "must be a name"),
        ('x="1.5"', 'x="nan"', "finite"),
        ('angle="90"', 'angle="north"', "finite"),
        ('shape="0,0,1 9,9,1"', 'shape="0,0 9,b"', "must hold points"),
        ('id="tree" ', "", '"id" is missing'),
    ],
)
def test_damage_is_named(tmp_path, old, new, words):
    assert old in FILE
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, FILE.replace(old, new))
    assert caught.value.line > 1


def test_angle_zero_is_north(tmp_path):
    pois, _ = read(tmp_path, '<add><poi id="a" x="0" y="0" angle="0"/></add>')
    assert pois[0].yaw == pytest.approx(math.pi / 2)
