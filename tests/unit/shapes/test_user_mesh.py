"""Users' own meshes."""

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.shapes.user_mesh import read_user_mesh

OBJ = "v 5 1 1\nv 3 2 1\nv 3 0 4\nf 1 2 3\n"


def write(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_mesh_is_moved_under_its_front(tmp_path):
    ((mesh, colour),) = read_user_mesh(write(tmp_path, "a.obj", OBJ))
    np.testing.assert_allclose(mesh.bounds, [[-2, -1, 0], [0, 1, 3]])
    assert colour is None


def test_yaml_turns_and_scales(tmp_path):
    write(tmp_path, "a.obj", OBJ)
    options = write(tmp_path, "a.yaml", "{mesh: a.obj, forward: -y, up: +x, scale: 2}")
    ((mesh, _),) = read_user_mesh(options)
    np.testing.assert_allclose(mesh.bounds, [[-4, -3, 0], [0, 3, 4]])
    # Forward -y and up +x leave +x cross -y = -z for the left: the tip at z = 4 is on the right.
    tip = mesh.vertices[np.argmin(mesh.vertices[:, 1])]
    np.testing.assert_allclose(tip, [0, -3, 0], atol=1e-12)


def test_gltf_stands_up(tmp_path):
    import trimesh

    path = tmp_path / "a.glb"
    trimesh.creation.box((2, 1, 4)).export(path)
    ((mesh, _),) = read_user_mesh(path)
    np.testing.assert_allclose(mesh.bounds, [[-4, -1, 0], [0, 1, 1]], atol=1e-6)


def test_colours_become_linear(tmp_path):
    import trimesh

    box = trimesh.creation.box((2, 1, 4))
    box.visual.face_colors = [128, 128, 128, 255]
    path = tmp_path / "a.ply"
    box.export(path)
    ((_, colour),) = read_user_mesh(path)
    np.testing.assert_allclose(colour, 0.2158605, rtol=1e-5)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.fbx", "", "none of"),
        ("b.obj", "", "holds no triangles|cannot be read"),
        ("c.ply", "nonsense", "cannot be read|no triangles"),
        ("d.yaml", "[", "cannot be read"),
        ("e.yaml", "{forward: +x}", "must hold mesh"),
        ("f.yaml", "{mesh: a.obj, colour: red}", "must hold mesh"),
        ("g.yaml", "{mesh: gone.obj}", "there is no file"),
        ("h.yaml", "{mesh: a.obj, forward: north}", "an axis is written"),
        ("i.yaml", "{mesh: a.obj, forward: +z}", "different axes"),
        ("j.yaml", "{mesh: a.obj, scale: 0}", "positive number"),
        ("k.yaml", "{mesh: a.obj, scale: big}", "positive number"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, name, text, message):
    write(tmp_path, "a.obj", OBJ)
    with pytest.raises(ConfigError, match=message):
        read_user_mesh(write(tmp_path, name, text))


def test_missing_files_are_said(tmp_path):
    for name in ("gone.obj", "gone.yaml"):
        with pytest.raises(ConfigError, match=r"vehicles\.user_models"):
            read_user_mesh(tmp_path / name)
