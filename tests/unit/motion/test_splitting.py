"""Where traces are cut."""

import numpy as np
import pytest

from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion.samples import split


def cut_of(times, x, speeds, *, step=1.0):
    times = np.asarray(times, dtype=float)
    full = np.ones(len(times))
    positions = np.column_stack([x, 0 * full, 0 * full])
    ints = np.full(len(times), -1)
    trace = Trace(
        "a", "vehicle", "", times, positions, 0 * full, speeds * full, 0 * full, ints, ints
    )
    return [len(piece.times) for piece in split(trace, step=step)]


def test_nothing_is_nothing():
    assert cut_of([], np.zeros(0), np.zeros(0)) == []


def test_steps_within_reach_stay_whole():
    assert cut_of([0, 1, 2], [0, 17.9, 20], [10, 0, 0]) == [3]


def test_longer_step_is_a_teleport():
    assert cut_of([0, 1, 2], [0, 18.1, 20], [10, 0, 0]) == [1, 2]


@pytest.mark.parametrize(("gap", "cut"), [(1.49, [4]), (1.51, [2, 2])])
def test_gap_is_more_than_one_and_a_half_steps(gap, cut):
    assert cut_of([0, 1, 1 + gap, 2 + gap], [0, 1, 2, 3], 1.0) == cut


def test_without_step_no_gap_is_looked_for():
    assert cut_of([0, 1, 50], [0, 1, 2], 1.0, step=0.0) == [3]


def test_without_speed_neighbours_say_how_fast():
    assert cut_of(range(6), [0, 14, 28, 1028, 1042, 1056], np.nan) == [3, 3]
    assert cut_of(range(6), [0, 14, 28, 42, 56, 70], np.nan) == [6]


def test_without_speed_a_lone_step_may_be_fast_but_not_absurd():
    assert cut_of([0, 1], [0, 60], np.nan) == [2]
    assert cut_of([0, 1], [0, 500], np.nan) == [1, 1]


def test_speed_missing_at_one_sample_is_taken_from_the_other():
    assert cut_of([0, 1, 2], [0, 30, 31], np.array([30, np.nan, 1])) == [3]
