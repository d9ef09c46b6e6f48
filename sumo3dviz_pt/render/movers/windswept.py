"""Plants that wind moves: meshes whose vertices and normals are written in every frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, on_faces
from sumo3dviz_pt.model.scene import FrameState, SceneData
from sumo3dviz_pt.model.swaying import Sway
from sumo3dviz_pt.model.weather import Wind
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.materials.compound import MergedMesh, merged_meshes


class WindsweptMesh:
    """A part of what stands that wind moves.

    Attributes:
        name: Of the mesh.
        merged: At rest, in the network's coordinates.
    """

    def __init__(self, name: str, merged: MergedMesh, sway: Sway) -> None:
        self.name, self.merged, self._sway = name, merged, sway
        self._still: Floats | None = None

    @property
    def shown(self) -> Mapping[str, slice]:
        """Its faces, as one thing that changes its shape."""
        return {self.name: slice(0, len(self.merged.mesh.faces))}

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Bring it to where it is in a frame; in a lull nothing is written twice.

        Args:
            parameters: Of Mitsuba's scene.
            frame: Says when it is, and which wind blows.
        """
        wind, origin = wind_of(frame), frame.origin
        if wind is None and self._still is not None and np.array_equal(self._still, origin):
            return
        self._still = origin if wind is None else None
        vertices, normals = self._sway.at(frame.time, wind)
        convert.overwrite(parameters, f"{self.name}.vertex_positions", vertices - origin)
        if normals is not None:
            # Otherwise Mitsuba computes other normals from the moved points.
            convert.overwrite(parameters, f"{self.name}.vertex_normals", normals)

    def place_on(self, frame: FrameState, faces: Ints, corners: Floats) -> Floats:
        """Return places on it in the network's coordinates in a frame, (n, 3) [m].

        Args:
            frame: Maybe another one than is shown.
            faces: Numbers among its own, (n,).
            corners: Weights of the faces' second and third corner, (n, 2).
        """
        vertices, _ = self._sway.at(frame.time, wind_of(frame))
        return on_faces(vertices, self.merged.mesh.faces[faces], corners)


def wind_of(frame: FrameState) -> Wind | None:
    """Return the wind that blows in a frame, or None."""
    wind = None if frame.weather is None else frame.weather.wind
    return None if wind is None or wind.speed <= 0.0 else wind


def windswept(data: SceneData) -> list[WindsweptMesh]:
    """Make the meshes of all parts that wind moves."""
    found: list[WindsweptMesh] = []
    for part in data.static:
        if part.id in data.swaying:
            (merged,) = merged_meshes([part.part], data.materials)
            sway = Sway(merged.mesh, data.swaying[part.id])
            found.append(WindsweptMesh(f"windswept_{len(found)}", merged, sway))
    return found
