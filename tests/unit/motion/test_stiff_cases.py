"""Hard logs: sparse, torn, doubled, far away, standing still. Each with what must come out.

`lane` gets the road; `hermite` and `linear` get places, speeds and angles only.
Manoeuvres have a file of their own, `test_stiff_manoeuvres.py`.
"""

import numpy as np
import pytest
from drives import (
    TYPES,
    accelerations,
    assert_sound,
    between,
    drive,
    frames,
    kinds_of,
    log_of,
    logged_acceleration,
    network_of,
    road,
    shown,
    straight,
    trace_of,
)

from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.sumo.fcd import read_trajectories

SMOOTHERS = ("linear", "hermite", "lane")
SMOOTH = ("hermite", "lane")
ALL = pytest.mark.parametrize("smoother", SMOOTHERS)
CURVED = pytest.mark.parametrize("smoother", SMOOTH)
BOTH_LOGS = pytest.mark.parametrize("euler", [False, True], ids=["rates", "euler"])
HEADINGS = pytest.mark.parametrize("heading", ["chord", "tractrix"])


def integral(times, speeds, start=20.0):
    """A way s(t) whose speed is piecewise linear in time."""
    knots = np.linspace(times[0] - 1.0, times[-1] + 1.0, 20001)
    pace = np.interp(knots, times, speeds)
    along = np.r_[0.0, np.cumsum((pace[1:] + pace[:-1]) / 2 * np.diff(knots))]
    begin = np.interp(times[0], knots, along)
    return lambda t: start - begin + np.interp(t, knots, along)


# Standing and creeping ---------------------------------------------------------------------


@ALL
@BOTH_LOGS
@pytest.mark.parametrize("step", [0.1, 1.0])
def test_minutes_of_standstill_then_a_start(smoother, euler, step):
    network, way = road("straight")
    s = integral(np.array([0, 4, 9, 189, 199, 205.0]), np.array([10, 10, 0, 0, 14, 14.0]))
    trace = drive(way, np.arange(0, 205 + step / 2, step), s, euler=euler)
    trajectory = shown(trace, smoother, network, way.names)
    assert_sound(trajectory, trace)
    (piece,) = trajectory.pieces
    waiting = piece.sample(np.arange(11.0, 188.0, 0.04))
    assert np.ptp(waiting.positions, axis=0).max() < 1e-6
    assert waiting.speeds.max() < 1e-6
    assert np.degrees(between(waiting.yaws, 0.0)).max() < 0.05
    assert trajectory.remarks == ()


@CURVED
@BOTH_LOGS
def test_a_start_from_standstill_is_no_harder_than_three_times_the_logs(smoother, euler):
    # A cubic that must rise monotonically from rest needs up to three times the mean.
    network, way = road("straight")
    s = integral(np.array([0, 10, 15, 25.0]), np.array([0, 0, 13, 13.0]))
    trace = drive(way, np.arange(0, 25.5, 1.0), s, euler=euler)
    (piece,) = shown(trace, smoother, network, way.names).pieces
    assert accelerations(piece).max() <= 3.0 * logged_acceleration(trace)


@ALL
@BOTH_LOGS
def test_stop_and_go_at_a_tenth_of_a_metre_a_second(smoother, euler):
    network, way = road("straight")
    corners = np.arange(0, 61, 1.0)
    s = integral(corners, np.where(corners % 6 < 3, 0.1, 0.0))
    trace = drive(way, np.arange(0, 61, 1.0), s, euler=euler)
    trajectory = shown(trace, smoother, network, way.names)
    assert_sound(trajectory, trace)
    motion = trajectory.sample(np.arange(0, 60, 0.04))
    assert np.diff(motion.positions[:, 0]).min() >= -1e-9
    assert motion.positions[-1, 0] == pytest.approx(trace.positions[-1, 0], abs=0.02)
    assert motion.speeds.max() <= 0.3
    assert np.degrees(between(motion.yaws, 0.0)).max() <= 0.5


@ALL
@HEADINGS
def test_rounding_while_standing_turns_nothing(smoother, heading):
    # A queue's car creeps by SUMO's last digit, now here, now there.
    noise = np.random.default_rng(4).integers(-1, 2, (60, 2)) * 0.01
    xy = np.column_stack([np.full(60, 40.0), np.zeros(60)]) + noise
    trace = trace_of(np.arange(60.0), xy, np.pi / 2, 0.0)
    motion = shown(trace, smoother, heading=heading).sample(np.arange(0, 59, 0.04))
    assert np.degrees(between(motion.yaws, np.pi / 2)).max() <= 1.0


