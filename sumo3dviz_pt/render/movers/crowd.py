"""Road users as one mesh whose vertices are updated: far ones, and those that take poses.

Every body has a fixed number of slots in the mesh; free ones wait under the ground.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, merge_meshes, on_faces
from sumo3dviz_pt.model.scene import Mover, Part, Poses, SceneData
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.materials.compound import (
    METALLIC_ATTRIBUTE,
    ROUGHNESS_ATTRIBUTE,
    face_attributes,
    tint_mask,
)
from sumo3dviz_pt.render.movers.build import Materials

_ATTRIBUTES = (convert.TINT_ATTRIBUTE, ROUGHNESS_ATTRIBUTE, METALLIC_ATTRIBUTE)


@dataclass(frozen=True, slots=True, eq=False)
class _MergedBody:
    """One prototype's places in the merged mesh.

    Attributes:
        mesh: The body at rest.
        poses: The shapes that it takes, or None of a rigid one.
        attributes: Values per face, (m, channels), by attribute name.
        mask: 1 for faces that take their mover's colour, else 0, (m,).
        first_vertex: Of its first slot in the merged mesh.
        first_face: Of its first slot in the merged mesh.
        capacity: How many slots it has.
    """

    mesh: Mesh
    poses: Poses | None
    attributes: Mapping[str, Floats]
    mask: Floats
    first_vertex: int
    first_face: int
    capacity: int

    def points(self, mover: Mover) -> tuple[Floats, Floats | None]:
        """Return vertices and normals in the pose of a road user, (v, 3) each."""
        if self.poses is None:
            return self.mesh.vertices, self.mesh.normals
        return _in_pose(self.poses.vertices, mover), _in_pose(self.poses.normals, mover)


def _in_pose(poses: Floats, mover: Mover) -> Floats:
    """Interpolate between the two nearest phases, and between rest and movement, (v, 3)."""
    count = len(poses) - 1
    place = (mover.phase % 1.0) * count
    first = int(place) % count
    share = place - int(place)
    moving = (1.0 - share) * poses[1 + first] + share * poses[1 + (first + 1) % count]
    return np.asarray((1.0 - mover.effort) * poses[0] + mover.effort * moving)


@dataclass(frozen=True, slots=True, eq=False)
class CrowdArrays:
    """What a crowd's mesh holds in one frame.

    Attributes:
        vertices: Relative to the renderer's origin, (n, 3) [m].
        normals: Unit, of smooth bodies, (n, 3); None of flat ones.
        tints: Reflectances of the faces, (m, 3).
    """

    vertices: Floats
    normals: Floats | None
    tints: Floats


class Crowd:
    """Road users merged into one mesh, with a fixed number of slots for each body.

    Attributes:
        name: Of the mesh.
        shown: Faces of each road user that is shown in this frame, by its name.
    """

    def __init__(
        self, name: str, scene: SceneData, slots: Mapping[str, int], *, far: bool, floor: float
    ) -> None:
        """Lay the mesh out.

        Args:
            name: Of the mesh.
            scene: Holds prototypes and materials.
            slots: How many of each prototype.
            far: Whether stand-ins are drawn, flat, or detailed bodies, smooth.
            floor: Where free slots wait [m].
        """
        self.name, self._floor, self._smooth = name, floor, not far
        self._bodies: dict[str, _MergedBody] = {}
        vertex = face = 0
        for key, count in sorted(slots.items()):
            prototype = scene.prototypes[key]
            parts = prototype.far if far else prototype.parts
            mesh = _merged(parts, smooth=self._smooth)
            poses = prototype.far_poses if far else prototype.poses
            attributes = face_attributes(parts, scene.materials, compound=True)
            mask = tint_mask(parts, scene.materials)
            self._bodies[key] = _MergedBody(mesh, poses, attributes, mask, vertex, face, count)
            vertex += count * len(mesh.vertices)
            face += count * len(mesh.faces)
        self._vertices, self._faces = vertex, face
        self.shown: dict[str, slice] = {}

    def __bool__(self) -> bool:
        """Return whether the shot ever shows one of them."""
        return self._faces > 0

    def make(self, materials: Materials) -> Any:
        """Make the mesh object; all slots wait out of sight."""
        bodies = self._bodies.values()
        faces = [
            body.mesh.faces + body.first_vertex + slot * len(body.mesh.vertices)
            for body in bodies
            for slot in range(body.capacity)
        ]
        attributes = {
            name: np.concatenate(
                [np.tile(body.attributes[name], (body.capacity, 1)) for body in bodies]
            )
            for name in _ATTRIBUTES
        }
        normals = np.tile([0.0, 0.0, 1.0], (self._vertices, 1)) if self._smooth else None
        places = np.full((self._vertices, 3), self._floor)
        mesh = Mesh(places, np.concatenate(faces), normals)
        bsdf = materials.get("", convert.face_tint())
        return convert.make_mesh(self.name, mesh, bsdf=bsdf, attributes=attributes)

    def arrays(self, movers: Sequence[Mover], origin: Floats) -> CrowdArrays:
        """Find what the mesh holds in a frame.

        Args:
            movers: The road users of that frame.
            origin: The renderer's origin, (3,) [m].

        Raises:
            RenderError: If there are more road users than slots.
        """
        vertices = np.tile([0.0, 0.0, self._floor - origin[2]], (self._vertices, 1))
        normals = np.tile([0.0, 0.0, 1.0], (self._vertices, 1)) if self._smooth else None
        tints = np.zeros((self._faces, 3))
        used = dict.fromkeys(self._bodies, 0)
        self.shown = {}
        for mover in movers:
            body, slot = self._bodies.get(mover.prototype), used.get(mover.prototype, 0)
            if body is None or slot >= body.capacity:
                raise RenderError(f"no slot is free for {mover.id} ({mover.prototype})")
            used[mover.prototype] = slot + 1
            matrix = convert.relative(mover.world_from_body, origin)
            points, directions = body.points(mover)
            first = body.first_vertex + slot * len(points)
            vertices[first : first + len(points)] = points @ matrix[:3, :3].T + matrix[:3, 3]
            if normals is not None and directions is not None:
                normals[first : first + len(points)] = _turned(directions, matrix[:3, :3])
            first = body.first_face + slot * len(body.mask)
            self.shown[mover.name] = slice(first, first + len(body.mask))
            mask = body.mask[:, None]
            own = body.attributes[convert.TINT_ATTRIBUTE] * (1.0 - mask)
            tints[first : first + len(mask)] = own + np.asarray(mover.colour) * mask
        return CrowdArrays(vertices, normals, tints)

    def is_rigid(self, prototype: str) -> bool:
        """Return whether movers of a prototype keep their shape here."""
        poses = self._bodies[prototype].poses
        return poses is None or poses.steady

    def place_on(self, mover: Mover, faces: Ints, corners: Floats) -> Floats:
        """Return places on a mover's body in the network's coordinates, (n, 3) [m].

        Args:
            mover: Says where the body is, and its pose.
            faces: Numbers among the body's, (n,).
            corners: Weights of the faces' second and third corner, (n, 2).
        """
        body = self._bodies[mover.prototype]
        vertices, _ = body.points(mover)
        places = on_faces(vertices, body.mesh.faces[faces], corners)
        return mover.world_from_body.points(places)

    def update(self, parameters: Any, movers: Sequence[Mover], origin: Floats) -> None:
        """Move everyone to their places in a frame.

        Args:
            parameters: Of Mitsuba's scene.
            movers: The road users of that frame.
            origin: The renderer's origin, (3,) [m].
        """
        held = self.arrays(movers, origin)
        convert.overwrite(parameters, f"{self.name}.vertex_positions", held.vertices)
        if held.normals is not None:
            convert.overwrite(parameters, f"{self.name}.vertex_normals", held.normals)
        convert.overwrite(parameters, f"{self.name}.{convert.TINT_ATTRIBUTE}", held.tints)


def _merged(parts: Sequence[Part], *, smooth: bool) -> Mesh:
    """Return all parts as one mesh, flat or smooth."""
    meshes = [part.mesh for part in parts]
    if not smooth or any(mesh.normals is None for mesh in meshes):
        return merge_meshes([Mesh(mesh.vertices, mesh.faces) for mesh in meshes])
    return merge_meshes([Mesh(mesh.vertices, mesh.faces, mesh.normals) for mesh in meshes])


def _turned(normals: Floats, matrix: Floats) -> Floats:
    """Turn and stretch unit normals, by the inverse transpose; they stay unit."""
    turned = normals @ np.linalg.inv(matrix)
    return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))
