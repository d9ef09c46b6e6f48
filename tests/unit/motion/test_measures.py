"""Measures of motion whose derivatives are known."""

import numpy as np
import pytest

from sumo3dviz_pt.model.trajectory import Motion
from sumo3dviz_pt.motion import laws

STEP = 0.04
TIMES = np.arange(0.0, 10.0, STEP)


def motion(places, yaws):
    count = len(places)
    return Motion(
        np.ones(count, dtype=bool),
        np.column_stack([places, np.zeros(count)]),
        np.asarray(yaws, dtype=float),
        *(np.zeros(count) for _ in range(3)),
    )


def measured(places, yaws, *, length=5.0):
    return laws.measure(motion(places, yaws), step=STEP, length=length)


def inner(values, *, margin=2):
    return values[margin:-margin]


def test_braking_along_a_slanting_line():
    """s = 20 t - t^2: 2 m/s2 of braking, no jerk, whatever the direction."""
    along = np.array([np.cos(2.5), np.sin(2.5)])
    way = 20.0 * TIMES - TIMES**2
    known = measured(way[:, None] * along + [5e6, -3e6], np.full(len(TIMES), 2.5))
    np.testing.assert_allclose(inner(known.speeds), inner(20.0 - 2.0 * TIMES), atol=1e-6)
    np.testing.assert_allclose(inner(known.accelerations)[:-10], -2.0, atol=1e-5)
    np.testing.assert_allclose(inner(known.sideways), 0.0, atol=1e-5)
    np.testing.assert_allclose(inner(known.jerks), 0.0, atol=1e-3)
    np.testing.assert_allclose(inner(known.crabs), 0.0, atol=1e-6)
    np.testing.assert_allclose(known.jumps[:-1], np.diff(way), atol=1e-6)


def test_circle_to_the_left():
    """v^2 / r inwards, v / r of turning, v^3 / r^2 of jerk; axle x v / r sideways."""
    radius, speed = 20.0, 8.0
    angle = speed * TIMES / radius
    places = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    known = measured(places, angle + np.pi / 2, length=5.0)
    np.testing.assert_allclose(inner(known.sideways), speed**2 / radius, rtol=1e-3)
    np.testing.assert_allclose(inner(known.accelerations), 0.0, atol=1e-6)
    np.testing.assert_allclose(inner(known.jerks), speed**3 / radius**2, rtol=1e-3)
    np.testing.assert_allclose(known.heading_rates[:-1], speed / radius, rtol=1e-9)
    turned = -laws.REAR_AXLE * 5.0 * speed / radius
    np.testing.assert_allclose(inner(known.crabs), turned, rtol=1e-3)


def test_jerk_of_a_cubic():
    """x = t^3 / 2 has 3 m/s3 exactly: the formula is of second order."""
    known = measured(np.column_stack([TIMES**3 / 2, 0 * TIMES]), 0 * TIMES)
    np.testing.assert_allclose(inner(known.jerks), 3.0, rtol=1e-6)


def test_standing_still_is_nothing():
    known = measured(np.full((20, 2), 7.0), np.full(20, 1.0))
    for name in ("speeds", "accelerations", "sideways", "jerks", "crabs"):
        assert np.all(inner(getattr(known, name)) == 0.0), name


def test_heading_turns_the_shorter_way_and_flips_are_seen_in_full():
    yaws = np.array([3.1, -3.1, -3.1, -3.1 + np.pi * 0.9])
    rates = laws.heading_rates(yaws, step=0.5)
    np.testing.assert_allclose(rates[:3], [(2 * np.pi - 6.2) / 0.5, 0.0, 0.9 * np.pi / 0.5])
    assert np.isnan(rates[3])


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_short_motion_has_few_values(count):
    known = measured(np.zeros((count, 2)), np.zeros(count))
    assert np.isnan(known.jerks).all()
    assert np.isfinite(known.jumps).sum() == count - 1
    assert np.isfinite(known.accelerations).sum() == max(count - 2, 0)


def test_nothing_is_measured_across_a_gap():
    places = np.column_stack([np.arange(20.0), np.zeros(20)])
    places[8:10] = np.nan
    places[10:] += 1000.0
    known = measured(places, np.zeros(20))
    assert np.nanmax(known.jumps) == 1.0
    assert np.nanmax(np.abs(known.accelerations)) < 1e-9


def test_excess_is_what_a_frame_may_not():
    ways = np.array([0.40, 0.80, 0.83])
    beyond = laws.excess(ways, np.array([10.0, 10.0, 13.0]), step=0.04)
    np.testing.assert_allclose(beyond, [-0.22, 0.18, 0.03])


def test_largest_are_peaks_apart_with_their_sign():
    values = np.array([0.0, np.nan, -9.0, 8.5, 1.0, 0.0, 0.0, 7.0, 2.0])
    times = 0.5 * np.arange(9)
    found = laws.largest(values, times, count=3, apart=1.2)
    assert [(peak.value, peak.time) for peak in found][:2] == [(-9.0, 1.0), (7.0, 3.5)]
    assert laws.largest(np.array([np.nan]), np.zeros(1)) == []
    assert laws.largest(np.empty(0), np.empty(0)) == []
    assert len(laws.largest(np.zeros(3), np.zeros(3), count=9)) == 1


def test_offsets_are_signed_and_of_the_nearest_line():
    lines = [np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]), np.array([[0.0, 4.0], [6.0, 4.0]])]
    places = np.array([[5.0, 1.0], [5.0, -1.0], [9.0, 8.0], [3.0, 3.5], [-3.0, 0.0], [12.0, 5.0]])
    found = laws.offsets(places, lines)
    np.testing.assert_allclose(found, [1.0, -1.0, 1.0, -0.5, 3.0, -2.0])
    assert np.isnan(laws.offsets(places, [])).all()
    many = np.repeat(places, 300, axis=0)
    np.testing.assert_array_equal(laws.offsets(many, lines), np.repeat(found, 300))
