"""Leaves of crowns: real outlines near an eye, fewer and larger ones elsewhere.

Cards of foliage stand for many leaves, and from near they would show as such. So each card within
reach becomes a twig of leaves as large as real ones, of the same area, colour and light.

Most leaves of a crown hide behind others. What a shot's cameras never see of it only casts and
reflects light, for which clumps of the same area and colour do as well. Whether a leaf is seen is
found in whole numbers, so that it is the same on every processor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import (
    Bools,
    Floats,
    Ints,
    Mesh,
    areas,
    merge_meshes,
    settled,
    unit,
)

LEAF = 0.085
"""Length of a leaf [m]."""

OUTLINE = 12.0
"""Up to this distance leaves have an outline of six triangles, beyond they are diamonds [m]."""

_SHARP = 10.0  # from this distance on leaves grow with it, as pixels do [m]
_MOST = 14  # leaves of one card
_NEEDLE = 3.2  # cards this many times longer than wide bear needles
_ASIDE = 0.62  # how far leaves lie from their twig, by half the card's width

_HALF_WIDTH = 0.39  # of a leaf, by its length

# Half outlines from stalk to tip: along and across, by a leaf's length and half width.
_OVATE = np.array([[-0.5, 0.0], [-0.33, 0.78], [-0.02, 1.0], [0.27, 0.62], [0.5, 0.0]])
_DIAMOND = np.array([[-0.5, 0.0], [-0.05, 1.0], [0.5, 0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Cards:
    """Cards of a crown.

    Attributes:
        centres: (n, 3) [m].
        along: From stalk to tip, (n, 3) [m].
        across: From side to side, (n, 3) [m].
        areas: (n,) [m2].
        normals: That light sees, (n, 3).
        tints: (n, 3).
        each: Triangles of a card: 1, or 2 for folded ones.
    """

    centres: Floats
    along: Floats
    across: Floats
    areas: Floats
    normals: Floats
    tints: Floats
    each: int


def cards_of(mesh: Mesh, tint: Floats) -> Cards:
    """Find the cards in foliage as `foliage.foliage` makes it.

    Args:
        mesh: Triangles of their own corners, or diamonds of four corners and two triangles.
        tint: Of each face, (m, 3).
    """
    each = 2 if len(mesh.vertices) == 2 * len(mesh.faces) else 1
    corners = mesh.vertices.reshape(-1, 2 + each, 3)
    if each == 2:
        along, across = corners[:, 2] - corners[:, 0], corners[:, 1] - corners[:, 3]
    else:
        along = corners[:, 2] - 0.5 * (corners[:, 0] + corners[:, 1])
        across = corners[:, 1] - corners[:, 0]
    areas = 0.5 * np.linalg.norm(np.cross(along, across), axis=1)
    normals = np.zeros_like(mesh.vertices) if mesh.normals is None else mesh.normals
    light = normals.reshape(-1, 2 + each, 3).mean(axis=1)
    return Cards(corners.mean(axis=1), along, across, areas, light, tint[::each], each)


def wanted(cards: Cards, away: Floats) -> Ints:
    """Count the leaves that each card should be for an eye at a distance, (n,); 0 keeps the card.

    Args:
        cards: The cards.
        away: Distances, (n,) [m].
    """
    size = LEAF * np.maximum(away / _SHARP, 1.0)
    count = np.clip(np.round(cards.areas / (0.5 * size**2)), 1, _MOST)
    long, wide = np.linalg.norm(cards.along, axis=1), np.linalg.norm(cards.across, axis=1)
    coarse = (count > 1) | (away < OUTLINE)
    return np.where(coarse & (long < _NEEDLE * wide), count, 0).astype(np.int64)


def triangles(counts: Ints, away: Floats) -> Ints:
    """Count the triangles of cards that become leaves, (n,)."""
    return np.asarray(counts * np.where(away < OUTLINE, 6, 2))


def with_leaves(
    mesh: Mesh, tint: Floats, counts: Ints, *, outlined: Bools, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """Exchange some cards of foliage for leaves.

    Args:
        mesh: As for `cards_of`.
        tint: Of each face, (m, 3).
        counts: Leaves of each card, (n,); 0 keeps the card.
        outlined: Which cards get leaves with a full outline, (n,).
        rng: Places and turns them.
    """
    cards = cards_of(mesh, tint)
    stays = np.repeat(counts == 0, cards.each)
    used, faces = np.unique(mesh.faces[stays], return_inverse=True)
    normals = None if mesh.normals is None else mesh.normals[used]
    meshes = [Mesh(mesh.vertices[used], faces.reshape(-1, 3), normals)]
    tints = [tint[stays]]
    for half, some in ((_OVATE, outlined), (_DIAMOND, ~outlined)):
        which = np.repeat(np.flatnonzero(some), counts[some])
        if not len(which):
            continue
        made = _leaves(cards, which, counts, half, rng)
        meshes.append(made)
        value = rng.uniform(0.86, 1.14, (len(which), 1))
        per_leaf = len(made.faces) // len(which)
        tints.append(np.repeat(np.clip(cards.tints[which] * value, 0.004, 0.8), per_leaf, axis=0))
    return merge_meshes(meshes), np.concatenate(tints)


def _leaves(
    cards: Cards, which: Ints, counts: Ints, half: Floats, rng: np.random.Generator
) -> Mesh:
    """Build leaves on both sides of their cards' middles; together as large as the card."""
    total = len(which)
    along, across = cards.along[which], cards.across[which]
    long = np.linalg.norm(along, axis=1, keepdims=True)
    wide = np.linalg.norm(across, axis=1, keepdims=True)
    share = rng.uniform(-0.5, 0.5, (total, 1))
    side = np.where(rng.random((total, 1)) < 0.5, -1.0, 1.0)
    ahead = rng.uniform(0.1, 1.0, (total, 1)) * along / np.maximum(long, 1e-9)
    aside = rng.uniform(0.3, 1.0, (total, 1)) * side * across / np.maximum(wide, 1e-9)
    axis = unit(unit(ahead + aside) + rng.normal(0, 0.38, (total, 3)))
    up = unit(cards.normals[which] + rng.normal(0, 0.45, (total, 3)))
    flat = unit(np.cross(axis, up))
    # Area of an outline by its squared length.
    fill = 2.0 * _HALF_WIDTH * float(np.trapezoid(half[:, 1], half[:, 0]))
    size = np.sqrt(cards.areas[which] / counts[which] / fill) * rng.uniform(0.8, 1.2, total)
    twig = (counts[which] > 1)[:, None]
    centre = cards.centres[which] + twig * (share * along + 0.5 * _ASIDE * side * across)
    centre = centre + twig * rng.normal(0, 0.2, (total, 3)) * wide
    tall, broad = size[:, None] * axis, _HALF_WIDTH * size[:, None] * flat
    fold = 0.16 * size[:, None] * up
    rim = [centre + u * tall + s * v * broad + v * fold for s, u, v in _rim(half)]
    corners = np.stack(rim, axis=1)
    n, mid = len(rim), len(half) - 1
    rib = [[0, k, k + 1] for k in range(1, mid)]
    other = [0, *range(n - 1, mid - 1, -1)]
    faces = rib + [[other[0], other[k + 1], other[k]] for k in range(1, len(other) - 1)]
    index = n * np.arange(total)[:, None, None] + np.array(faces)
    light = unit(0.55 * up + 0.45 * cards.normals[which])
    return Mesh(corners.reshape(-1, 3), index.reshape(-1, 3), np.repeat(light, n, axis=0))


def _rim(half: Floats) -> list[tuple[float, float, float]]:
    """Return side, along and across of all corners: from the stalk over one side, the tip, back."""
    first = [(1.0, float(u), float(v)) for u, v in half]
    return first + [(-1.0, float(u), float(v)) for u, v in half[-2:0:-1]]


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
    pairs = np.unique(np.column_stack([around, up]), axis=0)
    return [Direction(int(a), int(b)) for a, b in pairs]


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
