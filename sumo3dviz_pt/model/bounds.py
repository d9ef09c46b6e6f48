"""Ranges of numbers in all files; everything that can drive lies within them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Range:
    """A range of allowed numbers.

    Attributes:
        low: Smallest allowed number.
        high: Largest allowed number.
        unit: Unit of both, for messages; empty for counts and bits.
    """

    low: float
    high: float
    unit: str = ""

    def __contains__(self, number: float) -> bool:
        """Whether a number lies within; NaN does not."""
        return self.low <= number <= self.high

    def __str__(self) -> str:
        """Return the range in words, such as `from 0 to 1000 m/s`."""
        return f"from {self.low:.12g} to {self.high:.12g} {self.unit}".rstrip()


COORDINATE = Range(-2e7, 2e7, "m")
"""Coordinates: half of the Earth's circumference, as far as any map projection reaches."""

HEIGHT = Range(-2e4, 2e4, "m")
"""Heights: twice that of the highest mountain."""

SECONDS = Range(-1e9, 1e9, "s")
"""Times: thirty years before and after zero."""

ANGLE = Range(-3600.0, 3600.0, "degrees")
"""Angles: ten turns."""

MOST_FRAMES = 1_000_000
"""Largest number of frames of a film, eleven hours at 25 a second."""
