"""Playlists: orders are counterbalanced, blocks stay apart, seeds count."""

from collections import Counter

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.studies.designs.profiles import build_design
from sumo3dviz_pt.studies.designs.trials import (
    Trial,
    build_playlists,
    dominated,
    profiles_of,
    shared_out,
    single_trials,
    uneven,
    uneven_groups,
    with_even_places,
)


def lists(trials, **changes):
    asked = {"order": "latin", "count": None, "parts": 1, "repeat": 1, "seed": 5}
    return build_playlists(trials, **(asked | changes))


FOUR = single_trials([(letter,) for letter in "abcd"])


def test_latin_playlists_show_every_trial_at_every_position_equally_often():
    found = lists(FOUR)
    assert [playlist.name for playlist in found] == ["1", "2", "3", "4"]
    for place in range(4):
        assert Counter(playlist.trials[place] for playlist in found) == Counter(FOUR)


def test_a_count_goes_round_the_orders():
    found = lists(FOUR, count=9)
    assert found[0].trials == found[4].trials == found[8].trials != found[1].trials


def test_blocks_are_seen_apart():
    trials = [Trial(block, task, ((task,),)) for block in "12" for task in "abc"]
    found = lists(trials)
    assert {playlist.block for playlist in found} == {"1", "2"} and len(found) == 12
    for playlist in found:
        assert {trial.block for trial in playlist.trials} == {playlist.block}
    assert [playlist.block for playlist in lists(trials, count=4)] == ["1", "2", "1", "2"]


def test_parts_share_out_all_trials():
    found = lists(FOUR, parts=2)
    assert {playlist.block for playlist in found} == {"1.1", "1.2"}
    shown = {playlist.block: set(playlist.trials) for playlist in found}
    assert shown["1.1"] | shown["1.2"] == set(FOUR) and not shown["1.1"] & shown["1.2"]


def factorial(*counts, seed=0):
    levels = {f"f{n}": tuple(f"l{k}" for k in range(count)) for n, count in enumerate(counts)}
    return single_trials(build_design("full", levels, exclude=(), seed=seed).profiles)


def test_two_parts_of_three_factors_are_balanced_for_every_seed():
    """They were drawn by lot: for 177 of 200 seeds a level stood more often in one part."""
    for seed in range(200):
        parts = shared_out(factorial(2, 2, 2, seed=seed), 2, seed=seed, block="1")
        for part in parts:
            assert len(part) == 4
            for place in range(3):
                assert {*Counter(t.alternatives[0][place] for t in part).values()} == {2}


