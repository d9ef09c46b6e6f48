"""Pixels that lamps may cover: every one that sees a lamp, and few others."""

from __future__ import annotations

import numpy as np
import pytest
from builders import view_at

from sumo3dviz_pt.render.kernel.lamps import covered

SIZE = (64, 36)
FROM = np.array([500.0, -300.0, 6.0])


def hits(corners: np.ndarray, view, fine: int = 4) -> np.ndarray:
    """Pixels through which some ray meets a triangle, (h, w), by many rays each."""
    rays = view.directions((SIZE[0] * fine, SIZE[1] * fine))
    found = np.zeros(rays.shape[:2], bool)
    for a, b, c in corners - view.position:
        matrix = np.stack([a, b, c])
        if abs(np.linalg.det(matrix)) > 1e-12:
            # A ray meets the triangle where it is a sum of its corners with positive shares.
            found |= (rays @ np.linalg.inv(matrix) > 0.0).all(axis=-1)
    return found.reshape(SIZE[1], fine, SIZE[0], fine).any(axis=(1, 3))


@pytest.mark.parametrize("seed", range(12))
def test_every_pixel_that_sees_a_lamp_is_covered(seed: int) -> None:
    """Also those whose corners lie behind the eye, or far outside the picture."""
    rng = np.random.default_rng(seed)
    view = view_at(FROM, heading=rng.uniform(0, 360), pitch=rng.uniform(-40, 40), fov=80)
    middles = FROM + rng.normal(scale=(3.0, 3.0, 1.0), size=(40, 1, 3))
    corners = middles + rng.normal(scale=rng.choice([0.05, 0.5, 3.0]), size=(40, 3, 3))
    seen = hits(corners, view)
    assert not (seen & ~covered(corners, view, SIZE)).any()


def test_small_lamps_cover_little() -> None:
    rng = np.random.default_rng(1)
    view = view_at(FROM, heading=0)
    ahead = FROM + np.column_stack([rng.uniform(-8, 8, 10), np.full(10, 30.0), np.zeros(10)])
    corners = ahead[:, None] + rng.normal(scale=0.05, size=(10, 3, 3))
    pixels = covered(corners, view, SIZE)
    assert 10 <= pixels.sum() <= 10 * 25
    assert not covered(corners - (0.0, 60.0, 0.0), view, SIZE).any()
    assert not covered(np.zeros((0, 3, 3)), view, SIZE).any()


@pytest.mark.parametrize("seed", range(6))
def test_thin_lamps_are_told_from_large_ones(seed: int) -> None:
    """Pixels of large ones alone get fewer samples; no thin one may lie among them unseen."""
    rng = np.random.default_rng(seed)
    view = view_at(FROM, heading=rng.uniform(0, 360), fov=80)
    middles = FROM + rng.normal(scale=(9.0, 9.0, 1.0), size=(40, 1, 3))
    thin = middles + rng.normal(scale=0.02, size=(40, 3, 3))
    wide = middles[:8] + rng.normal(scale=2.0, size=(8, 3, 3))
    every = np.concatenate([thin, wide])
    few = covered(every, view, SIZE, thinner=1.5)
    assert not (few & ~covered(every, view, SIZE)).any()
    small = [one for one in thin if covered(one[None], view, SIZE, thinner=1.5).any()]
    assert small and not (hits(np.array(small), view) & ~few).any()
    # A bar is thin, however long, and what reaches behind the eye is large.
    bar = FROM + np.array([[[-6.0, 20.0, 0.0], [6.0, 20.0, 0.0], [6.0, 20.0, 0.05]]])
    pane = FROM + np.array([[[-9.0, 5.0, -6.0], [9.0, 5.0, -6.0], [0.0, 5.0, 9.0]]])
    ahead = view_at(FROM, heading=0, fov=80)
    slanting = FROM + np.array([[[-6.0, 20.0, -5.0], [6.0, 20.0, 5.0], [6.0, 20.0, 5.05]]])
    for line in (bar, slanting):
        assert covered(line, ahead, SIZE, thinner=1.5).any()
    assert covered(pane, ahead, SIZE).mean() > 0.3
    assert not covered(pane, ahead, SIZE, thinner=1.5).any()
