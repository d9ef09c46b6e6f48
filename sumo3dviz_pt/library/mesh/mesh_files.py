"""Reads the triangles of mesh files that others made, and bounds what they may ask for.

A file of a hundred bytes can announce billions of vertices, so its own counts are looked at
before it is read.
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.files.atomic import read_plain, refuse_special
from sumo3dviz_pt.files.quiet import unwarned
from sumo3dviz_pt.model.geometry import Floats, Mesh

MOST_BYTES = 500_000_000
"""Of a file."""

MOST_TRIANGLES = 3_000_000
"""Of a model: six times the largest that a picture of traffic can show well."""

_MOST_PARTS = 5000
"""Of a model: meshes in their places."""

_MOST_MEETINGS = 1_000_000_000
"""Corners of a mesh times the most of them at one vertex; smoothing takes so many steps."""

_MOST_NUMBERS = 40_000_000
"""Numbers that a file may announce: coordinates, normals, indices."""

_FARTHEST = 1e6
"""Coordinates of a model, in its own unit: a kilometre in millimetres."""

_PLY_COUNT = re.compile(rb"element\s+\w+\s+(\d+)")
_OBJ_PART = re.compile(rb"^\s*(?:usemtl|o)\s", re.M)
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
    _check_announced(path, key)
    try:
        with unwarned():
            solids = [_solid(*placed) for placed in _placed(path, key)]
    except ConfigError:
        raise
    except Exception as error:  # trimesh's readers raise anything
        why = cut(" ".join(f"{type(error).__name__}: {error}".split()), most=120)
        message = f"{path} cannot be read: it is damaged; write it again ({why})"
        raise ConfigError(message, key=key) from error
    solids = [solid for solid in solids if len(solid.mesh.faces)]
    if not solids:
        raise ConfigError(f"{path} holds no triangles", key=key)
    _check_solids(solids, path, key)
    return solids


def _placed(path: Path, key: str) -> list[tuple[Any, Floats]]:
    """Return the meshes of a file, each as often as it is used, and where, (4, 4)."""
    import trimesh

    scene: Any = trimesh.load(path, force="scene", resolver=_beside(path))
    shapes = {
        name: item
        for name, item in scene.geometry.items()
        if isinstance(item, trimesh.Trimesh) and len(item.faces)
    }
    used = [(place, shape) for place, shape in _nodes(scene.graph) if shape in shapes]
    triangles = sum(len(shapes[shape].faces) for _, shape in used)
    if triangles > MOST_TRIANGLES or len(used) > _MOST_PARTS:
        raise ConfigError(
            f"{path} has {len(used):,} parts of {triangles:,} triangles together, and at most"
            f" {_MOST_PARTS:,} parts and {MOST_TRIANGLES:,} triangles are drawn; make it simpler",
            key=key,
        )
    return [(shapes[shape], place) for place, shape in used]


def _nodes(graph: Any) -> Iterator[tuple[Floats, str | None]]:
    """Yield the places of all nodes, (4, 4), and what stands there.

    Each node is asked once: trimesh multiplies all matrices above each of them anew.
    """
    tree = graph.transforms
    waiting = [(graph.base_frame, np.eye(4))]
    while waiting:
        name, place = waiting.pop()
        yield place, tree.node_data[name].get("geometry")
        for child in tree.children.get(name, ()):
            own = tree.edge_data[name, child].get("matrix")
            waiting.append((child, place if own is None else place @ own))


def _beside(path: Path) -> Any:
    """Return what reads the files that a mesh file names: plain ones in its folder."""
    from trimesh.resolvers import FilePathResolver

    class Beside(FilePathResolver):
        """Reads no pipes and no devices, and no more than a mesh file may hold."""

        def get(self, name: str) -> bytes:
            """Return what a file holds."""
            return read_plain(self.absolute(name), most=MOST_BYTES)

    return Beside(str(path))


def _check_solids(solids: list[Solid], path: Path, key: str) -> None:
    """Refuse what cannot be drawn."""
    for solid in solids:
        # Written so that NaN fails too.
        if not (np.abs(solid.mesh.vertices) <= _FARTHEST).all():
            name = f" of {cut(solid.names[0])!r}" if solid.names else ""
            raise ConfigError(
                f"{path}: a vertex{name} is no number or lies beyond {_FARTHEST:g} units;"
                " write the model again",
                key=key,
            )
        widest = int(np.bincount(solid.mesh.faces.ravel()).max())
        if widest * solid.mesh.faces.size > _MOST_MEETINGS:
            raise ConfigError(
                f"{path}: {widest:,} of {len(solid.mesh.faces):,} triangles meet at one vertex;"
                " make the model simpler",
                key=key,
            )


def _check_announced(path: Path, key: str) -> None:
    """Refuse a file that is, or says it is, larger than any model."""
    try:
        refuse_special(path)
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise ConfigError(f"{path} has {size:,} bytes, more than {MOST_BYTES:,}", key=key)
        numbers, parts = _ANNOUNCED.get(path.suffix.lower(), lambda _: (0, 0))(path)
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}", key=key) from error
    for count, most, what in (
        (numbers, _MOST_NUMBERS, "numbers"),
        (parts, 2 * _MOST_PARTS, "parts"),
    ):
        if count > most:
            raise ConfigError(
                f"{path} says that it holds {count:,} {what}, more than {most:,};"
                " it is damaged or too large",
                key=key,
            )


def _announced_by_ply(path: Path) -> tuple[int, int]:
    """Count the numbers and parts that a PLY file announces."""
    with path.open("rb") as stream:
        head = stream.read(_HEAD).partition(b"end_header")[0]
    # More digits than that are too many in any case.
    return 3 * sum(int(match[1][:18]) for match in _PLY_COUNT.finditer(head)), 1


def _announced_by_gltf(path: Path) -> tuple[int, int]:
    """Count what a glTF file announces; nothing if it is damaged, which is said later."""
    data = path.read_bytes()
    if data[:4] == b"glTF" and len(data) >= 20:
        (length,) = struct.unpack_from("<I", data, 12)
        data = data[20 : 20 + length]
    try:
        content = json.loads(data)
        numbers = 3 * sum(int(each.get("count", 0)) for each in content.get("accessors", []))
        shapes = sum(len(each.get("primitives", [])) for each in content.get("meshes", []))
        return numbers, max(shapes, len(content.get("nodes", [])))
    except (ValueError, TypeError, AttributeError, OverflowError, RecursionError):
        return 0, 0


def _announced_by_obj(path: Path) -> tuple[int, int]:
    """Count the parts of an OBJ file: it changes its material or its object so often."""
    return 0, len(_OBJ_PART.findall(path.read_bytes()))


_ANNOUNCED = {
    ".ply": _announced_by_ply,
    ".gltf": _announced_by_gltf,
    ".glb": _announced_by_gltf,
    ".obj": _announced_by_obj,
}


def _solid(item: Any, place: Floats) -> Solid:
    """Put a mesh in its place, merge equal vertices, drop doubled faces and those without area."""
    import trimesh

    material = getattr(item.visual, "material", None)
    names = [item.metadata.get("name"), getattr(material, "name", None)]
    words = tuple(str(name) for name in names if name)
    # Without its looks: a copy of these would unpack all pictures.
    bare: Any = trimesh.Trimesh(item.vertices, item.faces, process=False)
    bare.apply_transform(place)
    bare.merge_vertices()
    keep = (bare.area_faces > 1e-12) & bare.unique_faces()
    mesh = Mesh(np.asarray(bare.vertices, dtype=np.float64), np.asarray(bare.faces)[keep])
    return _painted(Solid(mesh, words), item.visual)


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
