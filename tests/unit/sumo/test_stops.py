"""Stops and parking areas: what is read, and that bays lie where SUMO parks cars."""

import importlib.util
import re
import subprocess
import sys
from math import degrees, hypot, pi
from pathlib import Path

import numpy as np
import pytest
from needed import skip_if

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo.additional import read_parking, read_stops
from sumo3dviz_pt.sumo.network import read_network

NET = """<net version="1.20">
<location netOffset="0,0" convBoundary="0,0,300,0" origBoundary="0,0,300,0" projParameter="!"/>
<edge id="ab" from="a" to="b"><lane id="ab_0" index="0" speed="13" length="300"
 shape="0,-1.6 300,-1.6"/></edge>
<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-3.2"/>
<junction id="b" type="dead_end" x="300" y="0" incLanes="ab_0" intLanes="" shape="300,0 300,-3.2"/>
</net>"""


def files(tmp_path, text, net=NET):
    path, network = tmp_path / "stops.add.xml", tmp_path / "n.net.xml"
    path.write_text(f"<additional>{text}</additional>", encoding="utf-8")
    network.write_text(net, encoding="utf-8")
    return path, read_network(network)


def parking(tmp_path, text):
    path, network = files(tmp_path, text)
    return read_parking([path], network)


def test_stops_of_all_kinds_are_read(tmp_path):
    path, _ = files(
        tmp_path,
        '<busStop id="s" lane="ab_0" startPos="-30" endPos="-10" lines="1 X2"/>'
        '<trainStop id="s" lane="ab_0"/><containerStop id="c" lane="ab_0" endPos="9"/>'
        '<chargingStation id="e" lane="ab_0" power="1"/><busStop id="s" lane="zz"/>',
    )
    stops = read_stops([path])
    assert [stop.kind for stop in stops] == ["bus", "train", "container", "charging"]
    assert stops[0].lines == ("1", "X2") and stops[0].lane == "ab_0"
    assert stops[0].span(300.0) == pytest.approx((0.9, 29 / 30))
    assert stops[1].span(300.0) == (0.0, 1.0)


def test_parallel_bays_divide_their_stretch(tmp_path):
    (area,) = parking(
        tmp_path, '<parkingArea id="p" lane="ab_0" startPos="20" endPos="60" roadsideCapacity="4"/>'
    )
    assert [bay.front for bay in area.bays] == [
        pytest.approx((20.0 + 10.0 * k, -4.8)) for k in range(1, 5)
    ]
    assert area.bays[0].length == 10.0 and area.bays[0].width == 3.2 and area.roadside == 4
    corners = area.bays[0].corners()
    assert corners.min(axis=0) == pytest.approx((20.0, -6.4))
    assert corners.max(axis=0) == pytest.approx((30.0, -3.2))


@pytest.mark.parametrize("angle", [30, 45, 90, 135])
def test_turned_bays_touch_the_lane_and_lie_beside_it(tmp_path, angle):
    (area,) = parking(
        tmp_path,
        f'<parkingArea id="p" lane="ab_0" startPos="-60" endPos="-20" roadsideCapacity="5"'
        f' angle="{angle}" length="5" width="2.5"/>',
    )
    corners = np.concatenate([bay.corners() for bay in area.bays])
    assert corners[:, 1].max() == pytest.approx(-3.2)
    assert degrees(-area.bays[0].yaw) == pytest.approx(angle)
    assert area.bays[0].corners()[:, 0].mean() == pytest.approx(244.0)


def test_spaces_lie_where_they_say(tmp_path):
    (area,) = parking(
        tmp_path,
        '<parkingArea id="p" lane="ab_0"><space x="50" y="20" angle="90" width="2.5" length="5"/>'
        '<param key="a" value="b"/><space x="60" y="20"/></parkingArea><poi id="q" x="1" y="1"/>',
    )
    assert [bay.front for bay in area.bays] == [(50.0, 20.0), (60.0, 20.0)]
    assert [degrees(bay.yaw) for bay in area.bays] == pytest.approx([0.0, -90.0])
    assert area.bays[0].corners().mean(axis=0) == pytest.approx((47.5, 20.0))
    assert (area.bays[1].length, area.bays[1].width, area.roadside) == (7.5, 3.2, 0)


def test_parking_on_the_road_and_on_unknown_lanes_has_no_bays(tmp_path):
    text = '<parkingArea id="p" lane="ab_0" onRoad="1" roadsideCapacity="3"/>'
    text += (
        '<parkingArea id="q" lane="zz_0" roadsideCapacity="3"/><parkingArea id="r" lane="ab_0"/>'
    )
    assert parking(tmp_path, text) == ()


