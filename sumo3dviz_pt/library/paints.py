"""Paints of vehicles: which colours there are, how common they are, which glitter.

References:
    Shares after the annual colour popularity reports of paint makers for Europe
    (BASF, Axalta; about three quarters of new cars are white, black, grey or
    silver, and more than half of all have effect paints). The reflectances are our own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.random import pick, share_of


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours and how often they occur.

    Attributes:
        colours: Linear reflectances in [0, 0.85].
        shares: One for each colour, with a positive sum.
    """

    colours: tuple[Colour, ...]
    shares: tuple[float, ...]

    def draw(self, seed: int, key: str) -> Colour:
        """Return the colour of a road user: the same for the same seed and key."""
        return self.colours[pick(self.shares, share_of(seed, key, "colour"))]


# fmt: off
_PAINTS = (
    # colour                 cars   others  flop
    ((0.620, 0.630, 0.625),  22.0,  48.0,   0.0),  # white
    ((0.012, 0.012, 0.013),  17.0,   2.0,   0.5),  # black
    ((0.045, 0.048, 0.052),  10.0,   5.0,   0.8),  # anthracite
    ((0.120, 0.125, 0.130),  11.0,   6.0,   0.9),  # mid grey
    ((0.230, 0.235, 0.240),   6.0,   6.0,   1.0),  # light grey
    ((0.430, 0.440, 0.450),   8.0,  10.0,   1.0),  # silver
    ((0.550, 0.535, 0.495),   3.0,   3.0,   0.25),  # pearl
    ((0.010, 0.020, 0.055),   5.0,   4.0,   0.6),  # night blue
    ((0.018, 0.060, 0.190),   5.0,   6.0,   0.7),  # blue
    ((0.110, 0.190, 0.270),   2.0,   2.0,   0.9),  # steel blue
    ((0.300, 0.013, 0.012),   4.0,   5.0,   0.0),  # red
    ((0.110, 0.008, 0.012),   1.5,   1.0,   0.6),  # wine
    ((0.012, 0.045, 0.025),   2.0,   2.0,   0.6),  # racing green
    ((0.130, 0.085, 0.050),   1.5,   0.0,   0.9),  # bronze
    ((0.330, 0.280, 0.205),   1.0,   0.0,   0.8),  # sand
    ((0.500, 0.120, 0.015),   1.0,   0.0,   0.0),  # orange
)
"""Colours of vehicles, how common they are among cars and two-wheelers, and among others, and how
much their paints darken where one looks along them."""
# fmt: on

EUROPEAN = Palette(tuple(row[0] for row in _PAINTS), tuple(row[1] for row in _PAINTS))
"""Passenger cars and two-wheelers: 77 % achromatic."""

SOBER = Palette(tuple(row[0] for row in _PAINTS), tuple(row[2] for row in _PAINTS))
"""Buses, trucks, vans, trains and all other vehicles."""

_FLOPS: Mapping[Colour, float] = {row[0]: row[3] for row in _PAINTS}


def flop_of(colour: Colour) -> float:
    """Return how much a paint darkens where one looks along it, [0, 1]; 0 of users' colours."""
    return _FLOPS.get(colour, 0.0)
