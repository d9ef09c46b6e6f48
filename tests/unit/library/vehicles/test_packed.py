"""Packed bodies: bit by bit what was packed, the same bytes each time, nothing of a bad file."""

import json
import lzma

import numpy as np
import pytest
from bakery.packing import packed, unpacked, write_levels
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.library.mesh.solids import box
from sumo3dviz_pt.library.vehicles import packed as reader
from sumo3dviz_pt.library.vehicles.packed import read_levels
from sumo3dviz_pt.model.geometry import Mesh

VALUES = st.floats(width=32, allow_nan=False)


@st.composite
def meshes(draw):
    """Any mesh whose values are those of float32."""
    n = draw(st.integers(1, 12))

    def table(width):
        return draw(arrays(np.float32, (n, width), elements=VALUES)).astype(float)

    faces = draw(arrays(np.int64, (draw(st.integers(0, 9)), 3), elements=st.integers(0, n - 1)))
    normals, uvs = draw(st.booleans()), draw(st.booleans())
    return Mesh(table(3), faces, table(3) if normals else None, table(2) if uvs else None)


def bits(mesh):
    values = (mesh.vertices, mesh.faces, mesh.normals, mesh.uvs)
    return [None if v is None else (v.dtype, v.shape, v.tobytes()) for v in values]


@settings(max_examples=60, deadline=None)
@given(
    levels=st.dictionaries(st.sampled_from("ab"), st.dictionaries(st.text(), meshes(), max_size=3))
)
def test_what_is_read_is_what_was_packed(levels, tmp_path_factory):
    path = tmp_path_factory.mktemp("packed") / "bodies.xz"
    write_levels(path, levels)
    back = read_levels(path)
    assert [(lv, [*some]) for lv, some in back.items()] == [(v, [*s]) for v, s in levels.items()]
    for level, some in levels.items():
        for material, mesh in some.items():
            assert bits(back[level][material]) == bits(mesh)
    assert packed(levels) == packed(levels) == path.read_bytes()


def content():
    return unpacked({"parts": {"paint": box((0, 0, 0), (1, 1, 1))}})


def headed(change):
    """The same file with another line of JSON."""
    line, _, rest = content().partition(b"\n")
    head = json.loads(line)
    change(head)
    return json.dumps(head).encode() + b"\n" + rest


def row(head):
    return head["levels"]["parts"][0]


def with_a_corner(value):
    data = bytearray(content())
    at = data.index(b"\n") + 1
    data[at : at + 4] = np.int32(value).tobytes()
    return bytes(data)


BAD = {
    "no xz": lambda: b"solid cube",
    "cut": lambda: lzma.compress(content())[:-20],
    "more behind": lambda: lzma.compress(content()) + b"more",
    "a bit": lambda: lzma.compress(content())[:60] + b"\xff" + lzma.compress(content())[61:],
    "too short": lambda: lzma.compress(content()[:-4]),
    "too long": lambda: lzma.compress(content() + bytes(4)),
    "no line": lambda: lzma.compress(content()[40:]),
    "another format": lambda: lzma.compress(headed(lambda h: h.update(format=2))),
    "no format": lambda: lzma.compress(b"[]\n"),
    "no levels": lambda: lzma.compress(headed(lambda h: h.pop("levels"))),
    "negative": lambda: lzma.compress(headed(lambda h: row(h).__setitem__(1, -8))),
    "a word": lambda: lzma.compress(headed(lambda h: row(h).__setitem__(1, "many"))),
    "too many": lambda: lzma.compress(headed(lambda h: row(h).__setitem__(1, 10**12))),
    "unknown kind": lambda: lzma.compress(headed(lambda h: row(h).__setitem__(3, 4))),
    "a corner too far": lambda: lzma.compress(with_a_corner(-400)),
    "a corner below": lambda: lzma.compress(with_a_corner(7)),
    "legacy": lambda: lzma.compress(content(), lzma.FORMAT_ALONE),
}


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_file_is_one_sentence(kind, tmp_path):
    path = tmp_path / "bodies.xz"
    path.write_bytes(BAD[kind]())
    with pytest.raises(InputError, match=r"bodies\.xz.*is damaged.*install the package again"):
        read_levels(path)


def test_a_missing_file_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_levels(tmp_path / "bodies.xz")


def test_a_bomb_stops_at_the_bound(tmp_path, monkeypatch):
    """A kilobyte can ask for gigabytes."""
    monkeypatch.setattr(reader, "_MOST", 1_000_000)
    path = tmp_path / "bodies.xz"
    path.write_bytes(lzma.compress(bytes(20_000_000)))
    assert path.stat().st_size < 5000
    with pytest.raises(InputError, match="is damaged"):
        read_levels(path)


def test_a_dictionary_that_takes_too_much_memory_is_refused(tmp_path):
    path = tmp_path / "bodies.xz"
    wide = [{"id": lzma.FILTER_LZMA2, "preset": 1, "dict_size": 1 << 28}]
    path.write_bytes(lzma.compress(content(), filters=wide))
    with pytest.raises(InputError, match=r"is damaged.*[Mm]emory"):
        read_levels(path)
