"""Headings: chords and tractrices against closed forms, and turns that are calmed."""

import numpy as np
import pytest
from drives import arc, between, trace_of

from sumo3dviz_pt.motion.driven import STEEPEST, Driven, chord, chords, logged, slopes_of, tractrix
from sumo3dviz_pt.motion.front import Hermite, eased
from sumo3dviz_pt.motion.manoeuvres import FASTEST_TURN, aligned, calmed, leeway
from sumo3dviz_pt.motion.samples import split
from sumo3dviz_pt.motion.smoothers.hermite import CurveFront

TIMES = np.arange(0.0, 10.0, 0.1)


def samples_of(times, xyz, yaws=0.0, **other):
    (samples,) = split(trace_of(times, xyz, yaws, exact=True, **other), step=0.0)
    return samples


def driven_of(place, *, last=12.0, length=5.0, yaw=0.0):
    """The path of a front at place(t), (n, 3), sampled so finely that curves do not matter."""
    times = np.arange(0.0, last + 0.005, 0.01)
    rates = (place(times + 1e-4) - place(times - 1e-4)) / 2e-4
    rows = np.arange(0, len(times), 10)
    samples = samples_of(times[rows], place(times[rows]), yaw)
    return Driven.of(
        CurveFront(Hermite(times, place(times), rates)), samples, length=length, yaw=yaw
    )


def eastward(speed, rise=0.0):
    return lambda t: np.column_stack([speed * t, 0.0 * t, rise * speed * t])


def circling(radius, speed):
    def place(t):
        turned = speed * np.asarray(t) / radius
        return radius * np.column_stack([np.sin(turned), 1.0 - np.cos(turned), 0.0 * turned])

    return place


def headed(driven, length, yaws):
    """Headings along chords where the log has angles yaws(t), (n,)."""
    times = np.arange(0.0, 12.005, 0.1)
    samples = samples_of(times, driven.front.at(times).positions, yaws(times))
    return chord(driven, chords(driven, length), samples, length)


# Chord and tractrix ------------------------------------------------------------------------


@pytest.mark.parametrize(("radius", "length"), [(10.0, 5.0), (25.0, 12.0)])
def test_chord_on_a_circle_turned_half_a_length_less(radius, length):
    driven = driven_of(circling(radius, 5.0), length=length)
    curve = headed(driven, length, lambda t: 5.0 * t / radius - length / radius / 2.0)
    asked = np.linspace(length / 5.0 + 0.2, 11.9, 100)
    expected = 5.0 * asked / radius - length / radius / 2.0
    assert between(curve.at(asked)[0][:, 0], expected).max() < np.radians(0.1)
    assert np.abs(np.diff(curve.values[:, 0])).max() < 0.1  # unwrapped


def test_chord_of_a_climb_is_its_grade():
    driven = driven_of(eastward(8.0, rise=0.08))
    values = headed(driven, 5.0, np.zeros_like).at(np.linspace(1.0, 11.0, 30))[0]
    np.testing.assert_allclose(values, np.tile([0.0, np.arctan(0.08)], (30, 1)), atol=1e-6)


@pytest.mark.parametrize("yaw", [np.pi / 2, 1.0, -0.4])
def test_a_dragged_rod_is_the_tractrix(yaw):
    # tan(theta / 2) falls as exp(-x / base) on a straight line (Huygens); the axle is at 0.78.
    length, speed = 5.0, 2.0
    driven = driven_of(eastward(speed), yaw=yaw)
    curve = tractrix(driven, chords(driven, length), length, yaw=yaw)
    asked = np.linspace(0.0, 12.0, 121)
    expected = 2.0 * np.arctan(np.tan(yaw / 2.0) * np.exp(-speed * asked / (0.78 * length)))
    assert between(curve.at(asked)[0][:, 0], expected).max() < np.radians(0.7)


def test_a_dragged_rod_on_a_circle_settles_at_its_angle():
    # The axle settles where sin(angle behind the tangent) = base / radius.
    driven = driven_of(circling(12.0, 5.0))
    curve = tractrix(driven, chords(driven, 5.0), 5.0, yaw=0.0)
    expected = 5.0 * 11.5 / 12.0 - np.arcsin(0.78 * 5.0 / 12.0)
    assert between(curve.at(np.array([11.5]))[0][0, 0], expected) < np.radians(0.7)


# Slopes ------------------------------------------------------------------------------------


def test_slopes_of_chords():
    ahead = np.array([[5.0, 0.0, 0.0], [3.0, 4.0, 1.0], [0.0, -4.9, -0.5]])
    expected = np.arctan2([0.0, 1.0, -0.5], [5.0, 5.0, 4.9])
    np.testing.assert_allclose(slopes_of(ahead), expected)
    # A chord folded to nothing is not steep; one level everywhere keeps one slope.
    folded = slopes_of(np.array([[5.0, 0.0, 0.0], [0.0, 0.0, 0.1]]))
    assert folded[1] == pytest.approx(np.arctan2(0.1, 1.0))
    np.testing.assert_allclose(slopes_of(np.tile([4.0, 3.0, 0.5], (7, 1))), np.arctan(0.1))


def test_nothing_is_steeper_than_a_road():
    driven = driven_of(eastward(3.0, rise=2.0))
    curve = headed(driven, 5.0, np.zeros_like)
    assert curve.values[:, 1].max() == pytest.approx(STEEPEST)


# Calmed ------------------------------------------------------------------------------------


def envelope(times, yaws):
    """The middle of the tightest bounds of that slope, by brute force."""
    away = FASTEST_TURN * np.abs(times[:, None] - times)
    return ((yaws + away).min(axis=1) + (yaws - away).max(axis=1)) / 2.0


