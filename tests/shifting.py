"""Moves a simulation and its scene file as text, without rounding anything, and compares both."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

_SHAPE = re.compile(r'(?<=[ "])(shape|outlineShape|customShape)="([^"]*)"')
_AXIS = re.compile(r' (x|y)="([^"]*)"')
_PAIRS = re.compile(r'(netOffset|convBoundary)="([^"]*)"')
_PLACE = re.compile(r"(position|look_at): \[([^,\]]+),([^,\]]+),")
_GEO = re.compile(r'<poly [^>]*geo="(true|1)"[^>]*>')

_OWN = frozenset({"source", "origin"})
"""Attributes in which a simulation and its shift may differ."""

Shift = tuple[int, int]


def _moved(text: str, by: int) -> str:
    """Return a number as text, plus metres."""
    return f"{Decimal(text.strip()) + by:f}"


def _points(text: str, by: Shift) -> str:
    """Return points of a shape, moved."""
    found = []
    for point in text.split():
        x, y, *z = point.split(",")
        found.append(",".join([_moved(x, by[0]), _moved(y, by[1]), *z]))
    return " ".join(found)


def _pairs(text: str, by: Shift) -> str:
    """Return numbers that are x and y in turn, moved."""
    return ",".join(_moved(word, by[k % 2]) for k, word in enumerate(text.split(",")))


def _xml(text: str, by: Shift) -> str:
    """Return a file of SUMO with everything in net coordinates moved."""
    kept: list[str] = []

    def set_aside(match: re.Match[str]) -> str:
        kept.append(match[0])
        return f"\0{len(kept) - 1}\0"

    text = _GEO.sub(set_aside, text)
    text = _SHAPE.sub(lambda m: f'{m[1]}="{_points(m[2], by)}"', text)
    text = _AXIS.sub(lambda m: f' {m[1]}="{_moved(m[2], by[m[1] == "y"])}"', text)
    text = _PAIRS.sub(lambda m: f'{m[1]}="{_pairs(m[2], by)}"', text)
    return re.sub("\0([0-9]+)\0", lambda m: kept[int(m[1])], text)


def _scene(text: str, by: Shift) -> str:
    """Return a scene file with its cameras moved."""
    return _PLACE.sub(lambda m: f"{m[1]}: [{_moved(m[2], by[0])}, {_moved(m[3], by[1])},", text)


def _table(text: str, by: Shift) -> str:
    """Return a log as a table with its columns x and y moved."""
    head, *rows = text.splitlines()
    names = [name.rpartition("_")[2] for name in head.split(";")]
    moved = [head]
    for row in rows:
        cells = row.split(";")
        for k, axis in enumerate("xy"):
            place = names.index(axis)
            cells[place] = cells[place] and _moved(cells[place], by[k])
        moved.append(";".join(cells))
    return "\n".join(moved) + "\n"


_MOVERS: tuple[tuple[str, Callable[[str, Shift], str]], ...] = (
    (".xml", _xml),
    (".yaml", _scene),
    (".csv", _table),
)


def first_steps(log: Path, target: Path, count: int) -> Path:
    """Write the first steps of a packed log of SUMO into a folder, and return the new log."""
    steps = gzip.decompress(log.read_bytes()).decode().split("</timestep>")
    text = "</timestep>".join([*steps[:count], "</fcd-export>"])
    path = target / log.name
    path.write_bytes(gzip.compress(text.encode(), mtime=0))
    return path


def shift(files: Iterable[Path], target: Path, by: Shift) -> Path:
    """Write files of a simulation, moved, into a folder, and return that.

    Args:
        files: Plain or gzipped; those that hold no coordinates stay as they are.
        target: Where to; it is made.
        by: To the east and to the north [m].
    """
    target.mkdir(parents=True, exist_ok=True)
    for file in files:
        name = file.name.removesuffix(".gz")
        move = next((move for ending, move in _MOVERS if name.endswith(ending)), None)
        data = file.read_bytes()
        if move is not None:
            plain = gzip.decompress(data) if file.suffix == ".gz" else data
            data = move(plain.decode(), by).encode()
            data = gzip.compress(data, mtime=0) if file.suffix == ".gz" else data
        (target / file.name).write_bytes(data)
    return target


def differences(some: Any, other: Any, where: str = "") -> Iterator[str]:
    """Yield where two values differ in any bit; names of files may differ.

    Args:
        some: Numbers, text, arrays, collections and dataclasses of them.
        other: Likewise.
        where: Its name.
    """
    if type(some) is not type(other):
        yield f"{where}: {type(some).__name__} and {type(other).__name__}"
    elif isinstance(some, np.ndarray) and some.dtype != object:
        if some.shape != other.shape or some.tobytes() != other.tobytes():
            yield where
    elif parts := _parts(some):
        others = _parts(other)
        if list(parts) != list(others):
            yield f"{where}: {len(parts)} and {len(others)} parts"
            return
        for name, part in parts.items():
            yield from differences(part, others[name], f"{where}.{name}")
    elif isinstance(some, _PLAIN) and repr(some) != repr(other):
        yield f"{where}: {some} and {other}"


_PLAIN = (float, int, str, bytes, type(None))


def _parts(value: Any) -> dict[Any, Any]:
    """Return what a value consists of; nothing of what is one piece."""
    if is_dataclass(value):
        names = (each.name for each in fields(value) if each.name not in _OWN)
        return {name: getattr(value, name, None) for name in names}
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, frozenset):
        return dict(enumerate(sorted(value)))
    return dict(enumerate(value)) if isinstance(value, list | tuple) else {}
