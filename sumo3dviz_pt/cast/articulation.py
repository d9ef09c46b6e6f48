"""Vehicles of several units bend along the path that they drove.

Each unit has two pivots that stay on the path of the vehicle's front: the joints of buses
and lorries, the bogies of trains, so that their wheels stay on the rails. Units are rigid;
their pivots are as far apart as the body says, measured straight, not along the path.

Modules of a tram have one bogie each and meet at hinges. Where the two units that meet
disagree, in front of and behind a bend, the hinge lies half-way, and both turn to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import MotionPiece

_SPACING = 0.5
"""Of the points between which the path is straight [m]: 3 mm off in a bend of 10 m."""

_LONG = 40.0
"""Longer vehicles run on rails, in wider bends: twice that spacing [m]."""

_ROUNDS = 10
"""To find where a rigid unit's second pivot lies; in wide bends each is 50 times nearer."""

_REST = 4.0
"""Path behind the last pivot, because it is longer in bends than straight [m]."""

_TIGHT = 1.5
"""And this many times as long where vehicles may turn on the spot."""


@dataclass(frozen=True, slots=True, eq=False)
class UnitLinks:
    """Where the units of a vehicle are held, as drawn.

    Attributes:
        starts: Of each unit's front behind the vehicle's front, (u,) [m].
        lengths: Of the units, (u,) [m].
        pivots: Of each unit behind its own front, (u, 2) [m].
        hinged: Whether the units' ends are kept together.
    """

    starts: Floats
    lengths: Floats
    pivots: Floats
    hinged: bool = False


def unit_frames(piece: MotionPiece, times: Floats, links: UnitLinks) -> Floats:
    """Return the placements of a vehicle's units, unscaled, (n, u, 4, 4).

    Args:
        piece: The vehicle's motion.
        times: Within its life, (n,) [s].
        links: Of u units.
    """
    reach = float(links.starts[-1] + links.pivots[-1, 1]) + _REST
    spacing = _SPACING * (1.0 if reach < _LONG else 2.0)
    count = int(np.ceil((_TIGHT if reach < _LONG else 1.0) * reach / spacing)) + 1
    distances = spacing * np.arange(count, dtype=np.float64)
    path = piece.trail(times, distances)
    fronts, headings = _rigid(path, spacing, links)
    if links.hinged:
        fronts, headings = _hinged(fronts, headings, links.lengths)
    return _matrices(fronts, headings)


def _rigid(path: Floats, spacing: float, links: UnitLinks) -> tuple[Floats, Floats]:
    """Fronts and unit headings of units with both pivots on a path, (n, u, 3) each."""
    fronts, headings = [], []
    place, rear = np.zeros(len(path)), 0.0
    for start, (first, second) in zip(links.starts, links.pivots, strict=True):
        # Between units, too, distances are straight: couplings are bars.
        place, ahead = _second(path, spacing, place, base=float(start + first) - rear)
        place, behind = _second(path, spacing, place, base=float(second - first))
        rear = float(start + second)
        heading = _unit(ahead - behind)
        fronts.append(ahead + first * heading)
        headings.append(heading)
    return np.stack(fronts, axis=1), np.stack(headings, axis=1)


def _second(path: Floats, spacing: float, place: Floats, *, base: float) -> tuple[Floats, Floats]:
    """Where on the path a pivot lies that is a straight distance behind another one.

    Returns:
        Distance behind the vehicle's front along the path, (n,) [m], and the points, (n, 3).
    """
    start = _points(path, spacing, place)
    if base <= 0.0:
        return place + base, _points(path, spacing, place + base)
    along = place + base
    for _ in range(_ROUNDS):
        points = _points(path, spacing, along)
        along = along + base - np.linalg.norm(points - start, axis=1)
    return along, _points(path, spacing, along)


def _points(path: Floats, spacing: float, along: Floats) -> Floats:
    """Points of n paths, (n, k, 3), at one distance each, (n,) [m]; (n, 3)."""
    place = np.clip(along / spacing, 0.0, path.shape[1] - 1.0)
    index = np.minimum(place.astype(np.int64), path.shape[1] - 2)
    share = (place - index)[:, None]
    rows = np.arange(len(path))
    return np.asarray((1.0 - share) * path[rows, index] + share * path[rows, index + 1])


def _hinged(fronts: Floats, headings: Floats, lengths: Floats) -> tuple[Floats, Floats]:
    """Units whose ends are pulled together, arguments and result as from `_rigid`."""
    rears = fronts - lengths[:, None] * headings
    hinges = (rears[:, :-1] + fronts[:, 1:]) / 2.0
    first = np.concatenate([fronts[:, :1], hinges], axis=1)
    last = np.concatenate([hinges, rears[:, -1:]], axis=1)
    turned = _unit(first - last)
    return (first + last) / 2.0 + 0.5 * lengths[:, None] * turned, turned


def _unit(vectors: Floats) -> Floats:
    """Vectors of length 1, (..., 3); of none, east."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-9, vectors / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])


def _matrices(fronts: Floats, headings: Floats) -> Floats:
    """Placements without roll, (n, u, 4, 4)."""
    level = np.maximum(np.hypot(headings[..., 0], headings[..., 1]), 1e-9)
    left = np.stack([-headings[..., 1] / level, headings[..., 0] / level, 0.0 * level], axis=-1)
    matrices = np.zeros((*fronts.shape[:2], 4, 4))
    matrices[..., :3, 0], matrices[..., :3, 1] = headings, left
    matrices[..., :3, 2] = np.cross(headings, left)
    matrices[..., :3, 3] = fronts
    matrices[..., 3, 3] = 1.0
    return matrices


def rigid_frames(positions: Floats, yaws: Floats, pitches: Floats) -> Floats:
    """Return the placements of bodies, (n, 4, 4): pitch, then yaw.

    Args:
        positions: Of their fronts, (n, 3) [m].
        yaws: (n,) [rad].
        pitches: Nose up, (n,) [rad].
    """
    cy, sy, cp, sp = np.cos(yaws), np.sin(yaws), np.cos(pitches), np.sin(pitches)
    zero = np.zeros(len(yaws))
    matrices = np.zeros((len(yaws), 4, 4))
    matrices[:, :3, 0] = np.stack([cy * cp, sy * cp, sp], axis=1)
    matrices[:, :3, 1] = np.stack([-sy, cy, zero], axis=1)
    matrices[:, :3, 2] = np.stack([-cy * sp, -sy * sp, cp], axis=1)
    matrices[:, :3, 3] = positions
    matrices[:, 3, 3] = 1.0
    return matrices


def joined(
    starts: Sequence[float],
    lengths: Sequence[float],
    pivots: Sequence[tuple[float, float]],
    *,
    hinged: bool,
) -> UnitLinks:
    """Return links from lists of numbers.

    Args:
        starts: Of each unit's front behind the vehicle's front, u of them [m].
        lengths: Of the units, u of them [m].
        pivots: Of each unit behind its own front, u pairs [m].
        hinged: Whether the units' ends are kept together.
    """
    return UnitLinks(np.array(starts), np.array(lengths), np.array(pivots).reshape(-1, 2), hinged)
