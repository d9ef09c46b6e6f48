"""Low suns in a round atmosphere."""

import numpy as np
import pytest

from sumo3dviz_pt.render.air import clear_dome, sunlight

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def test_overhead_sunlight_is_what_the_coefficients_leave():
    """Optical depths from the scale heights: 8 km, 1.2 km, and 15 km of ozone."""
    depth = 8e3 * np.array([8.39e-6, 13.86e-6, 27.0e-6]) + 1.2e3 * 5.0e-6
    depth = depth + 15e3 * np.array([2.2e-6, 1.85e-6, 0.22e-6])
    left = sunlight(np.array([0.0]), np.array([1.0]))[0]
    np.testing.assert_allclose(left, np.exp(-depth), rtol=0.01)


def test_clouds_see_the_sun_after_it_has_set():
    height = np.array([0.0, 1e3, 3e3, 6e3, 10e3])
    left = sunlight(height, np.full(5, np.sin(np.radians(-1.6)))) @ LUMINANCE
    assert left[0] < 1e-9 and (np.diff(left) >= 0).all() and left[-1] > 1e-3


def test_a_low_sun_is_red():
    red, green, blue = sunlight(np.array([0.0]), np.sin(np.radians([1.0])))[0]
    assert red > 2 * green > 4 * blue


@pytest.mark.parametrize("elevation", [-30, -12, -6, -2, 0, 3, 8, 40])
def test_radiance_is_finite_and_positive(elevation):
    dome = clear_dome(np.radians(elevation), rows=12, columns=8)
    assert np.isfinite(dome.radiance).all() and (dome.radiance > 0).all()


def test_dusk_is_blue_above_and_warm_below():
    dome = clear_dome(np.radians(-4.0), rows=20, columns=12)
    zenith, afterglow = dome.radiance[-1, 0], dome.radiance[2, 0]
    assert zenith[2] > 1.5 * zenith[0] and afterglow[0] > 2 * afterglow[2]


def test_the_earths_shadow_rises_opposite_to_the_sun():
    dome = clear_dome(np.radians(-2.0), rows=40, columns=12)
    opposite, height = dome.radiance[:, -1] @ LUMINANCE, np.degrees(dome.elevation)
    brightest = height[opposite.argmax()]
    assert 3 < brightest < 25 and opposite[2] < 0.6 * opposite.max()
    belt, shadow = dome.radiance[opposite.argmax(), -1], dome.radiance[2, -1]
    assert belt[0] / belt[2] > shadow[0] / shadow[2], "the belt of Venus is pinker"


def test_the_dome_is_even_about_the_sun():
    dome = clear_dome(np.radians(2.0), rows=12, columns=8)
    around = np.radians([-170.0, -60.0, 60.0, 170.0, 190.0])
    seen = dome.towards(np.radians([5.0, 30.0]), around)
    np.testing.assert_allclose(seen[:, 0], seen[:, 3], rtol=1e-9)
    np.testing.assert_allclose(seen[:, 1], seen[:, 2], rtol=1e-9)
    np.testing.assert_allclose(seen[:, 0], seen[:, 4], rtol=1e-9)
