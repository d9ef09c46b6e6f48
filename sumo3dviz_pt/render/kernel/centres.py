"""What rays through given places of all pixels meet first: facts, without light and chance.

These rays are not the picture's: its samples lie where chance puts them. A ray through the centre
of each pixel tells what is exactly there, whatever seed, samples and quality a picture has, and a
picture does not depend on whether it was asked.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.render.kernel.eye import Eye
from sumo3dviz_pt.render.kernel.paths import Place

WIDTHS: Mapping[str, int] = {
    "depth": 1,
    "face": 1,
    "instance": 1,
    "corners": 2,
    "normals": 3,
    "albedo": 3,
}
"""Channels of everything that can be asked for.

`depth` is the distance from the eye along the ray [m], 0 where nothing was met; `face` the number
of the face in the tables, `instance` Mitsuba's number of the instance or 0, `corners` where in the
face it was met: weights of its second and third corner; `normals` unit shading normals; `albedo`
reflectance.
"""

CENTRE = (0.5, 0.5)
"""The middle of a pixel, in widths and heights of it."""


def met_through(
    place: Place,
    eye: Eye,
    wanted: Collection[str],
    at: tuple[float, float] = CENTRE,
    *,
    size: tuple[int, int],
) -> dict[str, Image]:
    """Return what rays through one place of every pixel meet first, by name.

    Only what is asked for is compiled and read from the tables.

    Args:
        place: What the rays go through.
        eye: What the rays come from; all go through the middle of its lens.
        wanted: Names of `WIDTHS`.
        at: Where in the pixels, in widths and heights of one.
        size: Width, height of the picture [px].
    """
    width, height = size
    pixel = dr.arange(mi.UInt32, width * height)
    columns, rows = dr.opaque(mi.UInt32, width), dr.opaque(mi.UInt32, height)
    row = pixel // columns
    across = mi.Float(pixel - row * columns) + dr.opaque(mi.Float, at[0])
    down = mi.Float(row) + dr.opaque(mi.Float, at[1])
    point = mi.Point2f(across / mi.Float(columns), down / mi.Float(rows))
    ray = eye.ray(point, mi.Point2f(0.5))
    found = place.solids.nearest(ray, True)
    # Rays may begin a little before the eye.
    found.t += eye.lead(ray)
    channels = {name: _channels(name, place, found, ray) for name in WIDTHS if name in wanted}
    dr.schedule(channels)
    return {
        name: np.stack([np.array(one) for one in some], axis=-1)
        .reshape(height, width, len(some))
        .squeeze(axis=-1 if len(some) == 1 else ())
        for name, some in channels.items()
    }


def _channels(name: str, place: Place, found: Any, ray: Any) -> list[Any]:
    """Return the channels of one thing that was asked for."""
    there = mi.Bool(found.is_valid())
    if name == "depth":
        return [dr.select(there, found.t, 0.0)]
    if name == "instance":
        return [dr.select(there, dr.reinterpret_array(mi.UInt32, found.instance), 0)]
    if name == "corners":
        return [dr.select(there, one, 0.0) for one in found.prim_uv]
    surface = place.surfaces.met(found, ray, mi.Bool(True))
    if name == "face":
        return [dr.select(surface.there, surface.face, 0)]
    if name == "normals":
        normal = mi.Vector3f(surface.si.sh_frame.n)
        return [dr.select(surface.there, one, 0.0) for one in normal]
    albedo = surface.finish.colour
    if place.surfaces.foreign:
        si = found.compute_surface_interaction(ray, mi.RayFlags.All, surface.foreign)
        theirs = si.bsdf().eval_diffuse_reflectance(si, surface.foreign)
        albedo = dr.select(surface.foreign, theirs, albedo)
    return [dr.select(surface.there, one, 0.0) for one in albedo]
