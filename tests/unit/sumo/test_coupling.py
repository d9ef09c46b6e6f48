"""Trains that split and join change their length; trains that wait behind others do not."""

from dataclasses import replace

import numpy as np
import pytest
from any_network.programs import call, why_missing

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.model.traffic import Trace, TrafficLog, VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.sumo import find_scenario, read_scenario
from sumo3dviz_pt.sumo.coupling import coupled

NODES = '<nodes><node id="a" x="0" y="0"/><node id="b" x="900" y="90"/></nodes>'
EDGES = '<edges><edge id="ab" from="a" to="b" numLanes="1" speed="20" allow="rail"/></edges>'
STOP = '<additional><trainStop id="s" lane="ab_0" startPos="200" endPos="420"/></additional>'
ROUTES = """<routes>
<vType id="t" vClass="rail" length="80"/><vType id="h" vClass="rail" length="40"/>
<route id="r" edges="ab"/>
<vehicle id="A" type="t" route="r" depart="0"><stop trainStop="s" duration="9" split="B"/></vehicle>
<trip id="B" type="h" depart="split" from="ab" to="ab"/>
<vehicle id="C" type="t" route="r" depart="90">
<stop trainStop="s" duration="30" join="D"/></vehicle>
<vehicle id="D" type="h" route="r" depart="105">
<stop trainStop="s" duration="5" join="C"/></vehicle>
</routes>"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    if why := why_missing():
        pytest.skip(why)
    folder = tmp_path_factory.mktemp("trains")
    files = {"n.nod.xml": NODES, "n.edg.xml": EDGES, "s.add.xml": STOP, "r.rou.xml": ROUTES}
    for name, text in files.items():
        (folder / name).write_text(text)
    made = ["-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "n.net.xml"]
    call("netconvert", made, folder=folder)
    run = ["-n", "n.net.xml", "-r", "r.rou.xml", "-a", "s.add.xml", "--fcd-output", "fcd.xml"]
    call("sumo", [*run, "--end", "260", "--step-length", "0.5"], folder=folder)
    return read_scenario(find_scenario(folder))


def parts_of(scenario, name):
    """Begin, end and length of what is drawn of a train."""
    return [
        (trace.times[0], trace.times[-1], scenario.vehicle_types[trace.type_id].length)
        for trace in scenario.traffic.traces
        if trace.id == name
    ]


def test_the_front_part_of_a_train_that_splits_is_shorter(scenario):
    (_, end, whole), (begin, _, left) = parts_of(scenario, "A")
    ((split, _, rear),) = parts_of(scenario, "B")
    assert (whole, left, rear) == (80.0, 40.0, 40.0)
    assert begin == split and begin - 0.01 < end < begin


def test_of_trains_that_join_the_one_that_stays_is_longer(scenario):
    (_, end, rear), (begin, _, joined) = parts_of(scenario, "D")
    ((_, last, front),) = parts_of(scenario, "C")
    assert (rear, front, joined) == (40.0, 80.0, 120.0)
    assert end == last and begin - 0.01 < end < begin
    # Its front is where that of the other one was.
    traces = {(k.id, k.type_id): k for k in scenario.traffic.traces}
    there = traces["C", "t"].positions[-1]
    assert traces["D", "h@D"].positions[0] == pytest.approx(there, abs=0.1)


def standing(name, type_id, x, span):
    """A train that comes, and stands with its front at x [m]."""
    times = np.arange(span[0], span[1] + 0.5)
    places = np.column_stack(
        [np.minimum(x, x - 30.0 + 10.0 * (times - times[0])), 0 * times, 0 * times]
    )
    nothing, none = np.zeros(len(times)), np.full(len(times), -1)
    return Trace(name, "vehicle", type_id, times, places, nothing, nothing, nothing, none, none)


TYPES = {
    "t": VehicleType("t", "rail", 80.0, 2.8, 4.0),
    "h": VehicleType("h", "rail", 40.0, 2.8, 4.0),
}


@pytest.mark.parametrize(
    ("behind", "joins"), [(85.0, True), (79.5, True), (60.0, False), (120.0, False)]
)
def test_the_rear_train_may_be_the_one_that_is_gone(behind, joins):
    front = standing("C", "t", 500.0, (0.0, 60.0))
    rear = standing("D", "h", 500.0 - behind, (10.0, 40.0))
    log = TrafficLog((front, rear), (), 0.0, 60.0, 1.0, changed={"vehicle:C": 41.0})
    traces, lengths = coupled(log, TYPES)
    assert [each.length for each in lengths.values()] == [120.0] * joins
    if joins:
        ends = {(k.id, k.type_id): (k.times[0], k.times[-1]) for k in traces}
        assert ends["D", "h"][1] == ends["C", "t"][1] == pytest.approx(41.0, abs=0.01)
        assert ends["C", "t@C"] == (41.0, 60.0)
    # A train that ends behind another which does not change has come to the end of its run.
    assert coupled(replace(log, changed={}), TYPES) == ((front, rear), {})


def test_a_train_keeps_its_look_when_it_splits(scenario):
    traces = [trace for trace in scenario.traffic.traces if trace.id == "A"]
    members = [
        Trajectory(name, "vehicle", trace.type_id, ())
        for name, trace in zip(("A", "A#2"), traces, strict=True)
    ]
    fleet = build_fleet(members, scenario.vehicle_types, VehicleSettings(), seed=3)
    assert fleet.colours[0] == fleet.colours[1]
    assert [round(float(each)) for each in fleet.lengths] == [80, 40]
