"""Rates eyes by the traffic that they see, what stands before them, and the sun."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.vectors import unit
from sumo3dviz_pt.pipeline.proposals.movement import Movement
from sumo3dviz_pt.pipeline.proposals.outdoors import Outdoors

FREE = 3.0
"""Nothing stands nearer than this on the axis of a camera [m]."""

_REACH = 75.0  # who is farther than this from the place does not count [m]
_MOST = 140  # places of road users that stand for all of them
_WAITS = 0.3  # how much who waits counts beside who drives
_CROWDED = 1.6  # nobody shall come nearer to a standing eye than this [m]
_PASSING = 8.5  # a vehicle that passes nearer than this fills the picture of a low eye [m]
_LENS = 14.0  # what stands nearer than this fills much of the picture [m]
_CLUTTER = 12.0  # how much a share of the picture that poles fill spoils it
_RASTER = np.array([(x, y) for y in (-0.7, -0.25, 0.25, 0.6) for x in (-0.8, -0.4, 0.0, 0.4, 0.8)])
_RATIO = 9.0 / 16.0


@dataclass(frozen=True, slots=True, eq=False)
class Subjects:
    """Places of road users over the shots that a camera is to see.

    Attributes:
        places: Middles of bodies, (n, 3) [m].
        yaws: Driving directions, (n,) [rad].
        weights: How much each counts, (n,).
    """

    places: Floats
    yaws: Floats
    weights: Floats


def subjects_of(movement: Movement, place: Floats) -> Subjects:
    """Return whom a camera is to see near a place, (3,) [m], among the rows of the shots."""
    near = movement.near(place, _REACH)
    step = max(1, -(-len(near.times) // _MOST))
    places = near.places[::step] + np.array([0.0, 0.0, 0.9])
    moves = 1.0 - np.exp(-near.driven[::step] / 1.5)
    away = np.hypot(*(places[:, :2] - place[:2]).T)
    weights = (_WAITS + (1.0 - _WAITS) * moves) * np.exp(-((away / 50.0) ** 2))
    return Subjects(places, near.yaws[::step], weights)


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
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


def rated(poses: Poses, subjects: Subjects, around: Outdoors, *, sun: Floats | None) -> Floats:
    """Return how good pictures from poses are, (n,); 0 where something stands in the way.

    Args:
        poses: n of them.
        subjects: Whom they are to see.
        around: What stands there.
        sun: Unit vector to the sun, (3,), or None.
    """
    forwards = unit(poses.aims - poses.eyes)
    value = _seen(poses, forwards, subjects, around)
    value *= _free_lens(poses, forwards, around)
    value *= np.exp(-_CLUTTER * _cluttered(poses, forwards, around.posts))
    if sun is not None and sun[2] > 0.05:
        # With the sun in front, all that is seen lies in its own shadow.
        flat = unit(forwards[:, :2]) @ (sun[:2] / max(float(np.hypot(*sun[:2])), 1e-9))
        value *= 1.0 - 0.35 * np.maximum(flat, 0.0)
    return value


def _seen(poses: Poses, forwards: Floats, subjects: Subjects, around: Outdoors) -> Floats:
    """How much traffic each pose sees, (n,)."""
    if not len(subjects.places):
        return np.ones(len(poses.eyes))
    way = subjects.places[None] - poses.eyes[:, None]
    distance = np.maximum(np.linalg.norm(way, axis=2), 0.1)
    rights, ups = _frame(forwards)
    half = np.tan(np.radians(poses.fov) / 2.0)
    ahead = np.einsum("nkc,nc->nk", way, forwards)
    x = np.einsum("nkc,nc->nk", way, rights) / np.maximum(ahead, 0.1) / half
    y = np.einsum("nkc,nc->nk", way, ups) / np.maximum(ahead, 0.1) / (half * _RATIO)
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
    return np.asarray((share * free).sum(axis=1))


def _free_lens(poses: Poses, forwards: Floats, around: Outdoors) -> Floats:
    """How little of the picture something near fills, (n,) in [0, 1]."""
    rights, ups = _frame(forwards)
    half = np.tan(np.radians(poses.fov) / 2.0)
    ways = (
        forwards[:, None]
        + half * _RASTER[None, :, :1] * rights[:, None]
        + half * _RATIO * _RASTER[None, :, 1:] * ups[:, None]
    )
    starts = np.repeat(poses.eyes, len(_RASTER), axis=0)
    ends = starts + _LENS * unit(ways.reshape(-1, 3))
    free = around.clear(starts, ends).reshape(len(poses.eyes), len(_RASTER))
    axis = around.clear(poses.eyes, poses.eyes + FREE / 0.97 * forwards)
    return np.asarray(free.mean(axis=1) ** 3 * (axis > 0.0))


def _cluttered(poses: Poses, forwards: Floats, posts: Floats) -> Floats:
    """Which share of each picture upright things before the place fill, about, (n,)."""
    share = np.zeros(len(poses.eyes))
    rights, ups = _frame(forwards)
    half = np.tan(np.radians(poses.fov) / 2.0)
    before = 0.85 * np.linalg.norm(poses.aims - poses.eyes, axis=1)
    x, y, radius, bottom, top = posts.T
    for level in (0.15, 0.5, 0.85):
        middles = np.column_stack([x, y, bottom + level * (top - bottom)])
        way = middles[None] - poses.eyes[:, None]
        ahead = np.einsum("nkc,nc->nk", way, forwards)
        depth = np.maximum(ahead, 0.5)
        inside = np.abs(np.einsum("nkc,nc->nk", way, rights)) < half * depth
        inside &= np.abs(np.einsum("nkc,nc->nk", way, ups)) < half * _RATIO * depth
        inside &= (ahead > 0.5) & (ahead < before[:, None])
        area = 2.0 * radius * (top - bottom) / 3.0
        share += (inside * area / depth**2).sum(axis=1) / (4.0 * half**2 * _RATIO)
    return share


def crowded(eyes: Floats, movement: Movement) -> Bools:
    """Return which eyes at the height of people, (n, 3) [m], somebody bumps into, (n,)."""
    if not len(movement.times):
        return np.zeros(len(eyes), dtype=np.bool_)
    away = np.hypot(*(eyes[:, None, :2] - movement.places[None, :, :2]).transpose(2, 0, 1))
    return np.asarray((away < _CROWDED).any(axis=1))


def unblocked(poses: Poses, movement: Movement) -> Floats:
    """Return a factor that is lower the longer vehicles pass right before eyes, (n,) in [0, 1].

    Args:
        poses: n of them.
        movement: Everyone near, while the shots last.
    """
    kinds = [trace.kind == "vehicle" for trace in movement.traces]
    vehicles = movement.where(np.array(kinds, dtype=np.bool_)[movement.users])
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


def _frame(forwards: Floats) -> tuple[Floats, Floats]:
    """Unit vectors to the right and up in pictures, both (n, 3)."""
    rights = unit(np.cross(forwards, [0.0, 0.0, 1.0]))
    return rights, np.cross(rights, forwards)
