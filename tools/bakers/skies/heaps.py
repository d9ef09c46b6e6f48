"""Where cumulus stand, and how far points lie inside them: heaps of rising bubbles.

Cloud sizes follow a power law: a few large, many small. They gather where broad noise is high.
Each is a family of towers, each tower a stack of bubbles that shrink upwards, with smaller bubbles
on their shoulders; all stand on one level.

References:
    R. A. J. Neggers, H. J. J. Jonker and A. P. Siebesma, Size statistics of cumulus cloud
    populations in large-eddy simulations, J. Atmos. Sci. 60(8), 2003 (the power law).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bakers.skies.recipe import CloudRecipe
from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal
from sumo3dviz_pt.model.geometry import Bools, Floats, Image

VOXEL = 40.0
"""Length of the field's voxels [m]."""

OUTSIDE = 240.0
"""Farthest distance from a cloud that is told [m]."""

_SMALLEST, _STEEPNESS = 260.0, 1.15
_MOST = 6000  # clouds that are tried


@dataclass(frozen=True, slots=True, eq=False)
class Heaps:
    """How far inside a cloud the points of a periodic grid lie.

    Attributes:
        inside: Distance to the surface, negative outside, (up, north, east) [m].
        column: Height of cloud over each place, (north, east) [m].
    """

    inside: Image
    column: Image


def make_heaps(recipe: CloudRecipe) -> Heaps:
    """Let clouds grow until they cover the share of the ground that a recipe asks for."""
    rng = np.random.default_rng(recipe.seed)
    levels = int(np.ceil(recipe.depth / VOXEL)) + 5
    across = round(recipe.span / VOXEL)
    inside = np.full((levels, across, across), -OUTSIDE, np.float32)
    places = _places(recipe, rng=rng)
    largest = 1.5 * recipe.cell
    sizes = (_SMALLEST * rng.pareto(_STEEPNESS, _MOST) + _SMALLEST).clip(None, largest)
    # The largest come first: what is small fills up what is left to cover.
    sizes = np.concatenate([np.sort(sizes[:40])[::-1], sizes[40:]])
    shadow = np.zeros((across, across), bool)
    for number, (place, size) in enumerate(zip(places, sizes, strict=True)):
        if number % 8 == 0 and shadow.mean() >= recipe.cover:
            break
        for centre, radius in _bubbles(float(size), recipe.depth, rng=rng):
            _blow(inside, shadow, centre + np.array([*place, 0.0]), radius)
    column = (inside > 0.0).sum(axis=0).astype(np.float32) * np.float32(VOXEL)
    return Heaps(inside, column)


def _places(recipe: CloudRecipe, *, rng: np.random.Generator) -> Floats:
    """Draw places that gather in broad patches, (n, 2) [m]."""
    waves = recipe.span / recipe.cell
    broad = fractal((256, 256), Spectrum(1.2, 1.0, 0.45 * waves), seed=recipe.seed + 2)
    weight = np.exp(recipe.clumped * broad).ravel()
    cells = rng.choice(weight.size, _MOST, p=weight / weight.sum())
    corner = np.stack([cells % 256, cells // 256], axis=-1)
    return np.asarray((corner + rng.random((_MOST, 2))) * (recipe.span / 256))


def _bubbles(size: float, depth: float, *, rng: np.random.Generator) -> list[tuple[Floats, float]]:
    """Return the bubbles of one cloud: centres, (3,) over its foot, and radii [m]."""
    half, high = 0.5 * size, depth * (1.0 - np.exp(-0.75 * size / depth)) * rng.uniform(0.7, 1.0)
    found: list[tuple[Floats, float]] = []
    stretch, turn = rng.uniform(1.0, 2.0), rng.uniform(0.0, np.pi)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    for _ in range(2 + int(size / 260.0)):
        away = half * np.sqrt(rng.random()) * 0.85
        around = rng.uniform(0.0, 2 * np.pi)
        foot = (away * np.array([np.cos(around) * stretch, np.sin(around) / stretch])) @ axes
        top = high * (1.0 - 0.75 * (away / half) ** 2) * rng.uniform(0.35, 1.0)
        radius, level = min(0.42 * half, 320.0) * rng.uniform(0.6, 1.1), 0.0
        while True:
            centre = np.array([*(foot + rng.normal(0.0, 0.22 * radius, 2)), level])
            found.append((centre, radius))
            for _ in range(3):
                side = rng.normal(0.0, 1.0, 3)
                side[2] = abs(side[2]) * 0.8
                side *= radius / np.linalg.norm(side)
                found.append((centre + side, radius * rng.uniform(0.3, 0.55)))
            level += 0.75 * radius
            if level + radius > top:
                break
            radius *= rng.uniform(0.80, 0.98)
    return found


def _blow(inside: Image, shadow: Bools, centre: Floats, radius: float) -> None:
    """Add one bubble to the grid, and to the ground that is covered."""
    reach = radius + OUTSIDE
    low = np.floor((centre - reach) / VOXEL).astype(int)
    high = np.ceil((centre + reach) / VOXEL).astype(int) + 1
    level = slice(max(low[2] + 2, 0), max(min(high[2] + 2, len(inside)), 0))
    axes = [(np.arange(low[axis], high[axis])) for axis in (0, 1)]
    up = ((np.arange(level.start, level.stop) - 1.5) * VOXEL - centre[2]) ** 2
    east, north = ((axis + 0.5) * VOXEL - centre[k] for k, axis in enumerate(axes))
    flat = (north[:, None] ** 2 + east[None, :] ** 2).astype(np.float32)
    made = np.float32(radius) - np.sqrt(up.astype(np.float32)[:, None, None] + flat)
    rows, columns = (axis % len(shadow) for axis in (axes[1], axes[0]))
    part = np.ix_(np.arange(level.start, level.stop), rows, columns)
    inside[part] = np.maximum(inside[part], made)
    shadow[np.ix_(rows, columns)] |= flat < radius**2
