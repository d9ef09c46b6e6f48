"""Lamps of vehicles: glowing lenses as two meshes, and beams of the nearest head lamps.

Emitters cannot be instanced. So all lenses are merged into two meshes, near and far, whose vertices
and radiances are updated in every frame; lamps that are off have no area. Beams are a fixed number
of spots that light the road.

How often paths aim at each was measured: noise, relative to the picture, is least where an
emitter is picked in proportion to the root of its light's second moment.

Lamps are placed on our detailed body. Stand-ins for far away are blunter, stretched and simplified,
and a user's own body has another form. So lamps are moved out of bodies that they would be hidden
in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, Transform
from sumo3dviz_pt.model.scene import (
    LENS_THAT_SHINES,
    Beam,
    FrameState,
    Lobe,
    Mover,
    Part,
    Prototype,
    RunningLights,
    SceneData,
    VehicleLamp,
    View,
)
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.kernels import load
from sumo3dviz_pt.render.lights.emitter import Glow, lamp_emitter, lobe_row, share_of, weigh

_CLEAR_LAMPS_BEFORE = 0.004
_DEEPEST = 0.125
"""A surface that lies farther than this before a lamp is meant to hide it [m]."""

_HIDDEN = 0.1
"""Share of a lamp that may be hidden."""

_CLEAR_LAMPS_TURN = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
_RING = np.stack([np.cos(_CLEAR_LAMPS_TURN), np.sin(_CLEAR_LAMPS_TURN)], axis=1)
_PROBES = np.concatenate([np.zeros((1, 2)), 0.5 * _RING[::2], 0.92 * _RING])


def clear_lamps(lamps: Sequence[VehicleLamp], parts: Sequence[Part]) -> tuple[VehicleLamp, ...]:
    """Move lamps along the way they shine until the body no longer hides them.

    Args:
        lamps: In the body's frame.
        parts: The body that is drawn.
    """
    if not (lamps and parts):
        return tuple(lamps)
    corners = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in parts])
    low, high = (np.ascontiguousarray(each.T) for each in _bounds(corners))
    return tuple(_moved(lamp, corners[_near(lamp, low, high)]) for lamp in lamps)


def _bounds(corners: Floats) -> tuple[Floats, Floats]:
    """Return the lowest and highest coordinates of triangles, (m, 3) each."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _near(lamp: VehicleLamp, low: Floats, high: Floats) -> Bools:
    """Return which triangles may hide a lamp, (m,), by the bounds of all of them, (3, m) each."""
    reach = float(np.linalg.norm([*lamp.size, _DEEPEST]))
    at = np.array(lamp.at)[:, None]
    return np.asarray(((low < at + reach) & (high > at - reach)).all(axis=0))


def _moved(lamp: VehicleLamp, corners: Floats) -> VehicleLamp:
    """Move one lamp out of the triangles of a body, (m, 3, 3) [m]."""
    ahead = _ahead(lamp, corners)
    if float((ahead > 0.0).mean()) <= _HIDDEN:
        return lamp
    step = float(ahead.max()) + _CLEAR_LAMPS_BEFORE
    x, y, z = lamp.at
    return replace(lamp, at=(x + step * np.cos(lamp.yaw), y + step * np.sin(lamp.yaw), z))


def _ahead(lamp: VehicleLamp, corners: Floats) -> Floats:
    """Return how far the foremost surface lies before each probe, (probes,) [m]; else 0."""
    forward = np.array([np.cos(lamp.yaw), np.sin(lamp.yaw), 0.0])
    # Across, up and forward, from the middle of the lamp and in units of its half axes.
    axes = np.stack([[-forward[1], forward[0], 0.0], [0.0, 0.0, 1.0], forward], axis=1)
    seen = (corners - np.array(lamp.at)) @ axes / [lamp.size[0] / 2, lamp.size[1] / 2, 1.0]
    low, high = _bounds(seen)
    near = (low[:, :2] < 1.0).all(axis=1) & (high[:, :2] > -1.0).all(axis=1)
    near &= (high[:, 2] > 0.0) & (low[:, 2] < _DEEPEST)
    depth, hit = _crossed(seen[near])
    hit &= (depth > 0.0) & (depth < _DEEPEST)
    return np.asarray(np.where(hit, depth, 0.0).max(axis=0, initial=0.0))


