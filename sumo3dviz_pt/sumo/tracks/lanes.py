"""Finds lanes where tracks run densely beside each other; none where they cross.

A way that was driven is a reference. At stations along it, everyone who drives the same direction
nearby has an offset to its side; lanes are where offsets are dense, and lead from station to
station. Where ways cross there are no lanes, as on junctions. Then the longest way that no lane
explains is the next reference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints

STEP = 2.0
"""Distance of points along ways [m]."""

_STATION = 3  # points between stations
_SIDE = 32.0  # how far beside a reference lanes are sought [m]
_ALONG = 5.0  # ways count at a station where they pass it within this distance [m]
_SAME = np.radians(20.0)
_NEAR = 2.0  # ways of other directions that are as near cross [m]
_ROWS = 1 << 32  # of squares, more than there can be
_SECTORS = 24
_ACROSS = _SECTORS // 2  # ways against each other do not cross
_CLEAR = 3  # points around a crossing that belong to it
_BLUR = 0.45  # spread of offsets in a lane [m]
_CELL = 0.1
_LEAST = 2.4  # lanes are not closer together [m]
_WIDEST = 4.7  # lanes farther apart are not neighbours [m]
_SHIFT = 1.0  # lanes do not move farther aside between stations [m]
_SHORTEST = 4  # stations of a lane
_USUAL = 3.3  # width of a lane without neighbours [m]
_EXPLAINED = 1.7  # who drives as near to a lane drives in it [m]
_MOST = 80  # number of references


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """Points every `STEP` along all ways.

    Attributes:
        points: (n, 2) [m].
        courses: Directions, (n,) [rad].
        owners: Index of each point's way, (n,); those of a way follow each other.
        speeds: (n,) [m/s].
    """

    points: Floats
    courses: Floats
    owners: Ints
    speeds: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Road:
    """Lanes beside each other that lead the same direction.

    Attributes:
        lanes: Middles from right to left, (m, 2) each [m].
        widths: One for each lane [m].
        speed: That most stay below [m/s].
    """

    lanes: tuple[Floats, ...]
    widths: tuple[float, ...]
    speed: float


def roads_of(ways: Ways) -> list[Road]:
    """Return the roads that ways tell; none where nobody moves."""
    if not len(ways.points):
        return []
    tree = cKDTree(ways.points)
    free = ~_crossing(ways)
    roads: list[Road] = []
    for _ in range(_MOST):
        reference = _longest(free, ways.owners)
        if len(reference) < _SHORTEST * _STATION:
            break
        found = list(_beside(ways, reference, tree))
        for road in found:
            free &= ~_explained(ways, road)
        free[reference] = False
        roads += found
    return roads


def _crossing(ways: Ways) -> Bools:
    """Return which points lie where other ways cross, or soon before or after that, (n,).

    Directions are told in `_SECTORS` of a turn, places in squares of `_NEAR`.
    """
    squares = np.floor(ways.points / _NEAR).astype(np.int64)
    keys = squares[:, 0] * _ROWS + squares[:, 1]
    known, own = np.unique(keys, return_inverse=True)
    sectors = np.floor(ways.courses % (2 * np.pi) / (2 * np.pi) * _SECTORS).astype(np.int64)
    sectors = np.minimum(sectors, _SECTORS - 1)
    driven = np.zeros(len(known), dtype=np.int64)
    np.bitwise_or.at(driven, own, 1 << sectors)
    around = driven.copy()
    for shift in (x * _ROWS + y for x in (-1, 0, 1) for y in (-1, 0, 1)):
        at = np.minimum(np.searchsorted(known, known + shift), len(known) - 1)
        around |= np.where(known[at] == known + shift, driven[at], 0)
    crossing = np.array(
        [
            sum(
                1 << other
                for other in range(_SECTORS)
                if min(abs(other - sector) % _ACROSS, _ACROSS - abs(other - sector) % _ACROSS) > 2
            )
            for sector in range(_SECTORS)
        ]
    )
    found: Bools = np.asarray((around[own] & crossing[sectors]) != 0)
    wide = found.copy()
    for shift in range(1, _CLEAR + 1):
        same = ways.owners[shift:] == ways.owners[:-shift]
        wide[shift:] |= found[:-shift] & same
        wide[:-shift] |= found[shift:] & same
    return wide


def _longest(free: Bools, owners: Ints) -> Ints:
    """Return the indices of the longest run of free points of one way."""
    breaks = np.flatnonzero(~(free[1:] & free[:-1] & (owners[1:] == owners[:-1]))) + 1
    starts, ends = np.concatenate([[0], breaks]), np.concatenate([breaks, [len(free)]])
    lengths = np.where(free[starts], ends - starts, 0)
    best = int(np.argmax(lengths))
    return np.arange(starts[best], starts[best] + lengths[best])


def _beside(ways: Ways, reference: Ints, tree: cKDTree) -> Iterator[Road]:
    """Yield the roads along a reference.

    Args:
        ways: All ways.
        reference: Indices of the points of one, in order.
        tree: Of all points.
    """
    line = gaussian_filter1d(ways.points[reference], 3.0, axis=0, mode="nearest")
    line = (
        line[::_STATION] if len(line) % _STATION == 1 else np.vstack([line[::_STATION], line[-1:]])
    )
    tangents = np.gradient(line, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-9)
    lanes = [
        _lanes_at(ways, place, tangent, tree) for place, tangent in zip(line, tangents, strict=True)
    ]
    for start, end, chains in _stretches(lanes):
        normals = np.column_stack([-tangents[start:end, 1], tangents[start:end, 0]])
        middles = tuple(line[start:end] + chain[:, None] * normals for chain in chains)
        inside = tree.query_ball_point(middles[0], _EXPLAINED)
        own = np.unique(np.concatenate([np.array(each, dtype=np.int64) for each in inside]))
        speed = float(np.quantile(ways.speeds[own], 0.85)) if len(own) else 0.0
        yield Road(middles, _widths(chains), speed)


def _lanes_at(ways: Ways, place: Floats, tangent: Floats, tree: cKDTree) -> Floats:
    """Return the offsets of lanes at a station, from right to left, that lead to the reference [m].

    Args:
        ways: All ways.
        place: The station, (2,) [m].
        tangent: Direction of the reference there, (2,).
        tree: Of all points.
    """
    near = np.array(tree.query_ball_point(place, _SIDE), dtype=np.int64)
    off = np.abs(_half_turn(ways.courses[near] - np.arctan2(tangent[1], tangent[0])))
    along = (ways.points[near] - place) @ tangent
    near = near[(off < _SAME) & (np.abs(along) < _ALONG)]
    sides = (ways.points[near] - place) @ np.array([-tangent[1], tangent[0]])
    # One offset for each way, and how many ways have it.
    _, first = np.unique(ways.owners[near], return_index=True)
    edges = np.arange(-_SIDE, _SIDE + _CELL, _CELL)
    counts, _ = np.histogram(sides[first], edges)
    density = gaussian_filter1d(counts.astype(float), _BLUR / _CELL)
    peaks, _ = find_peaks(density, distance=int(_LEAST / _CELL), height=density.max() * 0.08)
    offsets = (edges[peaks] + edges[peaks + 1]) / 2
    return _neighbours(offsets)


def _neighbours(offsets: Floats) -> Floats:
    """Return those offsets that no wide gap parts from the one next to 0 [m]."""
    if not len(offsets):
        return offsets
    groups: Ints = np.zeros(len(offsets), dtype=np.int64)
    groups[1:] = np.cumsum(np.diff(offsets) > _WIDEST)
    nearest = int(np.argmin(np.abs(offsets)))
    return np.asarray(offsets[groups == groups[nearest]])


def _stretches(lanes: Sequence[Floats]) -> Iterator[tuple[int, int, list[Floats]]]:
    """Yield stretches with the same lanes: first station, that after the last, offsets by lane."""
    start = 0
    for at in range(1, len(lanes) + 1):
        if at < len(lanes) and _leads_on(lanes[at - 1], lanes[at]):
            continue
        if at - start >= _SHORTEST and len(lanes[start]):
            offsets = np.array([*lanes[start:at]])
            smooth = gaussian_filter1d(offsets, 2.0, axis=0, mode="nearest")
            yield start, at, [*smooth.T]
        start = at


def _leads_on(before: Floats, after: Floats) -> bool:
    """Whether the lanes of two stations are the same."""
    return len(before) == len(after) and bool((np.abs(after - before) < _SHIFT).all())


def _widths(chains: Sequence[Floats]) -> tuple[float, ...]:
    """Return the width of each lane, by the distances to its neighbours [m]."""
    middles = np.array([float(np.median(chain)) for chain in chains])
    gaps = np.diff(middles)
    if not len(gaps):
        return (_USUAL,)
    usual = float(np.median(gaps))
    return (usual,) * len(middles)


def _explained(ways: Ways, road: Road) -> Bools:
    """Return which points lie in one of a road's lanes, (n,)."""
    middles = np.concatenate([_filled(lane) for lane in road.lanes])
    courses = np.concatenate([_courses(_filled(lane)) for lane in road.lanes])
    distances, nearest = cKDTree(middles).query(ways.points, distance_upper_bound=_EXPLAINED + 1.0)
    found = np.isfinite(distances)
    off = np.abs(_half_turn(ways.courses[found] - courses[np.asarray(nearest)[found]]))
    result = np.zeros(len(ways.points), dtype=np.bool_)
    result[found] = off < _SAME
    return result


def _filled(lane: Floats) -> Floats:
    """Return points about every metre of a lane, (k, 2) [m]."""
    count = max(int(np.linalg.norm(np.diff(lane, axis=0), axis=1).sum()), 2)
    at = np.linspace(0, len(lane) - 1, count)
    return np.column_stack([np.interp(at, np.arange(len(lane)), column) for column in lane.T])


def _courses(line: Floats) -> Floats:
    """Return the directions of a line at its points, (n,) [rad]."""
    tangents = np.gradient(line, axis=0)
    return np.asarray(np.arctan2(tangents[:, 1], tangents[:, 0]))


def _half_turn(angles: Floats) -> Floats:
    """Return angles within half a turn [rad]."""
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)
