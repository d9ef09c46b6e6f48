"""Sky, sun and sensors as Mitsuba's objects and dicts."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.render.skymap import SUN_RADIUS, SkyMap

SUN_DISTANCE = 1e6
"""Of the sun's disc: its direction differs by 0.06 degrees over a kilometre [m]."""


def sensor_entry(size: tuple[int, int], *, pixels: str, sampler: str, spp: int) -> dict[str, Any]:
    """A pinhole camera; place and opening angle come with each frame.

    Args:
        size: Width, height [px].
        pixels: `rgb` or `rgba`.
        sampler: Mitsuba's name of it.
        spp: Samples per pass.
    """
    width, height = size
    return {
        "type": "perspective",
        "fov": 50.0,
        "near_clip": 0.001,
        "far_clip": 1e7,
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "component_format": "float32",
            "pixel_format": pixels,
            # OIDN needs uncorrelated pixels; every filter but the box splats.
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": sampler, "sample_count": spp},
    }


def sky_entry(sky: SkyMap) -> Any:
    """The baked sky as an environment map; its columns already run clockwise from north."""
    return mi.load_dict(
        {
            "type": "envmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(sky.radiance, np.float32)),
            # Mitsuba's maps are y-up and put their first column at -z.
            "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
        }
    )


def sun_entry(sky: SkyMap) -> dict[str, Any]:
    """The sun as a disc so far away that its direction is the same everywhere."""
    if sky.sun is None:
        return {}
    place = sky.sun.direction * SUN_DISTANCE
    up = [0.0, 0.0, 1.0] if abs(place[2]) < 0.9 * SUN_DISTANCE else [0.0, 1.0, 0.0]
    towards_us = mi.ScalarTransform4f().look_at(
        origin=place.tolist(), target=[0.0, 0.0, 0.0], up=up
    )
    size = float(SUN_DISTANCE * np.tan(SUN_RADIUS))
    radiance = {"type": "rgb", "value": sky.sun.radiance.tolist()}
    disc = {
        "type": "disk",
        "to_world": towards_us @ mi.ScalarTransform4f().scale(size),
        "emitter": {"type": "area", "radiance": radiance},
    }
    return {"sun": mi.load_dict(disc)}
