"""Drops and flakes in the air: sizes and speeds, and where they are before a camera.

Sizes come in bins that fall alike, each drawn as far away as it is worth it. A drop that is thinner
than a pixel, and that flies through it in a small part of the exposure, covers little of it: Garg
and Nayar's ratio of the time that it is before a pixel to the exposure, times its share of the
pixel. Where that share is too small to be seen, drops are left to the extinction of the air. The
limit follows from how many can be drawn, so it depends on what falls and on the lens, not on what
is seen.

Space is divided into cubes that fall and drift with their kind of drop. A cube's number and the
scene's seed say how many drops are in it, where, and how large they are; so a drop is the same one
in all frames, wherever the camera is, and there is no state between frames. These random numbers
are the same on every machine, in any order.

References:
    Steele, G. L., Lea, D. and Flood, C. H., Fast splittable pseudorandom number generators,
    OOPSLA 2014, doi:10.1145/2660193.2660195: the finaliser of SplitMix64.
    Garg, K. and Nayar, S. K., Vision and rain, International Journal of Computer Vision 75,
    2007, doi:10.1007/s11263-006-0028-6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.falling import (
    Falling,
    Sizes,
    drop_speed,
    flake_diameter,
    flake_speed,
    rain_sizes,
    snow_sizes,
)
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.render.falling.light import along

Keys = NDArray[np.uint64]
"""Whole numbers that stand for places or things."""

_ODD = np.array(
    [0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB, 0xD6E8FEB86659FD93],
    dtype=np.uint64,
)

_STEPS = np.arange(1, 65, dtype=np.uint64) * _ODD[0]


def keys_of(seed: int, *numbers: Ints | int) -> Keys:
    """Return a key for each row of whole numbers.

    Args:
        seed: The scene's, with what tells uses apart.
        numbers: Arrays that broadcast, such as rows, columns and layers of cells.
    """
    keys: NDArray[Any] = np.array([seed % 2**63], dtype=np.uint64)
    for number in numbers:
        words = np.atleast_1d(np.asarray(number, dtype=np.int64)).view(np.uint64)
        keys = _mixed(keys + _ODD[0] * (words + _ODD[3]))
    return np.asarray(keys)


def shares(keys: Keys, count: int) -> Floats:
    """Return numbers in [0, 1) for each key, (count, n)."""
    values = np.empty((count, len(keys)))
    for row in range(count):
        words = _mixed(keys + _STEPS[row])
        values[row] = (words >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return values


def _mixed(words: Keys) -> Keys:
    """Return words whose bits all depend on all bits of what is given."""
    words = (words ^ (words >> np.uint64(30))) * _ODD[1]
    words = (words ^ (words >> np.uint64(27))) * _ODD[2]
    return np.asarray(words ^ (words >> np.uint64(31)))


FARTHEST = 60.0
"""Where even the largest are left to the extinction of the air [m]."""

_SMALLEST = 0.002
"""Share of a pixel's light that a drop must cover to be worth drawing, if there are few."""


@dataclass(frozen=True, slots=True)
class SizeBin:
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
        name: That of its rate in `Falling`; chance counts by it, too.
        flakes: Whether its members are flakes.
        kinds: Its bins.
        sizes: The distribution for a rate [mm/h].
        diameter: In the air [mm] by the diameter as water [mm].
        sway: How far members swing to the sides, at most [m].
        turns: How often they swing [1/s].
        most: How many are drawn in a picture, about.
    """

    name: str
    flakes: bool
    kinds: tuple[SizeBin, ...]
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
    kinds = _kinds(edges, drop_speed, np.asarray)
    return Matter("rain", False, kinds, rain_sizes, np.asarray, 0.03, 1.6, 14_000)


@cache
def snow() -> Matter:
    """Return the flakes of snow."""
    edges = np.geomspace(0.3, 4.5, 15).tolist()
    kinds = _kinds(edges, flake_speed, flake_diameter)
    return Matter("snow", True, kinds, snow_sizes, flake_diameter, 0.1, 0.8, 30_000)


MATTERS: Mapping[str, Callable[[], Matter]] = MappingProxyType({"rain": rain, "snow": snow})
"""What falls, by the names of `Falling`'s rates; drawn one after the other."""


def _kinds(
    edges: Sequence[float],
    speed: Callable[[Floats], Floats],
    diameter: Callable[[Floats], Floats],
) -> tuple[SizeBin, ...]:
    """Return the bins between diameters [mm]."""
    kinds = []
    for number, (low, high) in enumerate(pairwise(edges)):
        middle = np.array(0.5 * (low + high))
        wide = float(diameter(middle))
        cell = float(np.clip(0.8 * wide, 0.3, 3.0))
        kind = SizeBin(number, low, high, float(speed(middle)), 1e-3 * wide, cell)
        kinds.append(kind)
    return tuple(kinds)


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


NEAREST, NEAR = 0.35, 0.9
"""Between these distances drops come into being before the lens [m]."""

LOW_WIND = 0.7
"""Wind a few metres above the ground against that at ten."""

_SLOW = 0.25
"""Share of a drop, or of all if there is less than one in a cube, that comes by and by."""


@dataclass(frozen=True, slots=True, eq=False)
class Drops:
    """Drops or flakes before a camera.

    Attributes:
        first: Where each is when the shutter opens, in the world, (n, 3) [m].
        last: Where it is when the shutter closes, (n, 3) [m].
        diameters: (n,) [m].
        speeds: By which they fall, (n,) [m/s].
        shown: How much of each is drawn, by chance of its being, (n,) in [0, 1].
        flakes: Whether they are flakes of snow.
    """

    first: Floats
    last: Floats
    diameters: Floats
    speeds: Floats
    shown: Floats
    flakes: bool = False

    def only(self, which: Bools | Ints) -> Drops:
        """Return some of them."""
        return Drops(
            self.first[which],
            self.last[which],
            self.diameters[which],
            self.speeds[which],
            self.shown[which],
            self.flakes,
        )


