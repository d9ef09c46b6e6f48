"""Curves: against scipy's splines, polynomials and finite differences."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline, PchipInterpolator

from sumo3dviz_pt.motion.front import (
    Hermite,
    eased,
    eased_rate,
    forward_slopes,
    monotone_slopes,
    smooth_slopes,
)

KNOTS = np.array([0.0, 0.4, 1.5, 2.0, 3.7, 4.0, 6.0])
VALUES = np.array([3.0, 3.5, 1.0, 1.2, 4.0, 4.1, 9.0])
RISING = np.cumsum([0.0, 2.0, 0.0, 0.3, 5.0, 0.01, 0.01])


def cubic(t):
    return 2.0 - 3.0 * t + 0.5 * t**2 - 0.25 * t**3


def cubic_rate(t):
    return -3.0 + t - 0.75 * t**2


# Hermite -----------------------------------------------------------------------------------


def test_hermite_is_exact_for_cubics():
    curve = Hermite(KNOTS, cubic(KNOTS), cubic_rate(KNOTS))
    asked = np.linspace(0.0, 6.0, 97)
    values, rates = curve.at(asked)
    np.testing.assert_allclose(values, cubic(asked), atol=1e-12)
    np.testing.assert_allclose(rates, cubic_rate(asked), atol=1e-12)


def test_hermite_takes_columns_alike():
    slopes = np.cos(KNOTS)
    one, rate = Hermite(KNOTS, VALUES, slopes).at(np.linspace(0, 6, 50))
    both = np.column_stack([VALUES, -2.0 * VALUES])
    two, rates = Hermite(KNOTS, both, np.column_stack([slopes, -2.0 * slopes])).at(
        np.linspace(0, 6, 50)
    )
    np.testing.assert_allclose(two, np.column_stack([one, -2.0 * one]), atol=1e-12)
    np.testing.assert_allclose(rates, np.column_stack([rate, -2.0 * rate]), atol=1e-12)


def test_hermite_stands_beyond_its_ends():
    values, _ = Hermite(KNOTS, VALUES, np.ones(7)).at(np.array([-5.0, 6.5, 1e6]))
    np.testing.assert_allclose(values, [3.0, 9.0, 9.0], atol=1e-12)


def test_hermite_keeps_its_digits_far_away():
    near = Hermite(KNOTS, VALUES, np.ones(7)).at(np.linspace(0, 6, 50))[0]
    far = Hermite(KNOTS, VALUES + 5e6, np.ones(7)).at(np.linspace(0, 6, 50))[0]
    np.testing.assert_allclose(far - 5e6, near, atol=2e-9)


# Smooth ------------------------------------------------------------------------------------


def test_smooth_slopes_are_those_of_the_spline_with_the_same_ends():
    slopes = smooth_slopes(KNOTS, VALUES)
    spline = CubicSpline(KNOTS, VALUES, bc_type=((1, slopes[0]), (1, slopes[-1])))
    np.testing.assert_allclose(slopes, spline(KNOTS, 1), atol=1e-11)
    # Parabolic ends: no cubic term in the outer stretches.
    np.testing.assert_allclose(spline.c[0, [0, -1]], 0.0, atol=1e-11)
    assert np.abs(spline.c[0, 1:-1]).min() > 1e-3


def test_smooth_slopes_of_a_parabola_are_exact():
    np.testing.assert_allclose(smooth_slopes(KNOTS, KNOTS**2 - KNOTS), 2.0 * KNOTS - 1.0)


def test_smooth_slopes_of_two_and_three_points():
    np.testing.assert_allclose(smooth_slopes(KNOTS[:2], VALUES[:2]), [1.25, 1.25])
    # Through three points goes one parabola.
    fit = np.polynomial.Polynomial.fit(KNOTS[:3], VALUES[:3], 2)
    np.testing.assert_allclose(smooth_slopes(KNOTS[:3], VALUES[:3]), fit.deriv()(KNOTS[:3]))


# Monotone ----------------------------------------------------------------------------------


@pytest.mark.parametrize("values", [VALUES, RISING, -RISING])
def test_monotone_slopes_are_pchips_but_level_at_the_ends(values):
    slopes = monotone_slopes(KNOTS, values)
    expected = PchipInterpolator(KNOTS, values).derivative()(KNOTS)
    np.testing.assert_allclose(slopes[1:-1], expected[1:-1], atol=1e-12)
    assert slopes[0] == slopes[-1] == 0.0


def test_monotone_slopes_take_columns_alike():
    both = np.column_stack([VALUES, RISING])
    slopes = monotone_slopes(KNOTS, both)
    np.testing.assert_array_equal(slopes[:, 0], monotone_slopes(KNOTS, VALUES))
    np.testing.assert_array_equal(slopes[:, 1], monotone_slopes(KNOTS, RISING))


def test_monotone_curves_overshoot_nothing():
    curve = Hermite(KNOTS, VALUES, monotone_slopes(KNOTS, VALUES))
    for first, last, low, high in zip(KNOTS, KNOTS[1:], VALUES, VALUES[1:], strict=False):
        shown = curve.at(np.linspace(first, last, 50))[0]
        assert shown.min() >= min(low, high) - 1e-12
        assert shown.max() <= max(low, high) + 1e-12


def test_monotone_slopes_of_two_points_are_level():
    np.testing.assert_array_equal(monotone_slopes(KNOTS[:2], VALUES[:2]), [0.0, 0.0])


# Forward -----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_forward_slopes_never_let_a_curve_fall(seed):
    chance = np.random.default_rng(seed)
    knots = np.cumsum(chance.uniform(0.1, 2.0, 40))
    values = np.cumsum(chance.exponential(1.0, 40) * (chance.random(40) > 0.3))
    wanted = chance.normal(2.0, 4.0, 40)
    slopes = forward_slopes(wanted, np.diff(values) / np.diff(knots))
    shown, rates = Hermite(knots, values, slopes).at(np.linspace(knots[0], knots[-1], 5000))
    assert np.diff(shown).min() >= -1e-12
    assert rates.min() >= -1e-9


def test_forward_slopes_leave_what_is_mild():
    rates = np.array([1.0, 2.0, 1.5])
    mild = np.array([2.9, 0.0, 1.0, 4.4])
    np.testing.assert_array_equal(forward_slopes(mild, rates), mild)
    np.testing.assert_array_equal(
        forward_slopes(np.array([-1.0, 9.0, 9.0, 9.0]), rates), [0.0, 3.0, 4.5, 4.5]
    )


# Eased -------------------------------------------------------------------------------------


def test_eased_is_the_integral_of_its_rate():
    for share in (0.0, 0.1, 0.37, 0.5, 0.9, 1.0):
        area, _ = quad(lambda u: 30.0 * u**2 * (1.0 - u) ** 2, 0.0, share)
        assert eased(np.array(share)) == pytest.approx(area, abs=1e-12)


def test_eased_rate_is_its_derivative():
    share = np.linspace(0.001, 0.999, 200)
    slope = (eased(share + 1e-6) - eased(share - 1e-6)) / 2e-6
    np.testing.assert_allclose(eased_rate(share), slope, atol=1e-8)


def test_eased_is_level_twice_over_at_both_ends_and_clipped():
    np.testing.assert_array_equal(eased(np.array([-3.0, 0.0, 0.5, 1.0, 7.0])), [0, 0, 0.5, 1, 1])
    np.testing.assert_array_equal(eased_rate(np.array([-3.0, 0.0, 1.0, 7.0])), np.zeros(4))
    curvature = (eased_rate(np.array([1e-5, 1.0 - 1e-5]))) / 1e-5
    assert np.abs(curvature).max() < 1e-3
