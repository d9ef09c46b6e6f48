"""A camera's response: light is kept, noise follows its law, colour is halved, nothing breaks."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.response import response_named, response_names
from sumo3dviz_pt.image.tonemap import develop, develop_float
from sumo3dviz_pt.model.numbers import ResponseName
from sumo3dviz_pt.pipeline.still import response_of

CAMERAS = [name for name in response_names() if name != "none"]
NIGHT = 12.0


def street(height=90, width=160):
    """Light of a street: a wide range, with lamps."""
    rng = np.random.default_rng(5)
    light = rng.gamma(0.5, 0.4, (height, width, 3)).astype(np.float32)
    light[20, 30] = 300.0
    return light


def even(value, shape=(200, 320, 3)):
    return np.full(shape, value, np.float32)


def test_the_names_are_those_of_the_scene_file():
    assert response_names() == get_args(ResponseName)
    assert response_named("none") is None
    with pytest.raises(ConfigError, match=r"did you mean 'dashcam'"):
        response_named("dashcams")


def test_none_changes_no_bit():
    seen = street()
    np.testing.assert_array_equal(develop(seen), develop(seen, response=response_named("none")))


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("exposure", [0.0, NIGHT])
def test_light_is_kept_but_in_the_corners(name, exposure):
    seen = street(180, 320)
    got = replace(response_named(name), fall=0.0).on_light(seen, exposure=exposure)
    assert got.mean() == pytest.approx(seen.mean(), rel=0.005)


@pytest.mark.parametrize("name", CAMERAS)
def test_dark_places_get_a_share_of_the_mean(name):
    response = replace(response_named(name), fall=0.0, electrons=1e12, read=0.0)
    seen = even(0.0)
    seen[:, :100] = 0.8
    got = response.on_light(seen, exposure=0.0)
    share = response.veil * seen.mean()
    np.testing.assert_allclose(got[:, 200:], share, rtol=1e-3)


@pytest.mark.parametrize("name", CAMERAS)
def test_corners_lose_their_share(name):
    response = replace(response_named(name), electrons=1e12, read=0.0)
    got = response.on_light(even(0.4), exposure=0.0)
    assert got[100, 160, 0] == pytest.approx(0.4, rel=1e-3)
    for row in (0, -1):
        for column in (0, -1):
            corner = got[row, column, 0]
            assert corner == pytest.approx(0.4 * (1.0 - response.fall), rel=0.01)


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("exposure", [0.0, NIGHT])
@pytest.mark.parametrize("light", [0.1, 0.3, 0.9])
def test_variance_is_that_of_counting_and_reading(name, exposure, light):
    response = replace(response_named(name), fall=0.0)
    got = response.on_light(even(light), exposure=exposure)
    gain = 8.0 if exposure == NIGHT else 1.0
    white = response.electrons * (1280 / 320) ** 2 / gain
    law = light / white + (response.read * 4 / white) ** 2
    assert got.var(dtype=np.float64) == pytest.approx(law, rel=0.03)


def test_a_dash_camera_is_noisier_than_a_cinema_camera_and_more_so_by_night():
    sd = {
        (name, exposure): response_named(name)
        .deviation(np.float32(0.2), exposure=exposure, width=1280)
        .item()
        for name in CAMERAS
        for exposure in (0.0, NIGHT)
    }
    assert sd["dashcam", 0.0] > 1.5 * sd["cinema", 0.0]
    assert sd["dashcam", NIGHT] > 2 * sd["dashcam", 0.0]


def test_noise_is_a_function_of_the_frame():
    def made(seed, time):
        account = {"response": "dashcam", "seed": seed, "time": time}
        return develop(street(), exposure=1.0, response=response_of(account))

    first = made(3, 4.04)
    made(3, 4.0)  # another frame in between changes nothing
    np.testing.assert_array_equal(first, made(3, 4.04))
    for other in (made(3, 4.0), made(4, 4.04)):
        assert (first != other).any()


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("value", [0.0, 1e-30, 1e6])
def test_extremes_stay_within_range(name, value):
    seen = even(value, (37, 51, 3))
    seen[10, 10] = 1e6
    light = response_named(name).on_light(np.minimum(seen, 1e6), exposure=NIGHT)
    assert np.isfinite(light).all() and light.min() >= 0.0
    for tone in ("camera", "agx", "filmic", "neutral", "srgb"):
        got = develop_float(seen, exposure=NIGHT, tone=tone, response=response_named(name))
        assert got.shape == seen.shape and np.isfinite(got).all()
        assert got.min() >= 0.0 and got.max() <= 1.0


@pytest.mark.parametrize("shape", [(40, 60), (41, 61)])
def test_only_a_dash_camera_halves_colour(shape):
    grey, colour = np.full((*shape, 3), 0.5, np.float32), np.float32([0.1, 0.0, -0.1])
    stripes = grey + np.where(np.arange(shape[1]) % 2, 1, -1)[None, :, None] * colour
    plain = replace(response_named("dashcam"), sharpening=0.0)
    got = plain.on_picture(stripes.astype(np.float32))
    inside = got[:, 2:-2]
    weights = np.float32([0.2126, 0.7152, 0.0722])
    difference = inside - (inside @ weights)[..., None]
    assert np.abs(difference).max() < 1e-5  # colours of neighbours cancel out
    np.testing.assert_allclose(got @ weights, stripes @ weights, atol=1e-5)
    cinema = response_named("cinema").on_picture(stripes.astype(np.float32))
    np.testing.assert_array_equal(cinema, stripes.astype(np.float32))


def test_a_dash_camera_leaves_a_halo_along_edges():
    step = np.full((20, 1280, 3), 0.3, np.float32)
    step[:, 640:] = 0.6
    got = response_named("dashcam").on_picture(step)[10, :, 1]
    assert got.min() < 0.28 and got.max() > 0.62
    assert got[600] == pytest.approx(0.3, abs=1e-4) and got[680] == pytest.approx(0.6, abs=1e-4)


@pytest.mark.parametrize(
    ("lens", "darker"),
    [
        (None, True),
        ({"projection": "perspective", "stereo": "none"}, True),
        ({"projection": "perspective", "stereo": "top_bottom"}, False),
        ({"projection": "equirectangular", "stereo": "none"}, False),
    ],
)
def test_only_single_perspective_pictures_have_dark_corners(lens, darker):
    account = {"camera": "a", "scene": {"cameras": {"a": {"lens": lens}}}}
    assert bool(response_of(account, "cinema").fall) is darker
    assert response_of(account) is None
