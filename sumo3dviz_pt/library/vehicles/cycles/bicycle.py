"""Bicycles, in metres behind the front of the front wheel.

Frame angles and lengths after usual city bicycles: wheels of 28 inches, seat tube at 73
degrees, head tube at 71, chain stays of 0.43 m, cranks of 0.17 m.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.mesh.solids import box, lathe, moved, tube
from sumo3dviz_pt.library.vehicles.cycles.parts import (
    CycleWheel,
    Fineness,
    Point,
    arc,
    band,
    lamp,
    loft,
    round_lamp,
    tubes,
)
from sumo3dviz_pt.library.vehicles.cycles.rider import Grasp, Machine
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh

_R = 0.342
_FRONT: Point = (-_R, 0.0, _R)
_REAR: Point = (-1.372, 0.0, _R)
_CRANK: Point = (-0.948, 0.0, 0.285)
_SEAT_TOP: Point = (-1.104, 0.0, 0.795)
_SADDLE: Point = (-1.150, 0.0, 0.930)
_CROWN: Point = (-0.508, 0.0, 0.705)
_HEAD: Point = (-0.565, 0.0, 0.875)
_STEM: Point = (-0.592, 0.0, 0.985)
_ARM = 0.170
_PEDAL_Y = 0.155
_SOLE = 0.014
"""From a pedal's middle up to the sole on it [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BicycleRecipe(RecipeValue):
    """A bicycle.

    Attributes:
        frame: Material of its frame.
        sporty: Whether its rider leans forward, and it has neither mudguards nor rack.
        step_through: Whether its frame is low.
        basket: Whether there is one before the handlebar.
        turn: Angle of the right crank, forward from the top [rad].
        rider: A recipe of `library/people`.
    """

    model: Literal["bicycle"] = "bicycle"
    frame: str = "enamel_black"
    sporty: bool = False
    step_through: bool = False
    basket: bool = False
    turn: float = 0.6
    rider: dict[str, Any] = field(default_factory=dict)

    @property
    def grip(self) -> Point:
        """Middle of the left grip [m]."""
        return (-0.645, 0.275, 0.985) if self.sporty else (-0.700, 0.290, 1.075)


def bicycle(recipe: BicycleRecipe) -> Machine:
    """Make the two-wheeler of a recipe."""
    sporty, turn = recipe.sporty, recipe.turn
    lean = 0.62 if sporty else 0.24
    right, left = _pedal(turn), _pedal(turn + np.pi)
    feet = (
        (left[0], _PEDAL_Y, left[2] + _SOLE),
        (right[0], -_PEDAL_Y, right[2] + _SOLE),
    )
    # The heel is low when the pedal is in front, high when it is behind and below.
    pitch = tuple(float(-0.16 - 0.16 * np.sin(turn + shift - 0.6)) for shift in (np.pi, 0.0))
    hips = (_SADDLE[0] + (0.06 if sporty else 0.0), 0.0, _SADDLE[2] + 0.105)
    grasp = Grasp(hips, lean, recipe.grip, feet, -0.30, (pitch[0], pitch[1]), roll=0.25)
    x, _, z = _tail(recipe)
    lamps = (
        lamp("head", (-0.425, 0.0, 0.800), (0.05, 0.05)),
        lamp("tail", (x - 0.003, 0.0, z), (0.05 if sporty else 0.08, 0.04), back=True),
    )
    return Machine(
        wheel=CycleWheel(_R, 0.016 if sporty else 0.021),
        axles=(_FRONT[0], _REAR[0]),
        frame=lambda fine: _bicycle(recipe, fine),
        grasp=grasp,
        lamps=lamps,
        rider=recipe.rider,
    )


def _pedal(turn: float) -> Point:
    """Middle of a pedal whose crank is turned forward from the top [rad]."""
    return (_CRANK[0] + _ARM * np.sin(turn), 0.0, _CRANK[2] + _ARM * np.cos(turn))


