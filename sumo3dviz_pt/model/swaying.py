"""How wind moves plants: a pure function of time, place, wind and chance.

Stems bend as beams that stand in the ground, boughs and twigs swing in waves that run through the
crown, and leaves flutter around their stalks. All frequencies are the plant's own; wind only
decides how far it moves, so wind that changes makes no jumps.

References:
    Moore and Maguire, "Natural sway frequencies and damping ratios of trees", Trees 18 (2004)
        195-203: the lowest frequency is linear in D / H^2; here about 0.08 + 3.1 D / H^2 Hz, with
        the trunk's diameter D in cm and the height H in m.
    James, "A study of branch dynamics on an open-grown tree", Arboriculture & Urban Forestry 40
        (2014) 125-134: boughs of trees that stand alone sway each by itself.
    de Langre, "Effects of wind on plants", Annual Review of Fluid Mechanics 40 (2008) 141-168:
        drag grows less than with the square of the speed, as plants give way (Vogel's exponent).
    Beaufort's scale (WMO-No. 8): from 1.6 m/s leaves rustle, from 3.4 m/s they and small twigs are
        in constant motion, from 5.5 m/s small branches move, from 8 m/s small trees sway.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, frozen, unit
from sumo3dviz_pt.model.weather import Wind

STRONGEST = 20.0
"""Wind that is stronger moves plants no further [m/s]."""

FARTHEST = 0.1
"""No place of a plant moves farther than this, by its height."""

_USUAL = 10.0  # speed that amplitudes are given for [m/s]
_GIVING_WAY = 1.3  # exponent of the speed: 2 less 0.7, as crowns give way
_LEAN, _GUST, _SWAY, _ACROSS = 0.010, 0.006, 0.006, 0.4  # of the stem's tip, by the height
_SLOW, _BEAM = 0.08, 3.1  # the stem's frequency [Hz], and that by D / H^2 [Hz m2/cm]
_SLENDER = 1.0  # trunks are as thick as a hundredth of their height [cm/m]
_SLOWEST, _FASTEST = 0.15, 3.0  # of stems and boughs [Hz]
_BOUGHS = np.array([1.6, 2.2, 3.0])  # frequencies of boughs, by the stem's
_TWIGS = np.array([2.2, 3.1])  # of twigs [Hz]
_SWINGS = np.array([0.0050, 0.0040, 0.0030, 0.0014, 0.0011])  # of boughs and twigs, by the height
_LENGTHS = np.array([0.36, 0.30, 0.24, 0.10, 0.08])  # of their waves, by the height
_WIDE = 0.3  # half width of a crown, by the height
_GUSTS = np.array([0.11, 0.23])  # of gusts [Hz]
_CARRIED = np.array([0.8, 0.6]) / 8.0  # how gusts pass over the land [s/m]
_FLUTTER = np.geomspace(2.0, 5.0, 8)  # of leaves [Hz]
_TURN, _BRISK = 0.30, 6.0  # how far leaves turn [rad], from which wind on [m/s]
_LEAF = 0.12  # larger cards turn less, so that their tips move no farther [m]
_WAVES = len(_SWINGS)


@dataclass(frozen=True, slots=True, eq=False)
class Swaying:
    """The plants of a mesh that wind moves, one after the other.

    Attributes:
        feet: Where they stand, (k, 3) [m].
        heights: (k,) [m].
        seeds: Of their chance, (k,).
        shares: How far they move, by what they would near a camera, (k,) in [0, 1].
        vertices: How many vertices each has, (k,).
        leaves: Whether they are leaves, fans of triangles around their first corners.
    """

    feet: Floats
    heights: Floats
    seeds: Ints
    shares: Floats
    vertices: Ints
    leaves: bool

    def __post_init__(self) -> None:
        """Freeze all arrays."""
        for name in ("feet", "heights", "shares"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        for name in ("seeds", "vertices"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class _Flutter:
    """How leaves turn around their stalks.

    Attributes:
        leaf: Number of each vertex's leaf, (n,).
        levers: Where vertices go by each radian, (n, 3) [m].
        turns: How normals turn by each radian, (n, 3); None without normals.
        phases: Of the leaves, (m,) [rad].
        kinds: Which of the frequencies each has, (m,).
        reach: How far each turns, by a small leaf, (m,).
    """

    leaf: Ints
    levers: Floats
    turns: Floats | None
    phases: Floats
    kinds: Ints
    reach: Floats


def strength_of(speed: float) -> float:
    """Return how far wind of a speed [m/s] moves plants, by what wind of 10 m/s does."""
    return float((min(speed, STRONGEST) / _USUAL) ** _GIVING_WAY)


class Sway:
    """A mesh of plants in wind.

    Args:
        mesh: At rest, in the network's coordinates.
        swaying: Its plants.
    """

    def __init__(self, mesh: Mesh, swaying: Swaying) -> None:
        self.mesh, self._plants = mesh, swaying
        self._chance = [np.random.default_rng(seed) for seed in swaying.seeds.tolist()]
        self._draw()
        ends = np.cumsum(swaying.vertices)
        self._pieces = [
            slice(end - n, end) for end, n in zip(ends, swaying.vertices.tolist(), strict=True)
        ]
        stalks = _first_corners(mesh) if swaying.leaves else np.arange(len(mesh.vertices))
        # A leaf goes where its stalk goes, and keeps its shape.
        self._modes = self._modes_of(mesh.vertices[stalks])
        self._flutter = self._flutter_of(stalks) if swaying.leaves else None

    def at(self, time: float, wind: Wind | None) -> tuple[Floats, Floats | None]:
        """Return vertices, (n, 3) [m], and unit normals, (n, 3) or None, at a time [s] in wind."""
        mesh = self.mesh
        if wind is None or wind.speed <= 0.0:
            return mesh.vertices, mesh.normals
        moves = self._moves(time, wind)
        vertices, normals = mesh.vertices.copy(), mesh.normals
        for piece, move in zip(self._pieces, moves, strict=True):
            vertices[piece] += np.einsum("vm,mc->vc", self._modes[piece], move)
        if self._flutter is not None:
            turned = self._turned(self._flutter, time, wind)[:, None]
            vertices += turned * self._flutter.levers
            if normals is not None and self._flutter.turns is not None:
                normals = unit(normals + turned * self._flutter.turns)
        return vertices, normals

    def _draw(self) -> None:
        """Draw what differs from plant to plant."""
        plants, count = self._plants, len(self._chance)
        drawn = np.array([chance.random(5 * _WAVES + 3) for chance in self._chance])
        drawn = drawn.reshape(count, -1)
        stem = _SLOW + _BEAM * _SLENDER / np.maximum(plants.heights, 0.5)
        own = 0.9 + 0.2 * drawn[:, : _WAVES + 1]
        stem = np.clip(stem * own[:, 0], _SLOWEST, _FASTEST)
        boughs = np.minimum(stem[:, None] * _BOUGHS, _FASTEST)
        swings = np.hstack([boughs, np.broadcast_to(_TWIGS, (count, len(_TWIGS)))]) * own[:, 1:]
        self._frequencies = np.hstack([stem[:, None], swings])  # (k, 1 + waves) [Hz]
        self._phases = 2 * np.pi * drawn[:, _WAVES + 1 : 2 * _WAVES + 3]  # stem twice, then waves
        rest = drawn[:, 2 * _WAVES + 3 :].reshape(count, _WAVES, 3)
        # Which way the waves run, and which way they swing: along the wind, across it, up.
        turn, up = 2 * np.pi * rest[..., 0], 1.6 * rest[..., 1] - 0.8
        level = np.sqrt(1.0 - up * up)
        ways = np.stack([level * np.cos(turn), level * np.sin(turn), up], axis=-1)
        lengths = np.maximum(_LENGTHS * plants.heights[:, None], 0.3)
        self._numbers = ways * (2 * np.pi / lengths)[..., None]  # (k, waves, 3) [rad/m]
        tilt = 2 * np.pi * rest[..., 2]
        swing = np.stack(
            [np.full_like(tilt, 0.75), 0.5 * np.cos(tilt), 0.6 * np.sin(tilt)], axis=-1
        )
        self._swings = unit(swing)

    def _modes_of(self, places: Floats) -> Floats:
        """Return how far places, (n, 3) [m], follow the stem and each wave, (n, 1 + 2 waves)."""
        modes = np.empty((len(places), 1 + 2 * _WAVES))
        plants = self._plants
        for number, piece in enumerate(self._pieces):
            height = plants.heights[number]
            away = places[piece] - plants.feet[number]
            up = np.clip(away[:, 2] / height, 0.0, 1.2)
            # A beam that is held at its foot; low places are held by the trunk.
            modes[piece, 0] = 0.5 * up * up * (3.0 - up)
            wide = np.hypot(away[:, 0], away[:, 1]) / (_WIDE * height)
            top = np.maximum(up - 0.6, 0.0) / 0.4
            free = np.clip(np.hypot(wide, top), 0.0, 1.0) ** 1.5 * np.clip(up / 0.15, 0.0, 1.0)
            phases = away @ self._numbers[number].T
            modes[piece, 1::2] = free[:, None] * np.cos(phases)
            modes[piece, 2::2] = free[:, None] * np.sin(phases)
        return modes

    def _flutter_of(self, stalks: Ints) -> _Flutter:
        """Draw how leaves flutter, by the first corner of each vertex's leaf, (n,)."""
        first, leaf = np.unique(stalks, return_inverse=True)
        mesh, vertices = self.mesh, self.mesh.vertices
        owner = np.searchsorted(np.cumsum(self._plants.vertices), first, side="right")
        counts = np.bincount(owner, minlength=len(self._chance)).tolist()
        drawn = np.concatenate(
            [chance.random((n, 4)) for chance, n in zip(self._chance, counts, strict=True)]
        )
        up, turn = 2.0 * drawn[:, 0] - 1.0, 2 * np.pi * drawn[:, 1]
        level = np.sqrt(1.0 - up * up)
        axes = np.column_stack([level * np.cos(turn), level * np.sin(turn), up])[leaf]
        out = vertices - vertices[stalks]
        sizes = np.zeros(len(first))
        np.maximum.at(sizes, leaf, np.linalg.norm(out, axis=1))
        reach = self._plants.shares[owner] * np.minimum(1.0, _LEAF / np.maximum(sizes, 1e-6))
        turns = None if mesh.normals is None else np.cross(axes, mesh.normals)
        phases, kinds = 2 * np.pi * drawn[:, 2], (len(_FLUTTER) * drawn[:, 3]).astype(np.int64)
        return _Flutter(leaf, np.cross(axes, out), turns, phases, kinds, reach)

    def _gusts(self, time: float, places: Floats) -> Floats:
        """Return how gusty it is at places, (n, 2 or 3) [m], in [-1, 1], (n,)."""
        late = places[:, :2] @ _CARRIED
        first, second = (np.sin(2 * np.pi * rate * (time - late) + rate) for rate in _GUSTS)
        return np.asarray(0.6 * first + 0.4 * second)

    def _moves(self, time: float, wind: Wind) -> Floats:
        """Return where each mode goes at a time [s], (k, 1 + 2 waves, 3) [m]."""
        plants = self._plants
        gust = self._gusts(time, plants.feet)
        far = strength_of(wind.speed) * plants.heights * plants.shares
        along, across = np.array([wind.east, wind.north, 0.0]) / wind.speed, np.zeros(3)
        across[:2] = -along[1], along[0]
        angles = 2 * np.pi * self._frequencies * time
        ahead, aside = (np.sin(angles[:, 0] + self._phases[:, k]) for k in (0, 1))
        lean = far * (_LEAN + _GUST * gust + _SWAY * ahead)
        moves = np.empty((len(far), 1 + 2 * _WAVES, 3))
        moves[:, 0] = lean[:, None] * along + (far * _SWAY * _ACROSS * aside)[:, None] * across
        ways = self._swings @ np.stack([along, across, np.array([0.0, 0.0, 1.0])])
        size = (far * (0.75 + 0.25 * gust))[:, None] * _SWINGS
        when = angles[:, 1:] + self._phases[:, 2:]
        moves[:, 1::2] = (size * np.sin(when))[..., None] * ways
        moves[:, 2::2] = (-size * np.cos(when))[..., None] * ways
        return moves

    def _turned(self, flutter: _Flutter, time: float, wind: Wind) -> Floats:
        """Return how far each vertex's leaf has turned at a time [s], (n,) [rad]."""
        most = _TURN * min(1.0, wind.speed / _BRISK)
        angles = (2 * np.pi * _FLUTTER * time)[flutter.kinds] + flutter.phases
        return np.asarray((most * flutter.reach * np.sin(angles))[flutter.leaf])


def _first_corners(mesh: Mesh) -> Ints:
    """Return the first corner of each vertex's leaf, (n,)."""
    first = np.arange(len(mesh.vertices))
    np.minimum.at(first, mesh.faces.ravel(), np.repeat(mesh.faces.min(axis=1), 3))
    return first