def drops_before(
    falling: Falling, matter: Matter, rate: float, *, lens: Lens, size: tuple[int, int]
) -> tuple[Drops, Reach]:
    """Return the drops or flakes that a picture may show, and how far they are drawn.

    Args:
        falling: Time, wind, cameras and seed.
        matter: What falls.
        rate: How much [mm/h].
        lens: Of the camera.
        size: Of the picture [px].
    """
    far = reach(matter, rate, lens, size=size, exposure=falling.exposure)
    sizes = matter.sizes(rate)
    cone = lens.half_diagonal(size[1] / size[0])
    each = []
    for kind in matter.kinds:
        largest = np.array(1e-3 * matter.diameter(np.array(kind.high)))
        end = float(far.end(largest, np.array(kind.speed)))
        if end > NEAREST:
            cells = _cells(falling, kind, end=end, cone=cone)
            each.append(_members(falling, matter, kind, sizes, cells))
    return joined(each, flakes=matter.flakes), far


def joined(each: Sequence[Drops], *, flakes: bool) -> Drops:
    """Return all drops, or flakes, of some."""
    none = Drops(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0))
    some = (none, *each)
    return Drops(
        np.concatenate([drops.first for drops in some]),
        np.concatenate([drops.last for drops in some]),
        np.concatenate([drops.diameters for drops in some]),
        np.concatenate([drops.speeds for drops in some]),
        np.concatenate([drops.shown for drops in some]),
        flakes,
    )


def carried(falling: Falling, kind: SizeBin, time: float) -> Floats:
    """Return how far a kind has come since time 0, by wind and weight, at a time [s], (3,) [m]."""
    since = time - falling.time
    drift = LOW_WIND * (np.array(falling.drift) + since * np.array(falling.wind))
    return np.array([*drift, -kind.speed * time])


def _cells(falling: Falling, kind: SizeBin, *, end: float, cone: float) -> Ints:
    """Return the cubes of a kind that lie before the camera, (n, 3)."""
    camera = falling.cameras.mean(axis=0)
    eye = camera[:3, 3] - carried(falling, kind, falling.time)
    radius = np.sqrt(0.75) * kind.cell + 0.1
    low = np.floor((eye - end) / kind.cell).astype(np.int64)
    high = np.floor((eye + end) / kind.cell).astype(np.int64)
    axes = [np.arange(low[k], high[k] + 1) for k in range(3)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    towards = (cells + 0.5) * kind.cell - eye
    away = np.linalg.norm(towards, axis=1)
    ahead = along(towards, camera[:3, 0]) / np.maximum(away, 1e-9)
    wide = cone + np.arcsin(np.minimum(radius / np.maximum(away, 1e-9), 1.0))
    inside = (away < radius) | (ahead > np.cos(np.minimum(wide, np.pi)))
    return np.asarray(cells[inside & (away < end + radius)])


def _members(falling: Falling, matter: Matter, kind: SizeBin, sizes: Sizes, cells: Ints) -> Drops:
    """Return the drops of a kind in some of its cubes."""
    seed = falling.seed * 0x1F + int.from_bytes(matter.name.capitalize().encode())
    keys = keys_of(seed, np.full(len(cells), kind.number), *cells.T)
    dense = float(sizes.above(kind.low) - sizes.above(kind.high)) * kind.cell**3
    # Where the rate rises, the last one of a cube comes into being little by little.
    slow = _SLOW * min(dense, 1.0)
    filled = dense + shares(keys, 1)[0]
    counts = np.floor(filled + 0.5 * slow).astype(np.int64)
    owners = np.repeat(np.arange(len(cells)), counts)
    rank = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    chance = shares(_member_keys(keys, owners, rank), 8)
    diameters = sizes.share_at(chance[3], kind.low, kind.high)
    shown = np.clip((filled[owners] - rank - 1.0) / slow + 0.5, 0.0, 1.0)
    resting = (cells[owners] + chance[:3].T) * kind.cell
    half = 0.5 * falling.exposure
    ends = [
        resting + carried(falling, kind, time) + _swing(matter, chance[4:], time)
        for time in (falling.time - half, falling.time + half)
    ]
    wide = 1e-3 * matter.diameter(diameters)
    return Drops(ends[0], ends[1], wide, np.full(len(wide), kind.speed), shown)


def _member_keys(keys: Keys, owners: Ints, rank: Ints) -> Keys:
    """Return a key for each member of each cube."""
    return np.asarray(keys[owners] + np.uint64(0xA24BAED4963EE407) * (rank + 1).astype(np.uint64))


def _swing(matter: Matter, chance: Floats, time: float) -> Floats:
    """Return how far drops have swung to the sides at a time [s], (n, 3) [m]."""
    turns = matter.turns * (0.5 + chance[0])
    wide = matter.sway * (0.3 + 0.7 * chance[1])
    angle = 2.0 * np.pi * (turns * time + chance[2])
    towards = 2.0 * np.pi * chance[3]
    # Along an ellipse: forth and back one way, a third of it across, and a little up and down.
    forth, across = wide * np.sin(angle), 0.35 * wide * np.cos(angle)
    east = forth * np.cos(towards) - across * np.sin(towards)
    north = forth * np.sin(towards) + across * np.cos(towards)
    return np.column_stack([east, north, 0.15 * wide * np.sin(2.0 * angle)])
