"""How cameras lay directions out in a picture: perspective, parallel, fisheye, equirectangular.

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

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.pictures import Projection as Projection
from sumo3dviz_pt.model.pictures import Stereo as Stereo

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
