"""Both smoothers on what SUMO logs, pathologies included."""

import re
import time
from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import MotionSettings
from sumo3dviz_pt.model.traffic import Trace, TrafficLog
from sumo3dviz_pt.motion import MARGIN, smooth, smooth_log, smoother_names
from sumo3dviz_pt.motion.smoothers.paper import HEADING_HALF_WIDTH, POSITION_HALF_WIDTH

NORTH = np.pi / 2
BOTH = pytest.mark.parametrize("smoother", ["paper", "paper_symmetric"])


def trace_of(times, xy, yaws=0.0, speeds=np.nan, *, name="a", kind="vehicle", type_id="car"):
    times = np.asarray(times, dtype=float)
    xy = np.asarray(xy, dtype=float)
    positions = np.zeros((len(times), 3))
    positions[:, : xy.shape[1]] = xy
    full = np.ones(len(times))
    none = np.full(len(times), -1)
    return Trace(
        name, kind, type_id, times, positions, yaws * full, speeds * full, 0 * full, none, none
    )


def log_of(*traces, step=1.0):
    return TrafficLog(traces, (), 0.0, 100.0, step)


def angle_between(first, second):
    return np.abs((np.asarray(first) - second + np.pi) % (2 * np.pi) - np.pi)


def literal_paper(times, x, y, angles):
    """The paper's text as loops: frame times, x, y and unwrapped heading, angle in SUMO's sense."""
    angles = np.unwrap(angles)
    frames = []
    while times[0] + len(frames) / 25 <= times[-1] + 1e-9:
        frames.append(times[0] + len(frames) / 25)
    xs, ys, angs = (np.interp(frames, times, column) for column in (x, y, angles))

    def average(values, half):
        means = []
        for i in range(len(values)):
            window = values[max(0, i - half) : i + half + 1]
            means.append(sum(window) / len(window))
        return means

    xs, ys, angs = average(xs, 10), average(ys, 10), average(angs, 10)
    headings = [angs[0]]
    for i in range(1, len(frames)):
        dx, dy = xs[i] - xs[i - 1], ys[i] - ys[i - 1]
        moved = (dx * dx + dy * dy) ** 0.5 > 0.03
        headings.append(np.pi / 2 - np.arctan2(dy, dx) if moved else angs[i])
    return np.array(frames), xs, ys, average(np.unwrap(headings), 20)


def test_names_are_offered():
    assert {"paper", "paper_symmetric"} <= set(smoother_names())


def test_the_scene_file_names_them_all():
    told = MotionSettings.model_fields["smoother"]
    assert told.default in smoother_names()
    assert {name.strip() for name in re.split(r",| or ", told.description)} == set(smoother_names())


def test_unknown_smoother_suggests_one():
    with pytest.raises(ConfigError, match="did you mean 'paper_symmetric'"):
        smooth(trace_of([0], [[0, 0]]), smoother="paper_symetric")
    with pytest.raises(ConfigError):
        smooth_log(log_of(), smoother="nothing")


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
def test_paper_is_what_the_paper_says(step):
    generator = np.random.default_rng(3)
    times = 7.3 + np.arange(40) * step
    x, y = np.cumsum(generator.normal(5, 3, (2, 40)) * step, axis=1)
    sumo = np.cumsum(generator.normal(0, 0.3, 40))
    trace = trace_of(times, np.column_stack([x, y]), np.pi / 2 - sumo, 200.0)
    trajectory = smooth(trace, smoother="paper")
    frames, xs, ys, headings = literal_paper(times, x, y, sumo)
    motion = trajectory.sample(frames)
    assert motion.alive.all()
    np.testing.assert_allclose(motion.positions[:, 0], xs, atol=1e-9)
    np.testing.assert_allclose(motion.positions[:, 1], ys, atol=1e-9)
    assert angle_between(motion.yaws, np.pi / 2 - np.array(headings)).max() < 1e-9


