"""Fields and dual contouring."""

from __future__ import annotations

import numpy as np
import pytest
from bakery.mesh import implicit

from sumo3dviz_pt.model.geometry import Mesh


def ball(x, y, z):
    return np.sqrt(x * x + y * y + z * z) - 1.0


def cube(x, y, z):
    return np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z)) - 0.71


def volume(vertices, faces) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def axes(step: float):
    fine = np.arange(-1.35, 1.36, step)
    return fine, fine[::2], fine


def test_ball_is_closed_round_and_outward():
    vertices, faces = implicit.dual_contour(ball, axes(0.1))
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0, atol=2e-3)
    assert volume(vertices, faces) == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()


def test_cube_keeps_its_corners():
    vertices, faces = implicit.dual_contour(cube, axes(0.2))
    assert volume(vertices, faces) == pytest.approx(1.42**3, rel=0.02)
    corner = np.array([0.71, 0.71, 0.71])
    assert np.linalg.norm(vertices - corner, axis=1).min() < 0.03


def test_rounded_intersection_and_union():
    a, b = np.array([-1.0, -0.05, 0.0, 0.3]), np.array([-2.0, -0.05, 0.0, 0.4])
    inner = implicit.intersect(a, b, 0.1)
    assert inner[0] == -1.0
    assert inner[2] == pytest.approx(0.1 * (np.sqrt(2) - 1))
    assert (inner >= np.maximum(a, b) - 1e-12).all()
    np.testing.assert_allclose(implicit.unite(a, b, 0.1), -implicit.intersect(-a, -b, 0.1))


def test_rounded_box_distance():
    x, y = np.array([0.0, 2.0, 1.0]), np.array([0.0, 0.0, 0.5])
    found = implicit.rounded_box(x, y, (1.0, 0.5), 0.2)
    np.testing.assert_allclose(found, [-0.5, 1.0, 0.2 * (np.sqrt(2) - 1)], atol=1e-12)


@pytest.mark.parametrize("sense", [1, -1])
def test_polygon_distance_in_either_sense(sense):
    square = np.array([[0, 0], [2, 0], [2, 2], [0, 2]], float)[::sense]
    u, v = np.array([1.0, 3.0, -1.0, 1.0]), np.array([1.0, 1.0, -1.0, 0.25])
    found = implicit.polygon(u, v, square)
    np.testing.assert_allclose(found, [-1.0, 1.0, np.sqrt(2), -0.25])
    rounded = implicit.polygon(np.array([0.0, 1.0]), np.array([0.0, 0.0]), square, radius=0.5)
    np.testing.assert_allclose(rounded, [0.5 * (np.sqrt(2) - 1), 0.0], atol=1e-12)


def test_curve_goes_through_its_points_and_ends_flat():
    curve = implicit.ProfileCurve.through([(0, 0), (1, 1), (2, 2), (3, 2)], smooth=0.02)
    assert float(curve(1.0)) == pytest.approx(1.0, abs=0.01)
    assert float(curve(9.0)) == pytest.approx(2.0, abs=1e-6)
    assert float(curve.slope(0.5)) == pytest.approx(1.0, abs=0.35)
    assert float(curve.slope(9.0)) == pytest.approx(0.0, abs=1e-6)


def test_projection_lands_on_the_surface():
    points = np.array([[0.9, 0.3, 0.0], [0.0, 0.0, 1.05]])
    found = implicit.project(ball, points, reach=0.2)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-4)


def test_mesh_of_vertices_is_valid():
    mesh = Mesh(*implicit.dual_contour(cube, axes(0.3)))
    assert len(mesh.faces) and np.isfinite(mesh.vertices).all()
