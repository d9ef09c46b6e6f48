"""A scene's objects in Mitsuba, brought to the state of one frame after another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.model.scene import Bsdf, FrameState, LampSet, Mover, SceneData
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.backend import traces_by_optix
from sumo3dviz_pt.render.compound import COMPOUND, MergedMesh, merged_meshes
from sumo3dviz_pt.render.convert import view_parameters
from sumo3dviz_pt.render.crowd import Crowd
from sumo3dviz_pt.render.kernels import load, settle
from sumo3dviz_pt.render.lights.emitter import Glow
from sumo3dviz_pt.render.lights.picks import LampPicks
from sumo3dviz_pt.render.lights.running import RunningLamps
from sumo3dviz_pt.render.lights.standing import Lamps
from sumo3dviz_pt.render.movers import (
    InstancePool,
    Materials,
    Numbers,
    ScalarMovers,
    WindsweptMesh,
    lowest,
    numbered,
    windswept,
)
from sumo3dviz_pt.render.sky.weathered import AirVeil
from sumo3dviz_pt.render.textures import is_worn, wear_attributes

_LEAVES = "principledthin"  # what lets rain through
_PANE = "room_pane"  # material of panes before rooms


@dataclass(frozen=True, slots=True, eq=False)
class HeldMesh:
    """A mesh of a loaded scene.

    Attributes:
        name: What its parameters' names begin with.
        bsdf: Its material, with our own words.
        body: Name of the body that it is a part of, if that is instanced; else empty.
        moving: Whether its vertices differ from frame to frame.
        rooted: Whether it stands where it is, though wind moves its vertices.
        painted: Whether its colour is that of the instance that was hit.
    """

    name: str
    bsdf: Bsdf
    body: str = ""
    moving: bool = False
    rooted: bool = False
    painted: bool = False


class LoadedScene:
    """What the renderer holds of a scene.

    Attributes:
        scene: Mitsuba's, once a frame was shown: of everything, or without what has a scene of
            its own.
        standing: Mitsuba's scene of what stands, where `apart`; else None.
        apart: Whether what stands gets a scene of its own, when it is loaded next. Its tree is
            then not built anew when something moves. Only our own kernel traces two scenes.
        by_shape: Whether hits of instances name the part's own shape, as OptiX does, and not its
            index in the body, as Embree does.
        frame: That frame; None before.
        origin: Its origin in the network's coordinates, (3,) [m]; None before.
        parameters: Of Mitsuba's scene, or both; None before.
        aimed: Whether light paths aim at lamps.
        picks: How lamps shine and are picked; None without lamps, and where nothing compiles.
        running: Lamps and beams of road users.
        pool: Road users that are instanced; None in variants that do not compile.
        weather: Over time, or None.
        tracks: Where wheels have passed, or None.
        ruts: Where lanes are worn down by wheels, or None.
        misty: Whether something in the air ever takes light away.
        sky_changes: Whether the weather changes the sky over time.
        veil: Light of the frame's air, or None.
    """

    def __init__(self, data: SceneData, *, jit: bool) -> None:
        """Lay out everything that moves or shines.

        Args:
            data: The scene; its plugins must be known to the active variant.
            jit: Whether the variant compiles.
        """
        self.scene: Any = None
        self.standing: Any = None
        self.apart, self.by_shape = False, traces_by_optix(mi.variant())
        self.frame: FrameState | None = None
        self.origin: Floats | None = None
        self.parameters: Any = None
        self.picks: LampPicks | None = None
        self.misty = data.weather is not None and data.weather.is_foggy
        self.sky_changes = data.weather is not None and data.weather.changes
        self.veil: AirVeil | None = None
        self._materials = Materials(data.materials)
        lens = self._lens() if data.lamps else None
        self._lamps = Lamps(data.lamps, bsdf=lens, jit=jit, pane=self._pane(data.lamps))
        still = [part.part for part in data.static if part.id not in data.swaying]
        self._static = merged_meshes(still, data.materials)
        self._windswept = windswept(data)
        floor = lowest([merged.mesh for merged in self._standing()])
        self.weather, self.tracks, self.ruts = data.weather, data.tracks, data.ruts
        self.running = RunningLamps(data, floor=floor, jit=jit)
        far = Crowd("far_traffic", data, data.slots.far, far=True, floor=floor)
        self._crowds = (far, Crowd("deforming", data, data.slots.deforming, far=False, floor=floor))
        self.pool = InstancePool(data, self._materials, floor=floor) if jit else None
        self._scalar = None if jit else ScalarMovers(data, self._materials)
        running = data.running is not None and data.running.sampled
        self.aimed = running or any(lamps.sampled for lamps in data.lamps)

    def drop(self) -> None:
        """Let the scene go; the next frame loads it again."""
        self.scene = self.standing = self.parameters = self.picks = None

    def close(self) -> None:
        """Give every object back."""
        self.drop()
        self.pool = self._scalar = None
        self._lamps = Lamps((), bsdf=None, jit=False)
        self._materials = Materials({})

    def meshes(self) -> Iterator[HeldMesh]:
        """Go through all meshes but the sun's, if that is one."""
        for number, merged in enumerate(self._static):
            yield HeldMesh(f"static_{number}", self._materials.bsdf(merged.material))
        for plants in self._windswept:
            bsdf = self._materials.bsdf(plants.merged.material)
            yield HeldMesh(plants.name, bsdf, moving=True, rooted=True)
        for crowd in self._crowds:
            if crowd:
                yield HeldMesh(crowd.name, COMPOUND, moving=True)
        for name in (*self._lamps.names, *self.running.names):
            moving = name in self.running.names
            pane = _PANE in self._materials.dicts and self._lamps.is_pane(name)
            bsdf = self._materials.bsdf(_PANE if pane else "signal_lens")
            yield HeldMesh(name, bsdf, moving=moving)
        for body, meshes in self.pool.bodies.items() if self.pool is not None else ():
            for number, (material, painted) in enumerate(meshes):
                bsdf = self._materials.bsdf(material)
                name = f"{body}.part{number}"
                yield HeldMesh(name, bsdf, body=body, painted=painted)

    def shelters(self) -> list[Mesh]:
        """Return all that stands and keeps rain off, in the network's coordinates."""
        return [
            merged.mesh
            for merged in self._standing()
            if self._materials.bsdf(merged.material).get("type") != _LEAVES
        ]

    def _standing(self) -> Iterator[MergedMesh]:
        """Go through all that stands, plants in wind at rest."""
        yield from self._static
        yield from (plants.merged for plants in self._windswept)

    def show(self, frame: FrameState, fixed: Mapping[str, Any]) -> None:
        """Bring the scene to a frame's state.

        Args:
            frame: What differs from frame to frame.
            fixed: Sensors and lights by name, as plugin dicts or objects; only read where
                the scene is loaded: `sensor` and `guide` see what the frame's view does.
        """
        self.frame = frame
        if self.scene is None or self._scalar is not None:
            self._load(frame, fixed)
            return
        if self.origin is None or not np.array_equal(self.origin, frame.origin):
            self._recentre(frame.origin)
        self._move(self.parameters, frame)

    def numbers(self) -> Numbers:
        """Number what moves in the frame that is shown."""
        frame = self.frame
        assert frame is not None, "show a frame first"
        rigid: list[Mover] = [*frame.instanced]
        deforming: list[Mover] = []
        for crowd, movers in zip(self._crowds, (frame.far, frame.deforming), strict=True):
            for mover in movers:
                (rigid if crowd.is_rigid(mover.prototype) else deforming).append(mover)
        return numbered(rigid, deforming, plants=[plants.name for plants in self._windswept])

    @property
    def shown(self) -> Mapping[str, Mapping[str, slice]]:
        """Faces of what is shown by merged meshes, by mesh, then by name."""
        crowds = {crowd.name: crowd.shown for crowd in self._crowds if crowd}
        return {**crowds, **self.running.shown}

    @property
    def numbered_faces(self) -> Mapping[str, Mapping[str, slice]]:
        """The same, and plants in wind: all faces that have a moving part's number."""
        return {**self.shown, **{plants.name: plants.shown for plants in self._windswept}}

    def glows(self) -> dict[str, Glow]:
        """Return how all meshes of lamps shine in the frame that is shown, by name."""
        assert self.frame is not None, "show a frame first"
        return {**self._lamps.glows(self.frame), **self.running.glows()}

    def shining(self) -> Floats:
        """Return the corners of all faces of lamps that shine, as Mitsuba has them, (n, 3, 3) [m].

        They are relative to the origin.
        """
        assert self.frame is not None, "show a frame first"
        corners = [*self._lamps.shining(self.frame), *self.running.shining()]
        return np.concatenate([np.zeros((0, 3, 3)), *(c.astype(np.float32) for c in corners)])

    @property
    def most_lamps(self) -> int:
        """How many lamps there may be that paths aim at."""
        return self._lamps.most + self.running.most

    def takes_poses(self, mover: Mover) -> bool:
        """Return whether a mover of the frame that is shown takes poses there."""
        crowd = self._crowd_of(mover)
        return crowd is not None and not crowd.is_rigid(mover.prototype)

    def place_on(self, mover: Mover, faces: Ints, corners: Floats) -> Floats:
        """Return places on a mover's body in the network's coordinates, (n, 3) [m].

        Args:
            mover: Shown in the frame that is shown, here maybe in its pose of another one.
            faces: Numbers among its body's, (n,).
            corners: Weights of the faces' second and third corner, (n, 2).
        """
        crowd = self._crowd_of(mover)
        assert crowd is not None, "is not in a merged mesh"
        return crowd.place_on(mover, faces, corners)

    def _crowd_of(self, mover: Mover) -> Crowd | None:
        """Return the merged mesh that shows a mover, or None."""
        return next((crowd for crowd in self._crowds if mover.name in crowd.shown), None)

    @property
    def _moves(self) -> bool:
        """Whether anything of the shot ever moves or changes."""
        pooled = self.pool is not None and bool(self.pool.entries)
        return pooled or bool(self.running) or any(map(bool, (*self._crowds, self._windswept)))

    def shapes(self) -> Iterator[Any]:
        """Go through Mitsuba's shapes of the scene, or both."""
        for scene in (self.scene, self.standing):
            yield from () if scene is None else scene.shapes()

    def plants(self, mesh: str) -> WindsweptMesh | None:
        """Return the plants of a mesh that wind moves, by its name; None if it is no such mesh."""
        return next((plants for plants in self._windswept if plants.name == mesh), None)

    def things(self, mesh: str) -> tuple[tuple[str, int], ...]:
        """Return what the faces of a mesh that stands belong to; see `Mesh.things`."""
        for number, merged in enumerate(self._static):
            if mesh == f"static_{number}":
                return merged.mesh.things
        plants = self.plants(mesh)
        if plants is not None:
            return plants.merged.mesh.things
        return self._lamps.things(mesh)

    def _load(self, frame: FrameState, fixed: Mapping[str, Any]) -> None:
        """Put the scene together around a frame's origin."""
        self.drop()
        self.origin = frame.origin
        parts = {name: load(it) if isinstance(it, dict) else it for name, it in fixed.items()}
        standing = {
            f"static_{number}": self._place(merged, f"static_{number}", frame.origin)
            for number, merged in enumerate(self._static)
        }
        for plants in self._windswept:
            parts[plants.name] = self._place(plants.merged, plants.name, frame.origin)
        parts |= self._lamps.entries(frame.origin)
        if self.running:
            parts |= self.running.entries(self._lens())
        parts |= {crowd.name: crowd.make(self._materials) for crowd in self._crowds if crowd}
        if self.pool is not None:
            parts |= self.pool.entries
            standing |= self.pool.rooted
        if self._scalar is not None:
            parts |= self._scalar.entries(frame)
        else:
            self.picks = self._picks_of(parts)
        # Everything is moved to its place before there is a scene, whose trees are so built once.
        rooted = {} if self.pool is None else self.pool.rooted
        self._move(mi.traverse(_Parts({**parts, **rooted})), frame)
        apart = self.apart and self._moves and any(len(m.mesh.faces) for m in self._static)
        if not apart:
            parts |= standing
        self.scene = load({"type": "scene", **parts}, optimize=False)
        self.standing = load({"type": "scene", **standing}, optimize=False) if apart else None
        scenes = [scene for scene in (self.scene, self.standing) if scene is not None]
        self.parameters = Parameters([mi.traverse(scene) for scene in scenes])
        for sensor in self.scene.sensors():
            settle(sensor)

    def _picks_of(self, parts: Mapping[str, Any]) -> LampPicks | None:
        """Make the arrays of all lamps, and tell them to the emitters of their meshes."""
        # Panes are worn and so come first, as in the kernel's tables.
        names = sorted(self._lamps.names, key=lambda name: not self._lamps.is_pane(name))
        emitters = {name: parts[name].emitter() for name in (*names, *self.running.names)}
        if not emitters:
            return None
        wet = self.weather is not None and self.weather.is_wet
        picks = LampPicks({name: each.sizes for name, each in emitters.items()}, wet=wet)
        for number, emitter in enumerate(emitters.values()):
            emitter.picks, emitter.number = picks, dr.opaque(mi.UInt32, number)
        return picks

    def _move(self, parameters: Any, frame: FrameState) -> None:
        """Bring everything that is not fixed to a frame's state."""
        seen = view_parameters(frame.view, frame.origin)
        for sensor in ("sensor", "guide"):
            for name, value in seen.items():
                parameters[f"{sensor}.{name}"] = value
        if self.pool is not None:
            self.pool.update(parameters, frame)
        for crowd, movers in zip(self._crowds, (frame.far, frame.deforming), strict=True):
            if crowd:
                crowd.update(parameters, movers, frame.origin)
        for plants in self._windswept:
            plants.update(parameters, frame)
        self._lamps.update(parameters, frame)
        self.running.update(parameters, frame)
        if self.picks is not None:
            self.picks.follow(self.glows(), frame)
        parameters.update()

    def _recentre(self, origin: Floats) -> None:
        """Move everything static; nothing compiles, and the trees are rebuilt anyway."""
        for number, merged in enumerate(self._static):
            convert.shift(self.parameters, f"static_{number}", merged.mesh, origin)
        self._lamps.recentre(self.parameters, origin)
        self.origin = origin

    def _place(self, merged: MergedMesh, name: str, origin: Floats) -> Any:
        """Return a static mesh relative to an origin."""
        mesh = replace(merged.mesh, vertices=merged.mesh.vertices - origin)
        bsdf = self._materials.get(merged.material, convert.face_tint(), worn=is_worn(mesh))
        wear = wear_attributes(self._materials.dicts.get(merged.material, {}), mesh)
        attributes = {**merged.attributes, **wear}
        return convert.make_mesh(name, mesh, bsdf=bsdf, attributes=attributes)

    def _pane(self, lamps: Sequence[LampSet]) -> Any:
        """Return the material of panes before lit rooms; None where there are none."""
        lit = any(some.mesh.wear is not None for some in lamps)
        if not lit or _PANE not in self._materials.dicts:
            return None
        return self._materials.get(_PANE, convert.face_tint())

    def _lens(self) -> Any:
        """Return the material of the lamps' glass."""
        return self._materials.get("signal_lens", convert.face_tint())


