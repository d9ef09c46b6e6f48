"""Mopeds, in metres behind the front of the front wheel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, moved, shaded, tube
from sumo3dviz_pt.library.people.stack import closed, rope
from sumo3dviz_pt.library.vehicles.cycles.machine import Machine
from sumo3dviz_pt.library.vehicles.cycles.parts import (
    Fineness,
    Piece,
    Point,
    Wheel,
    arc,
    band,
    lamp,
    loft,
    mirrors,
    plate,
)
from sumo3dviz_pt.library.vehicles.cycles.rider import Grasp
from sumo3dviz_pt.model.geometry import Mesh

_R = 0.250
_FRONT: Point = (-0.262, 0.0, _R)
_REAR: Point = (-1.580, 0.0, _R)


def moped(recipe: Mapping[str, Any]) -> Machine:
    """A scooter of 50 cubic centimetres with leg shield and floor."""
    grasp = Grasp(
        (-1.190, 0.0, 0.885),
        0.12,
        (-0.705, 0.285, 1.045),
        ((-0.690, 0.115, 0.335), (-0.690, -0.115, 0.335)),
        -0.45,
        (0.12, 0.12),
        knees=0.16,
        roll=0.2,
    )
    lamps = (
        lamp("head", (-0.380, 0.0, 0.768), (0.16, 0.07)),
        lamp("tail", (-1.842, 0.0, 0.700), (0.18, 0.06), back=True),
        lamp("brake", (-1.842, 0.0, 0.700), (0.18, 0.06), back=True),
        *(
            lamp(role, (x, s * y, z), (0.05, 0.05), back=back)
            for role, s in (("left", 1.0), ("right", -1.0))
            for x, y, z, back in ((-0.445, 0.14, 0.690, False), (-1.835, 0.145, 0.690, True))
        ),
    )
    return Machine(
        wheel=Wheel(_R, 0.055, spoked=False, disc=0.10),
        axles=(_FRONT[0], _REAR[0]),
        frame=_moped,
        grasp=grasp,
        lamps=lamps,
    )


def _moped(fine: Fineness) -> Iterator[Piece]:
    """Everything but wheels and rider."""
    n = (10, 14) if fine.small else (3, 5)
    yield "paint", _shield(n)
    floor = (
        (0.520, 0.300, 0.022, 0.040, 0.150, 4.0),
        (0.600, 0.285, 0.022, 0.050, 0.190, 4.0),
        (0.930, 0.285, 0.022, 0.055, 0.190, 4.0),
        (1.040, 0.310, 0.050, 0.070, 0.170, 4.0),
    )
    yield "trim", loft(floor, rings=max(3, n[0] // 2), sides=n[1])
    body = (
        (0.990, 0.480, 0.190, 0.170, 0.130, 3.0),
        (1.060, 0.530, 0.210, 0.200, 0.185, 3.0),
        (1.350, 0.600, 0.170, 0.170, 0.205, 2.8),
        (1.650, 0.660, 0.115, 0.110, 0.190, 2.8),
        (1.810, 0.690, 0.070, 0.060, 0.150, 2.8),
        (1.840, 0.695, 0.045, 0.040, 0.120, 2.8),
    )
    yield "paint", loft(body, rings=n[0], sides=n[1])
    seat = (
        (1.010, 0.720, 0.030, 0.050, 0.085, 2.8),
        (1.080, 0.735, 0.040, 0.050, 0.125, 2.8),
        (1.300, 0.745, 0.040, 0.050, 0.160, 2.8),
        (1.460, 0.765, 0.045, 0.050, 0.155, 2.8),
        (1.700, 0.790, 0.030, 0.050, 0.130, 2.6),
        (1.770, 0.785, 0.015, 0.040, 0.090, 2.4),
    )
    yield "trim", loft(seat, rings=n[0], sides=n[1] - 2)
    if not fine.small:
        yield "trim", tube([(-0.69, -0.30, 1.04), (-0.69, 0.30, 1.04)], radius=0.02, sides=3)
        yield "trim", box((-0.56, -0.05, 0.25), (-0.26, 0.05, 0.45))
        return
    yield from _moped_front(fine)
    yield from _moped_trim()
    yield from _moped_rear(fine)


def _shield(n: tuple[int, int]) -> Mesh:
    """The leg shield: from the apron's point at the front to the floor."""
    sections = (
        (0.408, 0.640, 0.060, 0.120, 0.060, 2.6),
        (0.450, 0.680, 0.200, 0.260, 0.165, 2.8),
        (0.520, 0.650, 0.300, 0.340, 0.205, 3.2),
        (0.575, 0.640, 0.310, 0.350, 0.200, 3.4),
        (0.600, 0.640, 0.290, 0.330, 0.170, 3.4),
    )
    return loft(sections, rings=n[0], sides=n[1])


