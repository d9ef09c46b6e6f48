"""Packs bodies of vehicles for `sumo3dviz_pt/library/vehicles/packed.py`, the same bytes each time.

xz of 8 MiB dictionary, tuned to rows of four bytes: a ninth smaller than with its own choice.
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sumo3dviz_pt.library.vehicles.packed import CORNER, FORMAT, GROUPS, VALUE
from sumo3dviz_pt.library.vehicles.recipe import Meshes
from sumo3dviz_pt.model.geometry import Ints, Mesh

_FILTERS = [
    {
        "id": lzma.FILTER_LZMA2,
        "preset": 9 | lzma.PRESET_EXTREME,
        "dict_size": 1 << 23,
        "lc": 0,
        "lp": 2,
        "pb": 2,
    }
]

_VALUES = {kinds: values for values, kinds in GROUPS.items()}


def write_levels(path: Path, levels: Mapping[str, Meshes]) -> None:
    """Write levels of detail; the same meshes give the same bytes.

    Args:
        path: The file; replaced when it exists.
        levels: Meshes by material, by the names of their levels; coordinates become float32.
    """
    part = path.with_name(path.name + ".part")
    part.write_bytes(packed(levels))
    part.replace(path)


def packed(levels: Mapping[str, Meshes]) -> bytes:
    """Return levels of detail as the bytes of their file."""
    content = unpacked(levels)
    return lzma.compress(content, lzma.FORMAT_XZ, lzma.CHECK_CRC64, filters=_FILTERS)


def unpacked(levels: Mapping[str, Meshes]) -> bytes:
    """Return what the file unpacks to."""
    meshes = [mesh for level in levels.values() for mesh in level.values()]
    listed = {
        level: [
            [material, len(mesh.vertices), len(mesh.faces), _VALUES[_kinds(mesh)]]
            for material, mesh in some.items()
        ]
        for level, some in levels.items()
    }
    head = json.dumps({"format": FORMAT, "levels": listed}, separators=(",", ":"))
    corners = [_below(mesh.faces.ravel()).astype(CORNER).tobytes() for mesh in meshes]
    tables = [_table(mesh).tobytes() for mesh in meshes]
    return b"".join([head.encode("ascii"), b"\n", *corners, *tables])


def _below(corners: Ints) -> Ints:
    """How far corners, (n,), lie below the first vertex that none before them has."""
    before = np.concatenate([[-1], np.maximum.accumulate(corners)])[: len(corners)]
    return np.asarray(before + 1 - corners)


def _kinds(mesh: Mesh) -> tuple[bool, bool]:
    """Whether a mesh has normals and texture coordinates."""
    return mesh.normals is not None, mesh.uvs is not None


def _table(mesh: Mesh) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """The values of all vertices, (n, values)."""
    columns = [values for values in (mesh.vertices, mesh.normals, mesh.uvs) if values is not None]
    return np.concatenate(columns, axis=1).astype(VALUE)
