"""Raw and denoised pictures in one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.render.passes.finish import mixed, noisy_box, open_sky, texture

SHAPE = (24, 32, 3)
HIT = np.full(SHAPE[:2], 0.3)


def checks(contrast=0.5, noise=0.1, seed=1):
    """A chequered wall and the same with noise."""
    rows, columns = np.indices(SHAPE[:2])
    wall = 0.5 + contrast * (((rows + columns) % 2) - 0.5)
    smooth = np.repeat(wall[..., None], 3, axis=-1).astype(np.float32)
    spread = noise * np.random.default_rng(seed).standard_normal((*SHAPE[:2], 1))
    return smooth, (smooth + spread).astype(np.float32)


def test_without_a_share_all_but_the_sky_is_smooth():
    smooth, raw = checks()
    np.testing.assert_array_equal(mixed(smooth, raw, hit=HIT, share=0.0), smooth)


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_texture_is_mixed(share):
    """Noise far below the contrast is texture's own."""
    smooth, raw = checks(noise=0.01)
    found = mixed(smooth, raw, hit=HIT, share=share)
    np.testing.assert_allclose(found, (1 - share) * smooth + share * raw, atol=2e-3 * share)


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_what_is_even_stays_smooth(share):
    smooth, raw = checks(contrast=0.0)
    np.testing.assert_allclose(mixed(smooth, raw, hit=HIT, share=share), smooth, atol=1e-5)


@pytest.mark.parametrize("noise", [0.1, 0.25, 0.5])
def test_texture_is_wieners_ratio(noise):
    smooth, raw = checks(contrast=0.5, noise=noise)
    expected = 0.0625 / (0.0625 + noise**2)
    assert np.median(texture(smooth, raw)[4:-4, 4:-4]) == pytest.approx(expected, rel=0.1)


def test_the_sky_stays_raw_however_bright():
    smooth, raw = checks()
    raw[0, 0] = 1e4
    found = mixed(smooth, raw, hit=np.zeros(SHAPE[:2]), share=0.2)
    np.testing.assert_array_equal(found, raw)


def test_gaps_between_leaves_are_no_open_sky():
    """They would sparkle: another set of pixels in every frame."""
    rows, columns = np.indices(SHAPE[:2])
    hit = np.ones(SHAPE[:2])
    hit[:, 12:] = 0.0  # a wall's straight edge
    gaps = (columns < 10) & ((3 * rows + 5 * columns) % 4 < 2)
    hit[gaps] = 0.0
    np.testing.assert_array_equal(open_sky(hit), columns >= 12)
    smooth, raw = checks()
    found = mixed(smooth, raw, hit=hit, share=0.0)
    np.testing.assert_array_equal(found[:, :12], smooth[:, :12])
    np.testing.assert_array_equal(found[:, 12:], raw[:, 12:])


@given(st.integers(4, 90), st.integers(4, 90), st.integers(0, 89), st.integers(0, 89))
def test_the_noisy_box_leaves_out_nothing_but_open_sky(height, width, row, column):
    """Its edges are those of the picture, or of the network's blocks, a block from what is seen."""
    hit = np.zeros((height, width))
    hit[row % height :, column % width] = 1.0
    rows, columns = noisy_box(hit)
    noisy = ~open_sky(hit)
    outside = noisy.copy()
    outside[rows, columns] = False
    assert not outside.any()
    assert rows.start % 16 == columns.start % 16 == 0
    assert columns.stop == width or columns.stop % 16 == 0
    first = int(np.flatnonzero(noisy.any(axis=1))[0])
    assert rows.start == 0 or 16 <= first - rows.start < 32


def test_an_open_sky_has_no_noisy_box():
    rows, columns = noisy_box(np.zeros((20, 30)))
    assert np.zeros((20, 30))[rows, columns].size == 0


@given(st.floats(0.0, 1.0), st.floats(3.0, 1e6))
def test_a_flash_is_held_at_twice_its_surroundings(share, flash):
    smooth, raw = checks()
    raw[2, 3] = flash * smooth[2, 3]
    found = mixed(smooth, raw, hit=HIT, share=share)
    assert (found[2, 3] <= (1 + share) * smooth[2, 3] * (1 + 1e-5)).all()
    assert (found[2, 3] >= smooth[2, 3] * (1 - 1e-5)).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (8, 8)])
def test_tiny_pictures(size):
    smooth = np.full((*size, 3), 0.3, np.float32)
    assert np.isfinite(mixed(smooth, 2 * smooth, hit=np.ones(size), share=0.5)).all()
