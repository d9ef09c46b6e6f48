"""Windows of light, and pictures in bands."""

import numpy as np
import pytest
from scipy.ndimage import uniform_filter
from stages import Stage

from sumo3dviz_pt.image.average import accumulated
from sumo3dviz_pt.image.reprojected import MARGIN, bands_of, likeness, window_sums

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("window", [3, 5, 9, 21])
def test_sums_are_those_of_a_box_filter(window):
    values = RNG.normal(size=(40, 57)).astype(np.float32)
    reach = window // 2
    expected = uniform_filter(values.astype(np.float64), window)[reach:-reach, reach:-reach]
    sums = window_sums(values, window)
    assert sums.dtype == np.float32
    np.testing.assert_allclose(sums, expected * window**2, atol=2e-4)


def test_sums_of_whole_numbers_are_exact():
    known = RNG.random((30, 41)) < 0.4
    sums = window_sums(known.astype(np.int16), 21)
    assert sums.dtype == np.int16
    assert sums[0, 0] == known[:21, :21].sum() and sums[-1, -1] == known[-21:, -21:].sum()


def test_other_windows_are_refused():
    with pytest.raises(ValueError, match="no window of 7"):
        window_sums(np.zeros((30, 30), np.float32), 7)


@pytest.mark.parametrize("share", [1.0, 0.7])
def test_light_of_bands_is_that_of_the_whole(share):
    width, height = 3000, 130  # three bands: wide pictures have few rows in each
    change = RNG.normal(scale=0.2, size=(height, width)).astype(np.float32)
    change[40:60, 500:700] += 0.3
    known = RNG.random(change.shape) < share
    whole = likeness(*(np.pad(each, MARGIN, mode="edge") for each in (change, known)))
    bands = list(bands_of((width, height), MARGIN))
    assert len(bands) == 3
    parts = [
        likeness(band.padded(change[band.rows]), band.padded(known[band.rows])) for band in bands
    ]
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-6)
    assert whole[50, 600] < 0.1 and np.median(whole[known]) > 0.9


def test_the_number_of_threads_changes_no_bit():
    steps = [-2, -1, 1, 2]
    others = [Stage(eye=(0.3 * k, 0.0, 3.0), noise=0.2).frame(k + 5) for k in steps]
    one, many = (
        accumulated(Stage(noise=0.2).frame(), others, threads=threads) for threads in (1, 3)
    )
    for name, layer in one.layers.items():
        np.testing.assert_array_equal(many.layers[name], layer)
    np.testing.assert_array_equal(many.frames, one.frames)
