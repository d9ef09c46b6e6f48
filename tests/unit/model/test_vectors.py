"""Unit vectors, lengths along lines and areas of triangles."""

import numpy as np
import pytest

from sumo3dviz_pt.model.geometry import arc_length, area_vectors, areas, unit

CORNER = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0], [3.0, 12.0, 4.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 1]])


def test_unit_vectors_keep_their_direction_and_none_stays_none():
    given = np.array([[[3.0, 4.0], [0.0, 0.0]], [[-1e-6, 0.0], [0.0, 1e6]]])
    assert unit(given) == pytest.approx(np.array([[[0.6, 0.8], [0, 0]], [[-1, 0], [0, 1]]]))


def test_lengths_are_measured_in_the_dimensions_that_are_given():
    assert arc_length(CORNER) == pytest.approx([0.0, 5.0, 17.0])
    assert arc_length(CORNER[:, :2]) == pytest.approx([0.0, 3.0, 15.0])
    assert arc_length(CORNER[:1]).tolist() == [0.0]


def test_area_vectors_point_along_normals_and_are_twice_the_area():
    flat = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0]])
    assert area_vectors(flat, TRIANGLES).tolist() == [[0, 0, 6], [0, 0, -6]]
    assert areas(flat, TRIANGLES).tolist() == [3.0, 3.0]
    posed = np.stack([flat, 2.0 * flat])
    assert area_vectors(posed, TRIANGLES)[1].tolist() == [[0, 0, 24], [0, 0, -24]]
