"""Laws of the default smoother."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion import smooth

STEPS = st.sampled_from([0.1, 0.5, 1.0, 2.0])
NUMBERS = st.floats(-20, 20)


@st.composite
def traces(draw, straight=False):
    step = draw(STEPS)
    count = draw(st.integers(2, 30))
    times = draw(st.floats(0, 90000)) + step * np.arange(count)
    rates = np.array(draw(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=30)))
    rates = rates[np.zeros(count - 1, int) if straight else np.arange(count - 1) % len(rates)]
    xy = np.cumsum(np.concatenate([draw_origin(draw), rates * step]), axis=0)
    full = np.zeros(count)
    yaws = np.cumsum(full + draw(st.floats(-1, 1)))
    ints = np.full(count, -1)
    positions = np.column_stack([xy, full])
    return Trace("a", "vehicle", "", times, positions, yaws, full + 30, full, ints, ints)


def draw_origin(draw):
    return np.array([[draw(st.floats(-5e6, 5e6)), draw(st.floats(-5e6, 5e6))]])


def times_within(trace, count=200):
    return np.linspace(trace.times[0], trace.times[-1], count)


@settings(max_examples=tries(60), deadline=None)
@given(traces(straight=True))
def test_straight_lines_are_kept(trace):
    asked = times_within(trace)
    motion = smooth(trace, smoother="paper_symmetric").sample(asked)
    share = (asked - trace.times[0]) / (trace.times[-1] - trace.times[0])
    expected = trace.positions[0] + share[:, None] * (trace.positions[-1] - trace.positions[0])
    assert np.abs(motion.positions - expected).max() < 1e-6


@settings(max_examples=tries(60), deadline=None)
@given(traces())
def test_error_is_bounded_by_speed_times_half_window(trace):
    asked = times_within(trace)
    motion = smooth(trace, smoother="paper_symmetric").sample(asked)
    linear = np.column_stack([np.interp(asked, trace.times, c) for c in trace.positions.T])
    rates = np.diff(trace.positions, axis=0) / np.diff(trace.times)[:, None]
    fastest = np.linalg.norm(rates, axis=1).max()
    errors = np.linalg.norm(motion.positions - linear, axis=1)
    assert errors.max() <= 0.42 * fastest + 1e-6
    assert motion.speeds.max() <= fastest * (1 + 1e-6) + 1e-5
    steps = np.linalg.norm(np.diff(motion.positions, axis=0), axis=1)
    assert (steps <= fastest * np.diff(asked) + 1e-6).all()


@settings(max_examples=tries(60), deadline=None)
@given(traces())
def test_ends_are_exact(trace):
    trajectory = smooth(trace, smoother="paper_symmetric")
    first, last = trajectory.at(trace.times[0]), trajectory.at(trace.times[-1])
    np.testing.assert_allclose(first.position, trace.positions[0], atol=1e-8)
    np.testing.assert_allclose(last.position, trace.positions[-1], atol=1e-8)


@settings(max_examples=tries(40), deadline=None)
@given(traces(), st.sampled_from([24.0, 25.0, 29.97, 60.0]))
def test_pose_at_a_time_is_the_same_however_asked(trace, fps):
    trajectory = smooth(trace, smoother="paper_symmetric")
    count = int((trace.times[-1] - trace.times[0]) * fps)
    frames = trace.times[0] + np.arange(count + 1) / fps
    together = trajectory.sample(frames)
    for index in {0, count // 2, count}:
        alone = trajectory.sample(frames[index : index + 1])
        np.testing.assert_array_equal(alone.positions[0], together.positions[index])
        np.testing.assert_array_equal(alone.yaws[0], together.yaws[index])
    assert np.isfinite(together.yaws).all()
    assert np.abs(together.yaws).max() <= np.pi
