"""Writes values as numbers and words, and reads them back: no code comes out of what was written.

What is read can only be numbers, text, arrays, shapes of shapely, collections of these, and data
classes of a closed list that the reader gives. Their constructors check them, as always.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from types import MappingProxyType
from typing import Any, TypeAlias, get_args, get_type_hints

import numpy as np
import shapely

from sumo3dviz_pt.files.atomic import Files

Kinds: TypeAlias = Mapping[str, type]
"""Data classes by name."""

_TREE, _BYTES = "tree.json", "arrays.bin"
_PLAIN = (type(None), bool, int, float, str)
_COLLECTIONS: Mapping[str, type] = {
    kind.__name__: kind for kind in (tuple, list, set, frozenset, dict, MappingProxyType)
}
_NUMBERS = "biufU"
"""Kinds of NumPy's numbers and words that arrays may hold; others are read one by one."""

_WORD = 8
"""Arrays begin at multiples of the widest number's size [bytes]."""


def kinds_in(*roots: Any) -> Kinds:
    """Return all data classes that values of some types hold, as their annotations say."""
    kinds: dict[str, type] = {}
    waiting = list(roots)
    while waiting:
        kind = waiting.pop()
        waiting += get_args(kind)
        if isinstance(kind, type) and is_dataclass(kind) and _name(kind) not in kinds:
            kinds[_name(kind)] = kind
            waiting += get_type_hints(kind).values()
    return kinds


def packed(value: Any, kinds: Kinds) -> Files:
    """Return a value as two files.

    Raises:
        TypeError: If it holds something of no known kind.
    """
    packer = _Packer(kinds)
    tree = json.dumps(packer.node(value), separators=(",", ":"))
    return {_TREE: tree.encode(), _BYTES: b"".join(packer.chunks)}


def unpacked(files: Files, kinds: Kinds) -> Any:
    """Return a value that was written by `packed`.

    Raises:
        ValueError: If the files hold something else.
    """
    try:
        return _Reader(files[_BYTES], kinds).value(json.loads(files[_TREE]))
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError) as error:
        raise ValueError(f"it is damaged: {type(error).__name__}: {error}") from error


def _name(kind: type) -> str:
    """Return what a data class is called in files."""
    return f"{kind.__module__}.{kind.__qualname__}"


def _in_order(collection: Any) -> list[Any]:
    """Return what a collection holds in the same order every time; sets have none of their own."""
    if isinstance(collection, set | frozenset):
        return sorted(collection)
    return list(collection.items() if isinstance(collection, Mapping) else collection)


class _Packer:
    """Makes nodes of JSON of values, and collects the bytes of arrays and shapes."""

    def __init__(self, kinds: Kinds) -> None:
        self.chunks: list[bytes] = []
        self._kinds, self._size = kinds, 0
        self._seen: dict[int, tuple[int, Any]] = {}  # with the value, so that its id stays its own

    def node(self, value: Any) -> Any:
        """Return a value's node; what was there before is only named again."""
        if type(value) in _PLAIN:
            return value
        known = self._seen.get(id(value))
        if known is not None:
            return ["same", known[0]]
        node = self._node(value)
        self._seen[id(value)] = (len(self._seen), value)
        return node

    def _node(self, value: Any) -> list[Any]:
        """Return the node of a value that is not plain."""
        name = type(value).__name__
        if name in _COLLECTIONS and type(value) is _COLLECTIONS[name]:
            return [name, [self.node(item) for item in _in_order(value)]]
        if isinstance(value, np.ndarray):
            return self._array(value)
        if isinstance(value, np.generic) and value.dtype.kind in _NUMBERS:
            return ["number", value.dtype.str, value.item()]
        if isinstance(value, shapely.Geometry):
            return ["shape", *self._bytes(shapely.to_wkb(value))]
        if isinstance(value, shapely.STRtree):
            return ["shapes", self.node(value.geometries)]
        if self._kinds.get(_name(type(value))) is type(value):
            known: Any = value
            names = [field.name for field in fields(known) if field.init]
            return ["kind", _name(type(value)), {k: self.node(getattr(value, k)) for k in names}]
        raise TypeError(f"{type(value).__module__}.{name} is no known kind")

    def _array(self, value: Any) -> list[Any]:
        """Return an array's node."""
        shape = list(value.shape)
        if value.dtype.kind not in _NUMBERS:
            return ["items", shape, [self.node(item) for item in value.ravel()]]
        order = "F" if value.flags.f_contiguous and not value.flags.c_contiguous else "C"
        place = self._bytes(value.tobytes(order))
        return ["array", value.dtype.str, shape, order, bool(value.flags.writeable), *place]

    def _bytes(self, content: bytes) -> tuple[int, int]:
        """Collect bytes; return where they begin, and how many they are."""
        # Numbers that lie where a processor reads them at once need no copy later.
        spare = -self._size % _WORD
        begin = self._size + spare
        self.chunks += [bytes(spare), content]
        self._size = begin + len(content)
        return begin, len(content)


class _Reader:
    """Makes values of nodes."""

    def __init__(self, content: bytes, kinds: Kinds) -> None:
        self._content, self._kinds = memoryview(content), kinds
        self._seen: list[Any] = []

    def value(self, node: Any) -> Any:
        """Return a node's value.

        Raises:
            ValueError: If it is of no known kind; other errors if it is damaged.
        """
        if type(node) in _PLAIN:
            return node
        tag, *rest = node
        if tag == "same":
            return self._seen[rest[0]]
        made = self._made(tag, *rest)
        self._seen.append(made)
        return made

    def _made(self, tag: str, *rest: Any) -> Any:
        """Return the value of a node that is not plain."""
        if tag in _COLLECTIONS:
            items = [self.value(node) for node in rest[0]]
            kind: Any = _COLLECTIONS[tag]
            return kind(dict(items)) if issubclass(kind, dict | MappingProxyType) else kind(items)
        if tag == "kind":
            name, fields_of = rest
            return self._kinds[name](**{key: self.value(node) for key, node in fields_of.items()})
        makers: Mapping[str, Callable[..., Any]] = {
            "array": self._array,
            "items": self._items,
            "number": lambda dtype, item: _dtype(dtype).type(item),
            "shape": lambda begin, size: _shape(self._content[begin : begin + size].tobytes()),
            "shapes": lambda tree: shapely.STRtree(self.value(tree)),
        }
        return makers[tag](*rest)

    def _array(
        self, dtype: str, shape: list[int], order: Any, writeable: bool, begin: int, size: int
    ) -> Any:
        """Return an array of numbers or words; it lies in the file's bytes if it is read-only."""
        flat = np.frombuffer(self._content[begin : begin + size], _dtype(dtype))
        array = flat.reshape(shape, order=order)
        return array.copy(order=order) if writeable else array

    def _items(self, shape: list[int], nodes: list[Any]) -> Any:
        """Return an array of shapes."""
        array = np.empty(len(nodes), dtype=object)
        array[:] = [self.value(node) for node in nodes]
        return array.reshape(shape)


def _dtype(text: str) -> np.dtype[Any]:
    """Return a type of numbers or words."""
    dtype = np.dtype(text)
    if dtype.kind not in _NUMBERS:
        raise ValueError(f"{text!r} is no type of numbers")
    return dtype


def _shape(content: bytes) -> Any:
    """Return a shape of shapely."""
    try:
        return shapely.from_wkb(content)
    except shapely.errors.ShapelyError as error:
        raise ValueError(f"it holds a damaged shape: {error}") from error
