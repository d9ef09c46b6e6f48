"""Designs: what they promise, counted."""

from collections import Counter
from itertools import combinations, pairwise
from math import prod

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.studies.designs.arrays import (
    balanced_orders,
    confounded_pairs,
    latin_square,
    orthogonal_array,
)
from sumo3dviz_pt.studies.designs.profiles import build_design

KNOWN = {
    (2, 2, 2): 4,
    (2,) * 4: 8,
    (2,) * 7: 8,
    (3,) * 4: 9,
    (2,) * 11: 12,
    (3, 2, 2, 2, 2): 12,
    (6, 2, 2): 12,
    (2,) * 15: 16,
    (4, 4, 2, 2): 16,
    (4, *(2,) * 12): 16,
    (4,) * 5: 16,
    (2, *(3,) * 7): 18,
    (6, 3, 3, 3): 18,
    (5, *(2,) * 8): 20,
    (3, 4, 2, 2, 2): 24,
    (5,) * 6: 25,
    (3,) * 13: 27,
    (8, 4, 2, 2): 32,
    (2, 2, 2, 2, 3, 3): 36,
    (5, 5, 5, 2): 50,
    (8,) * 9: 64,
}
"""Smallest arrays of strength 2, as tables of orthogonal arrays list them."""


def pairs_by_hand(rows, counts):
    """How often each pair of levels occurs, for every two factors."""
    for one, other in combinations(range(len(counts)), 2):
        seen = {(a, b): 0 for a in range(counts[one]) for b in range(counts[other])}
        for row in rows:
            seen[row[one], row[other]] += 1
        yield list(seen.values())


@pytest.mark.parametrize("counts", KNOWN, ids=str)
def test_arrays_are_as_small_as_known_ones_and_orthogonal(counts):
    rows = orthogonal_array(counts)
    assert rows.shape == (KNOWN[counts], len(counts))
    for seen in pairs_by_hand(rows.tolist(), counts):
        assert len(set(seen)) == 1


STRONG = {
    (2,) * 4: 8,
    (2,) * 8: 16,
    (3,) * 4: 27,
    (4, 2, 2, 2): 16,
    (3, 2, 2, 2, 2): 24,
    (2,) * 12: 24,
}
"""Smallest arrays of strength 3."""


@pytest.mark.parametrize("counts", STRONG, ids=str)
def test_three_factors_meet_in_all_ways_equally_often_in_arrays_of_strength_3(counts):
    rows = orthogonal_array(counts, strength=3)
    assert rows.shape == (STRONG[counts], len(counts))
    for three in combinations(range(len(counts)), 3):
        seen = Counter(map(tuple, rows[:, list(three)].tolist()))
        assert len(seen) == prod(counts[k] for k in three) and len({*seen.values()}) == 1


def test_where_no_strong_fraction_can_exist_that_is_said():
    with pytest.raises(ConfigError, match="no orthogonal fraction of strength 3 exists"):
        orthogonal_array((2, 2, 3, 3), strength=3)


@pytest.mark.parametrize(
    "counts", [(2, 3), (2, 2), (2, 2, 3), (2, 3, 5), (3, 3, 2, 2), (2, 3, 4, 5)]
)
def test_where_no_fraction_can_exist_that_is_said(counts):
    with pytest.raises(
        ConfigError, match=r"^design: no orthogonal fraction exists that is smaller"
    ):
        orthogonal_array(counts)


def test_an_array_that_is_not_found_is_not_called_impossible():
    with pytest.raises(ConfigError, match="no orthogonal fraction was found"):
        orthogonal_array((10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10))


def test_an_array_is_the_callers_own():
    orthogonal_array((2, 2, 2))[:] = 0
    assert not confounded_pairs(orthogonal_array((2, 2, 2)), (2, 2, 2))


def test_confounded_pairs_are_named():
    rows = np.array([[0, 0, 0], [0, 1, 1], [1, 0, 0], [1, 1, 1]])
    assert confounded_pairs(rows, (2, 2, 2)) == [(1, 2)]


