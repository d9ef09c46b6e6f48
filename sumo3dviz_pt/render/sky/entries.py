"""Sky and sun as Mitsuba's objects and dicts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.render.kernels import aligned, load
from sumo3dviz_pt.render.sky.daylight import SUN_RADIUS
from sumo3dviz_pt.render.sky.map import SkyMap, Sun

SUN_DISTANCE = 1e6
"""Distance of the sun's disc [m]; its direction changes by 0.06 degrees over a kilometre."""

_NIGHT_LUX, _MOST_SKY = 0.6, 30.0
"""Illuminance for which the sky's weight is 1 [lx], and its highest weight."""

_ARC = 49  # corners of a sun cut by the horizon

# The moon's maria, by eye: east, north, half width, half height [radii of the disc], depth.
_MARIA = (
    (-0.30, 0.50, 0.30, 0.24, 0.42),  # Imbrium
    (-0.62, 0.18, 0.22, 0.42, 0.36),  # Procellarum
    (0.24, 0.44, 0.19, 0.17, 0.44),  # Serenitatis
    (0.42, 0.12, 0.24, 0.19, 0.46),  # Tranquillitatis
    (0.70, 0.26, 0.10, 0.13, 0.48),  # Crisium
    (0.66, -0.10, 0.14, 0.20, 0.38),  # Fecunditatis
    (-0.22, -0.28, 0.26, 0.16, 0.34),  # Nubium
    (-0.52, -0.36, 0.12, 0.12, 0.40),  # Humorum
)


def sky_weight(sky: SkyMap, *, lamps: bool) -> float:
    """Return how often light paths aim at the sky (and at the sun), against 1 for a lamp set.

    Args:
        sky: What shines.
        lamps: Whether paths aim at lamps, too. The weight then follows the sky's light; 1 was
            measured to be best over a city at night.
    """
    return float(np.clip(sky.illuminance / _NIGHT_LUX, 1.0, _MOST_SKY)) if lamps else 1.0


def sky_entry(sky: SkyMap, weight: float = 1.0) -> Any:
    """Return the baked sky as an environment map; its columns already run clockwise from north."""
    return load(
        {
            "type": "envmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(sky.radiance, np.float32)),
            "sampling_weight": weight,
            # Mitsuba's maps are y-up and put their first column at -z.
            "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
        }
    )


def update_sky(parameters: Any, entries: Mapping[str, Any]) -> None:
    """Let a loaded scene's sky and sun shine as others do that were made for it.

    Args:
        parameters: Of the scene; they still have to be updated.
        entries: From `sky_entry` and `sun_entry`.
    """
    for name, entry in entries.items():
        made = mi.traverse(entry)
        for key in ("data", "emitter.radiance.value", "emitter.radiance.data"):
            if key in made and f"{name}.{key}" in parameters:
                parameters[f"{name}.{key}"] = made[key]


def sun_entry(sky: SkyMap, weight: float = 1.0) -> dict[str, Any]:
    """Make the sun or moon as a disc, so distant that its direction is the same everywhere.

    At the horizon only what stands above it is there: from a high eye the rest would
    shine between the end of the ground and the horizon.
    """
    if sky.sun is None:
        return {}
    whole = sky.sun.risen >= 1.0
    return {"sun": _disc(sky.sun, weight) if whole else _segment(sky.sun, weight)}


def _facing(direction: Floats) -> Any:
    """Return the transform of a unit disc that faces +z to the sun's place, facing us, +y up."""
    place = direction * SUN_DISTANCE
    up = [0.0, 0.0, 1.0] if abs(direction[2]) < 0.9 else [0.0, 1.0, 0.0]
    towards_us = mi.ScalarTransform4f().look_at(
        origin=place.tolist(), target=[0.0, 0.0, 0.0], up=up
    )
    return towards_us @ mi.ScalarTransform4f().scale(float(SUN_DISTANCE * np.tan(SUN_RADIUS)))


def _disc(sun: Sun, weight: float) -> Any:
    """Make the whole disc; the moon's shows its dark plains."""
    radiance: dict[str, Any] = {"type": "rgb", "value": sun.radiance.tolist()}
    if sun.moon:
        face = (_moon_face()[..., None] * sun.radiance).astype(np.float32)
        radiance = {"type": "bitmap", "bitmap": mi.Bitmap(face), "raw": True}
    emitter = {"type": "area", "radiance": radiance, "sampling_weight": weight}
    return load({"type": "disk", "to_world": _facing(sun.direction), "emitter": emitter})


def _moon_face(rings: int = 24, around: int = 96) -> Floats:
    """Return the full moon's brightness by radius and angle, a disk's uv; 1 on average.

    Maria are dark ovals where they lie for northern eyes; there is no darkening to the limb.
    """
    radius, angle = (np.arange(rings) + 0.5) / rings, (np.arange(around) + 0.5) / around
    angle = angle[:, None] * 2 * np.pi
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    dark = np.zeros_like(x)
    for east, north, wide, high, depth in _MARIA:
        oval = ((x - east) / wide) ** 2 + ((y - north) / high) ** 2
        dark = np.maximum(dark, depth / (1.0 + np.exp(np.minimum(5.0 * (oval - 1.0), 50.0))))
    face = 1.0 - dark
    return np.asarray(face / ((face * radius).sum() / (np.ones_like(x) * radius).sum()))


def _segment(sun: Sun, weight: float) -> Any:
    """Make the part of the disc above the horizon, as a mesh."""
    height = float(np.arcsin(sun.direction[2]) / SUN_RADIUS)
    half = float(np.arccos(np.clip(height, -1.0, 1.0)))  # of the arc below the horizon
    turn = np.linspace(half, 2 * np.pi - half, _ARC) - np.pi / 2
    rim = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(_ARC)])
    matrix = np.array(_facing(sun.direction).matrix, dtype=np.float64)
    vertices = rim @ matrix[:3, :3].T + matrix[:3, 3]
    fan = np.arange(1, _ARC - 1)
    faces = np.column_stack([np.zeros_like(fan), fan, fan + 1])
    properties = mi.Properties()
    radiance = {"type": "rgb", "value": sun.radiance.tolist()}
    emitter = {"type": "area", "radiance": radiance, "sampling_weight": weight}
    properties["emitter"] = load(emitter)
    mesh = mi.Mesh("sun", _ARC, len(faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = aligned(vertices, np.float32)
    parameters["faces"] = aligned(faces, np.uint32)
    parameters.update()
    return mesh
