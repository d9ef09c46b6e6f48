"""Allowed ranges of numbers and counts in SUMO's files.

A damaged number is refused with its name and line, because a single one can make a program run
forever: a lane of 1e12 m would be sampled until the memory is full.
"""

from __future__ import annotations

import math

from sumo3dviz_pt.model.bounds import ANGLE, COORDINATE, HEIGHT, SECONDS, Range

__all__ = ["ANGLE", "COORDINATE", "HEIGHT", "SECONDS", "Range"]

ANY = Range(-math.inf, math.inf)
"""For numbers from which nothing is built."""

SPEED = Range(-1000.0, 1000.0, "m/s")
SPEED_LIMIT = Range(0.0, 1000.0, "m/s")

LANE_WIDTH = Range(-1.0, 200.0, "m")
"""SUMO writes -1 for lanes of the usual width."""

LANE_LENGTH = Range(-1e6, 1e6, "m")
SHORTEST_LANE = 1e-3
"""A lane with a smaller length has none; the length of its shape counts [m]."""

LONGEST_SHAPE = 50_000.0
"""A lane with a longer shape must be told as long, or nearly, by its `length` [m]."""

MOST_STRETCHED = 100.0
"""Largest length of such a shape as a multiple of the lane's `length`."""

BODY_LENGTH = Range(0.01, 5000.0, "m")
BODY_WIDTH = Range(0.01, 200.0, "m")
UNIT_LENGTH = Range(2.0, 5000.0, "m")
UNIT_GAP = Range(0.0, 100.0, "m")
INDEX = Range(0, 10_000)
LINK_INDEX = Range(-1, 100_000)
PRIORITY = Range(-(2**31), 2**31 - 1)
SIGNAL_BITS = Range(-1, 2**31 - 1)

MOST_POINTS = 20_000
"""Largest number of points of a shape: coasts and woods have thousands, houses and lanes tens."""

PLAIN_POINTS = 100
"""A shape of at most this many points may cross itself as often as it likes."""

MOST_WINDING = 50.0
"""Largest length of a shape with more points, as a multiple of its bounding box's diagonal.

Roads reach 3 and fjords 20; 3000 random points reach 1000 and cross each other millions of times.
"""

MOST_LENGTH = 2e8
"""Largest length of all lanes of a network together [m], that of a large country's roads."""

SIGNAL_LETTERS = "rugGyYsoO"
"""Letters of a link's signal (SUMO's manual, "Signal state definitions")."""