def test_paper_pulls_the_ends_as_measured():
    # Measured on the peer: first frame 2.52 m ahead, last 2.80 m behind at 14 m/s.
    times = np.arange(31.0)
    trace = trace_of(times, np.column_stack([14 * times, 0 * times]), 0.0, 14.0)
    trajectory = smooth(trace, smoother="paper")
    assert trajectory.at(0.0).position[0] == pytest.approx(2.8, abs=0.3)
    assert trajectory.at(30.0).position[0] == pytest.approx(420 - 2.8, abs=0.3)


def test_symmetric_ends_are_exact_and_straight_lines_kept():
    times = 86000 + np.arange(31.0)
    xy = np.column_stack([14 * (times - 86000) + 4.5e5, 3 * (times - 86000) + 5e6])
    trajectory = smooth(trace_of(times, xy, np.arctan2(3, 14), 14.4), smoother="paper_symmetric")
    asked = np.linspace(86000, 86030, 997)
    motion = trajectory.sample(asked)
    expected = np.column_stack([14 * (asked - 86000) + 4.5e5, 3 * (asked - 86000) + 5e6])
    assert np.abs(motion.positions[:, :2] - expected).max() < 1e-8
    assert np.abs(motion.speeds - np.hypot(14, 3)).max() < 1e-7
    assert angle_between(motion.yaws, np.arctan2(3, 14)).max() < 1e-8


def test_symmetric_is_the_average_of_the_interpolation():
    generator = np.random.default_rng(1)
    times = np.arange(0, 20, 0.5)
    xy = np.cumsum(generator.normal(0, 2, (40, 2)), axis=0)
    trajectory = smooth(trace_of(times, xy, 0.0, 20.0), smoother="paper_symmetric")
    for t in (0.1, 0.3, 5.123, 10.0, 19.4):
        half = min(0.42, t, 19.5 - t)
        fine = t + (np.arange(20000) + 0.5) / 20000 * 2 * half - half
        expected = [np.interp(fine, times, column).mean() for column in xy.T]
        np.testing.assert_allclose(trajectory.at(t).position[:2], expected, atol=1e-6)


@pytest.mark.parametrize("t", [0.05, 0.2, 0.9, 4.77, 11.3, 11.45])
def test_symmetric_speed_is_the_derivative(t):
    generator = np.random.default_rng(2)
    times = np.arange(0, 11.6, 0.1)
    xy = np.cumsum(generator.normal(0.5, 0.2, (len(times), 2)), axis=0)
    trajectory = smooth(trace_of(times, xy, 0.0, 20.0), smoother="paper_symmetric")
    ahead, behind = trajectory.at(t + 1e-6).position, trajectory.at(t - 1e-6).position
    assert trajectory.at(t).speed == pytest.approx(np.linalg.norm(ahead - behind) / 2e-6, rel=1e-3)


def test_asked_window_changes_nothing():
    generator = np.random.default_rng(5)
    times = np.arange(0, 60, 0.5)
    xy = np.cumsum(generator.normal(2, 1, (120, 2)), axis=0)
    yaws = np.cumsum(generator.normal(0, 0.2, 120))
    whole = smooth(trace_of(times, xy, yaws, 50.0), smoother="paper_symmetric")
    margin = POSITION_HALF_WIDTH + HEADING_HALF_WIDTH + 0.5
    assert margin < MARGIN
    kept = (times >= 20 - margin) & (times <= 30 + margin)
    part = smooth(trace_of(times[kept], xy[kept], yaws[kept], 50.0), smoother="paper_symmetric")
    asked = np.linspace(20, 30, 333)
    one, other = whole.sample(asked), part.sample(asked)
    assert np.abs(one.positions - other.positions).max() < 1e-9
    assert angle_between(one.yaws, other.yaws).max() < 1e-9


@BOTH
@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("fps", [25.0, 29.97, 60.0])
def test_every_frame_time_is_answered(smoother, step, fps):
    times = 100 + np.arange(int(8 / step) + 1) * step
    trace = trace_of(times, np.column_stack([10 * times, 0 * times]), 0.0, 10.0)
    trajectory = smooth(trace, smoother=smoother, step=step)
    frames = 101 + np.arange(int(6 * fps)) / fps
    motion = trajectory.sample(frames)
    assert motion.alive.all()
    np.testing.assert_allclose(motion.positions[:, 0], 10 * frames, atol=1e-7)
    singly = np.array([trajectory.at(t).position for t in frames[::17]])
    np.testing.assert_array_equal(singly, motion.positions[::17])


