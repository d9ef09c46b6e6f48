"""Reads and writes our meshes as binary little-endian PLY (float32, triangles).

trimesh 4 reads the 1,123 files of the library's vehicles to the same vertices, faces and normals,
but takes eight times as long, changes the last bits of texture coordinates and writes other bytes.

References:
    G. Turk: The PLY Polygon File Format, 1994. Property names as Mitsuba reads them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Mesh

_GROUPS = (("x", "y", "z"), ("nx", "ny", "nz"), ("u", "v"))
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
_END = b"end_header\n"


def write_ply(path: Path, mesh: Mesh) -> None:
    """Write a mesh; the same mesh gives the same bytes.

    Args:
        path: The file; replaced when it exists.
        mesh: Positions are stored as float32.
    """
    part = path.with_name(path.name + ".part")
    part.write_bytes(encoded(mesh))
    part.replace(path)


def encoded(mesh: Mesh) -> bytes:
    """Encode a mesh as the bytes of its file; positions become float32."""
    columns = [mesh.vertices, mesh.normals, mesh.uvs]
    table = np.concatenate([c for c in columns if c is not None], axis=1).astype("<f4")
    names = [n for c, group in zip(columns, _GROUPS, strict=True) if c is not None for n in group]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(mesh.vertices)}",
        *(f"property float {name}" for name in names),
        f"element face {len(mesh.faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    faces = np.empty(len(mesh.faces), dtype=_FACE)
    faces["count"], faces["corners"] = 3, mesh.faces
    return ("\n".join(header) + "\n").encode("ascii") + table.tobytes() + faces.tobytes()


def read_ply(path: Path) -> Mesh:
    """Read a mesh that `write_ply` wrote.

    Raises:
        InputError: If the file is missing, cut short or of another kind of PLY.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    return decoded(content, file=path)


def decoded(content: bytes, *, file: Path) -> Mesh:
    """Decode a mesh from the bytes of its file; `file` is only named in messages.

    Raises:
        InputError: If they are cut short or those of another kind of PLY.
    """
    head, mark, body = content.partition(_END)
    names, vertices, faces = _layout(head.decode("ascii", errors="replace").split("\n"), file)
    size = vertices * 4 * len(names)
    if not mark or len(body) != size + faces * _FACE.itemsize:
        raise InputError("is cut short or not a triangle mesh of ours", file=file)
    table = np.frombuffer(body, dtype="<f4", count=vertices * len(names)).astype(np.float64)
    table = table.reshape(vertices, len(names))
    corners = np.frombuffer(body, dtype=_FACE, offset=size)["corners"]
    at = {name: table[:, k] for k, name in enumerate(names)}
    groups = [np.stack([at[n] for n in g], 1) if g[0] in at else None for g in _GROUPS]
    return Mesh(table[:, :3], corners.astype(np.int64), groups[1], groups[2])


def _layout(lines: list[str], path: Path) -> tuple[list[str], int, int]:
    """Read the names of vertex properties and the numbers of vertices and faces from the header."""
    names = [line.split()[-1] for line in lines if line.startswith("property float ")]
    counts = [int(line.split()[-1]) for line in lines if line.startswith("element ")]
    known = lines[:2] == ["ply", "format binary_little_endian 1.0"]
    groups = [name for group in _GROUPS if group[0] in names for name in group]
    if not known or names != groups or names[:3] != ["x", "y", "z"] or len(counts) != 2:
        raise InputError("is not a binary PLY file of ours", file=path)
    return names, counts[0], counts[1]
