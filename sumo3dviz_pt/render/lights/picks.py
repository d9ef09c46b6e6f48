"""How often paths aim at which lamp: as often as it matters to the place that is lit.

The chances are stored by the cells of a grid around what the eye sees, where the renderer
looks them up. Cells of vehicles' lamps are three metres wide. With cells of twelve metres, the
road one metre behind a brake lamp got its light from one sample in a hundred, and the firefly
cap took a sixth of that light.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image, Ints
from sumo3dviz_pt.model.scene import View

_MOST_CELLS = 64
_ROOM = 2_000_000  # numbers in a table by cell and unit
_WIDE = 192.0  # side of the grid [m]
_AHEAD = 60.0  # from the eye to its middle [m]
_NEAR = 30.0  # from here on, a lamp's light matters less the smaller it is in the picture [m]
_AROUND = 12.0  # lamps this far outside the picture still light what is in it [m]
_OUTSIDE = 0.1
_LEAST = 1.0  # distance of lamps and what they light, at least [m]
_BEHIND = 0.03
_SHINY = 100.0  # how much more a lamp matters to wet ground that mirrors it to the eye


@dataclass(frozen=True, slots=True, eq=False)
class Glow:
    """The lamps of a mesh in one frame.

    Attributes:
        radiance: On the axis, (lamps, 3).
        axes: Unit, (lamps, 3).
        lobes: Floor, sharpness and flux as in `model.lamps.Lobe`, (lamps, 3).
        areas: Of the units, (m,) [m2].
        lamp_of_unit: Which lamp each unit belongs to, (m,).
        places: Of the units, (m, 3) [m].
    """

    radiance: Floats
    axes: Floats
    lobes: Floats
    areas: Floats
    lamp_of_unit: Ints
    places: Floats

    @property
    def power(self) -> Floats:
        """What units give, mean of the channels, (m,)."""
        given = (self.radiance.mean(axis=1) * self.lobes[:, 2])[self.lamp_of_unit] * self.areas
        # Lamps whose radiance is NaN must be picked, too, so that the picture's account shows it.
        return np.asarray(np.nan_to_num(given, nan=1.0, posinf=1e3))


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Square cells on the ground, as many rows as columns.

    Attributes:
        corner: The lowest x and y, (2,) [m].
        step: A cell's side [m].
    """

    corner: Floats
    step: float


def cells_for(units: int) -> int:
    """Return the number of rows (and of columns) that a grid of some units has."""
    return int(np.clip(np.sqrt(_ROOM / units), 1, _MOST_CELLS))


def share_of(lumens: float) -> float:
    """Return how often paths aim at an emitter of so much light [lm], against a night sky.

    Noise is least where an emitter is picked in proportion to the root of its light's second
    moment. A small lamp lights a small place, but almost alone, so the root of its light
    counts.
    """
    return float(np.sqrt(min(max(lumens, 0.0), 1e9) / 1250.0))


def grid_of(view: View, cells: int) -> Grid:
    """Lay a grid of so many rows and columns around what a view sees."""
    forward = view.world_from_camera.matrix[:2, 0]
    return Grid(view.position[:2] + _AHEAD * forward - _WIDE / 2.0, _WIDE / cells)


class Picks(NamedTuple):
    """How points on lamps are picked, by cell of a grid and by unit.

    There are as many rows and columns, c, as `cells_for` has for the units, m.

    Attributes:
        density: Of points [1/m2], (c * c, m).
        chance: Summed up over the units, (c * c, m).
        given: What all units together give to each cell: power over squared distance, (c * c,).
    """

    density: Floats
    chance: Floats
    given: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Shine:
    """How wet ground mirrors lamps to the eye.

    Attributes:
        eye: x and y of the eye, (2,) [m].
        wetness: Of the ground, [0, 1].
    """

    eye: Floats
    wetness: float


