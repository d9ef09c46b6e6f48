"""Which bodies a shot shows, and how coarse their stand-ins are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from sumo3dviz_pt.library.mesh.clustering import clustered_body
from sumo3dviz_pt.model.scene import Prototype, Slots
from sumo3dviz_pt.shot.crowd import FAR_TRIANGLES

_CELLS = (0.08, 0.12, 0.18, 0.25, 0.35)
"""Cells in which vertices of stand-ins are merged, until there are few enough [m]."""


def shown_bodies(prototypes: Mapping[str, Prototype], slots: Slots) -> dict[str, Prototype]:
    """Return the bodies that have slots, with stand-ins coarse enough for their budget."""
    names = sorted({*slots.near, *slots.far, *slots.deforming})
    return _coarse_enough({name: prototypes[name] for name in names}, slots.far)


def _coarse_enough(
    prototypes: Mapping[str, Prototype], slots: Mapping[str, int]
) -> dict[str, Prototype]:
    """The same bodies with stand-ins so coarse that all of them keep their budget."""
    found = dict(prototypes)
    for cell in _CELLS:
        total = sum(count * _far_triangles(found[name]) for name, count in slots.items())
        if total <= FAR_TRIANGLES:
            break
        for name in slots:
            whole = prototypes[name]
            # Those that take poses keep their points.
            if whole.far_poses is None:
                meshes = clustered_body([part.mesh for part in whole.far], cell)
                parts = (replace(p, mesh=m) for p, m in zip(whole.far, meshes, strict=True))
                far = tuple(p for p in parts if p.tint is None and len(p.mesh.faces))
                found[name] = replace(whole, far=far or whole.far)
    return found


def _far_triangles(prototype: Prototype) -> int:
    """Of its stand-in."""
    return sum(len(part.mesh.faces) for part in prototype.far)
