"""What a camera sees with: it answers where rays go and where things lie in the picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Image

Points = TypeVar("Points", Floats, Image)
"""Coordinates in double or single precision."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole with square pixels. The camera's frame is +x forward, +y left, +z up.

    Attributes:
        opening: Horizontal opening angle [rad].
    """

    opening: float

    @classmethod
    def of_degrees(cls, degrees: float) -> Lens:
        """Return a lens of an opening angle [deg]."""
        return cls(float(np.radians(degrees)))

    @property
    def half_width(self) -> float:
        """Half the picture's width one metre ahead [m]."""
        return float(np.tan(self.opening / 2.0))

    def half_diagonal(self, aspect: float) -> float:
        """Angle from the axis to a corner of a picture of height / width [rad]."""
        return float(np.arctan(self.half_width * np.hypot(1.0, aspect)))

    def pixel_angle(self, width: int) -> float:
        """Angle of a pixel of a picture so wide [px], on average [rad]."""
        return self.opening / width

    def pixel_width(self, width: float) -> float:
        """Width of a pixel in the middle of a picture so wide [px], one metre ahead [m]."""
        return 2.0 * self.half_width / width

    def length_of(self, share: float, away: Floats) -> Floats:
        """How long things are that take up a share of the picture's width, by distance [m]."""
        return np.asarray(share * 2.0 * self.half_width * away)

    def middle_part(self, count: int) -> Lens:
        """Return the lens of the middle one of so many equal parts side by side."""
        return replace(self, opening=float(2.0 * np.arctan(self.half_width / count)))

    def rays(self, size: tuple[int, int]) -> Floats:
        """Direction through every pixel's centre in the camera's frame, unit, (h, w, 3).

        Args:
            size: Width, height [px].
        """
        width, height = size
        half = self.half_width
        across = half * (1 - 2 * (np.arange(width) + 0.5) / width)
        up = half * (height / width) * (1 - 2 * (np.arange(height) + 0.5) / height)
        rays = np.ones((height, width, 3))
        rays[..., 1], rays[..., 2] = across[None, :], up[:, None]
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        return rays

    def ray(self, point: tuple[float, float], aspect: float) -> Floats:
        """Direction through a point of the picture in the camera's frame, unit, (3,).

        Args:
            point: Shares of width and height from the upper left corner.
            aspect: Height / width of the picture.
        """
        half = self.half_width
        across, up = half * (1.0 - 2.0 * point[0]), half * aspect * (1.0 - 2.0 * point[1])
        local = np.array([1.0, across, up])
        return np.asarray(local / np.linalg.norm(local))

    def project(self, points: Points, size: tuple[int, int]) -> tuple[Points, Bools]:
        """Return where points lie in a picture.

        Args:
            points: In the camera's frame, (..., 3) [m].
            size: Width, height [px].

        Returns:
            Row and column, (2, ...) [px], whole numbers at pixel centres; and whether the
            point lies ahead, (...).
        """
        width, height = size
        forward, left, up = np.moveaxis(points, -1, 0)
        ahead = forward > 0
        # px per unit of slope
        focal = width / (2 * self.half_width)
        per_depth = focal / np.where(ahead, forward, np.inf)  # in the points' precision
        row = (height - 1) / 2 - up * per_depth
        column = (width - 1) / 2 - left * per_depth
        return np.stack([row, column]), ahead

    def sees(self, points: Floats, aspect: float, *, margin: float = 0.0) -> Bools:
        """Return whether points lie in the picture, or beside it by no more than a margin.

        Args:
            points: In the camera's frame, (..., 3) [m].
            aspect: Height / width of the picture.
            margin: [m].
        """
        forward, left, up = np.moveaxis(points, -1, 0)
        half = self.half_width * forward
        beside = np.abs(left) < half + margin
        return np.asarray((forward > 0.0) & beside & (np.abs(up) < aspect * half + margin))

    def off_middle(self, points: Floats) -> Floats:
        """How far from the picture's middle points lie, across or up, in half its widths, (...).

        Points behind the camera or nearer than 1 m count as 1 m ahead.

        Args:
            points: In the camera's frame, (..., 3) [m].
        """
        across = np.abs(points[..., 1:]).max(axis=-1) / np.maximum(points[..., 0], 1.0)
        return np.asarray(across / self.half_width)

    def is_near_columns(self, points: Floats, *, widened: float, margin: float) -> Bools:
        """Return whether points lie in the columns of a wider picture or near them, at any height.

        Args:
            points: In the camera's frame, (..., 3) [m].
            widened: How many times as wide the picture is taken.
            margin: How far points may lie beside it, or behind the camera [m].
        """
        forward, left = points[..., 0], points[..., 1]
        room = widened * self.half_width * np.maximum(forward, 0.0) + margin
        return np.asarray((forward > -margin) & (np.abs(left) < room))


@lru_cache(maxsize=2)
def planes_of_rays(lens: Lens, size: tuple[int, int]) -> Image:
    """Return a lens's rays in single precision, one axis after the other, (3, h, w), read-only.

    Args:
        lens: Most films have one for all frames.
        size: Width, height [px].
    """
    rays = np.ascontiguousarray(np.moveaxis(lens.rays(size), -1, 0), dtype=np.float32)
    rays.setflags(write=False)
    return rays
