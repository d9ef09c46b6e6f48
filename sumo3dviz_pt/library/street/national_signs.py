"""Signs that look different from country to country, as a `SignStyle` says.

References:
    Limits on panels and yield signs: Manual on Uniform Traffic Control Devices, 2009, R2-1
    and R1-2. Limits in miles per hour and give way signs with words: Traffic Signs Regulations
    and General Directions 2016, diagrams 670 and 602.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sumo3dviz_pt.library.street import signs as shapes
from sumo3dviz_pt.library.street.road_styles import SignStyle
from sumo3dviz_pt.library.street.signs import BLACK, RED, WHITE, plate
from sumo3dviz_pt.library.street.strokes import fan, lettering, ring
from sumo3dviz_pt.library.street.traffic_light import rounded
from sumo3dviz_pt.model.scene import Part

_MILE = 1609.344  # [m]
_PANEL = (0.61, 0.76)  # width and height of a panel with a limit [m]


def shown_limit(speed: float, style: SignStyle) -> int:
    """Return the number on a sign for a speed limit [m/s], in the style's unit.

    Kilometres per hour are rounded to tens, miles per hour to fives.
    """
    if style.unit == "mph":
        return 5 * round(speed * 3600.0 / _MILE / 5)
    return 10 * round(speed * 3.6 / 10)


def speed_limit(number: int, style: SignStyle) -> tuple[Part, ...]:
    """Build the sign of a speed limit."""
    return _panel(number) if style.limit == "panel" else shapes.speed_limit(number)


def give_way(style: SignStyle) -> tuple[Part, ...]:
    """Build the sign that tells drivers to give way."""
    return _lettered(style.give_way) if style.give_way else shapes.give_way()


@cache
def _panel(number: int) -> tuple[Part, ...]:
    """A white panel with two words above a number."""
    wide, tall = _PANEL
    outer = rounded(wide, tall, radius=0.04)
    rims = [rounded(wide - k, tall - k, radius=0.035) for k in (0.03, 0.055)]
    words = [
        lettering(word, height=0.095, weight=0.15) + np.array([0.0, up])
        for word, up in (("SPEED", 0.27), ("LIMIT", 0.12))
    ]
    digits = lettering(str(number), height=0.27, weight=0.15) - np.array([0.0, 0.165])
    black = np.concatenate([ring(*rims), *words, digits])
    return tuple(plate(outer, [(fan(outer), WHITE), (black, BLACK)], z=0.0))


@cache
def _lettered(text: str) -> tuple[Part, ...]:
    """A give way sign with words, one line for each."""
    lines = text.split()
    height = 0.1 if len(lines) == 1 else 0.085
    words = [
        lettering(word, height=height, weight=0.15)
        + np.array([0.0, 0.13 - 1.5 * height * place - 0.5 * height])
        for place, word in enumerate(lines)
    ]
    colour = RED if len(lines) == 1 else BLACK
    outline, face = shapes.triangle_face()
    return tuple(plate(outline, [*face, (np.concatenate(words), colour)], z=-0.08))