def _bicycle(recipe: BicycleRecipe, fine: Fineness) -> Iterator[MaterialMesh]:
    """Everything but wheels and rider."""
    yield from still_parts(recipe, fine)
    if fine.small:
        yield from drive(recipe.turn, fine)


def still_parts(recipe: BicycleRecipe, fine: Fineness) -> Iterator[MaterialMesh]:
    """Build what does not move while the rider pedals: all but drive, wheels and rider."""
    yield from _frame(recipe, fine)
    yield from _saddle(fine)
    yield from _bar(recipe, fine)
    if not fine.small:
        return
    yield from _lamps(recipe)
    if not recipe.sporty:
        yield from _town(recipe, fine)


def _frame(recipe: BicycleRecipe, fine: Fineness) -> Iterator[MaterialMesh]:
    """Main triangle, stays and fork."""
    colour = recipe.frame
    low: Point = (_CROWN[0] - 0.016, 0.0, _CROWN[2] + 0.045)
    top: Point = (_HEAD[0] + 0.014, 0.0, _HEAD[2] - 0.045)
    runs: list[tuple[Sequence[Point], float]] = [
        ((_CRANK, _SEAT_TOP), 0.0155),
        ((_CRANK, low), 0.018),
        ((_CROWN, _HEAD), 0.020),
    ]
    if recipe.step_through:
        middle: Point = (-0.80, 0.0, 0.430)
        runs.append(((top, (-0.66, 0.0, 0.62), middle, (-1.0, 0.0, 0.455)), 0.016))
    else:
        runs.append((((_SEAT_TOP[0] + 0.01, 0.0, _SEAT_TOP[2] - 0.03), top), 0.015))
    yield from tubes(runs, colour, fine)
    post = ((_SEAT_TOP[0] + 0.01, 0.0, _SEAT_TOP[2] - 0.03), (_SADDLE[0], 0.0, _SADDLE[2] - 0.05))
    yield from tubes([(post, 0.0135)], "rim", fine)
    sides = (1.0, -1.0) if fine.small else (0.0,)
    for s in sides:
        drop = (_REAR[0], 0.062 * s, _REAR[2])
        stays = [
            (((_CRANK[0], 0.028 * s, _CRANK[2]), (-1.10, 0.045 * s, 0.305), drop), 0.010),
            (((_SEAT_TOP[0], 0.018 * s, _SEAT_TOP[2] - 0.04), drop), 0.0085),
        ]
        bend = (_CROWN[0] + 0.095, 0.048 * s, 0.46)
        fork = (
            (_CROWN[0], 0.030 * s, _CROWN[2]),
            (_CROWN[0] + 0.01, 0.046 * s, _CROWN[2] - 0.03),
            bend,
            (_FRONT[0], 0.052 * s, _FRONT[2]),
        )
        yield from tubes([*stays, (fork, 0.0125)], colour, fine)
    if fine.small:
        crown = [(_CROWN[0], -0.036, _CROWN[2]), (_CROWN[0], 0.036, _CROWN[2])]
        yield colour, tube(crown, radius=0.016, sides=fine.sides)
        for x, y in ((_FRONT, 0.058), (_REAR, 0.070)):
            ends = [(x[0], -y, x[2]), (x[0], y, x[2])]
            yield "rim", tube(ends, radius=0.008, sides=fine.sides)


def _saddle(fine: Fineness) -> Iterator[MaterialMesh]:
    """A saddle with a narrow nose."""
    d = -_SADDLE[0]
    sections = (
        (d - 0.145, _SADDLE[2] - 0.012, 0.010, 0.012, 0.012, 2.2),
        (d - 0.13, _SADDLE[2] - 0.010, 0.014, 0.022, 0.022, 2.2),
        (d - 0.04, _SADDLE[2] - 0.012, 0.014, 0.026, 0.034, 2.3),
        (d + 0.05, _SADDLE[2] - 0.010, 0.016, 0.034, 0.074, 2.6),
        (d + 0.11, _SADDLE[2] - 0.004, 0.016, 0.034, 0.080, 2.6),
        (d + 0.125, _SADDLE[2] - 0.004, 0.008, 0.020, 0.058, 2.4),
    )
    counts = (9, 10) if fine.small else (3, 4)
    yield "trim", loft(sections, rings=counts[0], sides=counts[1])


