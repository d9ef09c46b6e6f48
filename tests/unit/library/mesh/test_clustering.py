"""Coarser stand-ins."""

from __future__ import annotations

import numpy as np
import pytest
from builders import ball
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sumo3dviz_pt.library.mesh.shading import clustered_body, numbered_rows
from sumo3dviz_pt.model.geometry import Mesh

WHOLE = st.integers(-3, 3)


@pytest.mark.parametrize("cell", [0.1, 0.25, 0.5])
def test_a_ball_keeps_its_outline_and_loses_faces(cell):
    fine = ball((1.0, 2.0, 3.0), 1.0)
    coarse = clustered_body([fine], cell)[0]
    assert len(coarse.faces) < len(fine.faces) * min(1.0, 0.05 / cell**2)
    assert np.abs(coarse.bounds - fine.bounds).max() < cell
    a, b, c = (coarse.vertices[coarse.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (np.linalg.norm(normals, axis=1) > 1e-6).all()
    outward = np.einsum("ij,ij->i", normals, (a + b + c) / 3 - [1, 2, 3])
    assert (outward > 0).mean() > 0.95


def test_small_things_vanish():
    speck = ball((0.0, 0.0, 0.0), 0.01)
    assert not len(clustered_body([speck], 0.5)[0].faces)
    none = Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert not len(clustered_body([none], 0.5)[0].faces)


def test_a_body_keeps_its_outermost_points():
    """Means of merged vertices would make it smaller."""
    fine = ball((1.0, 2.0, 3.0), 1.0)
    (coarse,) = clustered_body([fine], 0.4)
    reach = np.linalg.norm(coarse.vertices - [1.0, 2.0, 3.0], axis=1)
    np.testing.assert_allclose(reach, 1.0, atol=1e-3)


def test_small_bodies_get_small_cells():
    """A bicycle among lorries stays one."""
    fine = ball((0.0, 0.0, 0.0), 0.25)
    (coarse,) = clustered_body([fine], 0.35)
    assert len(coarse.faces) > 60
    assert np.abs(coarse.bounds - fine.bounds).max() < 0.02


@given(
    rows=arrays(np.int64, st.tuples(st.integers(0, 30), st.integers(1, 3)), elements=WHOLE),
    scale=st.sampled_from([1, 1 << 50, 1 << 61]),
)
def test_numbers_of_rows_compare_as_the_rows_do(rows, scale):
    rows = rows * scale
    _, first, place = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    found = np.unique(numbered_rows(rows), return_index=True, return_inverse=True)
    np.testing.assert_array_equal(found[1], first)
    np.testing.assert_array_equal(found[2], place.reshape(-1))
