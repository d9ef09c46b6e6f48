"""Spray that tyres throw up from wet roads: puffs along the ways of wheels.

Puffs are born at fixed times of the clock, where wheels are then, and grow, slow down and thin out
with their age. So a plume is a pure function of the vehicle's motion and of time.

References:
    Kamm, W., Wunibald, I. and others measured that spray begins at about 30 to 50 km/h and grows
    with more than the square of speed; Pilkington, G. B., Splash and spray, ASTM STP 1031, 1990,
    doi:10.1520/STP23358S, gives that range. Sizes and depths of our puffs are chosen by eye.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.cast.presence import Present
from sumo3dviz_pt.model.falling import Puffs
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traffic import RAIL_CLASSES

STEP = 0.08
"""Between the births of puffs [s]."""

LIFE = 1.4
"""After which nothing of a puff is left [s]."""

NEAR = 90.0
"""Vehicles whose spray is drawn are at most so far away [m]."""

_SLOWEST, _FULL = 7.0, 25.0  # speeds at which spray begins, and at which it is as dense as said
_DENSE = 0.15  # optical depth of a young puff then
_BORN = 0.12  # time in which a puff comes into being [s]
_DRAG = 0.5  # time in which air stops what a wheel throws after it [s]
_TAKEN = 0.45  # share of the vehicle's speed that spray has at first
_LIGHT = frozenset({"bicycle", "pedestrian", "scooter", "wheelchair", "ship", "aircraft", "drone"})


def spray(
    fleet: Fleet, present: Present, view: View, *, wetness: float, wind: tuple[float, float]
) -> Puffs:
    """Return the spray behind vehicles near a camera.

    Args:
        fleet: Everyone on the road.
        present: Who is there at the frame's time.
        view: The camera.
        wetness: Of roads, [0, 1].
        wind: Towards the east and the north [m/s].
    """
    away = np.linalg.norm(present.positions - view.position, axis=1)
    each = []
    for row in np.flatnonzero((away < NEAR) & (present.speeds > 0.5 * _SLOWEST)).tolist():
        body = fleet.bodies[int(present.users[row])]
        if body.vclass not in RAIL_CLASSES | _LIGHT:
            faded = float(np.clip(4.0 * (1.0 - away[row] / NEAR), 0.0, 1.0))
            each.append(_plume(fleet, present, row, wind=wind, dense=wetness * faded))
    if not each:
        return Puffs()
    at, radii, depths = (np.concatenate(column) for column in zip(*each, strict=True))
    kept = depths > 1e-4
    return Puffs(at[kept], radii[kept], depths[kept])


def _plume(
    fleet: Fleet, present: Present, row: int, *, wind: tuple[float, float], dense: float
) -> tuple[Floats, Floats, Floats]:
    """Return the puffs of a vehicle: places, radii, optical depths."""
    user = int(present.users[row])
    piece = fleet.presence.pieces[int(present.pieces[row])]
    length, width, _ = fleet.bodies[user].size
    born = _births(present.time, piece.begin, share_of(fleet.seed, fleet.keys[user], "spray"))
    motion = piece.sample(born)
    age = present.time - born
    ahead = np.column_stack([np.cos(motion.yaws), np.sin(motion.yaws), np.zeros(len(born))])
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0], np.zeros(len(born))])

    # It flies after the vehicle at first, then with the wind, and sinks.
    flown = _DRAG * -np.expm1(-age / _DRAG)
    blown = (age - flown)[:, None] * np.array([*wind, 0.0]) * 0.6
    thrown = (_TAKEN * motion.speeds * flown)[:, None] * ahead
    speed = np.clip((motion.speeds - _SLOWEST) / (_FULL - _SLOWEST), 0.0, 1.6)
    heavy = float(np.clip(length / 6.0, 0.7, 2.2))
    first = 0.22 + 0.1 * heavy
    radius = first + 0.75 * np.sqrt(age) * (0.6 + 0.4 * heavy)
    height = 0.25 + 0.5 * radius + 0.35 * age
    places, radii, depths = [], [], []
    wheels = [0.92 * length] if length < 7.0 else [0.25 * length, 0.6 * length, 0.92 * length]
    for back in wheels:
        for side in (-0.38 * width, 0.38 * width):
            middle = motion.positions - back * ahead + side * aside + thrown + blown
            middle[:, 2] += height
            young = np.clip(age / _BORN, 0.0, 1.0)
            old = np.clip((LIFE - age) / (0.6 * LIFE), 0.0, 1.0)
            depth = _DENSE * dense * heavy * speed**2 * first / radius * young * old**2
            places.append(middle)
            radii.append(radius)
            depths.append(depth)
    return np.concatenate(places), np.concatenate(radii), np.concatenate(depths)


def _births(time: float, begin: float, share: float) -> Floats:
    """Return when the puffs were born that still live at a time, the oldest first, (n,) [s]."""
    last = np.floor(time / STEP - share)
    numbers = last - np.arange(int(LIFE / STEP), -1, -1)
    born = (numbers + share) * STEP
    return np.asarray(born[(born >= begin) & (born <= time) & (time - born < LIFE)])
