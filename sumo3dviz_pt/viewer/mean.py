"""A picture that improves while nothing moves: the mean of its samples, and its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.live import Live

_CHANNELS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Mean:
    """Samples of one picture, added up in two halves.

    Attributes:
        halves: Sums of radiance, depth and hits of even and odd samples, (2, h, w, 5).
        count: Samples that were added.
    """

    halves: Image
    count: int

    @classmethod
    def empty(cls, size: tuple[int, int]) -> Mean:
        """Begin a picture of a width and height [px], without any sample."""
        return cls(np.zeros((2, size[1], size[0], _CHANNELS), dtype=np.float32), 0)

    @classmethod
    def of(cls, sample: Image) -> Mean:
        """Begin a picture with a sample, (h, w, 5)."""
        return cls(np.stack([sample, np.zeros_like(sample)]), 1)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.halves.shape[2], self.halves.shape[1]

    def with_sample(self, sample: Image) -> Mean:
        """Add a sample, (h, w, 5); the sums are changed in place."""
        self.halves[self.count % 2] += sample
        return Mean(self.halves, self.count + 1)

    @property
    def value(self) -> Image:
        """The mean of all samples, (h, w, 5)."""
        return np.asarray(self.halves.sum(axis=0) / max(self.count, 1))

    def error(self, live: Live, view: View, *, extra: float) -> float | None:
        """Return the standard error of the shown picture [8-bit codes]; None if it is unknown yet.

        Half the difference between the pictures of two independent halves has the same
        variance as their mean.

        Args:
            live: Develops the picture.
            view: Of its camera.
            extra: Further exposure [EV].
        """
        if self.count < 2:
            return None
        even, odd = (self.count + 1) // 2, self.count // 2
        shown = [
            live.develop(half / count, view, extra=extra).astype(np.float32)
            for half, count in zip(self.halves, (even, odd), strict=True)
        ]
        return float(np.sqrt(np.mean(((shown[0] - shown[1]) / 2.0) ** 2)))
