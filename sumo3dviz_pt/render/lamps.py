"""Lamps whose radiance changes from frame to frame.

Mitsuba's area emitter asks its radiance at sampled points that know no face, where a
`mesh_attribute` is black: light paths that aim at such lamps found nothing. A texture
that looks radiance up by uv works, because sampled points carry that. It must call
itself uniform, or the emitter would ask for a parameterisation of the mesh. Scalar
variants, where such a texture is slow, do not aim at lamps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.render import convert

_PLUGIN = "sumo3dviz_lamps"
UNTINTED = 0.03
"""Reflectance of lenses without a colour: dark glass."""


def register_lamps() -> None:
    """Make the texture known to the active JIT variant."""

    class LampTexture(mi.Texture):  # type: ignore[misc]
        """Radiance of the lamp whose number is in u."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            self.count = int(props["count"])
            self.table = dr.opaque(mi.Float, 0.0, 3 * self.count)

        def eval(self, si: Any, active: Any = True) -> Any:
            index = dr.minimum(mi.UInt32(si.uv.x * self.count), self.count - 1)
            return dr.gather(mi.Color3f, self.table, index, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self.eval(si, active)

        def mean(self) -> Any:
            return mi.Float(1.0)

        def is_spatially_varying(self) -> bool:
            return False

        def traverse(self, callback: Any) -> None:
            callback.put("values", self.table, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "LampTexture[]"

    mi.register_texture(_PLUGIN, lambda props: LampTexture(props))


def lamp_texture(count: int, *, jit: bool) -> dict[str, Any]:
    """The radiance of lamps as a plugin's dict: by their number in u, or by their faces."""
    if jit:
        return {"type": _PLUGIN, "count": count}
    return {"type": "mesh_attribute", "name": convert.RADIANCE_ATTRIBUTE}


class Lamps:
    """A scene's lamp sets: made once, lit frame by frame."""

    def __init__(self, sets: Sequence[LampSet], *, bsdf: Any, jit: bool) -> None:
        self.sets, self._bsdf, self._jit = tuple(sets), bsdf, jit
        self._meshes = {lamps.id: _apart(lamps) for lamps in self.sets}

    def entries(self, origin: Floats) -> dict[str, Any]:
        """Shapes by name, relative to an origin; all are dark."""
        return {_name(lamps): self._shape(lamps, origin) for lamps in self.sets}

    def recentre(self, parameters: Any, origin: Floats) -> None:
        """Move all lamps to another origin."""
        for lamps in self.sets:
            key = f"{_name(lamps)}.vertex_positions"
            convert.overwrite(parameters, key, self._meshes[lamps.id].vertices - origin)

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Light the lamps as a frame says."""
        for lamps in self.sets:
            radiance = frame.lamps[lamps.id] if lamps.radiance is None else lamps.radiance
            if self._jit:
                convert.overwrite(parameters, f"{_name(lamps)}.emitter.radiance.values", radiance)
            else:
                key = f"{_name(lamps)}.{convert.RADIANCE_ATTRIBUTE}"
                convert.overwrite(parameters, key, radiance[lamps.lamp_of_face])

    def _shape(self, lamps: LampSet, origin: Floats) -> Any:
        """One set as a mesh that shines."""
        mesh = self._meshes[lamps.id]
        radiance = lamp_texture(len(lamps.lamps), jit=self._jit)
        weight = lamps.weight if self._jit and lamps.sampled else 0.0
        emitter = {"type": "area", "radiance": radiance, "sampling_weight": weight}
        placed = Mesh(mesh.vertices - origin, mesh.faces, None, mesh.uvs)
        tint = np.full((len(mesh.faces), 3), UNTINTED) if lamps.tint is None else lamps.tint
        return convert.make_lamps(
            _name(lamps), placed, bsdf=self._bsdf, emitter=emitter, tint=np.asarray(tint)
        )


def _name(lamps: LampSet) -> str:
    """The shape's name in the scene."""
    return f"lamps_{lamps.id}"


def _apart(lamps: LampSet) -> Mesh:
    """The mesh with corners of its own for every face: u tells the lamp of a face."""
    corners = lamps.mesh.vertices[lamps.mesh.faces].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    u = (np.repeat(lamps.lamp_of_face, 3) + 0.5) / max(len(lamps.lamps), 1)
    return Mesh(corners, faces, None, np.column_stack([u, np.zeros_like(u)]))
