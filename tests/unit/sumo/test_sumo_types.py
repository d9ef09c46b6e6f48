"""Vehicle types."""

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import default_vehicle_type, read_vehicle_types
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS, DEFAULT_TYPES

FILE = """<routes>
<vType id="plain"/>
<vTypeDistribution id="mix">
 <vType id="van" vClass="delivery" length="5.5" color="0,0,255" guiShape="passenger/van"/>
 <vType id="ice" vClass="rail_electric" locomotiveLength="20" carriageGap="1" sigma="0.5">
  <param key="has.wagons" value="8"/></vType>
</vTypeDistribution>
<vType id="DEFAULT_PEDTYPE" width="2"/>
<vType id="old" vClass="lightrail"/>
<vType id="free" vClass="ignoring"/>
<vType id="plain" length="99"/>
<vehicle id="v" type="van" depart="0"><param key="no" value="1"/></vehicle>
</routes>"""


def read(tmp_path, text=FILE):
    path = tmp_path / "r.rou.xml"
    path.write_text(text, encoding="utf-8")
    return read_vehicle_types([path])


def test_types_of_a_route_file(tmp_path):
    types = read(tmp_path)
    assert set(types) == {"plain", "van", "ice", "DEFAULT_PEDTYPE", "old", "free"}
    plain = types["plain"]
    assert (plain.vclass, plain.length, plain.width, plain.height) == ("passenger", 5, 1.8, 1.5)
    assert plain.colour is None
    van = types["van"]
    assert (van.length, van.width, van.height, van.gui_shape) == (5.5, 2.16, 2.86, "passenger/van")
    assert van.colour == (0, 0, 1)
    assert van.params == {}
    assert types["ice"].params == {
        "locomotiveLength": "20",
        "carriageGap": "1",
        "has.wagons": "8",
    }
    assert (types["old"].vclass, types["free"].vclass) == ("tram", "passenger")


def test_redefined_default_keeps_its_class(tmp_path):
    walker = read(tmp_path)["DEFAULT_PEDTYPE"]
    assert (walker.vclass, walker.width, walker.length) == ("pedestrian", 2, 0.215)


@pytest.mark.parametrize(
    ("attribute", "words"),
    [
        ('length="0"', "must lie from 0.01"),
        ('width="-2"', "must lie from 0.01"),
        ('height="inf"', "finite"),
        ('vClass="spaceship"', "unknown"),
        ('color="1,2"', "must be a name"),
    ],
)
def test_impossible_types_are_named(tmp_path, attribute, words):
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, f'<additional>\n<vType id="t" {attribute}/></additional>')
    assert (caught.value.line, caught.value.element) == (2, 'vType "t"')


@pytest.mark.parametrize(
    ("type_id", "kind", "vclass"),
    [
        ("DEFAULT_VEHTYPE", "vehicle", "passenger"),
        ("DEFAULT_PEDTYPE", "person", "pedestrian"),
        ("DEFAULT_BIKETYPE", "vehicle", "bicycle"),
        ("DEFAULT_TAXITYPE", "vehicle", "taxi"),
        ("DEFAULT_CONTAINERTYPE", "container", "container"),
        ("unheard", "vehicle", "passenger"),
        ("unheard", "person", "pedestrian"),
        ("", "container", "container"),
    ],
)
def test_types_that_no_file_defines(type_id, kind, vclass):
    found = default_vehicle_type(type_id, kind)
    assert (found.id, found.vclass) == (type_id, vclass)
    assert found.length == CLASS_DEFAULTS[vclass].length


def test_class_table_is_complete_and_positive():
    assert len(CLASS_DEFAULTS) == 33
    assert all(min(d.length, d.width, d.height) > 0 for d in CLASS_DEFAULTS.values())
    assert set(DEFAULT_TYPES.values()) <= set(CLASS_DEFAULTS)
