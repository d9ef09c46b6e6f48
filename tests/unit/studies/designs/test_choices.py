"""Choice designs: D-errors by hand, no dominance, and how factors go together."""

from __future__ import annotations

import math
from itertools import combinations, product

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.studies.designs.profiles import (
    ChoiceRequest,
    associations,
    build_design,
    choice_tasks,
    d_error,
    in_words,
)
from sumo3dviz_pt.studies.designs.trials import Trial, single_trials

ONE = {"a": ("x", "y")}
TWO = {"a": ("x", "y"), "b": ("x", "y")}
FOUR = {f"f{n}": ("low", "mid", "high") for n in range(4)}
PRIORS = {"f0": {"low": -1.0, "high": 1.0}, "f1": {"low": 0.5}}


def task(*alternatives, name="1"):
    return Trial("1", name, tuple(None if each is None else tuple(each) for each in alternatives))


@pytest.mark.parametrize(
    ("levels", "tasks", "priors", "error"),
    [
        # One task of +1 and -1: shares of 1/2, information 1.
        (ONE, [task("x", "y")], {}, 1.0),
        # Utilities of 1 and -1: shares p and 1 - p, information 4 p (1 - p).
        (ONE, [task("x", "y")], {"a": {"x": 1.0, "y": -1.0}}, (math.e + 1 / math.e) ** 2 / 4),
        # With nothing and its constant: information diag(2/3, 2/9).
        (ONE, [task("x", "y", None)], {}, math.sqrt(27 / 4)),
        # ++ against -- and +- against -+: information diag(2, 2).
        (TWO, [task("xx", "yy"), task("xy", "yx")], {}, 0.5),
        # The first alone cannot tell the factors apart.
        (TWO, [task("xx", "yy")], {}, math.inf),
        # Codes (1, 0), (0, 1), (-1, -1) in one task: information [[2, 1], [1, 2]] / 3.
        ({"a": ("p", "q", "r")}, [task("p", "q", "r")], {}, math.sqrt(3)),
    ],
)  # fmt: skip
def test_d_errors_are_those_by_hand(levels, tasks, priors, error):
    assert d_error(levels, tasks, priors) == pytest.approx(error)


def test_the_best_two_tasks_of_two_factors_are_found():
    found = choice_tasks(TWO, ChoiceRequest(2), exclude=(), seed=1)
    assert d_error(TWO, found) == pytest.approx(0.5)
    every = [frozenset(pair) for pair in combinations(product("xy", repeat=2), 2)]
    others = [[task(*a), task(*b)] for a, b in combinations(every, 2)]
    assert d_error(TWO, found) == pytest.approx(min(d_error(TWO, some) for some in others))


@pytest.mark.parametrize(
    "asked",
    [ChoiceRequest(9), ChoiceRequest(12, 3, True, PRIORS), ChoiceRequest(8, 2, False, PRIORS)],
    ids=["pairs", "three and none", "pairs with priors"],
)
def test_no_film_of_a_task_is_best_in_all_factors(asked):
    seed = 3
    exclude = [{"f0": ("low",), "f1": ("low",)}]
    found = choice_tasks(FOUR, asked, exclude=exclude, seed=seed)
    assert len({frozenset(t.alternatives) for t in found}) == len(found) == asked.tasks
    assert all((t.alternatives[-1] is None) == asked.none for t in found)
    for each in found:
        films = [profile for profile in each.alternatives if profile is not None]
        assert len({*films}) == len(films) == asked.alternatives
        assert not any(film[0] == film[1] == "low" for film in films)
        for one, other in combinations(films, 2):
            worth = [
                [asked.priors.get(f, {}).get(level, 0.0) for f, level in zip(FOUR, p, strict=True)]
                for p in (one, other)
            ]
            apart = np.subtract(*worth)[:2] if asked.priors else np.array([1.0, -1.0])
            told = one[2:] == other[2:]
            assert not told or (apart > 0).any() == (apart < 0).any()
    by_chance = [task(*p) for p in _drawn(asked, seed)]
    assert d_error(FOUR, found, asked.priors) < d_error(FOUR, by_chance, asked.priors)
    assert found == choice_tasks(FOUR, asked, exclude=exclude, seed=seed)


def _drawn(asked, seed):
    """As many tasks by chance."""
    rng, every = np.random.default_rng(seed), list(product(*FOUR.values()))
    none = [None] if asked.none else []
    for _ in range(asked.tasks):
        yield [*(every[n] for n in rng.permutation(81)[: asked.alternatives]), *none]


def test_ranks_tell_what_is_best_where_no_priors_do():
    ranks = {name: {"x": 1, "y": 0} for name in TWO}
    with pytest.raises(ConfigError, match="only 1 different tasks"):
        choice_tasks(TWO, ChoiceRequest(2, ranks=ranks), exclude=(), seed=0)


@pytest.mark.parametrize(
    ("levels", "asked", "words"),
    [
        (ONE, ChoiceRequest(2), "only 1 different tasks of 2 films"),
        (TWO, ChoiceRequest(1), "1 tasks of 2 films cannot tell all effects apart"),
        (ONE, ChoiceRequest(1, 2, False, {"a": {"x": 1.0}}), "only 0 different tasks"),
    ],
)
def test_tasks_that_are_not_there_are_refused(levels, asked, words):
    with pytest.raises(ConfigError, match=f"choices.tasks: {words}"):
        choice_tasks(levels, asked, exclude=(), seed=0)


def test_associations_are_none_in_orthogonal_designs_and_whole_between_the_same():
    levels = {"a": ("x", "y"), "b": ("x", "y"), "c": ("p", "q", "r", "s")}
    design = build_design("full", levels, exclude=(), seed=2)
    trials = single_trials(design.profiles)
    assert associations(levels, trials) == pytest.approx(np.eye(3))
    assert "0 for any two" in "".join(in_words(levels, trials))
    same = single_trials([("x", "x", "p"), ("y", "y", "q"), ("x", "x", "r"), ("y", "y", "s")])
    found = associations(levels, same)
    assert found[0, 1] == pytest.approx(1.0) and found[0, 2] == pytest.approx(1.0)
    # 2 x 2 counts of 3, 1, 1, 3: chi squared is 2 of 8.
    some = [("x", "x")] * 3 + [("x", "y"), ("y", "x")] + [("y", "y")] * 3
    assert associations(TWO, single_trials(some))[0, 1] == pytest.approx(0.5)
