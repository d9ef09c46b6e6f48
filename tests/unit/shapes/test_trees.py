"""Trees: budgets, one crown at all levels, natural tints."""

import time

import numpy as np
import pytest

from sumo3dviz_pt.shapes.trees import SPECIES, tree

BUDGETS = ((20_000, 34_000), (6_500, 14_000), (3_500, 4_800), (1_500, 2_700), (200, 280))


def area(part):
    a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("level", range(5))
def test_budget_size_and_finite_geometry(species, level):
    parts = tree(species, seed=1, level=level)
    low, high = BUDGETS[level]
    assert low <= sum(len(part.mesh.faces) for part in parts) <= high
    points = np.concatenate([part.mesh.vertices for part in parts])
    assert np.isfinite(points).all()
    assert points[:, 2].min() == pytest.approx(-0.3, abs=0.1)
    assert 0.95 < points[:, 2].max() / SPECIES[species].height < 1.15
    for part in parts:
        assert np.allclose(np.linalg.norm(part.mesh.normals, axis=1), 1.0)


@pytest.mark.parametrize("species", SPECIES)
def test_levels_share_leaf_area_and_outline(species):
    crowns = [tree(species, seed=3, level=level)[1] for level in range(5)]
    areas = np.array([area(crown) for crown in crowns])
    assert areas / areas[1] == pytest.approx(np.ones(5), rel=0.2)
    spread = [np.percentile(c.mesh.vertices, (5, 95), axis=0) for c in crowns]
    for one in spread:
        assert np.abs(one - spread[1]).max() < 0.16 * SPECIES[species].height


def test_the_same_seed_gives_the_same_tree_and_another_another():
    one, same, other = (tree("maple", seed=seed)[1].mesh.vertices for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_leaves_have_natural_varied_tints():
    tint = tree("maple", seed=1)[1].tint
    assert tint.mean(axis=0) == pytest.approx([0.11, 0.2, 0.042], abs=0.03)
    assert tint[:, 1].std() > 0.02
    assert (tint > 0).all()


def test_height_scales_the_whole_tree():
    small, tall = (tree("birch", seed=1, level=2, height=h)[1].mesh for h in (5.0, 10.0))
    assert np.allclose(2 * small.vertices, tall.vertices)


def test_a_near_tree_takes_no_time():
    begin = time.process_time()
    tree("poplar", seed=9, level=1)
    assert time.process_time() - begin < 1.0
