"""What wheels, rails and hulls leave and stand on: tracks in snow, ruts, rails, water.

Road users stand and ships float on what is drawn, whatever heights the log gives; trains are put
onto rails that lie higher than the road network says. Ruts, in which water stands, are where all
wheels roll, day by day.

Tracks in snow are where the wheels of a log's vehicles passed. Ways come from the logged places of
the whole log, those after the shot included, and not from the motion of what is shown: so tracks
are the same whatever moment, window or view is drawn. Between two samples a way is a cubic that
leaves and arrives as the vehicle was turned.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.cast.poses import grounded
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Transform
from sumo3dviz_pt.model.network import Lane
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Mover
from sumo3dviz_pt.model.traffic import FASTEST, GAP_FACTOR
from sumo3dviz_pt.model.trajectory import DrivenWay, DrivenWays, TyreTracks
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.world.areas.build import covers_ground
from sumo3dviz_pt.world.areas.covers import water_depth
from sumo3dviz_pt.world.build import BuiltPlace, World
from sumo3dviz_pt.world.rails.ways import TRAINS
from sumo3dviz_pt.world.roads.wear.lanes import TRACK_PLACE


def on_tracks(
    parts: Iterable[Mover], vclass: str, rise: Callable[[Floats], Floats] | None
) -> Iterable[Mover]:
    """Lift the parts of a train onto the rails below each of them.

    Args:
        parts: Of one road user.
        vclass: What it is drawn as; all but trains stay where they are.
        rise: How high rails are at points, (n, 2 or 3) -> (n,) [m]; None if all lie flush.
    """
    if rise is None or vclass not in TRAINS:
        return parts
    parts = list(parts)
    heights = rise(np.array([part.world_from_body.position for part in parts]).reshape(-1, 3))
    return [
        replace(part, world_from_body=Transform.from_pose((0.0, 0.0, up)) @ part.world_from_body)
        for part, up in zip(parts, heights.tolist(), strict=True)
    ]


def on_what_is_drawn(fleet: Fleet, place: BuiltPlace, world: World) -> Fleet:
    """Return a fleet on the roads and on the water that are drawn.

    Args:
        fleet: At the log's heights.
        place: What is built around the cameras.
        world: What exists.
    """
    if place.surface is not None:
        fleet = fleet.grounded(place.surface.rise_at)
    if not covers_ground(world.job):
        return fleet
    depth = water_depth()

    def down(points: Floats) -> Floats:
        """How far the water lies above lanes of ships, (n,) [m]."""
        return np.full(len(points), -depth)

    trajectories = tuple(
        grounded(trajectory, down, length=0.0) if body.vclass == "ship" else trajectory
        for trajectory, body in zip(fleet.trajectories, fleet.bodies, strict=True)
    )
    return replace(fleet, trajectories=trajectories).with_wakes()


REACH = 400.0
"""Tracks farther from every camera are not seen [m]."""

_WHEEL_TRACKS_PIECE = 2.0  # the longest straight piece of a way [m]
_LEAST = 2  # samples of a way
_STANDS = 0.01  # a wheel that rolls less between samples stands [m]
_SPARE = 3.0  # how much farther than its speeds say a vehicle may come between samples [m]
_STRAY = 0.3  # how far drivers stray from the middle of their way [m]
_SINGLE = frozenset({"bicycle", "motorcycle", "moped"})  # have one track
_AFLOAT = frozenset({"aircraft", "cable_car", "drone", "ship", *TRAINS})


def wheel_tracks(
    course: WeatherCourse | None, driven: DrivenWays | None, viewpoints: Floats, *, seed: int
) -> TyreTracks | None:
    """Return where wheels passed, over the whole log; None if snow keeps no tracks.

    Args:
        course: The weather over time, or None.
        driven: Where all vehicles of the log were; None for nobody.
        viewpoints: Where cameras are, (n, 3) [m].
        seed: The scene's.
    """
    snow = None if course is None else course.first.snow
    if course is None or snow is None or not course.is_snowy or snow.roads == "cleared":
        return None
    eyes = viewpoints[:, :2] if len(viewpoints) else np.zeros((1, 2))
    low, high = eyes.min(axis=0) - REACH, eyes.max(axis=0) + REACH
    begins, ends = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for way in () if driven is None else driven.ways:
        if way.vclass in _AFLOAT or not _within(way.places, low, high).any():
            continue
        for start, end in _wheels(way, driven.step if driven else 0.0, seed):
            seen = _within(start, low, high)
            begins.append(start[seen])
            ends.append(end[seen])
    return TyreTracks(np.concatenate(begins), np.concatenate(ends))


def _within(places: Floats, low: Floats, high: Floats) -> Bools:
    """Return which places, (n, 2) [m], lie between two corners."""
    return np.asarray(((places > low) & (places < high)).all(axis=1))


def _wheels(way: DrivenWay, step: float, seed: int) -> Iterator[tuple[Floats, Floats]]:
    """Yield where straight pieces of each wheel's way begin and end, (n, 2) [m] each.

    Args:
        way: Of a vehicle.
        step: Of the log [s].
        seed: The scene's.
    """
    if len(way.times) < _LEAST:
        return
    chance = share_of(seed, "tracks", way.key)
    # Which pieces there are: not between samples where it stood, or was not logged, or jumped.
    chords = np.hypot(*np.diff(way.places, axis=0).T)
    spans = np.diff(way.times)
    rolls = (chords > _STANDS) & (chords < _farthest(way, spans))
    if step > 0.0:
        rolls &= spans <= GAP_FACTOR * step
    rows = np.flatnonzero(rolls)
    counts = np.ceil(chords[rows] / _WHEEL_TRACKS_PIECE).astype(np.int64)
    row = np.repeat(rows, counts)
    number = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    travelled = np.concatenate([[0.0], np.cumsum(chords)])
    half = 0.0 if way.vclass in _SINGLE else 0.43 * way.width
    sides = (-half, half) if half else (0.0,)
    each = []
    for place in (number, number + 1):
        share = place / np.repeat(counts, counts)
        middle, across = _curve(way, row, share, chords[row])
        along = (travelled[row] + share * chords[row]) / (17.0 + 20.0 * chance)
        stray = _STRAY * (np.sin(6.2831853 * chance + along) + 1.3 * (2.0 * chance - 1.0))
        each.append([middle + across * (side + stray)[:, None] for side in sides])
    yield from zip(*each, strict=True)


def _farthest(way: DrivenWay, spans: Floats) -> Floats:
    """Return how far a vehicle can come between samples that are `spans` [s] apart, (n,) [m]."""
    speeds = np.fmax(way.speeds[:-1], way.speeds[1:])
    return np.asarray(np.where(np.isnan(speeds), FASTEST, 1.5 * speeds) * spans + _SPARE)


def _curve(way: DrivenWay, row: Ints, share: Floats, chord: Floats) -> tuple[Floats, Floats]:
    """Return places on the cubics between samples, and what points to their left, (n, 2) each.

    Args:
        way: Of a vehicle.
        row: The samples before, (n,).
        share: Of the way to the samples after, (n,) in [0, 1].
        chord: How far apart both are, (n,) [m].
    """
    u = share[:, None]
    heading = np.column_stack([np.cos(way.yaws), np.sin(way.yaws)])
    leave, arrive = heading[row] * chord[:, None], heading[row + 1] * chord[:, None]
    start, end = way.places[row], way.places[row + 1]
    place = start * (1.0 + 2.0 * u) * (1.0 - u) ** 2 + end * u**2 * (3.0 - 2.0 * u)
    place += leave * u * (1.0 - u) ** 2 - arrive * u**2 * (1.0 - u)
    pointing = heading[row] * (1.0 - u) + heading[row + 1] * u
    pointing /= np.maximum(np.hypot(*pointing.T), 1e-9)[:, None]
    return place, np.column_stack([-pointing[:, 1], pointing[:, 0]])


_DRIVEN = frozenset({"passenger", "bus", "truck"})
_RUTS_PIECE = 5.0  # the longest straight piece of a rut [m]
_SHORTEST = 0.05  # [m]


def ruts(
    course: WeatherCourse | None, lanes: Iterable[Lane], viewpoints: Floats
) -> TyreTracks | None:
    """Return the ruts of driven lanes near cameras; None where no puddles stand.

    Junctions have none: ways cross there, and wheels wear all of it.

    Args:
        course: The weather over time, or None.
        lanes: Of the network.
        viewpoints: Where cameras are, (n, 3) [m].
    """
    if course is None or not any(moment.puddles > 0.0 for moment in course.moments):
        return None
    eyes = viewpoints[:, :2] if len(viewpoints) else np.zeros((1, 2))
    low, high = eyes.min(axis=0) - REACH, eyes.max(axis=0) + REACH
    begins, ends = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for lane in lanes:
        if lane.edge_id.startswith(":") or (lane.allowed and not lane.allowed & _DRIVEN):
            continue
        for start, end in _sides(lane.shape[:, :2]):
            seen = ((np.maximum(start, end) > low) & (np.minimum(start, end) < high)).all(axis=1)
            begins.append(start[seen])
            ends.append(end[seen])
    return TyreTracks(np.concatenate(begins), np.concatenate(ends))


def _sides(middle: Floats) -> list[tuple[Floats, Floats]]:
    """Return where straight pieces of a lane's two ruts begin and end, (n, 2) [m] each.

    Args:
        middle: Of the lane, (n, 2) [m].
    """
    steps = np.hypot(*np.diff(middle, axis=0).T)
    long = np.flatnonzero(steps > _SHORTEST)
    counts = np.ceil(steps[long] / _RUTS_PIECE).astype(np.int64)
    row = np.repeat(long, counts)
    number = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    along = np.diff(middle, axis=0)[row] / steps[row, None]
    across = TRACK_PLACE * np.column_stack([-along[:, 1], along[:, 0]])
    share = np.stack([number, number + 1]) / np.repeat(counts, counts)
    start, end = (middle[row] + (each * steps[row])[:, None] * along for each in share)
    return [(start + side * across, end + side * across) for side in (-1.0, 1.0)]
