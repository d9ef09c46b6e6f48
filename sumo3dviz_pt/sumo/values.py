"""SUMO's notations for times, colours, shapes and flags, turned into SI values.

Numbers and counts have allowed ranges. A damaged number is refused with its name and line, because
a single one can make a program run forever: a lane of 1e12 m would be sampled until the memory is
full.

References:
    Colours follow SUMO's `RGBColor::parseColor` (utils/common/RGBColor.cpp); the
    named ones were checked against Eclipse SUMO 1.28.0 over TraCI. The transfer
    curve is sRGB's, IEC 61966-2-1.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.model.numbers import ANGLE, COORDINATE, HEIGHT, SECONDS, Range

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


_NAMED: dict[str, tuple[int, int, int]] = {
    "red": (255, 0, 0),
    "green": (0, 255, 0),
    "blue": (0, 0, 255),
    "yellow": (255, 255, 0),
    "cyan": (0, 255, 255),
    "magenta": (255, 0, 255),
    "orange": (255, 128, 0),
    "white": (255, 255, 255),
    "black": (0, 0, 0),
    "grey": (128, 128, 128),
    "gray": (128, 128, 128),
}
_SECONDS = (1.0, 60.0, 3600.0, 86400.0)
_FAR, _HIGH = COORDINATE.high, HEIGHT.high
_TRUE = frozenset({"1", "true", "yes", "on", "x", "t"})


def parse_number(text: str) -> float:
    """Return a number as SUMO reads it: in ASCII; Python would take `1_0` and other digits, too.

    Raises:
        ValueError: If it is none.
    """
    if not is_plain(text):
        raise ValueError(f"{text!r} is not a number")
    return float(text)


def is_plain(numbers: str) -> bool:
    """Whether numbers, or many of them joined, are written in what SUMO writes them in."""
    return numbers.isascii() and "_" not in numbers


def parse_time(text: str) -> float:
    """Return a time that is written as SUMO does.

    Args:
        text: Seconds (`12.50`), `h:m:s` or `d:h:m:s`.

    Returns:
        The time within `bounds.SECONDS` [s].

    Raises:
        ValueError: If it is none of these.
    """
    if ":" not in text:
        seconds = parse_number(text)
    else:
        sign = -1.0 if text.lstrip().startswith("-") else 1.0
        parts = text.strip().lstrip("-").split(":")
        if len(parts) not in (3, 4):
            raise ValueError(f"{text!r} is not a time")
        values = [parse_number(part) for part in reversed(parts)]
        if min(values) < 0:
            raise ValueError(f"{text!r} is not a time")
        seconds = sign * sum(v * unit for v, unit in zip(values, _SECONDS, strict=False))
    if seconds not in SECONDS:
        raise ValueError(f"{text!r} is not a time")
    return seconds


def parse_colour(text: str) -> Colour | None:
    """Return a colour that is written as SUMO does.

    Args:
        text: A name (`red`), `#rrggbb`, or `r,g,b[,a]` in 0-255 or 0-1; SUMO takes
            whole numbers for 0-255 unless none of them is above 1.

    Returns:
        Linear sRGB, each in [0, 1]; None for `invisible` and `random`. Opacity is
        left out.

    Raises:
        ValueError: If it is none of these.
    """
    word = text.strip().lower()
    if word in ("", "random", "invisible"):
        return None
    if word in _NAMED:
        bytes_ = _NAMED[word]
        encoded = tuple(value / 255.0 for value in bytes_)
    elif word.startswith("#"):
        encoded = _hex_colour(word[1:])
    else:
        encoded = _number_colour(word)
    return cast(Colour, tuple(linear_from_srgb(value) for value in encoded))


def parse_flag(text: str) -> bool:
    """Return whether a word is one of SUMO's words for true: 1, true, yes, on, x, t."""
    return text.strip().lower() in _TRUE


def parse_points(text: str) -> NDArray[np.float64]:
    """Return a shape that is written as SUMO does.

    Args:
        text: `x,y x,y` or `x,y,z x,y,z` [m]; SUMO leaves out a z of 0.

    Returns:
        Points, (n, 3) [m], without repeated neighbours; n may be 0.

    Raises:
        ValueError: If a point has not two or three finite numbers or lies off the Earth, or
            there are too many.
    """
    points: list[tuple[float, float, float]] = []
    words = text.split()
    if len(words) > MOST_POINTS:
        raise ValueError(f"these are {len(words)}, and at most {MOST_POINTS} can be drawn")
    for word in words:
        try:
            numbers = [parse_number(part) for part in word.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) not in (2, 3):
            raise ValueError(f"{cut(word)!r} is not a point")
        x, y, z = numbers if len(numbers) == 3 else (*numbers, 0.0)
        # Written so that NaN fails too.
        if not (-_FAR <= x <= _FAR and -_FAR <= y <= _FAR and -_HIGH <= z <= _HIGH):
            off = "lies off the Earth" if all(map(math.isfinite, numbers)) else "is not a point"
            raise ValueError(f"{cut(word)!r} {off}")
        if not points or points[-1] != (x, y, z):
            points.append((x, y, z))
    shape = np.array(points, dtype=np.float64).reshape(-1, 3)
    if len(shape) > PLAIN_POINTS:
        _check_winding(shape[:, :2])
    return shape


def _check_winding(shape: NDArray[np.float64]) -> None:
    """Refuse a shape that goes to and fro far too often."""
    length = float(np.linalg.norm(np.diff(shape, axis=0), axis=1).sum())
    across = float(np.linalg.norm(np.ptp(shape, axis=0)))
    if length > MOST_WINDING * across:
        raise ValueError(f"these go to and fro: {length:,.0f} m within {across:,.0f} m")


def yaw_from_angle_deg(angle_deg: float) -> float:
    """Return the yaw in [-pi, pi] of SUMO's angle, which is degrees clockwise from north [rad]."""
    return math.remainder(math.pi / 2 - math.radians(angle_deg), 2 * math.pi)


def _hex_colour(digits: str) -> tuple[float, ...]:
    if len(digits) not in (6, 8) or not is_plain(digits):
        raise ValueError(f"#{digits} is not a colour")
    return tuple(int(digits[i : i + 2], 16) / 255.0 for i in (0, 2, 4))


def _number_colour(text: str) -> tuple[float, ...]:
    words = text.split(",")
    if len(words) not in (3, 4):
        raise ValueError(f"{text!r} is not a colour")
    values = [parse_number(word) for word in words]
    whole = all("." not in word for word in words)
    scale = 255.0 if whole and max(values) > 1 else 1.0
    if not all(0.0 <= value <= scale for value in values):
        raise ValueError(f"{text!r} is not a colour")
    return tuple(value / scale for value in values[:3])
