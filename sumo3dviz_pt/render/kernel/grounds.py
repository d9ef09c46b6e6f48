"""Maps of the ground around the renderer's origin: where weather acts, and how far it reaches.

They are made of all that stands, seen from above, whenever a frame has another origin. So they are
the same whatever was rendered before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.ndimage import gaussian_filter, grey_opening

from sumo3dviz_pt.model.geometry import Floats, Image, Mesh
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.trajectory import TyreTracks
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.kernel.rows import MaterialKind
from sumo3dviz_pt.render.kernels import aligned, load

_CABIN = 3.0
"""What moves and lies nearer than this to where a ray starts may be the inside of a cabin [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """A place on a surface, as arrays of Dr.Jit.

    Attributes:
        p: Relative to the renderer's origin [m].
        own: Where patterns are read that move with the surface [m].
        normal: Unit shading normal.
        wi: Unit direction to where the ray came from, in the world.
        away: Distance along the ray [m].
        kind: What is special about the material.
        moves: Whether the surface moves.
        rigid: Whether it moves without changing its shape.
        parked: Whether it could move, but never does.
        active: Which lanes count.
    """

    p: Any
    own: Any
    normal: Any
    wi: Any
    away: Any
    kind: Any
    moves: Any
    rigid: Any
    parked: Any
    active: Any

    @property
    def inside(self) -> Any:
        """Whether it may lie in a cabin in which the camera rides: no weather gets there."""
        return self.moves & (self.away < _CABIN)

    def has(self, what: MaterialKind) -> Any:
        """Return whether the material is any of some kinds."""
        return (self.kind & int(what)) != 0


@dataclass(frozen=True, slots=True, eq=False)
class SkyExposure:
    """How far rain and snow reach a place, as arrays of Dr.Jit.

    Attributes:
        place: In coordinates that repeat, for patterns [m].
        open: How far it lies under the sky, in [0, 1].
        up: Vertical part of its normal; leaves have two sides.
        low: How low the ground lies there.
        rut: How deep in a rut of wheels it lies, in [0, 1].
        above: Height over what is seen from above, bare of leaves [m].
        leaf: Whether it is a leaf.
        pixel: Angle of a pixel [rad].
        tracks: How much snow wheels took away and made dirty, and the slopes of the former
            towards the east and the north [1/m]; None where there are no tracks.
    """

    place: Any
    open: Any
    up: Any
    low: Any
    rut: Any
    above: Any
    leaf: Any
    pixel: Any
    tracks: tuple[Any, Any, Any, Any] | None = None

    def paved(self, spot: Spot, what: MaterialKind) -> Any:
        """Return whether a place is level ground that is paved in some way."""
        return spot.has(what) & (self.up > 0.8) & ~spot.moves


def soft(value: Any) -> Any:
    """Return a value, cut to [0, 1], with soft ends."""
    return eased(dr.clip(value, 0.0, 1.0))


def number(value: float) -> Any:
    """Return a number that is no part of the kernel's code."""
    return dr.opaque(mi.Float, float(value))


CELL = 0.5
"""Side of a cell of the map of heights [m]."""

CELLS = 1280
"""Cells of a side of that map; it reaches 320 m to each side of the origin."""

TRACK_CELL = 0.25
"""Side of a cell of the map of tracks [m]."""

TRACK_CELLS = 2048
"""Cells of a side of that map."""

_SKY = 4000.0  # where rays from above start [m]
_NOTHING = -1e4  # height where there is nothing [m]
_THIN = 3  # what is narrower than so many cells keeps no rain off
_STEP = 0.15  # differences of height that count for what lies low [m]
_WALL = 0.45  # higher steps are walls, and say nothing of how low the ground lies [m]
_RINGS = (1.0, 2.0, 3.5)  # [m]
_WIDTH = 1.0  # spread of a wheel's track [cells]
_WIDE = 3.6  # spread of what wheels throw aside [cells]
_RIM = 4.0  # what lies nearer to a map's border is left out: it would go on beyond [m]
_OFTEN = 2.2  # passages after which two thirds of the snow are gone
_ONE_RUT = 1.0 - float(np.exp(-1.0 / _OFTEN))  # what one passage takes away in its middle
_MESSED = 0.8  # the same of snow that is no longer clean


def heights_from_above(meshes: Sequence[Mesh], origin: Floats) -> Image:
    """Return the heights of what is seen from above, (CELLS, CELLS) [m], rows from the south.

    Args:
        meshes: In the network's coordinates.
        origin: The renderer's, (3,) [m].
    """
    bsdf = load({"type": "diffuse"})
    parts = {
        f"mesh{number}": convert.make_mesh(
            f"mesh{number}", Mesh(mesh.vertices - origin, mesh.faces), bsdf=bsdf
        )
        for number, mesh in enumerate(meshes)
        if len(mesh.faces)
    }
    if not parts:
        return np.full((CELLS, CELLS), _NOTHING, np.float32)
    scene = load({"type": "scene", **parts}, optimize=False)
    index = dr.arange(mi.UInt32, CELLS * CELLS)
    row = index // CELLS
    column = index - row * CELLS
    middle = 0.5 * CELLS - 0.5
    start = mi.Point3f(
        CELL * (mi.Float(column) - middle), CELL * (mi.Float(row) - middle), mi.Float(_SKY)
    )
    hit = scene.ray_intersect_preliminary(mi.Ray3f(start, mi.Vector3f(0.0, 0.0, -1.0)))
    height = dr.select(hit.is_valid(), _SKY - hit.t, _NOTHING)
    return np.asarray(np.array(height), np.float32).reshape(CELLS, CELLS)


def shelter(heights: Image) -> Image:
    """Return the heights of what keeps rain off; poles, arms and wires do not."""
    return np.asarray(grey_opening(heights, size=(_THIN, _THIN)), np.float32)


def lowness(heights: Image) -> Image:
    """Return how low the ground lies beside what is around it, of the shape of `heights`.

    Beside a kerb of 12 cm it is about 1/2, on even ground 0, on a ridge below.
    """
    total = np.zeros(heights.shape, np.float32)
    count = 0
    for radius in _RINGS:
        steps = round(radius / CELL)
        slant = round(0.7071 * steps)
        around = [(0, steps), (steps, 0), (0, -steps), (-steps, 0)]
        around += [(slant, slant), (slant, -slant), (-slant, slant), (-slant, -slant)]
        for dy, dx in around:
            other = np.roll(heights, (dy, dx), axis=(0, 1))
            step = other - heights
            step[np.abs(step) > _WALL] = 0.0
            total += np.clip(step, -_STEP, _STEP)
            count += 1
    rim = round((_RINGS[-1] + _RIM) / CELL)
    inside = np.zeros(heights.shape, np.bool_)
    inside[rim:-rim, rim:-rim] = True
    total[~inside] = 0.0
    return np.asarray(gaussian_filter(total / (0.05 * count), 0.7), np.float32)


def trodden(tracks: TyreTracks, origin: Floats) -> tuple[Image, Image]:
    """Return how much of the snow wheels took away, and how much they made dirty.

    Both are (TRACK_CELLS, TRACK_CELLS) in [0, 1], rows from the south.

    Args:
        tracks: In the network's coordinates.
        origin: The renderer's, (3,) [m].
    """
    begins, ends = tracks.begins - origin[:2], tracks.ends - origin[:2]
    reach = 0.5 * TRACK_CELL * TRACK_CELLS
    inside = (np.abs(begins) < reach - _RIM).all(axis=1) & (np.abs(ends) < reach - _RIM).all(axis=1)
    begins, ends = begins[inside], ends[inside]
    lengths = np.hypot(*(ends - begins).T)
    passed = np.zeros(TRACK_CELLS * TRACK_CELLS)
    most = int(np.ceil(lengths.max() / TRACK_CELL)) if len(lengths) else 0
    for step in range(most):
        some = lengths > step * TRACK_CELL
        share = (step + 0.5) * TRACK_CELL / np.maximum(lengths[some], TRACK_CELL)
        spots = begins[some] + np.minimum(share, 1.0)[:, None] * (ends[some] - begins[some])
        weight = np.minimum(lengths[some] / TRACK_CELL - step, 1.0)
        cell = np.floor((spots + reach) / TRACK_CELL).astype(np.int64)
        passed += np.bincount(
            cell[:, 1] * TRACK_CELLS + cell[:, 0], weights=weight, minlength=len(passed)
        )
    cells = passed.reshape(TRACK_CELLS, TRACK_CELLS)
    shares = []
    for width, often in ((_WIDTH, _OFTEN), (_WIDE, _MESSED)):
        # A straight line of one passage in each cell has this height when it is spread.
        once = 1.0 / (np.sqrt(2.0 * np.pi) * width)
        spread = gaussian_filter(cells, width)
        shares.append(np.asarray(1.0 - np.exp(-spread / (often * once)), np.float32))
    return shares[0], shares[1]


def rut_depths(ruts: TyreTracks, origin: Floats) -> Image:
    """Return how deep in a rut the ground lies, (TRACK_CELLS, TRACK_CELLS) in [0, 1].

    Args:
        ruts: In the network's coordinates.
        origin: The renderer's, (3,) [m].
    """
    gone, _ = trodden(ruts, origin)
    return np.asarray(np.minimum(gone / _ONE_RUT, 1.0), np.float32)


class Grounds:
    """Maps of the ground for the kernel.

    Args:
        meshes: All that stands and keeps rain off, in the network's coordinates.
        tracks: Where wheels have passed, or None.
        ruts: Where lanes are worn down, or None.
    """

    def __init__(
        self, meshes: Sequence[Mesh], tracks: TyreTracks | None, ruts: TyreTracks | None = None
    ) -> None:
        self._meshes, self._given, self._worn = tuple(meshes), tracks, ruts
        self._ruts: Any = None
        self._corners: Any = None
        self._low: Any = None
        self._tracks: Any = None
        self._origin: Floats | None = None

    @property
    def rutted(self) -> bool:
        """Whether it is known where lanes are worn down."""
        return self._worn is not None

    def sunk(self, p: Any, active: Any) -> Any:
        """Return how deep in a rut a place lies; see `rut_depths`."""
        return self._ruts.eval(_place(p, TRACK_CELL * TRACK_CELLS), active)[0]

    @property
    def tracked(self) -> bool:
        """Whether there are tracks."""
        return self._given is not None

    def follow(self, origin: Floats) -> None:
        """Make the maps anew where the origin is another one."""
        if self._origin is not None and np.array_equal(self._origin, origin):
            return
        self._origin = origin
        heights = shelter(heights_from_above(self._meshes, origin))
        right = np.minimum(np.arange(CELLS) + 1, CELLS - 1)
        four = [heights, heights[:, right], heights[right], heights[np.ix_(right, right)]]
        self._corners = mi.Float(aligned(np.stack(four, axis=-1), np.float32))
        self._low = _texture(lowness(heights)[..., None])
        if self._given is not None:
            gone, dirty = trodden(self._given, origin)
            slopes = np.gradient(gone, TRACK_CELL)
            self._tracks = _texture(np.stack([gone, dirty, slopes[1], slopes[0]], axis=-1))
        if self._worn is not None:
            self._ruts = _texture(rut_depths(self._worn, origin)[..., None])

    def openness(self, p: Any, active: Any) -> tuple[Any, Any]:
        """Return how far a place lies under the sky, in [0, 1], and its height above the ground.

        Args:
            p: Relative to the origin [m].
            active: Which lanes count.
        """
        x = dr.clip(p.x * (1.0 / CELL) + (0.5 * CELLS - 0.5), 0.0, CELLS - 1.001)
        y = dr.clip(p.y * (1.0 / CELL) + (0.5 * CELLS - 0.5), 0.0, CELLS - 1.001)
        column, row = mi.UInt32(x), mi.UInt32(y)
        u, v = x - mi.Float(column), y - mi.Float(row)
        tops = dr.gather(mi.Vector4f, self._corners, row * CELLS + column, active)
        reach = 0.5 * CELL * CELLS - CELL
        inside = dr.maximum(dr.abs(p.x), dr.abs(p.y)) < reach
        free = [dr.select(p.z + 0.3 >= top, mi.Float(1.0), 0.0) for top in tops]
        value = dr.lerp(dr.lerp(free[0], free[1], u), dr.lerp(free[2], free[3], u), v)
        top = dr.lerp(dr.lerp(tops.x, tops.y, u), dr.lerp(tops.z, tops.w, u), v)
        return dr.select(inside, value, 1.0), dr.select(inside, p.z - top, 1e3)

    def low(self, p: Any, active: Any) -> Any:
        """Return how low the ground lies; see `lowness`."""
        return self._low.eval(_place(p, CELL * CELLS), active)[0]

    def tracks(self, x: Any, y: Any, active: Any) -> tuple[Any, Any, Any, Any]:
        """Return how much snow wheels took away and made dirty, and the former's slopes [1/m]."""
        place = _place(mi.Vector2f(x, y), TRACK_CELL * TRACK_CELLS)
        gone, dirty, dx, dy = self._tracks.eval(place, active)
        return gone, dirty, dx, dy


def _place(p: Any, side: float) -> Any:
    """Return a place as coordinates of a map of some side [m]."""
    return mi.Point2f(p.x * (1.0 / side) + 0.5, p.y * (1.0 / side) + 0.5)


def _texture(values: Image) -> Any:
    """Return a map that is read between its cells."""
    flat = mi.Float(aligned(values, np.float32))
    return mi.Texture2f(
        mi.TensorXf(flat, values.shape),
        use_accel=False,
        migrate=False,
        filter_mode=dr.FilterMode.Linear,
        wrap_mode=dr.WrapMode.Clamp,
    )
