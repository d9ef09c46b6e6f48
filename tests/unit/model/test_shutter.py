"""A shutter: the moments at which a frame is seen."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.camera import INSTANT, Shutter, frame_step

MOMENTS = st.floats(-1e5, 1e5)


@given(MOMENTS, st.integers(1, 16))
def test_an_instant_is_the_frames_own_time_to_the_bit(time, count):
    assert INSTANT.is_instant
    assert INSTANT.at(time).times(count) == (time,)


@given(MOMENTS, st.floats(-1.0, 1.0), st.floats(1e-3, 1.0), st.integers(1, 16))
def test_sub_times_lie_evenly_in_the_span(time, opens, span, count):
    times = Shutter(opens, opens + span).at(time).times(count)
    assert len(times) == count
    assert sum(times) / count == pytest.approx(time + opens + span / 2, abs=1e-6)
    steps = [later - earlier for earlier, later in pairwise(times)]
    assert steps == pytest.approx([span / count] * (count - 1), abs=1e-6)
    assert time + opens - 1e-6 <= times[0] <= times[-1] <= time + opens + span + 1e-6


def test_half_a_frame_at_25_frames_a_second():
    shutter = Shutter(0.0, 0.02)
    assert not shutter.is_instant
    assert shutter.at(10.0).times(2) == pytest.approx((10.005, 10.015))


def test_a_shutter_cannot_close_before_it_opens():
    with pytest.raises(ValueError, match="opens at 0"):
        Shutter(0.2, 0.1)


@given(
    st.floats(0.0, 0.1).filter(lambda s: s == 0 or s > 1e-4),
    st.integers(1, 16),
    st.floats(0.0, 0.05).filter(lambda r: r == 0 or r > 1e-4),
)
def test_every_row_is_seen_equally_often_and_about_its_own_time(span, count, rolling):
    shutter = Shutter(0.0, span, count, rolling).at(10.0)
    exposures = shutter.exposures()
    own = count if span or not rolling else 1
    step = span / count if span else rolling / max(2, count)
    for row in np.linspace(0.01, 0.99, 23):
        seen = [time for time, (first, last) in exposures if first <= row < last]
        if span == 0.0 and rolling == 0.0:
            assert seen == [10.0]
            continue
        assert len(seen) == own
        middle = 10.0 + span / 2 + rolling * row
        assert abs(np.mean(seen) - middle) <= step * 0.5 + 1e-9 or rolling < step


def test_the_time_of_a_frame_is_between_it_and_the_next():
    assert frame_step([3.0, 3.5, 4.0], fps=25) == 0.5
    assert frame_step([3.0], fps=25) == 0.04