def _crossed(corners: Floats) -> tuple[Floats, Bools]:
    """Return how far ahead the probes' rays cross triangles, and whether, (triangles, probes)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v = b - a, c - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    flat = np.abs(area) < 1e-9
    area = np.where(flat, 1.0, area)[:, None]
    off = _PROBES - a[:, None, :2]
    s = (off[..., 0] * v[:, None, 1] - off[..., 1] * v[:, None, 0]) / area
    t = (off[..., 1] * u[:, None, 0] - off[..., 0] * u[:, None, 1]) / area
    depth = a[:, None, 2] + s * u[:, None, 2] + t * v[:, None, 2]
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & ~flat[:, None]
    return depth, inside


MOST_BEAMS = 24
"""Vehicles whose head lamps light the road; farther ones only glow."""

BEAM_END = 130.0
"""Beams fade out towards this distance of the vehicle from the eye [m]."""

_FADE = 0.25
"""Share of that distance over which they fade."""

_BEAMS_BEFORE = 0.02  # from the foremost point of a body to where its beam starts [m]
_LAMP_HEIGHT = 0.7  # of head lamps over the road, about [m]

_BEAM_FLUX = 640.0
"""Light of a car's low beams [lm]."""

_BEAM_WEIGHT = 1.5
_UNSEEN_BEAM = 0.02
"""How much a beam matters whose light is not in the picture, in [0, 1]."""

_LIT = np.array(
    [
        (ahead, ahead * aside, 0.0)
        for ahead in (3.0, 6.0, 10.0, 16.0, 25.0, 38.0)
        for aside in (-0.3, -0.1, 0.1, 0.3)
    ]
)
"""Points of the road that stand for what a beam lights, in its frame, (n, 3) [m]."""

_BEAM_NEAR = 30.0
"""Light on the road farther from the eye matters less, as it is smaller in the picture [m]."""

