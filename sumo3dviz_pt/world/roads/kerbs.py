"""Kerb stones, gutters, drains and tactile slabs near the camera.

The slabs are ribbed, and tell the blind where a crossing begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.bands import Band, mitres
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, arc_length
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.memory import digest_of
from sumo3dviz_pt.world.roads.cells import Polygons, heights_near
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT, Drops, rise_at
from sumo3dviz_pt.world.roads.layers import Base
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.markings.markings import lifted
from sumo3dviz_pt.world.roads.mesh import KERB_WIDTH, KerbRings
from sumo3dviz_pt.world.roads.strips import PAVING, distance_to
from sumo3dviz_pt.world.roads.wear.stains import patchy

_DEEP, _SLAB, _RIBS = 0.6, 0.3, 4
"""Depth of the strip, size of a slab [m], and ribs on each."""

_AFTER_KERB = 0.08
"""From the kerb stones to the slabs [m]."""

_TACTILE_LIFT, _STEP = 0.004, 0.1
"""Height above the paving, and distance at which the kerb is looked for [m]."""

_PALE: Colour = (0.55, 0.54, 0.50)
_GROOVE: Colour = (0.30, 0.295, 0.28)


def tactile_slabs(base: Base, drops: Drops) -> tuple[Mesh, Floats]:
    """Build slabs behind dropped kerbs, and the reflectance of their faces, (n, 3).

    Args:
        base: The roads.
        drops: Where kerbs are lowered.
    """
    layout = base.layout
    quads = [np.zeros((0, 4, 2))]
    tones = [np.zeros((0, 3))]
    footways = layout.memory.of(("footways",), lambda: shapely.STRtree(layout.raised))
    for k, name in enumerate(drops.names):
        near = footways.geometries[np.sort(footways.query(drops.ramps.geometries[k]))]
        made_of = ("tactile", name, digest_of(*near))
        slab = layout.memory.by_content.of(made_of, partial(_at_end, k, drops, near))
        quads.append(slab[0])
        tones.append(slab[1])
    flat = np.concatenate(quads).reshape(-1, 2)
    if not len(flat):
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)), np.zeros((0, 3))
    heights = heights_near(layout.cells, flat) + rise_at(drops, flat)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = (4 * np.arange(len(flat) // 4)[:, None, None] + halves).reshape(-1, 3)
    paving = [mesh for key, mesh in base.surfaces.items() if key == PAVING]
    mesh = lifted(
        np.column_stack([flat, heights]), faces, layout=layout, surface=paving, lift=_TACTILE_LIFT
    )
    return mesh, np.repeat(np.concatenate(tones), 2, axis=0)


def _at_end(k: int, drops: Drops, footways: Polygons) -> tuple[Floats, Floats]:
    """Ribs and grooves along one end of a crossing, (n, 4, 2) [m], and their tones, (n, 3).

    Args:
        k: Number of the end.
        drops: Where kerbs are lowered.
        footways: The footways near it, (n,).
    """
    area = shapely.union_all(footways)
    shapely.prepare(area)
    count = int(2.0 * drops.halves[k] / _SLAB)
    half = 0.5 * count * _SLAB
    marks = np.linspace(-half, half, count * 2 * _RIBS + 1)
    begins = _kerb_at(k, marks, drops, area)
    quads, tones = [], []
    for i in range(len(marks) - 1):
        ends = begins[i : i + 2]
        if not np.isfinite(ends).all() or abs(ends[1] - ends[0]) > 0.3:
            continue
        # Slabs have joints where a groove lies twice.
        for row in range(round(_DEEP / _SLAB)):
            near = ends + KERB_WIDTH + _AFTER_KERB + row * _SLAB + 0.004
            far = near + _SLAB - 0.008
            corners = [
                (near[0], marks[i]), (far[0], marks[i]),
                (far[1], marks[i + 1]), (near[1], marks[i + 1]),
            ]  # fmt: skip
            quad = drops.frame(k, np.array(corners))
            if area.contains(shapely.Polygon(quad)):
                quads.append(quad)
                tones.append(_GROOVE if i % 2 else _PALE)
    return np.array(quads).reshape(-1, 4, 2), np.array(tones).reshape(-1, 3)


def _kerb_at(k: int, marks: Floats, drops: Drops, area: shapely.Geometry) -> Floats:
    """How far ahead of a crossing's end its kerb lies at places across it; NaN without one."""
    ahead = np.arange(-2.0, 2.5, _STEP)
    grid = np.stack(np.meshgrid(marks, ahead, indexing="ij")[::-1], axis=-1)
    inside = shapely.contains_xy(area, *drops.frame(k, grid).reshape(-1, 2).T)
    inside = inside.reshape(len(marks), len(ahead))
    first = np.argmax(inside, axis=1)
    at = np.full(len(marks), np.nan)
    for i in np.flatnonzero(inside.any(axis=1) & (first > 0)):
        step = shapely.LineString(
            drops.frame(k, np.array([[ahead[first[i] - 1], marks[i]], [ahead[first[i]], marks[i]]]))
        )
        outside = step.difference(area).length
        at[i] = ahead[first[i] - 1] + outside
    return at


