"""A lens's rays as whole pictures are worked on: in single precision, one axis after the other."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.lens import Lens


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
