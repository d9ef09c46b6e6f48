"""Road users in the renderer.

In JIT variants a fixed pool of `instance` shapes is moved by `to_world`, so that
nothing compiles during a film; free slots wait under the ground. In scalar variants
instances are cheap and Python textures are not: the scene is put together anew for
every frame from kept parts, one shape group per (body, colour).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Bsdf, FrameState, Mover, Prototype, SceneData, is_tinted
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.kernels import load
from sumo3dviz_pt.render.materials.compound import COMPOUND, MergedMesh, merged_meshes
from sumo3dviz_pt.render.materials.paint import colour_table, table_index


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
        attributes = {
            name: values
            for name, values in merged.attributes.items()
            if name != convert.TINT_ATTRIBUTE or not merged.material
        }
        bsdf = materials.get(merged.material, tint)
        name = f"{prototype.name}_{index}"
        made.append(convert.make_mesh(name, merged.mesh, bsdf=bsdf, attributes=attributes))
        group[f"part{index}"] = made[-1]
    return load(group), made


class InstancePool:
    """Near road users as instances in fixed slots (JIT variants).

    Args:
        scene: Holds the bodies and how many of each there can be.
        materials: Of the scene.
        floor: Height where free slots wait [m].

    Attributes:
        bodies: Names of the materials of each body's meshes, by the body's name in the scene.
        parts: Mitsuba's shapes of each body's meshes, by the body's name in the scene.
        body_of_slot: Name of the body that a slot shows, by the slot's name.
        placed: Placement relative to the renderer's origin, (4, 4), and colour, by slot.
        shown: Names of what slots show in this frame, by slot; free ones are not there.
        parked: Slots that show who never moves.
    """

    def __init__(self, scene: SceneData, materials: Materials, *, floor: float) -> None:
        self._floor = floor
        self.bodies: dict[str, tuple[str, ...]] = {}
        self.parts: dict[str, list[Any]] = {}
        self.body_of_slot: dict[str, str] = {}
        self.placed: dict[str, tuple[Floats, Floats]] = {}
        self.shown: dict[str, str] = {}
        self.parked: frozenset[str] = frozenset()
        self._entries: dict[str, Any] = {}
        self._slots: dict[str, list[str]] = defaultdict(list)
        self._index: dict[str, int] = {}
        number = 0
        for name, count in sorted(scene.slots.near.items()):
            body, prototype = f"body_{len(self._slots)}", scene.prototypes[name]
            meshes = body_meshes(prototype, materials)
            group, shapes = shape_group(prototype, meshes, materials, convert.instance_tint())
            self._entries[body] = group
            self.parts[body] = shapes
            self.bodies[body] = tuple(mesh.material for mesh in meshes)
            for _ in range(count):
                key = f"slot_{number:04d}"
                self._entries[key] = load({"type": "instance", "body": group})
                self._slots[name].append(key)
                self.body_of_slot[key] = body
                self._index[key] = table_index(self._entries[key])
                number += 1
        self._keys = tuple(self._index)
        # Nothing equals these, so every slot is moved at first.
        self._held = np.full((number, 4, 4), np.nan, np.float32)

    @property
    def entries(self) -> Mapping[str, Any]:
        """Shapes to put into the scene."""
        return self._entries

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Move every slot to its road user of this frame, or out of sight."""
        if not self._index:
            return
        taken = self._taken(frame.instanced)
        self.shown = {key: mover.name for key, mover in taken.items()}
        self.parked = frozenset(key for key, mover in taken.items() if mover.parked)
        places = self._places(taken, frame.origin)
        self._move(parameters, places)
        colours = {key: np.asarray(mover.colour) for key, mover in taken.items()}
        grey = np.full(3, 0.5)
        self.placed = {
            key: (place, colours.get(key, grey))
            for key, place in zip(self._keys, places, strict=True)
        }
        table = colour_table({self._index[key]: colour for key, colour in colours.items()})
        for name in parameters.keys():  # noqa: SIM118 - a SceneParameters object has no iterator
            if name.endswith(".table"):
                convert.overwrite(parameters, name, table)

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
