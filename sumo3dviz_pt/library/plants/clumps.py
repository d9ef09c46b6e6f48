"""Which leaves of a crown an eye sees, and all others as fewer, larger ones.

Most leaves of a crown hide behind others. What a shot's cameras never see of it only casts and
reflects light, for which clumps of the same area and colour do as well. Whether a leaf is
seen is found in whole numbers, so that it is the same on every processor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.library.plants.leaves import cards_of
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, settled
from sumo3dviz_pt.model.vectors import areas, unit

STEPS = 72
"""Directions of eyes around a plant."""

_GRAIN = 1e-4  # of places [m]
_TURN = 1024  # what a direction's numbers are multiples of one by
_CELL = 0.4  # of the grid on which leaves hide each other, by a usual leaf's size
_BEHIND = 0.5  # of a cell: leaves this much farther than the nearest are still seen

# Ten places of a triangle, by the weights of its corners.
_PLACES = np.array(
    [[3 * i + 1, 3 * j + 1, 10 - 3 * (i + j)] for i in range(4) for j in range(4 - i)]
)
_WEIGHT = 12


class Clumping(NamedTuple):
    """How leaves become fewer, larger ones.

    Attributes:
        each: How many become one.
        inwards: How far it moves into the crown, by the root of its area.
    """

    each: int
    inwards: float


PAIRS = Clumping(2, 0.0)
"""Of leaves that are seen a little."""

HIDDEN = tuple(Clumping(each, 0.6) for each in (1, 8, 12, 12, 8, 6))
"""Of leaves that no camera sees, by level of detail: far crowns have large leaves already."""


class Direction(NamedTuple):
    """Where an eye is, seen from a plant, in steps of a circle.

    Attributes:
        around: Counterclockwise from the plant's x axis, in [0, STEPS).
        up: Above the horizon, in [-STEPS / 4, STEPS / 4].
    """

    around: int
    up: int


def directions(towards: Floats) -> list[Direction]:
    """Return the directions of vectors, (n, 3), each once, sorted."""
    step = 2.0 * np.pi / STEPS
    around = np.rint(np.arctan2(towards[:, 1], towards[:, 0]) / step).astype(np.int64) % STEPS
    up = np.rint(np.arctan2(towards[:, 2], np.hypot(*towards[:, :2].T)) / step).astype(np.int64)
    found = np.unique(np.column_stack([around, up]), axis=0)
    return [Direction(int(a), int(b)) for a, b in found]


def seen_shares(mesh: Mesh, direction: Direction) -> Floats:
    """Return which share of each leaf a far eye sees between the others, (n,) in [0, 1].

    Args:
        mesh: Single triangles of their own corners.
        direction: Of the eye.
    """
    corners = np.rint(mesh.vertices[mesh.faces] / _GRAIN).astype(np.int64)
    places = (_PLACES @ corners) // _WEIGHT
    towards, aside, upwards = _axes(direction)
    size = settled(np.sqrt(np.median(areas(mesh.vertices, mesh.faces))))
    cell = max(int(_CELL * size / _GRAIN), 1) * _TURN
    # Find the nearest place in each cell of the grid that the eye looks through.
    across, down, away = (places @ aside) // cell, (places @ upwards) // cell, -(places @ towards)
    down -= down.min()
    number = (across - across.min()) * (down.max() + 1) + down
    nearest = np.full(number.max() + 1, np.iinfo(np.int64).max)
    np.minimum.at(nearest, number.ravel(), away.ravel())
    seen = away <= nearest[number] + int(_BEHIND * cell)
    return np.asarray(seen.mean(axis=1))


def _axes(direction: Direction) -> tuple[Ints, Ints, Ints]:
    """Return vectors towards an eye, to its right and up, each (3,), in whole numbers."""
    angles = 2.0 * np.pi / STEPS * np.array(direction)
    (c, d), (s, t) = (np.rint(_TURN * f(angles)).astype(np.int64) for f in (np.cos, np.sin))
    towards = np.array([c * d // _TURN, s * d // _TURN, t])
    upwards = np.array([-c * t // _TURN, -s * t // _TURN, d])
    return towards, np.array([-s, c, 0]), upwards


def clumped(mesh: Mesh, tint: Floats, way: Clumping) -> tuple[Mesh, Floats]:
    """Make fewer, larger leaves; neighbours become one of their area and mean colour.

    Args:
        mesh: Single triangles of their own corners, with normals.
        tint: Of each face, (n, 3).
        way: How many become one.
    """
    cards = cards_of(mesh, tint)
    order = _along_curve(cards.centres)
    first = np.arange(0, len(order), way.each)
    total = np.add.reduceat(cards.areas[order], first)
    weight = (cards.areas / np.repeat(total, way.each)[np.argsort(order, kind="stable")])[:, None]
    centre, colour, light = (
        np.add.reduceat((weight * values)[order], first)
        for values in (cards.centres, tint, cards.normals)
    )
    # They grow inwards, so that the crown keeps its outline.
    light = unit(light + 0.1 * cards.normals[order[first]])
    size = np.sqrt(total)[:, None]
    inward = cards.centres.mean(axis=0) - centre
    away = np.linalg.norm(inward, axis=1, keepdims=True)
    centre = centre + np.minimum(way.inwards * size / np.maximum(away, 1e-9), 0.5) * inward
    along, across = _plane(cards.along[order[first]], cards.across[order[first]])
    corners = centre[:, None] + size[:, None] * _shape(along, across)
    count = len(first)
    faces = np.arange(3 * count).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), faces, np.repeat(light, 3, axis=0)), colour


def _plane(along: Floats, across: Floats) -> tuple[Floats, Floats]:
    """Return unit vectors at right angles in the plane of leaves, (n, 3) each."""
    first = unit(along)
    return first, unit(across - (across * first).sum(axis=1, keepdims=True) * first)


def _shape(along: Floats, across: Floats) -> Floats:
    """Return the corners of triangles with equal sides and an area of one, (n, 3, 3)."""
    edge = np.sqrt(4.0 / np.sqrt(3.0))
    high, half = edge * np.sqrt(0.75), 0.5 * edge
    low = -high / 3.0 * along
    return np.stack([low - half * across, low + half * across, 2.0 * high / 3.0 * along], axis=1)


def some_leaves(mesh: Mesh, keep: Bools) -> Mesh:
    """Return some of the leaves of a mesh of single triangles of their own corners."""
    index = mesh.faces[keep].ravel()
    normals = None if mesh.normals is None else mesh.normals[index]
    return Mesh(mesh.vertices[index], np.arange(len(index)).reshape(-1, 3), normals)


def _along_curve(places: Floats) -> Ints:
    """Return an order of places, (n, 3), in which neighbours follow each other."""
    whole = np.rint(places / _GRAIN).astype(np.int64)
    whole -= whole.min(axis=0)
    # 64 cells a side, their numbers' bits interleaved.
    cells = whole * 64 // (whole.max() + 1)
    number = np.zeros(len(places), dtype=np.int64)
    for bit in range(6):
        for axis in range(3):
            number |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(number, kind="stable")
