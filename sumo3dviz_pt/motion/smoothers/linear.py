"""Straight lines at constant speed from sample to sample, the baseline for other smoothers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.front import Front, FrontMotion
from sumo3dviz_pt.motion.smoothers.registry import register


@dataclass(frozen=True, slots=True, eq=False)
class LinearFront:
    """The front on straight lines.

    Attributes:
        times: (n,) [s].
        positions: (n, 3) [m].
        remarks: What was noticed.
    """

    times: Floats
    positions: Floats
    remarks: tuple[Remark, ...] = ()

    @property
    def begin(self) -> float:
        """First sample's time [s]."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Last sample's time [s]."""
        return float(self.times[-1])

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""
        rates = np.diff(self.positions, axis=0) / np.diff(self.times)[:, None]
        index = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(rates) - 1)
        positions = self.positions[index] + (times - self.times[index])[:, None] * rates[index]
        return FrontMotion(positions, np.linalg.norm(rates[index], axis=1))


@register("linear")
def linear(samples: LoggedSamples, setting: Setting) -> Front:
    """Join samples by straight lines."""
    del setting  # only positions count
    return LinearFront(samples.times, samples.positions)
