"""Colours of filtered sunlight."""

import numpy as np
import pytest

from sumo3dviz_pt.render.sky.air import WAVELENGTHS, to_rgb


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_grey_filters_leave_sunlight_white(share):
    left = to_rgb(np.full((2, WAVELENGTHS.size), share))
    np.testing.assert_allclose(left, share, atol=1e-12)


@pytest.mark.parametrize(
    ("lowest", "highest", "primary"), [(600, 700, 0), (520, 560, 1), (400, 470, 2)]
)
def test_bands_have_the_colour_that_eyes_see(lowest, highest, primary):
    band = (lowest < WAVELENGTHS) & (highest > WAVELENGTHS)
    assert int(to_rgb(band.astype(float)).argmax()) == primary


def test_colours_add_up_inside_the_triangle():
    whole = np.ones(WAVELENGTHS.size)
    half = 0.5 + 0.1 * np.sin(WAVELENGTHS / 60.0)
    np.testing.assert_allclose(to_rgb(half) + to_rgb(whole - half), 1.0, rtol=1e-9)


def test_pure_colours_stay_positive():
    single = np.eye(WAVELENGTHS.size)
    assert (to_rgb(single) > 0).all()
