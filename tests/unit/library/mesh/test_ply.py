"""PLY files of our own."""

from __future__ import annotations

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.library.mesh.ply import read_ply, write_ply
from sumo3dviz_pt.model.geometry import Mesh


def triangle(*, normals: bool, uvs: bool) -> Mesh:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0.5]], dtype=float)
    return Mesh(
        vertices,
        np.array([[0, 1, 2]]),
        np.tile([0.0, 0.0, 1.0], (3, 1)) if normals else None,
        vertices[:, :2] / 4 if uvs else None,
    )


@pytest.mark.parametrize("normals", [True, False])
@pytest.mark.parametrize("uvs", [True, False])
def test_reads_what_was_written(tmp_path, normals, uvs):
    mesh = triangle(normals=normals, uvs=uvs)
    write_ply(tmp_path / "a.ply", mesh)
    back = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    np.testing.assert_array_equal(back.faces, mesh.faces)
    for name in ("normals", "uvs"):
        wanted, found = getattr(mesh, name), getattr(back, name)
        assert (wanted is None) == (found is None)
        if wanted is not None:
            np.testing.assert_array_equal(found, wanted)


def test_same_mesh_gives_same_bytes_and_leaves_no_part(tmp_path):
    for name in ("a.ply", "b.ply"):
        write_ply(tmp_path / name, triangle(normals=True, uvs=False))
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.ply", "b.ply"]


def test_empty_mesh(tmp_path):
    write_ply(tmp_path / "a.ply", Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)))
    assert len(read_ply(tmp_path / "a.ply").faces) == 0


def test_trimesh_agrees(tmp_path):
    trimesh = package("trimesh")
    mesh = triangle(normals=True, uvs=True)
    write_ply(tmp_path / "a.ply", mesh)
    other = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_allclose(other.vertices, mesh.vertices)
    np.testing.assert_array_equal(other.faces, mesh.faces)


@pytest.mark.parametrize("keep", [0, 20, 150, -1])
def test_cut_files_are_refused(tmp_path, keep):
    path = tmp_path / "a.ply"
    write_ply(path, triangle(normals=True, uvs=False))
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError, match=r"a\.ply"):
        read_ply(path)


def test_foreign_and_missing_files_are_refused(tmp_path):
    path = tmp_path / "a.ply"
    path.write_text("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", encoding="ascii")
    with pytest.raises(InputError, match="binary PLY"):
        read_ply(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_ply(tmp_path / "none.ply")
