"""Reports count people and riders without building them, and count the same."""

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast import counts, figures
from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import FigureChoice, ModelChoice, models_for
from sumo3dviz_pt.cast.counts import counted_people
from sumo3dviz_pt.cast.drawing import counted
from sumo3dviz_pt.catalog import digest_of

FAST = "man_bald"
WHO = [(family, name) for family, some in counts._known().items() for name in some]


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path))
    for kept in (figures.person, counts._shapeless):
        kept.cache_clear()
    yield tmp_path
    for kept in (figures.person, counts._shapeless):
        kept.cache_clear()


def choice_of(family, name):
    if family == "people":
        return FigureChoice(name, 1.7)
    model = next(model for model in models_for({}) if model.name == name)
    return ModelChoice(model, "bicycle", model.size)


def test_all_people_and_riders_are_counted_as_their_recipes_are_now():
    """If this fails, run tools/count_people.py."""
    assert {name for family, name in WHO if family == "people"} == set(catalog.names("people"))
    for family, name in WHO:
        known = counts._known()[family][name]
        assert known["made_from"] == digest_of(catalog.find(family, name).meta), name


@pytest.mark.parametrize(
    ("family", "name"),
    [pytest.param(*who, marks=[] if who[1] == FAST else pytest.mark.slow) for who in WHO],
)
def test_who_is_counted_has_the_size_and_triangles_of_who_is_built(cache, family, name):
    choice = choice_of(family, name)
    quick = build_body(choice, counted_people([choice]))
    assert not any((cache / kind).exists() for kind in ("people", "riders")), "nobody was built"
    made = build_body(choice, {})
    ours, theirs = quick.prototype, made.prototype
    assert counted(ours) == counted(theirs) and ours.name == theirs.name
    assert counted(replace(ours, parts=ours.far)) == counted(replace(theirs, parts=theirs.far))
    assert (ours.poses is None, ours.far_poses is None) == (
        theirs.poses is None,
        theirs.far_poses is None,
    )
    assert (ours.lamps, quick.assembly.drawn) == (theirs.lamps, made.assembly.drawn)
    assert np.allclose(quick.size, made.size, rtol=0, atol=1e-9) and quick.stride == made.stride


def test_whose_shape_is_needed_is_not_counted():
    tall, small = FigureChoice(FAST, 1.9), FigureChoice(FAST, 1.5)
    other = FigureChoice("boy", 1.3)
    assert set(counted_people([tall, other])) == {FAST, "boy"}
    assert set(counted_people([tall, other], shaped=[small])) == {"boy"}


def test_who_has_another_recipe_is_not_counted(monkeypatch):
    known = {"people": {FAST: {"made_from": "another"}}, "vehicles": {}}
    monkeypatch.setattr(counts, "_known", lambda: known)
    assert counted_people([choice_of("people", FAST), FigureChoice("boy", 1.3)]) == {}
