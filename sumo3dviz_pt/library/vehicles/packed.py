"""Reads the packed bodies of vehicles: several levels of detail in one file, bit by bit as made.

Packed is what `tools/bakery` wrote: a stream of xz that unpacks to one line of JSON, which lists
levels, materials and counts, then the corners of all faces, then the values of all vertices. A
corner is stored as how far it lies below the first vertex that none before it has: mostly 0 or
small. That is a sixth of what PLY takes. What a file may ask for is bounded, and nothing in it
is run.

References:
    W. Chun: WebGL Models: End-to-End, in OpenGL Insights, CRC Press, 2012 (high-water marks).
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.library.vehicles.recipe import Meshes
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh

BODIES = "bodies.xz"
"""In a vehicle's folder: its levels `parts` and `far`."""

FULL = "full.xz"
"""The same of the levels `full` and `wheel`, for close views."""

FORMAT = 1
"""What the line of JSON says; another one is not read."""

CORNER = np.dtype("<i4")
"""A corner of a face."""

VALUE = np.dtype("<f4")
"""A coordinate of a vertex, of its normal or on its texture; those of a vertex stand together."""

GROUPS = {3: (False, False), 5: (False, True), 6: (True, False), 8: (True, True)}
"""Whether a mesh has normals and texture coordinates, by the values of each of its vertices."""

_MOST_PACKED = 4_000_000  # of a file [bytes]
_MOST = 64_000_000  # of what it unpacks to [bytes]
_MEMORY = 48_000_000  # that unpacking may take; the dictionary has 8 MiB [bytes]


def read_levels(path: Path) -> dict[str, Meshes]:
    """Return meshes by material, by the names of their levels.

    Args:
        path: What `tools/bakery` wrote.

    Raises:
        InputError: If the file is missing, damaged, or asks for more than a vehicle takes.
    """
    try:
        with path.open("rb") as stream:
            packed = stream.read(_MOST_PACKED + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    try:
        return _levels(_unpacked(packed))
    except (ValueError, TypeError, LookupError, AttributeError, lzma.LZMAError) as error:
        message = f"is damaged ({error}); install the package again"
        raise InputError(message, file=path) from error


def _unpacked(packed: bytes) -> memoryview:
    """Return what a stream unpacks to."""
    if len(packed) > _MOST_PACKED:
        raise ValueError(f"more than {_MOST_PACKED:,} bytes")
    unpack = lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_MEMORY)
    content = unpack.decompress(packed, max_length=_MOST)
    if not unpack.eof or unpack.unused_data:
        raise ValueError("it ends too early or too late")
    return memoryview(content)


@dataclass(frozen=True, slots=True)
class _Listed:
    """A mesh as the line of JSON lists it."""

    level: str
    material: str
    vertices: int
    faces: int
    values: int

    def __post_init__(self) -> None:
        """Refuse what is no mesh."""
        counts = (self.vertices, self.faces, self.values)
        if not all(type(count) is int and 0 <= count < _MOST for count in counts):
            raise ValueError("a count is no count")
        if self.values not in GROUPS or not isinstance(self.material, str):
            raise ValueError("a mesh of an unknown kind")


def _listed(levels: Mapping[str, Any]) -> Iterator[_Listed]:
    """The meshes of all levels in the order of their values."""
    for level, rows in levels.items():
        for material, vertices, faces, values in rows:
            yield _Listed(level, material, vertices, faces, values)


def _levels(content: memoryview) -> dict[str, Meshes]:
    """Return the meshes of what was unpacked."""
    line = content.obj.partition(b"\n")[0]  # type: ignore[attr-defined]
    head = json.loads(line)
    if head.get("format") != FORMAT:
        raise ValueError(f"its format is {head.get('format')!r}, not {FORMAT}")
    listed = list(_listed(head["levels"]))
    corners, values = (
        sum(3 * mesh.faces for mesh in listed),
        sum(mesh.vertices * mesh.values for mesh in listed),
    )
    begin, middle = len(line) + 1, len(line) + 1 + corners * CORNER.itemsize
    if len(content) != middle + values * VALUE.itemsize:
        raise ValueError("it is too short or too long")
    stored = np.frombuffer(content[begin:middle], CORNER).astype(np.int64)
    table = np.frombuffer(content[middle:], VALUE).astype(np.float64)
    levels: dict[str, dict[str, Mesh]] = {level: {} for level in head["levels"]}
    at, row = 0, 0
    for mesh in listed:
        size = mesh.vertices * mesh.values
        own = _corners(stored[row : row + 3 * mesh.faces])
        levels[mesh.level][mesh.material] = _mesh(table[at : at + size], own, mesh)
        at, row = at + size, row + 3 * mesh.faces
    return dict(levels)


def _corners(below: Ints) -> Ints:
    """Return the corners of a mesh's faces, (n,), which lie so far below the first new vertex."""
    newer = np.where(below <= 0, 1 - below, 0)
    return np.asarray(np.cumsum(newer) - newer - below)


def _mesh(values: Floats, faces: Ints, listed: _Listed) -> Mesh:
    """Return one mesh; it refuses corners that are not there."""
    columns = values.reshape(listed.vertices, listed.values)
    normals, uvs = GROUPS[listed.values]
    return Mesh(
        columns[:, :3],
        faces,
        columns[:, 3:6] if normals else None,
        columns[:, -2:] if uvs else None,
    )
