"""What moves in the renderer: road users, crowds, plants in the wind.

For near road users in JIT variants a fixed pool of `instance` shapes is moved by `to_world`, so
that nothing compiles during a film; free slots wait under the ground. In scalar variants instances
are cheap and Python textures are not: the scene is put together anew for every frame from kept
parts, one shape group per (body, colour).

Far road users, and those that take poses, are one mesh whose vertices are updated. Every body has a
fixed number of slots in it, and free ones wait under the ground, too. Plants that wind moves are
meshes whose vertices and normals are written in every frame.

Everything that moves in a frame has a number, so that pictures can say what each pixel shows.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, on_faces
from sumo3dviz_pt.model.layers import MovingPart
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import (
    Bsdf,
    FrameState,
    Mover,
    Prototype,
    SceneData,
    is_tinted,
)
from sumo3dviz_pt.model.swaying import Sway
from sumo3dviz_pt.model.weather import Wind
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.compound import (
    COMPOUND,
    MergedMesh,
    merged_meshes,
)
from sumo3dviz_pt.render.kernels import load
from sumo3dviz_pt.render.paint import colour_table, table_index
from sumo3dviz_pt.render.textures import wear_attributes


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """What moves in a frame; the k-th part, from 1, has number k.

    Attributes:
        parts: All of them.
        by_name: Number of each, by its name.
    """

    parts: tuple[MovingPart, ...]
    by_name: Mapping[str, int]

    def of_faces(self, count: int, shown: Mapping[str, slice]) -> NDArray[np.float32]:
        """Return the number that each face of a merged mesh belongs to, 0 for free ones, (count,).

        Args:
            count: The mesh's faces.
            shown: Faces of each part, by its name.
        """
        numbers = np.zeros(count, np.float32)
        for name, faces in shown.items():
            numbers[faces] = self.by_name[name]
        return numbers


def numbered(
    rigid: Iterable[Mover], deforming: Iterable[Mover], *, plants: Iterable[str] = ()
) -> Numbers:
    """Number what moves.

    Args:
        rigid: What keeps its shape.
        deforming: What does not, as walking people.
        plants: Names of meshes that wind moves; they have no shape to keep either.
    """
    parts = [MovingPart(mover.name, mover.world_from_body) for mover in rigid]
    parts += [MovingPart(name, None) for name in (*(each.name for each in deforming), *plants)]
    return Numbers(tuple(parts), {part.name: k + 1 for k, part in enumerate(parts)})


class Materials:
    """BSDF objects of a scene, made when first asked for."""

    def __init__(self, materials: Mapping[str, Any]) -> None:
        self.dicts = materials
        self._made: dict[tuple[Any, ...], Any] = {}

    def bsdf(self, name: str) -> Bsdf:
        """Return a material's dict; the name is as in `get`."""
        return self.dicts[name] if name else COMPOUND

    def get(self, name: str, tint: Mapping[str, Any], *, worn: bool = False) -> Any:
        """Return a material, made at its first use.

        Args:
            name: Of the scene's materials; empty is the compound of all plain ones.
            tint: Where its colour comes from, as a plugin dict.
            worn: Whether it is for a worn or painted mesh.
        """
        bsdf = self.bsdf(name)
        worn = worn and "scalar" in mi.variant()
        key = (name, repr(sorted(tint.items())) if is_tinted(bsdf) else "", worn)
        if key not in self._made:
            self._made[key] = convert.make_bsdf(bsdf, tint=tint, worn=worn)
        return self._made[key]


def body_meshes(prototype: Prototype, materials: Materials) -> list[MergedMesh]:
    """Merge the parts of a detailed body whose tint is its mover's colour."""
    return merged_meshes(prototype.parts, materials.dicts, own_tint=False)


