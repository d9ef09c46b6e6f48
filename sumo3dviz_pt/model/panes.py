"""A pane of glass before the eye that reflects what lies under it.

It is thin and plane, and takes no light away: what it does not let through it reflects. A picture
through it is that share of what lies behind, and the rest of what its mirror image shows.

References:
    Born and Wolf, "Principles of Optics", 7th edition, 1.5.2 (Fresnel's formulas) and 1.6.4 (both
    faces of a plate whose reflections do not interfere: 2 R / (1 + R)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image, Transform

GLASS = 1.52
"""Index of refraction of soda-lime glass."""

_EDGE = 0.04
"""Within this of its edges a pane fades, so that none of them shows [m]."""


_STEEPEST = 1e-6
"""Rays that run along a pane by less than this as a slope meet it nowhere."""


@dataclass(frozen=True, slots=True, eq=False)
class Pane:
    """A plane pane.

    Attributes:
        world_from_pane: Its placement: +x across to the left, +y up along the glass; its origin is
            the middle of its lower edge [m].
        size: Width and height [m].
    """

    world_from_pane: Transform
    size: tuple[float, float]


def reflectance(cosine: Floats) -> Floats:
    """Return the share of unpolarised light that a thin pane reflects, (n,) in [0, 1].

    Args:
        cosine: Between the light and the pane's normal, (n,) in [0, 1].
    """
    within = np.sqrt(1.0 - (1.0 - cosine**2) / GLASS**2)
    across = (cosine - GLASS * within) / (cosine + GLASS * within)
    along = (within - GLASS * cosine) / (within + GLASS * cosine)
    one_face = 0.5 * (across**2 + along**2)
    return np.asarray(2.0 * one_face / (1.0 + one_face))


def reflection_samples(samples: int) -> int:
    """Return the samples of a pixel's reflection, by those of the picture behind the pane.

    A quarter is enough of what is a tenth as bright.
    """
    return max(2, samples // 4)


def reflected_share(pane: Pane, eye: Floats, directions: Floats, distance: Image) -> Image:
    """Return how much of each pixel is what a pane reflects, (h, w) in [0, 1].

    Args:
        pane: Before the eye.
        eye: Where that is, (3,) [m].
        directions: Unit, through the pixels' centres, (h, w, 3).
        distance: Of what is seen, (h, w) [m]; what is nearer than the pane hides it.
    """
    frame = pane.world_from_pane.matrix
    left, up, ahead = frame[:3, :3].T
    slope = directions @ ahead
    steep = np.where(np.abs(slope) > _STEEPEST, slope, np.inf)
    away = float((frame[:3, 3] - eye) @ ahead) / steep
    met = eye + directions * away[..., None] - frame[:3, 3]
    height = pane.size[1]
    inside = 0.5 * np.array(pane.size) - np.abs(
        np.stack([met @ left, met @ up - 0.5 * height], axis=-1)
    )
    cover = np.clip(inside.min(axis=-1) / _EDGE, 0.0, 1.0) * (away > 0.0) * (distance > away)
    return np.asarray(cover * reflectance(np.clip(np.abs(slope), 0.0, 1.0)), np.float32)
