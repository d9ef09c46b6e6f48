"""Rides at other times and paces keep their paths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.motion.samples import delayed, paced


def bend(n=13, step=1.0):
    """A ride around a bend that gets faster."""
    times = np.arange(n) * step
    along = 4.0 * times + 0.3 * times**2
    turn = along / 60.0
    places = np.stack([60 * np.sin(turn), 60 * (1 - np.cos(turn)), 0.1 * along], axis=1)
    speeds = 4.0 + 0.6 * times
    plain = np.zeros(n)
    numbers = np.full(n, -1)
    return Trace("a", "vehicle", "", times, places, turn, speeds, plain, numbers, numbers)


def test_a_delay_moves_the_same_ride_in_time():
    trace = bend()
    own = smooth(trace, smoother="lane")
    late = smooth(delayed(trace, 0.7), smoother="lane")
    times = np.linspace(1.0, 11.0, 40)
    a, b = own.sample(times), late.sample(times + 0.7)
    np.testing.assert_allclose(b.positions, a.positions, atol=1e-9)
    np.testing.assert_allclose(b.speeds, a.speeds, atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(pace=st.floats(0.5, 2.0), around=st.floats(0.0, 12.0))
def test_a_pace_keeps_the_path_and_multiplies_the_speed(pace, around):
    trace = bend()
    own = smooth(trace, smoother="lane", step=1.0)
    other = paced(trace, own, pace=pace, around=around, step=1.0)
    assert (np.diff(other.times) > 0).all()
    faster = smooth(other, smoother="lane", step=1.0)
    assert len(faster.pieces) == 1
    recorded = np.linspace(0.5, 11.5, 50)
    times = around + (recorded - around) / pace
    a, b = own.sample(recorded), faster.sample(times)
    np.testing.assert_allclose(b.positions, a.positions, atol=0.01)
    np.testing.assert_allclose(b.speeds, pace * a.speeds, atol=0.15)
    assert faster.pieces[0].end - faster.pieces[0].begin == pytest.approx(12.0 / pace)