def picked(glow: Glow, grid: Grid, shine: Shine | None = None) -> Picks:
    """Find how points on lamps are picked from the cells of a grid.

    Args:
        glow: The lamps.
        grid: The cells.
        shine: How the ground mirrors lamps; None where it is dry.
    """
    cells, units = cells_for(len(glow.areas)), len(glow.areas)
    lit = np.flatnonzero(glow.power > 0.0)
    density, chance = np.zeros((cells**2, units)), np.ones((cells**2, units))
    if not len(lit):
        return Picks(density, chance, np.zeros(cells**2))
    middles = grid.corner + (np.arange(cells) + 0.5)[:, None] * grid.step
    given = _given(glow, lit, middles, grid.step)
    if shine is not None:
        mirrored = _mirrored(glow.places[lit], middles, grid.step, shine.eye)
        given *= 1.0 + shine.wetness * _SHINY * mirrored
    total = given.sum(axis=1)
    given /= total[:, None]
    density[:, lit] = given / np.maximum(glow.areas[lit], 1e-12)
    summed = np.concatenate([np.zeros((cells**2, 1)), np.cumsum(given, axis=1)], axis=1)
    # Units that are off have the summed chance of the lit unit before them.
    before = np.searchsorted(lit, np.arange(units), side="right")
    np.take(summed / summed[:, -1:], before, axis=1, out=chance)
    return Picks(density, chance, total)


def _given(glow: Glow, units: Ints, middles: Floats, step: float) -> Floats:
    """Return what units give to cells, (c * c, m): power over squared distance, less behind them.

    Args:
        glow: The lamps.
        units: Which, (m,).
        middles: Of columns and rows, (c, 2) [m].
        step: A cell's side [m].
    """
    x, y = (middles[:, k, None] - glow.places[units, k] for k in (0, 1))
    away = y[:, None] ** 2 + x[None] ** 2 + (0.5 * step + _LEAST) ** 2
    axes = glow.axes[glow.lamp_of_unit[units]]
    cosine = (y[:, None] * axes[:, 1] + x[None] * axes[:, 0]) / np.sqrt(away)
    # Cells are wide and things in them are high: some of a cell may always be before the lamp.
    facing = _BEHIND + np.clip(0.5 + 2.0 * cosine, 0.0, 1.0)
    return np.asarray((glow.power[units] * facing / away).reshape(len(middles) ** 2, -1))


def _mirrored(places: Floats, middles: Floats, step: float, eye: Floats) -> Image:
    """Return how well ground mirrors lamps to the eye, (c * c, m), in [0, 1].

    At grazing angles rough water mirrors a lamp as a streak all along the line from the eye to
    below it, however high they are. So what counts is how far a cell lies beside that line,
    measured in cells.

    Args:
        places: Of the lamps, (m, 3) [m].
        middles: Of columns and rows, (c, 2) [m].
        step: A cell's side [m].
        eye: x and y, (2,) [m].
    """
    to_cell = np.stack(np.meshgrid(*(middles - eye).T), axis=-1).reshape(-1, 2).astype(np.float32)
    to_lamp = (places[:, :2] - eye).astype(np.float32).T
    along = to_cell @ to_lamp
    aside = to_cell @ np.stack([to_lamp[1], -to_lamp[0]])
    near = (to_cell**2).sum(axis=1)[:, None]
    # Squares of the ways from the cell to the eye and to the lamp, both uncertain by half a cell.
    both = 2.0 * (near - along) + (to_lamp**2).sum(axis=0)
    spread = 0.25 * step**2 * both + 1e-6
    off = aside * aside / spread + 1.0
    return np.asarray((along > near) / (off * off))


def nearness(places: Floats, view: View) -> Floats:
    """Return how much the light of lamps at places, (n, 3) [m], matters in a picture, (n,)."""
    seen = (places - view.position) @ view.world_from_camera.matrix[:3, :3]
    inside = view.lens.is_near_columns(seen, widened=1.15, margin=_AROUND)
    large = 1.0 / (1.0 + np.linalg.norm(seen, axis=1) / _NEAR)
    return np.asarray(np.where(inside, large, _OUTSIDE * large))
