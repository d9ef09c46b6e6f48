"""How often paths aim at which lamp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import Lobe, View
from sumo3dviz_pt.render.lights.emitter import (
    Glow,
    Grid,
    Shine,
    axes_of,
    cells_for,
    faces_of,
    lobe_row,
    nearness,
    picked,
)

EVEN = Lobe()


def glow(radiance, *, areas=(1.0, 1.0, 2.0), lamps=(0, 1, 1), lobe=EVEN, places=None):
    count = len(radiance)
    return Glow(
        np.repeat(np.array(radiance, float)[:, None], 3, axis=1),
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        np.tile(lobe_row(lobe), (count, 1)),
        np.array(areas, float),
        np.array(lamps),
        np.zeros((len(areas), 3)) if places is None else np.array(places, float),
    )


def shares(chance):
    return np.diff(chance, prepend=0.0, axis=1)


@pytest.mark.parametrize("radiance", [(1.0, 1.0), (3.0, 0.5), (0.0, 2.0)])
def test_lamps_side_by_side_are_picked_by_their_power(radiance):
    shining = glow(radiance)
    density, chance, _ = picked(shining, Grid(np.array([-40.0, -40.0]), 5.0))
    found = shares(chance)
    assert found.shape == (cells_for(3) ** 2, 3) and (chance[:, -1] == 1.0).all()
    expected = np.array(radiance) * [1.0, 3.0] / (radiance[0] + 3.0 * radiance[1])
    both = np.column_stack([found[:, 0], found[:, 1:].sum(axis=1)])
    np.testing.assert_allclose(both, np.tile(expected, (len(both), 1)), atol=1e-12)
    # Points lie evenly on a unit: that is what a density by area means.
    np.testing.assert_allclose(found, density * shining.areas, atol=1e-12)


def test_where_a_lamp_is_near_it_is_picked():
    places = [(-30.0, -30.0, 0.0), (30.0, 30.0, 0.0)]
    shining = glow((1.0, 1.0), areas=(1.0, 1.0), lamps=(0, 1), places=places)
    _, chance, _ = picked(shining, Grid(np.array([-40.0, -40.0]), 80.0 / cells_for(2)))
    cells = shares(chance)[:, 0].reshape(cells_for(2), -1)
    assert cells[0, 0] > 0.9 and cells[-1, -1] < 0.1
    assert cells[0, -1] == pytest.approx(0.5) and (cells > 0.0).all()


def test_what_lies_behind_a_lamp_is_rarely_lit_by_it_but_may_be():
    places = [(0.0, 0.0, 0.7), (0.5, 0.0, 0.7)]
    back_to_back = replace(
        glow((1.0, 1.0), areas=(1.0, 1.0), lamps=(0, 1), places=places),
        axes=np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]),
    )
    _, chance, _ = picked(back_to_back, Grid(np.array([-40.0, -40.0]), 80.0 / cells_for(2)))
    cells = shares(chance)[:, 0].reshape(cells_for(2), -1)
    middle = len(cells) // 2
    assert cells[middle, 0] > 0.9 and cells[middle, -1] < 0.1 and (cells > 0.0).all()


def test_wet_ground_before_a_lamp_mirrors_it_and_so_aims_at_it():
    """Each of two far lamps is picked on the way from the eye to it."""
    places = [(90.0, 0.0, 0.7), (0.0, 90.0, 8.0)]
    shining = glow((1.0, 1.0), areas=(1.0, 1.0), lamps=(0, 1), places=places)
    grid = Grid(np.array([-3.0, -3.0]), 1.5)
    dry, wet = (picked(shining, grid, on) for on in (None, Shine(np.zeros(2), 1.0)))
    before, cells = (shares(each.chance)[:, 0].reshape(64, 64) for each in (dry, wet))
    assert (cells[2, 6:] > 0.9).all() and (cells[6:, 2] < 0.1).all()
    assert (before[2, 6:20] < 0.7).all()
    # Nothing is mirrored behind the eye.
    np.testing.assert_allclose(cells[0, 0], before[0, 0])
    np.testing.assert_allclose(shares(wet.chance), wet.density * shining.areas, atol=1e-12)


def test_moist_ground_mirrors_less():
    places = [(90.0, 0.0, 0.7), (0.0, 90.0, 8.0)]
    shining = glow((1.0, 1.0), areas=(1.0, 1.0), lamps=(0, 1), places=places)
    given = [
        picked(shining, Grid(np.zeros(2), 1.5), Shine(np.zeros(2), wetness)).given[64 * 5 + 40]
        for wetness in (0.0, 0.1, 0.5, 1.0)
    ]
    assert (np.diff(given) > 0.0).all()


@pytest.mark.parametrize("dark", [(0,), (2,), (0, 1), (1, 3), (0, 2, 3)])
def test_dark_units_between_lit_ones_are_never_picked(dark):
    radiance = np.where(np.isin(np.arange(4), dark), 0.0, 1.0)
    shining = glow(radiance, areas=(1.0,) * 4, lamps=range(4))
    density, chance, _ = picked(shining, Grid(np.array([-40.0, -40.0]), 5.0))
    assert not density[:, dark].any() and not shares(chance)[:, dark].any()
    np.testing.assert_allclose(shares(chance), density)


def test_dark_lamps_have_no_density():
    density, chance, _ = picked(glow((0.0, 0.0)), Grid(np.zeros(2), 1.0))
    assert not density.any() and (chance == 1.0).all()


def test_tables_stay_small():
    assert cells_for(1) == 64 and cells_for(10**7) == 1
    assert all(cells_for(n) ** 2 * n <= 2e6 for n in (10, 1_000, 9_000, 300_000))


@pytest.mark.parametrize("lobe", [Lobe(), Lobe(0.06, 40.0), Lobe(3.0, 4.0), Lobe(0.2, 1e-9)])
def test_the_flux_of_a_lobe_is_its_integral(lobe):
    cosine = (np.arange(200_000) + 0.5) / 200_000
    assert lobe.flux == pytest.approx(2.0 * np.pi * (lobe.at(cosine) * cosine).mean(), rel=1e-6)
    assert lobe.at(np.array(1.0)) == 1.0


def test_a_dome_shines_along_its_middle():
    corners = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    normals, areas = faces_of(corners, faces)
    axes = axes_of(normals, areas, np.zeros(4, int), 1)
    np.testing.assert_allclose(axes, [[0.0, 0.0, 1.0]], atol=1e-12)
    assert areas.sum() == pytest.approx(4 * np.sqrt(3) / 2)


def test_lamps_in_the_picture_and_close_by_matter_most():
    view = View(Transform(np.eye(4)), Lens.of_degrees(60.0))
    near, far, beside, behind = nearness(
        np.array([[5.0, 0, 0], [100.0, 0, 0], [60.0, 80.0, 0], [-60.0, 0, 0]]), view
    )
    assert near > 3 * far > 0 and far > 3 * beside and far > 2 * behind > 0
