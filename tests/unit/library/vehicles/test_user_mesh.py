"""Users' own meshes."""

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.vehicles.user_mesh import UserFinish, read_user_vehicle

OBJ = "v 5 1 1\nv 3 2 1\nv 3 0 4\nf 1 2 3\n"


OURS = ("paint", "glass")


def read(path):
    return read_user_vehicle(path, materials=OURS)


def write(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_mesh_is_moved_under_its_front(tmp_path):
    ((mesh, finish),) = read(write(tmp_path, "a.obj", OBJ)).pieces
    np.testing.assert_allclose(mesh.bounds, [[-2, -1, 0], [0, 1, 3]])
    assert finish == UserFinish(named="paint")


def test_yaml_turns_and_scales(tmp_path):
    write(tmp_path, "a.obj", OBJ)
    options = write(tmp_path, "a.yaml", "{mesh: a.obj, forward: -y, up: +x, scale: 2}")
    ((mesh, _),) = read(options).pieces
    np.testing.assert_allclose(mesh.bounds, [[-4, -3, 0], [0, 3, 4]])
    # Forward -y and up +x leave +x cross -y = -z for the left: the tip at z = 4 is on the right.
    tip = mesh.vertices[np.argmin(mesh.vertices[:, 1])]
    np.testing.assert_allclose(tip, [0, -3, 0], atol=1e-12)


def test_gltf_stands_up(tmp_path):
    import trimesh

    path = tmp_path / "a.glb"
    trimesh.creation.box((2, 1, 4)).export(path)
    ((mesh, _),) = read(path).pieces
    np.testing.assert_allclose(mesh.bounds, [[-4, -1, 0], [0, 1, 1]], atol=1e-6)


def test_colours_become_linear(tmp_path):
    import trimesh

    box = trimesh.creation.box((2, 1, 4))
    box.visual.face_colors = [128, 128, 128, 255]
    path = tmp_path / "a.ply"
    box.export(path)
    ((_, finish),) = read(path).pieces
    np.testing.assert_allclose(finish.colour, 0.2158605, rtol=1e-5)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.fbx", "", "none of"),
        ("b.obj", "", "holds no triangles|cannot be read"),
        ("c.ply", "nonsense", "cannot be read|no triangles"),
        ("d.yaml", "[", "not valid YAML"),
        ("e.yaml", "{forward: +x}", "must hold mesh"),
        ("f.yaml", "{mesh: a.obj, colour: red}", "must hold mesh"),
        ("g.yaml", "{mesh: gone.obj}", "there is no file"),
        ("h.yaml", "{mesh: a.obj, forward: north}", "an axis is written"),
        ("i.yaml", "{mesh: a.obj, forward: +z}", "different axes"),
        ("j.yaml", "{mesh: a.obj, scale: 0}", "positive number"),
        ("k.yaml", "{mesh: a.obj, scale: big}", "positive number"),
        ("l.yaml", "{mesh: a.obj, materials: {a: velvet}}", "no material is called 'velvet'"),
        ("m.yaml", "{mesh: a.obj, materials: {a: {colour: red}}}", "#rrggbb"),
        ("n.yaml", "{mesh: a.obj, materials: {a: {metallic: 1}}}", "a material has"),
        ("o.yaml", "{mesh: a.obj, materials: [paint]}", "must map"),
        ("p.yaml", "{mesh: a.obj, lamps: [{role: head}]}", "a lamp has"),
        (
            "q.yaml",
            "{mesh: a.obj, lamps: [{role: disco, at: [0, 0, 1], size: [1, 1]}]}",
            "roles are",
        ),
    ],
)
def test_what_is_wrong_is_said(tmp_path, name, text, message):
    write(tmp_path, "a.obj", OBJ)
    with pytest.raises(ConfigError, match=message):
        read(write(tmp_path, name, text))


def test_missing_files_are_said(tmp_path):
    for name in ("gone.obj", "gone.yaml"):
        with pytest.raises(ConfigError, match=r"vehicles\.user_models"):
            read(tmp_path / name)


def two_boxes(path):
    """A GLB with a body, a pane that one can look through, and a shining rim."""
    import trimesh
    from trimesh.visual.material import PBRMaterial

    scene = trimesh.Scene()
    for name, colour, metal, mode in (
        ("body", [200, 10, 10, 255], 0.0, "OPAQUE"),
        ("pane", [20, 20, 20, 90], 0.0, "BLEND"),
        ("rim", [180, 180, 180, 255], 1.0, "OPAQUE"),
    ):
        box = trimesh.creation.box((2.0, 1.5, 4.0))
        box.visual = trimesh.visual.TextureVisuals(
            material=PBRMaterial(
                name=f"{name} look",
                baseColorFactor=colour,
                metallicFactor=metal,
                roughnessFactor=0.2,
                alphaMode=mode,
            )
        )
        scene.add_geometry(box, node_name=name, geom_name=name)
    scene.export(path)


def test_a_glb_keeps_its_looks(tmp_path):
    two_boxes(tmp_path / "a.glb")
    made = read(tmp_path / "a.glb")
    glass, body, rim = sorted((f for _, f in made.pieces), key=lambda f: (not f.named, f.metallic))
    assert glass == UserFinish(named="glass")
    assert body.colour[0] > 10 * body.colour[1]
    assert body.roughness == pytest.approx(0.2)
    assert rim.metallic == 1.0
    for mesh, _ in made.pieces:
        np.testing.assert_allclose(mesh.bounds, [[-4, -1, 0], [0, 1, 1.5]], atol=1e-6)
        # A box keeps its edges: every normal points along an axis.
        assert np.sort(np.abs(mesh.normals), axis=1)[:, 2] == pytest.approx(1.0)


def test_yaml_maps_materials_and_lamps(tmp_path):
    two_boxes(tmp_path / "a.glb")
    text = """
    mesh: a.glb
    scale: fit
    materials: {"body*": paint, rim look: {colour: "#808080", roughness: 0.0}}
    lamps: [{role: tail, at: [-4, 0.5, 0.8], size: [0.2, 0.1], yaw: 180}]
    """
    made = read(write(tmp_path, "a.yaml", text))
    rim, glass, paint = sorted((finish for _, finish in made.pieces), key=lambda f: f.named)
    assert (glass.named, paint.named, rim.named) == ("glass", "paint", "")
    assert rim.roughness == 0.05
    (lamp,) = made.lamps
    assert (lamp.role, lamp.at, lamp.size) == ("tail", (-4.0, 0.5, 0.8), (0.2, 0.1))
    assert lamp.yaw == pytest.approx(np.pi)
    assert made.fitted
