"""What an observer sees of road users: under which angles, how fast they grow, what hides them.

Bodies are boxes of the size that the vehicle type says, upright on the road.

* angular width and height: of the box, from the eye, as azimuths and elevations differ;
* angular rate: change of the width, over the frames before and after; tau: width / rate, the time
  to contact of what comes straight on (Lee 1976);
* bearing: of the box's middle from where the observer looks, clockwise; eccentricity: the angle
  between both in space. Who stands looks across, who rides looks ahead;

References:
    Lee, "A theory of visual control of braking based on information about time-to-collision",
    Perception 5, 1976, doi:10.1068/p050437 (tau).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.pipeline.measured.observer import Arrival, Observer
from sumo3dviz_pt.pipeline.measured.traffic import STANDS, Row, Traffic, known

_LEAST_RATE = 1e-4
"""Angular widths that change less have no tau [rad/s]."""

_CORNERS = np.array([(x, y, z) for x in (-1, 0) for y in (-0.5, 0.5) for z in (0, 1)], dtype=float)
"""Of a body, in its length, width and height; its front is 0."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """One road user as an observer sees it, at some times; NaN where it does not.

    Attributes:
        distance: From the eye to the nearest point of its outline, level [m], (t,).
        bearing: Clockwise from where the observer looks [rad], (t,).
        eccentricity: [rad], (t,).
        width: Angular, [rad], (t,).
        height: Angular, [rad], (t,).
        rate: Of the width [rad/s], (t,).
    """

    distance: Floats
    bearing: Floats
    eccentricity: Floats
    width: Floats
    height: Floats
    rate: Floats

    def tau(self, n: int) -> float:
        """Return width / rate [s]; NaN where the width hardly changes."""
        rate = float(self.rate[n])
        return float(self.width[n]) / rate if abs(rate) > _LEAST_RATE else float("nan")


def sight_of(observer: Observer, traffic: Traffic, k: int) -> Sight:
    """Return how an observer sees a road user.

    Args:
        observer: At the times of `traffic`.
        traffic: Everyone.
        k: Its number.
    """
    count = len(traffic.times)
    told = np.full((5, count), np.nan)
    there = np.flatnonzero(traffic.alive[k] & np.isfinite(observer.eyes).all(axis=1))
    yaws = traffic.yaws[k, there]
    turn = np.zeros((len(there), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaws)
    turn[:, 1, 0], turn[:, 0, 1], turn[:, 2, 2] = np.sin(yaws), -np.sin(yaws), 1.0
    size = traffic.sizes[k]
    eyes = observer.eyes[there] - traffic.fronts[k, there]
    inside = np.einsum("nji,nj->ni", turn, eyes)  # the eye as the body has it
    low, high = np.array([-size[0], -size[1] / 2.0]), np.array([0.0, size[1] / 2.0])
    told[0, there] = np.linalg.norm(inside[:, :2] - np.clip(inside[:, :2], low, high), axis=1)
    corners = np.einsum("nij,kj->nki", turn, _CORNERS * size) - eyes[:, None]
    middles = np.einsum("nij,j->ni", turn, size * (-0.5, 0.0, 0.5)) - eyes
    looks = observer.forward[there]
    bearings = _azimuth(looks) - _azimuth(middles)
    told[1, there] = _turned(bearings)
    cosines = (middles * looks).sum(axis=1) / np.maximum(np.linalg.norm(middles, axis=1), 1e-9)
    told[2, there] = np.arccos(np.clip(cosines, -1.0, 1.0))
    away = told[0, there] > 0.0
    beside = _turned(_azimuth(corners) - _azimuth(middles)[:, None])
    told[3, there[away]] = np.ptp(beside, axis=1)[away]
    far = np.hypot(corners[..., 0], corners[..., 1]).max(axis=1)
    told[4, there[away]] = _rise(eyes[:, 2], size[2], told[0, there], far)[away]
    return Sight(told[0], told[1], told[2], told[3], told[4], _rate(told[3], traffic.times))


def _rise(eye: Floats, height: float, near: Floats, far: Floats) -> Floats:
    """Return the angle from a body's foot to its top [rad].

    Args:
        eye: Its height above the body's foot, (t,) [m].
        height: Of the body [m].
        near: To the nearest point of its outline, level, (t,) [m].
        far: To the farthest one, (t,) [m].
    """
    top, foot = height - eye, -eye
    highest = np.arctan2(top, np.where(top > 0.0, near, far))
    return np.asarray(highest - np.arctan2(foot, np.where(foot < 0.0, near, far)))


def _azimuth(vectors: Floats) -> Floats:
    """Return angles from east, counter-clockwise [rad]."""
    return np.arctan2(vectors[..., 1], vectors[..., 0])


def _turned(angles: Floats) -> Floats:
    """Return angles within half a turn of 0 [rad]."""
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi)


def _rate(values: Floats, times: Floats) -> Floats:
    """Return changes per time over the neighbours that there are; NaN without any, (t,)."""
    found = np.full(len(values), np.nan)
    for n in np.flatnonzero(np.isfinite(values)).tolist():
        near = [m for m in (n - 1, n, n + 1) if 0 <= m < len(values) and np.isfinite(values[m])]
        if len(near) > 1:
            found[n] = (values[near[-1]] - values[near[0]]) / (times[near[-1]] - times[near[0]])
    return found


# Rows ---------------------------------------------------------------------------------------

Seen = Mapping[tuple[int, str], tuple[float, int]]
"""Of a frame's road user: the share of its body that is not hidden, and how many pixels show it."""


