"""Cuts, refinement, shading normals and simplification."""

from __future__ import annotations

import numpy as np
import pytest
from bakery.mesh import cutting
from bakery.mesh.cutting import Surface
from bakery.mesh.implicit import dual_contour
from bakery.mesh.simplify import simplify

from sumo3dviz_pt.library.mesh import shading


def ball(x, y, z):
    return np.sqrt(x * x + y * y + z * z) - 1.0


def circle(x, y, z):
    return np.where(z > 0, np.hypot(x, y) - 0.5, 1.0)


@pytest.fixture(scope="module")
def surface() -> Surface:
    axis = np.arange(-1.3, 1.31, 0.2)
    vertices, faces = dual_contour(ball, (axis, axis, axis))
    return Surface(vertices, faces, np.zeros(len(faces), int))


def areas(surface: Surface):
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0


def edge_uses(faces):
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(sides, axis=0, return_counts=True)[1]


def test_refined_cut_follows_the_curve_and_stays_closed(surface):
    fine = cutting.refine(surface, circle, ball, tolerance=0.004)
    assert (edge_uses(fine.faces) == 2).all()
    cut = cutting.split(fine, circle)
    assert (edge_uses(cut.faces) == 2).all()
    inside = circle(*cut.centroids.T) < 0
    tagged = cutting.retag(cut, inside, 5, (0,))
    cap = 2 * np.pi * (1 - np.sqrt(0.75))
    assert areas(tagged)[tagged.tags == 5].sum() == pytest.approx(cap, rel=0.04)
    values = circle(*cut.vertices.T)[cut.faces]
    assert not ((values.min(axis=1) < -2e-3) & (values.max(axis=1) > 2e-3)).any()


def test_split_without_crossing_changes_nothing(surface):
    assert cutting.split(surface, lambda x, y, z: x + 9.0) is surface


def test_retag_replaces_only_what_it_may(surface):
    everywhere = np.ones(len(surface.faces), bool)
    first = cutting.retag(surface, everywhere, 2, (0,))
    assert (first.tags == 2).all()
    assert (cutting.retag(first, everywhere, 3, (0, 1)).tags == 2).all()


def test_normals_of_a_ball_are_radial_and_shared(surface):
    owner, normals = cutting.corner_normals(ball, surface)
    assert (normals * surface.vertices[owner]).sum(axis=1).min() > 0.99
    mesh = shading.weld(owner, surface.vertices[owner], normals)
    assert len(mesh.vertices) == len(surface.vertices)


def test_a_crease_keeps_two_normals():
    owner = np.array([0, 0, 0])
    normals = np.array([[0, 0, 1.0], [0, 0.1, 1.0], [1.0, 0, 0]])
    shared = shading.share_normals(owner, normals, crease=0.5)
    np.testing.assert_allclose(shared[0], shared[1])
    np.testing.assert_allclose(shared[2], [1, 0, 0])


def test_simplify_keeps_shape_closure_and_borders(surface):
    cut = cutting.split(cutting.refine(surface, circle, ball, tolerance=0.004), circle)
    cut = cutting.retag(cut, circle(*cut.centroids.T) < 0, 1, (0,))
    less = simplify(cut, faces=len(cut.faces) // 3, largest=0.2)
    assert len(less.faces) <= len(cut.faces) // 3 + 2
    assert (edge_uses(less.faces) == 2).all()
    np.testing.assert_allclose(np.linalg.norm(less.vertices, axis=1), 1.0, atol=0.02)
    before, after = (areas(s)[s.tags == 1].sum() for s in (cut, less))
    assert after == pytest.approx(before, rel=0.08)
    assert (less.face_normals * less.centroids).sum(axis=1).min() > 0


def test_simplify_stops_at_its_largest_error(surface):
    assert len(simplify(surface, faces=4, largest=1e-4).faces) > len(surface.faces) // 2


def test_simplify_leaves_an_open_border_in_place():
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0), indexing="ij")
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    a = (np.arange(5)[:, None] * 6 + np.arange(5)).reshape(-1)
    faces = np.concatenate([np.stack([a, a + 6, a + 7], 1), np.stack([a, a + 7, a + 1], 1)])
    flat = simplify(Surface(vertices, faces, np.zeros(50, int)), faces=2)
    assert len(flat.faces) <= 8
    assert areas(flat).sum() == pytest.approx(25.0)
