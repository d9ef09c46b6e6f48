"""Shapes that differ from country to country: signs, and what guards a level crossing.

A level crossing has half barriers, flashing lights and St Andrew's crosses. Frame of all but the
arm: origin at the foot of the drive, faces look to -x, that is, towards traffic that drives to +x;
+y is that traffic's left. Frame of the arm: the hinge is the origin and the lowered arm lies along
+x.

References:
    Vienna Convention on Road Signs and Signals, 1968: sign A,28 (St Andrew's cross),
    articles 33 to 36 (flashing lights and barriers of level crossings).
    Colours and stripes of half barriers, red lights in pairs: the same, article 36.
    Crossbuck R15-1: Manual on Uniform Traffic Control Devices, 2009, section 8B.03.
    Limits on panels and yield signs: Manual on Uniform Traffic Control Devices, 2009, R2-1
    and R1-2. Limits in miles per hour and give way signs with words: Traffic Signs Regulations
    and General Directions 2016, diagrams 670 and 602.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, moved, tube
from sumo3dviz_pt.library.street import signs as shapes
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.street.road_styles import CrossDesign, SignStyle
from sumo3dviz_pt.library.street.signs import BLACK, RED, WHITE, SignLayer, plate
from sumo3dviz_pt.library.street.strokes import fan, ring
from sumo3dviz_pt.library.street.traffic_light import foot, housing, lens, pole, rounded
from sumo3dviz_pt.library.street.traffic_light import plate as board
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import Part

HINGE = (0.0, 0.0, 0.98)
"""Where the arm turns, from the foot of the drive [m]."""

LAMPS = ("right", "left")
"""The two lights that flash in turn, as drivers see them."""

_STRIPE = 0.5
_MAST = (-0.75, 0.0)  # from the drive to the mast with lights and cross [m]
_BOARD, _CROSS = 2.15, 2.95  # heights of the lights' lower edge and of the cross's middle [m]
_APART = 0.3  # from the mast to each of the two lights [m]
_ARM, _TIP = (0.055, 0.075), (0.035, 0.045)  # half width and half height at either end [m]


@cache
def arm(length: float) -> tuple[Part, ...]:
    """Build a red and white arm of a length [m], with its counterweight behind the hinge."""
    count = max(2, round(length / _STRIPE))
    ends = np.linspace(0.0, length, count + 1)
    share = ends / length
    wide, tall = ((1.0 - share) * _ARM[k] + share * _TIP[k] for k in range(2))
    pieces: dict[str, list[Mesh]] = {"barrier_red": [], "barrier_white": []}
    for k in range(count):
        # The tip is red, so that it is seen before a light background.
        colour = "barrier_red" if (count - 1 - k) % 2 == 0 else "barrier_white"
        low = (float(ends[k]), -float(wide[k]), -float(tall[k]))
        high = (float(ends[k + 1]), float(wide[k]), float(tall[k]))
        pieces[colour].append(box(low, high))
    weight = box((-0.85, -0.1, -0.16), (-0.35, 0.1, 0.16))
    yoke = [box((-0.6, y - 0.02, -0.05), (0.35, y + 0.02, 0.05)) for y in (-0.13, 0.13)]
    parts = [Part(merge_meshes(meshes), name) for name, meshes in pieces.items()]
    return (*parts, Part(merge_meshes([weight, *yoke]), "galvanised"))


@cache
def drive() -> Part:
    """Build the box with the motor that the arm turns in."""
    case = box((-0.2, -0.16, 0.06), (0.2, 0.16, 1.12))
    lid = box((-0.23, -0.19, 1.12), (0.23, 0.19, 1.16))
    base = box((-0.28, -0.24, -0.4), (0.28, 0.24, 0.06))
    return Part(merge_meshes([case, lid, base]), "galvanised")


@cache
def warning_mast(design: CrossDesign, *, level: int = 0) -> tuple[Part, ...]:
    """Build the mast before the drive: St Andrew's cross above two lights on a board.

    Args:
        design: How the cross is painted.
        level: 0 near, 1 farther away.
    """
    x, y = _MAST
    mast = moved(pole(_CROSS + 0.35, level=level), x, y, 0.0)
    back = board(1.05, 0.46, front=-0.03, back=0.0, z=_BOARD + 0.15)
    cases = [moved(housing(1, backing=False, level=level), 0.0, s * _APART, 0.0) for s in (-1, 1)]
    lights = moved(merge_meshes(cases), x - 0.09, y, _BOARD)
    dark = merge_meshes([moved(back, x - 0.06, y, 0.0), lights])
    cross = [
        Part(moved(part.mesh, x - 0.05, y, _CROSS), part.material, part.tint)
        for part in st_andrews_cross(design)
    ]
    return (Part(mast, "signal_pole"), Part(dark, "signal_housing"), *cross)


def light(side: str) -> Mesh:
    """Return the lens of one of the two flashing lights, `right` or `left` for drivers."""
    aside = -_APART if side == "right" else _APART
    return moved(lens(0), _MAST[0] - 0.09, _MAST[1] + aside, _BOARD)


@cache
def st_andrews_cross(design: CrossDesign) -> tuple[Part, ...]:
    """Build two crossed boards around the origin, looking to -x."""
    long, wide = 1.2, 0.2
    parts: list[Part] = []
    for k, turn in enumerate((-np.pi / 4, np.pi / 4)):
        outline = _turned(_rectangle(long, wide), turn)
        layers: list[SignLayer] = [(fan(outline), WHITE)]
        if design == "red_border":
            inner = _turned(_rectangle(long - 0.07, wide - 0.07), turn)
            layers.append((ring(outline, inner), RED))
        elif design == "red_ends":
            for side in (-1.0, 1.0):
                end = _rectangle(0.3, wide) + np.array([side * (long / 2 - 0.15), 0.0])
                layers.append((fan(_turned(end, turn)), RED))
        else:
            word = lettering(("CROSSING", "RAIL   ROAD")[k], height=0.11)
            layers.append((_turned(word, turn), BLACK))
        # The second board lies before the first.
        made = plate(outline, layers, z=0.0)
        parts += [Part(moved(part.mesh, -0.016 * k, 0.0, 0.0), part.material, part.tint)
                  for part in made]  # fmt: skip
    return tuple(parts)


def rail_mast(height: float, *, level: int = 0) -> tuple[Part, ...]:
    """Build the mast of a rail signal with its red and white plate.

    Args:
        height: Above the ground [m].
        level: 0 near, 1 farther away.
    """
    if level:
        return (Part(tube([(0, 0, -0.5), (0, 0, height)], radius=0.07, sides=6), "signal_pole"),)
    upright = merge_meshes([pole(height, radius=0.075), foot(0.075)])
    stripes: dict[str, list[Mesh]] = {"barrier_red": [], "barrier_white": []}
    for k, colour in enumerate(("barrier_red", "barrier_white", "barrier_red")):
        stripes[colour].append(box((-0.105, -0.09, 1.5 + 0.32 * k), (-0.09, 0.09, 1.82 + 0.32 * k)))
    rungs = [
        tube([(0.1, -0.18, z), (0.1, 0.18, z)], radius=0.012, sides=5)
        for z in np.arange(0.6, height - 0.4, 0.3).tolist()
    ]
    rails = [
        tube([(0.1, y, 0.3), (0.1, y, height - 0.3)], radius=0.016, sides=5) for y in (-0.18, 0.18)
    ]
    parts = [Part(merge_meshes(meshes), name) for name, meshes in stripes.items()]
    ladder = Part(merge_meshes([*rungs, *rails]), "galvanised")
    return (Part(upright, "signal_pole"), ladder, *parts)


def _rectangle(wide: float, tall: float) -> Floats:
    """Outline a rectangle around the origin, counter-clockwise, (4, 2) [m]."""
    return 0.5 * np.array([(-wide, -tall), (wide, -tall), (wide, tall), (-wide, tall)])


def _turned(points: Floats, angle: float) -> Floats:
    """Turn points of a plane, (..., 2), counter-clockwise [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack(
        [cos * points[..., 0] - sin * points[..., 1], sin * points[..., 0] + cos * points[..., 1]],
        axis=-1,
    )


_MILE = 1609.344  # [m]
_PANEL = (0.61, 0.76)  # width and height of a panel with a limit [m]


def shown_limit(speed: float, style: SignStyle) -> int:
    """Return the number on a sign for a speed limit [m/s], in the style's unit.

    Kilometres per hour are rounded to tens, miles per hour to fives.
    """
    if style.unit == "mph":
        return 5 * round(speed * 3600.0 / _MILE / 5)
    return 10 * round(speed * 3.6 / 10)


def speed_limit(number: int, style: SignStyle) -> tuple[Part, ...]:
    """Build the sign of a speed limit."""
    return _panel(number) if style.limit == "panel" else shapes.speed_limit(number)


def give_way(style: SignStyle) -> tuple[Part, ...]:
    """Build the sign that tells drivers to give way."""
    return _lettered(style.give_way) if style.give_way else shapes.give_way()


@cache
def _panel(number: int) -> tuple[Part, ...]:
    """A white panel with two words above a number."""
    wide, tall = _PANEL
    outer = rounded(wide, tall, radius=0.04)
    rims = [rounded(wide - k, tall - k, radius=0.035) for k in (0.03, 0.055)]
    words = [
        lettering(word, height=0.095, weight=0.15) + np.array([0.0, up])
        for word, up in (("SPEED", 0.27), ("LIMIT", 0.12))
    ]
    digits = lettering(str(number), height=0.27, weight=0.15) - np.array([0.0, 0.165])
    black = np.concatenate([ring(*rims), *words, digits])
    return tuple(plate(outer, [(fan(outer), WHITE), (black, BLACK)], z=0.0))


@cache
def _lettered(text: str) -> tuple[Part, ...]:
    """A give way sign with words, one line for each."""
    lines = text.split()
    height = 0.1 if len(lines) == 1 else 0.085
    words = [
        lettering(word, height=height, weight=0.15)
        + np.array([0.0, 0.13 - 1.5 * height * place - 0.5 * height])
        for place, word in enumerate(lines)
    ]
    colour = RED if len(lines) == 1 else BLACK
    outline, face = shapes.triangle_face()
    return tuple(plate(outline, [*face, (np.concatenate(words), colour)], z=-0.08))
