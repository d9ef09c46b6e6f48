"""Pieces that stick out of a car's body: mirrors, handles, plates, wipers, rails."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bakery.car.body import CarShape
from bakery.car.conform import CarFineness, bar, closed, land, resampled
from bakery.car.panels import handle_places
from sumo3dviz_pt.library.mesh.solids import box, moved, on_both_sides, shaded, superellipsoid, tube
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh

_PLATE = (0.26, 0.056)
"""Half sizes of a number plate [m]."""


def attached(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """Build plates and roof rails, which count for the car's length and height."""
    yield from on_both_sides(_rails(shape, level))
    yield from _plates(shape)


def details(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """Build mirrors, handles, wipers and antenna, which may stick out of the car's measures."""
    yield from on_both_sides((*_mirror(shape, level), *_handles(shape, level)))
    yield from _wipers(shape, level)
    yield from _spoiler(shape, level)
    yield from _antenna(shape)
    yield from _exhaust_shadow(shape)


def _mirror(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """The left door mirror: painted cap, black back with its glass, foot and repeater."""
    d, half = shape.recipe.cowl[0] + 0.38, shape.half
    z, y = float(shape.belt(d)) + 0.10, half + 0.055
    sides = max(10, level.sides)
    cap = superellipsoid((0.10, 0.115, 0.072), squareness=2.6, segments=sides, rings=sides // 2)
    # Flatten the back, where the glass sits, and round the front off.
    vertices = cap.vertices.copy()
    vertices[:, 0] = np.where(
        vertices[:, 0] < 0.0, np.maximum(vertices[:, 0], -0.03), 0.8 * vertices[:, 0]
    )
    vertices[:, 1] += 0.25 * np.minimum(vertices[:, 0], 0.02)
    yield shape.recipe.mirror, moved(shaded(vertices, cap.faces, crease=0.7), -d, y, z)
    yield "gloss_black", moved(box((-0.034, -0.096, -0.056), (-0.02, 0.096, 0.056)), -d, y, z)
    yield "glass", moved(box((-0.037, -0.088, -0.048), (-0.03, 0.088, 0.048)), -d, y, z)
    yield "lamp_amber", moved(box((0.03, 0.04, 0.008), (0.064, 0.108, 0.017)), -d, y, z)
    foot = [(-d + 0.01, half - 0.11, z - 0.065), (-d + 0.005, y - 0.04, z - 0.05)]
    yield "gloss_black", tube(foot, radius=[0.034, 0.022], sides=6)


def _handles(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """One handle on each door, before its hollow."""
    for d, z in handle_places(shape):
        path = resampled([(d - 0.09, z), (d + 0.09, z + 0.004)], 0.09)
        spots = land(shape, "side", path)
        grip = bar(spots, 0.026, height=0.03, depth=-0.012, bevelled=True)
        yield shape.recipe.grip, grip
        for end in (0, -1):
            x, y, height = spots.points[end]
            foot = box((-0.014, -0.02, -0.011), (0.014, 0.02, 0.011))
            yield shape.recipe.grip, moved(foot, x + (0.008 if end else -0.008), y, height)


def _rails(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """A roof rail that comes down at both ends."""
    if not shape.recipe.rails:
        return
    first, last = shape.recipe.header + 0.15, shape.recipe.length - 0.75
    d = np.linspace(first, last, 14)
    roof = shape.roof(d)
    y = shape.side_glass(d, roof - 0.06) - 0.05
    lift = 0.04 * np.minimum(1.0, np.minimum(d - first, last - d) / 0.15) ** 0.6
    path = np.stack([-d, y, roof - 0.055 + lift], axis=1)
    yield shape.recipe.rail, tube(path, radius=0.015, sides=max(6, level.sides // 3))


def _plates(shape: CarShape) -> Iterator[MaterialMesh]:
    """Number plates of 520 x 112 mm on dark holders."""
    half_y, half_z = _PLATE
    spots = [(y, z) for y in (0.0, half_y / 2, half_y) for z in (-half_z, 0.0, half_z)]
    for front, height in zip((True, False), shape.recipe.plates, strict=True):
        sign = 1.0 if front else -1.0
        near = land(shape, "front" if front else "rear", [(y, height + z) for y, z in spots])
        outer = float((sign * near.points[:, 0]).max()) * sign
        inset = 0.0 if front else shape.recipe.plate_recess
        for material, reach, margin in (("gap", 0.003, 0.009), ("plate", 0.006, 0.0)):
            ends = sorted((outer + sign * (reach - inset), outer - sign * (0.05 + inset)))
            low = (ends[0], -half_y - margin, height - half_z - margin)
            yield material, box(low, (ends[1], half_y + margin, height + half_z + margin))
        yield from _plate_band(outer + sign * (0.0072 - inset), height, sign)


def _plate_band(x: float, height: float, sign: float) -> Iterator[MaterialMesh]:
    """The blue band at a plate's left end; its letters are the vehicle's own, and no part of it."""
    # Seen from ahead, the reader's right is the car's left.
    ends = sorted((-0.256 * sign, -0.22 * sign))
    corners = [(x, y, height + z) for y in ends for z in (-0.052, 0.052)]
    faces = np.array([[0, 2, 3], [0, 3, 1]])
    yield (
        "livery_blue",
        shaded(np.array(corners), faces if sign > 0 else faces[:, ::-1], crease=0.3),
    )


def _wipers(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """Two wipers on the windscreen, and one on the rear window."""
    low = shape.recipe.cowl[1]
    reach = 0.76 * shape.half
    for begin, end in ((-0.02, 0.62), (-0.92, -0.12)):
        path = [(begin * reach, low + 0.035), (0.5 * (begin + end) * reach, low + 0.05)]
        path += [(end * reach, low + 0.062)]
        yield from _wiper(shape, "front", path, level)
    half = shape.recipe.wiper
    if half:
        low = shape.recipe.rear_window[0] + 0.035
        yield from _wiper(
            shape, "rear", [(0.0, low), (half, low + 0.02), (2 * half, low + 0.02)], level
        )


def _wiper(
    shape: CarShape, view: str, path: list[tuple[float, float]], level: CarFineness
) -> Iterator[MaterialMesh]:
    """A blade along a path and the arm that holds it."""
    spots = land(shape, view, resampled(path, 0.25))
    yield "gap", bar(spots, 0.014, height=0.016, depth=0.0)
    (y0, z0), (y1, z1) = path[0], path[1]
    arm = [(y0 - 0.01, z0 - 0.045), (0.5 * (y0 + y1), 0.5 * (z0 + z1) - 0.012), (y1, z1)]
    yield "gap", bar(land(shape, view, arm), 0.013, height=0.024, depth=-0.012)


def _spoiler(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """A lip over the rear window, wedge-shaped, as wide as the roof."""
    out = shape.recipe.spoiler
    if not out:
        return
    high = shape.recipe.rear_window[1] + 0.02
    d = float(shape.backlight(high))
    wide = float(shape.side_glass(np.array(d), np.array(high))) - 0.10
    y = np.linspace(-wide, wide, 9)
    # The roof's height where the lip begins, and the lip's way backwards.
    root = land(shape, "top", np.stack([np.full_like(y, d - 0.16), np.abs(y)], axis=1)).points
    edge = land(shape, "top", np.stack([np.full_like(y, d - 0.03), np.abs(y)], axis=1)).points
    back = -d - out + 0.06 * (y / wide) ** 2
    drop = 0.9 * (root[:, 2] - edge[:, 2])
    rings = [
        np.column_stack([root[:, 0], y, root[:, 2] - 0.03]),
        np.column_stack([root[:, 0], y, root[:, 2] + 0.003]),
        np.column_stack([edge[:, 0], y, root[:, 2] - 0.35 * drop + 0.004]),
        np.column_stack([back, y, root[:, 2] - 0.6 * drop - 0.01]),
        np.column_stack([back, y, root[:, 2] - 0.6 * drop - 0.026]),
        np.column_stack([edge[:, 0] + 0.05, y, edge[:, 2] - 0.06]),
    ]
    yield "paint", closed(np.stack(rings, axis=1).reshape(-1, 3), len(y), len(rings))


def _antenna(shape: CarShape) -> Iterator[MaterialMesh]:
    """A fin on the roof."""
    d = shape.recipe.antenna
    if not d:
        return
    z = float(shape.roof(d)) - 0.004
    outline = [(0.07, 0.0), (-0.06, 0.0), (-0.055, 0.034), (-0.035, 0.04), (0.01, 0.02)]
    rings = [
        np.column_stack([[x for x, _ in outline], np.full(5, y), [h for _, h in outline]])
        * [1.0, 1.0, 1.0 if abs(y) < 0.01 else 0.15]
        for y in (-0.022, -0.006, 0.006, 0.022)
    ]
    yield "gloss_black", moved(closed(np.concatenate(rings), 4, 5), -d, 0.0, z)


def _exhaust_shadow(shape: CarShape) -> Iterator[MaterialMesh]:
    """Dark axles and silencer, so that no light shows under the car."""
    recipe = shape.recipe
    for d in recipe.axles:
        low, high = 0.6 * recipe.wheel.radius, recipe.clearance + 0.12
        wide = shape.half - 0.32
        yield "gap", box((-d - 0.12, -wide, low), (-d + 0.12, wide, max(high, low + 0.05)))
