"""Where rays of a picture begin: Mitsuba's camera, one of our lenses, or a pane that mirrors.

A plain pinhole stays Mitsuba's `perspective`, so that its rays are what they were to the bit and
kernels of scenes without other lenses stay the same. Any other lens is a few operations of the
kernel; its numbers are no part of the kernel's code. Rays that a pane turns back begin on it, and
show what it reflects.

References:
    Cook, Porter and Carpenter, "Distributed ray tracing", SIGGRAPH 1984,
        doi:10.1145/800031.808590: depth of field by points on the lens.
"""

from __future__ import annotations

from typing import Any, Protocol

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.model.falling import Pane
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.convert import NEAR_CLIP, WHOLE, PicturePart

_FARTHEST = 1e7
"""Of what a lens can be focused on [m]; farther is infinity in single precision."""


class DrJitMath:
    """What rays are worked out with in the kernel; see `ArrayMath` in `model/projections.py`."""

    def cos(self, value: Any) -> Any:
        """Return cosines."""
        return dr.cos(value)

    def sincos(self, value: Any) -> tuple[Any, Any]:
        """Return sines and cosines."""
        sine, cosine = dr.sincos(value)
        return sine, cosine

    def hypot(self, one: Any, other: Any) -> Any:
        """Return lengths of two sides together."""
        return dr.sqrt(one * one + other * other)

    def arctan2(self, one: Any, other: Any) -> Any:
        """Return angles of which two sides are given, the far one first."""
        return dr.atan2(one, other)

    def arcsin(self, value: Any) -> Any:
        """Return angles of sines."""
        return dr.asin(value)

    def sqrt(self, value: Any) -> Any:
        """Return roots."""
        return dr.sqrt(value)

    def floor(self, value: Any) -> Any:
        """Return the next lower whole numbers."""
        return dr.floor(value)

    def clip(self, value: Any, low: Any, high: Any) -> Any:
        """Return values within bounds."""
        return dr.clip(value, low, high)

    def sinc(self, value: Any) -> Any:
        """Return sines over their angles, 1 at 0."""
        return dr.select(value > 1e-6, dr.sin(value) / dr.maximum(value, 1e-6), 1.0)

    def select(self, where: Any, one: Any, other: Any) -> Any:
        """Return one value where something holds, and another elsewhere."""
        return dr.select(where, one, other)

    def stretch(self, slopes: Any, distortion: Any) -> Any:
        """Return the factor by which distortion stretches slopes."""
        first, second = distortion
        square = slopes * slopes
        return 1.0 + square * (first + second * square)


_DRJIT = DrJitMath()


class SensorEye:
    """The rays of one of Mitsuba's cameras.

    Args:
        sensor: The camera.
    """

    is_blurred = False

    def __init__(self, sensor: Any) -> None:
        self._sensor = sensor

    def ray(self, place: Any, on_lens: Any) -> Any:
        """Return rays through places of the picture.

        Args:
            place: Shares of its width and height from the upper left corner.
            on_lens: Where on the lens, two numbers in [0, 1).
        """
        return self._sensor.sample_ray(0.0, 0.5, place, on_lens)[0]

    def lead(self, ray: Any) -> Any:
        """Return how far before the eye rays begin [m]."""
        along = dr.dot(ray.d, self._sensor.world_transform() @ mi.Vector3f(0.0, 0.0, 1.0))
        return dr.opaque(mi.Float, NEAR_CLIP) / along


