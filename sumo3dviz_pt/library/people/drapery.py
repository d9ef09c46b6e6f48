"""Folds that cloth throws where it is pulled, bunched or hung: single ridges, each with a place.

A garment is a tube, and a point of it has two coordinates: how far around it lies, and how far
along. A fold is a ridge along a short line with a valley at its lower side. It moves vertices, and
tilts normals beyond that, because a fold is narrower than a mesh for films is fine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.skin import SkinPart
from sumo3dviz_pt.model.geometry import Floats, unit

_SHARPENED = (0.40, 1.35)
"""How much more than the vertices tell normals are tilted: around, where that would soon turn them
from who looks along the surface, and along."""

_HOLLOW = 0.24
"""How much darker the deepest valleys are, as a share."""


class Fold(NamedTuple):
    """One fold at rest.

    Attributes:
        around: Of its middle: 0 in front, 0.25 at the left, 0.5 behind [turns].
        along: Of its middle [m].
        length: [m].
        slant: Of its line: 0 runs around to the left, 90 along [deg].
        wide: Half width of the ridge [m].
        high: [m].
    """

    around: float
    along: float
    length: float
    slant: float
    wide: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Drapery:
    """Folds of a garment.

    Attributes:
        folds: All of them, (k, 6) as in `Fold`.
        girth: Around the garment [m].
    """

    folds: Floats
    girth: float

    @classmethod
    def of(cls, folds: Sequence[Fold], girth: float, *, seed: int) -> Drapery:
        """Scatter folds a little; the same seed gives the same cloth."""
        rng = np.random.default_rng(seed)
        rows = np.array(folds, dtype=np.float64).reshape(-1, 6)
        some = rng.normal(0.0, 1.0, (len(rows), 6)).clip(-2.0, 2.0)
        rows[:, 0] += 0.018 * some[:, 0]
        rows[:, 1] += 0.012 * some[:, 1]
        rows[:, 2] *= 1.0 + 0.18 * some[:, 2]
        rows[:, 3] += 9.0 * some[:, 3]
        rows[:, 4] *= 1.0 + 0.15 * some[:, 4]
        rows[:, 5] *= 1.0 + 0.30 * some[:, 5]
        return cls(rows, girth)

    def height(self, around: Floats, along: Floats) -> Floats:
        """Return how far cloth stands out at places around [turns] and along [m], any shape."""
        if not len(self.folds):
            return np.zeros(np.broadcast_shapes(around.shape, along.shape))
        turn, place, length, slant, wide, high = self.folds.T
        apart = around[..., None] - turn
        s = (apart - np.round(apart)) * self.girth
        t = along[..., None] - place
        c, n = np.cos(np.radians(slant)), np.sin(np.radians(slant))
        share = (s * c + t * n) / length
        # A fold is a bent line.
        across = (t * c - s * n + 0.10 * length * (2.0 * share) ** 2) / wide
        ends = smoothstep(0.62, 0.22, np.abs(share))
        ridge = np.exp(-(across**2)) - 0.48 * np.exp(-(((across + 1.7) / 1.15) ** 2))
        return np.asarray((high * ends * ridge).sum(axis=-1))

    def slopes(self, around: Floats, along: Floats) -> Floats:
        """Return how steeply cloth rises around and along, (..., 2)."""
        step = 0.004
        s = self.height(around + step / self.girth, along) - self.height(
            around - step / self.girth, along
        )
        t = self.height(around, along + step) - self.height(around, along - step)
        return np.stack([s, t], axis=-1) / (2.0 * step)


def draped(
    rings: Floats, along: Floats, drapery: Drapery, *, room: Floats | float = 1.0
) -> tuple[Floats, Floats]:
    """Return what folds do to smooth rings, (k, m, 3) [m], of equal angles from front to left.

    Args:
        rings: The cloth, with or without the folds.
        along: Where each ring is, (k,) [m].
        drapery: The folds.
        room: How much of a fold there is at each ring, (k,), or everywhere.

    Returns:
        What tilts the normals of vertices, (k, m, 3), and the shade of each vertex, (k, m).
    """
    turn = np.arange(rings.shape[1]) / rings.shape[1] + 0.0 * along[:, None]
    place = along[:, None] + 0.0 * turn
    much = np.broadcast_to(np.asarray(room, dtype=np.float64), len(rings))[:, None]
    aside = unit(np.roll(rings, -1, axis=1) - np.roll(rings, 1, axis=1))
    way = np.gradient(rings, axis=0) / np.gradient(along)[:, None, None]
    steep = np.array(_SHARPENED) * much[..., None] * drapery.slopes(turn, place)
    valley = np.clip(-much * drapery.height(turn, place) / 0.006, 0.0, 1.0)
    return steep[..., :1] * aside + steep[..., 1:] * unit(way), 1.0 - _HOLLOW * valley


def pushed(rings: Floats, along: Floats, drapery: Drapery, *, room: Floats | float = 1.0) -> Floats:
    """Let rings, (k, m, 3) [m], throw folds; all else is as in `draped`."""
    turn = np.arange(rings.shape[1]) / rings.shape[1] + 0.0 * along[:, None]
    high = drapery.height(turn, along[:, None] + 0.0 * turn)
    high = high * np.broadcast_to(np.asarray(room, dtype=np.float64), len(rings))[:, None]
    out = unit(rings - rings.mean(axis=1, keepdims=True))
    return np.asarray(rings + high[..., None] * out)


def with_folds(piece: SkinPart, folds: tuple[Floats, Floats], *, first: int = 0) -> SkinPart:
    """Give a tube what `draped` returned of its rings.

    Args:
        piece: The tube; its lids, and rings that come first, keep plain normals.
        folds: Tilts, (k, m, 3), and shades, (k, m).
        first: How many rings come first, such as a hem's.
    """
    tilt, shade = folds
    count = tilt.shape[1]
    slopes, dark = np.zeros_like(piece.vertices), np.ones(len(piece.vertices))
    first *= count
    slopes[first : first + tilt.shape[0] * count] = tilt.reshape(-1, 3)
    dark[first : first + tilt.shape[0] * count] = shade.reshape(-1)
    own = dark[piece.faces].mean(axis=1)
    # Both triangles of a quad are alike.
    pairs = len(own) // 2 * 2
    own[:pairs] = np.repeat(own[:pairs].reshape(-1, 2).mean(axis=1), 2)
    return replace(piece, slopes=slopes, shade=own if piece.shade is None else own * piece.shade)


def trunk_folds(height: float, *, hem: float, loose: float) -> list[Fold]:
    """Return the folds of what hangs on a trunk: from the armpits, at the waist, over the hips.

    Args:
        height: Stature [m].
        hem: Level of the lower edge, as a share of it.
        loose: How much cloth there is: 1 for a shirt.
    """
    h, deep = height, 0.0125 * loose
    rows = []
    for s in (1.0, -1.0):
        # From the armpits to the middle, before and behind.
        for turn, level, length, slant, high in (
            *((0.16, 0.735, 0.15, 38.0, 0.9), (0.15, 0.70, 0.19, 52.0, 1.1)),
            *((0.19, 0.665, 0.16, 66.0, 0.9), (0.335, 0.745, 0.15, -36.0, 0.9)),
            *((0.345, 0.70, 0.20, -50.0, 1.2), (0.31, 0.655, 0.17, -66.0, 1.0)),
            *((0.40, 0.63, 0.15, -34.0, 0.9), (0.43, 0.77, 0.13, -20.0, 0.6)),
            *((0.46, 0.715, 0.13, -58.0, 0.7), (0.42, 0.665, 0.15, -24.0, 0.8)),
        ):
            rows.append(Fold(s * turn, level * h, length, s * slant, 0.022, high * deep))
        # Bunched at the waist, and slack at the sides above the hips.
        for turn, level, length, slant, high in (
            *((0.24, 0.615, 0.17, 12.0, 1.1), (0.27, 0.585, 0.19, -10.0, 1.2)),
            *((0.36, 0.60, 0.16, 16.0, 0.9), (0.12, 0.60, 0.15, -14.0, 0.8)),
            *((0.44, 0.575, 0.15, 8.0, 0.9), (0.22, 0.555, 0.16, 22.0, 1.0)),
        ):
            rows.append(Fold(s * turn, level * h, length, s * slant, 0.019, high * deep))
        # What hangs below runs down.
        below = max(hem + 0.02, 0.30)
        for turn, slant in ((0.20, 80.0), (0.33, 97.0), (0.08, 100.0), (0.43, 84.0)):
            low = 0.5 * (below + 0.56)
            length = max(0.56 - below, 0.05) * h
            rows.append(Fold(s * turn, low * h, length, s * slant, 0.026, 0.9 * deep))
    return rows


def sleeve_folds(elbow: float, end: float, *, high: float) -> list[Fold]:
    """Return the folds of a sleeve, by distance from the shoulder [m].

    Args:
        elbow: Where the arm bends [m].
        end: Where the sleeve ends [m].
        high: Of a mean fold [m].
    """
    rows = [
        Fold(0.10, elbow - 0.040, 0.16, 24.0, 0.013, 1.1 * high),
        Fold(-0.08, elbow - 0.012, 0.17, -20.0, 0.012, 1.3 * high),
        Fold(0.06, elbow + 0.016, 0.16, 14.0, 0.012, 1.3 * high),
        Fold(-0.10, elbow + 0.048, 0.15, -26.0, 0.013, 1.1 * high),
        Fold(0.42, elbow - 0.065, 0.13, 50.0, 0.014, 0.9 * high),
        Fold(0.30, 0.085, 0.14, 58.0, 0.016, 1.0 * high),
        Fold(-0.26, 0.115, 0.13, -52.0, 0.016, 1.0 * high),
        Fold(0.55, 0.145, 0.13, 40.0, 0.015, 0.9 * high),
        Fold(0.35, elbow + 0.085, 0.14, 36.0, 0.013, 1.0 * high),
        Fold(-0.30, elbow + 0.115, 0.14, -30.0, 0.012, 1.0 * high),
        Fold(0.15, elbow + 0.150, 0.14, 18.0, 0.011, 1.1 * high),
        Fold(0.60, elbow + 0.175, 0.14, -14.0, 0.011, 1.1 * high),
    ]
    return [row for row in rows if row.along < end - 0.015]


def trouser_folds(height: float, *, end: float, side: float, high: float) -> list[Fold]:
    """Return the folds of a trouser leg, by height over the ground [m].

    Args:
        height: Stature [m].
        end: Height of its lower edge [m].
        side: 1 left, -1 right.
        high: Of a mean fold [m].
    """
    h, s = height, side
    rows = [
        # From the crotch outward, before and behind.
        Fold(-s * 0.12, 0.475 * h, 0.17, -s * 30.0, 0.016, 1.2 * high),
        Fold(-s * 0.10, 0.445 * h, 0.16, -s * 46.0, 0.017, 1.0 * high),
        Fold(-s * 0.38, 0.470 * h, 0.18, s * 28.0, 0.016, 1.2 * high),
        Fold(-s * 0.40, 0.435 * h, 0.17, s * 44.0, 0.017, 1.0 * high),
        Fold(s * 0.20, 0.420 * h, 0.16, 74.0, 0.018, 0.8 * high),
        # Behind the knee, and over it.
        Fold(0.50, 0.312 * h, 0.17, s * 10.0, 0.013, 1.3 * high),
        Fold(0.46, 0.290 * h, 0.18, -s * 12.0, 0.012, 1.4 * high),
        Fold(0.54, 0.268 * h, 0.17, s * 16.0, 0.013, 1.2 * high),
        Fold(0.06, 0.318 * h, 0.13, -s * 28.0, 0.015, 0.9 * high),
        Fold(-0.05, 0.258 * h, 0.13, s * 24.0, 0.015, 1.0 * high),
        # Down the shin, and broken over the shoe.
        Fold(s * 0.22, 0.190 * h, 0.18, 66.0, 0.016, 0.9 * high),
        Fold(-s * 0.30, 0.170 * h, 0.18, 110.0, 0.016, 0.9 * high),
        Fold(0.02, 0.100 * h, 0.16, s * 22.0, 0.013, 1.2 * high),
        Fold(0.40, 0.088 * h, 0.17, -s * 18.0, 0.013, 1.2 * high),
        Fold(-0.06, 0.062 * h, 0.20, -s * 10.0, 0.012, 1.6 * high),
        Fold(0.55, 0.055 * h, 0.17, s * 12.0, 0.012, 1.2 * high),
    ]
    return [row for row in rows if row.along > end + 0.01]
