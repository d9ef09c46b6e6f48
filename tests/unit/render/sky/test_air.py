"""Low suns in a round atmosphere."""

import numpy as np
import pytest

from sumo3dviz_pt.render.sky.air import WAVELENGTHS, clear_dome, sunlight, to_rgb

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def test_overhead_sunlight_is_what_the_coefficients_leave():
    """Optical depths: 8 km of molecules, 1.2 km of aerosol, 300 Dobson units of ozone.

    At 550 nm turbidity 3 has twice the molecules' depth, 0.108, in aerosol.
    """
    molecules = 8e3 * 13.558e-6 * (550 / WAVELENGTHS) ** 4
    aerosol = 2 * 8e3 * 13.558e-6 * (550 / WAVELENGTHS) ** 1.3
    ozone = np.interp(WAVELENGTHS, [415, 535, 595, 655, 685], [0, 0.0206, 0.0404, 0.0186, 0.0101])
    known = to_rgb(np.exp(-molecules - aerosol - ozone))
    left = sunlight(np.array([0.0]), np.array([1.0]), 3.0)[0]
    np.testing.assert_allclose(left, known, rtol=0.02)


def test_haze_reddens_and_dims_a_low_sun():
    clear, hazy = (sunlight(np.array([0.0]), np.sin(np.radians([8.0])), t)[0] for t in (1.5, 4.0))
    assert hazy[0] < 0.6 * clear[0] and hazy[2] / hazy[0] < 0.7 * clear[2] / clear[0]


@pytest.mark.parametrize("elevation", [-2.0, -4.0, -6.0])
def test_the_zenith_of_dusk_is_blue_and_not_purple(elevation):
    """The ozone's hour: Hulburt 1953, doi:10.1364/JOSA.43.000113."""
    red, green, blue = clear_dome(np.radians(elevation), 2.0, rows=12, columns=8).radiance[-1, 0]
    assert red < 0.75 * green and blue > 1.5 * green


def test_the_afterglow_is_warm_until_haze_hides_it():
    glow = [clear_dome(np.radians(-4.0), t, rows=20, columns=8).radiance[2, 0] for t in (1.3, 4.0)]
    assert glow[0][0] > 2 * glow[0][2] and glow[1][0] < glow[1][2]


def test_clouds_see_the_sun_after_it_has_set():
    height = np.array([0.0, 1e3, 3e3, 6e3, 10e3])
    left = sunlight(height, np.full(5, np.sin(np.radians(-1.6)))) @ LUMINANCE
    assert left[0] < 1e-9 and (np.diff(left) >= 0).all() and left[-1] > 1e-3


def test_a_low_sun_is_red():
    red, green, blue = sunlight(np.array([0.0]), np.sin(np.radians([2.0])), 1.5)[0]
    assert red > 2 * green > 4 * blue


@pytest.mark.parametrize("elevation", [-30, -12, -6, -2, 0, 3, 8, 40])
def test_radiance_is_finite_and_positive(elevation):
    dome = clear_dome(np.radians(elevation), rows=12, columns=8)
    assert np.isfinite(dome.radiance).all() and (dome.radiance > 0).all()


def test_dusk_is_blue_above_and_warm_below():
    dome = clear_dome(np.radians(-4.0), 1.5, rows=20, columns=12)
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
