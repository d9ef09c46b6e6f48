"""Mesh files that ask for too much: refused in one sentence, within a second."""

import json
import struct
import time

import pytest

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.library.mesh.mesh_files import read_solids

BOX = "v 0 0 0\nv 4 0 0\nv 4 2 0\nv 0 2 1\n"


def glb(path, count, **more):
    """A triangle, used by so many nodes."""
    data = struct.pack("<9f", *(0, 0, 0, 4, 0, 0, 4, 1, 2))
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(count))}],
        "nodes": [{"mesh": 0, "translation": [0, number, 0]} for number in range(count)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data)}],
        **more,
    }
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    path.write_bytes(head + chunks + struct.pack("<I4s", len(data), b"BIN\0") + data)
    return path


def refused(path, *words):
    began = time.process_time()
    with pytest.raises((ConfigError, InputError)) as caught:
        read_solids(path, key="own")
    assert time.process_time() - began < 10
    assert "\n" not in str(caught.value) and all(word in str(caught.value) for word in words)


def test_one_face_many_times_is_one_face(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(BOX + "f 1 2 3\n" * 30_000)
    ((solid),) = read_solids(path, key="own")
    assert len(solid.mesh.faces) == 1


def test_a_fan_of_too_many_faces_is_refused(tmp_path):
    path = tmp_path / "a.obj"
    rim = "".join(f"v {number} 1 {number % 7}\n" for number in range(20_000))
    fan = "".join(f"f 1 {number} {number + 1}\n" for number in range(2, 20_000))
    path.write_text("v 0 0 0\n" + rim + fan)
    refused(path, "meet at one vertex", "simpler")


def test_every_node_has_its_place(tmp_path):
    found = read_solids(glb(tmp_path / "a.glb", 3), key="own")
    assert sorted(solid.mesh.vertices[:, 1].min() for solid in found) == [0, 1, 2]


@pytest.mark.slow
@pytest.mark.parametrize("count", [6000, 100_000])
def test_too_many_nodes_are_refused(tmp_path, count):
    refused(glb(tmp_path / "a.glb", count), f"{count:,} parts")


def test_nodes_below_each_other_take_no_longer(tmp_path):
    nodes = [{"mesh": 0, "children": [number + 1]} for number in range(3000)]
    path = glb(tmp_path / "a.glb", 1, nodes=[*nodes, {"mesh": 0}])
    began = time.process_time()
    assert len(read_solids(path, key="own")) == 3001
    assert time.process_time() - began < 20


def test_too_many_materials_are_refused(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(BOX + "".join(f"usemtl m{number}\nf 1 2 3\n" for number in range(30_000)))
    refused(path, "30,000 parts")


@pytest.mark.parametrize("line", ["mtllib /dev/zero", "mtllib ../../../../../dev/zero"])
def test_devices_are_not_read_for_materials(tmp_path, line):
    path = tmp_path / "a.obj"
    path.write_text(f"{line}\n{BOX}f 1 2 3\n")
    assert len(read_solids(path, key="own")) == 1
