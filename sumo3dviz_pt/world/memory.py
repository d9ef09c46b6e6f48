"""Keeps what was built of a world, so that nothing is built twice for its shots."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

MOST_BYTES = 600_000_000
"""What is kept, about; what was asked for longest ago goes first."""

_T = TypeVar("_T")


class Memory:
    """What was built of one world, by names.

    A name says all that a thing hangs on beside the world itself: a junction's number, a
    house's level of detail. So whoever asks first gets the same thing as whoever asks again.
    """

    def __init__(self, most: int = MOST_BYTES) -> None:
        self._most = most
        self._made: OrderedDict[tuple[Hashable, ...], tuple[Any, int]] = OrderedDict()
        self._bytes = 0
        self._lock = threading.Lock()

    def of(self, name: tuple[Hashable, ...], make: Callable[[], _T]) -> _T:
        """The thing of a name, made if it is not there.

        Args:
            name: Begins with what kind of thing it is.
            make: Makes it; nobody changes it afterwards.
        """
        with self._lock:
            if name in self._made:
                self._made.move_to_end(name)
                kept: _T = self._made[name][0]
                return kept
        # Not under the lock: what is made is often made of other things.
        made = make()
        self._keep(name, made)
        return made

    def _keep(self, name: tuple[Hashable, ...], made: Any) -> None:
        """Keep a thing, and as many others as there is room for."""
        size = _size_of(made)
        with self._lock:
            _, before = self._made.pop(name, (None, 0))
            self._made[name] = (made, size)
            self._bytes += size - before
            while self._bytes > self._most and len(self._made) > 1:
                self._bytes -= self._made.popitem(last=False)[1][1]


def _size_of(value: Any) -> int:
    """Bytes of a thing, about: those of its arrays, and a few for all else."""
    if isinstance(value, np.ndarray):
        return int(value.nbytes) * (20 if value.dtype.kind == "O" else 1)
    if isinstance(value, Mapping):
        return sum(map(_size_of, value.values()))
    if isinstance(value, list | tuple):
        return 50 + sum(map(_size_of, value))
    if is_dataclass(value):
        return sum(_size_of(getattr(value, field.name)) for field in fields(value))
    return 50