def _moped_front(fine: Fineness) -> Iterator[Piece]:
    """Fork, mudguard, lamps, cowled bar."""
    for s in (1.0, -1.0):
        leg = [(_FRONT[0], 0.082 * s, _R), (-0.400, 0.082 * s, 0.58)]
        yield "trim", tube(leg, radius=0.022, sides=8)
        yield from _moped_bar(s, fine)
        amber = loft(
            ((0.425, 0.690, 0.020, 0.020, 0.020, 2.4), (0.465, 0.690, 0.032, 0.032, 0.036, 2.4)),
            rings=3,
            sides=8,
        )
        yield "lamp_amber", moved(amber, 0.0, 0.125 * s, 0.0)
    yield "paint", band(arc(_FRONT, _R + 0.024, 34.0, 168.0, 12), half=0.080, thick=0.006)
    lens = (
        (0.392, 0.765, 0.030, 0.030, 0.060, 2.4),
        (0.402, 0.770, 0.062, 0.055, 0.100, 2.6),
        (0.470, 0.780, 0.075, 0.065, 0.125, 2.8),
    )
    yield "lamp_clear", loft(lens, rings=5, sides=14)
    for y in (-0.05, 0.05):
        bulb = (
            (0.383, 0.768, 0.012, 0.012, 0.014, 2.2),
            (0.390, 0.769, 0.034, 0.030, 0.036, 2.4),
            (0.420, 0.770, 0.036, 0.032, 0.038, 2.4),
        )
        yield "lamp_bowl", moved(loft(bulb, rings=3, sides=10), 0.0, y, 0.0)
    yield (
        "lamp_white",
        loft(
            ((0.386, 0.768, 0.006, 0.006, 0.075, 4.0), (0.415, 0.768, 0.008, 0.008, 0.080, 4.0)),
            rings=2,
            sides=8,
        ),
    )
    cowl = (
        (0.600, 1.000, 0.020, 0.040, 0.080, 2.4),
        (0.625, 1.005, 0.050, 0.065, 0.125, 2.6),
        (0.720, 1.010, 0.055, 0.060, 0.130, 2.6),
        (0.750, 1.005, 0.030, 0.040, 0.090, 2.4),
    )
    yield "paint", loft(cowl, rings=7, sides=12)
    yield "trim", tube([(-0.600, 0.0, 0.85), (-0.665, 0.0, 1.0)], radius=0.045, sides=8)
    screen = (
        (0.560, 1.060, 0.0, 0.085, 0.100, 2.2),
        (0.600, 1.100, 0.040, 0.120, 0.140, 2.2),
    )
    yield "glass", loft(screen, rings=3, sides=10)


def _moped_trim() -> Iterator[Piece]:
    """Gaps between panels, grille and edge strips."""
    for s in (1.0, -1.0):
        seam = [(-1.075, 0.186 * s, 0.40), (-1.25, 0.206 * s, 0.485), (-1.55, 0.203 * s, 0.60)]
        yield "gap", tube(seam, radius=0.004, sides=4)
        edge = [(-0.575, 0.196 * s, 0.36), (-0.585, 0.203 * s, 0.64), (-0.580, 0.150 * s, 0.905)]
        yield "chrome", tube(edge, radius=0.007, sides=5)
        kick = box((-1.00, -0.012, 0.262), (-0.58, 0.012, 0.284))
        yield "rim", moved(kick, 0.0, 0.186 * s, 0.0)
    for z in (0.545, 0.570, 0.595):
        yield "gap", box((-0.430, -0.075, z), (-0.405, 0.075, z + 0.010))


def _moped_bar(s: float, fine: Fineness) -> Iterator[Piece]:
    """One half of the bar."""
    yield "trim", tube([(-0.69, 0.08 * s, 1.025), (-0.715, 0.34 * s, 1.040)], radius=0.014, sides=6)
    yield (
        "rubber",
        tube([(-0.703, 0.225 * s, 1.034), (-0.717, 0.345 * s, 1.040)], radius=0.018, sides=8),
    )
    lever = [(-0.665, 0.20 * s, 1.030), (-0.640, 0.26 * s, 1.028), (-0.675, 0.35 * s, 1.022)]
    yield "rim", tube(lever, radius=0.007, sides=5)
    if s > 0:
        yield from mirrors((-0.650, 0.325, 1.235), (-0.680, 0.215, 1.040), fine)


def _moped_rear(fine: Fineness) -> Iterator[Piece]:
    """Engine, exhaust, mudguard, lamps, rack with a case, plate."""
    case = (
        (1.230, 0.260, 0.060, 0.060, 0.050, 3.0),
        (1.300, 0.260, 0.085, 0.075, 0.060, 3.0),
        (1.600, 0.255, 0.075, 0.070, 0.055, 3.0),
        (1.680, 0.255, 0.040, 0.045, 0.035, 3.0),
    )
    yield "engine", moved(loft(case, rings=7, sides=10), 0.0, 0.115, 0.0)
    path = np.array(
        [(-1.28, -0.11, 0.22), (-1.36, -0.13, 0.24), (-1.72, -0.15, 0.29), (-1.76, -0.15, 0.30)]
    )
    vertices, faces = closed(
        rope(path, np.array([0.03, 0.052, 0.052, 0.03]), 12), bottom=True, top=True
    )
    yield "trim", shaded(vertices, faces, crease=0.6)
    yield "trim", band(arc(_REAR, _R + 0.035, 60.0, 190.0, 10), half=0.075, thick=0.005)
    yield "trim", box((-1.45, -0.15, 0.24), (-1.02, 0.15, 0.36))
    lens = (
        (1.800, 0.700, 0.040, 0.034, 0.100, 3.0),
        (1.842, 0.700, 0.032, 0.028, 0.090, 3.0),
    )
    yield "lamp_red", loft(lens, rings=3, sides=12)
    for s in (1.0, -1.0):
        amber = (
            (1.780, 0.690, 0.034, 0.034, 0.030, 2.6),
            (1.835, 0.690, 0.026, 0.026, 0.022, 2.6),
        )
        yield "lamp_amber", moved(loft(amber, rings=3, sides=8), 0.0, 0.135 * s, 0.0)
        rack = [(-1.60, 0.12 * s, 0.80), (-1.72, 0.11 * s, 0.845), (-1.86, 0.09 * s, 0.85)]
        yield "rim", tube(rack, radius=0.010, sides=6)
    yield from plate((-1.872, 0.0, 0.535), half=(0.065, 0.055))
    yield "trim", box((-1.868, -0.05, 0.47), (-1.80, 0.05, 0.62))
