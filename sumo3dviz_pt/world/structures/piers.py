"""Piers that carry bridges: round columns that keep off the roads below."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.walls import between
from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.world.roads.cells import STOREY
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.levels import heights_on, lowest_surface
from sumo3dviz_pt.world.structures.decks import THICKNESS, Deck

SPACING = 25.0
"""Distance of piers [m], about."""

RADIUS = 0.5
"""Of a column [m]."""

_OFF = 1.2
"""Distance of columns from roads below [m], at least."""

_LEAST = 2.5
"""Height of a column above the ground [m], at least."""

_APART = 9.0
"""Piers stand at least this far from each other [m]."""

_WIDE = 8.0
"""Roads wider than this [m] stand on two columns side by side."""

_SIDES = 16

HeightAt = Callable[[Floats], Floats]


def piers(layout: RoadLayout, decks: Sequence[Deck], height_at: HeightAt) -> Mesh:
    """Build the piers of all decks.

    Args:
        layout: The roads.
        decks: What stands on them.
        height_at: Height of the ground.
    """
    feet = [foot for deck in decks for foot in _feet(layout, deck, height_at)]
    return merge_meshes([_column(*foot) for foot in feet])


def _feet(layout: RoadLayout, deck: Deck, height_at: HeightAt) -> Iterator[tuple[Floats, float]]:
    """Feet of the columns of a deck, (3,) [m], and the heights of their tops [m]."""
    owners = sorted({layout.cells.owners[k] for k in deck.cells} & set(layout.strips))
    for owner in owners:
        strips = layout.strips[owner]
        right, left = strips[0].right, strips[-1].left
        if len(right) != len(left):
            right, left = strips[0].right, strips[0].left
        middle = 0.5 * (right + left)
        distance = arc_length(middle[:, :2])
        at = np.arange(0.5, distance[-1], 1.0)
        if not len(at):
            continue
        way = np.column_stack([np.interp(at, distance, middle[:, k]) for k in range(2)])
        over = np.asarray(shapely.intersects_xy(deck.area, way[:, 0], way[:, 1]))
        if not over.any():
            continue
        top = heights_on(layout, deck.level, way) - THICKNESS
        ground = height_at(way)
        free = over & (top - ground > _LEAST) & ~_above_roads(layout, way, top)
        across = np.stack([np.interp(at, distance, (left - right)[:, k]) for k in range(2)], axis=1)
        shares = (-0.28, 0.28) if np.linalg.norm(across, axis=1).max() > _WIDE else (0.0,)
        for k in _chosen(over & (top - ground > _LEAST), free):
            for share in shares:
                spot = way[k] + share * across[k]
                if not _above_roads(layout, spot[None], top[k : k + 1])[0]:
                    foot = float(height_at(spot[None])[0]) - 0.5
                    yield np.array([*spot, foot]), float(top[k]) + 0.1


def _above_roads(layout: RoadLayout, places: Floats, top: Floats) -> Bools:
    """Which places, (n, 2), lie above or close to lower roads, (n,)."""
    turn = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    around = (RADIUS + _OFF) * np.column_stack([np.cos(turn), np.sin(turn)])
    shifts = np.vstack([np.zeros((1, 2)), around])
    below = lowest_surface(layout, (places[:, None] + shifts).reshape(-1, 2))
    below = below.reshape(len(places), len(shifts))
    lower = np.isfinite(below) & (below < (top + THICKNESS - STOREY)[:, None])
    return np.asarray(lower.any(axis=1))


def _chosen(high: Bools, free: Bools) -> list[int]:
    """Where along an edge, at steps of 1 m, piers stand.

    They stand on both sides of what they must keep off, and evenly between.
    """
    if not high.any():
        return []
    chosen: list[int] = []
    blocked = high & ~free
    sides = np.flatnonzero(free & (np.roll(blocked, 1) | np.roll(blocked, -1)))
    first, last = int(np.flatnonzero(high)[0]), int(np.flatnonzero(high)[-1])
    spans = max(round((last - first) / SPACING), 1)
    even = np.linspace(first, last, spans + 1)[1:-1].round().astype(np.int64)
    for k in [*sides.tolist(), *even.tolist()]:
        if free[k] and all(abs(k - other) >= _APART for other in chosen):
            chosen.append(int(k))
    return chosen


def _column(foot: Floats, top: float) -> Mesh:
    """A round column."""
    turn = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    ring = foot + RADIUS * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    upper = np.column_stack([ring[:, :2], np.full(_SIDES, top)])
    return between(upper, ring, closed=True)
