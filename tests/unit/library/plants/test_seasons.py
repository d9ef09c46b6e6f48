"""Seasons: which plants lose their leaves, what colours they have, and what that costs."""

from typing import get_args

import numpy as np
import pytest

from sumo3dviz_pt.job.surroundings import Season
from sumo3dviz_pt.library.plants.species import (
    bare,
    far_tints,
    grass_gain,
    grass_tints,
    hedge_tints,
    leaf_tints,
)
from sumo3dviz_pt.library.plants.tree import LEVELS, SHRUBS, SPECIES, tree

KNOWN = {**SPECIES, **SHRUBS}
SEASONS = get_args(Season)


def test_conifers_keep_their_needles() -> None:
    kept = {name for name, kind in SPECIES.items() if not bare(kind, "winter")}
    assert kept == {"pine", "spruce"}
    assert not any(bare(kind, season) for kind in KNOWN.values() for season in SEASONS[:3])


@pytest.mark.parametrize("level", range(LEVELS))
@pytest.mark.parametrize("species", ["lime", "birch"])
def test_bare_crowns_keep_outline_and_budget(species: str, level: int) -> None:
    summer, winter = (
        tree(species, seed=3, level=level, season=season) for season in ("summer", "winter")
    )
    assert sum(len(p.mesh.faces) for p in winter) <= sum(len(p.mesh.faces) for p in summer)
    (low, high), (below, above) = summer[1].mesh.bounds, winter[1].mesh.bounds
    np.testing.assert_allclose(above - below, high - low, rtol=0.25)
    area = [_area(parts[1].mesh) for parts in (summer, winter)]
    assert 0.1 < area[1] / area[0] < 0.4


def _area(mesh) -> float:
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def test_twigs_are_as_dark_as_bark() -> None:
    bark, twigs = tree("lime", seed=3, level=2, season="winter")
    assert twigs.tint is not None and bark.tint is not None
    assert twigs.tint.mean() < 1.3 * bark.tint.mean()
    red, green, _ = twigs.tint.mean(axis=0)
    assert green < red


def test_autumn_turns_leaves_of_some_trees_sooner() -> None:
    leaves = tree("maple", seed=1, level=3)[1].tint
    assert leaves is not None
    early, late = (leaf_tints(leaves, KNOWN["maple"], "autumn", chance=c) for c in (0.9, 0.0))
    redness = [float((t[:, 0] / t[:, 1]).mean()) for t in (leaves, late, early)]
    assert redness[0] < redness[1] < redness[2]
    assert redness[2] > 1.5


def test_pears_blossom_in_spring() -> None:
    leaves = tree("pear", seed=1, level=3)[1].tint
    assert leaves is not None
    spring = leaf_tints(leaves, KNOWN["pear"], "spring", chance=0.5)
    white = spring.min(axis=1) > 0.5
    assert 0.6 < white.mean() < 0.85


@pytest.mark.parametrize("change", [far_tints, grass_tints, hedge_tints])
def test_summer_is_as_it_is_drawn(change) -> None:
    tint = np.random.default_rng(0).uniform(0.02, 0.3, (50, 3))
    np.testing.assert_array_equal(change(tint, "summer"), tint)
    for season in SEASONS:
        found = change(tint, season)
        assert found.shape == tint.shape and (found > 0).all() and (found <= 0.8).all()
    assert grass_gain("summer") == (1.0, 1.0, 1.0)
