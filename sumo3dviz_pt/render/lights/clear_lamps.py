"""Moves lamps of vehicles out of the bodies that they would be hidden in.

Lamps are placed on our detailed body. Stand-ins for far away are blunter, stretched and
simplified, and a user's own body has another form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.lamps import VehicleLamp
from sumo3dviz_pt.model.scene import Part

_BEFORE = 0.004
_DEEPEST = 0.125
"""A surface that lies farther than this before a lamp is meant to hide it [m]."""

_HIDDEN = 0.1
"""Share of a lamp that may be hidden."""

_TURN = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
_RING = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
_PROBES = np.concatenate([np.zeros((1, 2)), 0.5 * _RING[::2], 0.92 * _RING])


def clear_lamps(lamps: Sequence[VehicleLamp], parts: Sequence[Part]) -> tuple[VehicleLamp, ...]:
    """Move lamps along the way they shine until the body no longer hides them.

    Args:
        lamps: In the body's frame.
        parts: The body that is drawn.
    """
    if not (lamps and parts):
        return tuple(lamps)
    corners = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in parts])
    low, high = _bounds(corners)
    return tuple(_moved(lamp, corners[_near(lamp, low, high)]) for lamp in lamps)


def _bounds(corners: Floats) -> tuple[Floats, Floats]:
    """Return the lowest and highest coordinates of triangles, (m, 3) each."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _near(lamp: VehicleLamp, low: Floats, high: Floats) -> Bools:
    """Return which triangles may hide a lamp, (m,), by the bounds of all of them, (m, 3) each."""
    reach = float(np.linalg.norm([*lamp.size, _DEEPEST]))
    at = np.array(lamp.at)
    return np.asarray(((low < at + reach) & (high > at - reach)).all(axis=1))


def _moved(lamp: VehicleLamp, corners: Floats) -> VehicleLamp:
    """Move one lamp out of the triangles of a body, (m, 3, 3) [m]."""
    ahead = _ahead(lamp, corners)
    if float((ahead > 0.0).mean()) <= _HIDDEN:
        return lamp
    step = float(ahead.max()) + _BEFORE
    x, y, z = lamp.at
    return replace(lamp, at=(x + step * np.cos(lamp.yaw), y + step * np.sin(lamp.yaw), z))


def _ahead(lamp: VehicleLamp, corners: Floats) -> Floats:
    """Return how far the foremost surface lies before each probe, (probes,) [m]; else 0."""
    forward = np.array([np.cos(lamp.yaw), np.sin(lamp.yaw), 0.0])
    # Across, up and forward, from the middle of the lamp and in units of its half axes.
    axes = np.stack([[-forward[1], forward[0], 0.0], [0.0, 0.0, 1.0], forward], axis=1)
    seen = (corners - np.array(lamp.at)) @ axes / [lamp.size[0] / 2, lamp.size[1] / 2, 1.0]
    low, high = _bounds(seen)
    near = (low[:, :2] < 1.0).all(axis=1) & (high[:, :2] > -1.0).all(axis=1)
    near &= (high[:, 2] > 0.0) & (low[:, 2] < _DEEPEST)
    depth, hit = _crossed(seen[near])
    hit &= (depth > 0.0) & (depth < _DEEPEST)
    return np.asarray(np.where(hit, depth, 0.0).max(axis=0, initial=0.0))


def _crossed(corners: Floats) -> tuple[Floats, Bools]:
    """Return how far ahead the probes' rays cross triangles, and whether, (triangles, probes)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v = b - a, c - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    flat = np.abs(area) < 1e-9
    area = np.where(flat, 1.0, area)[:, None]
    off = _PROBES - a[:, None, :2]
    s = (off[..., 0] * v[:, None, 1] - off[..., 1] * v[:, None, 0]) / area
    t = (off[..., 1] * u[:, None, 0] - off[..., 0] * u[:, None, 1]) / area
    depth = a[:, None, 2] + s * u[:, None, 2] + t * v[:, None, 2]
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & ~flat[:, None]
    return depth, inside
