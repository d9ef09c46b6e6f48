"""Files of a small scene: what other readers find in them."""

import json
import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from builders import box
from hypothesis import given
from hypothesis import strategies as st
from needed import package

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.exports.gltf import gltf, quaternions
from sumo3dviz_pt.exports.looks import Geometry, Look, Piece
from sumo3dviz_pt.exports.order import ExportOrder
from sumo3dviz_pt.exports.page import is_page, three_js, write_page
from sumo3dviz_pt.exports.scene import Exported, ExportedCamera, ExportedScene, Track
from sumo3dviz_pt.model.geometry import Transform

TIMES = np.array([10.0, 10.5, 11.0])


def geometry(**more):
    mesh = box((-1, -1, 0), (1, 1, 2))
    return Geometry(mesh.vertices, mesh.faces, **more)


def scene():
    """A box that stands, one that drives and leaves, and one that takes a pose."""
    ways = [Transform.from_pose((x, 5.0, 0.5), yaw=3.1 + 0.1 * x).matrix for x in (0, 1, 2)]
    driven = Track(np.stack(ways), np.array([True, True, False]))
    moved = (np.tile([0.0, 0.0, 1.0], (8, 1)),)
    posed = Track(np.eye(4)[None], np.ones(1, bool), np.array([[0.0], [0.5], [1.0]]))
    lamp = Exported("brake", "lamps", (Piece(geometry(), Look(glow=(6.0, 0.0, 0.0))),))
    red = {"own": (0.6, 0.1, 0.1)}
    same = geometry()
    things = (
        Exported("roads", "roads", (Piece(geometry(), Look((0.2, 0.2, 0.2))),)),
        Exported(
            "vehicle:a", "vehicle", (Piece(same, Look(), "own"),), driven, red, (lamp,), "vehicle:a"
        ),
        Exported("vehicle:b", "vehicle", (Piece(same, Look(), "own"),), driven, red),
        Exported("person:c", "person", (Piece(geometry(moved=moved), Look()),), posed),
    )
    eye = Transform.from_pose((250.0, -10.0, 3.0), yaw=math.pi / 2).matrix
    camera = ExportedCamera("post", np.stack([eye] * 3), math.tan(math.radians(30.0)))
    sun = np.array([0.0, -0.6, 0.8])
    return ExportedScene(np.array([250.0, 0.0, 0.0]), TIMES, things, (camera,), sun, (64, 36))


