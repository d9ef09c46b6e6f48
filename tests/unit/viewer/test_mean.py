"""The mean of a picture's samples, in two halves that tell how far off it is."""

import numpy as np

from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.viewer.client import Mean


class Linear:
    """Shows radiance as it is: what the error does must not depend on tone curves."""

    def develop(self, seen, view, *, extra):
        return (seen["radiance"] * 2.0**extra).astype(np.float32)


def even(value, size=(3, 4)):
    """A sample that is the same everywhere."""
    radiance = np.full((*size, 3), value, np.float32)
    return Layers({"radiance": radiance, "hit": radiance[..., 0]})


def noisy(dice, *, about, spread, size=(3, 4)):
    """A sample of normal deviates."""
    return Layers({"radiance": dice.normal(about, spread, (*size, 3)).astype(np.float32)})


def mean_of(samples):
    first, *others = samples
    mean = Mean.of(first)
    for sample in others:
        mean = mean.with_sample(sample)
    return mean


def test_the_mean_counts_all_samples_alike():
    mean = mean_of([even(value) for value in (1.0, 2.0, 6.0)])
    assert mean.count == 3 and mean.size == (4, 3)
    assert list(mean.value) == ["radiance", "hit"]
    for layer in mean.value.values():
        np.testing.assert_allclose(layer, 3.0, rtol=1e-6)


def test_a_mean_that_has_a_further_sample_is_another_one():
    one = Mean.of(even(1.0))
    both = one.with_sample(even(3.0))
    assert (one.count, both.count) == (1, 2)
    np.testing.assert_array_equal(one.value["hit"], 1.0)
    np.testing.assert_array_equal(both.value["hit"], 2.0)


def test_the_error_is_that_of_the_mean():
    """Of n samples with deviation 1, it is 1 / sqrt(n): seen over many pixels and pictures."""
    dice = np.random.default_rng(4)
    samples = [noisy(dice, about=50.0, spread=1.0, size=(64, 96)) for _ in range(32)]
    for count in (2, 8, 32):
        error = mean_of(samples[:count]).error(Linear(), None, extra=0.0)
        assert abs(error * np.sqrt(count) - 1.0) < 0.05, count


def test_brighter_pictures_have_larger_errors():
    dice = np.random.default_rng(5)
    mean = mean_of([noisy(dice, about=1.0, spread=0.1) for _ in range(4)])
    plain, brighter = (mean.error(Linear(), None, extra=extra) for extra in (0.0, 1.0))
    assert np.isclose(brighter, 2.0 * plain, rtol=1e-4)


def test_one_sample_tells_no_error():
    assert Mean.of(even(1.0)).error(Linear(), None, extra=0.0) is None
