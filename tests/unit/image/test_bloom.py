"""Glare: light is spread, none is made."""

import numpy as np
import pytest

from sumo3dviz_pt.image.optics import bloom
from sumo3dviz_pt.image.tonemap import develop_float


def lamp(size=(160, 200), value=500.0):
    image = np.full((*size, 3), 0.01, np.float32)
    image[size[0] // 2, size[1] // 2] = value
    return image


@pytest.mark.parametrize("size", [(160, 200), (333, 401)])
def test_light_is_kept(size):
    image = lamp(size)
    spread = bloom(image, 0.1)
    assert spread.sum(dtype=float) == pytest.approx(image.sum(dtype=float), rel=0.02)
    assert spread.shape == image.shape and spread.dtype == np.float32 and (spread >= 0).all()


def test_nothing_changes_without_it_or_in_even_light():
    image = lamp()
    np.testing.assert_array_equal(bloom(image, 0.0), image)
    even = np.full((90, 120, 3), 0.4, np.float32)
    np.testing.assert_allclose(bloom(even, 0.3), even, rtol=1e-5)


def test_a_lamp_glows_less_and_less_around_it():
    rows = bloom(lamp((360, 400)), 0.05)[180, 200:320, 0] - 0.01
    assert (np.diff(rows[1:60]) <= 1e-6).all()
    assert rows[3] > 20 * rows[30] > 0


def test_a_wider_picture_of_the_same_height_glows_alike():
    """Lenses of one angle upward: what is added at the sides does not widen the glow."""
    square, wide = bloom(lamp((120, 120)), 0.05), bloom(lamp((120, 240)), 0.05)
    np.testing.assert_allclose(square[60, 60:90], wide[60, 120:150], rtol=0.02)


def test_it_is_the_same_at_another_size():
    """The glow's shape follows the picture, not its pixels."""
    small, large = lamp((180, 180), 400.0), lamp((360, 360), 100.0)
    large[180:182, 180:182] = 400.0
    a, b = bloom(small, 0.1), bloom(large, 0.1)
    at = np.array([6, 15, 30])
    np.testing.assert_allclose(a[90, 90 + at, 0], b[180, 180 + 2 * at, 0], rtol=0.2)


def test_develop_takes_it():
    plain, glowing = (develop_float(lamp(), tone="neutral", glare=share) for share in (0.0, 0.05))
    assert glowing[80, 108].min() > 2.0 * plain[80, 108].min()
