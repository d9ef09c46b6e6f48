"""How far numbers may go, wherever they are written: nothing that drives lies beyond."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Range:
    """What a number may be.

    Attributes:
        low: The least.
        high: The greatest.
        unit: Of both, for messages; empty for counts and bits.
    """

    low: float
    high: float
    unit: str = ""

    def __contains__(self, number: float) -> bool:
        """Whether a number lies within; NaN does not."""
        return self.low <= number <= self.high

    def __str__(self) -> str:
        """In words, such as `from 0 to 1000 m/s`."""
        return f"from {self.low:.10g} to {self.high:.10g} {self.unit}".rstrip()


COORDINATE = Range(-2e7, 2e7, "m")
"""Half of the Earth's circumference: no map projection reaches farther."""

HEIGHT = Range(-2e4, 2e4, "m")
"""Twice that of the highest mountain."""

SECONDS = Range(-1e9, 1e9, "s")
"""Thirty years to either side."""

ANGLE = Range(-3600.0, 3600.0, "degrees")
"""Ten turns."""

MOST_FRAMES = 1_000_000
"""Frames of one film: eleven hours at 25 a second."""
