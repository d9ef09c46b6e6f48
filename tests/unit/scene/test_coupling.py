"""How many units make a train of a length."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.scene.coupling import coupled, pitch_of, spare_units

TRAIN = [
    {"model": "engine", "at": 0.0},
    {"model": "car", "at": -20.0, "repeat": True, "pitch": 25.0},
    {"model": "last", "at": -45.0},
]


def test_what_is_not_repeated_stays_as_it_is():
    rows = [TRAIN[0], TRAIN[2]]
    assert pitch_of(rows) == 0.0
    assert spare_units(60.0, 0.0, wanted=500.0) == 0
    assert coupled(rows, 0) == [("engine", 0.0), ("last", -45.0)]


@pytest.mark.parametrize(("wanted", "more"), [(20.0, -1), (45.0, -1), (70.0, 0), (96.0, 1)])
def test_as_many_as_need_the_least_stretching(wanted, more):
    assert spare_units(70.0, 25.0, wanted=wanted) == more


def test_units_follow_one_another():
    names = [name for name, _ in coupled(TRAIN, 2)]
    assert names == ["engine", "car", "car", "car", "last"]
    assert [x for _, x in coupled(TRAIN, 2)] == [0.0, -20.0, -45.0, -70.0, -95.0]
    assert coupled(TRAIN, -1) == [("engine", 0.0), ("last", -20.0)]


@given(st.floats(40.0, 1000.0))
def test_stretching_is_little(wanted):
    length = 70.0 + 25.0 * spare_units(70.0, 25.0, wanted=wanted)
    assert 0.75 < wanted / length < 1.3
