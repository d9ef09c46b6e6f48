"""Rays of an eye after a pane before it has turned them back: what it reflects."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.panes import Pane
from sumo3dviz_pt.render.kernel.eye import Eye

_STEEPEST = 1e-4
"""Rays that run along a pane by less than this as a slope meet it nowhere."""


class PaneEye:
    """The rays of an eye, mirrored by a pane. They begin on it, so nothing behind it is met.

    Args:
        eye: Whose rays these are.
        pane: Before it.
        origin: The loaded scene's, (3,) [m].
    """

    def __init__(self, eye: Eye, pane: Pane, origin: Floats) -> None:
        self._eye, self.is_blurred = eye, eye.is_blurred
        matrix = pane.world_from_pane.matrix
        self._foot = _vector(matrix[:3, 3] - origin)
        self._ahead = _vector(matrix[:3, 2])

    def ray(self, place: Any, on_lens: Any) -> Any:
        """Return mirrored rays through places of the picture; arguments as the eye's."""
        ray = self._eye.ray(place, on_lens)
        slope = dr.dot(ray.d, self._ahead)
        steep = dr.abs(slope) > _STEEPEST
        away = dr.dot(self._foot - mi.Vector3f(ray.o), self._ahead) / dr.select(steep, slope, 1.0)
        start = ray.o + ray.d * dr.select(steep, away, 0.0)
        return mi.Ray3f(start, ray.d - 2.0 * slope * self._ahead)

    def lead(self, ray: Any) -> Any:
        """Return 0: rays begin on the pane [m]."""
        return mi.Float(0.0)


def _vector(values: Floats) -> Any:
    """Return a vector that is no part of the kernel's code."""
    return mi.Vector3f(*(dr.opaque(mi.Float, float(value)) for value in values))