def test_proportions_count_and_not_numbers():
    rows = np.array([[0, 0], [0, 1], [0, 0], [0, 1], [1, 0], [1, 1]])
    assert not confounded_pairs(rows, (2, 2))
    assert confounded_pairs(rows[1:], (2, 2)) == [(0, 1)]


@pytest.mark.parametrize(
    ("size", "factors"), [(3, 3), (3, 4), (4, 5), (5, 4), (6, 3), (7, 3), (10, 3)]
)
def test_each_pair_of_levels_meets_once_in_a_latin_square(size, factors):
    rows = latin_square([size] * factors)
    assert rows.shape == (size * size, factors)
    assert all(set(seen) == {1} for seen in pairs_by_hand(rows.tolist(), [size] * factors))


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ((2, 3, 3), "equally many levels, not 2 x 3 x 3"),
        ((3, 3), "three or more factors"),
        ((3,) * 5, "at most 4 factors, not 5"),
        ((6,) * 4, "no orthogonal Latin squares of 6 levels exist"),
        ((10,) * 4, "no orthogonal Latin squares of 10 levels are known here"),
    ],
)
def test_squares_that_are_not_there_are_refused(counts, words):
    with pytest.raises(ConfigError, match=words):
        latin_square(counts)


@pytest.mark.parametrize("count", range(1, 13))
def test_balanced_orders_have_each_thing_everywhere_and_after_each_other(count):
    orders = balanced_orders(count)
    assert len(orders) == (count if count % 2 == 0 or count == 1 else 2 * count)
    assert all(sorted(order) == list(range(count)) for order in orders)
    for place in range(count):
        seen = [order[place] for order in orders]
        assert {seen.count(thing) for thing in range(count)} == {len(orders) // count}
    after = [pair for order in orders for pair in pairwise(order)]
    every = [(a, b) for a in range(count) for b in range(count) if a != b]
    assert len({after.count(pair) for pair in every}) <= 1


# Designs by name ---------------------------------------------------------------------------

LEVELS = {"light": ("day", "night"), "trees": ("none", "some", "many"), "car": ("red", "white")}


def design(kind="full", exclude=(), seed=1, levels=LEVELS):
    return build_design(kind, levels, exclude=exclude, seed=seed)


def test_full_designs_hold_every_combination_once():
    found = design()
    assert len(found.profiles) == len(set(found.profiles)) == prod(map(len, LEVELS.values()))
    assert not found.notes


def test_the_seed_chooses_order_and_fraction_and_nothing_else_does():
    four = dict.fromkeys("abcd", ("low", "high"))
    assert design(seed=3) == design(seed=3)
    assert design(seed=3).profiles != design(seed=4).profiles
    assert set(design(seed=3).profiles) == set(design(seed=4).profiles)
    fractions = {frozenset(design("fraction", seed=s, levels=four).profiles) for s in range(20)}
    assert {len(some) for some in fractions} == {8} and len(fractions) > 1


def test_exclusions_leave_out_what_they_name():
    found = design(exclude=[{"light": ("night",), "trees": ("some", "many")}])
    assert found.excluded == 4 and len(found.profiles) == 8
    assert all(profile[1] == "none" for profile in found.profiles if profile[0] == "night")
    assert found.notes == ("with the exclusions the design confounds light with trees",)


def test_a_level_that_exclusions_leave_nowhere_is_named():
    found = design(exclude=[{"trees": ("many",)}])
    assert "no profile that is left has trees many" in found.notes


def test_excluding_everything_is_refused():
    with pytest.raises(ConfigError, match="exclude: nothing is left"):
        design(exclude=[{"light": ("day", "night")}])


def test_designs_beyond_bounds_are_refused():
    levels = {f"f{n}": tuple("abcdefghij") for n in range(5)}
    with pytest.raises(ConfigError, match="100,000 profiles"):
        design(levels=levels)