@ALL
@HEADINGS
@pytest.mark.parametrize("facing", [np.pi / 2, np.pi, -np.pi / 2, 0.0])
def test_angles_that_wrap_do_not_spin(smoother, heading, facing):
    # SUMO's 359.99 and 0.01 in turn; ours wraps at west.
    yaws = facing + np.radians(0.01) * (-1) ** np.arange(40)
    along = 8.0 * np.arange(40.0)
    xy = along[:, None] * [np.cos(facing), np.sin(facing)]
    network = straight(turn=facing, lanes=1)
    trace = trace_of(np.arange(40.0), xy, yaws, 8.0, lanes=0, offsets=along)
    trajectory = shown(trace, smoother, network, ("a_0",), heading=heading)
    assert_sound(trajectory, trace)
    motion = trajectory.sample(np.arange(0, 39, 0.04))
    assert np.degrees(between(motion.yaws, facing)).max() <= 0.2


# Few, far apart, uneven --------------------------------------------------------------------


@ALL
@pytest.mark.parametrize("fps", [23.976, 25.0, 60.0, 120.0])
def test_one_sample_exists_at_its_time_only(smoother, fps):
    network, way = road("straight")
    trace = drive(way, np.array([7.0]), lambda t: 12.0 * t)
    trajectory = shown(trace, smoother, network, way.names)
    assert_sound(trajectory, trace, fps=fps)
    assert trajectory.sample(np.arange(0, 20, 0.5)).alive.sum() == 1
    pose = trajectory.at(7.0)
    np.testing.assert_allclose(pose.position, [84, 0, 0])
    assert pose.yaw == pytest.approx(0.0)
    assert trajectory.at(7.0 + 1 / fps) is None


@ALL
@BOTH_LOGS
def test_two_samples_are_a_drive(smoother, euler):
    network, way = road("straight")
    trace = drive(way, np.array([3.0, 4.0]), lambda t: 12.0 * t, euler=euler)
    trajectory = shown(trace, smoother, network, way.names)
    assert_sound(trajectory, trace)
    asked = np.linspace(3, 4, 26)
    motion = trajectory.sample(asked)
    np.testing.assert_allclose(motion.positions[:, 0], 12 * asked, atol=0.01)
    assert np.degrees(between(motion.yaws, 0.0)).max() < 0.1


@ALL
@pytest.mark.parametrize("name", ["straight", "corner", "roundabout", "ramp"])
def test_samples_ten_seconds_apart(name, smoother):
    network, way = road(name)
    trace = drive(way, np.arange(0, 31, 10.0), lambda t: 30.0 + 5.0 * t)
    trajectory = shown(trace, smoother, network, way.names)
    # Straight lines turn on the spot.
    turn = 720.0 if smoother == "linear" else 180.0
    assert_sound(trajectory, trace, refused={"unlike the log"}, turn=turn)
    asked = np.arange(0, 30.01, 0.04)
    motion = trajectory.sample(asked)
    if smoother == "lane":  # only the road tells what happened in ten seconds
        truth = way.at(30.0 + 5.0 * asked)
        assert np.linalg.norm(motion.positions - truth, axis=1).max() <= 0.5


@ALL
@BOTH_LOGS
def test_uneven_steps_at_even_speed(smoother, euler):
    network, way = road("straight")
    steps = np.tile([0.1, 1.0, 0.5, 0.04, 1.2, 0.1, 0.7], 6)
    times = np.round(np.r_[0.0, np.cumsum(steps)], 2)
    trace = drive(way, times, lambda t: 20.0 + 15.0 * t, euler=euler)
    trajectory = shown(trace, smoother, network, way.names, step=1.0)
    assert_sound(trajectory, trace)
    asked = np.arange(0, times[-1], 0.04)
    motion = trajectory.sample(asked)
    assert np.abs(motion.positions[:, 0] - 20.0 - 15.0 * asked).max() <= 0.02
    assert np.abs(motion.speeds - 15.0).max() <= 1.0  # rounding: 1 cm in 0.04 s is 0.25 m/s


