"""A picture that improves while nothing moves: the mean of its samples, and its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.layers import Layers, merged
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.live import Live


@dataclass(frozen=True, slots=True, eq=False)
class Mean:
    """Samples of one picture, added up in two halves.

    Attributes:
        halves: Sums of samples 0, 2, 4, ... and 1, 3, 5, ...; of a single sample only the first.
        count: Samples that were added.
    """

    halves: tuple[Layers, ...]
    count: int

    @classmethod
    def of(cls, sample: Layers) -> Mean:
        """Begin a picture with a sample."""
        return cls((sample,), 1)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.halves[0].size

    def with_sample(self, sample: Layers) -> Mean:
        """Add a sample to the sums."""
        if self.count == 1:
            return Mean((*self.halves, sample), 2)
        even, odd = self.halves
        halves = (even, added(odd, sample)) if self.count % 2 else (added(even, sample), odd)
        return Mean(halves, self.count + 1)

    @property
    def value(self) -> Layers:
        """The mean of all samples."""
        total = self.halves[0] if self.count == 1 else added(*self.halves)
        return divided(total, self.count)

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
        counts = (self.count + 1) // 2, self.count // 2
        shown = [
            live.develop(divided(half, count), view, extra=extra).astype(np.float32)
            for half, count in zip(self.halves, counts, strict=True)
        ]
        return float(np.sqrt(np.mean(((shown[0] - shown[1]) / 2.0) ** 2)))


def added(one: Layers, other: Layers) -> Layers:
    """Return the sums of two pictures' layers."""
    return merged((one, other), np.add)


def divided(sums: Layers, count: int) -> Layers:
    """Return the means of sums over a number of samples."""
    return merged((sums,), lambda layer: layer / count)
