"""What cameras become in Mitsuba: sensors, and what is set in them for each view."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render import convert


@dataclass(frozen=True, slots=True)
class PicturePart:
    """A part of a picture that is cut into as many rows as columns.

    Attributes:
        row: From the top, from 0.
        column: From the left, from 0.
        of: Rows, and columns.
    """

    row: int = 0
    column: int = 0
    of: int = 1


WHOLE = PicturePart()

_OTHERS = 1.0
"""Opening angle that Mitsuba's camera has where it is not what rays come from [rad]."""

NEAR_CLIP = 0.001
"""How far before the eye rays begin, along the axis [m]."""


def sensor_entry(size: tuple[int, int], *, pixels: str, sampler: str, spp: int) -> dict[str, Any]:
    """Return a pinhole camera; place and opening angle come with each frame.

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
        "near_clip": NEAR_CLIP,
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


def view_parameters(view: View, origin: Floats) -> dict[str, Any]:
    """Return a sensor's parameters for a view, by name.

    Args:
        view: What it sees.
        origin: The loaded scene's, (3,) [m].
    """
    # Rays of other lenses are our own; a sensor is only their film then.
    opening = view.lens.opening if view.lens.is_pinhole else _OTHERS
    return {
        "to_world": convert.transform(convert.sensor_matrix(view, origin)),
        "x_fov": float(np.degrees(opening)),
    }


def part_parameters(view: View, origin: Floats, part: PicturePart) -> dict[str, Any]:
    """Return a sensor's parameters for a part of a view's picture, by name.

    Args:
        view: Of the whole picture.
        origin: The loaded scene's, (3,) [m].
        part: What the sensor sees of it.
    """
    if not view.lens.is_pinhole:
        return view_parameters(view, origin)
    narrowed = replace(view, lens=view.lens.middle_part(part.of))
    # From the picture's middle to the part's, in widths and heights of the part.
    middle = (part.of - 1) / 2.0
    return {
        **view_parameters(narrowed, origin),
        "principal_point_offset_x": part.column - middle,
        "principal_point_offset_y": part.row - middle,
    }
