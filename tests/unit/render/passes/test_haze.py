"""Aerial perspective."""

import numpy as np
from builders import view_at
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.scene import Haze
from sumo3dviz_pt.render.passes.finish import apply_haze, horizon_behind

HAZE = Haze()


def hazed(distance, *, hit=1.0, radiance=0.2, behind=0.6):
    shape = np.shape(distance)
    image = np.full((*shape, 3), radiance, dtype=np.float32)
    hits = np.full(shape, hit, dtype=np.float32)
    return apply_haze(
        image, HAZE, depth=distance * hits, hit=hits, behind=np.full((*shape, 3), behind)
    )


def test_nothing_happens_at_the_eye():
    np.testing.assert_array_equal(hazed(np.zeros((1, 2))), np.float32(0.2))


def test_sky_is_left_alone():
    image = np.array([[[3.0, 2.0, 1.0]]], dtype=np.float32)
    zero = np.zeros((1, 1), dtype=np.float32)
    result = apply_haze(image, HAZE, depth=zero, hit=zero, behind=np.full((1, 1, 3), 9.0))
    np.testing.assert_array_equal(result, image)


def test_koschmieder_at_one_kilometre():
    result = hazed(np.full((1, 1), 1000.0))[0, 0]
    through = np.exp(-1000 * np.array(HAZE.extinction))
    np.testing.assert_allclose(result, 0.2 * through + 0.6 * (1 - through), rtol=1e-5)


def test_where_lamps_light_what_falls_haze_has_its_share_of_what_far_things_fade_into():
    """A street in snowfall by night: far ground behind a lamp was as dark as the horizon."""
    haze = Haze((1e-4, 2e-4, 3e-4), falls=2e-3)
    far = np.full((1, 1), 40_000.0, np.float32)
    plain, behind = np.full((1, 1, 3), 0.5, np.float32), np.full((1, 1, 3), 0.1)
    found = apply_haze(plain, haze, depth=far, hit=np.ones((1, 1)), behind=behind)[0, 0]
    share = np.array(haze.extinction) / (np.array(haze.extinction) + 2e-3)
    np.testing.assert_allclose(found, 0.5 * (1 - share) + 0.1 * share, rtol=1e-5)
    # Nearby it is the haze that there is without anything that falls.
    near = np.full((1, 1), 5.0, np.float32)
    some, none = (
        apply_haze(plain, one, depth=near, hit=np.ones((1, 1)), behind=behind)[0, 0]
        for one in (haze, Haze(haze.extinction))
    )
    np.testing.assert_allclose(0.5 - some, 0.5 - none, rtol=0.01)


def test_half_covered_pixels_get_half_the_veil():
    full, half = hazed(np.full((1, 1), 800.0)), hazed(np.full((1, 1), 800.0), hit=0.5)
    np.testing.assert_allclose(half - 0.2, (full - 0.2) / 2, rtol=0.05)


def test_the_skyline_of_hills_in_haze_is_no_dark_line():
    """Half hill, half horizon: the picture's mean, and fully veiled, is all horizon."""
    half = hazed(np.full((1, 1), 15_000.0), hit=0.5, radiance=0.35, behind=0.6)
    np.testing.assert_allclose(half, 0.6, rtol=0.02)


@given(st.lists(st.floats(0, 1e5), min_size=2, max_size=20), st.floats(0, 5), st.floats(0, 5))
def test_haze_is_monotone_and_between_thing_and_horizon(distances, radiance, behind):
    row = np.sort(np.array(distances))[None]
    result = hazed(row, radiance=radiance, behind=behind)[0].astype(float)
    steps = np.diff(result, axis=0) * np.sign(behind - np.float32(radiance))
    assert (steps >= -1e-6).all()
    low, high = min(radiance, behind), max(radiance, behind)
    assert (result >= low - 1e-5).all() and (result <= high + 1e-5).all()


def test_blue_fades_first():
    red, green, blue = hazed(np.full((1, 1), 1000.0), radiance=0.0)[0, 0]
    assert red < green < blue


# Pixels ------------------------------------------------------------------------------------


def test_horizon_behind_looks_the_right_way():
    columns = 64
    azimuth = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    horizon = np.stack([np.sin(azimuth), np.cos(azimuth), azimuth * 0], axis=-1)
    for heading in (0, 45, 130, 270, 359):
        behind = horizon_behind(horizon, view_at([0, 0, 1], heading=heading, fov=10), (3, 3))
        expected = [np.sin(np.radians(heading)), np.cos(np.radians(heading)), 0]
        np.testing.assert_allclose(behind[1, 1], expected, atol=3e-3)
