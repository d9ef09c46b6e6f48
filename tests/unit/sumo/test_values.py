"""SUMO's notations."""

import math

import numpy as np
import pytest

from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.sumo.values import (
    parse_colour,
    parse_flag,
    parse_points,
    parse_time,
    yaw_from_angle_deg,
)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("12.50", 12.5),
        ("0", 0.0),
        ("-3", -3.0),
        ("00:03:20", 200.0),
        ("1:03:46:40", 100_000.0),
        ("23:59:59.5", 86_399.5),
        ("-00:00:10", -10.0),
    ],
)
def test_times(text, seconds):
    assert parse_time(text) == seconds


@pytest.mark.parametrize("text", ["", "noon", "1:30", "nan", "inf", "1:2:3:4:5", "00:-1:00", "::"])
def test_bad_times(text):
    with pytest.raises(ValueError):
        parse_time(text)


@pytest.mark.parametrize(
    ("text", "srgb"),
    [
        ("red", (1, 0, 0)),
        ("Orange", (1, 128 / 255, 0)),
        ("#ff8000", (1, 128 / 255, 0)),
        ("#ff800080", (1, 128 / 255, 0)),
        ("255,0,0,128", (1, 0, 0)),
        ("1,0,0", (1, 0, 0)),
        ("1,1,2", (1 / 255, 1 / 255, 2 / 255)),
        ("0.5,.2,1", (0.5, 0.2, 1)),
        ("0,0,0,1", (0, 0, 0)),
        ("128, 1, 1", (128 / 255, 1 / 255, 1 / 255)),
        ("1,1,1", (1, 1, 1)),
    ],
)
def test_colours_as_sumo_takes_them(text, srgb):
    assert parse_colour(text) == pytest.approx([linear_from_srgb(v) for v in srgb])


@pytest.mark.parametrize("text", ["invisible", "random", ""])
def test_no_colour(text):
    assert parse_colour(text) is None


@pytest.mark.parametrize(
    "text", ["reddish", "#ff", "#gggggg", "1,2", "300,0,0", "-1,0,0", "1.5,0,0"]
)
def test_bad_colours(text):
    with pytest.raises(ValueError):
        parse_colour(text)


def test_points():
    points = parse_points("0,0 0,0 1.5,2,3\n4,5")
    np.testing.assert_array_equal(points, [[0, 0, 0], [1.5, 2, 3], [4, 5, 0]])
    assert parse_points("").shape == (0, 3)


@pytest.mark.parametrize("text", ["1", "1,2,3,4", "a,b", "nan,1", "1,,2"])
def test_bad_points(text):
    with pytest.raises(ValueError):
        parse_points(text)


def test_flags():
    assert all(map(parse_flag, ["1", "true", "YES", "on", "x", "t"]))
    assert not any(map(parse_flag, ["0", "false", "no", "off", "", "-"]))


@pytest.mark.parametrize(
    ("angle", "yaw"), [(0, math.pi / 2), (90, 0), (180, -math.pi / 2), (450, 0), (-90, math.pi)]
)
def test_yaw(angle, yaw):
    turn = yaw_from_angle_deg(angle) - yaw
    assert math.remainder(turn, 2 * math.pi) == pytest.approx(0, abs=1e-12)
