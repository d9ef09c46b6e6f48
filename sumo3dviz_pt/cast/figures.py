"""People on foot and on bicycles in all their poses: built once, then kept in the cache."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.kept_bodies import kept_files, kept_folder
from sumo3dviz_pt.files.kept import Files
from sumo3dviz_pt.library.people.build import figure
from sumo3dviz_pt.library.vehicles.cycles.pedalling import pedalling
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Poses, Prototype

Posed = tuple[tuple[Part, ...], Poses]
"""Parts, and the shapes that they take in turn."""


@cache
def person(look: str) -> Prototype:
    """Return somebody on foot at both levels of detail; a process reads each once.

    Args:
        look: A name in the catalogue's family `people`.
    """
    entry = catalog.find("people", look)
    recipe = entry.meta["recipe"]
    made = {"near": lambda: figure(recipe), "far": lambda: figure(recipe, "far")}
    levels = _kept(entry, "people", made)
    (parts, poses), (far, far_poses) = levels["near"], levels["far"]
    return Prototype(look, parts, far, poses=poses, far_poses=far_poses)


def cyclist(entry: catalog.Entry) -> Posed:
    """Return a vehicle whose rider pedals, in detail.

    Args:
        entry: Of the catalogue's family `vehicles`.
    """
    return _kept(entry, "riders", {"near": lambda: pedalling(entry.meta)})["near"]


def _kept(
    entry: catalog.Entry, family: str, made: Mapping[str, Callable[[], Posed]]
) -> dict[str, Posed]:
    """Return levels of detail by their names, from the cache if they are there."""

    def build() -> Files:
        """Build all levels, as files."""
        return {f"{name}.npz": _written(*make()) for name, make in made.items()}

    files = kept_files(kept_folder(entry, family), build)
    return {name: _read(files[f"{name}.npz"]) for name in made}


def _written(parts: tuple[Part, ...], poses: Poses) -> bytes:
    """Return one level as the bytes of a NumPy archive."""
    arrays: dict[str, Any] = {
        "materials": np.array([part.material for part in parts]),
        "pose_vertices": poses.vertices,
        "pose_normals": poses.normals,
    }
    for number, part in enumerate(parts):
        mesh = part.mesh
        given = {"normals": mesh.normals, "uvs": mesh.uvs, "tint": part.tint}
        arrays |= {f"{number}/vertices": mesh.vertices, f"{number}/faces": mesh.faces}
        arrays |= {f"{number}/{key}": some for key, some in given.items() if some is not None}
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def _read(content: bytes) -> Posed:
    """Read one level that `_written` wrote."""
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        arrays: Mapping[str, Any] = dict(archive)
    parts = []
    for number, material in enumerate(arrays["materials"].tolist()):
        own = {key: arrays.get(f"{number}/{key}") for key in ("normals", "uvs", "tint")}
        mesh = Mesh(
            arrays[f"{number}/vertices"], arrays[f"{number}/faces"], own["normals"], own["uvs"]
        )
        parts.append(Part(mesh, str(material), own["tint"]))
    return tuple(parts), Poses(arrays["pose_vertices"], arrays["pose_normals"])
