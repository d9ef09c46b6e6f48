"""Every asset as an exhibit."""

from functools import cache

import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import models_for
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.vehicles.recipe import WheelPlace
from sumo3dviz_pt.model.scene import is_tinted
from sumo3dviz_pt.shot import showroom
from sumo3dviz_pt.shot.showroom import FAMILIES, exhibits

QUICK = ("vehicles", "people", "trees", "buildings", "street", "surfaces")


@cache
def shown_of(family):
    """Modelling people takes a second."""
    return tuple(exhibits(family))


@pytest.mark.slow
@pytest.mark.parametrize("family", QUICK)
def test_exhibits_can_be_drawn(family):
    shown = shown_of(family)
    assert len({exhibit.title for exhibit in shown}) == len(shown) > 5
    for exhibit in shown:
        assert exhibit.triangles > 0
        assert {part.material for part in exhibit.parts} <= set(exhibit.materials)
        for part in exhibit.parts:
            # Nobody drives here whose colour a part could take.
            assert part.tint is not None or not is_tinted(exhibit.materials[part.material])


@pytest.mark.parametrize("family", ["vehicles", "people", "trees", "buildings", "street"])
def test_exhibits_stand_on_the_ground(family):
    for exhibit in shown_of(family):
        low, high = exhibit.bounds
        # Houses and posts have foundations, woods have roots.
        assert -2.5 < low[2] < 0.12, exhibit.title
        assert high[2] > 0.1 and (high > low).all()


def test_all_that_users_can_choose_is_shown():
    titles = {family: [exhibit.title for exhibit in shown_of(family)] for family in QUICK}
    assert set(titles["vehicles"]) == {model.name for model in models_for({})}
    assert set(titles["people"]) == set(catalog.names("people"))
    assert set(titles["surfaces"]) == set(catalog.names("surfaces"))


def test_vehicles_have_their_own_size():
    for exhibit in shown_of("vehicles"):
        low, high = exhibit.bounds
        length = catalog.find("vehicles", exhibit.title).meta["length"]
        assert high[0] - low[0] == pytest.approx(length, rel=0.05, abs=0.8), exhibit.title


def test_levels_of_a_vehicle(monkeypatch):
    small = next(body for body in showroom._bodies() if body.assembly.model == "e_scooter")
    monkeypatch.setattr(showroom, "_bodies", lambda chosen: iter([small]))
    full, middle, far = exhibits("levels")
    assert (full.title, middle.title) == ("e_scooter, full", "e_scooter")
    assert full.triangles > middle.triangles > far.triangles
    for other in (middle, far):
        np.testing.assert_allclose(full.bounds, other.bounds, atol=0.12)


@pytest.mark.parametrize(("side", "reversed_"), [(1, False), (1, True), (-1, False), (-1, True)])
def test_wheels_show_the_face_that_films_show(side, reversed_):
    """As in `Assembly.movers`: the outer face looks to +y on the left, unless reversed."""
    (entry,) = (body for body in showroom._bodies() if body.assembly.model == "e_scooter")
    unit = entry.assembly.units[0]
    place = WheelPlace((-0.5, 0.2 * side, 0.1), 0.1, reversed=reversed_)
    shown = Unit(unit.prototype, wheels=(place,))
    bare = showroom._unit_parts(Unit(unit.prototype), "full")
    wheel = showroom._unit_parts(shown, "full")[len(bare) :]
    made = showroom.full_bodies([unit])[unit.wheel].parts
    sign = -1.0 if (side < 0) != reversed_ else 1.0
    for drawn, part in zip(wheel, made, strict=True):
        expected = part.mesh.vertices * [sign, sign, 1.0] + place.at
        np.testing.assert_allclose(drawn.mesh.vertices, expected, atol=1e-6)


def test_unknown_sheet_is_refused_with_a_suggestion():
    with pytest.raises(ConfigError, match="did you mean 'vehicles'"):
        list(exhibits("vehicle"))
    assert set(QUICK) | {"levels"} == set(FAMILIES)
