"""When a camera lets light in: it answers at which moments a frame is seen."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Shutter:
    """A span of time in which light comes in.

    Attributes:
        opens: First moment, from the frame's time [s].
        closes: Last moment, from the frame's time [s].
    """

    opens: float = 0.0
    closes: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a shutter that closes before it opens."""
        if not self.opens <= self.closes:
            raise ValueError(f"a shutter opens at {self.opens} s and closes at {self.closes} s")

    @property
    def is_instant(self) -> bool:
        """Whether all light comes in at one moment."""
        return self.opens == self.closes

    def at(self, time: float) -> Shutter:
        """Return the same shutter for the frame of a time [s]."""
        return Shutter(time + self.opens, time + self.closes)

    def times(self, count: int) -> tuple[float, ...]:
        """Middles of so many equal parts of the span [s]; a single moment for an instant."""
        if self.is_instant:
            return (self.opens,)
        part = (self.closes - self.opens) / count
        return tuple(self.opens + (number + 0.5) * part for number in range(count))


INSTANT = Shutter()
"""What every camera has: nothing blurs because it moves."""
