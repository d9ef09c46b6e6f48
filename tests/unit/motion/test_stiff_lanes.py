"""Lanes that are missing, wrong, odd or changed oddly: `lane` shows what x and y say."""

from dataclasses import replace

import numpy as np
import pytest
from drives import (
    LENGTH,
    NAMES,
    Way,
    accelerations,
    arc,
    assert_sound,
    between,
    changing,
    drive,
    kinds_of,
    network_of,
    road,
    shown,
    straight,
    trace_of,
)

FINE = 0.04
HEADINGS = pytest.mark.parametrize("heading", ["chord", "tractrix"])


def steady(t):
    return 20.0 + 8.0 * np.asarray(t)


def worst(trajectory, way, s, last):
    """Largest distance from the truth [m]."""
    asked = np.arange(0, last, FINE)
    motion = trajectory.sample(asked)
    assert motion.alive.all()
    return np.linalg.norm(motion.positions - way.at(s(asked)), axis=1).max()


# Missing and wrong -------------------------------------------------------------------------


@HEADINGS
@pytest.mark.parametrize("name", ["straight", "corner", "roundabout"])
def test_lanes_that_the_network_lacks(name, heading):
    network, way = road(name)
    trace = drive(way, np.arange(0, 21.0), steady)
    names = tuple(f"elsewhere_{k}" for k in range(len(way.names)))
    trajectory = shown(trace, "lane", network, names, heading=heading)
    assert_sound(trajectory, trace)
    assert kinds_of(trajectory) & {"no lanes", "no route", "off lane"}
    assert worst(trajectory, way, steady, 20.0) <= 0.6


@pytest.mark.parametrize("lost", ["lanes", "offsets", "places"])
@pytest.mark.parametrize("name", ["straight", "corner", "roundabout"])
def test_lanes_lost_for_some_seconds(name, lost):
    network, way = road(name)
    trace = drive(way, np.arange(0, 21.0), steady)
    gone = (trace.times >= 7) & (trace.times <= 12)
    if lost == "lanes":
        trace = replace(trace, lanes=np.where(gone, -1, trace.lanes))
    elif lost == "offsets":
        trace = replace(trace, offsets=np.where(gone, np.nan, trace.offsets))
    else:  # lane and place stay those of the road that was left (moveToXY)
        trace = replace(trace, offsets=np.where(gone, 3.0, trace.offsets))
    trajectory = shown(trace, "lane", network, way.names)
    assert_sound(trajectory, trace)
    remarks = [r for r in trajectory.remarks if r.kind in ("no lanes", "no route", "off lane")]
    assert min(r.begin for r in remarks) == pytest.approx(6.0, abs=1.0)
    assert max(r.end for r in remarks) == pytest.approx(13.0, abs=1.0)
    assert worst(trajectory, way, steady, 20.0) <= 0.6


@pytest.mark.parametrize("without", ["offsets", "speeds", "lanes", "all"])
@pytest.mark.parametrize("name", ["straight", "corner", "roundabout"])
def test_logs_of_few_attributes(name, without):
    network, way = road(name)
    trace = drive(way, np.arange(0, 21.0), steady)
    empty = {
        "offsets": np.empty(0),
        "speeds": np.full(len(trace.times), np.nan),
        "lanes": np.full(len(trace.times), -1),
    }
    trace = replace(trace, **(empty if without == "all" else {without: empty[without]}))
    trajectory = shown(trace, "lane", network, way.names)
    assert_sound(trajectory, trace)
    assert worst(trajectory, way, steady, 20.0) <= 0.6


# Odd ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.1, 2.0])
def test_lanes_whose_length_is_not_their_shapes(factor):
    # SUMO counts 1 m of lane for `factor` m of map, or the other way round.
    network, way = road("straight")
    lane = network.lanes["a_0"]
    other = network_of({"a_0": lane.shape})
    edge = replace(other.edges["a"], lanes=(replace(lane, length=lane.length / factor),))
    network = replace(other, edges={"a": edge})
    trace = drive(way, np.arange(0, 21.0), steady)
    trace = replace(
        trace, offsets=np.round(trace.offsets / factor, 2), speeds=trace.speeds / factor
    )
    trajectory = shown(trace, "lane", network, way.names)
    assert_sound(trajectory, trace, own=True)
    assert worst(trajectory, way, steady, 20.0) <= 0.1


