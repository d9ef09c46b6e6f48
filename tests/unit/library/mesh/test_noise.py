import numpy as np
import pytest

from sumo3dviz_pt.library.mesh.noise import Band, blurred, cells, fractal, smoothstep, soft


def test_noise_is_seeded_and_normalised():
    first = fractal((64, 96), Band(1.5), seed=3)
    assert first.shape == (64, 96)
    assert abs(first.mean()) < 1e-12 and first.std() == pytest.approx(1)
    assert np.array_equal(first, fractal((64, 96), Band(1.5), seed=3))
    assert not np.array_equal(first, fractal((64, 96), Band(1.5), seed=4))


def test_band_limits_hold():
    power = np.abs(np.fft.rfft2(fractal((64, 64), Band(0.0, 8.0, 16.0), seed=1))) ** 2
    waves = np.hypot(np.fft.fftfreq(64)[:, None] * 64, np.fft.rfftfreq(64) * 64)
    assert power[waves < 8].max() < 1e-12 * power.sum()
    assert power[waves > 24].sum() < 1e-3 * power.sum()


def test_higher_exponents_are_smoother():
    rough, smooth = (fractal((128, 128), Band(e), seed=2) for e in (0.5, 2.0))
    assert np.abs(np.diff(smooth)).mean() < 0.5 * np.abs(np.diff(rough)).mean()


def test_stretch_makes_features_longer_along_rows():
    noise = fractal((128, 128), Band(1.5, stretch=6.0), seed=2)
    along, across = (np.abs(np.diff(noise, axis=axis)).mean() for axis in (1, 0))
    assert along < 0.6 * across


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


def test_soft_and_smoothstep():
    values = np.linspace(-10, 10, 101)
    assert np.abs(soft(values, 2.0)).max() <= 2
    assert np.allclose(soft(values[48:53] / 100, 2.0), values[48:53] / 100, atol=1e-6)
    steps = smoothstep(0.0, 1.0, np.array([-1, 0, 0.5, 1, 2]))
    assert steps.tolist() == [0, 0, 0.5, 1, 1]
