"""What is laid over a picture: shares of its pixels' light that something else gives instead.

Shares add up as optical depths do, so the order in which they are laid does not matter.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Floats, Image, Ints

_ROOM, _LEAST_ROOM = np.float32(0.02), np.float32(0.02)
"""How softly a surface hides what is behind it: share of the distance, and at least so far [m]."""


class Veil:
    """Collects what covers a picture, and the light that it gives.

    Args:
        distance: Of what each pixel sees, (h, w) [m]; any where it sees the sky.
        hit: Share of the pixel that sees anything but the sky, (h, w).
    """

    def __init__(self, distance: Image, hit: Image) -> None:
        self.size = distance.shape[1], distance.shape[0]
        self.distance, self.hit = distance.reshape(-1), hit.reshape(-1)
        self._depth: Floats = np.zeros(distance.size)
        self._light: Floats = np.zeros((3, distance.size))

    def seen(self, pixels: NDArray[Any], away: Image) -> Image:
        """Return how much of things is not hidden, [0, 1].

        Args:
            pixels: Flat numbers of the pixels that they are before.
            away: Their distances [m].
        """
        before = (self.distance[pixels] - away) / (_ROOM * away + _LEAST_ROOM) + np.float32(0.5)
        hit = self.hit[pixels]
        seen = 1 - hit + hit * np.clip(before, np.float32(0.0), np.float32(1.0))
        return np.asarray(seen, dtype=np.float32)

    def add(self, pixels: Ints, depths: Image, colours: Floats) -> None:
        """Cover pixels.

        Args:
            pixels: Flat numbers, (n,); one may occur many times.
            depths: Optical depths, (n,).
            colours: Radiance that comes instead, (n, 3).
        """
        count = len(self._depth)
        self._depth += np.bincount(pixels, weights=depths, minlength=count)
        for light, colour in zip(self._light, colours.T, strict=True):
            light += np.bincount(pixels, weights=depths * colour, minlength=count)

    def over(self, radiance: Image) -> Image:
        """Return a picture with what covers it, (h, w, 3)."""
        covered = np.flatnonzero(self._depth > 0.0)
        if not len(covered):
            return radiance
        depth = self._depth[covered]
        share = -np.expm1(-depth)
        laid = np.array(radiance, dtype=np.float32).reshape(-1, 3)
        light = self._light[:, covered] * (share / depth)
        laid[covered] = laid[covered] * (1.0 - share)[:, None] + light.T
        return laid.reshape(radiance.shape)
