"""Computes digests of what was built: the world, and a shot's plan of it.

They tell whether two pictures show the same things, whatever made them. Lengths count to a
tenth of a millimetre, other numbers to six digits: processors differ in the last bits.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.model.scene import SceneData, Sky

_GRID = 1.0e4
"""Steps of stored numbers in a unit, such as a metre."""

_OFF = 0.381966
"""Offset from the grid, in steps: round numbers lie inside a step, where last bits do nothing."""

_Feed = Callable[[bytes | memoryview], None]


def world_digest(data: SceneData) -> str:
    """Return a digest of what stands: ground, roads, houses, plants, lamps, and their materials.

    How plants move counts where any do.
    """
    swaying = (data.swaying,) if data.swaying else ()
    return _digest(data.static, data.materials, data.lamps, *swaying)


def light_digest(data: SceneData) -> str:
    """Return a digest of what lights it and of the air: sun or moon, sky, haze, weather."""
    return _digest(data.sky, data.haze, *(() if data.weather is None else (data.weather,)))


def plan_digest(data: SceneData, full_models: frozenset[str]) -> str:
    """Return a digest of the road users that can be shown: bodies, levels of detail, room.

    Args:
        data: Of a shot.
        full_models: Models that it draws in full detail.
    """
    return _digest(data.prototypes, data.slots, data.running, sorted(full_models))


def _digest(*values: Any) -> str:
    """Return one digest of many values."""
    whole = hashlib.blake2b(digest_size=16)
    for value in values:
        _take(value, whole.update)
    return whole.hexdigest()


def _take(value: Any, feed: _Feed) -> None:
    """Feed a value, whatever is in it."""
    if isinstance(value, np.ndarray):
        _take_array(value, feed)
    elif isinstance(value, Mapping):
        for key in sorted(value):
            feed(f"{key}:".encode())
            _take(value[key], feed)
    elif isinstance(value, list | tuple | frozenset):
        feed(f"[{len(value)}".encode())
        for item in sorted(value) if isinstance(value, frozenset) else value:
            _take(item, feed)
    elif is_dataclass(value):
        for name, item in _attributes(value):
            feed(f"{name}=".encode())
            _take(item, feed)
    else:
        feed(_word(value).encode())


def _attributes(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield a value's attributes; of a sky's pictures, hashed as files, whether they exist."""
    for attribute in fields(value):
        item = getattr(value, attribute.name)
        is_picture = isinstance(value, Sky) and attribute.name in ("image", "clouds", "overcast")
        yield attribute.name, (item is not None) if is_picture else item


def _take_array(array: np.ndarray[Any, Any], feed: _Feed) -> None:
    """Feed an array: whole numbers as they are, others as steps of a grid."""
    feed(f"{array.shape}".encode())
    if array.dtype.kind != "f":
        feed(np.ascontiguousarray(array, dtype=np.int64).data)
        return
    steps = array * np.float64(_GRID)
    steps += _OFF
    feed(np.ascontiguousarray(np.floor(steps, out=steps)).data)


def _word(value: Any) -> str:
    """Return a number, a name or nothing, as text; of a file, only what it is called."""
    if isinstance(value, float):
        return f"{value:.6g};"
    text = str(value)
    return f"{Path(text).name if '/' in text or chr(92) in text else text};"