def shape_group(
    prototype: Prototype, meshes: Sequence[MergedMesh], materials: Materials, tint: Bsdf
) -> tuple[Any, list[Any]]:
    """Make the detailed body of a prototype, ready to be instanced, and its meshes in order.

    Args:
        prototype: The body.
        meshes: Its meshes.
        materials: Of the scene.
        tint: Where its colour comes from, as a plugin dict.
    """
    group: dict[str, Any] = {"type": "shapegroup"}
    made = []
    for index, merged in enumerate(meshes):
        bsdf = materials.get(merged.material, tint if merged.painted else convert.face_tint())
        name = f"{prototype.name}_{index}"
        wear = wear_attributes(materials.dicts.get(merged.material, {}), merged.mesh)
        attributes = {**merged.attributes, **wear}
        made.append(convert.make_mesh(name, merged.mesh, bsdf=bsdf, attributes=attributes))
        group[f"part{index}"] = made[-1]
    return load(group), made


_LEAST_USE = 1.0 / 64.0
"""Use of a road user; less is of who never moves."""


def _use(mover: Mover) -> float:
    """Return what is random in a road user beside its paint, [0, 1), the same in all frames."""
    return 0.0 if mover.parked else max(share_of(0, mover.id, "use"), _LEAST_USE)


class InstancePool:
    """Near road users as instances in fixed slots (JIT variants).

    Args:
        scene: Holds the bodies and how many of each there can be.
        materials: Of the scene.
        floor: Height where free slots wait [m].

    Attributes:
        bodies: Material of each body's meshes, and whether its colour is its mover's, by the
            body's name in the scene.
        parts: Mitsuba's shapes of each body's meshes, by the body's name in the scene.
        body_of_slot: Name of the body that a slot shows, by the slot's name.
        placed: Placement relative to the renderer's origin, (4, 4), and colour, flop and use, (5,),
            by slot.
        shown: Names of what slots show in this frame, by slot; free ones are not there.
        parked: Slots that show who never moves.
        entries: Shapes to put into the scene, of bodies that move.
        rooted: The same of bodies that stand.
    """

    def __init__(self, scene: SceneData, materials: Materials, *, floor: float) -> None:
        self._floor = floor
        self.bodies: dict[str, tuple[tuple[str, bool], ...]] = {}
        self.parts: dict[str, list[Any]] = {}
        self.body_of_slot: dict[str, str] = {}
        self.placed: dict[str, tuple[Floats, Floats]] = {}
        self.shown: dict[str, str] = {}
        self.parked: frozenset[str] = frozenset()
        self.entries: dict[str, Any] = {}
        self.rooted: dict[str, Any] = {}
        self._slots: dict[str, list[str]] = defaultdict(list)
        self._index: dict[str, int] = {}
        number = 0
        for name, count in sorted(scene.slots.near.items()):
            body, prototype = f"body_{len(self._slots)}", scene.prototypes[name]
            meshes = body_meshes(prototype, materials)
            group, shapes = shape_group(prototype, meshes, materials, convert.instance_tint())
            entries = self.rooted if prototype.rooted else self.entries
            entries[body] = group
            self.parts[body] = shapes
            self.bodies[body] = tuple((mesh.material, mesh.painted) for mesh in meshes)
            for _ in range(count):
                key = f"slot_{number:04d}"
                entries[key] = load({"type": "instance", "body": group})
                self._slots[name].append(key)
                self.body_of_slot[key] = body
                self._index[key] = table_index(entries[key])
                number += 1
        self._keys = tuple(self._index)
        self._used: frozenset[str] = frozenset(self.parts)
        # Nothing equals these, so every slot is moved at first.
        self._held = np.full((number, 4, 4), np.nan, np.float32)

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Move every slot to its road user of this frame, or out of sight."""
        if not self._index:
            return
        taken = self._taken(frame.instanced)
        self.shown = {key: mover.name for key, mover in taken.items()}
        self.parked = frozenset(key for key, mover in taken.items() if mover.parked)
        places = self._places(taken, frame.origin)
        self._move(parameters, places)
        self._hide(parameters, frozenset(self.body_of_slot[key] for key in taken))
        colours = {
            key: np.array([*mover.colour, mover.flop, _use(mover)]) for key, mover in taken.items()
        }
        grey = np.array([0.5, 0.5, 0.5, 0.0, 0.0])
        self.placed = {
            key: (place, colours.get(key, grey))
            for key, place in zip(self._keys, places, strict=True)
        }
        table = colour_table({self._index[key]: colour[:4] for key, colour in colours.items()})
        for name in parameters.keys():  # noqa: SIM118 - a SceneParameters object has no iterator
            if name.endswith(".table"):
                convert.overwrite(parameters, name, table)

    def _hide(self, parameters: Any, used: frozenset[str]) -> None:
        """Leave bodies that nobody shows out of the trees, which are built anew in every frame."""
        for body in (used ^ self._used) & self.entries.keys():
            for number, shape in enumerate(self.parts[body]):
                hidden = np.full(shape.face_count(), body not in used)
                convert.hide(parameters, f"{body}.part{number}", hidden)
        self._used = used

    def _taken(self, movers: Sequence[Mover]) -> dict[str, Mover]:
        """Return what each slot shows that is not free, by its name.

        Raises:
            RenderError: If there are more road users than slots.
        """
        free = {name: iter(keys) for name, keys in self._slots.items()}
        taken = {}
        for mover in movers:
            key = next(free[mover.prototype], None) if mover.prototype in free else None
            if key is None:
                raise RenderError(f"no slot is free for {mover.id} ({mover.prototype})")
            taken[key] = mover
        return taken

    def _places(self, taken: Mapping[str, Mover], origin: Floats) -> Floats:
        """Return the placement of every slot relative to the renderer's origin, (slots, 4, 4)."""
        places = np.tile(np.eye(4), (len(self._keys), 1, 1))
        places[:, 2, 3] = self._floor - origin[2]
        rows = [row for row, key in enumerate(self._keys) if key in taken]
        if rows:
            matrices = [taken[self._keys[row]].world_from_body.matrix for row in rows]
            places[rows] = matrices
            places[rows, :3, 3] -= origin
        return places

    def _move(self, parameters: Any, places: Floats) -> None:
        """Tell Mitsuba of slots whose placement is another than before.

        Each costs more than all that we do for it; what stands, or is free, costs nothing.
        """
        wanted = places.astype(np.float32)
        for row in np.flatnonzero((wanted != self._held).any(axis=(1, 2))).tolist():
            parameters[f"{self._keys[row]}.to_world"] = mi.Transform4f(wanted[row])
        self._held = wanted


