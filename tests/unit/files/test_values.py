"""Values that are written as numbers and words."""

import json
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.files.values import kinds_in, packed, unpacked
from sumo3dviz_pt.model.geometry import frozen


@dataclass(frozen=True, slots=True, eq=False)
class Inner:
    values: np.ndarray
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outer:
    inner: tuple[Inner, ...]
    other: Inner | None


KINDS = kinds_in(Outer)


def back(value):
    return unpacked(packed(value, KINDS), KINDS)


def test_kinds_are_all_that_annotations_name():
    assert set(KINDS.values()) == {Inner, Outer}


leaves = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
nested = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner)
        | st.lists(inner).map(tuple)
        | st.dictionaries(st.text(), inner)
        | st.dictionaries(st.text(), inner).map(MappingProxyType)
        | st.frozensets(st.text())
    ),
)


def test_arrays_lie_where_they_need_no_copy():
    inner = Inner(frozen([True, False, True], np.bool_)), Inner(frozen([1.5]))
    values = back(Outer(inner, None)).inner[1].values
    assert values.flags.aligned and frozen(values) is values


@given(nested)
def test_collections_come_back(value):
    found = back(value)
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize("dtype", ["<f4", "<f8", "<i8", "<u4", "|b1", "<U5"])
@pytest.mark.parametrize("shape", [(0,), (), (4, 3), (2, 3, 2)])
def test_arrays_come_back_bit_by_bit(dtype, shape):
    value = np.arange(np.prod(shape, dtype=int)).reshape(shape).astype(dtype)
    for array in (value, value.T, np.asfortranarray(value), value[..., ::2] if shape else value):
        array.setflags(write=array is value)
        found = back(array)
        assert found.tobytes() == array.tobytes() and found.shape == array.shape
        assert found.dtype == array.dtype and found.flags.writeable == array.flags.writeable


def test_what_two_share_is_one_again():
    inner = Inner(np.arange(3.0), ("a",))
    found = back(Outer((inner, inner), inner))
    assert found.inner[0] is found.inner[1] is found.other
    assert found.other.words == ("a",) and found.other.values.tolist() == [0.0, 1.0, 2.0]


def test_shapes_and_numbers_come_back():
    square = shapely.box(0, 0, 1, 2)
    tree = back(shapely.STRtree([square, shapely.Point(4, 5)]))
    assert tree.query(shapely.Point(4, 5)).tolist() == [1]
    assert back(np.array([square, None], dtype=object)).tolist() == [square, None]
    assert back(np.float32(0.1)) == np.float32(0.1) and type(back(np.bool_(True))) is np.bool_


def test_other_things_are_not_written():
    for value in (print, object(), np, Outer, len):
        with pytest.raises(TypeError, match="no known kind"):
            packed(value, {})
    with pytest.raises(TypeError, match="Inner is no known kind"):
        packed(Inner(np.zeros(1)), {})


@pytest.mark.parametrize(
    "tree",
    [
        ["kind", "os.system", {"command": "true"}],
        ["kind", "builtins.exec", {}],
        ["array", "|O", [1], "C", False, 0, 8],
        ["array", "<f8", [10**12], "C", False, 0, 8],
        ["array", "<f8", [2], "C", False, 0, 8],
        ["same", 7],
        ["shape", 0, 8],
        ["number", "object", 1],
        ["reduce", []],
        [],
        {"a": 1},
        ["tuple"],
    ],
)
def test_damage_and_strangers_are_refused(tree):
    with pytest.raises(ValueError, match=r"."):
        unpacked({"tree.json": json.dumps(tree).encode(), "arrays.bin": bytes(8)}, KINDS)


def test_deep_nesting_and_missing_files_are_refused():
    deep = b"[" * 200_000
    for files in ({"tree.json": deep, "arrays.bin": b""}, {"arrays.bin": b""}, {}):
        with pytest.raises(ValueError, match=r"."):
            unpacked(files, KINDS)
