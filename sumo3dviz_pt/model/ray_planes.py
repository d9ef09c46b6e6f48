"""A lens's rays as whole pictures are worked on: in single precision, one axis after the other."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.lens import Lens


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
