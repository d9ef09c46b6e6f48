"""How a scene's lamps shine and how paths pick them, as arrays that kernels read.

What a lamp gives to the cells of a grid is computed where it is read: a kernel sums it up once a
frame, one lane for each cell, and paths that aim at a lamp or meet one by chance ask again for that
lamp alone. So only sums are stored, of units that are lit, and nothing returns from the device.
Every sum is made by one lane in the order of units, so it is the same whatever runs beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.lights.emitter import WIDE, Glow, LampSizes, grid_corner

_LEAST = 1.0  # distance of lamps and what they light, at least [m]
_BEHIND = 0.03
_SHINY = 100.0  # how much more a lamp matters to wet ground that mirrors it to the eye


class Pick(NamedTuple):
    """A face that is picked.

    Attributes:
        face: Its number in the mesh.
        left: What is left of the sample, in [0, 1].
        density: Of points on it [1/m2].
    """

    face: Any
    left: Any
    density: Any


class _Row(NamedTuple):
    """A mesh's sizes, and where its numbers begin in the tables; see `LampSizes`."""

    lamps: Any
    units: Any
    fan: Any
    cells: Any
    first_lamp: Any
    first_unit: Any
    first_sum: Any
    lit: Any


class LampPicks:
    """All lamps of a scene, mesh by mesh.

    Args:
        sizes: Of each mesh, by name.
        wet: Whether the ground is ever wet.

    Attributes:
        names: Of the meshes, by number.
    """

    def __init__(self, sizes: Mapping[str, LampSizes], *, wet: bool) -> None:
        self.names, self._wet = tuple(sizes), wet
        counts = np.array([(s.count, s.units, s.fan, s.cells) for s in sizes.values()], int)
        cells = counts[:, 3] ** 2
        firsts = [_firsts(each) for each in (counts[:, 0], counts[:, 1], cells * counts[:, 1])]
        self._sizes: Ints = np.column_stack([counts, *firsts])
        self._most, self._room = int(counts[:, 1].max()), int((cells * counts[:, 1]).sum())
        # A lane for each cell of each mesh.
        self._number = _whole(np.repeat(np.arange(len(counts)), cells))
        squares = [np.indices((side, side)).reshape(2, -1) for side in counts[:, 3]]
        lines, columns = np.concatenate(squares, axis=1)
        self._cell = mi.Point2u(_whole(columns), _whole(lines))
        self._rows = self._lit = mi.UInt32(0)
        self._lamps = self._units = self._sums = mi.Float(0.0)
        self._corner = self._eye = mi.Point2f(0.0)
        self._wetness = mi.Float(0.0)

    def follow(self, glows: Mapping[str, Glow], frame: FrameState) -> None:
        """Bring everything to a frame.

        Args:
            glows: How the lamps of each mesh shine.
            frame: Says what is in the picture.
        """
        ordered = [glows[name] for name in self.names]
        corner = grid_corner(frame.view)
        lit = [np.flatnonzero((glow.power > 0.0) & (glow.weight > 0.0)) for glow in ordered]
        rows = np.column_stack([self._sizes, [len(some) for some in lit]])
        units = np.zeros(self._sizes[:, 1].sum(), int)
        for first, some in zip(self._sizes[:, 5], lit, strict=True):
            units[first : first + len(some)] = some
        self._rows, self._lit = _whole(rows), _whole(units)
        self._lamps = numbers(np.concatenate([_lamp_rows(glow) for glow in ordered]))
        steps = WIDE / self._sizes[:, 3]
        self._units = numbers(
            np.concatenate([_unit_rows(*each, corner) for each in zip(ordered, steps, strict=True)])
        )
        self._corner = opaque_point(corner - frame.origin[:2])
        self._eye = opaque_point(frame.view.position[:2] - corner)
        weather = frame.weather
        wetness = 0.0 if weather is None else max(weather.wetness, weather.puddles)
        self._wetness = dr.opaque(mi.Float, wetness)
        self._sum_up()

    def _sum_up(self) -> None:
        """Sum up what units give to each cell."""
        row = self._row(self._number, mi.Bool(True))
        first = _first_sum(row, self._cell)
        self._sums = sums = dr.empty(mi.Float, self._room)

        def add(k: Any, total: Any) -> tuple[Any, Any]:
            unit = dr.gather(mi.UInt32, self._lit, row.first_unit + k)
            total += self._power(row, unit, self._cell, mi.Bool(True))[0]
            dr.scatter(sums, total, first + k)
            return k + 1, total

        lanes = dr.width(self._number)
        start = dr.zeros(mi.UInt32, lanes), dr.zeros(mi.Float, lanes)
        dr.while_loop(start, lambda k, _: k < row.lit, add)
        dr.eval(sums)

    def _row(self, number: Any, active: Any) -> _Row:
        """Return a mesh's sizes."""
        sizes = dr.gather(mi.Vector4u, self._rows, 2 * number, active)
        firsts = dr.gather(mi.Vector4u, self._rows, 2 * number + 1, active)
        return _Row(*sizes, *firsts)

    def _power(self, row: _Row, unit: Any, cell: Any, active: Any) -> tuple[Any, Any]:
        """Return what a unit gives to a cell, and its area's inverse [1/m2].

        That is power over squared distance, less behind the lamp.

        Args:
            row: Of the mesh.
            unit: Its number in the mesh.
            cell: Its column and line.
            active: Which lanes count.
        """
        first = 2 * (row.first_unit + unit)
        at, given = (dr.gather(mi.Vector4f, self._units, first + k, active) for k in (0, 1))
        step = WIDE / mi.Float(row.cells)
        half = 0.5 * step
        # Whole cells are subtracted first, which is exact: where a lamp is near, millimetres count.
        middle, beside = mi.Point2f(cell) + 0.5, mi.Point2f(given.z, given.w)
        to = (middle - mi.Point2f(at.x, at.y) - beside) * step
        away = dr.squared_norm(to) + dr.square(half + _LEAST)
        cosine = dr.dot(to, mi.Vector2f(at.z, at.w)) / dr.sqrt(away)
        # Cells are wide and things in them are high: some of a cell may always be before the lamp.
        facing = _BEHIND + dr.clip(0.5 + 2.0 * cosine, 0.0, 1.0)
        power = given.x * facing / away
        if self._wet:
            mirrored = self._mirrored(middle * step - self._eye, to, half)
            power *= 1.0 + self._wetness * _SHINY * mirrored
        return power, given.y

    def _mirrored(self, to_cell: Any, back: Any, half: Any) -> Any:
        """Return how well ground mirrors a lamp to the eye, in [0, 1].

        At grazing angles rough water mirrors a lamp as a streak all along the line from the eye to
        below it, however high they are. So what counts is how far a cell lies beside that line,
        measured in cells.

        Args:
            to_cell: From the eye to the cell, in the plan [m].
            back: From the lamp to the cell, in the plan [m].
            half: Half a cell's side [m].
        """
        aside = to_cell.y * back.x - to_cell.x * back.y
        # Both ends of the line are uncertain by half a cell.
        both = dr.squared_norm(to_cell) + dr.squared_norm(back)
        off = dr.square(aside) / (dr.square(half) * both + 1e-6) + 1.0
        return dr.select(dr.dot(to_cell, back) < 0.0, 1.0 / dr.square(off), 0.0)

    def _cell_of(self, row: _Row, place: Any) -> Any:
        """Return column and line of a place; those outside the grid have a cell at its edge."""
        cells = mi.Float(row.cells)
        at = (mi.Point2f(place.x, place.y) - self._corner) * (cells / WIDE)
        return mi.Point2u(dr.clip(at, 0.0, cells - 1.0))

    def _whole_of(self, row: _Row, cell: Any, active: Any) -> tuple[Any, Any]:
        """Return where a cell's sums begin, and the last one: what all units give."""
        first, there = _first_sum(row, cell), active & (row.lit > 0)
        whole = dr.gather(mi.Float, self._sums, first + dr.maximum(row.lit, 1) - 1, there)
        return first, dr.select(there, whole, 0.0)

    def given(self, number: Any, column: Any, line: Any, *, of: int, active: Any) -> Any:
        """Return what a mesh gives to a cell of a grid that has other cells.

        Args:
            number: Of the mesh.
            column: Of the cell.
            line: Of the cell.
            of: How many columns, and lines, the other grid has.
            active: Which lanes count.
        """
        row = self._row(number, active)
        cell = mi.Point2u(column, line) * row.cells // of
        return self._whole_of(row, cell, active)[1]

    def pick(self, number: Any, place: Any, sample: Any, active: Any) -> Pick:
        """Pick a face by what lamps give to a place.

        Args:
            number: Of the mesh.
            place: That is lit.
            sample: In [0, 1).
            active: Which lanes count.
        """
        row = self._row(number, active)
        cell = self._cell_of(row, place)
        first, whole = self._whole_of(row, cell, active)
        active &= whole > 0.0
        last, wanted = dr.maximum(row.lit, 1) - 1, sample * whole

        def summed(k: Any) -> Any:
            return dr.gather(mi.Float, self._sums, first + k, active)

        def below(k: Any) -> Any:
            return (k < last) & (summed(dr.minimum(k, last)) < wanted)

        rank = dr.minimum(dr.binary_search(0, self._most - 1, below), last)
        low = dr.select(rank > 0, summed(dr.maximum(rank, 1) - 1), 0.0)
        left = (wanted - low) / dr.maximum(summed(rank) - low, 1e-12 * whole) * mi.Float(row.fan)
        part = dr.minimum(mi.UInt32(dr.maximum(left, 0.0)), row.fan - 1)
        unit = dr.gather(mi.UInt32, self._lit, row.first_unit + rank, active)
        density = self._density(row, unit, (cell, whole), active)
        return Pick(unit * row.fan + part, dr.clip(left - mi.Float(part), 0.0, 1.0), density)

    def density(self, number: Any, u: Any, place: Any, active: Any) -> Any:
        """Return the density of picking a point on a lamp [1/m2].

        Args:
            number: Of the mesh.
            u: First texture coordinate of the point.
            place: That is lit.
            active: Which lanes count.
        """
        row = self._row(number, active)
        cell = self._cell_of(row, place)
        whole = self._whole_of(row, cell, active)[1]
        unit = dr.minimum(mi.UInt32(u * mi.Float(row.units)), row.units - 1)
        return self._density(row, unit, (cell, whole), active)

    def _density(self, row: _Row, unit: Any, seen: tuple[Any, Any], active: Any) -> Any:
        """Return the density of points on a unit, from a cell to which all give so much [1/m2]."""
        cell, whole = seen
        power, per_area = self._power(row, unit, cell, active)
        return dr.select(whole > 0.0, power * per_area / whole, 0.0)

    def shining(self, number: Any, v: Any, out: Any, active: Any) -> Any:
        """Return the radiance of a lamp into a direction, a colour.

        Args:
            number: Of the mesh.
            v: Second texture coordinate of a point on the lamp.
            out: The direction, unit.
            active: Which lanes count.
        """
        row = self._row(number, active)
        # Mitsuba's v runs up, ours down.
        lamp = dr.minimum(mi.UInt32(-v * mi.Float(row.lamps)), row.lamps - 1) + row.first_lamp
        full, axis = (dr.gather(mi.Vector4f, self._lamps, 2 * lamp + k, active) for k in (0, 1))
        cosine = dr.dot(out, mi.Vector3f(axis.x, axis.y, axis.z))
        share = full.w + (1.0 - full.w) * dr.exp(axis.w * (cosine - 1.0))
        return dr.select(active, mi.Color3f(full.x, full.y, full.z) * share, 0.0)


