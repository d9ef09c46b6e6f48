"""A scenario is read the same, bit by bit, wherever it lies by whole kilometres."""

from __future__ import annotations

import shutil
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from any_network.programs import call, why_missing
from hypothesis import given
from hypothesis import strategies as st
from shifting import Shift, differences, first_steps, shift

from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.sumo import find_scenario, read_location, read_network, read_scenario
from sumo3dviz_pt.sumo.places import counted_from

EXAMPLES = Path(__file__).parents[3] / "examples"
SHIFTS: tuple[Shift, ...] = (
    (100_000, 0), (0, 1_000_000), (5_000_000, -5_000_000), (-1_000_000, 10_000_000),
    (10_000_000, 10_000_000),
)  # fmt: skip

NET = """<net version="1.20">{location}
 <edge id="a" from="A" to="B" priority="1"><lane id="a_0" index="0" speed="13.89" length="200"
  shape="{x}.25,{y}.5 {x}.75,{z}.123456"/></edge>
 <junction id="A" type="priority" x="{x}.1" y="{y}.2" incLanes="" shape="{x}.0,{y}.0"/>
 <junction id="B" type="priority" x="{x}.3" y="{z}.4" incLanes="a_0" shape="{x}.0,{z}.0"/></net>"""

LOG = """<fcd-export><timestep time="0.00"><vehicle id="v" x="{x}" y="{y}" angle="0" lane="a_0"
 speed="5" pos="9"/></timestep><timestep time="1.00"><vehicle id="v" x="{x}" y="{z}" angle="0"
 lane="a_0" speed="5" pos="14"/></timestep></fcd-export>"""


