"""How often paths aim at which lamp."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import Lobe, View
from sumo3dviz_pt.render.lights.emitter import (
    axes_of,
    cells_for,
    faces_of,
    nearness,
)


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
