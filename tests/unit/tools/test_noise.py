import numpy as np
import pytest
from bakers.noise import blurred, cells, soft


def test_blur_wraps_around():
    point = np.zeros((16, 16))
    point[0, 0] = 1
    result = blurred(point, 1.0)
    assert result.sum() == pytest.approx(1)
    assert result[0, 1] == pytest.approx(result[0, -1]) and result[-1, 0] > 0.05


def test_cells_are_periodic_and_consistent():
    made = cells(64, 8, jitter=0.8, seed=5)
    assert set(np.unique(made.owner)) == set(range(64))
    assert (made.edge >= -1e-9).all() and (made.nearest >= 0).all()
    # The distance field is continuous across the seam.
    seam = np.abs(made.nearest[:, 0] - made.nearest[:, -1])
    assert seam.max() <= 8 / 64 + 1e-9


def test_soft_squeezes_only_outliers():
    values = np.linspace(-10, 10, 101)
    assert np.abs(soft(values, 2.0)).max() <= 2
    assert np.allclose(soft(values[48:53] / 100, 2.0), values[48:53] / 100, atol=1e-6)