# The body's +x, +y and +z are the spot's +z, +x and +y.
_SPOT = np.array(
    [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


class Beams:
    """Spots in front of the nearest vehicles with head lamps on.

    Args:
        scene: Holds the bodies and how many of each there can be.
        beam: What a car's head lamps throw onto the road.
        heads: Power of head lamps against a car's, by prototype.

    Attributes:
        beam: What a car's head lamps throw.
        placed: Placement of the spots that shine, (4, 4), relative to the renderer's origin,
            and their intensity, (3,), by name.
    """

    def __init__(self, scene: SceneData, beam: Beam, heads: Mapping[str, float]) -> None:
        self.beam, self._power = beam, heads
        self.placed: dict[str, tuple[Floats, Floats]] = {}
        places = {name: lamp_place(some) for name, some in scene.prototypes.items()}
        self._heads = {name: place for name, place in places.items() if place is not None}
        slots = (scene.slots.detailed, scene.slots.far)
        room = sum(some.get(name, 0) for some in slots for name in self._heads)
        self.count = min(room, MOST_BEAMS)

    def entries(self) -> dict[str, Any]:
        """Make the spots, by name; they are dark and share one pattern."""
        spot = self._spot(0.0)
        return {f"beam_{k:02d}": load(spot) for k in range(self.count)}

    def unit(self) -> Any:
        """Make a spot of intensity 1 at the origin."""
        return load(self._spot(1.0))

    def _spot(self, intensity: float) -> dict[str, Any]:
        """Return a spot at the origin as a plugin's dict, with its pattern as an object."""
        # A spot's u runs to its left and its v upwards.
        pattern = np.ascontiguousarray(self.beam.pattern[::-1, ::-1, None], np.float32)
        image = {"type": "bitmap", "bitmap": mi.Bitmap(pattern), "raw": True, "wrap_mode": "clamp"}
        angle = float(np.degrees(self.beam.half_angle))
        return {
            "type": "spot",
            "cutoff_angle": angle,
            "beam_width": angle,
            "intensity": {"type": "rgb", "value": [intensity] * 3},
            "texture": load(image),
        }

    def rows(self, names: tuple[str, ...]) -> Floats:
        """Return the numbers of beams, (beams, 16).

        They are three rows of the inverse of the placement, intensity, and height of the ground.

        Args:
            names: Of the beams, whether they shine or not.
        """
        rows = np.zeros((len(names), 16))
        for row, name in zip(rows, names, strict=True):
            if name in self.placed:
                matrix, intensity = self.placed[name]
                row[:12] = np.linalg.inv(matrix)[:3].ravel()
                row[12:15], row[15] = intensity, matrix[2, 3] - _LAMP_HEIGHT
        return rows

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Aim the beams of a frame."""
        shining, self.placed = self._shining(frame), {}
        for k in range(self.count):
            name = f"beam_{k:02d}"
            place, share = shining[k] if k < len(shining) else (None, 0.0)
            intensity = [share * channel for channel in self.beam.intensity]
            parameters[f"{name}.intensity.value"] = mi.Color3f(intensity)
            # With a weight, a spot that is off would still take light samples.
            lumens = _BEAM_FLUX * share * beam_weight(place, frame.view)
            parameters[f"{name}.sampling_weight"] = _BEAM_WEIGHT * share_of(lumens)
            if place is not None:
                matrix = convert.relative(place, frame.origin) @ _SPOT
                parameters[f"{name}.to_world"] = convert.transform(matrix)
                self.placed[name] = (matrix, np.array(intensity))

    def _shining(self, frame: FrameState) -> list[tuple[Transform, float]]:
        """Return where lamps are and how strong they are, those that matter most first."""
        beams = []
        for mover in (*frame.movers, *frame.deforming, *frame.far):
            if "head" in mover.lit and mover.prototype in self._heads:
                place = _unscaled(mover.world_from_body, self._heads[mover.prototype])
                power = self._power.get(mover.prototype, 1.0)
                # A bicycle's lamp matters as much as a car's at several times its distance.
                away = float(np.linalg.norm(place.position - frame.view.position)) / power**0.25
                beams.append((away, mover.id, place, power))
        beams.sort(key=lambda row: row[:2])
        # With more vehicles than spots, the farthest beams fade, so that none appears suddenly.
        end = min([BEAM_END, *(row[0] for row in beams[self.count : self.count + 1])])
        return [
            (place, power * float(np.clip((end - away) / (_FADE * end), 0.0, 1.0)))
            for away, _, place, power in beams[: self.count]
        ]


def beam_weight(place: Transform | None, view: View) -> float:
    """Return how much of a beam's light is large in the picture, in [0, 1].

    It changes smoothly while a vehicle drives by. If paths suddenly aimed much less at a beam,
    its light would go out in the film: few, bright samples would be left, which the cap cuts.
    """
    if place is None:
        return 0.0
    seen = (place.points(_LIT) - view.position) @ view.world_from_camera.matrix[:3, :3]
    # All of it in the picture, nothing at twice its width or behind the eye.
    inside = np.clip(2.0 - view.lens.off_middle(seen), 0.0, 1.0)
    if not view.lens.sees_around:
        inside *= np.clip(0.25 * seen[:, 0] + 0.5, 0.0, 1.0)
    large = 1.0 / (1.0 + (np.linalg.norm(seen, axis=1) / _BEAM_NEAR) ** 2)
    return _UNSEEN_BEAM + (1.0 - _UNSEEN_BEAM) * float((inside * large).mean())


def _unscaled(body: Transform, at: tuple[float, float, float]) -> Transform:
    """Return a placement at a point of a body, turned like the body but not stretched."""
    matrix = body.matrix.copy()
    matrix[:3, 3] = matrix[:3, :3] @ np.array(at) + matrix[:3, 3]
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    return Transform(matrix)


def lamp_place(body: Prototype) -> tuple[float, float, float] | None:
    """Return where a body's beam starts, or None where it has no head lamps [m].

    It lies midway between the lamps, ahead of whatever sticks out farthest: a round nose reaches
    farther than the lamps at its sides and would throw a shadow on the road.
    """
    heads = np.array([lamp.at for lamp in body.lamps if lamp.role == "head"]).reshape(-1, 3)
    if not len(heads):
        return None
    x, y, z = heads.mean(axis=0)
    meshes = [part.mesh for part in (*body.parts, *body.far) if len(part.mesh.vertices)]
    nose = max([float(x), *(float(mesh.vertices[:, 0].max()) for mesh in meshes)])
    return nose + _BEAMS_BEFORE, float(y), float(z)


_WEIGHTS: Mapping[bool, float] = {False: 2.4, True: 0.2}
"""How often paths aim at the lenses of near (False) and far (True) road users."""

_SIDES = 6
_RIM = np.arange(_SIDES)
_TURN = _RIM * 2.0 * np.pi / _SIDES
_FAN = np.column_stack([np.zeros(_SIDES, int), 1 + _RIM, 1 + (_RIM + 1) % _SIDES])


@dataclass(frozen=True, slots=True, eq=False)
class _Discs:
    """The lamps of one prototype that belong to a set, at one level of detail.

    Attributes:
        roles: Of each, n.
        corners: In the body's frame, (n, 1 + sides, 3) [m]: the centre, then the rim.
        radiance: When lit, (n, 3).
        lobes: As in `Glow`, (n, 3).
    """

    roles: tuple[str, ...]
    corners: Floats
    radiance: Floats
    lobes: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    """All lamps of a mesh in one frame; those that are off have no area.

    Attributes:
        vertices: Relative to the renderer's origin, (lamps, 1 + sides, 3) [m].
        radiance: (lamps, 3).
        lobes: As in `Glow`, (lamps, 3).
    """

    vertices: Floats
    radiance: Floats
    lobes: Floats


class GlowingLenses:
    """All lamps of one level of detail as a mesh with a fixed number of places.

    Args:
        scene: Holds the bodies and how many of each there can be.
        lights: What shines on vehicles.
        far: Whether the lamps are those of stand-ins, or of detailed bodies.
        floor: Height where lamps that are off wait [m].

    Attributes:
        name: Of the mesh.
        count: Places for lamps.
        shown: Faces of the lamps that shine in this frame, by the name of what carries them.
        glow: How they shine; None before a frame was shown.
        corners: Of the faces that shine, relative to the renderer's origin, (n, 3, 3) [m].
    """

    def __init__(self, scene: SceneData, lights: RunningLights, *, far: bool, floor: float) -> None:
        self.name, self._far = f"running_{'far' if far else 'near'}", far
        self._floor = floor
        self._weight = _WEIGHTS[far] if lights.sampled else 0.0
        self._discs: dict[str, _Discs] = {}
        self.shown: dict[str, slice] = {}
        self.glow: Glow | None = None
        self.corners: Floats = np.zeros((0, 3, 3))
        self.count = 1  # one that never shines, because a mesh without area cannot be sampled
        for key, places in (scene.slots.far if far else scene.slots.detailed).items():
            body = scene.prototypes[key]
            chosen = [lamp for lamp in body.lamps if lamp.role in lights.intensity]
            if chosen:
                shown = clear_lamps(chosen, body.far if far else body.parts)
                self._discs[key] = _discs(shown, lights, share=lights.heads.get(key, 1.0))
                self.count += places * len(chosen)

    def __bool__(self) -> bool:
        """Return whether any road user of the shot has a lamp."""
        return bool(self._discs)

    def make(self, bsdf: Any, *, jit: bool) -> Any:
        """Make the mesh; all lamps are off."""
        faces = (np.arange(self.count)[:, None, None] * (1 + _SIDES) + _FAN).reshape(-1, 3)
        u = np.repeat((np.arange(self.count) + 0.5) / self.count, 1 + _SIDES)
        vertices = self._placed((), np.zeros(3)).vertices.reshape(-1, 3)
        mesh = Mesh(vertices, faces, None, np.column_stack([u, u]))
        emitter = lamp_emitter(self.count, self.count, jit=jit, fan=_SIDES)
        tint = np.full((len(faces), 3), LENS_THAT_SHINES)
        return convert.make_lamps(self.name, mesh, bsdf=bsdf, emitter=emitter, tint=tint)

    def update(self, parameters: Any, frame: FrameState, *, jit: bool) -> None:
        """Put the lamps of a frame to their places.

        Args:
            parameters: Of Mitsuba's scene.
            frame: Says where road users are and what is lit.
            jit: Whether the variant compiles.
        """
        movers = frame.far if self._far else (*frame.movers, *frame.deforming)
        placed = self._placed(movers, frame.origin)
        vertices = placed.vertices
        convert.overwrite(parameters, f"{self.name}.vertex_positions", vertices.reshape(-1, 3))
        # All triangles of a fan have the same area, whatever ellipse it fills.
        across = np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0])
        twice = np.linalg.norm(across, axis=1)
        axes = across / np.maximum(twice, 1e-30)[:, None]
        if not jit:
            key = f"{self.name}.{convert.RADIANCE_ATTRIBUTE}"
            convert.overwrite(parameters, key, np.repeat(placed.radiance, _SIDES, axis=0))
            return
        areas, places = 0.5 * _SIDES * twice, vertices[:, 0] + frame.origin
        each, radiance = np.arange(self.count), placed.radiance
        self.glow = Glow(radiance, axes, placed.lobes, areas, each, places, self._weight)
        self.corners = vertices[(radiance != 0.0).any(axis=1)][:, _FAN].reshape(-1, 3, 3)
        weigh(parameters, self.name, self.glow, frame.view)

    def _placed(self, movers: Sequence[Mover], origin: Floats) -> _Placed:
        """Find where the lamps of some road users are, and how they shine."""
        vertices = np.tile([0.0, 0.0, self._floor - origin[2]], (self.count, 1 + _SIDES, 1))
        radiance, lobes = np.zeros((self.count, 3)), np.tile(lobe_row(Lobe()), (self.count, 1))
        vertices[0, 1:, :2] += 1e-3 * np.column_stack([np.cos(_TURN), np.sin(_TURN)])
        used, self.shown = 1, {}
        for mover in movers:
            discs = self._discs.get(mover.prototype)
            if discs is None:
                continue
            lit = [k for k, role in enumerate(discs.roles) if role in mover.lit]
            matrix = convert.relative(mover.world_from_body, origin)
            rows = slice(used, used + len(lit))
            vertices[rows] = discs.corners[lit] @ matrix[:3, :3].T + matrix[:3, 3]
            radiance[rows], lobes[rows] = discs.radiance[lit], discs.lobes[lit]
            self.shown[mover.name] = slice(_SIDES * used, _SIDES * (used + len(lit)))
            used += len(lit)
        return _Placed(vertices, radiance, lobes)


def _discs(lamps: Sequence[VehicleLamp], lights: RunningLights, *, share: float) -> _Discs:
    """Return the lamps of a body; its head lamps have a share of a car's power."""
    corners = np.array([_disc(lamp) for lamp in lamps]).reshape(-1, 1 + _SIDES, 3)
    # A regular polygon of n sides fills n/2 sin(2 pi/n) of its radius squared.
    filled = 0.5 * _SIDES * np.sin(2.0 * np.pi / _SIDES)
    area = np.array([filled * lamp.size[0] * lamp.size[1] / 4.0 for lamp in lamps])
    power = np.array([lights.intensity[lamp.role] for lamp in lamps]).reshape(-1, 3)
    power[[lamp.role == "head" for lamp in lamps]] *= share
    lobes = [lobe_row(lights.lobes.get(lamp.role, Lobe())) for lamp in lamps]
    roles = tuple(lamp.role for lamp in lamps)
    return _Discs(roles, corners, power / area.reshape(-1, 1), np.array(lobes).reshape(-1, 3))


def _disc(lamp: VehicleLamp) -> Floats:
    """Return a lamp's centre and rim, anticlockwise as seen from ahead, (1 + sides, 3)."""
    left = np.array([-np.sin(lamp.yaw), np.cos(lamp.yaw), 0.0])
    across = 0.5 * lamp.size[0] * np.cos(_TURN)[:, None] * left
    up = 0.5 * lamp.size[1] * np.sin(_TURN)[:, None] * np.array([0.0, 0.0, 1.0])
    return np.asarray(np.concatenate([np.zeros((1, 3)), across + up]) + np.array(lamp.at))


class RunningLamps:
    """All lamps and beams of a scene's vehicles.

    Args:
        scene: Says what vehicles light.
        floor: Height where lamps that are off wait [m].
        jit: Whether the variant compiles.

    Attributes:
        beams: Of head lamps; None where there are none.
    """

    def __init__(self, scene: SceneData, *, floor: float, jit: bool) -> None:
        lights, self._jit = scene.running, jit
        self._sets: list[GlowingLenses] = []
        if lights is not None:
            sets = [GlowingLenses(scene, lights, far=far, floor=floor) for far in _WEIGHTS]
            self._sets = [lenses for lenses in sets if lenses]
        self.beams: Beams | None = None
        if lights is not None and lights.beam is not None:
            self.beams = Beams(scene, lights.beam, lights.heads)

    def __bool__(self) -> bool:
        """Return whether there is anything to light."""
        return bool(self._sets)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the meshes."""
        return tuple(lenses.name for lenses in self._sets)

    @property
    def shown(self) -> dict[str, Mapping[str, slice]]:
        """Faces of the lamps that shine, by mesh, then by the name of what carries them."""
        return {lenses.name: lenses.shown for lenses in self._sets}

    def glows(self) -> dict[str, Glow]:
        """Return how each mesh shines in the frame that was shown."""
        return {lenses.name: lenses.glow for lenses in self._sets if lenses.glow is not None}

    def shining(self) -> list[Floats]:
        """Return the corners of faces that shine, relative to the origin, (n, 3, 3) [m]."""
        return [lenses.corners for lenses in self._sets]

    @property
    def most(self) -> int:
        """Places for lamps."""
        return sum(lenses.count for lenses in self._sets)

    def entries(self, bsdf: Any) -> dict[str, Any]:
        """Make the shapes and emitters, by name."""
        shapes = {lenses.name: lenses.make(bsdf, jit=self._jit) for lenses in self._sets}
        return shapes if self.beams is None else {**shapes, **self.beams.entries()}

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Light what a frame lights."""
        for lenses in self._sets:
            lenses.update(parameters, frame, jit=self._jit)
        if self.beams is not None:
            self.beams.update(parameters, frame)