@pytest.mark.parametrize(
    ("counts", "parts"),
    [
        *(((2,) * 4, 2), ((2,) * 5, 4), ((2,) * 6, 8), ((3, 3, 3), 3), ((3,) * 4, 9)),
        ((2, 4, 4), 2),
    ],
)
def test_parts_are_confounded_with_interactions_alone(counts, parts):
    """Each part has each level, and each pair of levels, equally often."""
    names = [f"f{n}" for n in range(len(counts))]
    trials = factorial(*counts)
    for seed in range(3):
        own = shared_out(trials, parts, seed=seed, block="1")
        assert {len(part) for part in own} == {len(trials) // parts}
        assert {trial for part in own for trial in part} == {*trials}
        assert not uneven(own, names)


@pytest.mark.parametrize(
    ("counts", "parts"), [((2, 2, 3), 4), ((2, 3, 4), 2), ((2, 3, 4), 5), ((4, 4), 4)]
)
def test_parts_are_as_even_as_whole_numbers_can_be(counts, parts):
    trials = factorial(*counts)
    own = shared_out(trials, parts, seed=1, block="1")
    assert {len(part) for part in own} <= {len(trials) // parts, -(-len(trials) // parts)}
    for place, count in enumerate(counts):
        for part in own:
            times = Counter(trial.alternatives[0][place] for trial in part)
            assert {times[f"l{k}"] for k in range(count)} <= {
                len(part) // count, -(-len(part) // count)
            }  # fmt: skip


def test_what_parts_cannot_share_evenly_is_named():
    own = shared_out(factorial(2, 2), 2, seed=1, block="1")
    assert uneven(own, ["light", "trees"]) == ["light x trees"]
    four = factorial(2, 2)
    by_first = sorted(four, key=lambda trial: trial.alternatives)
    assert uneven([by_first[:2], by_first[2:]], ["light", "trees"]) == ["light"]


def test_parts_of_choice_tasks_count_all_that_they_show():
    tasks = [
        Trial("1", str(n), ((a, "x"), (b, "y"), None))
        for n, (a, b) in enumerate([("p", "q"), ("q", "p"), ("p", "p"), ("q", "q")])
    ]
    assert not uneven(shared_out(tasks, 2, seed=3, block="1"), ["one", "two"])


CHOICES = [Trial("1", str(n), ((f"{n}a",), (f"{n}b",), None)) for n in range(6)]


@pytest.mark.parametrize("order", ["latin", "random", "as_written"])
def test_each_film_of_a_task_stands_at_each_place_equally_often(order):
    """Also at each position of a playlist, and in half of the tasks of each playlist."""
    plain = lists(CHOICES, order=order)
    found = with_even_places(plain, count=None, seed=3)
    assert len(found) == 2 * len(plain)
    first = Counter(
        (position, trial.alternatives[0])
        for playlist in found
        for position, trial in enumerate(playlist.trials)
    )
    for (position, profile), times in first.items():
        twin = (profile[0][:-1] + ("b" if profile[0].endswith("a") else "a"),)
        assert first[position, twin] == times
    for playlist in found:
        assert sum(trial.alternatives[0][0].endswith("b") for trial in playlist.trials) == 3
        assert all(trial.alternatives[2] is None for trial in playlist.trials)
    names = {(trial.task, trial.alternatives) for each in found for trial in each.trials}
    assert len({task for task, _ in names}) == len(names) == 12
    assert len(with_even_places(plain, count=2, seed=3)) == 2


def test_a_count_that_balances_nothing_is_found():
    assert not uneven_groups(lists(FOUR)) and not uneven_groups(lists(FOUR, count=8))
    assert uneven_groups(lists(FOUR, count=5)) == uneven_groups(lists(FOUR, count=3)) == ["1"]
    assert not uneven_groups(with_even_places(lists(FOUR), count=None, seed=1))


def test_repeats_come_after_all_others():
    for playlist in lists(FOUR, repeat=2):
        assert set(playlist.trials[:4]) == set(playlist.trials[4:]) == set(FOUR)


def test_random_orders_hang_on_the_seed_alone():
    assert lists(FOUR, order="random") == lists(FOUR, order="random")
    assert lists(FOUR, order="random") != lists(FOUR, order="random", seed=6)
    assert lists(FOUR, order="as_written")[0].trials == FOUR


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"parts": 5}, "playlists.parts: block 1 has 4 trials, fewer than parts"),
        ({"parts": 2, "count": 1}, "playlists.count: the design has 2 blocks"),
    ],
)
def test_what_cannot_be_is_refused(changes, words):
    with pytest.raises(ConfigError, match=words):
        lists(FOUR, **changes)


def test_too_many_playlists_are_refused():
    trials = [Trial(str(n), "1", (("a",),)) for n in range(10_001)]
    with pytest.raises(ConfigError, match="at most 10,000 are made"):
        lists(trials)


def test_profiles_are_listed_once_and_nothing_is_none():
    trials = [Trial("1", "1", (("a",), ("b",), None)), Trial("1", "2", (("b",), ("c",), None))]
    assert profiles_of(trials) == (("a",), ("b",), ("c",))


def test_what_nobody_would_choose_is_found_where_levels_are_ranked():
    price, look = {"5": 0, "3": 1, "1": 2}, None
    task = Trial("1", "1", (("3", "red"), ("5", "red"), ("1", "blue"), None))
    assert dominated(task, (price, look)) == (2,)
    assert dominated(task, (price, {"red": 0, "blue": 1})) == (1, 2)
    assert dominated(task, (None, None)) == ()
    assert dominated(Trial("1", "1", (("1", "red"), ("1", "red"))), (price, None)) == ()
