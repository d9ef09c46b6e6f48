"""Stars, moon and city glow."""

import numpy as np
import pytest

from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.sky.baked import bake_sky, map_size
from sumo3dviz_pt.render.sky.daylight import angles, glow, night_dome

SMALL = (128, 512)
DEEP = np.array([0.0, 0.5, -0.866])


@pytest.fixture(autouse=True, scope="module")
def variant():
    choose_backend("llvm")


def towards(azimuth, elevation):
    a, e = np.radians((azimuth, elevation))
    return np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def test_stars_are_seeded_and_spread():
    first, again = (night_dome(Sky(DEEP, stars=3), SMALL)[0] for _ in range(2))
    other = night_dome(Sky(DEEP, stars=4), SMALL)[0]
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    lit = (first @ LUMINANCE) > 0
    assert 0.03 < lit.mean() < 0.5
    quarters = lit.reshape(SMALL[0], 4, -1).sum(axis=(0, 2))
    assert quarters.min() > 0.8 * quarters.max()


def test_stars_do_not_depend_on_the_maps_size():
    """A star keeps its light: fewer, larger texels are dimmer."""
    light = []
    for rows in (128, 512):
        dome = night_dome(Sky(DEEP, stars=3), (rows, 4 * rows))[0] @ LUMINANCE
        high, _ = angles((rows, 4 * rows), share=0.5)
        light.append(float((dome * np.cos(high)[:, None]).sum() / rows**2))
    assert light[0] == pytest.approx(light[1], rel=0.02)


def test_over_a_town_few_stars_are_seen():
    seen = []
    for town in (0.0, 6e-6):
        dome = night_dome(Sky(DEEP, stars=3, glow=(town,) * 3), (512, 2048))[0]
        seen.append(int((dome - glow((town,) * 3, (512, 2048)) > 1e-9).any(axis=-1).sum()))
    assert 0 < seen[1] < 0.2 * seen[0]


def test_few_stars_are_bright():
    dome = night_dome(Sky(DEEP, stars=3), (512, 2048))[0] @ LUMINANCE
    flux = np.sort(dome[dome > 0])
    assert flux[-20] > 2 * flux[-200] > 4 * np.median(flux) / 2


def test_the_moon_stands_where_it_should_and_the_sky_is_bright_around_it():
    sky = bake_sky(Sky(DEEP, moon_direction=towards(210, 40)), (256, 512))
    assert sky.sun.moon
    np.testing.assert_allclose(sky.sun.direction, towards(210, 40), atol=1e-12)
    row, column = np.unravel_index((sky.radiance @ LUMINANCE).argmax(), (256, 512))
    assert row == pytest.approx((90 - 40) / 180 * 256, abs=1.5)
    assert column == pytest.approx(210 / 360 * 512, abs=1.5)


def test_the_moon_gives_no_light_beside_the_sun():
    both = bake_sky(Sky(towards(90, 20), moon_direction=towards(270, 30)), (64, 128))
    assert not both.sun.moon
    np.testing.assert_allclose(both.sun.direction, towards(90, 20), atol=1e-12)
    assert bake_sky(Sky(DEEP, moon_direction=towards(270, -5)), (64, 128)).sun is None


def test_glow_is_brightest_at_the_horizon():
    dome = glow((3.0, 2.0, 1.0), (64, 128))
    rings = dome.mean(axis=1)
    assert (np.diff(rings[:, 0]) > 0).all()
    np.testing.assert_allclose(rings[:, 0] / rings[:, 2], 3.0, rtol=1e-5)
    assert 1.0 < dome[-1, :, 2].max() / dome[-1, :, 2].min() < 3.0


def test_only_fine_things_ask_for_a_large_map():
    clear, starry = Sky(towards(90, 20)), Sky(DEEP, stars=1)
    assert map_size(starry)[0] >= 2 * map_size(clear)[0]