JOINT, STONE = "kerb_joint", "kerb_stone"
"""Materials of joints and of stones."""

_STONE, _GAP, _LIFT = 1.0, 0.009, 0.001
"""Length of a kerb stone, width of a joint, how far both lie before the kerb [m]."""

_GUTTER, _CHANNEL, _GUTTER_LIFT = 0.30, 0.5, 0.0028
"""Width of gutters, length of their stones, and how far they lie above the road [m]."""

_DRAINS = 19.0
"""Distance of drains [m]."""

_RUN = 16
"""Stones that are built together."""

_BARS = 7
_SETT, _SETT_GAP, _SETT_LIFT, _SETT_ROWS = 0.105, 0.014, 0.003, 3
"""Pitch of small stones, their joints, how far they lie above the paving [m]; their rows."""

_SETTS_FARTHEST = 45.0
"""Small stones are shown up to this distance from the camera's path [m]."""

_FARTHEST = 90.0
"""Kerbs farther from the camera's path [m] show none."""

_GRANITE: Colour = (0.43, 0.425, 0.41)
_CONCRETE: Colour = (0.215, 0.21, 0.2)
_BASALT: Colour = (0.17, 0.168, 0.165)
_IRON: Colour = (0.07, 0.068, 0.066)
_PIT: Colour = (0.008, 0.008, 0.008)


@dataclass(frozen=True, slots=True, eq=False)
class _Tinted:
    """Quads, (n, 4, 3) [m], and their reflectance, (n, 3)."""

    quads: Floats
    colours: Floats


def kerb_parts(base: Base, drops: Drops, rings: KerbRings) -> list[StaticPart]:
    """Build stones, joints, gutters, drains and tactile slabs; none without a focus.

    Args:
        base: The roads.
        drops: Where kerbs are lowered.
        rings: Where kerbs run.
    """
    if base.focus is None:
        return []
    # Build stones, joints and gutters along each ring near the camera.
    layout, keep = base.layout, base.layout.memory
    roads = shapely.STRtree(layout.cells.polygons[~layout.cells.raised])
    stones, joints, gutters = [_NONE], [np.zeros((0, 4, 3))], [_NONE]
    setts = [_NONE]
    for number, (foot, top) in enumerate(rings):
        if distance_to(base.focus, foot).min() >= _FARTHEST:
            continue
        lowered = drops.at(shapely.LinearRing(foot[:, :2]))
        ring = _Ring(f"kerb{number}", foot, top)
        bands = [ring.band(top, 0.0, KERB_WIDTH + _LIFT, lift=_LIFT), ring.face()]
        for side, band in enumerate(bands):
            for run in _near_runs(band, _STONE, base):
                name = ("kerb", number, lowered, side, run.first)
                stones.append(keep.of((*name, "stones"), partial(_stones, run, ring)))
                joints.append(keep.of((*name, "joints"), partial(_joints, run)))
        channel = ring.band(ring.foot, -_GUTTER, 0.0, lift=0.0)
        for run in _near_runs(channel, _CHANNEL, base):
            name = ("gutter", number, lowered, 0, run.first)
            gutters.append(keep.of(name, partial(_gutter, run, ring, roads)))
        setts.append(_setts(ring, base))
    # Join them into a few parts.
    paving = [mesh for key, mesh in base.surfaces.items() if key == PAVING]
    whole = _joined(stones)
    static = [
        _part("stones", STONE, _mesh(whole.quads), whole.colours),
        _laid("setts", _joined(setts), layout, surface=paving, lift=_SETT_LIFT),
        _laid("gutter", _joined(gutters), layout, surface=base.below, lift=_GUTTER_LIFT),
        _part("tactile", STONE, *tactile_slabs(base, drops)),
        StaticPart(f"road/joints/{JOINT}", "roads", Part(_mesh(np.concatenate(joints)), JOINT)),
    ]
    return [part for part in static if len(part.part.mesh.faces)]


def _laid(
    name: str, stones: _Tinted, layout: RoadLayout, *, surface: Sequence[Mesh], lift: float
) -> StaticPart:
    """Stones at a height [m] above the meshes that they lie on."""
    flat = _mesh(stones.quads)
    mesh = lifted(flat.vertices, flat.faces, layout=layout, surface=surface, lift=lift)
    return _part(name, STONE, mesh, stones.colours)


