"""Small closed pieces."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.library.mesh import solids
from sumo3dviz_pt.model.geometry import Mesh, merge_meshes

CLOSED = {
    "lathe": solids.lathe([(0, -1), (1, -1), (1, 1), (0, 1)], segments=24),
    "box": solids.box((0, 0, 0), (1, 2, 3)),
    "prism": solids.prism([(0, 0), (1, 0), (1, 1), (0, 1)], half_width=0.5),
    "superellipsoid": solids.superellipsoid((1, 2, 3), squareness=2.0, segments=24, rings=16),
    "tube": solids.tube([(0, 0, 0), (1, 0, 0), (2, 0, 0)], radius=(0.1, 0.1, 0.1), sides=24),
    "upright tube": solids.tube([(0, 0, 0), (0, 1, 0)], radius=0.1, sides=24),
    "slab": solids.slab(
        np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float),
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float),
    ),
}
VOLUMES = {
    "lathe": 2 * np.pi,
    "box": 6,
    "prism": 1,
    "superellipsoid": 8 * np.pi,
    "tube": 0.02 * np.pi,
    "upright tube": 0.01 * np.pi,
    "slab": 1,
}


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def agreement(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(((np.cross(b - a, c - a)[:, None] * mesh.normals[mesh.faces]).sum(2) > 0).mean())


@pytest.mark.parametrize("name", CLOSED)
def test_pieces_are_outward_and_of_their_volume(name):
    assert volume(CLOSED[name]) == pytest.approx(VOLUMES[name], rel=0.04)
    assert agreement(CLOSED[name]) == 1.0
    np.testing.assert_allclose(np.linalg.norm(CLOSED[name].normals, axis=1), 1.0)


def test_mirror_and_move_keep_the_volume():
    box = CLOSED["box"]
    assert volume(solids.mirrored(box)) == pytest.approx(6.0)
    assert volume(solids.moved(box, 1.0, -2.0, 3.0)) == pytest.approx(6.0)
    flat = Mesh(box.vertices, box.faces)
    assert solids.mirrored(flat).normals is None


def test_fitted_pieces_fill_the_size_and_merge_by_material():
    pieces = [("b", solids.box((0, 0, 0), (1, 1, 1))), ("a", solids.box((3, 3, 3), (4, 4, 4)))]
    fitted = solids.fitted([*pieces, pieces[0]], length=5, width=2, height=1)
    merged = solids.by_material(fitted)
    assert list(merged) == ["a", "b"]
    bounds = merge_meshes(list(merged.values())).bounds
    np.testing.assert_allclose(bounds, [[-5, -1, 0], [0, 1, 1]], atol=1e-12)
