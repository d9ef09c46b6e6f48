"""Worn paint covers what is left of its quads, however rows meet their borders."""

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.model.geometry import area_vectors
from sumo3dviz_pt.world.roads.markings.markings import Coats, worn_paint


def test_a_border_may_run_along_the_end_of_a_row():
    quad = np.array([[0.0, 0.0, 1.0], [0.9, 0.0, 1.0], [0.9, 1.0, 1.0], [0.0, 1.0, 1.0]])
    left = shapely.Polygon([(0, 0), (0.9, 0), (0.9, 1), (0.45, 1), (0.45, 0.5), (0, 0.5)])
    coats = Coats(
        quad[None],
        np.array([left], dtype=object),
        np.ones(1),
        np.zeros(1),
        np.zeros((1, 2), dtype=np.bool_),
    )
    paint = worn_paint(coats, shapely.STRtree([]))
    areas = area_vectors(paint.vertices, paint.faces)
    assert areas[:, 2].sum() / 2.0 == pytest.approx(left.area, abs=1e-6)
