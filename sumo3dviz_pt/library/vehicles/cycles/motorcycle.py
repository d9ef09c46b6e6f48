"""Motorcycles, in metres behind the front of the front wheel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, lathe, mirrored, moved, shaded, tube
from sumo3dviz_pt.library.people.stack import closed, rope
from sumo3dviz_pt.library.vehicles.cycles.machine import Machine
from sumo3dviz_pt.library.vehicles.cycles.parts import (
    Fineness,
    Piece,
    Point,
    Wheel,
    arc,
    band,
    facing,
    lamp,
    loft,
    mirrors,
    plate,
    round_lamp,
)
from sumo3dviz_pt.library.vehicles.cycles.rider import Grasp

_R = 0.312
_FRONT: Point = (-0.315, 0.0, _R)
_REAR: Point = (-1.745, 0.0, _R)
_PIVOT: Point = (-1.210, 0.0, 0.430)
_YOKE: Point = (-0.640, 0.0, 0.925)


def motorcycle(recipe: Mapping[str, Any]) -> Machine:
    """A naked motorcycle of the middle class."""
    peg = (-1.180, 0.205, 0.405)
    grasp = Grasp(
        (-1.260, 0.0, 0.905),
        0.36,
        (-0.790, 0.330, 1.045),
        ((peg[0] + 0.02, peg[1], peg[2]), (peg[0] + 0.02, -peg[1], peg[2])),
        -0.40,
        (-0.15, -0.15),
        knees=0.30,
        roll=0.15,
    )
    lamps = (
        lamp("head", (-0.452, 0.0, 0.880), (0.15, 0.15)),
        lamp("tail", (-1.985, 0.0, 0.800), (0.13, 0.05), back=True),
        lamp("brake", (-1.985, 0.0, 0.800), (0.13, 0.05), back=True),
        *(
            lamp(role, (x, s * 0.20, z), (0.05, 0.03), back=back)
            for role, s in (("left", 1.0), ("right", -1.0))
            for x, z, back in ((-0.565, 0.845, False), (-1.985, 0.745, True))
        ),
    )
    return Machine(
        wheel=Wheel(_R, 0.066, spoked=False, disc=0.150),
        axles=(_FRONT[0], _REAR[0]),
        frame=_motorcycle,
        grasp=grasp,
        lamps=lamps,
    )


def _motorcycle(fine: Fineness) -> Iterator[Piece]:
    """Everything but wheels and rider."""
    yield from _shells(fine)
    yield from _front_end(fine)
    yield from _engine(fine)
    if fine.small:
        yield from _exhaust(fine)
        yield from _small_things(fine)


def _shells(fine: Fineness) -> Iterator[Piece]:
    """Tank, seat and tail."""
    n = (12, 14) if fine.small else (3, 5)
    tank = (
        (0.690, 0.865, 0.045, 0.050, 0.050, 2.3),
        (0.720, 0.885, 0.085, 0.090, 0.115, 2.4),
        (0.830, 0.890, 0.130, 0.110, 0.165, 2.5),
        (0.960, 0.880, 0.125, 0.110, 0.170, 2.5),
        (1.070, 0.860, 0.085, 0.090, 0.120, 2.4),
        (1.130, 0.840, 0.045, 0.060, 0.085, 2.3),
    )
    yield "paint", loft(tank, rings=n[0], sides=n[1])
    seat = (
        (1.100, 0.800, 0.020, 0.040, 0.090, 2.8),
        (1.180, 0.785, 0.022, 0.050, 0.125, 2.8),
        (1.340, 0.775, 0.025, 0.050, 0.150, 2.8),
        (1.450, 0.795, 0.030, 0.050, 0.145, 2.8),
        (1.500, 0.835, 0.035, 0.060, 0.125, 2.6),
        (1.700, 0.855, 0.030, 0.050, 0.110, 2.6),
        (1.780, 0.860, 0.015, 0.040, 0.075, 2.4),
    )
    yield "trim", loft(seat, rings=n[0], sides=n[1])
    tail = (
        (1.380, 0.730, 0.035, 0.045, 0.120, 3.0),
        (1.600, 0.780, 0.035, 0.045, 0.110, 3.0),
        (1.850, 0.820, 0.035, 0.035, 0.080, 3.0),
        (1.955, 0.835, 0.018, 0.025, 0.060, 3.0),
    )
    yield "paint", loft(tail, rings=max(3, n[0] * 2 // 3), sides=n[1] - 2)


def _front_end(fine: Fineness) -> Iterator[Piece]:
    """Fork, mudguard, head lamp, bar."""
    for s in (1.0, -1.0) if fine.small else (0.0,):
        y = 0.098 * s
        low, split = (_FRONT[0], y, _R), (-0.467, y, 0.590)
        top = (_YOKE[0] - 0.005, y, _YOKE[2] + 0.05)
        yield "trim", tube([low, split], radius=0.030, sides=fine.sides + 2)
        yield "chrome", tube([split, top], radius=0.022, sides=fine.sides + 2)
    if not fine.small:
        yield "trim", box((-0.60, -0.09, 0.80), (-0.46, 0.09, 0.96))
        yield "trim", tube([(-0.76, -0.36, 1.04), (-0.76, 0.36, 1.04)], radius=0.016, sides=3)
        return
    for z in (0.80, 0.945):
        x = -0.640 + (0.925 - z) * 0.47
        yield "trim", box((x - 0.045, -0.125, z - 0.018), (x + 0.040, 0.125, z + 0.018))
    yield "paint", band(arc(_FRONT, _R + 0.022, 35.0, 165.0, 12), half=0.072, thick=0.004)
    yield from round_lamp((-0.470, 0.0, 0.880), 0.090, fine, shell="trim", lens="lamp_white")
    for y in (-0.05, 0.05):
        dial = [(0.0, -0.05), (0.035, -0.045), (0.042, 0.0), (0.038, 0.004), (0.0, 0.004)]
        face = facing(lathe(dial, segments=12, crease=0.6), (-0.60, y, 1.01), yaw=np.pi, pitch=0.9)
        yield "glass", face
    for s in (1.0, -1.0):
        bar: list[Point] = [
            (-0.655, 0.03 * s, 0.985),
            (-0.655, 0.10 * s, 1.035),
            (-0.745, 0.25 * s, 1.050),
            (-0.815, 0.385 * s, 1.040),
        ]
        yield "trim", tube(bar, radius=0.0125, sides=fine.sides)
        yield "rubber", tube([(-0.757, 0.27 * s, 1.050), bar[3]], radius=0.0175, sides=8)
        lever = [(-0.715, 0.235 * s, 1.045), (-0.690, 0.30 * s, 1.040), (-0.735, 0.40 * s, 1.030)]
        yield "rim", tube(lever, radius=0.007, sides=5)
        tank = [(0.0, -0.02), (0.022, -0.02), (0.022, 0.02), (0.0, 0.02)]
        yield "trim", moved(lathe(tank, segments=8), -0.700, 0.20 * s, 1.080)
        yield from _indicator((-0.590, s, 0.845))


def _indicator(at: Point) -> Iterator[Piece]:
    """An indicator on a stalk; the second coordinate is the side."""
    x, s, z = at
    yield "trim", tube([(x, 0.07 * s, z), (x, 0.20 * s, z)], radius=0.008, sides=5)
    lens = (
        (-x - 0.025, z, 0.016, 0.016, 0.026, 2.5),
        (-x, z, 0.020, 0.020, 0.032, 2.5),
        (-x + 0.025, z, 0.012, 0.012, 0.020, 2.5),
    )
    yield "lamp_amber", moved(loft(lens, rings=4, sides=8), 0.0, 0.20 * s, 0.0)


def _engine(fine: Fineness) -> Iterator[Piece]:
    """Frame, crank case, cylinder with fins, radiator, swing arm."""
    if not fine.small:
        yield "trim", box((-1.25, -0.16, 0.26), (-0.72, 0.16, 0.72))
        yield "trim", box((-1.75, -0.10, 0.28), (-1.20, 0.10, 0.40))
        return
    case = (
        (0.760, 0.400, 0.090, 0.100, 0.120, 3.0),
        (0.840, 0.400, 0.150, 0.140, 0.180, 3.0),
        (1.060, 0.400, 0.150, 0.130, 0.190, 3.2),
        (1.200, 0.410, 0.100, 0.090, 0.130, 3.0),
    )
    yield "engine", loft(case, rings=7, sides=14)
    for s in (1.0, -1.0):
        cover = [(0.0, 0.03), (0.085, 0.025), (0.105, 0.0), (0.105, -0.03)][::-1]
        disc = moved(lathe(cover, segments=16, crease=0.6), -0.985, 0.185, 0.395)
        yield "engine", disc if s > 0 else mirrored(disc)
    for k in range(7):
        z = 0.545 + 0.026 * k
        x = -0.880 + 0.25 * (z - 0.5)
        yield "engine", box((x - 0.105, -0.165, z), (x + 0.105, 0.165, z + 0.012))
    yield "trim", box((-0.960, -0.150, 0.52), (-0.76, 0.150, 0.735))
    yield "trim", box((-0.735, -0.150, 0.47), (-0.695, 0.150, 0.76))
    for s in (1.0, -1.0):
        spar = [
            (-0.66, 0.05 * s, 0.86),
            (-0.80, 0.175 * s, 0.78),
            (-1.10, 0.165 * s, 0.66),
            (-1.22, 0.14 * s, 0.50),
            (-1.22, 0.13 * s, 0.36),
        ]
        yield "trim", tube(spar, radius=0.026, sides=8)
        rail = [(-1.12, 0.15 * s, 0.66), (-1.42, 0.12 * s, 0.72), (-1.80, 0.07 * s, 0.80)]
        yield "trim", tube(rail, radius=0.014, sides=6)
        arm = [
            (_PIVOT[0], 0.10 * s, _PIVOT[2]),
            (-1.40, 0.115 * s, 0.40),
            (_REAR[0], 0.115 * s, _R),
        ]
        yield "rim", tube(arm, radius=(0.035, 0.032, 0.026), sides=8)
        peg = [(-1.18, 0.15 * s, 0.395), (-1.18, 0.255 * s, 0.395)]
        yield "rubber", tube(peg, radius=0.014, sides=6)
        hanger = [(-1.21, 0.14 * s, 0.52), (-1.18, 0.16 * s, 0.395)]
        yield "rim", tube(hanger, radius=0.016, sides=6)
    yield from _final_drive()


def _final_drive() -> Iterator[Piece]:
    """Chain, sprocket and spring."""
    chain = [(-1.20, 0.105, 0.43), (_REAR[0], 0.105, _R + 0.095)]
    yield "trim", tube(chain, radius=0.010, sides=4)
    yield "trim", tube([(-1.20, 0.105, 0.36), (_REAR[0], 0.105, _R - 0.095)], radius=0.010, sides=4)
    ring = [(0.0, -0.004), (0.095, -0.004), (0.095, 0.004), (0.0, 0.004)]
    yield "rim", moved(lathe(ring, segments=20, crease=0.5), _REAR[0], 0.105, _R)
    shock = [(-1.28, 0.0, 0.70), (-1.36, 0.0, 0.44)]
    yield "lamp_amber", tube(shock, radius=0.035, sides=8)


def _exhaust(fine: Fineness) -> Iterator[Piece]:
    """Header pipes below the engine and a silencer on the right."""
    for y in (-0.10, -0.035, 0.035, 0.10):
        path = np.array(
            [
                (-0.77, y, 0.60),
                (-0.665, y, 0.54),
                (-0.655, y, 0.40),
                (-0.72, y, 0.27),
                (-0.88, 0.6 * y, 0.22),
                (-1.05, 0.4 * y - 0.03, 0.215),
            ]
        )
        yield "chrome", tube(path, radius=0.021, sides=7)
    pipe = np.array(
        [(-1.02, -0.03, 0.215), (-1.20, -0.09, 0.23), (-1.34, -0.165, 0.30), (-1.42, -0.19, 0.36)]
    )
    yield "chrome", tube(pipe, radius=0.032, sides=9)
    path = np.array(
        [(-1.40, -0.185, 0.345), (-1.44, -0.19, 0.37), (-1.78, -0.20, 0.53), (-1.815, -0.20, 0.547)]
    )
    vertices, faces = closed(
        rope(path, np.array([0.034, 0.058, 0.058, 0.045]), 14), bottom=True, top=True
    )
    yield "rim", shaded(vertices, faces, crease=0.6)
    yield "trim", tube([(-1.812, -0.20, 0.546), (-1.822, -0.20, 0.551)], radius=0.030, sides=10)


def _small_things(fine: Fineness) -> Iterator[Piece]:
    """Mirrors, rear mudguard, lamps, plate."""
    yield from mirrors((-0.700, 0.365, 1.240), (-0.690, 0.225, 1.055), fine)
    yield "trim", band(arc(_REAR, _R + 0.030, 62.0, 128.0, 9), half=0.085, thick=0.005)
    yield "trim", box((-1.98, -0.055, 0.600), (-1.93, 0.055, 0.800))
    yield (
        "lamp_red",
        loft(
            ((1.950, 0.805, 0.022, 0.022, 0.062, 3.0), (1.985, 0.800, 0.018, 0.020, 0.055, 3.0)),
            rings=3,
            sides=10,
        ),
    )
    for s in (1.0, -1.0):
        yield from _indicator((-1.955, s, 0.745))
    yield from plate((-1.995, 0.0, 0.635), half=(0.09, 0.065))
