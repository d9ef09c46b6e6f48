import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.image.tonemap import (
    TONES,
    develop,
    develop_float,
    srgb_encoded,
    tone_curve,
    tone_names,
)

GREYS = np.concatenate([[0.0], np.geomspace(1e-6, 1e6, 4000)]).astype(np.float32)


def grey_response(name):
    return TONES[name](np.repeat(GREYS[:, None], 3, axis=1))


@pytest.mark.parametrize("name", tone_names())
def test_greys_stay_grey_rise_and_reach_white(name):
    light = grey_response(name)
    assert light.min() >= 0 and light.max() <= 1
    assert np.ptp(light, axis=1).max() < 2e-3
    assert np.diff(light[:, 1]).min() > -1e-6
    assert light[0].max() < 1e-3 and light[-1].min() > 0.99


@pytest.mark.parametrize(
    ("name", "expected"), [("camera", 0.18), ("srgb", 0.18), ("neutral", 0.14), ("filmic", 0.18)]
)
def test_middle_grey(name, expected):
    light = TONES[name](np.full((1, 3), 0.18, np.float32))
    assert light == pytest.approx(expected, abs=2e-3)


def test_agx_puts_middle_grey_at_half_of_the_code_values():
    light = TONES["agx"](np.full((1, 3), 0.18, np.float32))
    assert srgb_encoded(light) == pytest.approx(0.5, abs=0.015)


def test_neutral_keeps_base_colours_but_for_the_offset():
    colour = np.array([[0.6, 0.3, 0.1]], np.float32)
    assert TONES["neutral"](colour) == pytest.approx(colour - 0.04, abs=1e-6)


def test_a_camera_keeps_the_colour_of_what_is_dark():
    leaf = np.array([[0.0215, 0.0274, 0.040]], np.float32)
    assert 255 * develop_float(leaf)[0] == pytest.approx([40, 46, 56], abs=3)
    dark = np.random.default_rng(3).uniform(0.0, 0.3, (500, 3)).astype(np.float32)
    assert TONES["camera"](dark) == pytest.approx(dark, abs=1e-6)


def test_a_camera_clips_sunlit_cloud_without_a_step():
    light = np.linspace(0.0, 3.0, 30001, dtype=np.float32)[:, None].repeat(3, axis=1)
    shown = TONES["camera"](light)[:, 1]
    slope = np.diff(shown) / np.diff(light[:, 1])
    assert shown[light[:, 1] >= 1.0].min() > 254.5 / 255.0
    rising = slope[light[1:, 1] < 0.999]
    assert 0.3 < rising.min() < rising.max() < 1.25
    assert np.abs(np.diff(rising)).max() < 0.01


def test_bright_colours_fade_to_white_except_with_srgb():
    lamp = np.array([[5000.0, 10.0, 10.0]], np.float32)
    assert TONES["srgb"](lamp).tolist() == [[1, 1, 1]]
    for name in ("camera", "neutral", "agx", "filmic"):
        assert TONES[name](lamp).min() > 0.15


def test_srgb_encoding_has_the_standards_values():
    linear = np.array([0.0, 0.0031308, 0.18, 0.5, 1.0], np.float32)
    expected = [0.0, 0.04045, 0.46135613, 0.73535698, 1.0]
    assert srgb_encoded(linear) == pytest.approx(expected, abs=1e-5)


def test_exposure_is_in_stops():
    image = np.full((2, 2, 3), 0.1, np.float32)
    assert np.allclose(
        develop_float(image, exposure=2, tone="srgb"), develop_float(4 * image, tone="srgb")
    )


def test_develop_rounds_and_ignores_negative_light():
    image = np.array([[[-5.0, 0.18, 1.0]]], np.float32)
    assert develop(image, tone="srgb").tolist() == [[[0, 118, 255]]]


def test_dither_is_seeded_and_keeps_the_mean():
    image = np.full((200, 200, 3), 0.21, np.float32)
    first = develop(image, tone="srgb", dither=4)
    assert np.array_equal(first, develop(image, tone="srgb", dither=4))
    assert not np.array_equal(first, develop(image, tone="srgb", dither=5))
    exact = 255 * float(develop_float(image, tone="srgb")[0, 0, 0])
    assert first.mean() == pytest.approx(exact, abs=0.02)
    assert np.ptp(first) <= 3


def test_broken_radiance_is_counted():
    image = np.ones((4, 4, 3), np.float32)
    image[0, 0, 0], image[1, 1, 1] = np.nan, np.inf
    with pytest.raises(RenderError, match="2 of 48"):
        develop(image)


def test_huge_radiance_stays_finite():
    for name in tone_names():
        assert np.isfinite(develop_float(np.full((1, 1, 3), 3e38, np.float32), tone=name)).all()


def test_unknown_curve_suggests_one():
    with pytest.raises(ConfigError, match="did you mean 'neutral'"):
        tone_curve("nuetral")
    with pytest.raises(ConfigError, match="known: camera, neutral, srgb"):
        tone_curve("xyz")
