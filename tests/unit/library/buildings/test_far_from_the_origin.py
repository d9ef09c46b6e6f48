"""Textures of facades are as fine far from a network's origin as near it."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.library.buildings.shell import upright_uvs

WALL = np.array([[0, 0, 0], [7.5, 2, 0], [7.5, 2, 3], [0, 0, 3]], dtype=np.float64)
NEXT = WALL + np.array([7.5, 2, 0])


@pytest.mark.parametrize("tile", [1.5, 2.4])
@pytest.mark.parametrize("away", [0.0, 1e5, 1e6, 5e6, 1e7])
def test_texture_coordinates_stay_small_and_walls_continue(away, tile):
    quads = np.stack([WALL, NEXT]) + np.array([away, away, 0.0])
    uvs = upright_uvs(quads, tile=tile)
    assert np.abs(uvs).max() < 600.0
    # The renderer keeps 24 bits; an error of a thousandth of a tile is not seen.
    kept = uvs.astype(np.float32).astype(np.float64)
    steps = np.linalg.norm(np.diff(kept[:, :2], axis=1), axis=-1) * tile
    assert steps == pytest.approx(np.hypot(7.5, 2.0), abs=2e-3 * tile)
    seam = kept[0, 1] - kept[1, 0]
    assert np.abs(seam - np.rint(seam)).max() < 2e-3


def test_near_the_origin_nothing_is_shifted():
    uvs = upright_uvs(WALL[None], tile=1.5)
    assert uvs[0, :, 0] * 1.5 == pytest.approx([0, np.hypot(7.5, 2), np.hypot(7.5, 2), 0])
