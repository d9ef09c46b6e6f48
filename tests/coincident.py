"""Faces of a body that lie in one place: which of them is seen hangs on last bits."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Mesh

_LEAST = 2e-7
"""Smaller areas [m2] count as none."""


def shared_area(meshes: Mapping[str, Mesh]) -> dict[tuple[str, str], float]:
    """Return by pairs of names which area faces share that look one way [m2]."""
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes.values()])
    names = np.repeat(list(meshes), [len(mesh.faces) for mesh in meshes.values()])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    keep = doubled > 1e-10
    corners, names = corners[keep], names[keep]
    normals = normals[keep] / doubled[keep, None]
    offsets = (normals * corners[:, 0]).sum(axis=1)
    # Faces of one plane come together; a plane at a border of cells may be missed.
    planes = defaultdict(list)
    cells = np.round(np.column_stack([normals * 200.0, offsets * 2e4])).astype(np.int64)
    for index, cell in enumerate(map(tuple, cells.tolist())):
        planes[cell].append(index)
    found: dict[tuple[str, str], float] = defaultdict(float)
    for faces in planes.values():
        if len(set(names[faces])) < 2:
            continue
        normal = normals[faces[0]]
        aside = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        flat = np.stack([corners[faces] @ aside, corners[faces] @ np.cross(normal, aside)], axis=-1)
        shapes = shapely.polygons(flat)
        one, other = shapely.STRtree(shapes).query(shapes, predicate="intersects")
        areas = shapely.area(shapely.intersection(shapes[one], shapes[other]))
        for i, j, area in zip(one.tolist(), other.tolist(), areas.tolist(), strict=True):
            pair = (str(names[faces[i]]), str(names[faces[j]]))
            if pair[0] < pair[1] and area > _LEAST:
                found[pair] += area
    return dict(found)
