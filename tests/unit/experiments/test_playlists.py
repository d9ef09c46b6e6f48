"""Playlists: orders are counterbalanced, blocks stay apart, seeds count."""

from collections import Counter

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.playlists import build_playlists
from sumo3dviz_pt.experiments.trials import Trial, dominated, profiles_of, single_trials


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
