"""Road users in a merged mesh, whose vertices are written in every frame.

Every body has a fixed number of slots in it. Free ones wait under the ground, and the trees leave
them out. What stays as it was in the frame before is not worked out again.
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
from sumo3dviz_pt.render.compound import (
    METALLIC_ATTRIBUTE,
    ROUGHNESS_ATTRIBUTE,
    Shades,
    face_attributes,
)
from sumo3dviz_pt.render.movers import Materials

_ATTRIBUTES = (convert.TINT_ATTRIBUTE, ROUGHNESS_ATTRIBUTE, METALLIC_ATTRIBUTE)


@dataclass(frozen=True, slots=True, eq=False)
class _MergedBody:
    """One prototype's places in the merged mesh.

    Attributes:
        mesh: The body at rest.
        poses: The shapes that it takes, or None of a rigid one.
        attributes: Values per face, (m, channels), by attribute name.
        shades: What its mover's colours are multiplied with.
        first_vertex: Of its first slot in the merged mesh.
        first_face: Of its first slot in the merged mesh.
        capacity: How many slots it has.
    """

    mesh: Mesh
    poses: Poses | None
    attributes: Mapping[str, Floats]
    shades: Shades
    first_vertex: int
    first_face: int
    capacity: int

    def rows(self, first: int, end: int) -> slice:
        """Return the vertices of some slots in the merged mesh."""
        start, each = self.first_vertex, len(self.mesh.vertices)
        return slice(start + first * each, start + max(first, end) * each)

    def faces(self, first: int, end: int) -> slice:
        """Return the faces of some slots in the merged mesh."""
        start, each = self.first_face, len(self.mesh.faces)
        return slice(start + first * each, start + max(first, end) * each)

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
            shades = Shades.of(parts, scene.materials)
            self._bodies[key] = _MergedBody(mesh, poses, attributes, shades, vertex, face, count)
            vertex += count * len(mesh.vertices)
            face += count * len(mesh.faces)
        self._vertices, self._faces = vertex, face
        self.shown: dict[str, slice] = {}
        self._empty()

    def __bool__(self) -> bool:
        """Return whether the shot ever shows one of them."""
        return self._faces > 0

    def make(self, materials: Materials) -> Any:
        """Make the mesh object; all slots wait out of sight."""
        self._empty()
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

    def _empty(self) -> None:
        """Forget what the mesh holds."""
        self._held: CrowdArrays | None = None
        self._origin: Floats | None = None
        self._used: dict[str, int] = {}
        self._looks: dict[int, tuple[object, object]] = {}

    def arrays(self, movers: Sequence[Mover], origin: Floats) -> CrowdArrays:
        """Find what the mesh holds in a frame; the arrays are written again for the next one.

        Args:
            movers: The road users of that frame.
            origin: The renderer's origin, (3,) [m].

        Raises:
            RenderError: If there are more road users than slots.
        """
        if self._held is None or self._origin is None or (self._origin != origin).any():
            self._empty()
            self._origin = origin
            vertices, normals = np.empty((2, self._vertices, 3))
            self._held = CrowdArrays(
                vertices, normals if self._smooth else None, np.empty((self._faces, 3))
            )
            self._used = {name: body.capacity for name, body in self._bodies.items()}
        used = dict.fromkeys(self._bodies, 0)
        self.shown = {}
        for mover in movers:
            body, slot = self._bodies.get(mover.prototype), used.get(mover.prototype, 0)
            if body is None or slot >= body.capacity:
                self._empty()
                raise RenderError(f"no slot is free for {mover.id} ({mover.prototype})")
            used[mover.prototype] = slot + 1
            self.shown[mover.name] = self._place(self._held, body, slot, mover, origin)
        for name, count in used.items():
            self._free(self._held, self._bodies[name], count, self._used[name], origin)
        self._used = used
        return self._held

    def _place(
        self, held: CrowdArrays, body: _MergedBody, slot: int, mover: Mover, origin: Floats
    ) -> slice:
        """Put a road user into a slot; return its faces."""
        matrix = convert.relative(mover.world_from_body, origin)
        points, directions = body.points(mover)
        rows, faces = body.rows(slot, slot + 1), body.faces(slot, slot + 1)
        held.vertices[rows] = points @ matrix[:3, :3].T + matrix[:3, 3]
        if held.normals is not None:
            held.normals[rows] = (
                [0.0, 0.0, 1.0] if directions is None else _turned(directions, matrix[:3, :3])
            )
        # Those who keep their slots keep their colours.
        look = mover.colour, mover.outfit
        before = self._looks.get(faces.start)
        if before is None or look[0] is not before[0] or look[1] is not before[1]:
            held.tints[faces] = body.shades.coloured(*look)
            self._looks[faces.start] = look
        return faces

    def _free(
        self, held: CrowdArrays, body: _MergedBody, count: int, before: int, origin: Floats
    ) -> None:
        """Let slots of a body wait that are free from now on: those from `count` to `before`."""
        rows, faces = body.rows(count, before), body.faces(count, before)
        held.vertices[rows] = [0.0, 0.0, self._floor - origin[2]]
        if held.normals is not None:
            held.normals[rows] = [0.0, 0.0, 1.0]
        held.tints[faces] = 0.0
        for slot in range(count, before):
            self._looks.pop(body.faces(slot, slot + 1).start, None)

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
        before = self._used
        held = self.arrays(movers, origin)
        if self._used != before:
            hidden = np.ones(self._faces, dtype=np.bool_)
            for name, count in self._used.items():
                hidden[self._bodies[name].faces(0, count)] = False
            convert.hide(parameters, self.name, hidden)
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
