"""Arc length over time: exact where the log tells all, never backward, at rest at rest."""

import numpy as np
import pytest

from sumo3dviz_pt.motion.smoothers.hermite import run_along, with_rests

TIMES = np.arange(0.0, 9.0)


def braking(times, *, stop, brake):
    """Place and speed of who brakes evenly until `stop` [s], and stands."""
    left = np.maximum(stop - np.asarray(times), 0.0)
    return brake * (stop**2 - left**2) / 2.0, brake * left


def starting(times, *, start, push):
    """Place and speed of who sets off at `start` [s]."""
    past = np.maximum(np.asarray(times) - start, 0.0)
    return push * past**2 / 2.0, push * past


def test_constant_acceleration_is_exact():
    stations, speeds = 5.0 * TIMES + 0.7 * TIMES**2, 5.0 + 1.4 * TIMES
    asked = np.linspace(0.0, 8.0, 101)
    shown, rates = run_along(TIMES, stations, speeds, euler=False).at(asked)
    np.testing.assert_allclose(shown, 5.0 * asked + 0.7 * asked**2, atol=1e-9)
    np.testing.assert_allclose(rates, 5.0 + 1.4 * asked, atol=1e-9)


@pytest.mark.parametrize("unknown", ["euler", "one is missing"])
def test_unknown_speeds_play_no_part(unknown):
    stations = 5.0 * TIMES + 0.7 * TIMES**2
    wrong = np.full(9, 3.0)
    if unknown == "one is missing":
        wrong[4] = np.nan
    made = run_along(TIMES, stations, wrong, euler=unknown == "euler")
    asked = np.linspace(0.0, 8.0, 101)
    # The spline through the places is exact for a parabola, too.
    np.testing.assert_allclose(made.at(asked)[0], 5.0 * asked + 0.7 * asked**2, atol=1e-9)


def test_known_speeds_do_play_a_part():
    stations = 5.0 * TIMES
    wrong = run_along(TIMES, stations, np.full(9, 3.0), euler=False)
    assert wrong.at(np.array([2.0]))[1][0] == pytest.approx(3.0)


