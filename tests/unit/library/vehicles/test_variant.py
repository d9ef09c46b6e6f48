"""Assets that vary another one."""

from __future__ import annotations

from sumo3dviz_pt.library.vehicles.recipe import varied

BASE = {"length": 4.7, "vclass": "passenger", "recipe": {"cowl": 1, "panels": ["a", "b"]}}


def test_own_keys_replace_those_of_the_base():
    made = varied(BASE, {"base": "sedan", "vclass": "taxi", "recipe": {"cowl": 2}})
    assert made == {
        "length": 4.7,
        "vclass": "taxi",
        "base": "sedan",
        "recipe": {"cowl": 2, "panels": ["a", "b"]},
    }


def test_more_of_a_list_goes_after_the_base_and_leaves_it_as_it_was():
    made = varied(BASE, {"recipe": {"more_panels": ["c"], "more_strips": ["d"]}})
    assert made["recipe"] == {"cowl": 1, "panels": ["a", "b", "c"], "strips": ["d"]}
    assert BASE["recipe"]["panels"] == ["a", "b"]


def test_nothing_of_its_own_is_the_base():
    assert varied(BASE, {}) == BASE
