"""Panes of bodies tell of the cabin behind them, and lamps keep their colours as lenses."""

import numpy as np
import pytest

from sumo3dviz_pt.cast.fitting import read_vehicle
from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.library.vehicles.glazing import LENS, LENSES, PANE, lens_counts, lensed, paned
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.world.town.parked import _car

CARS = [name for name in names("vehicles") if "cabin" in find("vehicles", name).meta]


@pytest.mark.parametrize("name", CARS)
def test_panes_of_near_cars_tell_where_they_are_in_a_cabin(name):
    body = read_vehicle(find("vehicles", name))
    (pane,) = (part.mesh for part in body.parts if part.material == PANE)
    assert pane.wear is not None and pane.uvs is not None
    assert pane.wear.min() > 0.0 and pane.wear.max() < 1.0
    assert np.ptp(pane.uvs, axis=0).max() == 0.0
    assert PANE not in {part.material for part in body.far}


@pytest.mark.parametrize("name", CARS)
def test_cabins_are_as_large_as_their_bodies_let_them_be(name):
    meta = find("vehicles", name).meta
    seat, low, rear, roof, half, cowl, tail = meta["cabin"]
    assert -meta["length"] < seat - tail < seat < seat + cowl < 0.0
    assert low + roof < meta["height"]
    assert 0.5 < half < meta["width"] / 2.0
    assert 0.6 < rear < 1.3


def test_lamps_become_one_material_with_the_colours_that_they_had():
    body = read_vehicle(find("vehicles", "sedan"))
    made = list(lensed(body.parts))
    lenses = [part for part in made if part.material == LENS]
    assert not {part.material for part in made} & set(LENSES)
    assert all(part.tint is not None and len(part.tint) == len(part.mesh.faces) for part in lenses)
    counts = {part.material: len(part.mesh.faces) for part in body.parts}
    assert lens_counts(counts)[LENS] == sum(len(part.mesh.faces) for part in lenses)
    assert lens_counts({"trim": 3}) == {"trim": 3}


def test_cars_that_stand_say_which_way_they_look():
    meta = find("vehicles", "sedan").meta
    (mesh,) = (p.mesh for p in read_vehicle(find("vehicles", "sedan")).parts if p.material == PANE)
    north, east = (paned(mesh, meta, yaw=yaw, chance=0.4) for yaw in (np.pi / 2.0, 0.0))
    assert north.uvs is not None and east.uvs is not None
    np.testing.assert_array_equal(north.uvs[:, 0], east.uvs[:, 0])
    np.testing.assert_allclose(north.uvs[0, 1] - east.uvs[0, 1], 0.25, atol=1e-3)


def test_parked_cars_near_by_have_panes_and_lose_nothing_but_dirt():
    place = Transform.from_pose((30.0, 40.0, 0.0), yaw=1.0)
    parts = list(_car("bay 1", place, 7, near=True))
    panes = [part.mesh for part in parts if part.material == PANE]
    assert len(panes) == 1 and panes[0].wear is not None and panes[0].uvs is not None
    assert all(part.mesh.uvs is None for part in parts if part.material != PANE)
    assert PANE not in {part.material for part in _car("bay 1", place, 7, near=False)}