def test_overtaking_on_the_opposite_lane_does_not_turn_round():
    # SUMO logs the opposite lane and the place on it, which falls; the angle is the driver's.
    shapes = {"a_0": [(0, 0), (1500, 0)], "b_0": [(1500, 3.2), (0, 3.2)]}
    network = network_of(shapes)
    times = np.arange(0, 41.0)
    along = 10.0 + 20.0 * times
    over = (times > 12.5) & (times < 25.5)
    trace = trace_of(
        times, np.column_stack([along, 3.2 * over]), 0.0, 20.0,
        lanes=over.astype(int), offsets=np.where(over, 1500.0 - along, along),
    )  # fmt: skip
    trajectory = shown(trace, "lane", network, ("a_0", "b_0"))
    assert_sound(trajectory, trace, own=True)
    motion = trajectory.sample(np.arange(0, 40, FINE))
    assert np.degrees(between(motion.yaws, 0.0)).max() <= 30.0
    assert "reversing" not in kinds_of(trajectory)
    expected = 10.0 + 20.0 * np.arange(0, 40, FINE)
    assert np.abs(motion.positions[:, 0] - expected).max() <= 1.0


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0, 2.0])
def test_lanes_of_a_decimetre(step):
    shapes = {
        "a_0": [(0, 0), (60, 0)],
        ":j_0_0": [(60, 0), (60.1, 0)],
        "b_0": [(60.1, 0), (60.3, 0)],
        ":k_0_0": [(60.3, 0), (60.4, 0.01)],
        "c_0": [(60.4, 0.01), (400, 0.01)],
    }
    network = network_of(shapes, [("a_0", "b_0", ":j_0_0"), ("b_0", "c_0", ":k_0_0")])
    way = Way.of(network, tuple(shapes))
    trace = drive(way, np.arange(0, 21.0, step), steady)
    trajectory = shown(trace, "lane", network, way.names)
    assert_sound(trajectory, trace)
    assert trajectory.remarks == ()
    assert worst(trajectory, way, steady, trace.times[-1]) <= 0.05


@pytest.mark.parametrize("step", [0.5, 1.0, 2.0])
def test_twice_round_a_roundabout(step):
    quarter = {f"r{k}_0": arc((0, 0), 16, 90 * k, 90 * k + 90, 10) for k in range(4)}
    links = [(f"r{k}_0", f"r{(k + 1) % 4}_0", "") for k in range(4)]
    network = network_of(quarter, links)
    way = Way.of(network, tuple(quarter))
    length = way.along[-1]

    def s(t):
        return 5.0 + 7.0 * np.asarray(t)

    trace = drive(way, np.arange(0, 25.0, step), lambda t: s(t) % length)
    assert s(trace.times[-1]) > 1.5 * length
    front = way.at(s(trace.times) % length)
    rear = way.at((s(trace.times) - LENGTH) % length)
    yaws = np.arctan2(*(front - rear)[:, 1::-1].T)
    trace = replace(trace, yaws=yaws, speeds=np.full(len(yaws), 7.0))
    trajectory = shown(trace, "lane", network, way.names)
    assert_sound(trajectory, trace)
    asked = np.arange(0, trace.times[-1], FINE)
    radii = np.hypot(*trajectory.sample(asked).positions[:, :2].T)
    assert np.abs(radii - 16.0).max() <= 0.15
    assert np.diff(np.unwrap(trajectory.sample(asked).yaws)).min() >= -0.002


# Changed oddly -----------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [25.0, 8.0])
def test_a_lane_change_within_one_step_of_4_hundredths(speed):
    network, trace = changing(speed)
    times = np.round(np.arange(0, 40, 0.04), 2)
    lanes = (times > 20.0).astype(int)
    along = 10.0 + speed * times
    trace = trace_of(
        times, np.column_stack([along, 3.2 * lanes]), 0.0, speed, lanes=lanes, offsets=along
    )
    trajectory = shown(trace, "lane", network, NAMES)
    assert_sound(trajectory, trace)
    (piece,) = trajectory.pieces
    assert accelerations(piece).max() <= 15.0  # 1 cm of rounding in 0.04 s is 6 m/s2


