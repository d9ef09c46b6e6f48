"""An emitter for lamps, each with its own radiance, axis and chance that paths aim at it.

Mitsuba's area emitter picks a point of a mesh by area alone, whether it is lit and near or not,
and it shines alike to all sides. Ours picks by what a lamp gives to the lit point, by cells of
a grid. So a red lamp lights the road behind it without speckles, lamps that are off draw no
light samples, and the narrow beams of real lenses leave the pavement below a traffic light
dark. The mesh's u coordinate holds the number of what is picked and v that of the lamp, as
sampled points carry both. Scalar variants, where Python plugins are slow, have area emitters
that paths never aim at.

Paths aim at a lamp as often as it matters to the place that is lit. The chances are stored by the
cells of a grid around what the eye sees, where the renderer looks them up. Cells of vehicles' lamps
are three metres wide. With cells of twelve metres, the road one metre behind a brake lamp got its
light from one sample in a hundred, and the firefly cap took a sixth of that light.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image, Ints, area_vectors, unit
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, FrameState, Lobe, View
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.rooms import inward, seen_through
from sumo3dviz_pt.render.textures import WEAR_ATTRIBUTE

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
        power = (self.radiance.mean(axis=1) * self.lobes[:, 2])[self.lamp_of_unit] * self.areas
        # Lamps whose radiance is NaN must be picked, too, so that the picture's account shows it.
        return np.asarray(np.nan_to_num(power, nan=1.0, posinf=1e3))


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
    power = _powers(glow, lit, middles, grid.step)
    if shine is not None:
        mirrored = _mirrored(glow.places[lit], middles, grid.step, shine.eye)
        power *= 1.0 + shine.wetness * _SHINY * mirrored
    total = power.sum(axis=1)
    power /= total[:, None]
    density[:, lit] = power / np.maximum(glow.areas[lit], 1e-12)
    summed = np.concatenate([np.zeros((cells**2, 1)), np.cumsum(power, axis=1)], axis=1)
    # Units that are off have the summed chance of the lit unit before them.
    before = np.searchsorted(lit, np.arange(units), side="right")
    np.take(summed / summed[:, -1:], before, axis=1, out=chance)
    return Picks(density, chance, total)


def _powers(glow: Glow, units: Ints, middles: Floats, step: float) -> Floats:
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


_PLUGIN = "sumo3dviz_lamps"
_TABLES = ("radiance", "axes", "lobes", "density", "chance", "given", "grid")


class _LampsEmitter:
    """The emitter's methods. Mitsuba's class, made once a variant is set, takes them from here.

    Paths pick units: `fan` neighbouring faces of the same area each.

    Attributes:
        count: Lamps.
        units: Units.
        fan: Faces of a unit.
        cells: Rows, and columns, of the grid.
        radiance: Three numbers by lamp.
        axes: Unit vectors by lamp.
        lobes: Floor and sharpness by lamp.
        density: Of picked points, by cell and unit [1/m2].
        chance: Of each unit to be picked, summed up, by cell and unit.
        given: What all units give to each cell.
        grid: x and y of the corner [m], and cells per metre.
        get_shape: Mitsuba's; returns the mesh.
        rooms: Whether lamps may be lit rooms, which are not as bright everywhere.
    """

    count: int
    units: int
    fan: int
    cells: int
    radiance: Any
    axes: Any
    lobes: Any
    density: Any
    chance: Any
    given: Any
    grid: Any
    get_shape: Any
    rooms: bool

    def eval(self, si: Any, active: Any = True) -> Any:
        """Return the radiance towards where a ray came from."""
        front, out = active & (si.wi.z > 0.0), si.to_world(si.wi)
        shining = self._shining(self._lamp(si.uv), out, front)
        if not self.rooms:
            return shining
        place = dr.clip(si.shape.eval_attribute_3(WEAR_ATTRIBUTE, si, front), 0.0, 1.0)
        walls = si.shape.eval_attribute_3(convert.TINT_ATTRIBUTE, si, front)
        return shining * seen_through(place, inward(out, si.n), walls, si.t)[1]

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
        """Return the radiance towards where light is looked for."""
        del it
        front = active & (dr.dot(ds.d, ds.n) < 0.0)
        return self._shining(self._lamp(ds.uv), -ds.d, front)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
        """Return the density of directions to a point on a lamp [1/sr]."""
        cosine = -dr.dot(ds.d, ds.n)
        unit = dr.minimum(mi.UInt32(ds.uv.x * self.units), self.units - 1)
        density = dr.gather(mi.Float, self.density, self._cell(it.p) + unit, active)
        return dr.select(active & (cosine > 0.0), density * dr.square(ds.dist) / cosine, 0.0)

    def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
        """Return a direction to a point on a lamp, and its light over its density."""
        ds = self._point(it.p, sample, active)
        ds.time = it.time
        ds.d = ds.p - it.p
        ds.dist = dr.norm(ds.d)
        ds.d /= ds.dist
        ds.pdf = self.pdf_direction(it, ds, active)
        lit = active & (ds.pdf > 0.0)
        light = self._shining(self._lamp(ds.uv), -ds.d, lit)
        return ds, dr.select(lit, light / ds.pdf, 0.0)

    def bbox(self) -> Any:
        """Return the bounding box of all lamps."""
        return self.get_shape().bbox()

    def to_string(self) -> str:
        """Return a name for Mitsuba's messages."""
        return f"LampEmitter[{self.count}]"

    def _lamp(self, uv: Any) -> Any:
        """Return the number of the lamp at texture coordinates."""
        # Mitsuba's v runs up, ours down.
        return dr.minimum(mi.UInt32(-uv.y * self.count), self.count - 1)

    def _cell(self, place: Any) -> Any:
        """Return where the numbers of a place's cell begin in the tables by cell and unit."""
        grid = dr.gather(mi.Vector3f, self.grid, mi.UInt32(0))
        last = self.cells - 1.0
        column = mi.UInt32(dr.clip((place.x - grid.x) * grid.z, 0.0, last))
        row = mi.UInt32(dr.clip((place.y - grid.y) * grid.z, 0.0, last))
        return (row * self.cells + column) * self.units

    def _shining(self, lamp: Any, out: Any, active: Any) -> Any:
        """Return the radiance of a lamp into a direction."""
        full = dr.gather(mi.Color3f, self.radiance, lamp, active)
        cosine = dr.dot(out, dr.gather(mi.Vector3f, self.axes, lamp, active))
        lobe = dr.gather(mi.Vector2f, self.lobes, lamp, active)
        share = lobe.x + (1.0 - lobe.x) * dr.exp(lobe.y * (cosine - 1.0))
        return dr.select(active, full * share, 0.0)

    def _point(self, place: Any, sample: Any, active: Any) -> Any:
        """Return a point on a lamp, picked by what lamps give to a place."""
        face, left = self._face(self._cell(place), sample.x, active)
        part = mi.warp.square_to_uniform_triangle(mi.Point2f(left, sample.y))
        mesh = self.get_shape()
        corners = mesh.face_indices(face, active)
        a, b, c = (mesh.vertex_position(k, active) for k in (corners.x, corners.y, corners.z))
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = a + (b - a) * part.x + (c - a) * part.y
        ds.n = dr.normalize(dr.cross(b - a, c - a))
        ds.uv = mesh.vertex_texcoord(corners.x, active)
        ds.emitter = mi.EmitterPtr(self)
        return ds

    def _face(self, first: Any, number: Any, active: Any) -> tuple[Any, Any]:
        """Return the face that a number in [0, 1) picks, and what is left of the number."""

        def chance(k: Any) -> Any:
            return dr.gather(mi.Float, self.chance, first + k, active)

        unit = dr.binary_search(0, self.units - 1, lambda k: chance(k) < number)
        low = dr.select(unit > 0, chance(dr.maximum(unit, 1) - 1), 0.0)
        left = (number - low) / dr.maximum(chance(unit) - low, 1e-12) * self.fan
        part = dr.minimum(mi.UInt32(dr.maximum(left, 0.0)), self.fan - 1)
        return unit * self.fan + part, dr.clip(left - part, 0.0, 1.0)