def _bar(recipe: BicycleRecipe, fine: Fineness) -> Iterator[MaterialMesh]:
    """Stem, handlebar, grips, bell and brake levers."""
    x, _, z = _STEM
    grip = recipe.grip
    ahead: Point = (x + 0.055, 0.0, max(z + 0.01, grip[2] - 0.025))
    yield from tubes([((_HEAD, (x, 0.0, ahead[2] - 0.01), ahead), 0.0125)], "rim", fine)
    for s in (1.0, -1.0):
        bend = (x + 0.045, 0.18 * s, grip[2] + 0.004)
        inner = (grip[0] + 0.055, (grip[1] - 0.035) * s, grip[2] + 0.003)
        outer = (grip[0] - 0.050, (grip[1] + 0.030) * s, grip[2] - 0.004)
        # The bar ends within its grip: two ends in one place would flicker.
        end = (outer[0] + 0.01, outer[1] - 0.006 * s, outer[2] + 0.0007) if fine.small else outer
        yield "rim", tube([ahead, bend, inner, end], radius=0.0112, sides=fine.sides)
        if fine.small:
            yield "rubber", tube([inner, outer], radius=0.0165, sides=fine.sides + 1)
            lever = [
                (inner[0] + 0.02, inner[1] - 0.01 * s, inner[2] - 0.012),
                (inner[0] + 0.055, inner[1] + 0.01 * s, inner[2] - 0.022),
                (outer[0] + 0.06, outer[1], outer[2] - 0.026),
            ]
            yield "trim", tube(lever, radius=0.006, sides=4)


def drive(turn: float, fine: Fineness) -> Iterator[MaterialMesh]:
    """Build chain ring, cranks, pedals, sprocket and chain, on the right."""
    y = -0.048
    x, _, z = _CRANK
    ring = [(0.060, 0.002), (0.060, -0.002), (0.092, -0.002), (0.092, 0.002), (0.060, 0.002)]
    yield "chrome", moved(lathe(ring, segments=fine.segments, crease=0.5), x, y, z)
    sprocket = [(0.0, -0.004), (0.040, -0.004), (0.040, 0.004), (0.0, 0.004)]
    yield "chrome", moved(lathe(sprocket, segments=14, crease=0.5), _REAR[0], y, _REAR[2])
    for top in (1.0, -1.0):
        ends = [(x, y, z + 0.090 * top), (_REAR[0], y, _REAR[2] + 0.040 * top)]
        yield "trim", tube(ends, radius=0.0048, sides=4)
    axle = [(x, -0.075, z), (x, 0.075, z)]
    yield "rim", tube(axle, radius=0.018, sides=8)
    for s, angle in ((-1.0, turn), (1.0, turn + np.pi)):
        px, _, pz = _pedal(angle)
        crank = [(x, 0.070 * s, z), (px, 0.090 * s, pz)]
        yield "rim", tube(crank, radius=(0.013, 0.010), sides=6)
        pedal = box((px - 0.045, -0.045, pz - 0.012), (px + 0.045, 0.045, pz + 0.012))
        yield "trim", moved(pedal, 0.0, _PEDAL_Y * s, 0.0)
        for d in (-0.047, 0.043):
            light = box((px + d, -0.03, pz - 0.008), (px + d + 0.004, 0.03, pz + 0.008))
            yield "lamp_amber", moved(light, 0.0, _PEDAL_Y * s, 0.0)


