"""Lamps that shine on what falls near a camera: the few that give most light there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.colour import LUMINANCE
from sumo3dviz_pt.model.falling import Glows, Throws
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.lamps import Beam, LampSet, Lobe, RunningLights, VehicleLamp
from sumo3dviz_pt.model.scene import Mover, Prototype, View

MOST_GLOWS, MOST_THROWS = 20, 6
"""Lamps, and vehicles with head lamps, whose light falls on drops."""

_AHEAD = 8.0  # the place before the eye that counts [m]
_FADE = 0.5  # above the weakest that is left out, in its light
_PATTERN = 64  # rows and columns of a beam's pattern
_OWN = frozenset({"dials", "screen"})  # inside the cabin


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """The lamps of a set as points.

    Attributes:
        id: Of the set.
        at: Middles, (n, 3) [m].
        axes: Unit, (n, 3).
        areas: (n,) [m^2].
        lobe: Floor and sharpness.
        radiance: Of lamps that never change, (n, 3), or None.
    """

    id: str
    at: Floats
    axes: Floats
    areas: Floats
    lobe: tuple[float, float]
    radiance: Floats | None

    @classmethod
    def of(cls, lamps: LampSet) -> Standing:
        """Return a set's lamps as points."""
        corners = lamps.mesh.vertices[lamps.mesh.faces]
        across = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area, count = np.linalg.norm(across, axis=1), len(lamps.lamps)
        lamp = np.asarray(lamps.lamp_of_face)

        def summed(values: Floats) -> Floats:
            columns = [np.bincount(lamp, weights=v, minlength=count) for v in values.T]
            return np.stack(columns, axis=1)

        areas = np.bincount(lamp, weights=area, minlength=count)
        axes, filled = summed(across), np.maximum(areas, 1e-12)[:, None]
        # What a lamp sends along its axis is its face as seen from there.
        facing = np.linalg.norm(axes, axis=1)
        return cls(
            lamps.id,
            summed(corners.mean(axis=1) * area[:, None]) / filled,
            axes / np.maximum(facing, 1e-12)[:, None],
            facing,
            (lamps.lobe.floor, lamps.lobe.sharpness),
            lamps.radiance,
        )

    def glows(self, lit: Mapping[str, Floats]) -> Glows:
        """Return its lamps as they shine in a frame.

        Args:
            lit: Radiance by set of those that change.
        """
        radiance = lit.get(self.id, self.radiance)
        if radiance is None:
            return Glows()
        intensity = np.asarray(radiance) * self.areas[:, None]
        return Glows(self.at, self.axes, intensity, np.tile(self.lobe, (len(self.at), 1)))


def running_glows(
    movers: Iterable[Mover], prototypes: Mapping[str, Prototype], lights: RunningLights
) -> Glows:
    """Return the lamps on road users.

    Args:
        movers: Road users and parts of them.
        prototypes: By name.
        lights: How bright lamps are.
    """
    at, axes, intensity, lobes = [], [], [], []
    for mover in movers:
        for lamp in prototypes[mover.prototype].lamps:
            if lamp.role not in mover.lit or lamp.role in _OWN or lamp.role not in lights.intensity:
                continue
            place, axis = _placed(mover, lamp)
            lobe = lights.lobes.get(lamp.role, Lobe())
            share = lights.heads.get(mover.prototype, 1.0) if lamp.role == "head" else 1.0
            at.append(place)
            axes.append(axis)
            intensity.append(share * np.array(lights.intensity[lamp.role]))
            lobes.append((lobe.floor, lobe.sharpness))
    if not at:
        return Glows()
    return Glows(np.array(at), np.array(axes), np.array(intensity), np.array(lobes))


def _placed(mover: Mover, lamp: VehicleLamp) -> tuple[Floats, Floats]:
    """Return a lamp's middle and axis in the world, (3,) each."""
    matrix = mover.world_from_body.matrix
    axis = matrix[:3, :3] @ np.array([np.cos(lamp.yaw), np.sin(lamp.yaw), 0.0])
    return matrix[:3, :3] @ np.array(lamp.at) + matrix[:3, 3], axis / np.linalg.norm(axis)


def nearest(glows: Sequence[Glows], view: View) -> Glows:
    """Return those lamps that give most light before the eye.

    Args:
        glows: All that shine.
        view: The camera.
    """
    whole = Glows(
        *(
            np.concatenate([getattr(each, name) for each in glows])
            for name in ("at", "axes", "intensity", "lobes")
        )
    )
    share = _shares(whole.at, whole.intensity, view, MOST_GLOWS)
    kept = np.flatnonzero(share > 0.0)
    intensity = whole.intensity[kept] * share[kept, None]
    return Glows(whole.at[kept], whole.axes[kept], intensity, whole.lobes[kept])


def throws(
    movers: Iterable[Mover], prototypes: Mapping[str, Prototype], lights: RunningLights, view: View
) -> Throws:
    """Return the head lamps that light the air before the eye.

    Args:
        movers: Road users and parts of them.
        prototypes: By name.
        lights: How bright lamps are.
        view: The camera.
    """
    if lights.beam is None:
        return Throws()
    frames, powers = [], []
    for mover in movers:
        heads = [lamp.at for lamp in prototypes[mover.prototype].lamps if lamp.role == "head"]
        if "head" in mover.lit and heads:
            frame = mover.world_from_body.matrix.copy()
            frame[:3, 3] = frame[:3, :3] @ np.mean(heads, axis=0) + frame[:3, 3]
            frame[:3, :3] /= np.linalg.norm(frame[:3, :3], axis=0)
            frames.append(frame)
            powers.append(lights.heads.get(mover.prototype, 1.0))
    if not frames:
        return Throws()
    placed = np.array(frames)
    intensity = np.array(powers)[:, None] * np.array(lights.beam.intensity)
    share = _shares(placed[:, :3, 3], intensity, view, MOST_THROWS)
    kept = np.flatnonzero(share > 0.0)
    pattern = _coarse(lights.beam)
    edge = float(np.tan(lights.beam.half_angle))
    return Throws(placed[kept], intensity[kept] * share[kept, None], pattern, edge)


def _coarse(beam: Beam) -> Floats:
    """Return a beam's pattern with fewer rows and columns."""
    block = max(1, len(beam.pattern) // _PATTERN)
    count = len(beam.pattern) // block
    kept = np.asarray(beam.pattern[: count * block, : count * block], dtype=np.float64)
    return np.asarray(kept.reshape(count, block, count, block).mean(axis=(1, 3)))


def _shares(at: Floats, intensity: Floats, view: View, most: int) -> Floats:
    """Return how much of lamps counts, so that none comes or goes suddenly, (n,) in [0, 1]."""
    away = np.linalg.norm(at - (view.position + _AHEAD * view.forward), axis=1)
    light = (intensity @ LUMINANCE) / (away**2 + 4.0)
    if len(light) <= most:
        return np.asarray((light > 0.0).astype(np.float64))
    weakest = max(float(np.sort(light)[-most - 1]), 1e-30)
    return np.asarray(np.clip((light / weakest - 1.0) / _FADE, 0.0, 1.0))
