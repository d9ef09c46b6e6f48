"""When road users arrive at a person at a kerb, on a crossing or on a bicycle, and how they look.

Every film's camera is an observer, and the study file may name more. Times come from the drawn
motion; bodies are boxes of the size that the vehicle type says, upright on the road.

* arrival: when a front comes to the way across. That is from the kerb straight over the road; of an
  observer that rides, the line through its own front. It is looked for until ten seconds after the
  film, in the motion that will be drawn, so a vehicle that turns off before has none;
* distance to arrival: along the way that the front will take; to an observer that rides, straight
  to its line;
* time to arrival: that distance / present speed, which is what an onlooker could reckon;
* gap before: from when the last one's rear left the way across until the next front comes, of all
  vehicles and both directions together: what a person who waits there is offered;
* angular width and height: of the box, from the eye, as azimuths and elevations differ;
* angular rate: change of the width, over the frames before and after; tau: width / rate, the time
  to contact of what comes straight on (Lee 1976);
* bearing: of the box's middle from where the observer looks, clockwise; eccentricity: the angle
  between both in space. Observers that stand look across, those that ride look ahead.

References:
    Lee, "A theory of visual control of braking based on information about time-to-collision",
    Perception 5, 1976, doi:10.1068/p050437 (tau).
    Raff and Hart, "A volume warrant for urban stop signs", Eno Foundation, 1950 (gaps and lags as
    a stream offers them).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.job.sessions import CAMERA, ObserverSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.studies.measured.traffic import STANDS, Row, Traffic, known

HORIZON = 10.0
"""How long before and after a film passages are looked for [s]."""

STEP = 0.1
"""Time between moments at which passages are looked for [s]."""

_KERB = 15.0
"""Observers that stand farther than this from the middle of all lanes have no way across [m]."""

_BEYOND = 12.0
"""How far the way across goes beyond the middle of the nearest lane [m]: four lanes."""

_BESIDE = 15.0
"""How far the line of an observer that rides goes to both sides [m]."""

_LEAST_RATE = 1e-4
"""Angular widths that change less have no tau [rad/s]."""

_CORNERS = np.array([(x, y, z) for x in (-1, 0) for y in (-0.5, 0.5) for z in (0, 1)], dtype=float)
"""Of a body, in its length, width and height; its front is 0."""


@dataclass(frozen=True, slots=True, eq=False)
class Observer:
    """A person or vehicle that looks, at some times, in SUMO's coordinates.

    Attributes:
        name: As the study file has it.
        eyes: (t, 3) [m]; NaN where it is not there.
        forward: Where it looks, unit, (t, 3).
        across: Both ends of its way across, (t, 2, 2) [m]; None if it has none.
        key: Of the road user that it is, or rides in; empty for none.
        stands: Whether it stays where it is.
    """

    name: str
    eyes: Floats
    forward: Floats
    across: Floats | None
    key: str = ""
    stands: bool = True


# Observers ----------------------------------------------------------------------------------


def camera_observer(
    cameras: Sequence[Mapping[str, Any]], traffic: Traffic, network: Network
) -> Observer:
    """Return a film's camera as an observer.

    Args:
        cameras: `position` and `forward` of each frame's.
        traffic: Everyone, at the frames' times.
        network: Where a way across is looked for.
    """
    eyes = np.array([camera["position"] for camera in cameras], dtype=float)
    forward = np.array([camera["forward"] for camera in cameras], dtype=float)
    if traffic.ridden:
        return Observer(
            CAMERA, eyes, forward, _beside(traffic, traffic.ridden), traffic.ridden, False
        )
    stands = bool(np.ptp(eyes, axis=0).max() < 1e-3)
    way = way_across(eyes[0, :2], network) if stands else None
    across = None if way is None else np.broadcast_to(way, (len(eyes), 2, 2))
    return Observer(CAMERA, eyes, forward, across, "", stands)


def named_observer(
    name: str, settings: ObserverSettings, traffic: Traffic, network: Network
) -> Observer | None:
    """Return an observer that a study file names; None if it is nowhere near this film's camera.

    Args:
        name: Its own.
        settings: Where it is.
        traffic: Everyone, at the times that are looked at.
        network: Where a way across is looked for.
    """
    if settings.road_user is not None:
        k = traffic.number(settings.road_user)
        if k is None:
            return None
        yaws = traffic.yaws[k]
        ahead = np.stack([np.cos(yaws), np.sin(yaws), np.zeros_like(yaws)], axis=1)
        eyes = traffic.fronts[k] + (0.0, 0.0, settings.eye)
        key = traffic.keys[k]
        return Observer(name, eyes, ahead, _beside(traffic, key), key, False)
    place = np.array(settings.position, dtype=float)
    end = settings.across
    way = way_across(place, network) if end is None else np.array([place, end])
    return _standing(name, place, way, settings.eye + height_at(place, network), len(traffic.times))


def _standing(name: str, place: Floats, way: Floats | None, z: float, count: int) -> Observer:
    """Return an observer that stands and looks across, or north where there is no way across."""
    towards = np.array([0.0, 1.0]) if way is None else way[1] - way[0]
    forward = np.append(towards / np.linalg.norm(towards), 0.0)
    across = None if way is None else np.broadcast_to(way, (count, 2, 2))
    eyes = np.broadcast_to(np.append(place, z), (count, 3))
    return Observer(name, eyes, np.broadcast_to(forward, (count, 3)), across)


def _beside(traffic: Traffic, key: str) -> Floats:
    """Return the line through a front, at right angles to its heading, (t, 2, 2) [m]."""
    k = traffic.keys.index(key)
    left = np.stack([-np.sin(traffic.yaws[k]), np.cos(traffic.yaws[k])], axis=1)
    front = traffic.fronts[k, :, :2]
    return np.stack([front - _BESIDE * left, front + _BESIDE * left], axis=1)


def way_across(place: Floats, network: Network) -> Floats | None:
    """Return where somebody would cross, from a place straight over the nearest lane, (2, 2) [m].

    Args:
        place: In SUMO's coordinates, (2,) [m]; on a lane the way goes to both sides.
        network: The roads.

    Returns:
        Its ends in SUMO's coordinates; None if no lane for vehicles is near.
    """
    nearest = nearest_lane(place, network)
    if nearest is None or nearest[0] > _KERB:
        return None
    away, middle, along, lane = nearest
    if away > lane.width / 2.0:
        towards = (middle - place) / away
        return np.stack([place, middle + _BEYOND * towards])
    left = np.array([-along[1], along[0]])
    return np.stack([place - _BEYOND * left, place + _BEYOND * left])


def nearest_lane(place: Floats, network: Network) -> tuple[float, Floats, Floats, Lane] | None:
    """Return the nearest lane for vehicles: how far, its nearest point, its direction, itself."""
    best: tuple[float, Floats, Floats, Lane] | None = None
    for lane in network.lanes.values():
        edge = network.edges.get(lane.edge_id)
        if edge is None or edge.function != "normal" or "passenger" not in lane.allowed:
            continue
        line = network.location.outside(lane.shape)[:, :2]
        steps = np.diff(line, axis=0)
        sizes = np.maximum((steps**2).sum(axis=1), 1e-12)
        shares = np.clip(((place - line[:-1]) * steps).sum(axis=1) / sizes, 0.0, 1.0)
        points = line[:-1] + shares[:, None] * steps
        away = np.linalg.norm(points - place, axis=1)
        k = int(np.argmin(away))
        if best is None or away[k] < best[0]:
            best = (float(away[k]), points[k], steps[k] / np.sqrt(sizes[k]), lane)
    return best


def height_at(place: Floats, network: Network) -> float:
    """Return how high the nearest lane lies [m]."""
    nearest = nearest_lane(place, network)
    if nearest is None:
        return 0.0
    points = network.location.outside(nearest[3].shape)
    return float(points[np.argmin(np.linalg.norm(points[:, :2] - place, axis=1)), 2])


# When they arrive ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Arrival:
    """A road user that comes to somebody's way across.

    Attributes:
        k: Its number.
        time: When its front is there [s].
        left: When its rear is there [s].
        speed: Of its front then [m/s].
        side: From where it comes: `left` or `right` for an observer that looks across, `behind` or
            `ahead` for one that rides.
    """

    k: int
    time: float
    left: float
    speed: float
    side: str


def arrivals(observer: Observer, around: Traffic) -> list[Arrival]:
    """Return which vehicles come to an observer's way across, in order.

    Args:
        observer: At the film's times.
        around: Everyone, before, in and after the film.
    """
    if observer.across is None:
        return []
    if observer.stands:
        across = np.broadcast_to(observer.across[0], (len(around.times), 2, 2))
    else:
        across = _beside(around, observer.key)
    sides = ("left", "right") if observer.stands else ("behind", "ahead")
    arriving = []
    for k, key in enumerate(around.keys):
        if key == observer.key or not key.startswith("vehicle:"):
            continue
        yaws = around.yaws[k]
        forward = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
        fronts = around.fronts[k, :, :2]
        rears = fronts - around.sizes[k, 0] * forward
        leaves = [time for time, _ in crossings(across, rears, around.times)]
        for time, rising in crossings(across, fronts, around.times):
            left = next((other for other in leaves if other >= time), time)
            speed = float(np.interp(time, around.times, around.speeds[k]))
            arriving.append(Arrival(k, time, left, speed, sides[0 if rising else 1]))
    return sorted(arriving, key=lambda each: (each.time, each.k))


def crossings(across: Floats, points: Floats, times: Floats) -> list[tuple[float, bool]]:
    """Return when a point comes over a line, and whether from the left of it as it is walked.

    Args:
        across: Ends of the line, (t, 2, 2) [m].
        points: (t, 2) [m]; NaN where there is none.
        times: (t,) [s].
    """
    begins, ways = across[:, 0], across[:, 1] - across[:, 0]
    sizes = (ways**2).sum(axis=1)
    towards = points - begins
    shares = (towards * ways).sum(axis=1) / sizes
    # Left of the line is positive.
    beside = (ways[:, 0] * towards[:, 1] - ways[:, 1] * towards[:, 0]) / np.sqrt(sizes)
    before, after = beside[:-1], beside[1:]
    over = ((before > 0.0) & (after <= 0.0)) | ((before < 0.0) & (after >= 0.0))
    moments = []
    for n in np.flatnonzero(over).tolist():
        part = float(before[n] / (before[n] - after[n]))
        if 0.0 <= shares[n] + part * (shares[n + 1] - shares[n]) <= 1.0:
            moments.append(
                (float(times[n] + part * (times[n + 1] - times[n])), bool(before[n] > 0.0))
            )
    return moments


def arrival_rows(
    observer: Observer,
    arriving: Sequence[Arrival],
    keys: Sequence[str],
    *,
    begin: float,
    speed: float = 1.0,
) -> Iterator[Row]:
    """Yield a row for each arrival while a film is shown, or soon after, with the gap before it.

    Args:
        observer: The one with the way across.
        arriving: In order, also before the film.
        keys: Of road users.
        begin: First time of the film [s].
        speed: SUMO's seconds per second of film.
    """
    left = -np.inf
    for each in arriving:
        if each.time >= begin:
            yield {
                "observer": observer.name,
                "road_user": keys[each.k],
                "from": each.side,
                "arrives": known(each.time),
                "arrives_in_film": known((each.time - begin) / speed),
                "leaves": known(each.left),
                "leaves_in_film": known((each.left - begin) / speed),
                "speed": known(each.speed),
                "gap_before": known(max(each.time - left, 0.0)) if observer.stands else "",
                "in_picture": "",
            }
        left = max(left, each.left)


# What is seen -------------------------------------------------------------------------------


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
    rows = np.full((5, count), np.nan)
    there = np.flatnonzero(traffic.alive[k] & np.isfinite(observer.eyes).all(axis=1))
    yaws = traffic.yaws[k, there]
    turn = np.zeros((len(there), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaws)
    turn[:, 1, 0], turn[:, 0, 1], turn[:, 2, 2] = np.sin(yaws), -np.sin(yaws), 1.0
    size = traffic.sizes[k]
    eyes = observer.eyes[there] - traffic.fronts[k, there]
    inside = np.einsum("nji,nj->ni", turn, eyes)  # the eye as the body has it
    low, high = np.array([-size[0], -size[1] / 2.0]), np.array([0.0, size[1] / 2.0])
    rows[0, there] = np.linalg.norm(inside[:, :2] - np.clip(inside[:, :2], low, high), axis=1)
    corners = np.einsum("nij,kj->nki", turn, _CORNERS * size) - eyes[:, None]
    middles = np.einsum("nij,j->ni", turn, size * (-0.5, 0.0, 0.5)) - eyes
    looks = observer.forward[there]
    bearings = _azimuth(looks) - _azimuth(middles)
    rows[1, there] = _turned(bearings)
    cosines = (middles * looks).sum(axis=1) / np.maximum(np.linalg.norm(middles, axis=1), 1e-9)
    rows[2, there] = np.arccos(np.clip(cosines, -1.0, 1.0))
    away = rows[0, there] > 0.0
    beside = _turned(_azimuth(corners) - _azimuth(middles)[:, None])
    rows[3, there[away]] = np.ptp(beside, axis=1)[away]
    far = np.hypot(corners[..., 0], corners[..., 1]).max(axis=1)
    rows[4, there[away]] = _rise(eyes[:, 2], size[2], rows[0, there], far)[away]
    return Sight(rows[0], rows[1], rows[2], rows[3], rows[4], _rate(rows[3], traffic.times))


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
    rates = np.full(len(values), np.nan)
    for n in np.flatnonzero(np.isfinite(values)).tolist():
        near = [m for m in (n - 1, n, n + 1) if 0 <= m < len(values) and np.isfinite(values[m])]
        if len(near) > 1:
            rates[n] = (values[near[-1]] - values[near[0]]) / (times[near[-1]] - times[near[0]])
    return rates


# Rows ---------------------------------------------------------------------------------------

Seen = Mapping[tuple[int, str], tuple[float, int]]
"""Of a frame's road user: the share of its body that is not hidden, and how many pixels show it."""


