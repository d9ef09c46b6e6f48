"""What one camera sees of a place that was built once for several cameras.

Cameras of one scene mostly stand within a few hundred metres. A report on them needs no more than
how much each of them sees, so the place is built once, as detailed as the nearest of them wants
it, and parted by squares. Films build each camera's own place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.model.camera_path import CameraPath, in_view
from sumo3dviz_pt.model.geometry import Bools, Mesh
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.road_choice import DETAILED, MOST_LANES

_ROADS = ("roads", "markings", "ground")
"""Families that are laid out by large squares, or all of which a camera of a small network has."""

_SQUARE = 32.0
"""Side of the squares by which a place is parted [m]."""

_TALL = 12.0
"""What stands on a square reaches so far above it and beyond it, about [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """What a report needs of a shot, which it counts and does not render.

    Attributes:
        camera_path: Ways of all cameras that share the shot's place; None where it is alone.
        memory: Holds the place, which may be larger than all else that a world remembers.
    """

    camera_path: CameraPath | None = None
    memory: Memory = field(default_factory=Memory)


def seen_of(
    static: Sequence[StaticPart], camera_path: CameraPath, *, lanes: int
) -> tuple[StaticPart, ...]:
    """Return what a camera's own place would hold of a shared one, about.

    Args:
        static: Of the shared place.
        camera_path: Where the camera is and looks.
        lanes: Of the network; roads of small ones are built whatever a camera sees.
    """
    whole = _ROADS if lanes <= MOST_LANES else ()
    found = []
    for part in static:
        kept = part
        if part.family not in whole and len(part.part.mesh.faces):
            roads = part.family in _ROADS
            kept = _with_faces(part, _seen(part.part.mesh, camera_path, roads=roads))
        found.append(kept)
    return tuple(part for part in found if len(part.part.mesh.faces))


def _seen(mesh: Mesh, camera_path: CameraPath, *, roads: bool) -> Bools:
    """Which faces of a mesh lie in squares that a camera sees, (m,)."""
    size, beyond = DETAILED if roads else (_SQUARE, _TALL)
    middles = mesh.vertices[mesh.faces[:, 0]]
    places = np.floor(middles[:, :2] / size).astype(np.int64)
    low, high = places.min(axis=0), places.max(axis=0)
    own = np.ravel_multi_index(tuple((places - low).T), tuple(high - low + 1))
    counts = np.bincount(own)
    used = np.flatnonzero(counts)
    heights = np.bincount(own, weights=middles[:, 2])[used] / counts[used]
    cells = low + np.column_stack(np.unravel_index(used, tuple(high - low + 1)))
    centres = np.column_stack([(cells + 0.5) * size, heights])
    seen = np.zeros(len(counts), dtype=np.bool_)
    seen[used] = in_view(camera_path, centres, radius=size * 0.5**0.5 + beyond).any(axis=1)
    return np.asarray(seen[own])


def _with_faces(part: StaticPart, kept: Bools) -> StaticPart:
    """Return a part with some of its faces."""
    if kept.all():
        return part
    mesh, tint = part.part.mesh, part.part.tint
    runs = [name for name, _ in mesh.things]
    owner = np.repeat(np.arange(len(runs)), [count for _, count in mesh.things])
    counts = np.bincount(owner[kept], minlength=len(runs)).tolist() if runs else []
    things = tuple((name, count) for name, count in zip(runs, counts, strict=True) if count)
    some = replace(mesh, faces=mesh.faces[kept], things=things)
    return replace(
        part, part=replace(part.part, mesh=some, tint=None if tint is None else tint[kept])
    )
