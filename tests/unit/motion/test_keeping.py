"""Places in lanes: measured against the lanes that a road user is logged on."""

import numpy as np
import pytest
from drives import network_of

from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.model.trajectory import Remark, Trajectory
from sumo3dviz_pt.motion.lanes import LaneGraph
from sumo3dviz_pt.motion.laws import LaneKeeping

NAMES = ("a_0", "b_0", "a_1")
NETWORK = network_of(
    {
        "a_0": [(0, 0), (50, 0)],
        "a_1": [(0, 3), (50, 3)],
        ":n_0": [(50, 0), (60, 0)],
        "b_0": [(60, 0), (100, 0)],
        "far_0": [(0, 500), (50, 500)],
    },
    [("a_0", "b_0", ":n_0")],
)


def trace_of(x, y, lanes):
    count = len(x)
    places = np.column_stack([x, y, np.zeros(count)])
    nothing = np.zeros(count)
    lanes = np.array(lanes)
    return Trace(
        "v", "vehicle", "", np.arange(count, dtype=float), places, nothing, nothing, nothing,
        lanes, np.full(count, -1),
    )  # fmt: skip


def strays(trace, times, places, *remarks):
    keeping = LaneKeeping(LaneGraph(NETWORK), NAMES)
    shown = Trajectory("v", "vehicle", "", (), tuple(remarks))
    return keeping.strays(trace, shown, np.array(times), np.array(places, dtype=float))


def test_lanes_are_those_logged_and_those_between():
    trace = trace_of([40.0, 70.0], [0.0, 0.0], [0, 1])
    found = {lane.id for lane in LaneKeeping(LaneGraph(NETWORK), NAMES).lanes_of(trace)}
    assert found == {"a_0", ":n_0", "b_0"}


def test_what_the_log_itself_is_off_does_not_count():
    trace = trace_of([10.0, 20.0, 30.0], [0.4, -0.6, 0.0], [0, 0, 0])
    found = strays(trace, [0.5, 0.9, 1.5], [(15, -0.6), (18, 1.1), (25, 0.7)])
    np.testing.assert_allclose(found, [0.0, 0.5, 0.1])


def test_a_way_through_a_junction_counts_and_a_jump_between_lanes_does_not():
    through = trace_of([40.0, 70.0], [0.0, 0.0], [0, 1])
    np.testing.assert_allclose(strays(through, [0.5], [(55.0, 0.3)]), [0.3])
    across = trace_of([40.0, 45.0], [0.0, 3.0], [0, 2])
    assert np.isnan(strays(across, [0.5], [(42.0, 1.5)])).all()


@pytest.mark.parametrize("kind", ["lane change", "parking"])
def test_moves_aside_on_purpose_do_not_count(kind):
    trace = trace_of([10.0, 20.0], [0.0, 0.0], [0, 0])
    found = strays(trace, [0.2, 0.8], [(12, 1.0), (18, 1.0)], Remark(kind, 0.0, 0.5))
    assert np.isnan(found[0]) and found[1] == 1.0


def test_without_lanes_nothing_is_known():
    for trace in (trace_of([1.0, 2.0], [0.0, 0.0], [-1, -1]), trace_of([1.0], [0.0], [0])):
        assert np.isnan(strays(trace, [0.0], [(1.0, 0.0)])).all()