class LensEye:
    """The rays of one of our lenses.

    Args:
        view: Where it is and what it sees with.
        origin: The loaded scene's, (3,) [m].
        size: Width, height of the picture [px].
        part: Of the picture, that is traced.
    """

    def __init__(
        self, view: View, origin: Floats, size: tuple[int, int], part: PicturePart = WHOLE
    ) -> None:
        self._lens = lens = view.lens
        self.is_blurred = lens.aperture > 0.0
        matrix = view.world_from_camera.matrix
        self._turn = [_vector(matrix[:3, k]) for k in range(3)]
        self._position = _vector(matrix[:3, 3] - origin)
        width, height = lens.eye_size(size)
        self._across, self._upwards = (_number(one) for one in lens.edges(height / width))
        self._shift = _number(lens.shift)
        self._part = [_number(one) for one in (part.column, part.row, 1.0 / part.of)]
        self._is_part = part.of > 1

    def ray(self, place: Any, on_lens: Any) -> Any:
        """Return rays through places of the picture; arguments as in `SensorEye.ray`."""
        x, y = place.x, place.y
        if self._is_part:
            column, row, share = self._part
            x, y = (x + column) * share, (y + row) * share
        x, y, shift = self._eyes(x, y)
        left, up = self._across * (1.0 - 2.0 * x), self._upwards * (1.0 - 2.0 * y)
        start, direction = self._traced(left, up, shift)
        if self.is_blurred:
            start, direction = self._refracted(start, direction, on_lens)
        ahead, aside, upwards = self._turn
        there = ahead * start.x + aside * start.y + upwards * start.z
        towards = ahead * direction.x + aside * direction.y + upwards * direction.z
        return mi.Ray3f(mi.Point3f(self._position + there), dr.normalize(towards))

    def lead(self, ray: Any) -> Any:
        """Return 0: rays begin where the lens is [m]."""
        return mi.Float(0.0)

    def _eyes(self, x: Any, y: Any) -> tuple[Any, Any, Any]:
        """Return places in one eye's picture, and how far that eye is to the left [m]."""
        lens = self._lens
        if lens.stereo == "none":
            return x, y, self._shift
        beside = lens.stereo == "side_by_side"
        along = x if beside else y
        second = along >= 0.5
        along = 2.0 * along - dr.select(second, 1.0, 0.0)
        half = _number(0.5 * lens.eye_distance)
        shift = dr.select(second, -half, half)
        return (along, y, shift) if beside else (x, along, shift)

    def _traced(self, left: Any, up: Any, shift: Any) -> tuple[Any, Any]:
        """Return where rays begin and their directions, in the camera's frame."""
        kind, bent = self._lens.kind, None
        if any(self._lens.distortion):
            first, second = self._lens.distortion
            bent = (_number(first), _number(second))
        start, direction = kind.rays(_DRJIT, left, up, shift=shift, distortion=bent)
        towards = mi.Vector3f(*direction)
        return mi.Vector3f(*start), dr.normalize(towards) if kind.is_flat else towards

    def _refracted(self, start: Any, direction: Any, on_lens: Any) -> tuple[Any, Any]:
        """Return rays from points on the lens that meet where it is focused."""
        lens = self._lens
        radius, focus = _number(lens.aperture), _number(min(lens.focus, _FARTHEST))
        disk = mi.warp.square_to_uniform_disk_concentric(on_lens) * radius
        if lens.kind.is_flat:
            offset = mi.Vector3f(0.0, disk.x, disk.y)
            sharp = direction * (focus / direction.x)
        else:
            frame = mi.Frame3f(direction)
            offset = frame.s * disk.x + frame.t * disk.y
            sharp = direction * focus
        return start + offset, dr.normalize(sharp - offset)


class Eye(Protocol):
    """Where rays of a picture begin.

    Attributes:
        is_blurred: Whether its lens has an opening.
    """

    is_blurred: bool

    def ray(self, place: Any, on_lens: Any) -> Any:
        """Return rays through places of the picture; arguments as in `SensorEye.ray`."""

    def lead(self, ray: Any) -> Any:
        """Return how far before the eye rays begin [m]."""


def eye_of(
    sensor: Any, view: View, origin: Floats, *, size: tuple[int, int], part: PicturePart = WHOLE
) -> Eye:
    """Return the eye of a view.

    Args:
        sensor: One of Mitsuba's, aimed at what is to be seen, if that is what a pinhole sees.
        view: Of the whole picture.
        origin: The loaded scene's, (3,) [m].
        size: Width, height of the picture or of each of its parts [px].
        part: What is seen of the picture.
    """
    if view.lens.is_pinhole:
        return SensorEye(sensor)
    return LensEye(view, origin, size, part)


def _number(value: float) -> Any:
    """Return a number that is no part of the kernel's code."""
    return dr.opaque(mi.Float, float(value))


def _vector(values: Floats) -> Any:
    """Return a vector that is no part of the kernel's code."""
    return mi.Vector3f(*(_number(value) for value in values))


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
