"""How large numbers and counts in SUMO's files may be.

A damaged number is refused by name and line, instead of making something endless of it:
one lane of 1e12 m would be sampled until the memory is full.
"""

from __future__ import annotations

import math

from sumo3dviz_pt.model.bounds import ANGLE, COORDINATE, HEIGHT, SECONDS, Range

__all__ = ["ANGLE", "COORDINATE", "HEIGHT", "SECONDS", "Range"]

ANY = Range(-math.inf, math.inf)
"""For numbers that nothing is built from."""

SPEED = Range(-1000.0, 1000.0, "m/s")
SPEED_LIMIT = Range(0.0, 1000.0, "m/s")

LANE_WIDTH = Range(-1.0, 200.0, "m")
"""SUMO writes -1 for lanes of the usual width."""

LANE_LENGTH = Range(1e-3, 1e6, "m")
BODY_LENGTH = Range(0.01, 5000.0, "m")
BODY_WIDTH = Range(0.01, 200.0, "m")
UNIT_LENGTH = Range(2.0, 5000.0, "m")
UNIT_GAP = Range(0.0, 100.0, "m")
INDEX = Range(0, 10_000)
LINK_INDEX = Range(-1, 100_000)
PRIORITY = Range(-(2**31), 2**31 - 1)
SIGNAL_BITS = Range(-1, 2**31 - 1)

MOST_POINTS = 20_000
"""Points of one shape: coasts and woods have thousands, houses and lanes tens."""

PLAIN_POINTS = 100
"""A shape of so many points may cross itself as it likes."""

MOST_WINDING = 50.0
"""How many times as long as its box a shape of more points may be: roads reach 3, fjords 20, and
3000 points at random 1000, whose millions of crossings nothing can draw."""

MOST_WAY = 2e8
"""Length of all lanes of a network together [m]: all roads of a large country."""

SIGNAL_LETTERS = "rugGyYsoO"
"""What a link's signal may be (SUMO's manual, "Signal state definitions")."""
