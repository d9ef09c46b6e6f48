"""Where people sit in a body: the driver's eye and the foot of the windscreen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats

CAR_EYE_HEIGHT = 1.2
"""Of a car driver, above the ground [m]; higher where the windscreen's foot is."""

_ABOVE_COWL = 0.25
"""A driver looks over the windscreen's foot by at least this [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Seat:
    """Places in the frame of a drawn body (+x forward, origin below the front).

    Attributes:
        eye: The eye on the left front seat, y >= 0, (3,) [m].
        cowl: Where bonnet and windscreen meet, on the axis, (3,) [m].
    """

    eye: Floats
    cowl: Floats


@dataclass(frozen=True, slots=True)
class _Rule:
    """A seat by class: metres, or shares of the body's size where marked.

    Attributes:
        back: Eye behind the front [m]; None is 0.45 of the length.
        aside: Eye left of the axis, share of the width.
        up: Eye above the ground [m]; None is 0.93 of the height.
        bonnet: Windscreen's foot behind the front [m].
        dash: Its height [m].
    """

    back: float | None
    aside: float
    up: float | None
    bonnet: float
    dash: float


_TRUCK = _Rule(1.2, 0.28, 2.3, 0.0, 1.35)
_BUS = _Rule(1.3, 0.30, 2.3, 0.0, 1.15)
_VAN = _Rule(1.9, 0.22, 1.75, 0.95, 1.25)
_TRAIN = _Rule(1.6, 0.0, 2.3, 0.0, 1.3)
_CYCLE = _Rule(None, 0.0, 1.5, 0.0, 1.0)
_SHIP = _Rule(None, 0.0, None, 0.0, 1.0)

_RULES: Mapping[str, _Rule] = {
    "truck": _TRUCK,
    "trailer": _TRUCK,
    "container": _TRUCK,
    "bus": _BUS,
    "coach": _BUS,
    "delivery": _VAN,
    "emergency": _VAN,
    **dict.fromkeys(
        ("tram", "rail", "rail_urban", "rail_electric", "rail_fast", "subway", "cable_car"), _TRAIN
    ),
    **dict.fromkeys(("motorcycle", "moped", "bicycle", "scooter", "wheelchair"), _CYCLE),
    "pedestrian": _Rule(0.1, 0.0, None, 0.0, 1.0),
    "ship": _SHIP,
    "aircraft": _SHIP,
}

PLAIN_CLASSES = frozenset(_RULES)
"""Classes with a seat of their own kind."""


def class_seat(vclass: str, size: Floats) -> Seat:
    """Return the seat in a plain body.

    Args:
        vclass: What is drawn.
        size: Length, width, height, (3,) [m].
    """
    length, width, height = (float(side) for side in size)
    rule = _RULES.get(vclass)
    if rule is None:
        cowl = np.array([-0.24 * length, 0.0, 0.64 * height])
        return car_seat(np.array([-0.45 * length, 0.2 * width, 0.0]), cowl=cowl)
    back = 0.45 * length if rule.back is None else min(rule.back, 0.5 * length)
    up = 0.93 * height if rule.up is None else rule.up
    if width > 1.2:
        up = min(up, 0.97 * height)
    cowl = np.array([-min(rule.bonnet, 0.3 * length), 0.0, min(rule.dash, 0.7 * height)])
    return Seat(np.array([-back, rule.aside * width, up]), cowl)


def car_seat(eye: Floats, *, cowl: Floats) -> Seat:
    """Return the seat in a car whose eye point and windscreen's foot are known, (3,) each [m].

    The eye is 1.2 m above the ground, or higher where it could not look over the bonnet.
    """
    height = max(CAR_EYE_HEIGHT, float(cowl[2]) + _ABOVE_COWL)
    return Seat(np.array([eye[0], abs(eye[1]), height]), cowl)
