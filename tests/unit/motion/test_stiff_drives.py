"""Hard driving along the road: births and deaths at speed, lane changes, braking.

`lane` gets the road; `hermite` and `linear` get places, speeds and angles only.
"""

import numpy as np
import pytest
from drives import (
    LENGTH,
    NAMES,
    accelerations,
    assert_sound,
    between,
    changing,
    drive,
    logged_acceleration,
    network_of,
    road,
    shown,
    sideways,
    stopping,
    straight,
    trace_of,
)

SMOOTHERS = ("linear", "hermite", "lane")
ALL = pytest.mark.parametrize("smoother", SMOOTHERS)
CURVED = pytest.mark.parametrize("smoother", ["hermite", "lane"])
HEADINGS = pytest.mark.parametrize("heading", ["chord", "tractrix"])
BOTH_LOGS = pytest.mark.parametrize("euler", [False, True], ids=["rates", "euler"])
REAR_AXLE = 0.78 * LENGTH  # behind the front [m]
FINE = 0.04


# Births and deaths -------------------------------------------------------------------------


@ALL
@BOTH_LOGS
@pytest.mark.parametrize("step", [0.1, 1.0])
@HEADINGS
def test_insertion_at_40_metres_a_second(smoother, euler, step, heading):
    network, way = road("straight")
    trace = drive(way, np.arange(5, 20, step), lambda t: 5.0 + 40.0 * (t - 5.0), euler=euler)
    trajectory = shown(trace, smoother, network, way.names, heading=heading)
    assert_sound(trajectory, trace)
    asked = np.arange(5.0, 19.0, FINE)
    motion = trajectory.sample(asked)
    assert np.abs(motion.positions[:, 0] - 5.0 - 40.0 * (asked - 5.0)).max() <= 0.02
    assert np.abs(motion.speeds - 40.0).max() <= 0.5
    assert np.degrees(between(motion.yaws, 0.0)).max() <= 0.1
    assert trajectory.at(4.99) is None
    assert motion.travelled[0] == 0.0


@ALL
@BOTH_LOGS
def test_insertion_in_a_bend_takes_sumos_angle(smoother, euler):
    network, way = road("roundabout")
    trace = drive(way, np.arange(0, 8.0), lambda t: 130.0 + 4.0 * t, euler=euler)
    pose = shown(trace, smoother, network, way.names).at(0.0)
    assert np.degrees(between(pose.yaw, trace.yaws[0])) <= 1.0
    np.testing.assert_allclose(pose.position, trace.positions[0], atol=0.005)


@ALL
@BOTH_LOGS
@pytest.mark.parametrize("step", [0.1, 1.0])
def test_removal_in_the_middle_of_the_road(smoother, euler, step):
    network, way = road("straight")
    trace = drive(way, np.arange(0, 12, step), lambda t: 20.0 + 25.0 * t, euler=euler)
    trajectory = shown(trace, smoother, network, way.names)
    last = trace.times[-1]
    pose = trajectory.at(last)
    np.testing.assert_allclose(pose.position, trace.positions[-1], atol=0.005)
    assert pose.speed == pytest.approx(25.0, abs=0.5)
    assert trajectory.at(last + 0.01) is None
    assert_sound(trajectory, trace)


# Lane changes ------------------------------------------------------------------------------


@ALL
@pytest.mark.parametrize("speed", [36.11, 13.9, 5.0, 1.4])
def test_a_lane_change_is_no_jump(smoother, speed):
    network, trace = changing(speed)
    trajectory = shown(trace, smoother, network, NAMES)
    # Only `lane` knows that it is a change of lanes; the others join SUMO's samples.
    assert_sound(trajectory, trace, own=smoother != "lane")