_NONE = _Tinted(np.zeros((0, 4, 3)), np.zeros((0, 3)))


@dataclass(frozen=True, slots=True, eq=False)
class _Ring:
    """A raised area's outline on the carriageway and on top, each (n, 3) [m]."""

    name: str
    foot: Floats
    top: Floats

    def band(self, ring: Floats, right: float, left: float, *, lift: float) -> Band:
        """Return a band beside the outline [m], closed."""
        across = np.column_stack([mitres(ring, closed=True), np.zeros(len(ring))])
        sides = [ring + side * across + [0.0, 0.0, lift] for side in (right - lift, left)]
        return _closed(sides[0], sides[1], ring)

    def face(self) -> Band:
        """Return the visible face, its foot to the right."""
        out = _LIFT * np.column_stack([mitres(self.foot, closed=True), np.zeros(len(self.foot))])
        return _closed(self.foot - out, self.top - out + [0.0, 0.0, _LIFT], self.top)


def _closed(right: Floats, left: Floats, ring: Floats) -> Band:
    """A band whose end is its beginning."""
    lines = [np.concatenate([line, line[:1]]) for line in (right, left, ring)]
    return Band(lines[0], lines[1], arc_length(lines[2][:, :2]) + 1e-9 * np.arange(len(lines[2])))


@dataclass(frozen=True, slots=True, eq=False)
class _StoneRun:
    """Some stones of a band, one after the other.

    Attributes:
        band: All of them.
        length: Of a stone, about [m].
        first: Number of the run's first stone.
    """

    band: Band
    length: float
    first: int

    @property
    def marks(self) -> Floats:
        """Where its stones begin along the band, and where the last one ends, (n + 1,) [m]."""
        return _marks(self.band, self.length)[self.first : self.first + _RUN + 1]

    def pieces(self) -> list[tuple[int, Floats]]:
        """Numbers of stones, and quads of each, with gaps between them."""
        pairs = enumerate(pairwise(self.marks.tolist()), start=self.first)
        return [(k, self.band.quads(a + 0.5 * _GAP, b - 0.5 * _GAP)) for k, (a, b) in pairs]


def _marks(band: Band, length: float) -> Floats:
    """Where stones of about a length begin and end along a band, (n,) [m]."""
    end = float(band.stations[-1])
    return np.linspace(0.0, end, max(1, round(end / length)) + 1)


