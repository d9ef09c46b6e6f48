"""Drivers behind the panes of cars."""

import numpy as np
import pytest
from bakery.bake import completed_recipe
from bakery.car.body import car_shape
from bakery.car.conform import CarFineness
from bakery.car.driver import driver
from bakery.car.recipe import read_recipe

from sumo3dviz_pt.catalog import find

LEVEL = CarFineness(spacing=0.055, faces=2500, step=0.2, sides=8)


@pytest.mark.parametrize("name", ["city_car", "sedan", "suv", "pickup", "coupe"])
def test_a_driver_lies_on_the_panes_and_faces_outwards(name):
    meta = find("vehicles", name).meta
    shape = car_shape(read_recipe(completed_recipe(find("vehicles", name).folder)))
    pieces = list(driver(shape, LEVEL))
    assert {material for material, _ in pieces} == {"glass", "glass_face", "glass_coat"}
    for _, mesh in pieces:
        d, y, z = (mesh.vertices * [-1.0, 1.0, 1.0]).T
        away = shape.field(d, y, z)
        assert (away > 0.0).all() and away.max() < 0.01
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        outwards = (np.cross(b - a, c - a) * mesh.normals[mesh.faces[:, 0]]).sum(axis=1)
        assert outwards.min() > 0.0
        assert mesh.vertices[:, 1].min() > 0.0
        assert mesh.vertices[:, 2].max() < meta["height"]
        assert mesh.vertices[:, 2].min() > 0.5 * meta["height"]
