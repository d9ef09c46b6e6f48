"""Drops and flakes in the air: which there are before a camera, and where.

Space is divided into cubes that fall and drift with their kind of drop. A cube's number and the
scene's seed say how many drops are in it, where, and how large they are; so a drop is the same
one in all frames, wherever the camera is, and there is no state between frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.falling import Falling
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.precipitation import Sizes
from sumo3dviz_pt.render.falling.chance import Keys, keys_of, shares
from sumo3dviz_pt.render.falling.frames import along
from sumo3dviz_pt.render.falling.kinds import Kind, Matter, Reach, reach

NEAREST, NEAR = 0.35, 0.9
"""Between these distances drops come into being before the lens [m]."""

LOW_WIND = 0.7
"""Wind a few metres above the ground against that at ten."""

_SLOW = 0.25
"""Share of a drop, or of all if there is less than one in a cube, that comes by and by."""

_SALTS = {"rain": 0x5261696E, "snow": 0x536E6F77}


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
    return joined(each, flakes=matter.name == "snow"), far


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


def carried(falling: Falling, kind: Kind, time: float) -> Floats:
    """Return how far a kind has come since time 0, by wind and weight, at a time [s], (3,) [m]."""
    since = time - falling.time
    drift = LOW_WIND * (np.array(falling.drift) + since * np.array(falling.wind))
    return np.array([*drift, -kind.speed * time])


def _cells(falling: Falling, kind: Kind, *, end: float, cone: float) -> Ints:
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


def _members(falling: Falling, matter: Matter, kind: Kind, sizes: Sizes, cells: Ints) -> Drops:
    """Return the drops of a kind in some of its cubes."""
    seed = falling.seed * 0x1F + _SALTS[matter.name]
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
