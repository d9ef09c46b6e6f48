"""Lamps that stand still: made once, lit frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.lights.emitter import axes_of, faces_of, lamp_emitter, light, lobe_row
from sumo3dviz_pt.render.lights.picks import Glow

UNTINTED = 0.03
"""Reflectance of lenses without a colour: dark glass."""


class _Standing:
    """One lamp set as the renderer keeps it."""

    def __init__(self, lamps: LampSet) -> None:
        self.lamps, count = lamps, len(lamps.lamps)
        self.name = f"lamps_{lamps.id}"
        self.mesh = _apart(lamps)
        normals, self._areas = faces_of(self.mesh.vertices, self.mesh.faces)
        index = lamps.lamp_of_face
        self._axes = axes_of(normals, self._areas, index, count)
        self._lobes = np.tile(lobe_row(lamps.lobe), (count, 1))
        self._places = lamps.mesh.vertices[lamps.mesh.faces].mean(axis=1)

    def glow(self, frame: FrameState) -> Glow:
        """Return how the lamp set shines in a frame."""
        index = self.lamps.lamp_of_face
        return Glow(self.radiance(frame), self._axes, self._lobes, self._areas, index, self._places)

    def radiance(self, frame: FrameState) -> Floats:
        """Return the radiance of each lamp, (lamps, 3)."""
        constant = self.lamps.radiance
        return np.asarray(frame.lamps[self.lamps.id] if constant is None else constant)


class Lamps:
    """A scene's lamp sets.

    Args:
        sets: All of them.
        bsdf: The material of their glass.
        jit: Whether the variant compiles.
    """

    def __init__(self, sets: Sequence[LampSet], *, bsdf: Any, jit: bool) -> None:
        self._bsdf, self._jit = bsdf, jit
        self._sets = [_Standing(lamps) for lamps in sets]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the meshes."""
        return tuple(each.name for each in self._sets)

    def things(self, mesh: str) -> tuple[tuple[str, int], ...]:
        """Return what the faces of a lamp set's mesh belong to; see `Mesh.things`."""
        found = (each.lamps.mesh.things for each in self._sets if each.name == mesh)
        return next(found, ())

    def entries(self, origin: Floats) -> dict[str, Any]:
        """Shapes by name, relative to an origin; all are dark."""
        return {each.name: self._shape(each, origin) for each in self._sets}

    def recentre(self, parameters: Any, origin: Floats) -> None:
        """Move all lamps to another origin."""
        for each in self._sets:
            key = f"{each.name}.vertex_positions"
            convert.overwrite(parameters, key, each.mesh.vertices - origin)

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Light the lamps as a frame says."""
        for each in self._sets:
            weight = each.lamps.weight if each.lamps.sampled else 0.0
            if self._jit:
                light(parameters, each.name, each.glow(frame), frame, weight=weight)
            else:
                key = f"{each.name}.{convert.RADIANCE_ATTRIBUTE}"
                radiance = each.radiance(frame)[each.lamps.lamp_of_face]
                convert.overwrite(parameters, key, radiance)

    def glows(self, frame: FrameState) -> list[Glow]:
        """Return how the lamps that paths aim at shine in a frame."""
        return [each.glow(frame) for each in self._sets if each.lamps.sampled]

    @property
    def most(self) -> int:
        """Lamps that paths aim at."""
        return sum(len(each.lamps.lamps) for each in self._sets if each.lamps.sampled)

    def _shape(self, each: _Standing, origin: Floats) -> Any:
        """Make the mesh of one lamp set."""
        lamps, mesh = each.lamps, each.mesh
        emitter = lamp_emitter(len(lamps.lamps), len(mesh.faces), jit=self._jit)
        placed = Mesh(mesh.vertices - origin, mesh.faces, None, mesh.uvs)
        tint = np.full((len(mesh.faces), 3), UNTINTED) if lamps.tint is None else lamps.tint
        return convert.make_lamps(
            each.name, placed, bsdf=self._bsdf, emitter=emitter, tint=np.asarray(tint)
        )


def _apart(lamps: LampSet) -> Mesh:
    """Return the mesh with corners of its own for every face: u tells the face, v the lamp."""
    corners = lamps.mesh.vertices[lamps.mesh.faces].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    face = (np.arange(len(faces)) + 0.5) / max(len(faces), 1)
    lamp = (lamps.lamp_of_face + 0.5) / max(len(lamps.lamps), 1)
    return Mesh(corners, faces, None, np.repeat(np.column_stack([face, lamp]), 3, axis=0))
