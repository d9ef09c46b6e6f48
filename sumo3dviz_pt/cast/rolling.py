"""Wheels that roll: turned by the way of their own hubs, steered along the path of their axle.

Every wheel of a body in full detail is turned by the way that its hub makes along the
direction in which it rolls, so that outer wheels turn faster in a bend and none slips.
Steered wheels point where their axle goes relative to the body; as that is found from the
path around the place, and not from the speed, a car that waits in a turn keeps its wheels
turned. The chord's rear end slides a little sideways in bends, as SUMO's does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.vehicles.parts import WheelPlace
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.vectors import arc_length

_STEP = 0.05
"""Between the places of a hub that are added up [s]: at 3 m/s^2 the way is 1 mm off."""

_AROUND = 0.5
"""Path before and behind the axle that tells where it goes [m]."""

_MOST_STEERING = float(np.radians(40.0))
"""What the wheels of cars and lorries allow [rad]."""

_CHUNK = 2000

FramesAt = Callable[[Floats], Floats]
"""Placements of all units at times, (n,) [s]: (n, u, 4, 4), unscaled."""


@dataclass(frozen=True, slots=True, eq=False)
class Hub:
    """A wheel as drawn.

    Attributes:
        unit: The unit that it belongs to.
        at: Its centre in that unit's frame, scaled, (3,) [m].
        radius: As drawn [m].
        steered: Whether it steers.
    """

    unit: int
    at: Floats
    radius: float
    steered: bool

    @classmethod
    def of(cls, unit: int, place: WheelPlace, scale: Floats) -> Hub:
        """Return a wheel as drawn: round, and as high as the body is scaled upwards.

        Args:
            unit: The unit that it belongs to.
            place: Where it is on that unit.
            scale: Of the body, (3,).
        """
        radius = place.radius * float(scale[2])
        return cls(unit, scale * np.array(place.at), radius, place.steered)


@dataclass(frozen=True, slots=True, eq=False)
class Rolling:
    """The wheels of a road user over a stretch of motion.

    Attributes:
        times: Increasing, (n,) [s].
        turned: Of each wheel since the first time, (n, w) [rad].
        steered: Which wheels steer, (w,).
        ways: That the steered axle has made, never falling, (n,) [m].
        axle: Its middle, (n, 2) [m].
        headings: Of its unit, unwrapped, (n,) [rad].
    """

    times: Floats
    turned: Floats
    steered: Bools
    ways: Floats
    axle: Floats
    headings: Floats

    @classmethod
    def of(cls, begin: float, end: float, hubs: Sequence[Hub], frames: FramesAt) -> Rolling:
        """Follow all wheels over a stretch of motion.

        Args:
            begin: [s].
            end: [s].
            hubs: The wheels.
            frames: Placements of the units they belong to.
        """
        # Sample the units, a chunk at a time.
        count = max(2, int(np.ceil((end - begin) / _STEP)) + 1)
        times = np.linspace(begin, end, count)
        parts = [frames(times[k : k + _CHUNK]) for k in range(0, count, _CHUNK)]
        units = np.concatenate(parts)
        # Add up the ways of wheels and of the axle that steers.
        places = np.stack([_places(units, hub) for hub in hubs], axis=1)
        ways = _ways(places, units, hubs)
        steered = np.array([hub.steered for hub in hubs], dtype=np.bool_)
        leading = next((hub.unit for hub in hubs if hub.steered), 0)
        axle = places[:, steered if steered.any() else slice(None), :2].mean(axis=1)
        ahead = units[:, leading, :2, 0]
        return cls(
            times,
            ways / [hub.radius for hub in hubs],
            steered,
            arc_length(axle),
            axle,
            np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0])),
        )

    def at(self, time: float) -> Floats:
        """Return how far the wheels have turned and are steered to the left, (w, 2) [rad]."""
        turned = [np.interp(time, self.times, column) for column in self.turned.T]
        angle = self.steering(time) if self.steered.any() else 0.0
        return np.column_stack([np.mod(turned, 2.0 * np.pi), np.where(self.steered, angle, 0.0)])

    def steering(self, time: float) -> float:
        """Return where the axle goes relative to its unit, to the left [rad]."""
        way = float(np.interp(time, self.times, self.ways))
        behind, ahead = (self._axle_at(way + side * _AROUND) for side in (-1.0, 1.0))
        across = ahead - behind
        length = float(np.hypot(*across))
        heading = float(np.interp(time, self.times, self.headings))
        # Backwards is the same direction of a wheel; where it turns back there is none.
        off = (np.arctan2(across[1], across[0]) - heading + np.pi / 2) % np.pi - np.pi / 2
        trusted = float(np.clip(length / _AROUND, 0.0, 1.0))
        return float(np.clip(off, -_MOST_STEERING, _MOST_STEERING)) * trusted**2

    def _axle_at(self, way: float) -> Floats:
        """The axle's middle after a way [m], (2,)."""
        return np.array([np.interp(way, self.ways, column) for column in self.axle.T])


def _places(units: Floats, hub: Hub) -> Floats:
    """A wheel's centre over time, (n, 3) [m]."""
    frame = units[:, hub.unit]
    return np.asarray(frame[:, :3, :3] @ hub.at + frame[:, :3, 3])


def _ways(places: Floats, units: Floats, hubs: Sequence[Hub]) -> Floats:
    """Way of each hub in the direction in which its wheel rolls, (n, w) [m]."""
    moves = np.diff(places, axis=0)
    ahead = units[..., :3, 0][:, [hub.unit for hub in hubs]]
    along = np.einsum("nwc,nwc->nw", moves, (ahead[1:] + ahead[:-1]) / 2.0)
    free = np.sign(along) * np.linalg.norm(moves, axis=2)
    rolled = np.where([hub.steered for hub in hubs], free, along)
    return np.concatenate([np.zeros((1, len(hubs))), np.cumsum(rolled, axis=0)])
