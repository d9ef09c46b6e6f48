import numpy as np
import pytest

from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal, smoothstep


def test_noise_is_seeded_and_normalised():
    first = fractal((64, 96), Spectrum(1.5), seed=3)
    assert first.shape == (64, 96)
    assert abs(first.mean()) < 1e-12 and first.std() == pytest.approx(1)
    assert np.array_equal(first, fractal((64, 96), Spectrum(1.5), seed=3))
    assert not np.array_equal(first, fractal((64, 96), Spectrum(1.5), seed=4))


def test_band_limits_hold():
    power = np.abs(np.fft.rfft2(fractal((64, 64), Spectrum(0.0, 8.0, 16.0), seed=1))) ** 2
    waves = np.hypot(np.fft.fftfreq(64)[:, None] * 64, np.fft.rfftfreq(64) * 64)
    assert power[waves < 8].max() < 1e-12 * power.sum()
    assert power[waves > 24].sum() < 1e-3 * power.sum()


def test_higher_exponents_are_smoother():
    rough, smooth = (fractal((128, 128), Spectrum(e), seed=2) for e in (0.5, 2.0))
    assert np.abs(np.diff(smooth)).mean() < 0.5 * np.abs(np.diff(rough)).mean()


def test_stretch_makes_features_longer_along_rows():
    noise = fractal((128, 128), Spectrum(1.5, stretch=6.0), seed=2)
    along, across = (np.abs(np.diff(noise, axis=axis)).mean() for axis in (1, 0))
    assert along < 0.6 * across


def test_smoothstep():
    steps = smoothstep(0.0, 1.0, np.array([-1, 0, 0.5, 1, 2]))
    assert steps.tolist() == [0, 0, 0.5, 1, 1]
