"""Full detail is read, not built, and reports count it without reading it."""

from dataclasses import replace

import numpy as np
import pytest
from builders import cube

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.cast.drawing import Unit, counted, counted_bodies, full_bodies, full_prototypes
from sumo3dviz_pt.library.materials import MATERIALS

SMALL = "e_scooter"


def test_body_and_wheel_in_known_materials():
    made = full_prototypes([SMALL])
    assert set(made) == {f"{SMALL}/full", f"{SMALL}/wheel"}
    for name, prototype in made.items():
        assert prototype.name == name and prototype.parts and not prototype.far
        assert {part.material for part in prototype.parts} <= set(MATERIALS)
    body = np.concatenate([p.mesh.vertices for p in made[f"{SMALL}/full"].parts])
    length = catalog.find("vehicles", SMALL).meta["length"]
    assert body[:, 0].min() == pytest.approx(-length, abs=0.3)
    wheel = np.concatenate([p.mesh.vertices for p in made[f"{SMALL}/wheel"].parts])
    radius = catalog.find("vehicles", SMALL).meta["wheels"][0]["radius"]
    assert wheel[:, 2].max() == pytest.approx(radius, rel=0.02)
    assert wheel[:, 2].min() == pytest.approx(-radius, rel=0.02)


def test_a_stretched_body_keeps_its_full_detail_and_its_wheels():
    """A van that gives between its axles: wheels where they were on either side, and round."""
    model = next(model for model in models_for({}) if model.name == "delivery_van")
    length, *other = model.size
    own, longer = (
        build_body(ModelChoice(model, "delivery", (size, *other)), {}).assembly.units[0]
        for size in (length, length + 1.0)
    )
    assert own.full != longer.full and own.wheel == longer.wheel
    made = full_bodies([own, longer])
    assert set(made) == {own.full, longer.full, own.wheel}
    rears = [
        min(part.mesh.vertices[:, 0].min() for part in made[u.full].parts) for u in (own, longer)
    ]
    assert rears[0] - rears[1] == pytest.approx(1.0, abs=0.26), "bodies come in half metres"
    moved = [one.at[0] - other.at[0] for one, other in zip(own.wheels, longer.wheels, strict=True)]
    assert min(moved) == 0.0 and max(moved) == pytest.approx(rears[0] - rears[1])
    assert made[longer.full].lamps == longer.prototype.lamps


def unit_of(name):
    return Unit(cube(name))


def fitted(name, longer=0.0):
    model = next(model for model in models_for({}) if model.name == name)
    length, *other = model.size
    body = build_body(ModelChoice(model, "delivery", (length + longer, *other)), {})
    return body.assembly.units[0]


def test_nobody_near_reads_nothing():
    assert full_prototypes([]) == {}


@pytest.mark.parametrize("name", [SMALL, "sedan", "minibus"])
def test_counts_are_those_of_what_is_read(name):
    units = [unit_of(name), replace(unit_of(name), model=name)]
    quick, made = counted_bodies(units), full_bodies(units)
    assert set(quick) == set(made)
    for body in made:
        assert counted(quick[body]) == counted(made[body])
        assert quick[body].triangles == made[body].triangles
        assert (quick[body].name, quick[body].lamps) == (body, made[body].lamps)
        assert all(len(part.mesh.vertices) == 1 for part in quick[body].parts)


def test_a_stretched_body_counts_as_it_is_read():
    units = [fitted("delivery_van"), fitted("delivery_van", longer=1.0)]
    quick, made = counted_bodies(units), full_bodies(units)
    assert {n: (counted(b), b.lamps) for n, b in quick.items()} == {
        n: (counted(b), b.lamps) for n, b in made.items()
    }


def test_counting_reads_no_bodies(monkeypatch):
    def read(path):
        raise AssertionError(path)

    monkeypatch.setattr("sumo3dviz_pt.cast.drawing.read_levels", read)
    assert counted_bodies([unit_of("sedan")])["sedan/full"].triangles > 20_000
