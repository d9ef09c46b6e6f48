"""Lamps of vehicles: glowing lenses as four meshes, and beams of the nearest head lamps.

Emitters cannot be instanced, so all lenses are merged into meshes whose vertices and
radiances are updated: white and coloured ones, near and far, because a path picks a lamp of
a mesh by its area alone. Lamps that are off have no area. Beams are a fixed pool of spots.

How often paths aim at each was chosen by measuring: noise is least where an emitter's share
of the picks follows the root of its second moment, relative to the square of the picture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, Transform
from sumo3dviz_pt.model.lamps import Beam, RunningLights, VehicleLamp
from sumo3dviz_pt.model.scene import FrameState, Mover, SceneData, View
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.clear_lamps import clear_lamps
from sumo3dviz_pt.render.lamps import UNTINTED, lamp_texture

MOST_BEAMS = 24
"""Vehicles whose head lamps light the road; farther ones only glow."""

BEAM_END = 130.0
"""Beams fade out towards this distance of the vehicle from the eye [m]."""

_FADE = 0.25
"""Share of that distance over which they fade."""

_WHITE = ("head", "reverse", "sign")
_WEIGHTS: Mapping[tuple[str, bool], float] = {
    ("white", False): 2.4,
    ("white", True): 0.2,
    ("colour", False): 2.0,
    ("colour", True): 0.2,
}
"""By colour and whether they are on road users that are far away."""

_UNSEEN_BEAM, _SEEN_BEAM = 0.05, 1.6
_LIT_AHEAD = np.array([4.0, 9.0, 16.0, 28.0])
"""Where a beam's light on the road is looked for [m]."""

_BEAM_NEAR = 30.0
"""From here on, light on the road matters less the smaller it is in the picture [m]."""

_SIDES = 6
_TURN = np.arange(_SIDES) * 2.0 * np.pi / _SIDES

