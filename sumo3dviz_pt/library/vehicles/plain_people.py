"""Plain people and what they ride: pedestrian, bicycle, motorcycle, scooter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, moved, superellipsoid, tube
from sumo3dviz_pt.library.vehicles.plain_wheels import thin_wheel
from sumo3dviz_pt.model.geometry import Mesh

Piece = tuple[str, Mesh]
"""Material and mesh."""

Point = tuple[float, float, float]


def pedestrian(*, fine: bool) -> Iterator[Piece]:
    """Someone who stands, 1.72 m tall, in a coat; stretched by the caller."""
    sides = 8 if fine else 4
    for s in (-1.0, 1.0):
        leg = [(0.0, 0.09 * s, 0.06), (0.02, 0.09 * s, 0.48), (0.0, 0.085 * s, 0.88)]
        yield "interior", tube(leg, radius=(0.05, 0.06, 0.065), sides=sides)
        arm = [(0.02, 0.215 * s, 0.80), (-0.01, 0.21 * s, 1.10), (0.0, 0.17 * s, 1.42)]
        yield "cloth", tube(arm, radius=(0.036, 0.046, 0.055), sides=sides)
        if fine:
            shoe = superellipsoid((0.105, 0.047, 0.05), squareness=2.6, segments=8, rings=4)
            yield "rubber", moved(shoe, 0.035, 0.09 * s, 0.05)
            hand = superellipsoid((0.035, 0.025, 0.055), squareness=2.0, segments=6, rings=4)
            yield "skin", moved(hand, 0.03, 0.215 * s, 0.755)
    yield "cloth", _torso(sides + 4 if fine else 6, fine=fine)
    yield from _head((0.0, 0.0, 1.60), fine=fine)


def _torso(sides: int, *, fine: bool) -> Mesh:
    """A flattened coat from the hips to the neck."""
    heights = (0.74, 0.95, 1.10, 1.30, 1.42, 1.49) if fine else (0.74, 1.30, 1.49)
    radii = (0.175, 0.165, 0.155, 0.185, 0.165, 0.06) if fine else (0.175, 0.185, 0.06)
    round_torso = tube([(0.0, 0.0, z) for z in heights], radius=radii, sides=sides)
    flat = np.array([0.62, 1.0, 1.0])
    assert round_torso.normals is not None
    normals = round_torso.normals / flat
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(round_torso.vertices * flat, round_torso.faces, normals)


def _head(at: Point, *, fine: bool, helmet: str = "interior") -> Iterator[Piece]:
    """Head, neck, and hair or a helmet."""
    segments, rings = (9, 6) if fine else (4, 3)
    face = superellipsoid((0.095, 0.075, 0.12), squareness=2.1, segments=segments, rings=rings)
    yield "skin", moved(face, *at)
    if not fine:
        return
    neck = [(at[0] - 0.01, 0.0, at[2] - 0.16), (at[0], 0.0, at[2] - 0.05)]
    yield "skin", tube(neck, radius=0.05, sides=7)
    hair = superellipsoid((0.10, 0.085, 0.085), squareness=2.1, segments=9, rings=5)
    yield helmet, moved(hair, at[0] - 0.018, 0.0, at[2] + 0.045)


def bicycle(*, fine: bool) -> Iterator[Piece]:
    """A bicycle with a rider, 1.7 m long and tall; the front wheel ends at x = 0."""
    front, rear, r = -0.34, -1.38, 0.34
    for x in (front, rear):
        yield from thin_wheel(x, radius=r, tyre=0.02, fine=fine)
    crank, seat, head = (-0.95, 0.0, 0.28), (-1.07, 0.0, 0.88), (-0.50, 0.0, 0.84)
    runs: list[Sequence[Point]] = [(crank, seat), (crank, head), (head, (front, 0.0, r))]
    if fine:
        runs += [
            (crank, (rear, 0.0, r)),
            ((-1.05, 0.0, 0.80), head),
            (seat, (rear, 0.0, r)),
            (head, (-0.48, 0.0, 1.02)),
        ]
    for run in runs:
        yield "paint", tube(run, radius=0.019, sides=6 if fine else 3)
    if fine:
        bar = [(-0.54, -0.30, 1.02), (-0.47, 0.0, 1.04), (-0.54, 0.30, 1.02)]
        yield "trim", tube(bar, radius=0.014, sides=6)
        saddle = superellipsoid((0.13, 0.07, 0.035), squareness=2.5, segments=8, rings=4)
        yield "trim", moved(saddle, -1.09, 0.0, 0.91)
    yield from _rider(hip=(-1.08, 0.98), grip=(-0.54, 1.04), foot=0.22, fine=fine)


def motorcycle(*, fine: bool) -> Iterator[Piece]:
    """A motorcycle with a rider, 2.1 m long, 1.55 m tall; the front wheel ends at x = 0."""
    front, rear, r = -0.32, -1.72, 0.32
    for x in (front, rear):
        yield from thin_wheel(x, radius=r, tyre=0.062, fine=fine)
    yield "trim", _blob((0.30, 0.16, 0.20), (-1.02, 0.0, 0.40), fine=fine)
    yield "paint", _blob((0.30, 0.15, 0.13), (-0.88, 0.0, 0.78), fine=fine)
    if fine:
        yield "trim", _blob((0.38, 0.13, 0.07), (-1.38, 0.0, 0.76))
        yield "paint", _blob((0.22, 0.12, 0.09), (-1.66, 0.0, 0.74))
        yield "rim", tube([(front, 0.0, r), (-0.60, 0.0, 0.92)], radius=0.045, sides=6)
        yield "trim", tube([(rear, 0.0, r), (-1.10, 0.0, 0.40)], radius=0.045, sides=6)
        yield (
            "trim",
            tube(
                [(-0.72, -0.38, 0.98), (-0.62, 0.0, 0.98), (-0.72, 0.38, 0.98)],
                radius=0.018,
                sides=6,
            ),
        )
        yield "lamp_white", _blob((0.06, 0.08, 0.08), (-0.47, 0.0, 0.86))
        yield "lamp_red", box((-1.90, -0.06, 0.73), (-1.85, 0.06, 0.79))
        yield "rim", tube([(-1.0, -0.17, 0.33), (-1.75, -0.20, 0.42)], radius=0.05, sides=8)
    yield from _rider(hip=(-1.28, 0.90), grip=(-0.70, 1.0), foot=0.34, fine=fine, helmet="paint")


def _blob(half: Point, at: Point, *, fine: bool = True) -> Mesh:
    """A rounded piece at a place."""
    segments, rings = (12, 5) if fine else (5, 3)
    return moved(superellipsoid(half, squareness=2.6, segments=segments, rings=rings), *at)


def scooter(*, fine: bool) -> Iterator[Piece]:
    """A kick scooter with a standing rider, 1.2 m long, 1.75 m tall."""
    for x in (-0.11, -1.05):
        yield from thin_wheel(x, radius=0.11, tyre=0.022, fine=fine)
    sides = 6 if fine else 3
    yield "trim", tube([(-1.05, 0.0, 0.13), (-0.30, 0.0, 0.13)], radius=0.05, sides=sides)
    yield "paint", tube([(-0.11, 0.0, 0.11), (-0.27, 0.0, 1.05)], radius=0.025, sides=sides)
    if fine:
        yield "trim", tube([(-0.27, -0.25, 1.05), (-0.27, 0.25, 1.05)], radius=0.017, sides=6)
    for material, mesh in pedestrian(fine=fine):
        yield material, moved(mesh, -0.65, 0.0, 0.17)


def wheelchair(*, fine: bool) -> Iterator[Piece]:
    """A wheelchair with someone in it, 1.2 m long and tall."""
    for y in (-0.30, 0.30):
        for material, mesh in thin_wheel(-0.85, radius=0.31, tyre=0.022, fine=fine):
            yield material, moved(mesh, 0.0, y, 0.0)
        if fine:
            for material, mesh in thin_wheel(-0.30, radius=0.10, tyre=0.02, fine=False):
                yield material, moved(mesh, 0.0, 0.8 * y, 0.0)
    yield "trim", box((-0.96, -0.22, 0.43), (-0.48, 0.22, 0.49))
    yield "trim", box((-1.0, -0.22, 0.45), (-0.95, 0.22, 0.98))
    yield from _rider(hip=(-0.86, 0.57), grip=(-0.55, 0.62), foot=0.15, fine=fine)


def _rider(
    *,
    hip: tuple[float, float],
    grip: tuple[float, float],
    foot: float,
    fine: bool,
    helmet: str = "interior",
) -> Iterator[Piece]:
    """Someone who sits and holds a bar.

    Args:
        hip: x and z of the hips [m].
        grip: x and z of the hands [m].
        foot: z of the feet [m].
        fine: Whether to use many sides.
        helmet: Material of hair or helmet.
    """
    sides = 7 if fine else 3
    (hx, hz), (gx, gz) = hip, grip
    neck = (hx + 0.22, hz + 0.50)
    trunk: list[Point] = [
        (hx, 0.0, hz - 0.08),
        (hx + 0.06, 0.0, hz + 0.18),
        (hx + 0.17, 0.0, hz + 0.40),
        (neck[0], 0.0, neck[1]),
    ]
    yield "cloth", tube(trunk, radius=(0.13, 0.15, 0.17, 0.07), sides=sides + 2 if fine else 4)
    for s in (-1.0, 1.0):
        knee = (hx + 0.42, 0.13 * s, hz - 0.10)
        leg = [(hx, 0.09 * s, hz), knee, (hx + 0.20, 0.12 * s, foot)]
        yield "interior", tube(leg, radius=(0.095, 0.07, 0.045), sides=sides)
        shoulder, hand = (neck[0] - 0.06, 0.18 * s, neck[1] - 0.08), (gx, 0.24 * s, gz)
        elbow = (0.5 * (neck[0] + gx), 0.26 * s, gz + 0.10)
        if fine:
            yield "cloth", tube((shoulder, elbow, hand), radius=(0.055, 0.046, 0.035), sides=7)
        else:
            yield "cloth", tube((shoulder, hand), radius=0.045, sides=3)
    yield from _head((neck[0] + 0.05, 0.0, neck[1] + 0.14), fine=fine, helmet=helmet)