@CURVED
def test_uneven_steps_while_braking(smoother):
    network, way = road("straight")
    s = integral(np.array([0, 5, 10, 15.0]), np.array([20, 20, 5, 5.0]))
    times = np.unique(np.round(np.random.default_rng(1).uniform(0, 15, 40), 1))
    trace = drive(way, times, s)
    (piece,) = shown(trace, smoother, network, way.names, step=1.0).pieces
    asked = frames(piece, 25.0)
    positions = piece.sample(asked).positions
    # The acceleration changes by 3 m/s2 somewhere within steps of up to 1.5 s.
    assert np.diff(times).max() <= 1.5
    assert np.abs(positions - way.at(s(asked))).max() <= 0.1


STEP = '<timestep time="{t:.2f}"><vehicle id="a" x="{x:.2f}" y="0.00" angle="90.00" type="car" '
STEP += 'speed="{v}" pos="{x:.2f}" lane="a_0" slope="{slope}"/></timestep>'


def read_log(folder, rows):
    """The log of rows (t, x, v), as the reader gives it."""
    body = "\n".join(STEP.format(t=t, x=x, v=v, slope=slope) for t, x, v, slope in rows)
    file = folder / "fcd.xml"
    file.write_text(f"<fcd-export>\n{body}\n</fcd-export>", encoding="utf-8")
    return read_trajectories([file])


@ALL
def test_overlapping_and_doubled_steps(smoother, tmp_path):
    # Two segments of a simulation, joined with an overlap, and a step written twice.
    times = [*range(11), 10, 10, *range(6, 21)]
    log = read_log(tmp_path, [(t, 30.0 + 11.0 * t, 11.0, 0.0) for t in times])
    network = straight() if smoother == "lane" else None
    (found,) = smooth_log(log, smoother=smoother, network=network, types=TYPES)
    assert_sound(found, log.traces[0])
    assert len(found.pieces) == 1
    asked = np.arange(0, 20, 0.04)
    positions = found.sample(asked).positions
    assert np.abs(positions[:, 0] - 30.0 - 11.0 * asked).max() <= 0.01


# Torn --------------------------------------------------------------------------------------


def torn(jump, missing):
    """A drive at 10 m/s that is `jump` further on from t = 10, with rows missing before."""
    times = np.r_[np.arange(11.0), np.arange(11.0 + missing, 25.0 + missing)]
    network, way = road("straight")
    return network, way, drive(way, times, lambda t: 20.0 + 10.0 * t + jump * (t > 10.5))


@ALL
@pytest.mark.parametrize("missing", [0, 1, 9], ids=lambda n: f"{n} rows missing")
@pytest.mark.parametrize("jump", [1.0, 8.0, 400.0])
def test_teleports_are_not_slid_across(smoother, jump, missing):
    network, way, trace = torn(jump, missing)
    trajectory = shown(trace, smoother, network, way.names)
    # A metre at 10 m/s is driving; 8 m are not, and may be shown only with a remark.
    assert_sound(trajectory, trace, refused={"unlike the log", "teleport"})
    inside = trajectory.sample(np.arange(10.04, trace.times[11] - 0.01, 0.04)).alive
    if missing or jump > 8.0:
        assert not inside.any()
        assert len(trajectory.pieces) == 2
        assert kinds_of(trajectory) & {"gap", "teleport"}
    elif jump < 8.0:
        assert inside.all()
        assert kinds_of(trajectory) == set()
    else:
        assert kinds_of(trajectory) & {"teleport", "unlike the log"}
    for sample in (10, 11):  # what was logged is shown, before and after
        where = trajectory.at(trace.times[sample]).position
        np.testing.assert_allclose(where, trace.positions[sample], atol=0.02)


@ALL
def test_a_gap_says_how_long_it_is(smoother):
    network, way, trace = torn(0.0, 9)
    (remark,) = shown(trace, smoother, network, way.names).remarks
    assert (remark.kind, remark.begin, remark.end) == ("gap", 10.0, 20.0)
    assert remark.value == pytest.approx(10.0)


@ALL
def test_a_teleport_says_how_far_it_went(smoother):
    network, way, trace = torn(400.0, 0)
    (remark,) = shown(trace, smoother, network, way.names).remarks
    assert (remark.kind, remark.begin, remark.end) == ("teleport", 10.0, 11.0)
    assert remark.value == pytest.approx(410.0, abs=10.0)


