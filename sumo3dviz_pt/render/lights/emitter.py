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
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, area_vectors, unit
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Lobe, View
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.rooms import inward, seen_through
from sumo3dviz_pt.render.textures import WEAR_ATTRIBUTE

_MOST_CELLS = 64
_ROOM = 2_000_000  # numbers in a table by cell and unit
_AHEAD = 60.0  # from the eye to the middle of the grid [m]
_NEAR = 30.0  # from here on, a lamp's light matters less the smaller it is in the picture [m]
_AROUND = 12.0  # lamps this far outside the picture still light what is in it [m]
_OUTSIDE = 0.1

WIDE = 192.0
"""Side of the grid by whose cells lamps are picked [m]."""


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
        weight: How often paths aim at them, against other lamps of the same power; 0 never.
    """

    radiance: Floats
    axes: Floats
    lobes: Floats
    areas: Floats
    lamp_of_unit: Ints
    places: Floats
    weight: float = 1.0

    @property
    def power(self) -> Floats:
        """What units give, mean of the channels, (m,)."""
        power = (self.radiance.mean(axis=1) * self.lobes[:, 2])[self.lamp_of_unit] * self.areas
        # Lamps whose radiance is NaN must be picked, too, so that the picture's account shows it.
        return np.asarray(np.nan_to_num(power, nan=1.0, posinf=1e3))


def cells_for(units: int) -> int:
    """Return the number of rows (and of columns) that a grid of some units has."""
    return int(np.clip(np.sqrt(_ROOM / units), 1, _MOST_CELLS))


@dataclass(frozen=True, slots=True)
class LampSizes:
    """How many lamps a mesh has, and how they are picked.

    Attributes:
        count: Lamps.
        units: What paths pick; as many neighbouring faces of the same area as a fan has.
        fan: Faces of a unit.
    """

    count: int
    units: int
    fan: int

    @property
    def cells(self) -> int:
        """Rows, and columns, of the grid by whose cells units are picked."""
        return cells_for(self.units)


def share_of(lumens: float) -> float:
    """Return how often paths aim at an emitter of so much light [lm], against a night sky.

    Noise is least where an emitter is picked in proportion to the root of its light's second
    moment. A small lamp lights a small place, but almost alone, so the root of its light
    counts.
    """
    return float(np.sqrt(min(max(lumens, 0.0), 1e9) / 1250.0))


def grid_corner(view: View) -> Floats:
    """Return the lowest x and y of the square around what a view sees, (2,) [m]."""
    forward = view.world_from_camera.matrix[:2, 0]
    return np.asarray(view.position[:2] + _AHEAD * forward - WIDE / 2.0)


def nearness(places: Floats, view: View) -> Floats:
    """Return how much the light of lamps at places, (n, 3) [m], matters in a picture, (n,)."""
    seen = (places - view.position) @ view.world_from_camera.matrix[:3, :3]
    inside = view.lens.is_near_columns(seen, widened=1.15, margin=_AROUND)
    large = 1.0 / (1.0 + np.linalg.norm(seen, axis=1) / _NEAR)
    return np.asarray(np.where(inside, large, _OUTSIDE * large))


_PLUGIN = "sumo3dviz_lamps"


class _LampsEmitter:
    """The emitter's methods. Mitsuba's class, made once a variant is set, takes them from here.

    Attributes:
        sizes: How many lamps there are, and how they are picked.
        picks: Arrays of all lamps of the scene; set once these are known.
        number: Of the mesh in them.
        get_shape: Mitsuba's; returns the mesh.
        rooms: Whether lamps may be lit rooms, which are not as bright everywhere.
    """

    sizes: LampSizes
    picks: Any
    number: Any
    get_shape: Any
    rooms: bool

    def eval(self, si: Any, active: Any = True) -> Any:
        """Return the radiance towards where a ray came from."""
        front, out = active & (si.wi.z > 0.0), si.to_world(si.wi)
        shining = self.picks.shining(self.number, si.uv.y, out, front)
        if not self.rooms:
            return shining
        place = dr.clip(si.shape.eval_attribute_3(WEAR_ATTRIBUTE, si, front), 0.0, 1.0)
        walls = si.shape.eval_attribute_3(convert.TINT_ATTRIBUTE, si, front)
        return shining * seen_through(place, inward(out, si.n), walls, si.t)[1]

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
        """Return the radiance towards where light is looked for."""
        del it
        front = active & (dr.dot(ds.d, ds.n) < 0.0)
        return self.picks.shining(self.number, ds.uv.y, -ds.d, front)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
        """Return the density of directions to a point on a lamp [1/sr]."""
        cosine = -dr.dot(ds.d, ds.n)
        density = self.picks.density(self.number, ds.uv.x, it.p, active)
        return dr.select(active & (cosine > 0.0), density * dr.square(ds.dist) / cosine, 0.0)

    def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
        """Return a direction to a point on a lamp, and its light over its density."""
        picked = self.picks.pick(self.number, it.p, sample.x, active)
        ds = self._point(picked.face, mi.Point2f(picked.left, sample.y), active)
        ds.time = it.time
        ds.d = ds.p - it.p
        ds.dist = dr.norm(ds.d)
        ds.d /= ds.dist
        cosine = -dr.dot(ds.d, ds.n)
        front = active & (cosine > 0.0)
        ds.pdf = dr.select(front, picked.density * dr.square(ds.dist) / cosine, 0.0)
        lit = active & (ds.pdf > 0.0)
        light = self.picks.shining(self.number, ds.uv.y, -ds.d, lit)
        return ds, dr.select(lit, light / ds.pdf, 0.0)

    def bbox(self) -> Any:
        """Return the bounding box of all lamps."""
        return self.get_shape().bbox()

    def to_string(self) -> str:
        """Return a name for Mitsuba's messages."""
        return f"LampEmitter[{self.sizes.count}]"

    def _point(self, face: Any, part: Any, active: Any) -> Any:
        """Return a point of a face by two numbers in [0, 1)."""
        part = mi.warp.square_to_uniform_triangle(part)
        mesh = self.get_shape()
        corners = mesh.face_indices(face, active)
        a, b, c = (mesh.vertex_position(k, active) for k in (corners.x, corners.y, corners.z))
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = a + (b - a) * part.x + (c - a) * part.y
        ds.n = dr.normalize(dr.cross(b - a, c - a))
        ds.uv = mesh.vertex_texcoord(corners.x, active)
        ds.emitter = mi.EmitterPtr(self)
        return ds


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
        _point = _LampsEmitter._point

        def __init__(self, props: Any) -> None:
            mi.Emitter.__init__(self, props)
            self.m_flags = mi.EmitterFlags.Surface
            self.sizes = LampSizes(*(int(props[key]) for key in ("count", "units", "fan")))
            self.rooms = bool(props["rooms"])

        def traverse(self, callback: Any) -> None:
            mi.Emitter.traverse(self, callback)

    mi.register_emitter(_PLUGIN, lambda props: LampEmitter(props))


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
        sizes = {"count": count, "units": units, "fan": fan}
        return {"type": _PLUGIN, **sizes, "rooms": rooms, "sampling_weight": 0.0}
    radiance = {"type": "mesh_attribute", "name": convert.RADIANCE_ATTRIBUTE}
    return {"type": "area", "radiance": radiance, "sampling_weight": 0.0}


def weigh(parameters: Any, name: str, glow: Glow, view: View) -> None:
    """Say how often paths aim at a mesh of lamps, as it shines in one frame.

    Args:
        parameters: Of the scene.
        name: Of the mesh.
        glow: How it shines.
        view: What is in the picture.
    """
    if glow.weight > 0.0:
        lumens = CANDELAS_PER_UNIT * float(glow.power @ nearness(glow.places, view))
        parameters[f"{name}.emitter.sampling_weight"] = glow.weight * share_of(lumens)


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
