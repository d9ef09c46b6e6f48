"""When road users arrive at somebody: at a kerb, on a crossing, on a bicycle.

Every film's camera is an observer, and the study file may name more. Times come from the drawn
motion.

* arrival: when a front comes to the way across: from the kerb straight over the road, of who rides
  the line through its own front. It is looked for until ten seconds after the film, in the motion
  that will be drawn, so who turns off before has none;
* distance to arrival: along the way that the front will take; of who rides, straight to its line;
* time to arrival: that distance / present speed, which is what an onlooker could reckon;
* gap before: from when the last one's rear left the way across until the next front comes, of all
  vehicles and both directions together: what somebody who waits there is offered.

References:
    Raff and Hart, "A volume warrant for urban stop signs", Eno Foundation, 1950 (gaps and lags as
    a stream offers them).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.report import CAMERA, ObserverSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.pipeline.measured.traffic import Row, Traffic, known

HORIZON = 10.0
"""How long before and after a film passages are looked for [s]."""

STEP = 0.1
"""Time between moments at which passages are looked for [s]."""

_KERB = 15.0
"""Who stands farther than this from the middle of all lanes has no way across [m]."""

_BEYOND = 12.0
"""How far the way across goes beyond the middle of the nearest lane [m]: four lanes."""

_BESIDE = 15.0
"""How far the line of who rides goes to both sides [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Observer:
    """Who looks, at some times, in SUMO's coordinates.

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


# Who looks ----------------------------------------------------------------------------------


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
) -> Observer:
    """Return an observer that a study file names.

    Args:
        name: Its own.
        settings: Where it is.
        traffic: Everyone, at the times that are looked at.
        network: Where a way across is looked for.

    Raises:
        ConfigError: If its road user never comes near the film's camera.
    """
    if settings.road_user is not None:
        k = traffic.number(settings.road_user)
        if k is None:
            message = f"nobody near the film's camera is called {settings.road_user!r}"
            raise ConfigError(message, key=f"report.observers.{name}.road_user")
        yaws = traffic.yaws[k]
        ahead = np.stack([np.cos(yaws), np.sin(yaws), np.zeros_like(yaws)], axis=1)
        eyes = traffic.fronts[k] + (0.0, 0.0, settings.eye)
        key = traffic.keys[k]
        return Observer(name, eyes, ahead, _beside(traffic, key), key, False)
    place = np.array(settings.position, dtype=float)
    end = settings.across
    way = way_across(place, network) if end is None else np.array([place, end])
    return _standing(name, place, way, settings.eye + _height(place, network), len(traffic.times))


def _standing(name: str, place: Floats, way: Floats | None, z: float, count: int) -> Observer:
    """Return somebody who stands and looks across, or north where there is no way across."""
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
    found = _nearest(place, network)
    if found is None or found[0] > _KERB:
        return None
    away, middle, along, lane = found
    if away > lane.width / 2.0:
        towards = (middle - place) / away
        return np.stack([place, middle + _BEYOND * towards])
    left = np.array([-along[1], along[0]])
    return np.stack([place - _BEYOND * left, place + _BEYOND * left])


def _nearest(place: Floats, network: Network) -> tuple[float, Floats, Floats, Lane] | None:
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


def _height(place: Floats, network: Network) -> float:
    """Return how high the nearest lane lies [m]."""
    found = _nearest(place, network)
    if found is None:
        return 0.0
    points = network.location.outside(found[3].shape)
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
        side: `left` or `right`: from where it comes, for who looks across; of who rides, `behind`
            or `ahead`.
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
    found = []
    for k, key in enumerate(around.keys):
        if key == observer.key or not key.startswith("vehicle:"):
            continue
        yaws = around.yaws[k]
        forward = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
        fronts = around.fronts[k, :, :2]
        rears = fronts - around.sizes[k, 0] * forward
        leaves = [time for time, _ in _crossings(across, rears, around.times)]
        for time, rising in _crossings(across, fronts, around.times):
            left = next((other for other in leaves if other >= time), time)
            speed = float(np.interp(time, around.times, around.speeds[k]))
            found.append(Arrival(k, time, left, speed, sides[0 if rising else 1]))
    return sorted(found, key=lambda each: (each.time, each.k))


def _crossings(across: Floats, points: Floats, times: Floats) -> list[tuple[float, bool]]:
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
    found = []
    for n in np.flatnonzero(over).tolist():
        part = float(before[n] / (before[n] - after[n]))
        if 0.0 <= shares[n] + part * (shares[n + 1] - shares[n]) <= 1.0:
            found.append(
                (float(times[n] + part * (times[n + 1] - times[n])), bool(before[n] > 0.0))
            )
    return found


def arrival_rows(
    observer: Observer, found: Sequence[Arrival], keys: Sequence[str], span: tuple[float, float]
) -> Iterator[Row]:
    """Yield a row for each arrival while a film is shown, or soon after, with the gap before it.

    Args:
        observer: Whose way across it is.
        found: In order, also before the film.
        keys: Of road users.
        span: First and last time of the film [s].
    """
    left = -np.inf
    for each in found:
        if each.time >= span[0]:
            yield {
                "observer": observer.name,
                "road_user": keys[each.k],
                "from": each.side,
                "arrives": known(each.time),
                "arrives_in_film": known(each.time - span[0]),
                "leaves": known(each.left),
                "speed": known(each.speed),
                "gap_before": known(max(each.time - left, 0.0)) if observer.stands else "",
            }
        left = max(left, each.left)
