"""Cloth that is no plain surface: creases, wrinkles, patches, hems and dark hollows.

Large creases move vertices; what is smaller than the mesh tilts its normals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.skin import SkinPart, smooth_normals, turns
from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, area_vectors, unit


@dataclass(frozen=True, slots=True, eq=False)
class Folds:
    """Creases of a cloth as waves in space.

    Attributes:
        waves: Wave vectors, (w, 3) [rad/m].
        shifts: Their phases, (w,) [rad].
    """

    waves: Floats
    shifts: Floats

    @classmethod
    def of(cls, seed: int, *, slant: float = 0.5) -> Folds:
        """Draw creases.

        Args:
            seed: The same seed gives the same folds.
            slant: 0 lays them level around the body, 1 lets them hang down.
        """
        rng = np.random.default_rng(seed)
        length = rng.uniform(0.10, 0.30, 5)
        turn = rng.uniform(0.0, 2.0 * np.pi, 5)
        rise = np.radians(90.0) * (1.0 - slant) + rng.normal(0.0, 0.45, 5)
        level = np.cos(rise)
        waves = np.stack([level * np.cos(turn), level * np.sin(turn), np.sin(rise)], axis=1)
        return cls(waves * (2.0 * np.pi / length)[:, None], rng.uniform(0.0, 2.0 * np.pi, 5))

    def __call__(self, points: Floats) -> Floats:
        """Return the displacement at points, (..., 3): about [-1, 1], (...)."""
        waves = np.cos(points @ self.waves.T + self.shifts)
        # Sharp valleys between broad swells, as cloth has them.
        return np.asarray(2.0 - 3.3 * np.abs(waves).mean(axis=-1) + 0.5 * waves.mean(axis=-1))


def creased(rings: Floats, folds: Folds, depth: Floats | float) -> Floats:
    """Push rings, (k, m, 3), out and in by folds.

    Args:
        rings: (k, m, 3) [m].
        folds: Creases of the cloth.
        depth: Of the folds, for each ring, (k,), or for all [m].
    """
    away = rings - rings.mean(axis=1, keepdims=True)
    away /= np.linalg.norm(away, axis=2, keepdims=True) + 1e-9
    deep = np.broadcast_to(np.asarray(depth, dtype=np.float64), len(rings))
    return np.asarray(rings + away * (pressed(folds(rings)) * deep[:, None])[..., None])


def pressed(waves: Floats) -> Floats:
    """Limit folds to what a body leaves room for: they rise freely and hardly press in."""
    return np.asarray(np.maximum(waves, -0.35))


def bulges(
    rings: Floats, along: Floats, *, joint: float, wide: float, deep: float, seed: int
) -> Floats:
    """Return the folds that cloth throws about a joint that bends by a radian, (k, m, 3) [m].

    Args:
        rings: Of the cloth at rest, (k, m, 3) [m].
        along: Where the rings are on the limb, (k,) [m].
        joint: Where the limb bends [m].
        wide: How far from it folds reach [m].
        deep: How far they stand out [m].
        seed: Of the folds.
    """
    away = rings - rings.mean(axis=1, keepdims=True)
    away = away / (np.linalg.norm(away, axis=2, keepdims=True) + 1e-9)
    apart = (along - joint)[:, None]
    turn = turns(rings.shape[1])[None, :]
    shift = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 3)
    wave = np.cos(2.0 * np.pi * apart / 0.062 + 1.3 * np.cos(turn + shift[0]) + shift[1])
    wave += 0.6 * np.cos(2.0 * np.pi * apart / 0.10 + 2.0 * np.cos(turn + shift[2]))
    size = deep * np.exp(-((apart / wide) ** 2)) * np.maximum(wave, -0.5)
    return np.asarray(size[..., None] * away)


_Print = Callable[[Floats, Floats, Floats], Floats]
"""Returns the factor of colours, (n, 3), of quads by row from the hem, by column, and by level."""


def _factor(where: Floats | Bools, colour: Colour) -> Floats:
    """Return a colour where something is 1, and white where it is 0, (n, 3)."""
    return np.asarray(1.0 + where[:, None] * (np.array(colour) - 1.0))


def _stripes(row: Floats, column: Floats, level: Floats) -> Floats:
    """Level stripes in navy on what is pale, dark on what is not."""
    return _factor((row % 3 == 1) & (level < 0.80), (0.10, 0.12, 0.20))


def _checks(row: Floats, column: Floats, level: Floats) -> Floats:
    """Checks, as of flannel."""
    across, down = row % 3 == 0, column % 3 == 0
    return _factor(across, (0.42, 0.30, 0.30)) * _factor(down, (0.42, 0.30, 0.30))


def _yoke(row: Floats, column: Floats, level: Floats) -> Floats:
    """Shoulders and chest darker than what is below, as of many jackets."""
    return _factor(level > 0.735, (0.22, 0.22, 0.24))


def _chest(row: Floats, column: Floats, level: Floats) -> Floats:
    """One broad band around the chest."""
    return _factor(np.abs(level - 0.70) < 0.022, (0.20, 0.12, 0.12))


def _sides(row: Floats, column: Floats, level: Floats) -> Floats:
    """Panels down both sides, as of sportswear; columns count from 0 to 1."""
    aside = np.abs(np.abs((column + 0.5) % 1.0 - 0.5) - 0.25) < 0.075
    return _factor(aside, (0.12, 0.12, 0.14))


def _block(row: Floats, column: Floats, level: Floats) -> Floats:
    """Darker below the chest, as of a dress of two cloths."""
    return _factor(level < 0.645, (0.30, 0.28, 0.34))


PRINTS: Mapping[str, _Print] = {
    "stripes": _stripes,
    "checks": _checks,
    "yoke": _yoke,
    "chest": _chest,
    "sides": _sides,
    "block": _block,
}
"""What cloth can be printed or sewn with, by name."""


def printed(piece: SkinPart, columns: int, name: str, *, height: float) -> SkinPart:
    """Print on a tube.

    Args:
        piece: Quads row by row from its hem, then its lids.
        columns: Points of a ring.
        name: One of `PRINTS`.
        height: Stature of the wearer [m].
    """
    quad = np.arange(len(piece.faces)) // 2
    column = quad % columns
    level = piece.vertices[piece.faces].mean(axis=1)[:, 2] / height
    # Both triangles of a quad are alike.
    level = np.bincount(quad, level)[quad] / np.bincount(quad)[quad]
    where = (column + 0.5) / columns if name == "sides" else column.astype(np.float64)
    some = np.unique(quad, return_index=True)[1]
    factors = PRINTS[name]((quad // columns)[some].astype(np.float64), where[some], level[some])
    tint = np.ones((len(piece.faces), 3)) if piece.tint is None else piece.tint
    return replace(piece, tint=tint * factors[quad])


def banded(piece: SkinPart, columns: int) -> SkinPart:
    """Darken the inside of an open end, and a little the hem above it.

    Args:
        piece: A tube that begins with the ring of `hemmed`.
        columns: Points of a ring.
    """
    shade = np.ones(len(piece.faces))
    shade[: 2 * columns] = 0.6
    shade[2 * columns : 4 * columns] = 0.86
    return replace(piece, shade=shade if piece.shade is None else shade * piece.shade)


def uneven(piece: SkinPart, seed: int, *, patches: float) -> SkinPart:
    """Let a piece be paler and darker in patches, and dark where it is hollow.

    Args:
        piece: At rest.
        seed: The same seed gives the same patches.
        patches: How much they differ, as a share of the reflectance.
    """
    rng = np.random.default_rng(seed)
    waves = rng.normal(0.0, 1.0, (6, 3))
    waves *= (2.0 * np.pi / rng.uniform(0.35, 0.90, 6) / np.linalg.norm(waves, axis=1))[:, None]
    at = piece.vertices[piece.faces].mean(axis=1)
    noise = np.cos(at @ waves.T + rng.uniform(0.0, 2.0 * np.pi, 6)).sum(axis=1) / 3.0
    hollow = _hollows(piece)[piece.faces].mean(axis=1)
    shade = 1.0 + patches * np.clip(noise, -1.0, 1.0) - np.clip(0.6 * hollow, -0.03, 0.10)
    return replace(piece, shade=shade if piece.shade is None else shade * piece.shade)


_WRINKLES = 7
_STEEP = 0.30
"""How steep the sides of a wrinkle are."""

_AMONG_FOLDS, _STEEPEST = 0.6, 0.78
"""How much of the wrinkles there is among folds, and how steep both may be together."""


def wrinkled(piece: SkinPart, seed: int) -> SkinPart:
    """Let a piece of cloth catch light as if it were wrinkled.

    Args:
        piece: At rest.
        seed: The same seed gives the same wrinkles.
    """
    rng = np.random.default_rng(seed)
    # Most wrinkles lie across limbs and trunk, and slant.
    rise, turn = rng.normal(0.0, 0.6, _WRINKLES), rng.uniform(0.0, 2.0 * np.pi, _WRINKLES)
    ways = np.stack(
        [np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), np.cos(rise)], axis=1
    )
    lengths = rng.uniform(0.085, 0.17, _WRINKLES)
    theta = piece.vertices @ (2.0 * np.pi * ways / lengths[:, None]).T
    theta = theta + rng.uniform(0.0, 2.0 * np.pi, _WRINKLES)
    # Each is there in some places only, and steeper on one side.
    where = rng.normal(0.0, 1.0, (_WRINKLES, 3)) * 9.0
    there = np.clip(0.25 + np.cos(piece.vertices @ where.T + 2.0 * theta[:1]), 0.0, 1.0)
    steep = _STEEP * there * (np.sin(theta) + 0.45 * np.sin(2.0 * theta))
    slopes = steep @ ways
    if piece.slopes is not None:
        slopes = piece.slopes + _AMONG_FOLDS * slopes
    size = np.linalg.norm(slopes, axis=1, keepdims=True)
    slopes = slopes * np.minimum(1.0, (0.42 if piece.slopes is None else _STEEPEST) / (size + 1e-9))
    return replace(piece, slopes=slopes * _smooth(piece)[:, None])


def _smooth(piece: SkinPart) -> Floats:
    """Return 1 where a surface is smooth, and 0 at its sharp edges, (n,)."""
    normals = smooth_normals(piece.vertices[None], piece.faces)[0]
    flat = unit(area_vectors(piece.vertices[None], piece.faces)[0])
    agree = np.einsum("mki,mi->mk", normals[piece.faces], flat)
    least = np.ones(len(piece.vertices))
    np.minimum.at(least, piece.faces.reshape(-1), agree.reshape(-1))
    return smoothstep(0.45, 0.85, least)


def _hollows(piece: SkinPart) -> Floats:
    """Return how far the neighbours of vertices stand out, as a share of their distance, (n,)."""
    faces, points = piece.faces, piece.vertices
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    away = points[ends[:, 1]] - points[ends[:, 0]]
    normals = smooth_normals(points[None], faces)[0]
    out = (away * normals[ends[:, 0]]).sum(axis=1)
    count = np.bincount(ends[:, 0], minlength=len(points)) + 1e-9
    size = np.bincount(ends[:, 0], np.linalg.norm(away, axis=1), len(points)) / count + 1e-6
    return np.asarray(np.bincount(ends[:, 0], out, len(points)) / count / size)
