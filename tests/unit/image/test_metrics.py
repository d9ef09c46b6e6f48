import builtins

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.metrics import capped_rmse, flip, flip_map, mean_bias, psnr, relative_mse

RNG = np.random.default_rng(2)
TRUTH = RNG.uniform(0.2, 0.8, (40, 50, 3)).astype(np.float32)


def test_equal_images_have_no_error():
    assert capped_rmse(TRUTH, TRUTH, cap=4) == relative_mse(TRUTH, TRUTH) == 0
    assert psnr(TRUTH, TRUTH) == np.inf
    assert mean_bias(TRUTH, TRUTH) == 0


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
