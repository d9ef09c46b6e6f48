"""A frame as it was traced, which is what a film stores and what frames know of each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.layers import Layers, MovingPart
from sumo3dviz_pt.model.scene import View


@dataclass(frozen=True, eq=False)
class TracedFrame:
    """A frame as it was traced, neither denoised nor hazed.

    Attributes:
        layers: `radiance`, `albedo`, `normal`, `hit`, `depth`, `ids` and `first_depth`; see
            `model/layers.py`. Others stay as they are.
        view: Of the camera.
        white: Radiance that is shown as white, scene units.
        samples: Of each pixel.
        parts: What the numbers of `ids` stand for, from 1 on.
    """

    layers: Layers
    view: View
    white: float = 1.0
    samples: int = 1
    parts: tuple[MovingPart, ...] = ()

    @cached_property
    def numbers(self) -> NDArray[np.int32]:
        """The layer `ids`, as whole numbers, (h, w)."""
        return self.layers["ids"].astype(np.int32)
