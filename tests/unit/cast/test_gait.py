"""What of a stride somebody shows."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.cast.poses import effort, head_rise, stride_phase


def test_a_stride_is_two_steps_long():
    first = stride_phase(10.0, stride=1.4, start=0.25)
    assert stride_phase(11.4, stride=1.4, start=0.25) == pytest.approx(first)
    half = stride_phase(10.7, stride=1.4, start=0.25)
    assert (half - first) % 1.0 == pytest.approx(0.5)


def test_who_stands_keeps_the_phase_and_rests():
    assert stride_phase(0.0, stride=1.4, start=0.4) == 0.4
    assert effort(0.0) == 0.0
    assert effort(1.4) == 1.0
    assert 0.0 < effort(0.2) < 1.0


def test_a_head_rises_twice_in_a_stride_and_is_lowest_when_a_heel_strikes():
    phases = np.linspace(0.0, 1.0, 201)
    rises = np.array([head_rise(phase, 1.0) for phase in phases])
    assert rises.max() - rises.min() == pytest.approx(0.04, abs=1e-3)
    assert rises[0] == rises.min() and rises[100] == pytest.approx(rises.min())
    assert rises.mean() == pytest.approx(0.0, abs=1e-3) and head_rise(0.3, 0.0) == 0.0