def _tail(recipe: BicycleRecipe) -> Point:
    """Where the tail lamp is: on the rack, or below the saddle."""
    return (-1.655, 0.0, 0.640) if not recipe.sporty else (-1.172, 0.0, 0.790)


def _lamps(recipe: BicycleRecipe) -> Iterator[MaterialMesh]:
    """Head lamp, tail lamp and the reflector above it."""
    x, _, z = _tail(recipe)
    yield from round_lamp((-0.445, 0.0, 0.800), 0.030)
    yield "trim", tube([(-0.46, 0.0, 0.79), (-0.52, 0.0, 0.75)], radius=0.007, sides=4)
    half = 0.025 if recipe.sporty else 0.040
    yield "trim", box((x + 0.005, -half - 0.005, z - 0.025), (x + 0.045, half + 0.005, z + 0.050))
    yield "lamp_red", box((x, -half, z - 0.020), (x + 0.005, half, z + 0.020))
    yield "lamp_red", box((x, -half, z + 0.024), (x + 0.005, half, z + 0.046))


def _town(recipe: BicycleRecipe, fine: Fineness) -> Iterator[MaterialMesh]:
    """Mudguards, rack, reflectors, stand and basket."""
    count = 16 if fine.segments > 30 else 10
    yield "trim", band(arc(_REAR, _R + 0.022, 20.0, 190.0, count), half=0.026, thick=0.003)
    yield "trim", band(arc(_FRONT, _R + 0.022, 25.0, 165.0, count), half=0.026, thick=0.003)
    deck = _R * 2 + 0.055
    for s in (1.0, -1.0):
        rail = [
            (-1.16, 0.045 * s, deck - 0.005),
            (-1.25, 0.062 * s, deck),
            (-1.61, 0.062 * s, deck),
        ]
        leg = [(_REAR[0] - 0.01, 0.075 * s, _REAR[2]), (-1.47, 0.066 * s, deck)]
        yield from tubes([(rail, 0.006), (leg, 0.005)], "trim", fine)
    for x in (-1.30, -1.42, -1.54, -1.61):
        yield "trim", tube([(x, -0.062, deck), (x, 0.062, deck)], radius=0.005, sides=4)
    for x in (_FRONT[0], _REAR[0]):
        for a in (0.4, 3.5):
            place = (x + 0.22 * np.cos(a), 0.0, _R + 0.22 * np.sin(a))
            yield "lamp_amber", moved(box((-0.03, -0.006, -0.012), (0.03, 0.006, 0.012)), *place)
    side = (_CRANK[0] - 0.01, -0.068, _CRANK[2] - 0.04), (-1.16, -0.068, 0.055)
    yield "trim", tube(side, radius=0.008, sides=5)
    if recipe.basket:
        yield from _basket()


def _basket() -> Iterator[MaterialMesh]:
    """A wire basket before the handlebar."""
    for z, a, b in (
        (1.04, 0.165, 0.125),
        (0.96, 0.155, 0.115),
        (0.88, 0.145, 0.105),
        (0.82, 0.14, 0.10),
    ):
        ring = [(-0.40 + b * x, a * y, z) for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))]
        yield "trim", tube(ring, radius=0.005 if z < 1.0 else 0.008, sides=4)
    for y in np.linspace(-0.14, 0.14, 6):
        path = [
            (-0.28, 1.15 * y, 1.04),
            (-0.30, y, 0.82),
            (-0.50, y, 0.82),
            (-0.52, 1.15 * y, 1.04),
        ]
        yield "trim", tube(path, radius=0.004, sides=3)
    for x in (-0.50, -0.43, -0.37, -0.30):
        path = [
            (1.1 * x + 0.04, -0.16, 1.04),
            (x, -0.14, 0.82),
            (x, 0.14, 0.82),
            (1.1 * x + 0.04, 0.16, 1.04),
        ]
        yield "trim", tube(path, radius=0.004, sides=3)
