"""How far somebody has walked, and what of a stride they show."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.scene.gait import Walk, effort


def walk_of(speed, *, count=30):
    times = np.arange(float(count))
    ones, none = np.ones(count), np.full(count, -1)
    positions = np.column_stack([speed * times, 0 * times, 0 * times])
    trace = Trace("p", "person", "", times, positions, 0 * ones, speed * ones, 0 * ones, none, none)
    (piece,) = smooth(trace, smoother="paper_symmetric", step=1.0).pieces
    return Walk.of(piece)


def test_distance_is_what_was_walked():
    walk = walk_of(1.4)
    assert walk.distances[-1] == pytest.approx(1.4 * 29, rel=1e-3)
    assert (np.diff(walk.distances) >= 0).all()


def test_a_stride_is_two_steps_long():
    walk = walk_of(1.4)
    first = walk.phase(10.0, stride=1.4, start=0.25)
    assert walk.phase(11.0, stride=1.4, start=0.25) == pytest.approx(first, abs=0.01)
    half = walk.phase(10.5, stride=1.4, start=0.25)
    assert (half - first) % 1.0 == pytest.approx(0.5, abs=0.01)


def test_who_stands_keeps_the_phase():
    walk = walk_of(0.0)
    phases = {walk.phase(t, stride=1.4, start=0.4) for t in (0.0, 3.3, 20.0)}
    assert phases == {0.4}
    assert effort(0.0) == 0.0
    assert effort(1.4) == 1.0
    assert 0.0 < effort(0.2) < 1.0
