"""The screen in the middle of a dashboard, with a map on it.

The map looks ahead: the road on which the car is runs up from the arrow that stands for it. Nobody
can read names at this size, so there are none; its streets, a river and a park are drawn, not taken
from the network. It has the brightness that a lit screen has by day; by night the way ahead glows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.library.mesh.solids import bevelled, box, moved
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.street.strokes import fan, ribbon
from sumo3dviz_pt.library.vehicles.interior.flats import flat
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import VehicleLamp

_PLACE = (0.69, 0.345, -0.214)
"""The screen's middle: ahead of the eye, towards the car's middle, over the eye [m]."""

_HALF = (0.115, 0.041)
"""Half its width and height [m]."""

_MAP = (0.1105, 0.0365)
"""Half the width and height of what is lit [m]."""

_LAYER = 0.0004
"""From a layer of the map to the next [m]."""

_BAR = -0.072
"""Left of this, from the screen's middle, stands the next turn [m]."""

_MM = 0.001

Line = Sequence[tuple[float, float]]


class _Street(NamedTuple):
    """A line on the map: its material after `screen_`, width, and way, to the right and up [mm]."""

    material: str
    width: float
    line: Line


_AREAS: tuple[tuple[str, Line], ...] = (
    ("screen_park", ((-60, 12), (-34, 6), (-24, 20), (-30, 31), (-60, 33))),
    ("screen_park", ((54, -34), (93, -34), (88, -19), (60, -16))),
    ("screen_water", ((85, 0), (110.5, -6), (110.5, 6), (98, 8))),
)
"""Convex outlines, counter-clockwise [mm]."""

_STREETS = (
    _Street("water", 8, ((30, 36.5), (45, 26), (70, 20), (92, 3))),
    _Street("street", 1.6, ((-72, -23), (-30, -20), (50, -26))),
    _Street("street", 1.6, ((-50, -36.5), (-46, -5), (-52, 36.5))),
    _Street("street", 1.6, ((55, -36.5), (51, 4), (61, 36.5))),
    _Street("street", 1.6, ((-72, 4), (-20, 1), (30, 6))),
    _Street("street", 1.6, ((-20, 26), (20, 27), (35, 20))),
    _Street("street", 1.6, ((52, -9), (85, -12), (110.5, -20))),
    _Street("street", 1.6, ((80, -36.5), (84, -12))),
    _Street("street", 1.6, ((-26, -36.5), (-28, -20), (-20, 1))),
    _Street("road", 3.2, ((-72, 20), (-40, 14.5), (15, 13), (110.5, 24))),
    _Street("road", 3.2, ((-72, -12), (-30, -11), (60, -14), (110.5, -30))),
    _Street("road", 4.2, ((12, -36.5), (12, 2), (8, 20), (-6, 36.5))),
    _Street("route", 3.4, ((12, -21), (12, 2), (9.5, 13.1), (28, 14.2), (110.5, 24))),
)
"""What the map shows, from below; the car is on the road that runs up."""

_ARROW = ((0.0, 0.0062), (-0.0044, -0.005), (0.0, -0.0024), (0.0044, -0.005))
_CAR = (0.012, -0.022)
_TURN = ((-0.097, -0.002), (-0.097, 0.013), (-0.083, 0.013))
_HEAD = ((-0.0835, 0.0085), (-0.077, 0.013), (-0.0835, 0.0175))

_GLOWS = (
    # left, up, width, height: where the map glows by night
    (-0.012, -0.0095, 0.0034, 0.023),  # the way straight on, then the next turn
    (0.097, 0.006, 0.003, 0.018),
    (0.09, 0.013, 0.016, 0.003),
)


def screen(eye: Floats, *, belt: float) -> Iterator[MaterialMesh]:
    """Build a flat screen in the middle of the dashboard, its foot and the map that it shows.

    Args:
        eye: The driver's, (3,) [m].
        belt: Height of the dashboard [m].
    """
    middle, (wide, high) = screen_middle(eye), _HALF
    frame = bevelled((0.0, -wide, -high), (0.011, wide, high), bevel=0.003)
    yield "gloss_black", moved(frame, *middle)
    foot = box((0.011, -0.05, belt - middle[2] - 0.04), (0.03, 0.05, 0.01))
    yield "trim", moved(foot, *middle)
    for number, (material, figure) in enumerate(_figures()):
        yield material, flat(figure.reshape(-1, 2), middle - [_LAYER * (1 + number), 0.0, 0.0])


def screen_lamps(eye: Floats) -> tuple[VehicleLamp, ...]:
    """Return what of the map glows at night."""
    middle, lamps = screen_middle(eye), []
    for left, up, width, height in _GLOWS:
        x, y, z = (float(v) for v in middle + np.array([-0.012, left, up]))
        lamps.append(VehicleLamp("screen", (x, y, z), (width, height), float(np.pi)))
    return tuple(lamps)


def screen_middle(eye: Floats) -> Floats:
    """Return the screen's middle, (3,) [m]."""
    ahead, inwards, up = _PLACE
    side = float(np.sign(eye[1]) or 1.0)
    return np.asarray(eye + np.array([ahead, -side * inwards, up]))


def _figures() -> Iterator[tuple[str, Floats]]:
    """Material and triangles, (n, 3, 2), of every layer, from below."""
    wide, high = _MAP
    yield "screen_land", fan([(_BAR, -high), (wide, -high), (wide, high), (_BAR, high)])
    for material in ("screen_park", "screen_water"):
        yield (
            material,
            np.concatenate(
                [fan(_MM * np.array(line)) for name, line in _AREAS if name == material]
            ),
        )
    for street in _STREETS:
        yield f"screen_{street.material}", ribbon(_MM * np.array(street.line), _MM * street.width)
    yield "screen_street", fan([(x + _CAR[0], y + _CAR[1]) for x, y in _ring(0.0085)])
    yield "screen_route", _dart()
    # Beside the map the next turn and how far it is.
    yield "screen_street", np.concatenate([ribbon(np.array(_TURN), 0.004), fan(_HEAD)])
    yield "screen_street", _text("400 m", 0.0062, (-0.0915, -0.0135))
    yield "screen_text", _text("12 km", 0.0042, (-0.0915, -0.027))


def _ring(radius: float) -> list[tuple[float, float]]:
    """Points of a circle, counter-clockwise."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20, endpoint=False)
    return [(radius * float(np.cos(t)), radius * float(np.sin(t))) for t in turn]


def _dart() -> Floats:
    """The arrow that stands for the car, (2, 3, 2)."""
    points = np.array(_ARROW) + _CAR
    return np.stack([points[[0, 1, 2]], points[[0, 2, 3]]])


def _text(text: str, height: float, middle: tuple[float, float]) -> Floats:
    """Write a line of text about a point, (n, 3, 2)."""
    drawn = lettering(text, height=height, weight=0.15)
    low, high = drawn.min(axis=(0, 1)), drawn.max(axis=(0, 1))
    return np.asarray(drawn - 0.5 * (low + high) + np.array(middle))
