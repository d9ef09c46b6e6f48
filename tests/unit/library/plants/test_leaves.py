"""Leaves near an eye: as small as real ones, with the area and colour of their cards."""

import numpy as np
import pytest

from sumo3dviz_pt.library.plants.leaves import (
    LEAF,
    OUTLINE,
    cards_of,
    triangles,
    wanted,
    with_leaves,
)
from sumo3dviz_pt.library.plants.tree import tree


def area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def foliage(species="maple", level=2):
    return tree(species, seed=1, level=level)[1]


@pytest.mark.parametrize("level", [0, 2])
@pytest.mark.parametrize("away", [5.0, 30.0])
def test_leaves_keep_area_and_colour_of_their_cards(level, away):
    leaf = foliage(level=level)
    cards = cards_of(leaf.mesh, leaf.tint)
    far = np.full(len(cards.areas), away)
    counts = wanted(cards, far)
    mesh, tint = with_leaves(
        leaf.mesh, leaf.tint, counts, outlined=far < OUTLINE, rng=np.random.default_rng(1)
    )
    kept = int((counts == 0).sum()) * cards.each
    assert len(mesh.faces) == len(tint) == kept + triangles(counts, far).sum()
    assert area(mesh) == pytest.approx(area(leaf.mesh), rel=0.12)
    assert np.allclose(tint.mean(axis=0), leaf.tint.mean(axis=0), rtol=0.05)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)


def test_the_nearest_leaves_are_as_long_as_real_ones():
    leaf = foliage(level=1)
    cards = cards_of(leaf.mesh, leaf.tint)
    near = np.full(len(cards.areas), 4.0)
    counts = wanted(cards, near)
    assert (counts > 0).all()
    mesh, _ = with_leaves(
        leaf.mesh, leaf.tint, counts, outlined=near < OUTLINE, rng=np.random.default_rng(1)
    )
    corners = mesh.vertices.reshape(counts.sum(), -1, 3)
    long = np.linalg.norm(corners - corners[:, :1], axis=2).max(axis=1)
    assert LEAF * 0.6 < np.median(long) < LEAF * 2.0


def test_needles_and_far_leaves_stay():
    for leaf, away in ((foliage("spruce", 0), 5.0), (foliage(level=0), 50.0)):
        cards = cards_of(leaf.mesh, leaf.tint)
        assert wanted(cards, np.full(len(cards.areas), away)).mean() < 0.2