@pytest.mark.parametrize(
    ("speed", "acceleration", "slant", "rate", "slip"),
    # facts/motion.md section 8 for fast ones; slow ones go 4 m along for each metre across.
    [(36.11, 5.0, 6.0, 20.0, 0.6), (13.9, 5.0, 9.0, 20.0, 0.6), (1.4, 1.0, 30.0, 30.0, 0.6)],
)
def test_lanes_are_changed_as_a_vehicle_can(speed, acceleration, slant, rate, slip):
    network, trace = changing(speed)
    trajectory = shown(trace, "lane", network, NAMES)
    asked = np.arange(0, 40, FINE)
    motion = trajectory.sample(asked)
    (piece,) = trajectory.pieces
    assert accelerations(piece).max() <= acceleration
    yaws = np.degrees(np.arctan2(np.sin(motion.yaws), np.cos(motion.yaws)))
    assert np.abs(yaws).max() <= slant
    assert np.abs(np.diff(yaws)).max() / FINE <= rate
    assert sideways(motion).max() <= slip
    across = motion.positions[:, 1]
    assert np.diff(across).min() >= -0.001
    assert np.abs(across[asked < 14.0]).max() <= 0.01
    assert np.abs(across[asked > 27.0] - 3.2).max() <= 0.01


def test_there_and_back_within_three_seconds():
    network, trace = changing(25.0, changes=(20.5, 23.5))
    trajectory = shown(trace, "lane", network, NAMES)
    assert_sound(trajectory, trace)
    (piece,) = trajectory.pieces
    assert accelerations(piece).max() <= 8.0
    across = trajectory.sample(np.arange(0, 40, FINE)).positions[:, 1]
    assert across.min() >= -0.05
    assert across.max() <= 3.25


@pytest.mark.parametrize("at", [18.5, 20.5, 30.5], ids=["stopping", "stopped", "standing"])
def test_a_lane_change_at_a_stop_is_driven_before_or_after_it(at):
    network, s = straight(), stopping(15.0, 2.0, 10.0)  # it stands from 20 to 60 s
    times = np.arange(0, 90.0)
    along = s(times) + np.clip(times - 60.0, 0.0, None) ** 2 / 2.0
    lanes = (times > at).astype(int)
    trace = trace_of(
        times, np.column_stack([along, 3.2 * lanes]), 0.0, np.gradient(along),
        lanes=lanes, offsets=along,
    )  # fmt: skip
    trajectory = shown(trace, "lane", network, NAMES)
    assert_sound(trajectory, trace, refused={"parking"})
    (piece,) = trajectory.pieces
    assert accelerations(piece).max() <= 6.0
    motion = trajectory.sample(np.arange(0, 89, FINE))
    assert np.degrees(between(motion.yaws, 0.0)).max() <= 35.0


def test_a_lane_change_right_after_birth_and_before_death():
    network, trace = changing(25.0, changes=(0.5, 9.5), last=10.0)
    trajectory = shown(trace, "lane", network, NAMES)
    assert_sound(trajectory, trace, refused={"lane change"})
    for index in (0, -1):
        where = trajectory.at(trace.times[index]).position
        np.testing.assert_allclose(where, trace.positions[index], atol=0.02)


def test_lanes_side_by_side_at_other_heights_do_not_pitch():
    shapes = {"a_0": [(0, 0, 0), (900, 0, 0)], "a_1": [(0, 3.2, 0.4), (900, 3.2, 0.4)]}
    network = network_of(shapes)
    _, flat = changing(14.0)
    heights = flat.positions + [0.0, 0.0, 0.4] * (flat.lanes[:, None] == 1)
    trace = trace_of(flat.times, heights, 0.0, 14.0, lanes=flat.lanes, offsets=flat.offsets)
    motion = shown(trace, "lane", network, NAMES).sample(np.arange(0, 40, FINE))
    assert np.degrees(np.abs(motion.pitches)).max() <= 1.5  # a step in 1 s would be 1.6 and more


# Braking -----------------------------------------------------------------------------------


@CURVED
@BOTH_LOGS
@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
def test_braking_at_9_is_no_harder_than_twice_that(smoother, euler, step):
    network, way = road("straight")
    s = stopping(5.3, 9.0, 30.0)
    trace = drive(way, np.arange(0, 15, step), s, euler=euler)
    trajectory = shown(trace, smoother, network, way.names)
    assert_sound(trajectory, trace)
    (piece,) = trajectory.pieces
    # Rounded to 1 cm, places 0.1 s apart differ by up to 2 m/s2 in their second difference.
    assert accelerations(piece).max() <= 2.0 * max(9.0, logged_acceleration(trace)) + 0.02 / step**2
    motion = trajectory.sample(np.arange(0, 14, FINE))
    assert np.diff(motion.positions[:, 0]).min() >= -1e-9
    assert motion.speeds[-1] == pytest.approx(0.0, abs=1e-6)
