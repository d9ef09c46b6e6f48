"""When a camera lets light in: it answers at which moments a frame is seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sumo3dviz_pt.model.geometry import Floats


@dataclass(frozen=True, slots=True)
class Shutter:
    """A span of time in which light comes in, seen at so many moments.

    Attributes:
        opens: First moment, from the frame's time [s].
        closes: Last moment, from the frame's time [s]; of the picture's first row.
        moments: At how many of its moments a row of the picture is seen.
        rolling: How much later the picture's last row is seen than its first [s].
    """

    opens: float = 0.0
    closes: float = 0.0
    moments: int = 1
    rolling: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a shutter that closes before it opens."""
        if not self.opens <= self.closes:
            raise ValueError(f"a shutter opens at {self.opens} s and closes at {self.closes} s")

    @property
    def is_instant(self) -> bool:
        """Whether all light comes in at one moment."""
        return self.opens == self.closes and self.rolling == 0.0

    @property
    def open_for(self) -> float:
        """How long light comes in [s]."""
        return self.closes - self.opens

    @property
    def lasts(self) -> float:
        """How long after the frame's time the last row is still seen [s]."""
        return self.closes + self.rolling

    @property
    def middle(self) -> float:
        """The middle of the exposure, of the row in the picture's middle [s]."""
        return 0.5 * (self.opens + self.closes + self.rolling)

    def at(self, time: float) -> Shutter:
        """Return the same shutter for the frame of a time [s]."""
        return Shutter(time + self.opens, time + self.closes, self.moments, self.rolling)

    def times(self, count: int) -> tuple[float, ...]:
        """Middles of so many equal parts of the span [s]; a single moment for an instant."""
        if self.opens == self.closes:
            return (self.opens,)
        part = (self.closes - self.opens) / count
        return tuple(self.opens + (number + 0.5) * part for number in range(count))

    def exposures(self) -> tuple[tuple[float, tuple[float, float]], ...]:
        """Return the moments of a frame [s], and which rows are seen then: shares of the height.

        Rows of a rolling shutter are seen in bands, so that every row is seen at `moments` of
        them, in the same steps.
        """
        if self.rolling == 0.0:
            return tuple((moment, (0.0, 1.0)) for moment in self.times(self.moments))
        # Each band of rows is as much later than the one above it as moments lie apart, so that
        # both share moments.
        count = 1 if self.opens == self.closes else self.moments
        span = self.closes - self.opens
        step = span / count if span > 0.0 else self.rolling / max(2, self.moments)
        bands = max(1, math.ceil(self.rolling / step - 1e-9))
        edges = [min(1.0, number * step / self.rolling) for number in range(bands + 1)]
        first = self.opens + (step if span > 0.0 else 0.5 * step)
        return tuple(
            (first + n * step, (edges[max(0, n - count + 1)], edges[min(bands, n + 1)]))
            for n in range(bands + count - 1)
        )


INSTANT = Shutter()
"""What every camera has: nothing blurs because it moves."""


def frame_step(times: Sequence[float] | Floats, *, fps: float) -> float:
    """Return the time from a frame to the next [s].

    Args:
        times: Of a shot's frames, (n,) [s], n >= 1.
        fps: Frames per second, for a shot of a single frame.
    """
    return float(times[1] - times[0]) if len(times) > 1 else 1.0 / fps
