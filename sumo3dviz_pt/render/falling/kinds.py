"""Sizes of drops and flakes, in bins that fall alike, and how far each is worth drawing.

A drop that is thinner than a pixel, and that flies through it in a small part of the exposure,
covers little of it: Garg and Nayar's ratio of the time that it is before a pixel to the exposure,
times its share of the pixel. Where that share is too small to be seen, drops are left to the
extinction of the air. The limit follows from how many can be drawn, so it depends on what falls
and on the lens, not on what is seen.

References:
    Garg, K. and Nayar, S. K., Vision and rain, International Journal of Computer Vision 75,
    2007, doi:10.1007/s11263-006-0028-6.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.precipitation import (
    Sizes,
    drop_speed,
    flake_diameter,
    flake_speed,
    rain_sizes,
    snow_sizes,
)

FARTHEST = 60.0
"""Where even the largest are left to the extinction of the air [m]."""

_SMALLEST = 0.002
"""Share of a pixel's light that a drop must cover to be worth drawing, if there are few."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A bin of sizes whose members fall at the same speed.

    Attributes:
        number: Its own, for chance.
        low: Least diameter, of flakes melted [mm].
        high: Largest diameter, of flakes melted [mm].
        speed: How fast it falls [m/s].
        diameter: Of its middle as it is in the air [m].
        cell: Side of the cubes in which its members are counted [m].
    """

    number: int
    low: float
    high: float
    speed: float
    diameter: float
    cell: float


@dataclass(frozen=True, slots=True)
class Matter:
    """What falls.

    Attributes:
        name: `rain` or `snow`.
        kinds: Its bins.
        sizes: The distribution for a rate [mm/h].
        diameter: In the air [mm] by the diameter as water [mm].
        sway: How far members swing to the sides, at most [m].
        turns: How often they swing [1/s].
        most: How many are drawn in a picture, about.
    """

    name: str
    kinds: tuple[Kind, ...]
    sizes: Callable[[float], Sizes]
    diameter: Callable[[Floats], Floats]
    sway: float
    turns: float
    most: int


@dataclass(frozen=True, slots=True)
class Reach:
    """How far the members of each kind are drawn, for one lens and exposure.

    Attributes:
        cover: Share of a pixel that one must cover to be drawn; at twice that it is drawn in
            full.
        focal: Pixels of the width of what is as wide as it is far away.
        exposure: [s].
    """

    cover: float
    focal: float
    exposure: float

    def end(self, diameter: Floats, speed: Floats) -> Floats:
        """Return the distance from which on nothing of a size [m] and speed is drawn [m]."""
        stay = np.minimum(1.0, diameter / (speed * self.exposure))
        return np.asarray(np.minimum(diameter * self.focal * stay / self.cover, FARTHEST))


@cache
def rain() -> Matter:
    """Return the drops of rain; smaller ones are mist."""
    edges = [*np.arange(0.4, 2.0, 0.2), *np.arange(2.0, 4.0, 0.4), 4.0, 4.8, 6.0]
    return Matter(
        "rain", _kinds(edges, drop_speed, np.asarray), rain_sizes, np.asarray, 0.03, 1.6, 14_000
    )


@cache
def snow() -> Matter:
    """Return the flakes of snow."""
    edges = np.geomspace(0.3, 4.5, 15).tolist()
    kinds = _kinds(edges, flake_speed, flake_diameter)
    return Matter("snow", kinds, snow_sizes, flake_diameter, 0.1, 0.8, 30_000)


def _kinds(
    edges: Sequence[float],
    speed: Callable[[Floats], Floats],
    diameter: Callable[[Floats], Floats],
) -> tuple[Kind, ...]:
    """Return the bins between diameters [mm]."""
    found = []
    for number, (low, high) in enumerate(pairwise(edges)):
        middle = np.array(0.5 * (low + high))
        wide = float(diameter(middle))
        cell = float(np.clip(0.8 * wide, 0.3, 3.0))
        kind = Kind(number, low, high, float(speed(middle)), 1e-3 * wide, cell)
        found.append(kind)
    return tuple(found)


def reach(
    matter: Matter, rate: float, lens: Lens, *, size: tuple[int, int], exposure: float
) -> Reach:
    """Return how far what falls is drawn.

    Args:
        matter: What falls.
        rate: How much [mm/h].
        lens: Of the camera.
        size: Of the picture [px].
        exposure: [s].
    """
    focal = 1.0 / lens.pixel_width(size[0])
    sizes = matter.sizes(rate)
    low, high, speeds, wide = (
        np.array([getattr(kind, name) for kind in matter.kinds])
        for name in ("low", "high", "speed", "diameter")
    )
    dense = sizes.above(low) - sizes.above(high)
    # A pyramid of a picture's width and height.
    width = float(lens.length_of(1.0, np.ones(1))[0])
    opening = width**2 * size[1] / size[0] / 3.0

    def drawn(cover: float) -> float:
        away = Reach(cover, focal, exposure).end(wide, speeds)
        return float((dense * opening * away**3).sum())

    # A picture of more pixels shows the same drops.
    least = np.log(_SMALLEST * focal / 1000.0)
    most = 20.0
    for _ in range(40):
        middle = 0.5 * (least + most)
        if drawn(float(np.exp(middle))) > matter.most:
            least = middle
        else:
            most = middle
    return Reach(float(np.exp(most)), focal, exposure)