def test_a_damaged_number_names_its_attribute(tmp_path):
    with pytest.raises(InputError, match="angle"):
        parking(tmp_path, '<parkingArea id="p" lane="ab_0" roadsideCapacity="2" angle="steep"/>')


# Against SUMO itself -----------------------------------------------------------------------

ROWS = {
    "flat": 'startPos="20" endPos="60" roadsideCapacity="4"',
    "short": 'startPos="70" endPos="100" roadsideCapacity="3" length="5" width="2.2"',
    "a45": 'startPos="110" endPos="140" roadsideCapacity="3" angle="45" length="5" width="3"',
    "a90": 'startPos="150" endPos="170" roadsideCapacity="3" angle="90" length="5"',
    "m30": 'startPos="180" endPos="210" roadsideCapacity="3" angle="-30" length="5"',
    "end": 'startPos="-60" endPos="-20" roadsideCapacity="3" angle="30"',
    "m135": 'startPos="10" endPos="40" roadsideCapacity="3" angle="-135" length="5" width="2"',
    "m90": 'startPos="40" endPos="60" roadsideCapacity="3" angle="-90" length="6" width="2"',
    "a200": 'startPos="60" endPos="90" roadsideCapacity="3" angle="200" length="6" width="2"',
    "own": 'startPos="215" endPos="230"',
}


def program(name):
    """SUMO's program, or None where SUMO is not installed."""
    found = importlib.util.find_spec("sumo")
    if found is None or not found.submodule_search_locations:
        return None
    folder = Path(next(iter(found.submodule_search_locations))) / "bin"
    return next((path for path in (folder / name, folder / f"{name}.exe") if path.is_file()), None)


@pytest.mark.slow
@skip_if(program("sumo") is None, "SUMO is not installed")
@pytest.mark.parametrize("hand", [[], ["--lefthand"]])
def test_sumo_parks_cars_in_these_bays(tmp_path, hand):
    def run(name, *words):
        subprocess.run([program(name), *words], cwd=tmp_path, check=True, capture_output=True)

    def write(name, text):
        (tmp_path / name).write_text(text, encoding="utf-8")

    write("n.nod.xml", '<nodes><node id="a" x="0" y="0"/><node id="b" x="300" y="0"/>'
          '<node id="c" x="500" y="80"/></nodes>')  # fmt: skip
    write("e.edg.xml", '<edges><edge id="ab" from="a" to="b" speed="14"/>'
          '<edge id="bc" from="b" to="c" speed="14"/></edges>')  # fmt: skip
    space = '<space x="190" y="-30" angle="30" width="2.5" length="5"/><space x="200" y="-30"/>'
    rows = "".join(
        f'<parkingArea id="{name}" lane="ab_0" {row}>{space if name == "own" else ""}</parkingArea>'
        for name, row in ROWS.items()
    )
    write("p.add.xml", f"<additional>{rows}</additional>")
    trips = "".join(
        f'<trip id="{name}.{k}" depart="{6 * n + 2 * k}" from="ab" to="bc">'
        f'<stop parkingArea="{name}" duration="900"/></trip>'
        for n, name in enumerate(ROWS)
        for k in range(2)
    )
    write("r.rou.xml", f'<routes><vType id="DEFAULT_VEHTYPE" length="4.5"/>{trips}</routes>')
    run("netconvert", "-n", "n.nod.xml", "-e", "e.edg.xml", "-o", "n.net.xml", *hand)
    run("sumo", "-n", "n.net.xml", "-a", "p.add.xml", "-r", "r.rou.xml",
        "--fcd-output", "f.xml", "-e", "140")  # fmt: skip
    areas = {
        area.id: area
        for area in read_parking([tmp_path / "p.add.xml"], read_network(tmp_path / "n.net.xml"))
    }
    last = (tmp_path / "f.xml").read_text(encoding="utf-8").rsplit("<timestep", 1)[1]
    rows = re.findall(
        r'<vehicle id="(\w+)\.\d+" x="([-\d.]+)" y="([-\d.]+)" angle="([\d.]+)"', last
    )
    assert {name for name, *_ in rows} == set(ROWS), sys.version
    for name, *numbers in rows:
        x, y, angle = map(float, numbers)
        bay = min(areas[name].bays, key=lambda b: hypot(b.front[0] - x, b.front[1] - y))
        assert hypot(bay.front[0] - x, bay.front[1] - y) < 0.02, name
        turn = (degrees(pi / 2 - bay.yaw) - angle + 180.0) % 360.0 - 180.0
        assert abs(turn) < 0.5, name