def register_lamps() -> None:
    """Make the emitter known to the active JIT variant."""

    class LampEmitter(mi.Emitter):  # type: ignore[misc]
        """Lamps on the faces of one mesh."""

        # Mitsuba's classes cannot have a second base class.
        eval, eval_direction = _LampsEmitter.eval, _LampsEmitter.eval_direction
        pdf_direction, sample_direction = (
            _LampsEmitter.pdf_direction,
            _LampsEmitter.sample_direction,
        )
        bbox, to_string = _LampsEmitter.bbox, _LampsEmitter.to_string
        _lamp, _cell, _shining = _LampsEmitter._lamp, _LampsEmitter._cell, _LampsEmitter._shining
        _point, _face = _LampsEmitter._point, _LampsEmitter._face

        def __init__(self, props: Any) -> None:
            mi.Emitter.__init__(self, props)
            self.m_flags = mi.EmitterFlags.Surface
            self.count, self.units = int(props["count"]), int(props["units"])
            self.fan, self.cells = int(props["fan"]), int(props["cells"])
            self.rooms = bool(props["rooms"])
            self.radiance = dr.opaque(mi.Float, 0.0, 3 * self.count)
            self.axes = dr.opaque(mi.Float, 0.0, 3 * self.count)
            self.lobes = dr.opaque(mi.Float, 0.0, 2 * self.count)
            self.density = dr.opaque(mi.Float, 0.0, self.cells**2 * self.units)
            self.chance = dr.opaque(mi.Float, 1.0, self.cells**2 * self.units)
            self.given = dr.opaque(mi.Float, 0.0, self.cells**2)
            self.grid = dr.opaque(mi.Float, 0.0, 3)

        def traverse(self, callback: Any) -> None:
            mi.Emitter.traverse(self, callback)
            for name in _TABLES:
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

    mi.register_emitter(_PLUGIN, lambda props: LampEmitter(props))