# The body's +x, +y and +z are the spot's +z, +x and +y.
_SPOT = np.array(
    [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


@dataclass(frozen=True, slots=True, eq=False)
class _Discs:
    """The lamps of one prototype that belong to a set, at one level of detail.

    Attributes:
        roles: Of each, n.
        corners: In the body's frame, (n, 1 + sides, 3) [m]: the centre, then the rim.
        radiance: When lit, (n, 3).
    """

    roles: tuple[str, ...]
    corners: Floats
    radiance: Floats


class GlowingLenses:
    """All lamps of one colour and level as a mesh with a fixed number of places."""

    def __init__(
        self, scene: SceneData, lights: RunningLights, *, colour: str, far: bool, floor: float
    ) -> None:
        self.name, self._far = f"running_{colour}_{'far' if far else 'near'}", far
        self._floor = floor
        self._weight = _WEIGHTS[colour, far] if lights.sampled else 0.0
        self._discs: dict[str, _Discs] = {}
        self.count = 1  # one that never shines, because a mesh without area cannot be sampled
        for key, places in (scene.slots.far if far else scene.slots.near).items():
            body = scene.prototypes[key]
            chosen = [lamp for lamp in body.lamps if lamp.role in lights.intensity]
            chosen = [lamp for lamp in chosen if (lamp.role in _WHITE) == (colour == "white")]
            if chosen:
                shown = clear_lamps(chosen, body.far if far else body.parts)
                self._discs[key] = _discs(shown, lights.intensity)
                self.count += places * len(chosen)

    def __bool__(self) -> bool:
        """Whether any road user of the shot has such a lamp."""
        return bool(self._discs)

    def make(self, bsdf: Any, *, jit: bool) -> Any:
        """The mesh; all lamps are off."""
        ring = np.arange(_SIDES)
        fan = np.column_stack([np.zeros(_SIDES, int), 1 + ring, 1 + (ring + 1) % _SIDES])
        faces = (np.arange(self.count)[:, None, None] * (1 + _SIDES) + fan).reshape(-1, 3)
        u = np.repeat((np.arange(self.count) + 0.5) / self.count, 1 + _SIDES)
        vertices, _ = self._places((), np.zeros(3))
        mesh = Mesh(vertices, faces, None, np.column_stack([u, np.zeros_like(u)]))
        emitter = {
            "type": "area",
            "radiance": lamp_texture(self.count, jit=jit),
            "sampling_weight": self._weight if jit else 0.0,
        }
        tint = np.full((len(faces), 3), UNTINTED)
        return convert.make_lamps(self.name, mesh, bsdf=bsdf, emitter=emitter, tint=tint)

    def update(self, parameters: Any, frame: FrameState, *, jit: bool) -> None:
        """Put the lamps of a frame to their places."""
        movers = frame.distant if self._far else frame.movers
        vertices, radiance = self._places(movers, frame.origin)
        convert.overwrite(parameters, f"{self.name}.vertex_positions", vertices)
        if jit:
            convert.overwrite(parameters, f"{self.name}.emitter.radiance.values", radiance)
        else:
            key = f"{self.name}.{convert.RADIANCE_ATTRIBUTE}"
            convert.overwrite(parameters, key, np.repeat(radiance, _SIDES, axis=0))

    def _places(self, movers: Sequence[Mover], origin: Floats) -> tuple[Floats, Floats]:
        """Vertices, (n, 3), relative to the origin, and radiances, (lamps, 3)."""
        vertices = np.tile([0.0, 0.0, self._floor - origin[2]], (self.count, 1 + _SIDES, 1))
        radiance = np.zeros((self.count, 3))
        vertices[0, 1:, :2] += 1e-3 * np.column_stack([np.cos(_TURN), np.sin(_TURN)])
        used = 1
        for mover in movers:
            discs = self._discs.get(mover.prototype)
            if discs is None:
                continue
            lit = [k for k, role in enumerate(discs.roles) if role in mover.lit]
            matrix = convert.relative(mover.world_from_body, origin)
            rows = slice(used, used + len(lit))
            vertices[rows] = discs.corners[lit] @ matrix[:3, :3].T + matrix[:3, 3]
            radiance[rows] = discs.radiance[lit]
            used += len(lit)
        return vertices.reshape(-1, 3), radiance


def _discs(lamps: Sequence[VehicleLamp], intensity: Mapping[str, Colour]) -> _Discs:
    """The lamps of a body that belong to a set."""
    corners = np.array([_disc(lamp) for lamp in lamps]).reshape(-1, 1 + _SIDES, 3)
    # A regular polygon of n sides fills n/2 sin(2 pi/n) of its radius squared.
    share = 0.5 * _SIDES * np.sin(2.0 * np.pi / _SIDES)
    area = np.array([share * lamp.size[0] * lamp.size[1] / 4.0 for lamp in lamps])
    power = np.array([intensity[lamp.role] for lamp in lamps]).reshape(-1, 3)
    return _Discs(tuple(lamp.role for lamp in lamps), corners, power / area.reshape(-1, 1))


def _disc(lamp: VehicleLamp) -> Floats:
    """Centre and rim of a lamp, anticlockwise as seen from where it shines, (1 + sides, 3)."""
    left = np.array([-np.sin(lamp.yaw), np.cos(lamp.yaw), 0.0])
    across = 0.5 * lamp.size[0] * np.cos(_TURN)[:, None] * left
    up = 0.5 * lamp.size[1] * np.sin(_TURN)[:, None] * np.array([0.0, 0.0, 1.0])
    return np.asarray(np.concatenate([np.zeros((1, 3)), across + up]) + np.array(lamp.at))


class Beams:
    """Spots in front of the nearest vehicles with head lamps on."""

    def __init__(self, scene: SceneData, beam: Beam) -> None:
        self._beam = beam
        places = {name: _between(some.lamps) for name, some in scene.prototypes.items()}
        self._heads = {name: place for name, place in places.items() if place is not None}
        slots = (scene.slots.near, scene.slots.far)
        room = sum(some.get(name, 0) for some in slots for name in self._heads)
        self.count = min(room, MOST_BEAMS)

    def entries(self) -> dict[str, Any]:
        """Spots by name, dark; they share one pattern."""
        # A spot's u runs to its left and its v upwards.
        pattern = np.ascontiguousarray(self._beam.pattern[::-1, ::-1, None], np.float32)
        image = {"type": "bitmap", "bitmap": mi.Bitmap(pattern), "raw": True, "wrap_mode": "clamp"}
        angle = float(np.degrees(self._beam.half_angle))
        spot = {
            "type": "spot",
            "cutoff_angle": angle,
            "beam_width": angle,
            "intensity": {"type": "rgb", "value": [0.0, 0.0, 0.0]},
            "texture": mi.load_dict(image),
        }
        return {f"beam_{k:02d}": mi.load_dict(spot) for k in range(self.count)}

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Aim the beams of a frame."""
        shining = self._shining(frame)
        for k in range(self.count):
            name = f"beam_{k:02d}"
            place, share = shining[k] if k < len(shining) else (None, 0.0)
            intensity = [share * channel for channel in self._beam.intensity]
            parameters[f"{name}.intensity.value"] = mi.Color3f(intensity)
            # A spot that is off would still draw light samples.
            parameters[f"{name}.sampling_weight"] = _beam_weight(place, frame.view) * share
            if place is not None:
                matrix = convert.relative(place, frame.origin) @ _SPOT
                parameters[f"{name}.to_world"] = convert.transform(matrix)

    def _shining(self, frame: FrameState) -> list[tuple[Transform, float]]:
        """Where lamps are and how strong they are, the nearest first."""
        found = []
        for mover in (*frame.movers, *frame.distant):
            if "head" in mover.lit and mover.prototype in self._heads:
                place = _unscaled(mover.world_from_body, self._heads[mover.prototype])
                away = float(np.linalg.norm(place.position - frame.view.position))
                found.append((away, mover.id, place))
        found.sort(key=lambda row: row[:2])
        # Where there are more than spots, the last ones fade, so that none appears at once.
        end = min([BEAM_END, *(away for away, _, _ in found[self.count : self.count + 1])])
        return [
            (place, float(np.clip((end - away) / (_FADE * end), 0.0, 1.0)))
            for away, _, place in found[: self.count]
        ]


def _beam_weight(place: Transform | None, view: View) -> float:
    """How often paths aim at a beam: by how large its light is in the picture."""
    if place is None:
        return 0.0
    ahead = place.matrix[:3, 0] * _LIT_AHEAD[:, None] + place.position
    seen = (ahead - view.position) @ view.world_from_camera.matrix[:3, :3]
    half = 1.15 * np.tan(view.fov / 2.0)
    inside = (seen[:, 0] > 1.0) & (np.abs(seen[:, 1:]) < half * seen[:, :1]).all(axis=1)
    large = 1.0 / (1.0 + (np.linalg.norm(seen, axis=1) / _BEAM_NEAR) ** 2)
    return _UNSEEN_BEAM + _SEEN_BEAM * float((inside * large).mean())


def _unscaled(body: Transform, at: tuple[float, float, float]) -> Transform:
    """A frame at a point of a body, turned like it but not stretched."""
    matrix = body.matrix.copy()
    matrix[:3, 3] = matrix[:3, :3] @ np.array(at) + matrix[:3, 3]
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    return Transform(matrix)


def _between(lamps: Sequence[VehicleLamp]) -> tuple[float, float, float] | None:
    """The place midway between a body's head lamps, just before them, or None [m]."""
    heads = np.array([lamp.at for lamp in lamps if lamp.role == "head"]).reshape(-1, 3)
    if not len(heads):
        return None
    x, y, z = heads.mean(axis=0)
    return float(x) + 0.05, float(y), float(z)


class RunningLamps:
    """Everything that vehicles of a scene light."""

    def __init__(self, scene: SceneData, *, floor: float, jit: bool) -> None:
        lights, self._jit = scene.running, jit
        self._sets: list[GlowingLenses] = []
        if lights is not None:
            sets = [GlowingLenses(scene, lights, colour=c, far=f, floor=floor) for c, f in _WEIGHTS]
            self._sets = [lenses for lenses in sets if lenses]
        beam = None if lights is None else lights.beam
        self._beams = None if beam is None else Beams(scene, beam)

    def __bool__(self) -> bool:
        """Whether there is anything to light."""
        return bool(self._sets)

    def entries(self, bsdf: Any) -> dict[str, Any]:
        """Shapes and emitters by name."""
        shapes = {lenses.name: lenses.make(bsdf, jit=self._jit) for lenses in self._sets}
        return shapes if self._beams is None else {**shapes, **self._beams.entries()}

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Light what a frame lights."""
        for lenses in self._sets:
            lenses.update(parameters, frame, jit=self._jit)
        if self._beams is not None:
            self._beams.update(parameters, frame)
