"""What of a stride somebody shows."""

from __future__ import annotations

import pytest

from sumo3dviz_pt.cast.gait import effort, stride_phase


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
