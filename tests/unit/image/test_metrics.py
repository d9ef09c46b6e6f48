import builtins

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.metrics import (
    capped_rmse,
    flip,
    flip_map,
    flip_p99,
    hdr_flip,
    mean_bias,
    psnr,
    relative_mse,
    ssim,
)

RNG = np.random.default_rng(2)
TRUTH = RNG.uniform(0.2, 0.8, (40, 50, 3)).astype(np.float32)


def test_equal_images_have_no_error():
    assert capped_rmse(TRUTH, TRUTH, cap=4) == relative_mse(TRUTH, TRUTH) == 0
    assert psnr(TRUTH, TRUTH) == np.inf
    assert mean_bias(TRUTH, TRUTH) == 0
    assert ssim(TRUTH, TRUTH) == 1
    assert flip(TRUTH, TRUTH) == flip_p99(TRUTH, TRUTH) == hdr_flip(TRUTH, TRUTH) == 0


def test_known_offsets():
    assert capped_rmse(TRUTH + 0.1, TRUTH, cap=4) == pytest.approx(0.1, rel=1e-5)
    assert psnr(TRUTH + 0.1, TRUTH) == pytest.approx(20, rel=1e-5)
    assert mean_bias(TRUTH * 1.05, TRUTH) == pytest.approx(0.05, rel=1e-4)
    assert relative_mse(1.1 * TRUTH, TRUTH, epsilon=0) == pytest.approx(0.01, rel=1e-4)


def test_a_firefly_cannot_own_the_capped_or_trimmed_error():
    spotted = TRUTH.copy()
    spotted[3, 4] = 1e6
    assert capped_rmse(spotted, TRUTH, cap=4) < 0.2
    assert relative_mse(spotted, TRUTH) > 1e6
    assert relative_mse(spotted, TRUTH, trim=0.001) == 0


def test_flip_sees_differences_where_they_are():
    spotted = TRUTH.copy()
    spotted[:20, :20] = 1 - spotted[:20, :20]
    errors = flip_map(spotted, TRUTH)
    assert errors.shape == (40, 50)
    assert errors[:15, :15].mean() > 5 * errors[30:, 40:].mean()
    assert flip(TRUTH, TRUTH) == 0
    assert flip(spotted, TRUTH) == pytest.approx(float(errors.mean()))


def test_p99_of_flip_is_what_one_percent_exceeds():
    spotted = TRUTH.copy()
    spotted[10:20, 10:20] = 1 - spotted[10:20, 10:20]
    errors = flip_map(spotted, TRUTH)
    assert (errors > flip_p99(spotted, TRUTH)).mean() == pytest.approx(0.01, abs=1e-3)
    assert flip_p99(spotted, TRUTH) > 5 * flip(spotted, TRUTH)


# Structural similarity ---------------------------------------------------------------------


def test_ssim_follows_its_formula():
    """One window, written out: Wang et al. 2004, equations 13 to 16."""
    luma = np.array([0.2126, 0.7152, 0.0722])
    noisy = np.clip(TRUTH + RNG.normal(0, 0.1, TRUTH.shape), 0, 1)[:11, :11]
    steps = np.arange(-5, 6)
    weights = np.exp(-(steps[:, None] ** 2 + steps**2) / (2 * 1.5**2))
    weights /= weights.sum()
    x, y = noisy @ luma, TRUTH[:11, :11] @ luma
    mx, my = (weights * x).sum(), (weights * y).sum()
    vx, vy = (weights * (x - mx) ** 2).sum(), (weights * (y - my) ** 2).sum()
    cov = (weights * (x - mx) * (y - my)).sum()
    expected = (2 * mx * my + 1e-4) * (2 * cov + 9e-4)
    expected /= (mx**2 + my**2 + 1e-4) * (vx + vy + 9e-4)
    assert ssim(noisy, TRUTH[:11, :11]) == pytest.approx(expected, rel=1e-6)


def test_ssim_tells_structure_from_brightness():
    brighter, noisy = TRUTH + 0.1, TRUTH + RNG.normal(0, 0.1, TRUTH.shape)
    assert psnr(brighter, TRUTH) == pytest.approx(psnr(noisy, TRUTH), abs=0.3)
    assert ssim(brighter, TRUTH) > 0.95 > ssim(noisy, TRUTH) + 0.05
    assert ssim(1 - TRUTH, TRUTH) < -0.5


