"""Trees: budgets, one crown at all levels, species that look different, natural tints."""

import time

import numpy as np
import pytest

from sumo3dviz_pt.library.plants.tree import LEVELS, SHRUBS, SPECIES, fine_tree, tree

BUDGETS = (
    (20_000, 56_000),
    (8_400, 12_800),
    (3_400, 4_800),
    (1_750, 2_400),
    (700, 840),
    (240, 280),
)
PLANTS = {**SPECIES, **SHRUBS}


def areas_of(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def crown_measures(species):
    """Slenderness, height of the crown's foot, where it is widest, leaf hue, leaf area."""
    kind = SPECIES[species]
    leaves = tree(species, seed=2, level=2)[1]
    points = leaves.mesh.vertices / kind.height
    radius = np.hypot(points[:, 0], points[:, 1])
    low, high = np.percentile(points[:, 2], (2, 98))
    edges = np.linspace(low, high, 6)
    row = np.clip(np.digitize(points[:, 2], edges) - 1, 0, 4)
    widths = np.array([np.percentile(radius[row == k], 90) for k in range(5)])
    tint = leaves.tint.mean(axis=0)
    return np.array(
        [
            2.0 * widths.max(),
            low,
            widths[0] / widths.max(),
            widths[4] / widths.max(),
            2.0 * np.log(tint[1]),
            np.log(kind.height),
        ]
    )


@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("level", range(LEVELS))
def test_budget_size_and_finite_geometry(species, level):
    parts = tree(species, seed=1, level=level)
    low, high = BUDGETS[level]
    assert low <= sum(len(part.mesh.faces) for part in parts) <= high
    points = np.concatenate([part.mesh.vertices for part in parts])
    assert np.isfinite(points).all()
    assert -0.5 < points[:, 2].min() < -0.1
    assert 0.95 < points[:, 2].max() / SPECIES[species].height < 1.05
    for part in parts:
        assert np.allclose(np.linalg.norm(part.mesh.normals, axis=1), 1.0)


@pytest.mark.parametrize("species", PLANTS)
def test_no_face_is_empty(species):
    for level in (0, 2, 5):
        for part in tree(species, seed=4, level=level):
            assert areas_of(part.mesh).min() > 1e-9


@pytest.mark.parametrize("species", PLANTS)
def test_levels_share_leaf_area_outline_and_hue(species):
    crowns = [tree(species, seed=3, level=level)[1] for level in range(LEVELS)]
    areas = np.array([areas_of(crown.mesh).sum() for crown in crowns])
    assert areas / areas[1] == pytest.approx(np.ones(LEVELS), rel=0.15)
    size = np.ptp(crowns[0].mesh.bounds, axis=0)
    for one in crowns:
        assert (np.abs(one.mesh.bounds - crowns[0].mesh.bounds) <= 0.03 * size).all()
        tint = one.tint.mean(axis=0)
        assert tint == pytest.approx(crowns[0].tint.mean(axis=0), rel=0.12)


def test_species_differ_in_habit():
    measures = {name: crown_measures(name) for name in SPECIES}
    names = list(measures)
    for k, one in enumerate(names):
        for other in names[k + 1 :]:
            assert np.linalg.norm(measures[one] - measures[other]) > 0.25, (one, other)
    assert measures["poplar"][0] < 0.6 * measures["oak"][0]
    assert measures["spruce"][3] < 0.5 < measures["maple"][3]
    assert measures["pine"][1] > 0.35 > measures["lime"][1]


def test_birches_are_white_and_old_pines_red():
    birch, pine = (tree(name, seed=1)[0] for name in ("birch", "pine"))
    assert np.median(birch.tint, axis=0).min() > 0.15
    upper = pine.mesh.vertices[pine.mesh.faces].mean(axis=1)[:, 2] > 7.0
    red, _, blue = np.median(pine.tint[upper], axis=0)
    assert red > 2.5 * blue


def test_the_same_seed_gives_the_same_tree_and_another_another():
    one, same, other = (tree("maple", seed=seed)[1].mesh.vertices for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("species", PLANTS)
def test_leaves_have_natural_varied_tints(species):
    tint = tree(species, seed=1)[1].tint
    red, green, blue = tint.mean(axis=0)
    assert green > red > blue > 0
    assert 0.05 < green < 0.26
    assert tint[:, 1].std() > 0.1 * green


def test_trunks_flare_into_the_ground():
    kind, bark = SPECIES["pine"], tree("pine", seed=1)[0].mesh
    foot = bark.vertices[np.abs(bark.vertices[:, 2]) < 0.05, :2]
    assert np.hypot(*foot.T).max() > 1.4 * kind.girth * kind.height


def test_height_scales_the_whole_tree():
    small, tall = (tree("birch", seed=1, level=2, height=h)[1].mesh for h in (5.0, 10.0))
    assert np.allclose(2 * small.vertices, tall.vertices)


def test_a_near_tree_takes_no_time():
    begin = time.process_time()
    tree("poplar", seed=9, level=1)
    assert time.process_time() - begin < 1.0


@pytest.mark.parametrize("species", ["maple", "birch", "spruce", "hazel"])
def test_small_leaves_are_seen_one_by_one(species):
    """Each faces its own way and has its own brightness; together they are as bright."""
    small = fine_tree(species, seed=3, leaf=0.15)[1]
    large = tree(species, seed=3, level=1)[1]

    def tilts(part):
        """Cosines between normals and the planes that leaves really lie in."""
        a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
        flat = np.cross(b - a, c - a)
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        return np.abs((part.mesh.normals[part.mesh.faces[:, 0]] * flat).sum(axis=1))

    assert np.median(tilts(small)) > 0.96 > 0.92 > np.median(tilts(large))
    spread = [part.tint[:, 1].std() / part.tint[:, 1].mean() for part in (small, large)]
    assert spread[0] > 1.4 * spread[1]
    np.testing.assert_allclose(small.tint.mean(axis=0), large.tint.mean(axis=0), rtol=0.03)
