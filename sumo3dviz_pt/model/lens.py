"""A lens's rays as whole pictures are worked on: in single precision, one axis after the other.

What a camera sees with: it answers where rays go and where things lie in the picture.

How cameras lay directions out in a picture: perspective, parallel, fisheye, equirectangular.
Places in a picture are two numbers: `left` and `up` go from 1 at its left and upper edge to -1 at
its right and lower one. Directions are in the camera's frame, +x forward, +y left, +z up.

References:
    Fisheyes are equidistant: the angle from the axis is proportional to the distance from the
        picture's middle (Kannala and Brandt, IEEE TPAMI 28, 2006, doi:10.1109/TPAMI.2006.153).
    Distortion is radial, as OpenCV writes it (Brown, "Close-range camera calibration",
        Photogrammetric Engineering 37, 1971): r' = r (1 + k1 r^2 + k2 r^4), of slopes r.
    Omnidirectional stereo: Peleg, Ben-Ezra and Pritch, "Omnistereo: panoramic stereo imaging",
        IEEE TPAMI 23, 2001, doi:10.1109/34.910880.
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

Distortion = tuple[float, float]

_STEEPEST = 100.0
"""Slopes beyond this lie outside of any picture."""

NEWTON = 8
"""Steps that find a slope from where distortion puts it."""


def distorted(slopes: Floats, distortion: Distortion) -> Floats:
    """Return the factor by which distortion stretches slopes, of lengths (...).

    Where the polynomial would turn back, which is outside of any picture, slopes are only moved.
    """
    end = min(_turning(distortion), _STEEPEST)
    inside = np.minimum(slopes, end)
    square = np.square(inside)
    stretch = 1.0 + square * (distortion[0] + distortion[1] * square)
    outside = inside * stretch + (slopes - inside)
    return np.divide(outside, slopes, out=np.asarray(stretch), where=slopes > end)


def _turning(distortion: Distortion) -> float:
    """Return the least slope at which distortion turns back; infinite if it never does."""
    first, second = 3.0 * distortion[0], 5.0 * distortion[1]
    roots = np.roots([second, first, 1.0]) if any(distortion) else np.zeros(0)
    ends = [root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0]
    return float(np.sqrt(min(ends))) if ends else float("inf")


def undistorted(lengths: Floats, distortion: Distortion) -> Floats:
    """Return the slopes that distortion puts at lengths, (...)."""
    slopes = np.array(lengths, dtype=np.float64)
    for _ in range(NEWTON):
        square = np.square(slopes)
        value = slopes * distorted(slopes, distortion)
        steepness = 1.0 + square * (3.0 * distortion[0] + 5.0 * distortion[1] * square)
        slopes -= (value - lengths) / steepness
    return slopes


def folds(length: float, distortion: Distortion) -> bool:
    """Return whether distortion maps two slopes to one place, up to a length from the middle."""
    slopes = undistorted(np.linspace(0.0, length, 65), distortion)
    square = np.square(slopes)
    steep = 1.0 + square * (3.0 * distortion[0] + 5.0 * distortion[1] * square)
    back = slopes * distorted(slopes, distortion) - np.linspace(0.0, length, 65)
    return bool((steep <= 0.05).any() or (np.abs(back) > 1e-6).any() or (slopes < 0.0).any())


# Perspective ------------------------------------------------------------------------------------


def perspective_rays(left: Floats, up: Floats, distortion: Distortion) -> Floats:
    """Return unit directions of slopes to the left and up in a picture, (..., 3)."""
    if any(distortion):
        lengths = np.hypot(left, up)
        slopes = undistorted(lengths, distortion)
        stretch = np.divide(slopes, lengths, out=np.ones_like(slopes), where=lengths > 0)
        left, up = left * stretch, up * stretch
    rays = np.stack([np.ones_like(left), left, up], axis=-1)
    return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))


# Fisheye ----------------------------------------------------------------------------------------


def fisheye_rays(left: Floats, up: Floats) -> Floats:
    """Return unit directions of angles from the axis, to the left and up, (..., 3)."""
    angle = np.hypot(left, up)
    share = np.sinc(angle / np.pi)  # sin(angle) / angle
    return np.stack([np.cos(angle), share * left, share * up], axis=-1)


def fisheye_places(points: Floats) -> tuple[Floats, Floats]:
    """Return angles from the axis at which points, (..., 3), are seen: to the left and up."""
    forward, left, up = np.moveaxis(points, -1, 0)
    aside = np.hypot(left, up)
    angle = np.arctan2(aside, forward)
    scale = np.divide(angle, aside, out=np.zeros_like(angle), where=aside > 0)
    return left * scale, up * scale


# Equirectangular --------------------------------------------------------------------------------


def equirectangular_rays(turn: Floats, rise: Floats) -> Floats:
    """Return unit directions of angles to the left of the axis and above the horizon, (..., 3)."""
    flat = np.cos(rise)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), np.sin(rise)], axis=-1)


def circle_origins(turn: Floats, shift: float) -> Floats:
    """Return where the rays of an eye on the viewing circle begin, (..., 3) [m].

    Args:
        turn: Of the rays, to the left [rad].
        shift: Of the eye, to the left [m].
    """
    flat = np.zeros_like(turn)
    return np.stack([-shift * np.sin(turn), shift * np.cos(turn), flat], axis=-1)


def equirectangular_places(points: Floats, shift: float) -> tuple[Floats, Floats]:
    """Return at which turn and rise an eye on the viewing circle sees points, (..., 3) [rad].

    Args:
        points: In the camera's frame [m].
        shift: Of the eye, to the left [m].
    """
    forward, left, up = np.moveaxis(points, -1, 0)
    away = np.hypot(forward, left)
    turn = np.arctan2(left, forward)
    if shift == 0.0:
        return turn, np.arctan2(up, away)
    turn = turn - np.arcsin(np.clip(shift / np.maximum(away, 1e-12), -1.0, 1.0))
    turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
    along = np.sqrt(np.maximum(np.square(away) - shift**2, 0.0))
    return turn, np.arctan2(up, along)


def is_before(points: Floats, projection: Projection) -> Bools:
    """Return which points, (..., 3), can lie in a picture at all."""
    if projection in ("perspective", "orthographic"):
        return np.asarray(points[..., 0] > 0.0)
    return np.ones(points.shape[:-1], dtype=np.bool_)


Points = TypeVar("Points", Floats, Image)
"""Coordinates in double or single precision."""

Half = tuple[tuple[slice, slice], "Lens"]
"""A part of a picture, rows and columns, and what it is seen with."""

_WIDE = float(np.radians(179.0))
"""Rays farther than half of this from the axis have no slope [rad]."""

_FAR = 1e9
"""Where things that are infinitely far away are taken to be [m]."""


@dataclass(frozen=True, slots=True)
class Lens:
    """What rays a picture is made of. The camera's frame is +x forward, +y left, +z up.

    Without its further attributes it is a pinhole with square pixels.

    Attributes:
        opening: Horizontal opening angle [rad]; of parallel rays 0.
        projection: How directions are laid out; see `projections`.
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
    def from_dict(cls, said: dict[str, Any]) -> Lens:
        """Return a lens from what `as_dict` said of it."""
        bent: Any = {"distortion": tuple(said.get("distortion", (0.0, 0.0)))}
        return cls(**{**said, **bent})

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values, without those that a pinhole has."""
        plain = Lens(self.opening)
        names = (field.name for field in fields(self))
        own = [name for name in names if getattr(self, name) != getattr(plain, name)]
        return {name: getattr(self, name) for name in ("opening", *own)}

    # What kind it is --------------------------------------------------------------------------

    @property
    def is_pinhole(self) -> bool:
        """Whether it is a plain pinhole: perspective, sharp, straight, with one eye."""
        return replace(self, opening=0.0, focus=0.0) == _PLAIN

    @property
    def is_straight(self) -> bool:
        """Whether its picture is a plane before the eye without distortion."""
        return self.projection == "perspective" and not any(self.distortion)

    @property
    def sees_around(self) -> bool:
        """Whether it sees what is beside it or behind, so that slopes say nothing."""
        return self.projection in ("fisheye", "equirectangular") and self.opening >= _WIDE

    @property
    def has_one_centre(self) -> bool:
        """Whether all rays go through one point, up to its aperture."""
        return self.projection != "orthographic" and self.stereo == "none" and self.shift == 0.0

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
        return float(np.tan(min(self.opening, _WIDE) / 2.0))

    @property
    def free_opening(self) -> float:
        """Opening angle of a pinhole that shows about as much, as far as one can [rad]."""
        return self.opening if self.is_straight else float(np.clip(self.opening, 1.0, 2.0))

    @property
    def turn(self) -> float:
        """Share of a whole turn that it sees, at most 1."""
        return min(self.opening / (2.0 * np.pi), 1.0)

    def edges(self, aspect: float) -> tuple[float, float]:
        """What the left and the upper edge of one eye's picture of height / width stand for.

        Slopes in a perspective picture, metres of parallel rays, else angles [rad].
        """
        if self.projection == "equirectangular":
            return 0.5 * self.opening, 0.5 * np.pi
        if self.projection == "fisheye":
            return 0.5 * self.opening, 0.5 * self.opening * aspect
        half = 0.5 * self.width if self.projection == "orthographic" else self.half_width
        return half, half * aspect

    def half_diagonal(self, aspect: float) -> float:
        """Angle from the axis to the farthest corner of a picture of height / width [rad]."""
        aspect = self.eye_aspect(aspect)
        if self.projection == "fisheye":
            return float(min(np.pi, self.opening / 2.0 * np.hypot(1.0, aspect)))
        if self.projection == "equirectangular":
            return float(max(self.opening / 2.0, np.pi / 2.0))
        if self.projection == "orthographic":
            return float(np.pi)
        corner = self.half_width * np.hypot(1.0, aspect)
        if any(self.distortion):
            corner = float(undistorted(np.array(corner), self.distortion))
        return float(np.arctan(corner))

    def pixel_angle(self, width: int, *, away: float = 100.0) -> float:
        """Angle of a pixel of a picture so wide [px], on average [rad].

        Args:
            width: Of the picture [px].
            away: Of what parallel rays show [m]; others do without it.
        """
        width = self.eye_size((width, 0))[0]
        if self.projection == "orthographic":
            return self.width / width / away
        return self.opening / width

    def pixel_width(self, width: float) -> float:
        """Width of a pixel in the middle of a picture so wide [px], one metre ahead [m]."""
        width = width / 2.0 if self.stereo == "side_by_side" else width
        if self.projection == "orthographic":
            return self.width / width
        if self.projection == "perspective":
            return 2.0 * self.half_width / width
        return self.opening / width

    def length_of(self, share: float, away: Floats) -> Floats:
        """How long things are that take up a share of the picture's width, by distance [m]."""
        if self.projection == "orthographic":
            return np.full_like(away, share * self.width)
        if self.projection == "perspective":
            return np.asarray(share * 2.0 * self.half_width * away)
        return np.asarray(share * self.opening * away)

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
            return self._rays(across, upwards, height / width)
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
        across, upwards = self.edges(height / width)
        left = across * (1 - 2 * (np.arange(width) + 0.5) / width)
        if self.projection == "equirectangular":
            return circle_origins(np.broadcast_to(left, (height, width)), self.shift)
        if self.projection == "orthographic":
            up = upwards * (1 - 2 * (np.arange(height) + 0.5) / height)
            origins[..., 1], origins[..., 2] = left[None, :], up[:, None]
        origins[..., 1] += self.shift
        return origins

    def ray(self, point: tuple[float, float], aspect: float) -> Floats:
        """Direction through a point of the picture in the camera's frame, unit, (3,).

        Args:
            point: Shares of width and height from the upper left corner.
            aspect: Height / width of the picture.
        """
        if not self.is_straight:
            place = np.array([1.0 - 2.0 * point[0], 1.0 - 2.0 * point[1]])
            return self._rays(place[0], place[1], aspect)
        half = self.half_width
        across, up = half * (1.0 - 2.0 * point[0]), half * aspect * (1.0 - 2.0 * point[1])
        local = np.array([1.0, across, up])
        return np.asarray(local / np.linalg.norm(local))

    def _rays(self, left: Floats, up: Floats, aspect: float) -> Floats:
        """Return unit directions through places of one eye's picture, (..., 3)."""
        across, upwards = self.edges(aspect)
        if self.projection == "equirectangular":
            return equirectangular_rays(across * left, upwards * up)
        if self.projection == "fisheye":
            return fisheye_rays(across * left, upwards * up)
        if self.projection == "orthographic":
            return np.broadcast_to((1.0, 0.0, 0.0), (*left.shape, 3)).copy()
        return perspective_rays(across * left, upwards * up, self.distortion)

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
            return np.asarray(place, points.dtype), is_before(exact, self.projection)
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
        if self.projection == "equirectangular":
            turn, rise = equirectangular_places(points, self.shift)
            return turn / across, rise / upwards
        forward, left, up = np.moveaxis(points - (0.0, self.shift, 0.0), -1, 0)
        if self.projection == "fisheye":
            left, up = fisheye_places(np.stack([forward, left, up], axis=-1))
        elif self.projection == "perspective":
            ahead = np.where(forward > 0, forward, np.inf)
            left, up = left / ahead, up / ahead
            stretch = distorted(np.hypot(left, up), self.distortion)
            left, up = left * stretch, up * stretch
        return left / across, up / upwards

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
            return np.asarray(inside & is_before(points, self.projection))
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
        if self.projection == "orthographic":
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
        if self.projection == "orthographic":
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
