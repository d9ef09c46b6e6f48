"""Closed rows of houses along a building line: where one ends and the next begins.

A building line runs with its land on the left. Neighbours share a party wall at a right
angle to the line; a house at a corner keeps its whole corner, with a wing on each side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.vectors import arc_length

_CORNER = np.radians(28.0)  # a sharper turn is a corner
_BEND = np.radians(4.0)  # a slighter turn is none
_JOINED = 9.0  # turns closer together belong to one corner [m]
_WING = 3.5  # what a corner house has beyond its neighbours' depth [m]
_CLEAR, _WALL = 0.5, 13.5  # distance of party walls from bends, and their length [m]
_USUAL, _LEAST = 15.5, 8.0  # widths of houses [m]
_SPREAD = 0.22  # of party walls around even ones, as a share of a width
_STEP = 2.0  # between tested points of a line [m]

Share = Callable[[Floats, str], float]
"""A number in [0, 1) for a place, (2,) [m], and a word."""


@dataclass(frozen=True, slots=True, eq=False)
class Lot:
    """The front of one house.

    Attributes:
        line: Its front, with the house on the left, (n, 2) [m].
        corner: Whether it stands at a corner.
        joined: Whether another lot begins where it begins, and where it ends.
    """

    line: Floats
    corner: bool
    joined: tuple[bool, bool] = (True, True)

    def plan(self, depth: float) -> Floats | None:
        """Return the counter-clockwise corners of a house, front walls first, or None without room.

        Args:
            depth: From the front to the back [m].
        """
        back = shapely.LineString(self.line).offset_curve(depth, join_style="mitre")
        if back.geom_type != "LineString" or back.is_empty:
            return None
        inner = shapely.get_coordinates(back)
        ends = self.line[[0, -1]]
        # Where a wing is shorter than the house is deep, the offset has lost its end.
        if np.abs(np.linalg.norm(inner[[0, -1]] - ends, axis=1) - depth).max() > 0.3:
            return None
        plan = np.concatenate([self.line, inner[::-1]])
        return plan if shapely.Polygon(plan).is_valid else None


def lots_along(
    line: Floats, fit: Callable[[Floats], Bools], *, depth: float, share: Share
) -> list[Lot]:
    """Divide a building line into lots.

    Args:
        line: (n, 2) [m], its land on the left; closed if its ends coincide.
        fit: Which places, (m, 2) [m], may bear a front.
        depth: Of houses at corners [m].
        share: Says where party walls stand around even places.

    Returns:
        Lots in order, without those that are narrower than a house.
    """
    line = _from_a_corner(settled(_straightened(line)))
    knots = arc_length(line)
    corners = _corners(line, knots, depth)
    lots: list[Lot] = []
    for begin, end in _runs(line, knots, fit):
        cuts = _cuts(line, knots, (begin, end), corners, share)
        for number, (a, b) in enumerate(pairwise(cuts)):
            corner = any(a < (low + high) / 2 < b for low, high in corners)
            lots.append(
                Lot(_piece(line, knots, a, b), corner, (number > 0, number < len(cuts) - 2))
            )
    return [lot for lot in lots if arc_length(lot.line)[-1] > _LEAST - 1.5]


def _cuts(
    line: Floats,
    knots: Floats,
    run: tuple[float, float],
    corners: Sequence[tuple[float, float]],
    share: Share,
) -> list[float]:
    """Choose where party walls stand along a run, its ends included [m]."""
    begin, end = run
    inside = [(a, b) for a, b in corners if a >= begin - 0.1 and b <= end + 0.1]
    # A corner at the end of a run has no room for its second wing.
    for a, b in corners:
        if (a, b) not in inside and b > begin and a < end:
            if a < begin:
                begin = min(b, end)
            else:
                end = max(a, begin)
    found = [begin]
    for low, high in [*inside, (end, end)]:
        found += _even(_at(line, knots, found[-1]), found[-1], low, share)
        found += [low, high] if high > low else []
    found.append(end)
    # A wall behind a bend to the left needs room, or backs would cross.
    room = _CLEAR + _WALL * np.tan(np.clip(_turns(line), 0.0, 1.2) / 2)
    cuts = [found[0]]
    for cut in found[1:]:
        near = np.flatnonzero(np.abs(knots[1:-1] - cut) < room)
        if len(near) and begin < cut < end:
            cut = float((knots[1:-1] + room)[near[0]])
        if cut > cuts[-1] + 0.5:
            cuts.append(cut)
    return cuts


def _even(place: Floats, low: float, high: float, share: Share) -> list[float]:
    """Space party walls about evenly between two others [m]."""
    count = max(round((high - low) / _USUAL), 1)
    width = (high - low) / count
    return [
        low + width * (k + _SPREAD * (2.0 * share(place, f"cut{k}") - 1.0)) for k in range(1, count)
    ]


def _runs(line: Floats, knots: Floats, fit: Callable[[Floats], Bools]) -> list[tuple[float, float]]:
    """Find the stretches on which fronts may stand, as distances along the line [m]."""
    count = max(int(knots[-1] / _STEP), 1) + 1
    at = np.linspace(0.0, knots[-1], count)
    good = np.concatenate([[False], fit(_at(line, knots, at)), [False]])
    begins, ends = np.flatnonzero(~good[:-1] & good[1:]), np.flatnonzero(good[:-1] & ~good[1:]) - 1
    pairs = zip(at[begins].tolist(), at[ends].tolist(), strict=True)
    return [(a, b) for a, b in pairs if b - a > _LEAST]


def _corners(line: Floats, knots: Floats, depth: float) -> list[tuple[float, float]]:
    """Find the stretches that corner houses take, wings included, in order and apart [m]."""
    turns = _turns(line)
    groups: list[list[int]] = []
    for k in np.flatnonzero(turns > _BEND).tolist():
        if groups and knots[k + 1] - knots[groups[-1][-1] + 1] < _JOINED:
            groups[-1].append(k)
        else:
            groups.append([k])
    found: list[tuple[float, float]] = []
    for group in groups:
        if turns[group].sum() < _CORNER:
            continue
        low, high = knots[group[0] + 1] - depth - _WING, knots[group[-1] + 1] + depth + _WING
        if found and low < found[-1][1]:  # two corners of a narrow block
            middle = (low + found[-1][1]) / 2
            found[-1], low = (found[-1][0], middle), middle
        found.append((max(float(low), 0.0), min(float(high), float(knots[-1]))))
    return [(a, b) for a, b in found if b > a]


def _from_a_corner(line: Floats) -> Floats:
    """Let a closed line begin in the middle of its longest side; leave an open one as it is."""
    if len(line) < 4 or np.linalg.norm(line[0] - line[-1]) > 1e-6:
        return line
    step = np.linalg.norm(np.diff(line, axis=0), axis=1)
    k = int(np.argmax(settled(step)))
    middle = (line[k] + line[k + 1]) / 2
    return np.concatenate([[middle], line[k + 1 : -1], line[: k + 1], [middle]])


def _straightened(line: Floats) -> Floats:
    """Drop bends of a line that are too slight to be seen, (m, 2)."""
    simple = shapely.get_coordinates(shapely.LineString(line).simplify(0.5))
    keep = np.append(True, np.linalg.norm(np.diff(simple, axis=0), axis=1) > 0.05)
    return np.asarray(simple[keep])


def _turns(line: Floats) -> Floats:
    """Return the turns to the left at the inner vertices, (n - 2,) [rad]."""
    step = np.diff(line, axis=0)
    angle = np.arctan2(step[:, 1], step[:, 0])
    return np.asarray((np.diff(angle) + np.pi) % (2 * np.pi) - np.pi)


def _at(line: Floats, knots: Floats, at: Floats | float) -> Floats:
    """Return the places at distances along a line, (m, 2) or (2,)."""
    return settled(np.stack([np.interp(at, knots, column) for column in line.T], axis=-1))


def _piece(line: Floats, knots: Floats, a: float, b: float) -> Floats:
    """Cut out the piece of a line between two distances along it, (n, 2)."""
    inner = line[(knots > a + 0.05) & (knots < b - 0.05)]
    return np.concatenate([_at(line, knots, a)[None], inner, _at(line, knots, b)[None]])
