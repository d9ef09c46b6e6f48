"""Beams of the nearest head lamps: a fixed number of spots that light the road."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.lamps import Beam
from sumo3dviz_pt.model.scene import FrameState, Prototype, SceneData, View
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.kernels import load
from sumo3dviz_pt.render.lights.picks import share_of

MOST_BEAMS = 24
"""Vehicles whose head lamps light the road; farther ones only glow."""

BEAM_END = 130.0
"""Beams fade out towards this distance of the vehicle from the eye [m]."""

_FADE = 0.25
"""Share of that distance over which they fade."""

_BEFORE = 0.02  # from the foremost point of a body to where its beam starts [m]
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

    def given(self, name: str, x: Floats, y: Floats) -> Floats:
        """Return what a beam gives to places on the ground, as `picks.Picks.given` counts.

        Args:
            name: Of a beam that shines.
            x: Of the places, relative to the renderer's origin, (n,) [m].
            y: Of the same places, (n,) [m].
        """
        matrix, intensity = self.placed[name]
        place = matrix[:3, 3]
        ground = np.stack([x, y, np.full_like(x, place[2] - _LAMP_HEIGHT)], axis=-1)
        seen = (ground - place) @ matrix[:3, :3]
        away = (seen**2).sum(axis=-1)
        ahead = np.maximum(seen[:, 2], 1e-6)
        # The spot's +z looks ahead, +x to its left, and +y up.
        half, count = np.tan(self.beam.half_angle), len(self.beam.pattern)
        across = (0.5 - 0.5 * seen[:, 0] / (ahead * half)) * count
        down = (0.5 - 0.5 * seen[:, 1] / (ahead * half)) * count
        inside = (seen[:, 2] > 0.0) & (np.abs(across - 0.5 * count) < 0.5 * count)
        inside &= np.abs(down - 0.5 * count) < 0.5 * count
        row, column = (np.where(inside, each, 0).astype(int) for each in (down, across))
        share = np.where(inside, self.beam.pattern[row, column], 0.0)
        return np.asarray(np.pi * np.mean(intensity) * share / (away + 4.0))

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
        found = []
        for mover in (*frame.movers, *frame.deforming, *frame.far):
            if "head" in mover.lit and mover.prototype in self._heads:
                place = _unscaled(mover.world_from_body, self._heads[mover.prototype])
                power = self._power.get(mover.prototype, 1.0)
                # A bicycle's lamp matters as much as a car's at several times its distance.
                away = float(np.linalg.norm(place.position - frame.view.position)) / power**0.25
                found.append((away, mover.id, place, power))
        found.sort(key=lambda row: row[:2])
        # With more vehicles than spots, the farthest beams fade, so that none appears suddenly.
        end = min([BEAM_END, *(row[0] for row in found[self.count : self.count + 1])])
        return [
            (place, power * float(np.clip((end - away) / (_FADE * end), 0.0, 1.0)))
            for away, _, place, power in found[: self.count]
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
    return nose + _BEFORE, float(y), float(z)
