"""Rates eyes by who comes close to them while the shots last."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.vectors import unit
from sumo3dviz_pt.pipeline.proposals.eyes import RATIO, Poses, frame
from sumo3dviz_pt.pipeline.proposals.movement import Movement

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


def unblocked(poses: Poses, movement: Movement) -> Floats:
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


def not_looming(poses: Poses, movement: Movement, types: Mapping[str, VehicleType]) -> Floats:
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