class ScalarMovers:
    """Near road users where every frame is a new scene (scalar variants)."""

    def __init__(self, scene: SceneData, materials: Materials) -> None:
        self._scene, self._materials = scene, materials
        self._groups: dict[tuple[str, tuple[float, ...]], Any] = {}

    def entries(self, frame: FrameState) -> dict[str, Any]:
        """Shapes of this frame."""
        shapes: dict[str, Any] = {}
        for number, mover in enumerate(frame.instanced):
            group = self._group(mover)
            shapes[f"body_{id(group)}"] = group
            matrix = convert.relative(mover.world_from_body, frame.origin)
            shapes[f"slot_{number:04d}"] = load(
                {"type": "instance", "to_world": convert.scalar_transform(matrix), "body": group}
            )
        return shapes

    def _group(self, mover: Mover) -> Any:
        """Return a road user's body in its colour."""
        key = (mover.prototype, tuple(mover.colour))
        if key not in self._groups:
            prototype = self._scene.prototypes[mover.prototype]
            tint = convert.constant_tint(mover.colour)
            meshes = body_meshes(prototype, self._materials)
            self._groups[key], _ = shape_group(prototype, meshes, self._materials, tint)
        return self._groups[key]


def lowest(meshes: Sequence[Mesh]) -> float:
    """Return the height where free slots wait: below everything [m]."""
    heights = [float(mesh.vertices[:, 2].min()) for mesh in meshes if len(mesh.vertices)]
    return min(heights, default=0.0) - 10.0


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
    meshes: list[WindsweptMesh] = []
    for part in data.static:
        if part.id in data.swaying:
            (merged,) = merged_meshes([part.part], data.materials)
            sway = Sway(merged.mesh, data.swaying[part.id])
            meshes.append(WindsweptMesh(f"windswept_{len(meshes)}", merged, sway))
    return meshes
