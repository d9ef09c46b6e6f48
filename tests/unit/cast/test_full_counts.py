"""Reports count bodies in full detail without building them, and count the same."""

from dataclasses import replace

import pytest
from bakery.bake import has_full_detail
from builders import cube

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast import full_counts
from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.cast.full_counts import counted, counted_bodies, recipe_digest
from sumo3dviz_pt.cast.full_detail import full_bodies
from sumo3dviz_pt.model.scene import Part, Prototype

NAMES = [n for n in catalog.names("vehicles") if has_full_detail(catalog.find("vehicles", n).meta)]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path))
    return tmp_path / "vehicles"


def unit_of(name):
    return Unit(Prototype(name, (Part(cube(), "paint"),), ()))


def fitted(name, longer=0.0):
    model = next(model for model in models_for({}) if model.name == name)
    length, *other = model.size
    body = build_body(ModelChoice(model, "delivery", (length + longer, *other)), {})
    return body.assembly.units[0]


def test_every_vehicle_with_full_detail_is_counted_as_its_recipe_is_now():
    """If this fails, run tools/count_full_bodies.py with the vehicles' names."""
    known = full_counts._known()
    assert list(known) == NAMES
    assert {name: levels["made_from"] for name, levels in known.items()} == {
        name: recipe_digest(name) for name in NAMES
    }


@pytest.mark.parametrize(
    "name", ["e_scooter", *(pytest.param(n, marks=pytest.mark.slow) for n in ("sedan", "minibus"))]
)
def test_counts_are_those_of_what_is_built(cache, name):
    units = [unit_of(name)]
    quick = counted_bodies(units)
    assert not cache.exists(), "nothing was built"
    made = full_bodies(units)
    assert set(quick) == set(made)
    for body in made:
        assert counted(quick[body]) == counted(made[body])
        assert quick[body].triangles == made[body].triangles
        assert (quick[body].name, quick[body].lamps) == (body, made[body].lamps)


@pytest.mark.slow
def test_a_stretched_body_counts_as_it_is_built(cache):
    units = [fitted("delivery_van"), fitted("delivery_van", longer=1.0)]
    quick, made = counted_bodies(units), full_bodies(units)
    assert {n: (counted(b), b.lamps) for n, b in quick.items()} == {
        n: (counted(b), b.lamps) for n, b in made.items()
    }


def test_a_vehicle_whose_recipe_is_another_is_built(cache, monkeypatch):
    known = {**full_counts._known()}
    known["e_scooter"] = {**known["e_scooter"], "made_from": "another"}
    monkeypatch.setattr(full_counts, "_known", lambda: known)
    units = [unit_of("e_scooter"), replace(unit_of("sedan"), model="sedan")]
    made = counted_bodies(units)
    assert len(made["e_scooter/full"].parts[0].mesh.vertices) > 1
    assert len(made["sedan/full"].parts[0].mesh.vertices) == 1
    assert len(list(cache.iterdir())) == 1
