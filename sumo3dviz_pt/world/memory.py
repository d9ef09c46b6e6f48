"""Keeps what was built of a world, so that nothing is built twice for its shots."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from copy import copy
from dataclasses import dataclass, fields, is_dataclass
from hashlib import blake2b
from itertools import islice
from typing import Any, TypeVar

import numpy as np
import shapely

MOST_BYTES = 600_000_000
"""What is kept, about; what was used longest ago goes first."""

_SAMPLE = 40
"""Items by which the size of a collection is estimated."""

_T = TypeVar("_T")


Name = tuple[Hashable, ...]
"""What a kept thing is called."""


class Memory:
    """What was built of one world, by names.

    A name holds everything that a thing depends on beside the world itself: a junction's
    number, a house's level of detail. So the first and every later request for a name get the
    same thing.
    """

    def __init__(self, most: int = MOST_BYTES) -> None:
        """Begin empty.

        Args:
            most: Bytes that are kept, about.
        """
        self._store = _Store(most)
        self._prefix: Name = ()

    def within(self, *prefix: Hashable) -> Memory:
        """Return a view of this memory that puts a prefix before all names.

        The view shares this memory's room: what is kept through it counts here.
        """
        view = copy(self)
        view._prefix = (*self._prefix, *prefix)
        return view

    @property
    def by_content(self) -> Memory:
        """A view of this memory without any prefix, for names that hold a thing's whole content.

        What shots that differ in their choice of roads have in common is found here.
        """
        view = copy(self)
        view._prefix = ("by content",)
        return view

    def of(self, name: Name, make: Callable[[], _T]) -> _T:
        """Return the thing of a name; make it if it is not there.

        Args:
            name: Begins with what kind of thing it is.
            make: Makes the thing, which must not be changed afterwards.
        """
        name = (*self._prefix, *name)
        entry = self._store.find(name)
        if entry is not None:
            thing: _T = entry.thing
            return thing
        # Not under the store's lock: what is made is often made of other things.
        made = make()
        self._store.keep(name, _Sized(made, _size_of(made)))
        return made


def digest_of(*values: Any) -> bytes:
    """Return a digest of geometries, arrays of numbers, words and numbers, in their order."""
    digest = blake2b(digest_size=16)
    for value in values:
        if isinstance(value, shapely.Geometry):
            content = shapely.to_wkb(value)
        elif isinstance(value, np.ndarray):
            digest.update(repr((value.shape, value.dtype.str)).encode())
            content = np.ascontiguousarray(value).tobytes()
        else:
            content = repr(value).encode()
        # With its length, so that the end of one value is not taken for the next one's beginning.
        digest.update(len(content).to_bytes(8, "little"))
        digest.update(content)
    return digest.digest()


@dataclass(frozen=True, slots=True, eq=False)
class _Sized:
    """A thing and its size in bytes, about."""

    thing: Any
    size: int


class _Store:
    """Things by name, up to a number of bytes; several threads may use it at once."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._entries: OrderedDict[Name, _Sized] = OrderedDict()
        self._bytes = 0
        self._lock = threading.Lock()

    def find(self, name: Name) -> _Sized | None:
        """Return what is kept under a name, now the one used last; None if nothing is."""
        with self._lock:
            if name in self._entries:
                self._entries.move_to_end(name)
            return self._entries.get(name)

    def keep(self, name: Name, new: _Sized) -> None:
        """Keep a thing, and of the others those used last, as many as there is room for."""
        with self._lock:
            before = self._entries.pop(name, None)
            self._entries[name] = new
            self._bytes += new.size - (0 if before is None else before.size)
            while self._bytes > self._most and len(self._entries) > 1:
                self._bytes -= self._entries.popitem(last=False)[1].size


def _size_of(value: Any) -> int:
    """Bytes of a thing, about: those of its arrays, and a few for all else.

    Long collections count by their first items, which take less time than all.
    """
    if isinstance(value, np.ndarray):
        return int(value.nbytes) * (20 if value.dtype.kind == "O" else 1)
    if isinstance(value, Mapping | list | tuple):
        items = value.values() if isinstance(value, Mapping) else value
        some = [_size_of(item) for item in islice(items, _SAMPLE)]
        return 50 + sum(some) * len(items) // max(len(some), 1)
    if is_dataclass(value):
        return sum(_size_of(getattr(value, field.name)) for field in fields(value))
    return 50
