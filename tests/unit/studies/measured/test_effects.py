"""Eta squared in closed form, and events by frames."""

import math

import pytest

from sumo3dviz_pt.pipeline.accounts import brake_onsets
from sumo3dviz_pt.studies.measured.film import event_rows
from sumo3dviz_pt.studies.measured.report import effects

LEVELS = {"light": ("night", "day"), "trees": ("some", "none", "never shown")}
PROFILES = [(a, b) for a in ("day", "night") for b in ("some", "none")]


def found(values):
    return {
        each.factor: each for each in effects(LEVELS, PROFILES, [{"x": value} for value in values])
    }


def test_a_measure_that_tells_a_level_has_one():
    both = found([5.0, 5.0, 1.0, 1.0])
    assert both["light"].eta_squared == pytest.approx(1.0)
    assert both["trees"].eta_squared == pytest.approx(0.0)
    assert both["light"].means == {"day": 5.0, "night": 1.0}
    assert list(both["light"].means) == ["night", "day"]
    assert list(both["trees"].means) == ["some", "none"]


def test_two_factors_share_a_sum():
    both = found([2.0 + 1.0, 2.0, 1.0, 0.0])  # 2 by light, 1 by trees
    assert both["light"].eta_squared == pytest.approx(0.8)
    assert both["trees"].eta_squared == pytest.approx(0.2)


def test_constants_have_none_and_unknown_measures_are_left_out():
    assert found([0.1 + 0.2, 0.3, 0.3, 0.3])["light"].eta_squared == 0.0
    unknown = [{"x": math.nan}, {"x": 1.0}, {"x": 1.0}, {"x": 1.0}]
    assert not effects(LEVELS, PROFILES, unknown)


def test_lamps_that_shone_at_first_have_no_onset():
    lit = [["brake"], [], ["brake", "head"], ["brake"], ["head"], ["brake"]]
    lamps = [{"frame": n, "lit": each} for n, each in enumerate(lit)]
    assert brake_onsets(lamps) == [2, 5]
    assert brake_onsets([{"frame": 0, "lit": []}, {"frame": 9, "lit": ["brake"]}]) == [9]


def test_events_are_in_order_and_what_the_first_frame_shows_is_none():
    account = {
        "frames": [{"time": 4.0 + n / 25} for n in range(4)],
        "signal_changes": [
            {"frame": 0, "tls": "C", "state": "rr"}, {"frame": 3, "tls": "C", "state": "Gr"},
        ],
        "road_users": {"vehicle:a": {"lamps": [
            {"frame": 0, "lit": []}, {"frame": 1, "lit": ["brake"]},
        ]}},
    }  # fmt: skip
    columns = ("frame", "kind", "id", "state")
    rows = [tuple(row[name] for name in columns) for row in event_rows(account)]
    assert rows == [(1, "brake", "vehicle:a", "on"), (3, "signal", "C", "Gr")]