@dataclass(frozen=True, slots=True)
class LampSizes:
    """How many lamps an emitter has, and how they are picked; see its attributes of these names."""

    count: int
    units: int
    fan: int
    cells: int


def lamp_sizes(emitter: Any) -> LampSizes:
    """Return the sizes of an emitter of lamps."""
    return LampSizes(emitter.count, emitter.units, emitter.fan, emitter.cells)


def lamp_emitter(
    count: int, units: int, *, jit: bool, fan: int = 1, rooms: bool = False
) -> dict[str, Any]:
    """Return the emitter of a mesh of lamps as a plugin's dict; it is dark at first.

    Args:
        count: Lamps.
        units: What is picked; their numbers are in u, those of the lamps in v.
        jit: Whether the variant compiles.
        fan: Faces of a unit.
        rooms: Whether they may be lit rooms.
    """
    if jit:
        sizes = {"count": count, "units": units, "fan": fan, "cells": cells_for(units)}
        sizes["rooms"] = rooms
        return {"type": _PLUGIN, **sizes, "sampling_weight": 0.0}
    radiance = {"type": "mesh_attribute", "name": convert.RADIANCE_ATTRIBUTE}
    return {"type": "area", "radiance": radiance, "sampling_weight": 0.0}


def light(parameters: Any, name: str, glow: Glow, frame: FrameState, *, weight: float) -> None:
    """Make a mesh of lamps shine as it does in one frame.

    Args:
        parameters: Of the scene.
        name: Of the mesh.
        glow: How it shines.
        frame: Says what is in the picture.
        weight: How often paths aim at it, against other lamps of the same power; 0 never.
    """
    convert.overwrite(parameters, f"{name}.emitter.radiance", glow.radiance)
    convert.overwrite(parameters, f"{name}.emitter.axes", glow.axes)
    convert.overwrite(parameters, f"{name}.emitter.lobes", glow.lobes[:, :2])
    if weight <= 0.0:
        return
    grid = grid_of(frame.view, cells_for(len(glow.areas)))
    picks = picked(glow, grid, _shine(frame))
    start = [*(grid.corner - frame.origin[:2]), 1.0 / grid.step]
    for table, values in (*picks._asdict().items(), ("grid", np.array(start))):
        convert.overwrite(parameters, f"{name}.emitter.{table}", values)
    lumens = CANDELAS_PER_UNIT * float(glow.power @ nearness(glow.places, frame.view))
    parameters[f"{name}.emitter.sampling_weight"] = weight * share_of(lumens)


def _shine(frame: FrameState) -> Shine | None:
    """Return how wet ground mirrors lamps to the eye in a frame; None if it is dry."""
    weather = frame.weather
    wetness = 0.0 if weather is None else max(weather.wetness, weather.puddles)
    return Shine(frame.view.position[:2], wetness) if wetness > 0.0 else None


def lobe_row(lobe: Lobe) -> tuple[float, float, float]:
    """Return a row of `Glow.lobes`."""
    return lobe.floor, lobe.sharpness, lobe.flux


def axes_of(normals: Floats, areas: Floats, lamp_of_face: Ints, count: int) -> Floats:
    """Return the mean direction of each lamp's faces, unit, (count, 3).

    Args:
        normals: Of the faces, unit, (m, 3).
        areas: Of the faces, (m,) [m2].
        lamp_of_face: (m,).
        count: Lamps.
    """
    whole = areas[:, None] * normals
    total = np.stack([np.bincount(lamp_of_face, axis, minlength=count) for axis in whole.T], axis=1)
    return unit(np.asarray(total, dtype=np.float64))


def faces_of(mesh_vertices: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Return unit normals, (m, 3), and areas, (m,) [m2], of triangles."""
    across = area_vectors(mesh_vertices, faces)
    twice = np.linalg.norm(across, axis=1)
    return across / np.maximum(twice, 1e-30)[:, None], 0.5 * twice