@pytest.mark.parametrize("size", [(8, 8), (1, 1), (10, 40), (11, 3)])
def test_tiny_pictures_have_errors_too(size):
    small = TRUTH[: size[0], : size[1]]
    for measure in (ssim, hdr_flip, flip_p99):
        assert np.isfinite(measure(small * 0.8, small))
    assert ssim(small, small) == 1


# Bias --------------------------------------------------------------------------------------


def test_emitters_can_be_exempt_from_the_bias():
    lamps = np.zeros((40, 50), dtype=bool)
    lamps[:3, :3] = True
    image, truth = (1.02 * TRUTH).copy(), TRUTH.copy()
    image[lamps], truth[lamps] = 100.0, 500.0
    assert mean_bias(image, truth) < -0.5
    assert mean_bias(image, truth, exempt=lamps) == pytest.approx(0.02, rel=1e-3)
    assert np.isnan(mean_bias(image, truth, exempt=np.ones((40, 50), dtype=bool)))


def test_bias_against_black():
    black = np.zeros_like(TRUTH)
    assert mean_bias(black, black) == 0
    assert mean_bias(TRUTH, black) == np.inf
    assert mean_bias(black, TRUTH) == -1


# HDR-FLIP ----------------------------------------------------------------------------------


def test_hdr_flip_takes_the_exposures_of_the_paper():
    """Without black and sun, flip-evaluator's own choice must come out."""
    import flip_evaluator

    radiance = np.float32(8.0) * TRUTH**2
    _, expected, _ = flip_evaluator.evaluate(
        radiance, 1.1 * radiance, "HDR", applyMagma=False, parameters={"ppd": 67.0}
    )
    assert hdr_flip(1.1 * radiance, radiance) == pytest.approx(expected, rel=1e-3)


def test_hdr_flip_does_not_depend_on_exposure():
    values = [hdr_flip(1.2 * scale * TRUTH, scale * TRUTH) for scale in (0.01, 1, 100)]
    assert values[0] > 0.02
    assert values == pytest.approx([values[0]] * 3, rel=1e-3)


def night(*, sun):
    """Nearly all black, a few grey pixels, and a very bright one."""
    image = np.zeros((20, 30, 3), dtype=np.float32)
    image[:2] = 0.3
    image[10, 10] = sun
    return image


@pytest.mark.parametrize("level", [0.0, 1e-30, 0.5, 1e5, 1e30])
@pytest.mark.parametrize("other", [0.0, 0.4])
def test_hdr_flip_survives_constant_pictures(level, other):
    """A black reference ended the process, and with it a night's measurements."""
    image, reference = (np.full((20, 30, 3), v, dtype=np.float32) for v in (other, level))
    assert 0 <= hdr_flip(image, reference) <= 1
    assert hdr_flip(reference, reference) == 0


def test_hdr_flip_survives_the_sun():
    with_sun = night(sun=1e5)
    assert hdr_flip(with_sun, with_sun) == 0
    spoiled = with_sun.copy()
    spoiled[5:] += 0.1
    # The sun must not hide what is wrong elsewhere.
    assert hdr_flip(spoiled, with_sun) > 0.5 * hdr_flip(spoiled, night(sun=0.3)) > 0.1
    assert 0 < hdr_flip(night(sun=0.3), with_sun) < 0.2


def test_hdr_flip_refuses_broken_pixels():
    broken = TRUTH.copy()
    broken[2, 3] = np.nan
    with pytest.raises(ValueError, match="finite"):
        hdr_flip(broken, TRUTH)


def test_flip_tells_what_is_missing(monkeypatch):
    true_import = builtins.__import__

    def without_flip(name, *args, **kwargs):
        if name == "flip_evaluator":
            raise ImportError(name)
        return true_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_flip)
    with pytest.raises(ConfigError, match="flip-evaluator"):
        flip(TRUTH, TRUTH)


def test_shapes_must_match():
    with pytest.raises(ValueError, match="against a reference"):
        psnr(TRUTH, TRUTH[:-1])
