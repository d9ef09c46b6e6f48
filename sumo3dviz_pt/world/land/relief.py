"""Hills at the world's edge: heights and field colours as functions of the place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy import ndimage

from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal, smoothstep
from sumo3dviz_pt.model.geometry import Floats, settled

_TILE = 14_000.0  # the relief repeats after this far [m]
_FIELD = 210.0  # width of a field [m]
_SIZE = 256
_EDGE: Literal["grid-wrap"] = "grid-wrap"  # it repeats


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """Noise over the plane, as coefficients of cubic splines.

    Attributes:
        swell: Hills, (n, n); their values lie in about [-2, 2].
        woods: Where forests stand, (n, n), in the same range.
    """

    swell: Floats
    woods: Floats

    def heights(self, points: Floats, away: Floats) -> Floats:
        """Return height above the plain, (n,) [m], never below it.

        Level near what is built, then low hills, and from 5 km on ridges that
        close the horizon also for eyes high above the roads.

        Args:
            points: (n, 2) [m].
            away: Distance from what is built, (n,) [m].
        """
        share = np.clip(0.5 + 0.27 * _sampled(self.swell, points, _TILE), 0.0, 1.0)
        rolling = 62.0 * smoothstep(450.0, 1900.0, away) * share
        ridges = 170.0 * smoothstep(1500.0, 5200.0, away) * (0.45 + 0.55 * share)
        return np.asarray(rolling + ridges)

    def wooded(self, points: Floats, away: Floats) -> Floats:
        """Return how likely a place bears forest, (n,) in [0, 1]; hills more than plains."""
        bias = 0.9 * smoothstep(500.0, 3000.0, away) - 0.55
        value = _sampled(self.woods, points, 2300.0) + bias
        return smoothstep(-0.12, 0.12, value)


@lru_cache(maxsize=4)
def relief(seed: int) -> Relief:
    """Return the relief of a seed; the same everywhere and always."""
    swell = fractal((_SIZE, _SIZE), Spectrum(2.0, 4.0, 60.0), seed=seed)
    woods = fractal((_SIZE, _SIZE), Spectrum(1.6, 3.0, 60.0), seed=seed + 1)
    return Relief(*(ndimage.spline_filter(noise, order=3, mode=_EDGE) for noise in (swell, woods)))


def field_tints(points: Floats, mean: Floats, *, seed: int, variety: float) -> Floats:
    """Reflectance of the fields that places lie in, (n, 3).

    Args:
        points: (n, 2) [m].
        mean: Reflectance of the ground nearby, (3,).
        seed: Of their colours.
        variety: 0 gives the mean everywhere, 1 meadows, crops and stubble.
    """
    # Strips of land lie askew, or they would show the axes of the grid.
    x, y = points.T
    turned = np.column_stack([0.86 * x - 0.51 * y, 0.51 * x + 0.86 * y])
    cell = np.floor(settled(turned / [_FIELD, 0.6 * _FIELD])).astype(np.int64)
    number = (cell[:, 0] * 73_856_093) ^ (cell[:, 1] * 19_349_663)
    pick = np.random.default_rng(seed).random(4096)[number % 4096]
    palette = np.array(
        [[1.0, 1.0, 1.0], [0.82, 0.9, 0.85], [1.25, 1.12, 1.05], [1.9, 1.35, 1.6], [0.9, 1.08, 0.8]]
    )
    factor = palette[(pick * len(palette)).astype(np.int64)]
    return np.asarray(mean * (1.0 + variety * (factor - 1.0)))


def _sampled(splines: Floats, points: Floats, tile: float) -> Floats:
    """Periodic noise at places, smoothly interpolated, (n,)."""
    at = points.T / tile * len(splines)
    found = ndimage.map_coordinates(splines, at, order=3, mode=_EDGE, prefilter=False)
    return np.asarray(found)