class Parameters:
    """Parameters of one or two scenes of Mitsuba's, whose objects have different names."""

    def __init__(self, scenes: Sequence[Any]) -> None:
        """Join them.

        Args:
            scenes: What `mi.traverse` found of each; those of what moves most come first.
        """
        self._scenes = scenes

    def _of(self, key: str) -> Any:
        """Return the parameters that have a name; the first ones if none has."""
        return next((scene for scene in self._scenes if key in scene), self._scenes[0])

    def __contains__(self, key: str) -> bool:
        """Return whether any scene has a parameter of a name."""
        return any(key in scene for scene in self._scenes)

    def __getitem__(self, key: str) -> Any:
        """Return a parameter."""
        return self._of(key)[key]

    def __setitem__(self, key: str, value: Any) -> None:
        """Change a parameter; the scene follows when it is updated."""
        self._of(key)[key] = value

    def set_dirty(self, key: str) -> None:
        """Say that a parameter's values were written where they lie."""
        self._of(key).set_dirty(key)

    def keys(self) -> Iterator[str]:
        """Go through all names."""
        for scene in self._scenes:
            yield from scene.keys()

    def update(self) -> None:
        """Let the scenes follow; where nothing changed, nothing is done."""
        for scene in self._scenes:
            scene.update()


class _Parts:
    """Objects by name that are no scene yet; `mi.traverse` takes them for one."""

    def __init__(self, parts: Mapping[str, Any]) -> None:
        self._parts = parts

    def traverse(self, callback: Any) -> None:
        """Tell Mitsuba of every part."""
        for name, part in self._parts.items():
            callback.put(name, part, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys: list[str]) -> None:
        """Do nothing: there is no scene yet that would have to follow."""