def _near_runs(band: Band, length: float, base: Base) -> list[_StoneRun]:
    """Runs of stones of which one lies near the camera."""
    marks = _marks(band, length)
    middles = 0.5 * (marks[1:] + marks[:-1])
    line = 0.5 * (band.right + band.left)
    at = np.stack([np.interp(middles, band.stations, c) for c in line.T[:2]], axis=1)
    near = np.flatnonzero(distance_to(base.focus, at) < _FARTHEST)
    return [_StoneRun(band, length, first) for first in np.unique(near // _RUN * _RUN).tolist()]


def _stones(run: _StoneRun, ring: _Ring) -> _Tinted:
    """Kerb stones, each of its own tone."""
    pieces = run.pieces()
    return _joined([_toned(quads, _GRANITE, f"{ring.name}:{k}") for k, quads in pieces])


def _toned(quads: Floats, colour: Colour, name: str) -> _Tinted:
    """Quads of one stone."""
    tone = 0.84 + 0.26 * share_of(0, "stone", name)
    tone *= 0.78 if share_of(0, "scuffed", name) < 0.07 else 1.0
    warm = 0.03 * share_of(0, "hue", name) - 0.015
    reflectance = tone * np.array(colour) * [1.0 + warm, 1.0, 1.0 - warm]
    return _Tinted(quads, np.tile(np.minimum(reflectance, 0.85), (len(quads), 1)))


def _joints(run: _StoneRun) -> Floats:
    """What lies after each stone but a band's last one, (n, 4, 3) [m]."""
    ends = run.marks[1:]
    inner = ends[ends < run.band.stations[-1] - 0.5 * run.length]
    # A band gives no quads shorter than 2 cm; a joint is cut out of one.
    cut = [_slimmed(run.band.quads(at - 0.012, at + 0.012)) for at in inner.tolist()]
    return np.concatenate([np.zeros((0, 4, 3)), *cut])


def _slimmed(quads: Floats) -> Floats:
    """The middle of a single quad of 24 mm, as wide as a joint; bends get none."""
    if len(quads) != 1:
        return np.zeros((0, 4, 3))
    right, left = (quads[0, pair].mean(axis=0) for pair in ([0, 1], [3, 2]))
    share = 0.5 * _GAP / 0.024
    ahead = [share * (quads[0, b] - quads[0, a]) for a, b in ((0, 1), (3, 2))]
    return np.array([[right - ahead[0], right + ahead[0], left + ahead[1], left - ahead[1]]])


def _gutter(run: _StoneRun, ring: _Ring, roads: shapely.STRtree) -> _Tinted:
    """Channel stones where a carriageway lies beside the kerb, with drains among them."""
    shift = _DRAINS * share_of(0, "drains", ring.name)
    parts = []
    for k, quads in run.pieces():
        spots = shapely.points(quads.mean(axis=1)[:, :2])
        beside = np.unique(roads.query(spots, predicate="within")[0])
        if len(beside) < max(len(quads), 1):
            continue
        # One drain in every `_DRAINS` metres.
        if (shift + k * _CHANNEL) % _DRAINS < _CHANNEL and len(quads) == 1:
            parts.append(_drain(quads[0]))
        else:
            parts.append(_toned(quads, _CONCRETE, f"{ring.name}:gutter:{k}"))
    return _joined(parts)


def _setts(ring: _Ring, base: Base) -> _Tinted:
    """Rows of small stones behind the kerb, where it is whole."""
    parts = []
    for row in range(_SETT_ROWS):
        right = KERB_WIDTH + 0.012 + row * _SETT
        band = ring.band(ring.top, right, right + _SETT - _SETT_GAP, lift=0.0)
        count = max(1, round(float(band.stations[-1]) / _SETT))
        # Every row begins elsewhere: joints do not line up.
        marks = (np.arange(count) + 0.5 * (row % 2)) * band.stations[-1] / count
        at = np.stack([marks, marks + _SETT - _SETT_GAP])
        sides = [
            np.stack([np.interp(at, band.stations, c) for c in line.T], axis=-1)
            for line in (band.right, band.left)
        ]
        (a, b), (d, c) = sides
        quads = np.stack([a, b, c, d], axis=1)[marks < band.stations[-1] - _SETT]
        rise = np.interp(marks, band.stations, np.append(ring.top[:, 2], ring.top[0, 2]))
        rise -= np.interp(marks, band.stations, np.append(ring.foot[:, 2], ring.foot[0, 2]))
        whole = rise[marks < band.stations[-1] - _SETT] > SIDEWALK_HEIGHT - 1e-3
        near = distance_to(base.focus, quads.mean(axis=1)) < _SETTS_FARTHEST
        quads = quads[whole & near]
        grain = patchy(100.0 * quads.mean(axis=1), 7.0, salt=row)
        tone = 1.0 + 0.28 * grain + 0.1 * patchy(quads.mean(axis=1), 2.0, salt=7)
        parts.append(_Tinted(quads, tone[:, None] * np.array(_BASALT)))
    return _joined(parts)


def _drain(quad: Floats) -> _Tinted:
    """A grate of bars across the gutter in its iron frame, side by side without overlap."""
    marks = np.concatenate([[0.0], np.linspace(0.06, 0.94, 2 * _BARS), [1.0]])
    right = quad[0] + marks[:, None] * (quad[1] - quad[0])
    left = quad[3] + marks[:, None] * (quad[2] - quad[3])
    quads = np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)
    colours = np.where((np.arange(len(quads)) % 2 == 0)[:, None], _IRON, _PIT)
    return _Tinted(quads, colours)


def _joined(pieces: list[_Tinted]) -> _Tinted:
    """Several as one, without quads that sharp corners have folded over."""
    quads = np.concatenate([np.zeros((0, 4, 3)), *(piece.quads for piece in pieces)])
    colours = np.concatenate([np.zeros((0, 3)), *(piece.colours for piece in pieces)])
    halves = quads[:, [[0, 1, 2], [0, 2, 3]], :2]
    first, second = halves[:, :, 1] - halves[:, :, 0], halves[:, :, 2] - halves[:, :, 0]
    up = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0] > -1e-6
    return _Tinted(quads[up.all(axis=1)], colours[up.all(axis=1)])


def _mesh(quads: Floats) -> Mesh:
    """Two triangles of each quad."""
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = 4 * np.arange(len(quads))[:, None, None] + halves
    return Mesh(quads.reshape(-1, 3), faces.reshape(-1, 3))


def _part(name: str, material: str, mesh: Mesh, colours: Floats) -> StaticPart:
    """A part whose colours are given by quad, or by face."""
    tint = colours if len(colours) == len(mesh.faces) else np.repeat(colours, 2, axis=0)
    return StaticPart(f"road/{name}/{material}", "roads", Part(mesh, material, tint))
