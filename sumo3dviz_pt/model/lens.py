"""What a camera sees with: where rays go and where things lie in the picture.

How directions are laid out is said in `model/projections.py`. A picture may be one of both eyes.
Work on whole pictures takes rays in single precision, one axis after the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.numbers import Projection as Projection
from sumo3dviz_pt.model.numbers import Stereo as Stereo
from sumo3dviz_pt.model.projections import (
    KINDS,
    NUMPY,
    WIDE,
    Distortion,
    Fisheye,
    Triple,
    turning,
)

Points = TypeVar("Points", Floats, Image)
"""Coordinates in double or single precision."""

Half = tuple[tuple[slice, slice], "Lens"]
"""A part of a picture, rows and columns, and what it is seen with."""

_FAR = 1e9
"""Where things that are infinitely far away are taken to be [m]."""


@dataclass(frozen=True, slots=True)
class Lens:
    """What rays a picture is made of. The camera's frame is +x forward, +y left, +z up.

    Without its further attributes it is a pinhole with square pixels.

    Attributes:
        opening: Horizontal opening angle [rad]; of parallel rays 0.
        projection: How directions are laid out; see `model/projections.py`.
        width: Of what parallel rays show [m].
        aperture: Radius of the hole through which light comes [m]; 0 is a point.
        focus: Distance at which things are sharp [m]: along the axis for perspective pictures,
            along the ray for others.
        distortion: Radial, k1 and k2 of OpenCV, of perspective pictures.
        stereo: Whether both eyes' pictures are in one, and how.
        eye_distance: Between both eyes [m].
        shift: Of the eye from the camera to the left [m].
    """

    opening: float
    projection: Projection = "perspective"
    width: float = 0.0
    aperture: float = 0.0
    focus: float = float("inf")
    distortion: Distortion = (0.0, 0.0)
    stereo: Stereo = "none"
    eye_distance: float = 0.063
    shift: float = 0.0

    @classmethod
    def of_degrees(cls, degrees: float) -> Lens:
        """Return a lens of an opening angle [deg]."""
        return cls(float(np.radians(degrees)))

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Lens:
        """Return a lens from what `as_dict` said of it."""
        bent: Any = {"distortion": tuple(content.get("distortion", (0.0, 0.0)))}
        return cls(**{**content, **bent})

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values, without those that a pinhole has."""
        plain = Lens(self.opening)
        names = (field.name for field in fields(self))
        own = [name for name in names if getattr(self, name) != getattr(plain, name)]
        return {name: getattr(self, name) for name in ("opening", *own)}

    # What kind it is --------------------------------------------------------------------------

    @property
    def kind(self) -> Fisheye:
        """What is known of its projection."""
        return KINDS[self.projection]

    @property
    def is_pinhole(self) -> bool:
        """Whether it is a plain pinhole: perspective, sharp, straight, with one eye."""
        return replace(self, opening=0.0, focus=0.0) == _PLAIN

    @property
    def is_straight(self) -> bool:
        """Whether its picture is a plane before the eye without distortion."""
        return self.kind.is_flat and not any(self.distortion)

    @property
    def sees_around(self) -> bool:
        """Whether it sees what is beside it or behind, so that slopes say nothing."""
        kind = self.kind
        return not (kind.is_flat or kind.is_parallel) and self.opening >= WIDE

    @property
    def has_one_centre(self) -> bool:
        """Whether all rays go through one point, up to its aperture."""
        return not self.kind.is_parallel and self.stereo == "none" and self.shift == 0.0

    def halves(self, size: tuple[int, int]) -> Iterator[Half]:
        """Yield the parts of a picture and their lenses: the left eye's, then the right eye's.

        Args:
            size: Width, height of the whole picture [px].
        """
        width, height = size
        if self.stereo == "none":
            yield (slice(0, height), slice(0, width)), self
            return
        half = 0.5 * self.eye_distance
        beside = self.stereo == "side_by_side"
        for number, shift in enumerate((half, -half)):
            one = replace(self, stereo="none", shift=shift)
            if beside:
                columns = slice(number * width // 2, (number + 1) * width // 2)
                yield (slice(0, height), columns), one
            else:
                rows = slice(number * height // 2, (number + 1) * height // 2)
                yield (rows, slice(0, width)), one

    def eye_size(self, size: tuple[int, int]) -> tuple[int, int]:
        """Return width, height of one eye's picture [px] in one of a size [px]."""
        width, height = size
        if self.stereo == "side_by_side":
            return width // 2, height
        return (width, height // 2) if self.stereo == "top_bottom" else size

    def eye_aspect(self, aspect: float) -> float:
        """Return height / width of one eye's picture in one of height / width."""
        return aspect * {"none": 1.0, "side_by_side": 2.0, "top_bottom": 0.5}[self.stereo]

    # Its angles -------------------------------------------------------------------------------

    @property
    def half_width(self) -> float:
        """Half the picture's width one metre ahead [m]; at most that of 179 degrees."""
        return float(np.tan(min(self.opening, WIDE) / 2.0))

    @property
    def free_opening(self) -> float:
        """Opening angle of a pinhole that shows about as much, as far as one can [rad]."""
        return self.opening if self.is_straight else float(np.clip(self.opening, 1.0, 2.0))

    @property
    def turning(self) -> float:
        """Slope from which on distortion only moves slopes; outside of any picture."""
        return turning(self.distortion)

    @property
    def turn(self) -> float:
        """Share of a whole turn that it sees, at most 1."""
        return min(self.opening / (2.0 * np.pi), 1.0)

    def edges(self, aspect: float) -> tuple[float, float]:
        """What the left and the upper edge of one eye's picture of height / width stand for.

        Slopes in a perspective picture, metres of parallel rays, else angles [rad].
        """
        return self.kind.edges(self, aspect)

    def half_diagonal(self, aspect: float) -> float:
        """Angle from the axis to the farthest corner of a picture of height / width [rad]."""
        return self.kind.half_diagonal(self, self.eye_aspect(aspect))

    def pixel_angle(self, width: int, *, away: float = 100.0) -> float:
        """Angle of a pixel of a picture so wide [px], on average [rad].

        Args:
            width: Of the picture [px].
            away: Of what parallel rays show [m]; others do without it.
        """
        width = self.eye_size((width, 0))[0]
        if self.kind.is_parallel:
            return self.width / width / away
        return self.opening / width

    def pixel_width(self, width: float) -> float:
        """Width of a pixel in the middle of a picture so wide [px], one metre ahead [m]."""
        width = width / 2.0 if self.stereo == "side_by_side" else width
        return self.kind.pixel_width(self, width)

    def length_of(self, share: float, away: Floats) -> Floats:
        """How long things are that take up a share of the picture's width, by distance [m]."""
        return self.kind.length_of(self, share, away)

    def middle_part(self, count: int) -> Lens:
        """Return the lens of the middle one of so many equal parts side by side."""
        return replace(self, opening=float(2.0 * np.arctan(self.half_width / count)))

    # Rays -------------------------------------------------------------------------------------

    def rays(self, size: tuple[int, int]) -> Floats:
        """Direction through every pixel's centre in the camera's frame, unit, (h, w, 3).

        Args:
            size: Width, height [px].
        """
        width, height = size
        if self.stereo != "none":
            rays = np.empty((height, width, 3))
            for part, lens in self.halves(size):
                rays[part] = lens.rays(self.eye_size(size))
            return rays
        left = 1 - 2 * (np.arange(width) + 0.5) / width
        up = 1 - 2 * (np.arange(height) + 0.5) / height
        if not self.is_straight:
            across, upwards = np.broadcast_arrays(left[None, :], up[:, None])
            return self._directions(across, upwards, height / width)
        half = self.half_width
        rays = np.ones((height, width, 3))
        rays[..., 1], rays[..., 2] = half * left[None, :], half * (height / width) * up[:, None]
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        return rays

    def origins(self, size: tuple[int, int]) -> Floats | None:
        """Where rays through pixels' centres begin in the camera's frame, (h, w, 3) [m].

        Args:
            size: Width, height [px].

        Returns:
            None where all begin at the camera.
        """
        width, height = size
        if self.has_one_centre:
            return None
        origins = np.zeros((height, width, 3))
        if self.stereo != "none":
            for part, lens in self.halves(size):
                origins[part] = lens.origins(self.eye_size(size))
            return origins
        left = 1 - 2 * (np.arange(width) + 0.5) / width
        up = 1 - 2 * (np.arange(height) + 0.5) / height
        starts, _ = self._traced(left[None, :], up[:, None], height / width)
        for axis, start in enumerate(starts):
            origins[..., axis] = start
        return origins

    def ray(self, point: tuple[float, float], aspect: float) -> Floats:
        """Direction through a point of the picture in the camera's frame, unit, (3,).

        Args:
            point: Shares of width and height from the upper left corner.
            aspect: Height / width of the picture.
        """
        if not self.is_straight:
            place = np.array([1.0 - 2.0 * point[0], 1.0 - 2.0 * point[1]])
            return self._directions(place[0], place[1], aspect)
        half = self.half_width
        across, up = half * (1.0 - 2.0 * point[0]), half * aspect * (1.0 - 2.0 * point[1])
        local = np.array([1.0, across, up])
        return np.asarray(local / np.linalg.norm(local))

    def _directions(self, left: Floats, up: Floats, aspect: float) -> Floats:
        """Return unit directions through places of one eye's picture, (..., 3)."""
        _, direction = self._traced(left, up, aspect)
        rays = np.stack(np.broadcast_arrays(*direction, left)[:3], axis=-1)
        if not self.kind.is_flat:
            return rays
        return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))

    def _traced(self, left: Floats, up: Floats, aspect: float) -> tuple[Triple, Triple]:
        """Return where rays through places of one eye's picture begin, and their directions."""
        across, upwards = self.edges(aspect)
        bent = self.distortion if any(self.distortion) else None
        return self.kind.rays(NUMPY, across * left, upwards * up, shift=self.shift, distortion=bent)

    # Places -----------------------------------------------------------------------------------

    def project(self, points: Points, size: tuple[int, int]) -> tuple[Points, Bools]:
        """Return where points lie in a picture; in one with both eyes, in the left eye's.

        Args:
            points: In the camera's frame, (..., 3) [m].
            size: Width, height [px].

        Returns:
            Row and column, (2, ...) [px], whole numbers at pixel centres; and whether the
            point can be seen at all: in a perspective picture, whether it lies ahead, (...).
        """
        width, height = size
        if self.stereo != "none":
            _, lens = next(self.halves(size))
            return lens.project(points, self.eye_size(size))
        if not self.is_straight or self.shift:
            exact = np.asarray(points, np.float64)
            left, up = self._places(exact, height / width)
            place = np.stack([(height * (1.0 - up) - 1.0) / 2.0, (width * (1.0 - left) - 1.0) / 2])
            return np.asarray(place, points.dtype), self._is_before(exact)
        forward, left, up = np.moveaxis(points, -1, 0)
        ahead = forward > 0
        # px per unit of slope
        focal = width / (2 * self.half_width)
        per_depth = focal / np.where(ahead, forward, np.inf)  # in the points' precision
        row = (height - 1) / 2 - up * per_depth
        column = (width - 1) / 2 - left * per_depth
        return np.stack([row, column]), ahead

    def at_infinity(self, directions: Floats) -> Floats:
        """Return points so far away in directions, (..., 3), that it matters not whence [m]."""
        return directions if self.has_one_centre else directions * _FAR

    def _places(self, points: Floats, aspect: float) -> tuple[Floats, Floats]:
        """Return where points, (..., 3), lie: 1 at the left and upper edge, -1 opposite."""
        across, upwards = self.edges(aspect)
        with np.errstate(divide="ignore", invalid="ignore"):
            left, up = self.kind.places(NUMPY, self, tuple(np.moveaxis(points, -1, 0)))
        return left / across, up / upwards

    def _is_before(self, points: Floats) -> Bools:
        """Return which points, (..., 3), can lie in a picture at all."""
        return np.asarray((points[..., 0] > 0.0) | self.kind.sees_behind)

    def sees(self, points: Floats, aspect: float, *, margin: float = 0.0) -> Bools:
        """Return whether points lie in the picture, or beside it by no more than a margin.

        Args:
            points: In the camera's frame, (..., 3) [m].
            aspect: Height / width of the picture.
            margin: [m].
        """
        aspect = self.eye_aspect(aspect)
        if not self.is_straight:
            left, up = self._places(points, aspect)
            away = np.maximum(np.linalg.norm(points, axis=-1), 1e-9)
            room = margin / self.length_of(0.5, away)
            inside = (np.abs(left) < 1.0 + room) & (np.abs(up) < 1.0 + room / aspect)
            return np.asarray(inside & self._is_before(points))
        forward, left, up = np.moveaxis(points, -1, 0)
        half = self.half_width * forward
        beside = np.abs(left) < half + margin
        return np.asarray((forward > 0.0) & beside & (np.abs(up) < aspect * half + margin))

    def off_middle(self, points: Floats) -> Floats:
        """How far from the picture's middle points lie, across or up, in half its widths, (...).

        Points behind the camera or nearer than 1 m count as 1 m ahead. A lens that sees around
        it has everything in its middle.

        Args:
            points: In the camera's frame, (..., 3) [m].
        """
        across = np.abs(points[..., 1:]).max(axis=-1)
        if self.sees_around:
            return np.zeros_like(across)
        if self.kind.is_parallel:
            return np.asarray(across / (0.5 * self.width))
        return np.asarray(across / np.maximum(points[..., 0], 1.0) / self.half_width)

    def is_near_columns(self, points: Floats, *, widened: float, margin: float) -> Bools:
        """Return whether points lie in the columns of a wider picture or near them, at any height.

        Args:
            points: In the camera's frame, (..., 3) [m].
            widened: How many times as wide the picture is taken.
            margin: How far points may lie beside it, or behind the camera [m].
        """
        forward, left = points[..., 0], points[..., 1]
        if self.sees_around:
            return np.ones(forward.shape, dtype=np.bool_)
        if self.kind.is_parallel:
            return np.asarray(np.abs(left) < 0.5 * widened * self.width + margin)
        room = widened * self.half_width * np.maximum(forward, 0.0) + margin
        return np.asarray((forward > -margin) & (np.abs(left) < room))


_PLAIN = Lens(0.0, focus=0.0)


def planes_of_rays(lens: Lens, size: tuple[int, int]) -> Image:
    """Return a lens's rays in single precision, one axis after the other, (3, h, w), read-only.

    Args:
        lens: Most films have one for all frames.
        size: Width, height [px].
    """
    # Focus may change from frame to frame; rays through the middle of the lens do not.
    return _planes(replace(lens, aperture=0.0, focus=float("inf")), size)


@lru_cache(maxsize=2)
def _planes(lens: Lens, size: tuple[int, int]) -> Image:
    """Return what `planes_of_rays` does."""
    rays = np.ascontiguousarray(np.moveaxis(lens.rays(size), -1, 0), dtype=np.float32)
    rays.setflags(write=False)
    return rays