def test_slow_turns_are_left_alone():
    yaws = 2.0 * np.sin(TIMES)  # up to 115 deg/s
    np.testing.assert_array_equal(calmed(FASTEST_TURN * TIMES, yaws), yaws)


@pytest.mark.parametrize("seed", range(5))
def test_calmed_turns_are_lipschitz_and_the_middle_of_their_bounds(seed):
    chance = np.random.default_rng(seed)
    times = np.cumsum(chance.uniform(0.02, 0.2, 150))
    yaws = np.cumsum(chance.normal(0.0, 0.4, 150))
    shown = calmed(FASTEST_TURN * times, yaws)
    assert (np.abs(np.diff(shown)) <= FASTEST_TURN * np.diff(times) + 1e-9).all()
    assert shown[0] == yaws[0]
    # Beyond the reach of the beginning, which is held.
    free = times > times[0] + np.ptp(yaws) / FASTEST_TURN
    assert free.any()
    np.testing.assert_allclose(shown[free], envelope(times, yaws)[free], atol=1e-9)


def test_a_jump_is_turned_evenly_around_its_middle():
    jump = np.where(TIMES > 4.95, np.pi / 2.0, 0.0)
    # The bounds turn at full rate on either side of it, their middle at half of that.
    expected = np.clip(np.pi / 4.0 + FASTEST_TURN / 2.0 * (TIMES - 4.95), 0.0, np.pi / 2.0)
    np.testing.assert_allclose(
        calmed(FASTEST_TURN * TIMES, jump), expected, atol=FASTEST_TURN * 0.05
    )
    np.testing.assert_allclose(
        calmed(FASTEST_TURN * TIMES, -jump), -calmed(FASTEST_TURN * TIMES, jump), atol=1e-12
    )


def test_what_is_far_from_a_jump_stays():
    yaws = 0.3 * np.sin(TIMES) + np.where(TIMES > 4.95, 1.0, 0.0)
    far = np.abs(TIMES - 4.95) > 2.0 * np.ptp(yaws) / FASTEST_TURN
    assert far.sum() > 20
    np.testing.assert_allclose(calmed(FASTEST_TURN * TIMES, yaws)[far], yaws[far], atol=1e-12)


# Near the log ------------------------------------------------------------------------------


def test_headings_stay_near_steady_angles_and_free_in_turns():
    samples = samples_of(np.arange(4.0), np.zeros((4, 3)), np.array([0.0, 0.0, 1.0, 1.0]))
    times = np.array([0.5, 1.5, 2.5])
    off = np.radians([9.0, 40.0, -80.0])
    near = leeway(times, np.array([0.0, 0.5, 1.0]), samples)
    shown = np.degrees(aligned(np.array([0.0, 0.5, 1.0]) + off, near) - [0.0, 0.5, 1.0])
    assert shown[0] == pytest.approx(9.0)  # near enough
    assert shown[1] == pytest.approx(40.0, abs=1.5)  # half-way through a turn of 57 degrees
    assert -17.0 <= shown[2] < -16.0


def test_a_body_turns_only_where_there_is_room():
    room = np.minimum(np.maximum(TIMES - 2.0, 0.0), 3.0)  # it stands until 2 s and from 5 s on
    yaws = np.where(TIMES > 1.0, 0.8, 0.0)
    shown = calmed(room, yaws)
    assert np.ptp(shown[TIMES < 2.0]) == 0.0
    assert np.ptp(shown[TIMES > 5.0]) < 1e-12
    assert (np.abs(np.diff(shown)) <= np.diff(room) + 1e-12).all()


# Logged ------------------------------------------------------------------------------------


def test_logged_angles_at_once_are_one_eased_turn():
    times = np.array([2.0, 3.0, 4.0, 5.0])
    samples = samples_of(times, np.zeros((4, 3)), np.array([0.0, 2.0, -1.0, 1.2]))
    curve = logged(samples, yaw=0.2, at_once=True)
    asked = np.linspace(2.0, 5.0, 60)
    expected = 0.2 + eased((asked - 2.0) / 3.0) * 1.0
    np.testing.assert_allclose(curve.at(asked)[0][:, 0], expected, atol=0.01)


@pytest.mark.parametrize("turns", [-1, 0, 3])
def test_logged_angles_begin_on_the_turn_of_the_body(turns):
    samples = samples_of(np.arange(4.0), np.zeros((4, 3)), np.array([3.0, 3.1, -3.1, -3.0]))
    begin = 3.0 + 2.0 * np.pi * turns
    for at_once in (False, True):
        values = logged(samples, yaw=begin, at_once=at_once).values[:, 0]
        assert values[0] == pytest.approx(begin)
        assert values[-1] == pytest.approx(begin + 2.0 * np.pi - 6.0)
        assert np.ptp(values) < 0.3


def test_logged_angles_are_calmed_too():
    spin = arc((0, 0), 1.0, 0, 0, 4)
    samples = samples_of(np.arange(4.0) / 4.0, spin, np.array([0.0, 0.0, 2.5, 2.5]))
    curve = logged(samples, yaw=0.0, at_once=False)
    rates = curve.at(np.linspace(0.0, 0.75, 200))[1][:, 0]
    # A cubic between knots that turn evenly may overshoot their rate a little.
    assert np.abs(rates).max() <= 1.5 * FASTEST_TURN
    steps = np.abs(np.diff(curve.values[:, 0])) / np.diff(curve.knots)
    assert steps.max() <= FASTEST_TURN + 1e-9
