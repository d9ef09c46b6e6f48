"""The far level of a car: a loft of a few cross sections with dark windows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh
from sumo3dviz_pt.shapes.car_body import CarShape
from sumo3dviz_pt.shapes.solids import box, lathe, mirrored, moved, shaded

_SEGMENTS = 8
_BANDS = 4
_WINDOW, _TOP = 2, 3


def far_pieces(shape: CarShape, *, track: float) -> Iterator[tuple[str, Mesh]]:
    """Body, windows, wheels and lamps with a few hundred triangles.

    Args:
        shape: The body.
        track: |y| of the wheels' middles [m].

    Yields:
        Material and mesh, in the body frame.
    """
    stations = _stations(shape)
    rings = np.stack([_ring(shape, d) for d in stations])
    vertices, faces, tags = _loft(rings, _glazed(shape, stations))
    for tag, material in enumerate(("paint", "glass", "trim")):
        yield material, shaded(vertices, faces[tags == tag], crease=0.6)
    for material, mesh in (*_wheels(shape, track), *_lamps(shape)):
        yield material, mesh
        yield material, mirrored(mesh)


def _stations(shape: CarShape) -> Floats:
    """Distances d of the cross sections: bumpers, bonnet, cowl, roof, rear window."""
    recipe = shape.recipe
    low, high = recipe.rear_window
    roof_d = np.linspace(recipe.header, float(shape.backlight(high)), 100)
    crown = float(roof_d[shape.roof(roof_d).argmax()])
    end = float(shape.backlight(high + 0.05))
    first, last = _reach(shape)
    boot = min(float(shape.backlight(low - 0.02)), last - 0.06)
    stations = [
        first,
        first + 0.09,
        0.5 * recipe.cowl[0],
        recipe.cowl[0] + 0.03,
        recipe.header,
        crown,
        end,
        boot,
        last - 0.11,
        last,
    ]
    if recipe.bed:
        stations[6:8] = [recipe.bed[0] - 0.12, recipe.bed[0] - 0.02]
    return np.unique(np.round(stations, 3))


def _reach(shape: CarShape) -> tuple[float, float]:
    """Distances d just within the foremost and the rearmost point of the middle [m]."""
    d = np.linspace(-0.1, shape.recipe.length + 0.1, 1200)
    dd, zz = np.meshgrid(d, np.linspace(0.1, shape.recipe.height, 120), indexing="ij")
    within = d[(shape.field(dd, np.zeros_like(dd), zz) < 0.0).any(axis=1)]
    return float(within[0]) + 0.01, float(within[-1]) - 0.01


def _ring(shape: CarShape, d: float) -> Floats:
    """Five points of the half cross section at d, from the floor to the roof, (5, 3)."""
    recipe = shape.recipe
    y, z = np.linspace(0.0, shape.half + 0.05, 240), np.linspace(0.05, recipe.height + 0.02, 320)
    zz, yy = np.meshgrid(z, y, indexing="ij")
    inside = shape.field(np.full_like(zz, d), yy, zz) < 0.0
    levels = z[inside[:, 0]]
    low, high = float(levels.min()), float(levels.max())
    reach = np.where(inside, yy, 0.0).max(axis=1)

    def wide(level: float) -> tuple[float, float]:
        level = float(np.clip(level, low + 0.01, high - 0.01))
        return float(np.interp(level, z, reach)), level

    belt = min(float(shape.belt(d)) + 0.02, high - 0.05)
    corners = [wide(low + 0.02), wide(recipe.shoulder), wide(belt), wide(high - 0.06), (0.0, high)]
    return np.array([(-d, *corner) for corner in corners])


def _glazed(shape: CarShape, stations: Floats) -> Bools:
    """Which bands between stations are glass, (stations - 1, bands)."""
    recipe = shape.recipe
    middle = 0.5 * (stations[1:] + stations[:-1])
    end = recipe.bed[0] - 0.12 if recipe.bed else float(shape.backlight(recipe.rear_window[1]))
    boot = recipe.bed[0] if recipe.bed else float(shape.backlight(recipe.rear_window[0] - 0.03))
    glazed = np.zeros((len(middle), _BANDS), dtype=np.bool_)
    glazed[:, _WINDOW] = (middle > recipe.cowl[0]) & (middle < end)
    screen = (middle > recipe.cowl[0]) & (middle < recipe.header)
    glazed[:, _TOP] = screen | ((middle > end - 0.05) & (middle < boot))
    return glazed


def _loft(rings: Floats, glazed: Bools) -> tuple[Floats, Ints, Ints]:
    """Join half rings, (s, 5, 3), to a closed body; tags are 0 paint, 1 glass, 2 trim."""
    count = len(rings)
    right = rings[:, -2::-1] * np.array([1.0, -1.0, 1.0])
    whole = np.concatenate([rings, right], axis=1)
    around = whole.shape[1]
    s, k = np.meshgrid(np.arange(count - 1), np.arange(around), indexing="ij")
    a, b = s * around + k, s * around + (k + 1) % around
    quads = np.stack([a, b, b + around, a + around], axis=-1).reshape(-1, 4)
    band = np.minimum(k, around - 2 - k)
    tags = np.where(band < 0, 2, glazed[s, np.maximum(band, 0)].astype(int)).reshape(-1)
    faces = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    last = (count - 1) * around
    front = [(0, k + 1, k) for k in range(1, around - 1)]
    rear = [(last, last + k, last + k + 1) for k in range(1, around - 1)]
    caps = np.array(front + rear, dtype=np.int64)
    tags = np.concatenate([tags, tags, np.zeros(len(caps), dtype=np.int64)])
    return whole.reshape(-1, 3), np.concatenate([faces, caps]), tags


def _wheels(shape: CarShape, track: float) -> Iterator[tuple[str, Mesh]]:
    """The two left wheels as short cylinders with a bright disc."""
    wheel = shape.recipe.wheel
    r, w, rim = wheel.radius, wheel.width / 2.0, wheel.radius * wheel.rim
    tyre = lathe([(r, -w), (r, w), (rim, w)], segments=_SEGMENTS, crease=0.8)
    disc = lathe([(rim, w), (0.0, 0.8 * w)], segments=_SEGMENTS, crease=0.9)
    for d in shape.recipe.axles:
        yield "rubber", moved(tyre, -d, track, r)
        yield "rim", moved(disc, -d, track, r)


def _lamps(shape: CarShape) -> Iterator[tuple[str, Mesh]]:
    """Left lamps as slabs at the height of the recipe's own lamps."""
    seen: set[str] = set()
    for panel in shape.recipe.panels:
        if panel.material not in ("lamp_white", "lamp_red") or panel.material in seen:
            continue
        seen.add(panel.material)
        corners = np.asarray(panel.outline)
        (y0, z0), (y1, z1) = corners.min(axis=0), corners.max(axis=0)
        y1 = min(y1, 0.93 * shape.half)
        middle = 0.5 * (y0 + y1)
        front = panel.view == "front"
        x = -_bumper(shape, middle, 0.5 * (z0 + z1), front=front)
        yield panel.material, box((x - 0.03, y0, z0), (x + 0.03, y1, z1))


def _bumper(shape: CarShape, y: float, z: float, *, front: bool) -> float:
    """Distance d of the front or rear at (y, z) [m]."""
    length = shape.recipe.length
    d = np.linspace(0.0, 1.0, 500) if front else length - np.linspace(0.0, 1.0, 500)
    inside = shape.field(d, np.full_like(d, y), np.full_like(d, z)) < 0.0
    return float(d[inside.argmax()])