@pytest.mark.parametrize("euler", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_samples_are_met_and_nobody_rolls_back(seed, euler):
    chance = np.random.default_rng(seed)
    times = np.cumsum(chance.uniform(0.1, 2.0, 60))
    stations = np.cumsum(chance.exponential(3.0, 60) * (chance.random(60) > 0.4))
    speeds = chance.exponential(3.0, 60) * (chance.random(60) > 0.4)
    made = with_rests(run_along(times, stations, speeds, euler=euler), speeds, euler=euler)
    assert (np.diff(made.knots) > 0.0).all()
    # Only who stops too hard for its places comes to rest late, by an eighth of its step.
    hard = np.zeros(60, dtype=bool)
    passed, steps = np.diff(stations), np.diff(times)
    hard[1:-1] = euler & (passed[:-1] > 2.5 * steps[:-1] ** 2) & (passed[1:] < 0.05 * steps[1:])
    short = stations - made.at(times)[0]
    assert np.abs(short[~hard]).max() < 1e-9
    assert short.min() > -1e-9 and (short[1:] <= passed / 8.0 + 1e-9).all()
    shown, rates = made.at(np.linspace(times[0], times[-1], 8000))
    assert np.diff(shown).min() >= -1e-9
    assert rates.min() >= -1e-9


def test_creeping_after_a_stop_does_not_roll_back():
    # Slower than who rests, but not quite standing.
    times, stations = np.arange(5.0), np.array([0.0, 1.5, 1.7, 1.73, 1.76])
    speeds = np.array([2.0, 1.0, 0.04, 0.03, 0.03])
    made = with_rests(run_along(times, stations, speeds, euler=False), speeds, euler=False)
    assert np.diff(made.at(np.linspace(0.0, 4.0, 2001))[0]).min() >= -1e-12


def test_creeping_before_setting_off_does_not_roll_back():
    times, stations = np.arange(5.0), np.array([0.0, 0.03, 0.06, 0.26, 1.8])
    speeds = np.array([0.03, 0.03, 0.04, 1.0, 2.0])
    made = with_rests(run_along(times, stations, speeds, euler=False), speeds, euler=False)
    assert np.diff(made.at(np.linspace(0.0, 4.0, 2001))[0]).min() >= -1e-12


def test_standing_is_standing():
    stations = np.array([0.0, 9.0, 12.0, 12.0, 12.0, 13.0, 20.0, 29.0, 38.0])
    shown = run_along(TIMES, stations, np.full(9, np.nan), euler=False).at(np.linspace(2, 4, 50))[0]
    np.testing.assert_array_equal(shown, 12.0)


@pytest.mark.parametrize("rests", [(True, False), (False, True), (True, True)])
def test_rest_at_the_ends_if_told(rests):
    made = run_along(TIMES, 5.0 * TIMES, np.full(9, 5.0), euler=False, rests=rests)
    expected = [0.0 if rests[0] else 5.0, 0.0 if rests[1] else 5.0]
    np.testing.assert_array_equal(made.at(np.array([0.0, 8.0]))[1], expected)


# Moments of rest ---------------------------------------------------------------------------


@pytest.mark.parametrize("stop", [4.1, 4.3, 4.5, 4.9])
@pytest.mark.parametrize("brake", [1.0, 4.5, 9.0])
def test_stopping_between_samples_is_exact(stop, brake):
    stations, speeds = braking(TIMES, stop=stop, brake=brake)
    made = with_rests(run_along(TIMES, stations, speeds, euler=False), speeds, euler=False)
    asked = np.linspace(0.0, 8.0, 401)
    shown, rates = made.at(asked)
    expected = braking(asked, stop=stop, brake=brake)
    np.testing.assert_allclose(shown, expected[0], atol=1e-9)
    np.testing.assert_allclose(rates, expected[1], atol=1e-8)


@pytest.mark.parametrize("start", [3.1, 3.5, 3.9])
@pytest.mark.parametrize("push", [1.0, 2.6])
def test_setting_off_between_samples_is_exact(start, push):
    stations, speeds = starting(TIMES, start=start, push=push)
    made = with_rests(run_along(TIMES, stations, speeds, euler=False), speeds, euler=False)
    asked = np.linspace(0.0, 8.0, 401)
    np.testing.assert_allclose(
        made.at(asked)[0], starting(asked, start=start, push=push)[0], atol=1e-9
    )


def test_without_moments_of_rest_a_stop_is_not_exact():
    # What `with_rests` is for: the limit on slopes lets who stops early creep.
    stations, speeds = braking(TIMES, stop=4.3, brake=4.5)
    made = run_along(TIMES, stations, speeds, euler=False)
    asked = np.linspace(4.0, 5.0, 101)
    assert np.abs(made.at(asked)[0] - braking(asked, stop=4.3, brake=4.5)[0]).max() > 0.02


@pytest.mark.parametrize("known", ["euler", "no speeds"])
@pytest.mark.parametrize("step", [0.5, 1.0])
def test_who_stops_within_a_step_brakes_as_it_was_simulated(known, step):
    # From the middle of the last step to the middle of the next, at v / dt.
    speed, times = 4.5 * step, step * np.arange(9.0)
    stations = speed * np.minimum(times, 4.0 * step)
    speeds = np.full(9, np.nan) if known == "no speeds" else np.diff(stations, prepend=0.0) / step
    made = run_along(times, stations, speeds, euler=known == "euler")
    shown = with_rests(made, speeds, euler=known == "euler")
    late = np.linspace(4.0, 4.5, 40) * step
    left = 4.5 * step - late
    np.testing.assert_allclose(
        shown.at(late)[0], stations[4] - speed / step * left**2 / 2.0, atol=1e-9
    )
    after = np.linspace(4.5, 8.0, 40) * step
    np.testing.assert_allclose(shown.at(after)[0], stations[4], atol=1e-9)
    np.testing.assert_allclose(shown.at(times[:4])[0], stations[:4], atol=1e-9)
    asked = np.linspace(0.0, 8.0 * step, 2001)
    braking = -np.diff(shown.at(asked)[1]).min() / (asked[1] - asked[0])
    assert braking < -np.diff(made.at(asked)[1]).min() / (asked[1] - asked[0])


@pytest.mark.parametrize("euler", [False, True])
def test_nothing_is_added_where_nothing_is_known(euler):
    stations, speeds = braking(TIMES, stop=4.3, brake=2.0)
    speeds = speeds if euler else np.full(9, np.nan)
    made = run_along(TIMES, stations, speeds, euler=euler)
    assert with_rests(made, speeds, euler=euler) is made


def test_who_never_rests_gets_no_moment_of_rest():
    made = run_along(TIMES, 5.0 * TIMES, np.full(9, 5.0), euler=False)
    assert with_rests(made, np.full(9, 5.0), euler=False) is made
