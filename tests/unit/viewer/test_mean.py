"""The mean of a picture's samples, in two halves that tell how far off it is."""

import numpy as np

from sumo3dviz_pt.viewer.mean import Mean

SIZE = (4, 3)


class Linear:
    """Shows radiance as it is: what the error does must not depend on tone curves."""

    def develop(self, seen, view, *, extra):
        return (seen[..., :3] * 2.0**extra).astype(np.float32)


def test_the_mean_counts_all_samples_alike():
    mean = Mean.empty(SIZE)
    for value in (1.0, 2.0, 6.0):
        mean = mean.with_sample(np.full((3, 4, 5), value, dtype=np.float32))
    assert mean.count == 3
    np.testing.assert_allclose(mean.value, 3.0, rtol=1e-6)


def test_the_error_is_that_of_the_mean():
    """Of n samples with deviation 1, it is 1 / sqrt(n): seen over many pixels and pictures."""
    dice = np.random.default_rng(4)
    mean, size = Mean.empty((96, 64)), (64, 96, 5)
    for count in range(1, 33):
        mean = mean.with_sample(dice.normal(50.0, 1.0, size).astype(np.float32))
        if count in (2, 8, 32):
            error = mean.error(Linear(), None, extra=0.0)
            assert abs(error * np.sqrt(count) - 1.0) < 0.05, count


def test_brighter_pictures_have_larger_errors():
    dice = np.random.default_rng(5)
    mean = Mean.empty(SIZE)
    for _ in range(4):
        mean = mean.with_sample(dice.normal(1.0, 0.1, (3, 4, 5)).astype(np.float32))
    plain, brighter = (mean.error(Linear(), None, extra=extra) for extra in (0.0, 1.0))
    assert np.isclose(brighter, 2.0 * plain, rtol=1e-4)


def test_one_sample_tells_no_error():
    mean = Mean.empty(SIZE)
    assert mean.error(Linear(), None, extra=0.0) is None
    one = mean.with_sample(np.ones((3, 4, 5), dtype=np.float32))
    assert one.error(Linear(), None, extra=0.0) is None