OBJECTS = """<additional>
 <poi id="p" x="301.5" y="280.25"/><poly id="b" shape="310,310 330,310 330,325" type="building"/>
 <poi id="on" lane="{lane}" pos="5" posLat="3"/>
 <parkingArea id="a" lane="{lane}" startPos="5" endPos="30"><space x="305.5" y="290"/></parkingArea>
</additional>"""


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The crossing of the examples with a short log and objects of all kinds of place."""
    folder, example = tmp_path_factory.mktemp("crossing"), EXAMPLES / "crossing"
    for file in (*example.glob("*.xml"), example / "crossing.net.xml.gz"):
        shutil.copy(file, folder)
    shutil.copy(example / "crossing.sumocfg", folder)
    first_steps(example / "fcd.xml.gz", folder, 30)
    shutil.copy(example / "signals.xml.gz", folder)
    lane = next(iter(read_network(folder / "crossing.net.xml.gz").edges["S_out_far"].lanes)).id
    (folder / "homes.add.xml").write_text(OBJECTS.format(lane=lane))
    return folder


@pytest.mark.parametrize("by", SHIFTS)
def test_an_example_is_read_the_same(by, crossing, tmp_path):
    there = shift(crossing.iterdir(), tmp_path / "there", by)
    one, two = (read_scenario(find_scenario(f / "crossing.sumocfg")) for f in (crossing, there))
    assert two.network.location.origin == by
    assert one.pois and one.polygons and one.traffic.traces and one.stops and one.parking
    assert not list(differences(one, two))


def test_our_examples_and_whatever_begins_at_zero_are_counted_as_they_are():
    for name in ("crossing", "ronda"):
        location = read_location(EXAMPLES / name / f"{name}.net.xml.gz")
        assert location.origin == (0.0, 0.0)
    assert counted_from(Location(), (-120.0, -60.0)).origin == (0.0, 0.0)


@pytest.mark.skipif(bool(why_missing()), reason=why_missing() or "SUMO is there")
@pytest.mark.parametrize(
    "words",
    [
        "--grid --grid.number 3 --sidewalks.guess --crossings.guess --offset.x 12.34",
        pytest.param(
            "--spider --spider.omit-center --offset.y -77.7 --precision 6", marks=pytest.mark.slow
        ),
        pytest.param(
            "--rand --rand.iterations 20 --seed 5 --default.lanenumber 2", marks=pytest.mark.slow
        ),
    ],
)
def test_networks_of_netgenerate_are_read_the_same(words, tmp_path):
    call("netgenerate", [*words.split(), "-o", "a.net.xml"], folder=tmp_path)
    network = read_network(tmp_path / "a.net.xml")
    for by in SHIFTS:
        there = shift([tmp_path / "a.net.xml"], tmp_path / "there", by) / "a.net.xml"
        assert not list(differences(network, read_network(there))), by
        assert read_location(there) == read_network(there).location


@pytest.mark.parametrize(
    "location",
    [
        "",
        '<location netOffset="0.00,0.00" convBoundary="0.00,0.00,0.00,0.00" projParameter="!"/>',
        '<location netOffset="-4e5,-4e6" convBoundary="3e9,3e9,4e9,4e9" projParameter="!"/>',
    ],
)
def test_a_network_without_a_true_box_is_counted_from_its_first_place(location, tmp_path):
    read = []
    for far in (0, 5_000_000):
        path = tmp_path / f"{far}.net.xml"
        text = NET.format(location=location, x=far + 30, y=far + 40, z=far + 240)
        path.write_text(text)
        read.append(read_network(path))
        assert read[-1].location.origin == (far, far)
    assert not list(differences(read[0].lanes, read[1].lanes))
    assert not list(differences(read[0].junctions, read[1].junctions))


DEGREES = '<location netOffset="{o},{o}" convBoundary="{b},{b},{e},{e}" projParameter="-"/>'


def test_logs_in_degrees_lie_where_the_network_does(tmp_path):
    found = []
    for far in (0, 10_000_000):
        folder = tmp_path / str(far)
        folder.mkdir()
        location = DEGREES.format(o=far - 55_600, b=far, e=far + 1000)
        text = NET.format(location=location, x=far + 30, y=far + 40, z=far + 240)
        (folder / "a.net.xml").write_text(text)
        log = LOG.format(x=55_630.5 / 111_320, y=55_650 / 111_136, z=55_690 / 111_136)
        (folder / "fcd.xml").write_text(log)
        own = read_scenario(find_scenario(folder))
        assert own.network.location.place == pytest.approx((0.505, 0.504), abs=1e-3)
        found.append(own)
    assert not list(differences(*found))
    assert found[0].traffic.traces[0].positions[1, :2] == pytest.approx((30.5, 90.0), abs=3.0)


def test_logs_as_tables_are_read_the_same(tmp_path):
    head = "timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_angle;vehicle_lane;vehicle_speed"
    rows = [f"{t}.0;v;30.5;{50 + 5.01 * t};0;a_0;5" for t in range(20)]
    here = tmp_path / "here"
    here.mkdir()
    (here / "fcd.csv").write_text("\n".join([head, *rows]) + "\n")
    (here / "a.net.xml").write_text(NET.format(location="", x=30, y=40, z=240))
    there = shift([here / "fcd.csv", here / "a.net.xml"], tmp_path / "there", SHIFTS[4])
    one, two = (read_scenario(find_scenario(folder)) for folder in (here, there))
    assert len(one.traffic.traces[0].times) == 20
    assert not list(differences(one.traffic, two.traffic))


@given(
    st.decimals(-5e4, 5e4, places=6),
    st.integers(-10_000, 10_000),
)
def test_six_decimals_hold_at_any_kilometre(value: Decimal, kilometres: int):
    origin = 1000.0 * kilometres
    location = Location(origin=(origin, -origin))
    text = [f"{value + 1000 * kilometres:f}", f"{value - 1000 * kilometres:f}"]
    assert location.inside([float(word) for word in text]).tolist() == [float(value) + 0.0] * 2
    back = location.outside(location.inside([float(word) for word in text]))
    assert np.abs(back - [float(word) for word in text]).max() < 1e-8