def _first_sum(row: _Row, cell: Any) -> Any:
    """Return where the sums of a cell begin."""
    return row.first_sum + (cell.y * row.cells + cell.x) * row.lit


def opaque_point(xy: Floats) -> Any:
    """Return x and y as a point of Dr.Jit that is no part of a kernel's code."""
    return mi.Point2f(*(dr.opaque(mi.Float, float(each)) for each in xy))


def _firsts(counts: Ints) -> Ints:
    """Return where each row begins, of rows one after another with so many numbers each."""
    return np.asarray(np.cumsum(counts) - counts)


def _whole(values: Ints) -> Any:
    """Return whole numbers as an array of Dr.Jit."""
    return mi.UInt32(aligned(values, np.uint32))


def numbers(values: Floats) -> Any:
    """Return numbers as an array of Dr.Jit."""
    return mi.Float(aligned(values, np.float32))


def _lamp_rows(glow: Glow) -> Floats:
    """Return radiance, the lobe's floor, axis and the lobe's sharpness of lamps, (lamps, 8)."""
    lobes = glow.lobes
    return np.column_stack([glow.radiance, lobes[:, 0], glow.axes, lobes[:, 1]])


def _unit_rows(glow: Glow, step: float, corner: Floats) -> Floats:
    """Return the numbers of units, (m, 8).

    They are the whole cells of the place, the axis, power, inverse of the area, and what the place
    is beside whole cells.

    Args:
        glow: The lamps.
        step: A cell's side [m].
        corner: Of the grid, (2,) [m].
    """
    places = (glow.places[:, :2] - corner) / step
    cells, axes = np.floor(places), glow.axes[glow.lamp_of_unit, :2]
    per_area = 1.0 / np.maximum(glow.areas, 1e-12)
    return np.column_stack([cells, axes, glow.power, per_area, places - cells])