def read(data):
    """The two chunks of a binary glTF file."""
    kind, version, length = struct.unpack_from("<4sII", data)
    assert (kind, version, length) == (b"glTF", 2, len(data))
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def values(said, block, number):
    """Numbers of an accessor of floats."""
    entry = said["accessors"][number]
    view = said["bufferViews"][entry["bufferView"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[entry["type"]]
    shape = (entry["count"], width)
    return np.frombuffer(block, "<f4", shape[0] * width, view["byteOffset"]).reshape(shape)


def test_a_gltf_file_is_the_same_scene_to_another_reader():
    import io

    # Older ones read another place of what moves.
    trimesh = pytest.importorskip("trimesh", minversion="5.0")
    loaded = trimesh.load_scene(io.BytesIO(gltf(scene())), file_type="glb")
    low, high = loaded.bounds
    # It is y up: north is -z.
    assert low[2] <= -6.0 and high[1] == pytest.approx(2.5, abs=0.6)
    assert sum(len(each.faces) for each in loaded.geometry.values()) >= 12


def test_motion_leaving_and_poses_are_in_the_file():
    said, block = read(gltf(scene()))
    nodes = {node["name"]: index for index, node in enumerate(said["nodes"])}
    (animation,) = said["animations"]
    found = {
        (channel["target"]["node"], channel["target"]["path"]): values(
            said, block, animation["samplers"][channel["sampler"]]["output"]
        )
        for channel in animation["channels"]
    }
    car, person = nodes["vehicle:a"], nodes["person:c"]
    assert np.allclose(found[car, "translation"][:, 0], [0.0, 1.0, 2.0])
    assert np.allclose(found[car, "scale"].max(axis=1), [1.0, 1.0, 0.0])
    assert np.allclose(found[person, "weights"].ravel(), [0.0, 0.5, 1.0])
    times = values(said, block, animation["samplers"][0]["input"])
    assert np.allclose(times.ravel(), TIMES - TIMES[0])


def test_equal_things_share_a_mesh_and_the_file_says_where_it_lies():
    said, _ = read(gltf(scene()))
    meshes = {node["name"]: node.get("mesh") for node in said["nodes"]}
    assert meshes["vehicle:a"] == meshes["vehicle:b"] != meshes["roads"]
    world = next(node for node in said["nodes"] if node["name"] == "world")
    assert world["extras"] == {"origin": [250.0, 0.0, 0.0], "sumo_time": 10.0}


def test_a_camera_sees_what_ours_sees():
    said, _ = read(gltf(scene()))
    node = next(node for node in said["nodes"] if node.get("extras", {}).get("camera") == "post")
    assert node["translation"] == pytest.approx([0.0, -10.0, 3.0])
    x, y, z, w = node["rotation"]
    ahead = -np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    assert ahead == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
    lens = said["cameras"][0]["perspective"]
    across = 2 * math.atan(math.tan(lens["yfov"] / 2) * lens["aspectRatio"])
    assert math.degrees(across) == pytest.approx(60.0)


@given(st.lists(st.floats(-400.0, 400.0), min_size=2, max_size=20))
def test_turns_take_the_short_way(yaws):
    matrices = np.stack([Transform.from_pose((0, 0, 0), yaw=yaw).matrix for yaw in yaws])
    _, turns, sizes = quaternions(matrices)
    assert np.allclose(sizes, 1.0)
    assert ((turns[1:] * turns[:-1]).sum(axis=1) >= -1e-9).all()


def test_usd_has_the_same_places_and_no_fault(tmp_path):
    package("pxr", "USD needs usd-core")
    from pxr import Gf, Usd, UsdGeom, UsdValidation

    from sumo3dviz_pt.exports.usd import write_usd

    write_usd(scene(), tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    faults = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [fault.GetMessage() for fault in faults] == []
    car = UsdGeom.Xformable(stage.GetPrimAtPath("/World/vehicle_a"))
    place = car.ComputeLocalToWorldTransform(1.0).ExtractTranslation()
    assert Gf.IsClose(place, Gf.Vec3d(1.0, 5.0, 0.5), 1e-6)
    shown = UsdGeom.Imageable(car)
    assert [shown.ComputeVisibility(t) for t in (1.0, 2.0)] == ["inherited", "invisible"]


def test_a_page_needs_nothing_from_elsewhere(tmp_path):
    write_page(scene(), tmp_path / "page", title="a <b>")
    assert is_page(tmp_path / "page")
    page = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    assert "a &lt;b&gt;" in page and "http" not in page
    assert "THREE.GLTFLoader=" in three_js()


def test_pictures_of_others_stay(tmp_path):
    """A folder beside a USD file is replaced only if nothing but our pictures lies there."""
    package("pxr", "USD needs usd-core")
    folder = tmp_path / "a_pictures"
    folder.mkdir()
    (folder / "asphalt_0.png").write_bytes(b"")
    order = ExportOrder(tmp_path / "a.usd", 10.0, 10.0, overwrite=True)
    order.check()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(ConfigError, match="no folder of pictures of ours"):
        order.check()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"path": "a.obj"}, "must end in .glb"),
        ({"end": 5.0}, "ends at 5 s, before 10 s"),
        ({"fps": 0.0}, "0.1 to 240"),
        ({"end": 1e6}, "more than 5,000"),
        ({"path": "nowhere/a.glb"}, "there is no folder"),
        ({"path": "old.glb"}, "exists already"),
        ({"path": "things"}, "no page of ours"),
    ],
)
def test_what_cannot_be_done_is_refused_before_any_work(tmp_path, change, said):
    (tmp_path / "old.glb").write_bytes(b"")
    (tmp_path / "things").mkdir()
    (tmp_path / "things" / "mine.txt").write_text("", encoding="utf-8")
    order = ExportOrder(tmp_path / change.pop("path", "new.glb"), 10.0, 20.0)
    with pytest.raises(ConfigError, match=said):
        replace(order, **change).check()