@BOTH
def test_outside_its_life_there_is_nothing(smoother):
    trajectory = smooth(trace_of([3, 4, 5], [[0, 0], [5, 0], [9, 0]]), smoother=smoother)
    assert trajectory.at(2.99) is None
    assert trajectory.at(5.01) is None
    assert trajectory.at(3.0) is not None
    assert trajectory.at(5.0) is not None


@BOTH
def test_waiting_facing_north_never_spins(smoother):
    times = np.arange(31.0)
    moved = np.maximum(times - 15, 0) ** 2
    trace = trace_of(times, np.column_stack([0 * times, moved]), NORTH, np.gradient(moved))
    yaws = smooth(trace, smoother=smoother).sample(np.arange(0, 30, 0.04)).yaws
    assert angle_between(yaws, NORTH).max() < 1e-6


@BOTH
def test_parked_keeps_its_angle(smoother):
    trace = trace_of(np.arange(20.0), np.ones((20, 2)), np.pi / 4, 0.0)
    motion = smooth(trace, smoother=smoother).sample(np.arange(0, 19, 0.04))
    assert angle_between(motion.yaws, np.pi / 4).max() < 1e-9
    assert np.abs(motion.positions[:, :2] - 1).max() < 1e-9
    assert motion.speeds.max() < 1e-9


def test_reversing_keeps_sumos_angle():
    times = np.arange(20.0)
    trace = trace_of(times, np.column_stack([-2 * times, 0 * times]), 0.0, 2.0)
    yaws = smooth(trace, smoother="paper_symmetric").sample(np.arange(0, 19, 0.04)).yaws
    assert angle_between(yaws, 0).max() < 1e-9


def test_slow_instant_lane_change_does_not_turn_the_car_across():
    times = np.arange(20.0)
    xy = np.column_stack([0.9 * times, 3.2 * (times >= 10)])
    yaws = (
        smooth(trace_of(times, xy, 0.0, 0.9), smoother="paper_symmetric")
        .sample(np.arange(0, 19, 0.04))
        .yaws
    )
    assert angle_between(yaws, 0).max() <= np.pi / 3


@BOTH
def test_wrap_at_full_circle_is_smooth(smoother):
    times = np.arange(20.0)
    yaws = np.pi + 0.02 * (-1) ** np.arange(20)
    trace = trace_of(times, np.column_stack([-5 * times, 0 * times]), yaws, 5.0)
    shown = smooth(trace, smoother=smoother).sample(np.arange(0, 19, 0.04)).yaws
    assert angle_between(shown, np.pi).max() < np.radians(2)


@BOTH
def test_u_turn_goes_round(smoother):
    times = np.arange(0, 20, 0.5)
    turned = np.clip((times - 8) / 3.1, 0, 1) * np.pi
    along = 5 * np.where(times < 8, times - 8, 0)
    back = 5 * np.maximum(times - 11.1, 0)
    xy = np.column_stack([along + 5 * np.sin(turned) - back, 5 - 5 * np.cos(turned)])
    motion = smooth(trace_of(times, xy, turned, 5.0), smoother=smoother).sample(
        np.arange(0, 19, 0.04)
    )
    expected = np.clip((np.arange(0, 19, 0.04) - 8) / 3.1, 0, 1) * np.pi
    assert angle_between(motion.yaws, expected).max() < np.radians(26)
    assert np.abs(np.diff(np.unwrap(motion.yaws))).max() < np.radians(4)


@BOTH
def test_teleport_is_not_slid_across(smoother):
    times = np.arange(20.0)
    x = 10 * times + 1000 * (times >= 10)
    trajectory = smooth(trace_of(times, np.column_stack([x, 0 * x]), 0.0, 10.0), smoother=smoother)
    assert len(trajectory.pieces) == 2
    assert trajectory.at(9.5) is None
    xs = trajectory.sample(np.arange(0, 19.01, 0.04)).positions[:, 0]
    assert not np.any((xs > 100) & (xs < 1090))


