"""How many units make a train of a length."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.cast.choice import Carriages, coupled, numbered, pitch_of, spare_units

TRAIN = [
    {"model": "engine", "at": 0.0},
    {"model": "car", "at": -20.0, "repeat": True, "pitch": 25.0},
    {"model": "last", "at": -45.0},
]


def named(placed):
    """Names of units and where they are."""
    return [(row["model"], x) for row, x in placed]


def test_what_is_not_repeated_stays_as_it_is():
    rows = [TRAIN[0], TRAIN[2]]
    assert pitch_of(rows) == 0.0
    assert spare_units(60.0, 0.0, wanted=500.0) == 0
    assert named(coupled(rows, 0)) == [("engine", 0.0), ("last", -45.0)]


@pytest.mark.parametrize(("wanted", "more"), [(20.0, -1), (45.0, -1), (70.0, 0), (96.0, 1)])
def test_as_many_as_need_the_least_stretching(wanted, more):
    assert spare_units(70.0, 25.0, wanted=wanted) == more


def test_units_follow_one_another():
    names = [name for name, _ in named(coupled(TRAIN, 2))]
    assert names == ["engine", "car", "car", "car", "last"]
    assert [x for _, x in coupled(TRAIN, 2)] == [0.0, -20.0, -45.0, -70.0, -95.0]
    assert named(coupled(TRAIN, -1)) == [("engine", 0.0), ("last", -20.0)]


@pytest.mark.parametrize(
    ("count", "names"),
    [(1, "engine"), (2, "engine last"), (4, "engine car car last"), (5, "engine car car car last")],
)
def test_a_number_of_units(count, names):
    assert [row["model"] for row in numbered(TRAIN, count)] == names.split()


@pytest.mark.parametrize("text", ["", "x", "-1", "nan", "1e9"])
def test_lengths_that_say_nothing(text):
    assert Carriages.of({"locomotiveLength": text, "carriageGap": "2"}) is None


def test_what_is_not_said_of_a_train_is_sumos_default():
    assert Carriages.of({"carriageLength": "25"}) == Carriages(25.0, 25.0, 1.0)
    assert Carriages.of({"locomotiveLength": "18", "carriageGap": "0"}) == Carriages(18, 18, 0)


@given(st.floats(10.0, 400.0), st.floats(5.0, 30.0), st.floats(5.0, 30.0), st.floats(0.0, 2.0))
def test_carriages_fill_the_train(length, locomotive, carriage, gap):
    spans = Carriages(locomotive, carriage, gap).split(length)
    ends = [start + own for start, own in spans]
    assert spans[0][0] == 0.0
    assert ends[-1] == pytest.approx(length)
    assert all(own > 0.0 for _, own in spans)
    assert all(b > a - 1e-9 for a, (b, _) in zip(ends, spans[1:], strict=False))


@given(st.floats(40.0, 1000.0))
def test_stretching_is_little(wanted):
    length = 70.0 + 25.0 * spare_units(70.0, 25.0, wanted=wanted)
    assert 0.75 < wanted / length < 1.3