def observer_rows(
    observer: Observer,
    traffics: tuple[Traffic, Traffic],
    found: Sequence[Arrival],
    *,
    within: float,
    seen: Seen,
) -> Iterator[Row]:
    """Yield a row for each frame and road user that is near an observer, by frames.

    Args:
        observer: At the frames' times.
        traffics: Everyone, at the frames' times, and before, in and after the film.
        found: Who comes to the way across, in order.
        within: Of whom is told: so near [m].
        seen: What the picture shows, of the film's camera.
    """
    traffic, around = traffics
    sights = [sight_of(observer, traffic, k) for k in range(len(traffic.keys))]
    coming = np.array([_coming(observer, traffic, around, found, k) for k in range(len(sights))])
    for n, time in enumerate(traffic.times.tolist()):
        times = coming[:, 0, n] if len(coming) else np.empty(0)
        following = int(np.nanargmin(times)) if np.isfinite(times).any() else -1
        for k, sight in enumerate(sights):
            if traffic.keys[k] == observer.key or not sight.distance[n] <= within:
                continue
            arrival, distance, reckoned = coming[k, :, n]
            share, pixels = seen.get((n, traffic.keys[k]), ("", ""))
            yield {
                "frame": n,
                "time": round(time, 6),
                "observer": observer.name,
                "road_user": traffic.keys[k],
                "speed": known(traffic.speeds[k, n]),
                "distance": known(sight.distance[n]),
                "bearing": known(np.degrees(sight.bearing[n])),
                "eccentricity": known(np.degrees(sight.eccentricity[n])),
                "angular_width": known(np.degrees(sight.width[n])),
                "angular_height": known(np.degrees(sight.height[n])),
                "angular_rate": known(np.degrees(sight.rate[n])),
                "tau": known(sight.tau(n)),
                "distance_to_arrival": known(distance),
                "time_to_arrival": known(reckoned),
                "arrives_in": known(arrival),
                "next": int(k == following),
                "seen": share,
                "pixels": pixels,
            }


def _coming(
    observer: Observer, traffic: Traffic, around: Traffic, found: Sequence[Arrival], k: int
) -> Floats:
    """Return time [s] and distance [m] until a road user arrives, and reckoned time, (3, t)."""
    told = np.full((3, len(traffic.times)), np.nan)
    own = [each.time for each in found if each.k == k]
    if observer.across is None or not own:
        return told
    places = np.searchsorted(own, traffic.times - 1e-9)
    comes = (places < len(own)) & traffic.alive[k]
    when = np.array([*own, np.nan])[places]
    told[0, comes] = (when - traffic.times)[comes]
    if observer.stands:
        way = _way(around.fronts[k, :, :2])
        left = np.interp(when, around.times, way) - np.interp(traffic.times, around.times, way)
        closing = traffic.speeds[k]
    else:
        begins, ways = observer.across[:, 0], np.diff(observer.across, axis=1)[:, 0]
        towards = traffic.fronts[k, :, :2] - begins
        left = np.abs(ways[:, 0] * towards[:, 1] - ways[:, 1] * towards[:, 0])
        left = left / np.linalg.norm(ways, axis=1)
        closing = -_rate(left, traffic.times)
    told[1, comes] = left[comes]
    near = comes & (closing > STANDS)
    told[2, near] = left[near] / closing[near]
    return told


def _way(places: Floats) -> Floats:
    """Return how far somebody has come, (t,) [m]; it stays where nobody is known to be."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])