@BOTH
def test_missing_rows_are_not_flown_across(smoother):
    times = np.r_[np.arange(10.0), np.arange(19.0, 30)]
    trace = trace_of(times, np.column_stack([times, 0 * times]), 0.0, 1.0)
    trajectory = smooth(trace, smoother=smoother)
    assert trajectory.at(9.0) is not None
    assert trajectory.at(12.0) is None
    assert trajectory.at(19.0) is not None


@BOTH
def test_one_sample_exists_at_its_time_only(smoother):
    trajectory = smooth(trace_of([4.0], [[7, 8]], 1.0), smoother=smoother, step=1.0)
    pose = trajectory.at(4.0)
    np.testing.assert_allclose(pose.position, [7, 8, 0])
    assert pose.yaw == pytest.approx(1.0)
    assert trajectory.at(4.02) is None


def test_two_samples_are_a_straight_line():
    trajectory = smooth(trace_of([0, 1], [[0, 0], [10, 0]], 0.0, 10.0), smoother="paper_symmetric")
    xs = [trajectory.at(t).position[0] for t in (0, 0.25, 0.5, 1)]
    np.testing.assert_allclose(xs, [0, 2.5, 5, 10], atol=1e-12)


def test_two_samples_one_tick_apart_survive_the_paper():
    trajectory = smooth(trace_of([0, 0.01], [[0, 0], [0.1, 0]], 0.0, 10.0), smoother="paper")
    assert trajectory.at(0.01).speed == 0.0


def test_height_and_slope_are_smoothed_alike():
    times = np.arange(20.0)
    xyz = np.column_stack([10 * times, 0 * times, times])
    trace = trace_of(times, xyz, 0.0, 10.0)
    trace.slopes[:] = 0.1
    pose = smooth(trace, smoother="paper_symmetric").at(7.77)
    assert pose.position[2] == pytest.approx(7.77)
    assert pose.pitch == pytest.approx(0.1)


def test_log_numbers_reused_ids():
    times = np.arange(5.0)
    line = np.column_stack([5 * times, 0 * times])
    car = trace_of(times, line)
    bus = trace_of(times + 50, line, type_id="bus")
    walker = trace_of(times, line + 9, name="a", kind="person")
    again = trace_of(times + 90, line, type_id="truck")
    found = smooth_log(log_of(car, bus, walker, again), smoother="paper_symmetric")
    assert [t.key for t in found] == ["vehicle:a", "vehicle:a#2", "person:a", "vehicle:a#3"]
    assert [t.type_id for t in found] == ["car", "bus", "car", "truck"]


def test_log_uses_the_step_of_the_log():
    sparse = trace_of([0, 2, 4], [[0, 0], [1, 0], [2, 0]], 0.0, 1.0)
    (found,) = smooth_log(log_of(sparse, step=1.0), smoother="paper")
    assert len(found.pieces) == 3
    (found,) = smooth_log(log_of(sparse, step=0.0), smoother="paper")
    assert len(found.pieces) == 1


def test_thousand_vehicles_for_a_minute_are_quick():
    times = np.arange(60.0)
    xy = np.column_stack([10 * times, np.sin(times)])
    log = log_of(*(trace_of(times, xy + i, 0.0, 10.0, name=str(i)) for i in range(200)))
    started = time.process_time()
    for trajectory in smooth_log(log, smoother="paper_symmetric"):
        trajectory.sample(np.arange(0, 59, 0.04))
    assert 5 * (time.process_time() - started) < 10.0


def test_crests_are_not_cut():
    trace = trace_of(np.arange(0.0, 9.0), np.stack([20.0 * np.arange(9), np.zeros(9)], axis=1))
    heights = np.array([0, 1, 2, 3, 4, 3, 2, 1, 0], dtype=float)
    positions = np.column_stack([trace.positions[:, :2], heights])
    crested = smooth(replace(trace, positions=positions), smoother="paper_symmetric")
    # Averaged over 0.84 s like x and y, the top would sink by 0.21 m.
    assert crested.at(4.0).position[2] == pytest.approx(4.0, abs=0.06)