@pytest.mark.parametrize("seconds", [3.0, 6.0])
@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
def test_a_lane_change_that_takes_its_time_is_kept(seconds, step):
    # --lanechange.duration: sideways at even speed, the lane changes half way.
    times = np.round(np.arange(0, 40, step), 2)
    share = np.clip((times - 18.0) / seconds, 0.0, 1.0)
    along = 10.0 + 20.0 * times
    yaws = np.where((share > 0) & (share < 1), np.arctan2(3.2 / seconds, 20.0), 0.0)
    trace = trace_of(
        times, np.column_stack([along, 3.2 * share]), yaws, 20.0,
        lanes=(share > 0.5).astype(int), offsets=along,
    )  # fmt: skip
    trajectory = shown(trace, "lane", straight(), NAMES)
    assert_sound(trajectory, trace)
    motion = trajectory.sample(times)
    # The log's own box of sideways speed may be rounded off, not moved.
    assert np.abs(motion.positions[:, 1] - trace.positions[:, 1]).max() <= 0.5
    across = trajectory.sample(np.arange(0, 39, FINE)).positions[:, 1]
    assert across.min() >= -0.05
    assert across.max() <= 3.25


@pytest.mark.parametrize("inside", [False, True], ids=["before", "within"])
def test_a_lane_change_at_a_junction(inside):
    shapes = {}
    for k in (0, 1):
        y = 3.2 * k
        shapes[f"a_{k}"] = [(0, y), (200, y)]
        shapes[f":j_0_{k}"] = [(200, y), (220, y)]
        shapes[f"b_{k}"] = [(220, y), (600, y)]
    network = network_of(shapes, [(f"a_{k}", f"b_{k}", f":j_0_{k}") for k in (0, 1)])
    names = tuple(shapes)
    times = np.arange(0, 40.0)
    along = 11.0 + 12.0 * times
    lanes = (along > (210.0 if inside else 190.0)).astype(int)
    edge = np.searchsorted([200.0, 220.0], along, side="right")
    offsets = along - np.array([0.0, 200.0, 220.0])[edge]
    trace = trace_of(
        times, np.column_stack([along, 3.2 * lanes]), 0.0, 12.0,
        lanes=3 * lanes + edge, offsets=offsets,
    )  # fmt: skip
    trajectory = shown(trace, "lane", network, names)
    assert_sound(trajectory, trace)
    (piece,) = trajectory.pieces
    assert accelerations(piece).max() <= 5.0
    motion = trajectory.sample(np.arange(0, 39, FINE))
    assert np.abs(motion.positions[:, 0] - 11.0 - 12.0 * np.arange(0, 39, FINE)).max() <= 0.3


def test_left_and_right_again_and_again():
    changes = tuple(np.arange(10.5, 31.0, 3.0))
    network, trace = changing(20.0, changes=changes)
    trajectory = shown(trace, "lane", network, NAMES)
    assert_sound(trajectory, trace)
    (piece,) = trajectory.pieces
    assert accelerations(piece).max() <= 10.0
    across = trajectory.sample(np.arange(0, 40, FINE)).positions[:, 1]
    assert across.min() >= -0.05
    assert across.max() <= 3.25


def test_a_lane_change_onto_the_begin_of_a_lane_while_creeping():
    # Nothing leads to the new lane: the move can only begin where it does.
    shapes = {
        "a_0": [(0, 0), (100, 0)],
        ":j_0_0": [(100, 0), (110, 0)],
        "b_0": [(110, -3.2), (400, -3.2)],
        "b_1": [(110, 0), (400, 0)],
    }
    network = network_of(shapes, [("a_0", "b_1", ":j_0_0")])
    times = np.arange(0, 60.0)
    along = 109.0 + 0.25 * np.minimum(times, 30.0) + np.clip(times - 30.0, 0, None) ** 2 / 4.0
    lanes = np.where(along < 110.0, 1, np.where(times < 5.5, 3, 2))
    offsets = along - np.where(along < 110.0, 100.0, 110.0)
    trace = trace_of(
        times, np.column_stack([along, np.where(lanes == 2, -3.2, 0.0)]), 0.0,
        np.gradient(along), lanes=lanes, offsets=offsets,
    )  # fmt: skip
    trajectory = shown(trace, "lane", network, tuple(shapes))
    assert_sound(trajectory, trace, refused={"parking"})
    met = trajectory.sample(times).positions[:, :2] - trace.positions[:, :2]
    told = [(r.begin, r.end) for r in trajectory.remarks]
    for time, off in zip(times, np.hypot(*met.T), strict=True):
        assert off <= 0.1 or any(begin <= time <= end for begin, end in told), time
    assert all(end - begin <= 17.0 for begin, end in told)