def observer_rows(
    observer: Observer,
    traffics: tuple[Traffic, Traffic],
    arriving: Sequence[Arrival],
    *,
    within: float,
    seen: Seen,
) -> Iterator[Row]:
    """Yield a row for each frame and road user that is near an observer, by frames.

    Args:
        observer: At the frames' times.
        traffics: Everyone, at the frames' times, and before, in and after the film.
        arriving: Passages over the way across, in order.
        within: How near road users are that have rows [m].
        seen: What the picture shows, of the film's camera.
    """
    traffic, around = traffics
    sights = [sight_of(observer, traffic, k) for k in range(len(traffic.keys))]
    coming = np.array([_coming(observer, traffic, around, arriving, k) for k in range(len(sights))])
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
    observer: Observer, traffic: Traffic, around: Traffic, arriving: Sequence[Arrival], k: int
) -> Floats:
    """Return time [s] and distance [m] until a road user arrives, and reckoned time, (3, t)."""
    rows = np.full((3, len(traffic.times)), np.nan)
    own = [each.time for each in arriving if each.k == k]
    if observer.across is None or not own:
        return rows
    places = np.searchsorted(own, traffic.times - 1e-9)
    comes = (places < len(own)) & traffic.alive[k]
    when = np.array([*own, np.nan])[places]
    rows[0, comes] = (when - traffic.times)[comes]
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
    rows[1, comes] = left[comes]
    near = comes & (closing > STANDS)
    rows[2, near] = left[near] / closing[near]
    return rows


def _way(places: Floats) -> Floats:
    """Return how far somebody has come, (t,) [m]; it stays where nobody is known to be."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])
