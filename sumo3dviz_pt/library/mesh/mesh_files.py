"""Reads the triangles of mesh files that others made, and bounds what they may ask for.

A file of a hundred bytes can announce billions of vertices, so its own counts are looked at
before it is read.
"""

from __future__ import annotations

import json
import re
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.model.geometry import Floats, Mesh

MOST_BYTES = 500_000_000
"""Of a file."""

MOST_TRIANGLES = 3_000_000
"""Of a model: six times the largest that a picture of traffic can show well."""

_MOST_NUMBERS = 40_000_000
"""Numbers that a file may announce: coordinates, normals, indices."""

_FARTHEST = 1e6
"""Coordinates of a model, in its own unit: a kilometre in millimetres."""

_PLY_COUNT = re.compile(rb"element\s+\w+\s+(\d+)")
_HEAD = 1 << 16


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """One mesh of a file.

    Attributes:
        mesh: Its triangles, in the file's frame.
        names: Of the mesh and of its material.
        rgba: Its colour in sRGB and how opaque it is, (4,) in [0, 1]; None if the file has none.
        blended: Whether it is marked as transparent.
        roughness: In [0, 1], or None.
        metallic: In [0, 1], or None.
    """

    mesh: Mesh
    names: tuple[str, ...]
    rgba: Floats | None = None
    blended: bool = False
    roughness: float | None = None
    metallic: float | None = None


def read_solids(path: Path, *, key: str) -> list[Solid]:
    """Read all triangle meshes of a file.

    Args:
        path: GLB, glTF, OBJ, PLY or STL.
        key: Of the setting that names it, for messages.

    Raises:
        ConfigError: If it is too large, damaged, holds no triangles or coordinates that no
            model has.
    """
    import trimesh

    _check_announced(path, key)
    try:
        scene: Any = trimesh.load(path, force="scene")
        meshes = [item for item in scene.dump() if isinstance(item, trimesh.Trimesh)]
        found = [_solid(item) for item in meshes if len(item.faces)]
    except Exception as error:  # trimesh's readers raise anything
        why = cut(" ".join(f"{type(error).__name__}: {error}".split()), most=120)
        message = f"{path} cannot be read: it is damaged; write it again ({why})"
        raise ConfigError(message, key=key) from error
    found = [solid for solid in found if len(solid.mesh.faces)]
    if not found:
        raise ConfigError(f"{path} holds no triangles", key=key)
    _check_solids(found, path, key)
    return found


def _check_solids(found: list[Solid], path: Path, key: str) -> None:
    """Refuse what cannot be drawn."""
    triangles = sum(len(solid.mesh.faces) for solid in found)
    if triangles > MOST_TRIANGLES:
        raise ConfigError(
            f"{path} has {triangles:,} triangles, and at most {MOST_TRIANGLES:,} are drawn;"
            " make it simpler",
            key=key,
        )
    for solid in found:
        # Written so that NaN fails too.
        if not (np.abs(solid.mesh.vertices) <= _FARTHEST).all():
            name = f" of {cut(solid.names[0])!r}" if solid.names else ""
            raise ConfigError(
                f"{path}: a vertex{name} is no number or lies beyond {_FARTHEST:g} units;"
                " write the model again",
                key=key,
            )


def _check_announced(path: Path, key: str) -> None:
    """Refuse a file that is, or says it is, larger than any model."""
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise ConfigError(f"{path} has {size:,} bytes, more than {MOST_BYTES:,}", key=key)
    numbers = _ANNOUNCED.get(path.suffix.lower(), lambda _: 0)(path)
    if numbers > _MOST_NUMBERS:
        raise ConfigError(
            f"{path} says that it holds {numbers:,} numbers, more than {_MOST_NUMBERS:,};"
            " it is damaged or too large",
            key=key,
        )


def _announced_by_ply(path: Path) -> int:
    """Count the numbers that a PLY file announces."""
    with path.open("rb") as stream:
        head = stream.read(_HEAD).partition(b"end_header")[0]
    # More digits than that are too many in any case.
    return 3 * sum(int(match[1][:18]) for match in _PLY_COUNT.finditer(head))


def _announced_by_gltf(path: Path) -> int:
    """Count the numbers that a glTF file announces; 0 if it is damaged, which is said later."""
    data = path.read_bytes()
    if data[:4] == b"glTF" and len(data) >= 20:
        (length,) = struct.unpack_from("<I", data, 12)
        data = data[20 : 20 + length]
    try:
        accessors = json.loads(data).get("accessors", [])
        return 3 * sum(int(accessor.get("count", 0)) for accessor in accessors)
    except (ValueError, TypeError, AttributeError, OverflowError, RecursionError):
        return 0


_ANNOUNCED = {
    ".ply": _announced_by_ply,
    ".gltf": _announced_by_gltf,
    ".glb": _announced_by_gltf,
}


def _solid(item: Any) -> Solid:
    """Merge a mesh's equal vertices and drop its faces without area."""
    material = getattr(item.visual, "material", None)
    names = [item.metadata.get("name"), getattr(material, "name", None)]
    given = tuple(str(name) for name in names if name)
    item = item.copy()
    item.merge_vertices(merge_tex=True, merge_norm=True)
    keep = item.area_faces > 1e-12
    mesh = Mesh(np.asarray(item.vertices, dtype=np.float64), np.asarray(item.faces)[keep])
    return _painted(Solid(mesh, given), item.visual)


def _painted(solid: Solid, visual: Any) -> Solid:
    """Give a mesh the looks that its file says it has."""
    if not visual.defined:
        return solid
    material = getattr(visual, "material", visual)
    return replace(
        solid,
        rgba=np.asarray(material.main_color, dtype=np.float64) / 255.0,
        blended=getattr(material, "alphaMode", None) == "BLEND",
        roughness=_share(getattr(material, "roughnessFactor", None)),
        metallic=_share(getattr(material, "metallicFactor", None)),
    )


def _share(value: Any) -> float | None:
    """Clip a value to [0, 1]; None where there is none."""
    return None if value is None or not float(value) >= 0.0 else min(float(value), 1.0)