@ALL
def test_a_vehicle_of_one_step_in_a_long_log(smoother):
    network, way = road("straight")
    long = drive(way, np.arange(30.0), lambda t: 30.0 + 9.0 * t, id="long")
    short = drive(way, np.array([12.0]), lambda t: 5.0 + 0.0 * t, id="short")
    log = log_of(long, short, names=way.names)
    network = network if smoother == "lane" else None
    found = smooth_log(log, smoother=smoother, network=network, types=TYPES)[1]
    assert_sound(found, short)
    assert found.sample(np.arange(0, 30, 0.04)).alive.sum() == 1
    assert found.at(12.0).speed == 0.0


@ALL
def test_ids_that_come_back_as_another_class(smoother):
    network, way = road("straight")
    car = drive(way, np.arange(10.0), lambda t: 20.0 + 9.0 * t)
    bus = drive(way, np.arange(30.0, 40.0), lambda t: 9.0 * (t - 28.0), type_id="bus", length=12.0)
    network = network if smoother == "lane" else None
    log = log_of(car, bus, names=way.names)
    first, second = smooth_log(log, smoother=smoother, network=network, types=TYPES)
    assert (first.key, second.key) == ("vehicle:a", "vehicle:a#2")
    assert (first.type_id, second.type_id) == ("car", "bus")
    assert first.at(35.0) is None
    assert second.at(5.0) is None
    for trajectory, trace in ((first, car), (second, bus)):
        assert_sound(trajectory, trace)


# Far away in place and time ----------------------------------------------------------------


@CURVED
@HEADINGS
@pytest.mark.parametrize("name", ["corner", "roundabout"])
def test_five_thousand_kilometres_away_nothing_changes(name, smoother, heading):
    network, way = road(name)
    here = drive(way, np.arange(0, 26.0), lambda t: 30.0 + 5.0 * t)
    away = np.array([5e6, -5e6, 0.0])
    moved = {lane.id: lane.shape + away for lane in network.lanes.values()}
    links = [(c.from_lane, c.to_lane, c.via) for c in network.connections if c.via]
    there = trace_of(
        here.times, here.positions + away, here.yaws, here.speeds,
        lanes=here.lanes, offsets=here.offsets,
    )  # fmt: skip
    asked = np.arange(0, 25, 0.04)
    near = shown(here, smoother, network, way.names, heading=heading).sample(asked)
    far = shown(there, smoother, network_of(moved, links), way.names, heading=heading).sample(asked)
    assert np.abs(far.positions - away - near.positions).max() < 1e-5
    assert between(far.yaws, near.yaws).max() < 1e-4
    assert np.abs(far.speeds - near.speeds).max() < 1e-4


@ALL
def test_late_in_the_day_times_carry_noise(smoother):
    # Steps of 0.1 s added up one by one from a day's end: 86,400.29999999999, ...
    noisy = 86400.0 + np.cumsum(np.full(200, 0.1)) - 0.1
    noisy += np.random.default_rng(2).normal(0, 1e-10, 200)
    network, way = road("straight")
    trace = drive(way, noisy, lambda t: 20.0 + 14.0 * (t - 86400.0))
    trajectory = shown(trace, smoother, network, way.names)
    assert len(trajectory.pieces) == 1
    assert trajectory.remarks == ()
    assert_sound(trajectory, trace)
    asked = 86400.0 + np.arange(int(19.9 * 25)) / 25
    motion = trajectory.sample(asked)
    assert motion.alive.all()
    assert np.abs(motion.positions[:, 0] - 20.0 - 14.0 * (asked - 86400.0)).max() <= 0.02
    assert trajectory.at(86400.0 + 19.9) is not None


@ALL
@pytest.mark.parametrize("fps", [23.976, 24.0, 29.97, 60.0, 120.0])
@pytest.mark.parametrize("name", ["corner", "roundabout"])
def test_odd_and_high_frame_rates(name, smoother, fps):
    network, way = road(name)
    trace = drive(way, np.arange(3, 31.0), lambda t: 15.0 + 5.0 * t)
    assert_sound(shown(trace, smoother, network, way.names), trace, fps=fps)
