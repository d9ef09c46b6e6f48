"""Rates eyes by the traffic that they see, who comes close to them, and what stands before them.

They are rated over the time that the shots last. Proposed cameras keep away from roads that cross
at one height without a junction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, unit
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Trace, VehicleType
from sumo3dviz_pt.proposals.busiest import Movement
from sumo3dviz_pt.proposals.outdoors import Outdoors
from sumo3dviz_pt.sumo.repairs import crossings_at_grade
from sumo3dviz_pt.world.placement.clearance import shares

FREE = 3.0
"""Nothing stands nearer than this to the axis of a camera, before its target [m]."""

_REACH = 75.0  # who is farther than this from the place does not count [m]
_MOST = 140  # places of road users that stand for all of them
_WAITS = 0.3  # how much who waits counts beside who drives
_LENS = 14.0  # what stands nearer than this fills much of the picture [m]
_BEFORE, _MIDDLE = 0.85, 1.5  # share of the way to the target that is free so widely [m]
_FARTHEST = 60.0  # what stands beyond this on an axis is small [m]
_LIVELY = 0.6  # share of the time in which somebody is in view
_LEAST_FREE = 0.6  # share of the picture that nothing near fills
_CLUTTER = 12.0  # how much a share of the picture that poles fill spoils it
_FILLS = 0.02  # no post near the lens fills a larger share of a picture
_AGAINST = 0.5  # cosine of the angle in plan within which the sun is in front
_HIGH = 0.87  # and the sine of its height above which it blinds nobody
_RASTER = np.array([(x, y) for y in (-0.7, -0.25, 0.25, 0.6) for x in (-0.8, -0.4, 0.0, 0.4, 0.8)])
RATIO = 9.0 / 16.0
"""Height / width of pictures."""


@dataclass(frozen=True, slots=True, eq=False)
class Subjects:
    """Places of road users over the shots that a camera is to see.

    Attributes:
        places: Middles of bodies, (n, 3) [m].
        yaws: Driving directions, (n,) [rad].
        weights: How much each counts, (n,).
        seconds: In which second of the log each is there, (n,).
    """

    places: Floats
    yaws: Floats
    weights: Floats
    seconds: Ints


def subjects_of(movement: Movement, place: Floats) -> Subjects:
    """Return whom a camera is to see near a place, (3,) [m], among the rows of the shots."""
    near = movement.near(place, _REACH)
    # Thin out in the order of time, so that every second keeps somebody.
    step = max(1, -(-len(near.times) // _MOST))
    some = np.argsort(near.times, kind="stable")[::step]
    places = near.places[some] + np.array([0.0, 0.0, 0.9])
    moves = 1.0 - np.exp(-near.driven[some] / 1.5)
    away = np.hypot(*(places[:, :2] - place[:2]).T)
    weights = (_WAITS + (1.0 - _WAITS) * moves) * np.exp(-((away / 50.0) ** 2))
    seconds = np.floor(near.times[some] + 1e-6).astype(np.int64)
    return Subjects(places, near.yaws[some], weights, seconds)


@dataclass(frozen=True, slots=True, eq=False)
class ViewPoses:
    """Where cameras may stand and look.

    Attributes:
        eyes: (n, 3) [m].
        aims: Points that they look at, (n, 3) [m].
        fov: Horizontal opening angle of all of them [deg].
        focus: At this distance a road user counts half of what it would close by [m].
    """

    eyes: Floats
    aims: Floats
    fov: float
    focus: float = 30.0


def rated(poses: ViewPoses, subjects: Subjects, around: Outdoors, *, sun: Floats | None) -> Floats:
    """Return how good pictures from poses are, (n,); 0 where something stands in the way.

    Args:
        poses: n of them.
        subjects: Whom they are to see.
        around: What stands there.
        sun: Unit vector to the sun, (3,), or None.
    """
    forwards = unit(poses.aims - poses.eyes)
    value = _seen(poses, forwards, subjects, around)
    value *= _free_lens(poses, forwards, around) * _free_axis(poses, around)
    value *= np.exp(-_CLUTTER * _cluttered(poses, forwards, around.posts))
    value *= np.where(_before_lens(poses, forwards, around.posts) > _FILLS, 0.02, 1.0)
    if sun is not None and sun[2] > 0.05:
        # With the sun in front, all that is seen lies in its own shadow.
        flat = unit(forwards[:, :2]) @ (sun[:2] / max(float(np.hypot(*sun[:2])), 1e-9))
        value *= 1.0 - 0.35 * np.maximum(flat, 0.0)
    return value


def against(poses: ViewPoses, sun: Floats | None) -> Bools:
    """Return which poses look against the sun, (n,).

    Args:
        poses: n of them.
        sun: Unit vector to the sun, (3,), or None; one high above blinds nobody.
    """
    if sun is None or not 0.0 < sun[2] < _HIGH:
        return np.zeros(len(poses.eyes), dtype=np.bool_)
    ahead = unit((poses.aims - poses.eyes)[:, :2])
    return np.asarray(ahead @ sun[:2] > _AGAINST * float(np.hypot(*sun[:2])))


def _seen(poses: ViewPoses, forwards: Floats, subjects: Subjects, around: Outdoors) -> Floats:
    """How much traffic each pose sees, (n,)."""
    if not len(subjects.places):
        return np.ones(len(poses.eyes))
    way = subjects.places[None] - poses.eyes[:, None]
    distance = np.maximum(np.linalg.norm(way, axis=2), 0.1)
    rights, ups = frame(forwards)
    half = np.tan(np.radians(poses.fov) / 2.0)
    ahead = np.einsum("nkc,nc->nk", way, forwards)
    x = np.einsum("nkc,nc->nk", way, rights) / np.maximum(ahead, 0.1) / half
    y = np.einsum("nkc,nc->nk", way, ups) / np.maximum(ahead, 0.1) / (half * RATIO)
    inside = (ahead > 1.0) & (np.abs(x) < 0.97) & (np.abs(y) < 0.95)
    # Near the picture's border a road user is worth less.
    share = inside * (1.0 - 0.4 * np.maximum(np.abs(x), np.abs(y)) ** 4)
    share = share * subjects.weights * poses.focus / (poses.focus + distance)
    # Fronts are nicer than rears.
    level = np.zeros(len(subjects.yaws))
    towards = np.stack([np.cos(subjects.yaws), np.sin(subjects.yaws), level], axis=1)
    facing = -np.einsum("nkc,kc->nk", way, towards) / distance
    share = share * (1.0 + 0.15 * facing)
    eye, subject = np.nonzero(share > 0.0)
    free = np.zeros(share.shape)
    free[eye, subject] = around.clear(poses.eyes[eye], subjects.places[subject])
    seen = share * free
    return np.asarray(seen.sum(axis=1) * _lively(seen > 0.0, subjects.seconds))


def _lively(seen: Bools, seconds: Ints) -> Floats:
    """A factor that is lower where nobody is in view for much of the time, (n,) in [0, 1].

    Args:
        seen: Whom each of n poses sees, (n, k).
        seconds: When each of them is there, (k,).
    """
    moments, row = np.unique(seconds, return_inverse=True)
    alive = np.zeros((len(seen), len(moments)), dtype=np.bool_)
    for moment in range(len(moments)):
        alive[:, moment] = seen[:, row == moment].any(axis=1)
    return np.asarray(np.minimum(alive.mean(axis=1) / _LIVELY, 1.0) ** 2)


def _free_axis(poses: ViewPoses, around: Outdoors) -> Floats:
    """A factor that is near 0 where something stands beside an axis above heads, (n,)."""
    ahead = poses.aims - poses.eyes
    length = np.maximum(np.linalg.norm(ahead, axis=1), 1e-6)
    # Down at the target something may stand: an axis ends as far above it as it is to be free.
    steep = np.maximum(-ahead[:, 2] / length, 1e-6)
    share = np.where(ahead[:, 2] < 0.0, np.maximum(1.0 - FREE / steep / length, 0.0), 1.0)
    share = np.minimum(share, _FARTHEST / length)
    room = around.room(poses.eyes, poses.eyes + share[:, None] * ahead)
    # Nor stands a pole in the very middle of the picture, whatever the camera's height.
    middle = around.room(poses.eyes, poses.eyes + _BEFORE * ahead)
    free = np.where(middle >= _MIDDLE, 1.0, 0.3 + 0.7 * middle / _MIDDLE)
    return np.asarray(free * np.where(room >= FREE, 1.0, 0.02 * room / FREE))


def _free_lens(poses: ViewPoses, forwards: Floats, around: Outdoors) -> Floats:
    """How little of the picture something near fills, (n,) in [0, 1]."""
    rights, ups = frame(forwards)
    half = np.tan(np.radians(poses.fov) / 2.0)
    ways = (
        forwards[:, None]
        + half * _RASTER[None, :, :1] * rights[:, None]
        + half * RATIO * _RASTER[None, :, 1:] * ups[:, None]
    )
    starts = np.repeat(poses.eyes, len(_RASTER), axis=0)
    ends = starts + _LENS * unit(ways.reshape(-1, 3))
    free = around.clear(starts, ends).reshape(len(poses.eyes), len(_RASTER)).mean(axis=1)
    return np.asarray(free**3 * (free >= _LEAST_FREE))


def _cluttered(poses: ViewPoses, forwards: Floats, posts: Floats) -> Floats:
    """Which share of each picture upright things before the place fill, about, (n,)."""
    share = np.zeros(len(poses.eyes))
    rights, ups = frame(forwards)
    half = np.tan(np.radians(poses.fov) / 2.0)
    before = 0.85 * np.linalg.norm(poses.aims - poses.eyes, axis=1)
    x, y, radius, bottom, top = posts.T
    for level in (0.15, 0.5, 0.85):
        middles = np.column_stack([x, y, bottom + level * (top - bottom)])
        way = middles[None] - poses.eyes[:, None]
        ahead = np.einsum("nkc,nc->nk", way, forwards)
        depth = np.maximum(ahead, 0.5)
        inside = np.abs(np.einsum("nkc,nc->nk", way, rights)) < half * depth
        inside &= np.abs(np.einsum("nkc,nc->nk", way, ups)) < half * RATIO * depth
        inside &= (ahead > 0.5) & (ahead < before[:, None])
        area = 2.0 * radius * (top - bottom) / 3.0
        share += (inside * area / depth**2).sum(axis=1) / (4.0 * half**2 * RATIO)
    return share


def _before_lens(poses: ViewPoses, forwards: Floats, posts: Floats) -> Floats:
    """Which share of each picture the largest of the posts near the lens fills, (n,)."""
    if not len(posts):
        return np.zeros(len(poses.eyes))
    diagonal = np.arctan(np.tan(np.radians(poses.fov) / 2.0) * np.hypot(1.0, RATIO))
    way = CameraPath(poses.eyes, forwards, np.full(len(poses.eyes), diagonal))
    low, high = posts[:, 3], posts[:, 4:]
    hidden = shares(way, posts[:, :2], low, height=high - low[:, None], radius=posts[:, 2:3])
    return np.asarray(hidden.max(axis=0))


def best_of(values: Floats) -> int | None:
    """Return the index of the highest value, or None if there is none above 0.

    Values are rounded before, so that processors agree, and the first of equals wins.
    """
    if not len(values) or values.max() <= 0.0:
        return None
    return int(np.argmax(np.round(values / values.max(), 6)))


def ring(middle: Floats, *, azimuths: Sequence[float], distances: Sequence[float]) -> Floats:
    """Return places around a middle, (n, 2) [m].

    Args:
        middle: (2,) or (3,) [m].
        azimuths: Counter-clockwise from east [rad].
        distances: [m].
    """
    turn, away = np.meshgrid(np.array(azimuths), np.array(distances), indexing="ij")
    steps = np.stack([np.cos(turn) * away, np.sin(turn) * away], axis=-1).reshape(-1, 2)
    return np.asarray(middle[:2] + steps)


def frame(forwards: Floats) -> tuple[Floats, Floats]:
    """Return unit vectors to the right and up in pictures that look forwards, both (n, 3)."""
    rights = unit(np.cross(forwards, [0.0, 0.0, 1.0]))
    return rights, np.cross(rights, forwards)


_CROWDED = 1.6  # nobody shall come nearer to a standing eye than this [m]
_PASSING = 8.5  # a vehicle that passes nearer than this fills the picture of a low eye [m]
_LOOMS = 0.35  # a vehicle higher than this share of the picture, and cut by its edge, spoils it
_USUAL = (4.5, 1.5)  # length and height of a vehicle of an unknown type [m]


def crowded(eyes: Floats, movement: Movement) -> Bools:
    """Return which eyes at the height of people, (n, 3) [m], somebody bumps into, (n,)."""
    if not len(movement.times):
        return np.zeros(len(eyes), dtype=np.bool_)
    away = np.hypot(*(eyes[:, None, :2] - movement.places[None, :, :2]).transpose(2, 0, 1))
    return np.asarray((away < _CROWDED).any(axis=1))


def unblocked(poses: ViewPoses, movement: Movement) -> Floats:
    """Return a factor that is lower the longer vehicles pass right before eyes, (n,) in [0, 1].

    Args:
        poses: n of them.
        movement: Everyone near, while the shots last.
    """
    vehicles = _vehicles(movement)
    if not len(vehicles.times):
        return np.ones(len(poses.eyes))
    back = np.stack([np.cos(vehicles.yaws), np.sin(vehicles.yaws)], axis=1)
    middles = vehicles.places[:, :2] - 2.2 * back
    way = middles[None] - poses.eyes[:, None, :2]
    away = np.maximum(np.hypot(way[..., 0], way[..., 1]), 0.1)
    ahead = np.einsum("nkc,nc->nk", way, unit((poses.aims - poses.eyes)[:, :2])) / away
    near = (away < _PASSING) & (ahead > np.cos(np.radians(poses.fov / 2.0 + 12.0)))
    seconds = max(float(np.ptp(vehicles.times)), 1.0)
    return np.asarray((1.0 - np.minimum(near.sum(axis=1) / seconds, 1.0)) ** 2)


def not_looming(poses: ViewPoses, movement: Movement, types: Mapping[str, VehicleType]) -> Floats:
    """Return a factor that is lower the longer high vehicles are cut by pictures' edges, (n,).

    Args:
        poses: n of them.
        movement: Everyone near, while the shots last.
        types: Vehicle types by id; they say how long and how high vehicles are.
    """
    vehicles = _vehicles(movement)
    if not len(vehicles.times):
        return np.ones(len(poses.eyes))
    kinds = [types.get(trace.type_id) for trace in movement.traces]
    sizes = [_USUAL if kind is None else (kind.length, kind.height) for kind in kinds]
    length, height = np.array(sizes)[vehicles.users].T
    forwards = unit(poses.aims - poses.eyes)
    rights, ups = frame(forwards)
    half = np.tan(np.radians(poses.fov) / 2.0)
    back = np.stack([np.cos(vehicles.yaws), np.sin(vehicles.yaws), 0.0 * length], axis=1)
    looms = np.zeros((len(poses.eyes), len(length)), dtype=np.bool_)
    for share in (0.0, 0.5, 1.0):
        middles = vehicles.places - share * length[:, None] * back
        middles[:, 2] += 0.5 * height
        way = middles[None] - poses.eyes[:, None]
        depth = np.einsum("nkc,nc->nk", way, forwards)
        wide = half * np.maximum(depth, 0.5)
        x = np.einsum("nkc,nc->nk", way, rights) / wide
        y = np.einsum("nkc,nc->nk", way, ups) / (RATIO * wide)
        # In units of half the picture's height, as y is.
        high = height / (RATIO * wide)
        cut = (np.abs(x) < 1.0) & (y - 0.5 * high < -1.0) & (y + 0.5 * high > -1.0)
        looms |= cut & (high > 2.0 * _LOOMS) & (depth > 0.5)
    moments, row = np.unique(np.floor(vehicles.times + 1e-6), return_inverse=True)
    spoilt = np.array([looms[:, row == moment].any(axis=1) for moment in range(len(moments))])
    return np.asarray((1.0 - spoilt.mean(axis=0)) ** 2)


def _vehicles(movement: Movement) -> Movement:
    """Rows of vehicles, without those of people."""
    kinds = [trace.kind == "vehicle" for trace in movement.traces]
    return movement.where(np.array(kinds, dtype=np.bool_)[movement.users])


_AVOIDED = 60.0
"""Who drives nearer than this to such a crossing plays no part [m]."""

_SEEN = 150.0
"""Cars that pass through each other farther away than this are small in a picture [m]."""


def meetings_of(network: Network) -> Floats:
    """Return where roads cross at one height without a junction, (n, 3) [m]."""
    return np.array([each.place for each in crossings_at_grade(network)]).reshape(-1, 3)


def apart(movement: Movement, meetings: Floats) -> Movement:
    """Return the rows away from places where roads meet, (n, 3) [m]; all if none are."""
    if not len(meetings) or not len(movement.times):
        return movement
    away = movement.where(_away(movement.places, meetings))
    return away if len(away.times) else movement


def riding_apart(traces: Sequence[Trace], meetings: Floats) -> list[Trace]:
    """Return the road users that never come to places where roads meet, (n, 3) [m]."""
    if not len(meetings):
        return list(traces)
    return [trace for trace in traces if _away(trace.positions, meetings).all()]


def shows_none(poses: ViewPoses, meetings: Floats) -> Bools:
    """Return which pictures show none of the places where roads meet, (k,).

    Args:
        poses: k of them.
        meetings: (n, 3) [m].
    """
    forwards = unit(poses.aims - poses.eyes)
    rights, ups = frame(forwards)
    way = meetings[None] - poses.eyes[:, None]
    ahead, x, y = (np.einsum("knc,kc->kn", way, axis) for axis in (forwards, rights, ups))
    half = np.tan(np.radians(poses.fov) / 2.0) * np.maximum(ahead, 0.0)
    near = (ahead > 0.0) & (np.linalg.norm(way, axis=2) < _SEEN)
    shown = near & (np.abs(x) < half) & (np.abs(y) < RATIO * half)
    return np.asarray(~shown.any(axis=1))


def _away(places: Floats, meetings: Floats) -> Bools:
    """Which places, (k, 3), are away from all of some others, (n, 3) [m], in plan."""
    far, _ = cKDTree(meetings[:, :2]).query(places[:, :2])
    return np.asarray(far > _AVOIDED)
