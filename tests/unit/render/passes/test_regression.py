"""What guides give back of a smeared picture."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.render.passes.regression import regressed

SIZE = (90, 131)
"""No multiple of a square's side."""


def guides(seed: int = 0) -> dict[str, Image]:
    """Leaves: normals at all angles, pixel by pixel; the same reflectance, all of it foliage."""
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(*SIZE, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return {
        "normal": normal.astype(np.float32),
        "albedo": np.full((*SIZE, 3), 0.2, np.float32),
        "hit": np.ones(SIZE, np.float32),
    }


def picture(values: Image) -> Image:
    return np.repeat(values[..., None], 3, axis=-1).astype(np.float32)


def noisy(clean: Image, seed: int, scale: float = 0.8) -> Image:
    """A raw picture of which the clean one is the mean."""
    rng = np.random.default_rng(seed)
    return clean * rng.gamma(1 / scale**2, scale**2, SIZE)[..., None].astype(np.float32)


def rms(values: Image) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_shading_of_smeared_leaves_comes_back_without_the_noise() -> None:
    known = guides()
    clean = picture(1.0 + 0.5 * known["normal"][..., 2])
    smooth = picture(np.ones(SIZE))
    made = regressed(smooth, noisy(clean, 1), **known)
    assert rms(made - clean) < 0.5 * rms(smooth - clean)


@pytest.mark.parametrize("level", [1e-6, 1.0, 1e6])
def test_what_follows_no_guide_is_not_added(level: float) -> None:
    known = guides()
    clean = level * picture(np.ones(SIZE))
    made = regressed(clean, noisy(clean, 2), **known)
    # Of the noise remains what five numbers of a window of 400 pixels can follow.
    assert rms(made - clean) < 0.25 * rms(noisy(clean, 2) - clean)


def test_even_guides_add_nothing() -> None:
    known = guides() | {"normal": np.broadcast_to(np.float32([0, 0, 1]), (*SIZE, 3))}
    smooth = picture(1.0 + 0.1 * np.arange(SIZE[1])[None].repeat(SIZE[0], 0))
    made = regressed(smooth, noisy(smooth, 3), **known)
    np.testing.assert_allclose(made, smooth, rtol=1e-5)


def test_black_and_extreme_pictures_stay_finite() -> None:
    known = guides()
    for smooth, raw in ((0.0, 0.0), (0.0, 1e8), (1e8, 0.0), (1e-30, 1e30)):
        made = regressed(picture(np.full(SIZE, smooth)), picture(np.full(SIZE, raw)), **known)
        assert np.isfinite(made).all() and made.min() >= 0.0


def test_brightness_of_a_crown_does_not_change() -> None:
    known = guides()
    clean = picture(1.0 + 0.5 * known["normal"][..., 0])
    made = regressed(picture(np.ones(SIZE)), noisy(clean, 4), **known)
    assert made.mean() == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (4, 400)])
def test_smallest_pictures(size: tuple[int, int]) -> None:
    one = np.ones((*size, 3), np.float32)
    made = regressed(one, one, albedo=one, normal=one, hit=one[..., 0])
    np.testing.assert_allclose(made, one, rtol=1e-5)
