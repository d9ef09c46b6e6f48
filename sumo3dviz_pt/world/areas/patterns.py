"""What is drawn on areas: bays of car parks, lines of pitches, tracks in fields, paths in parks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import common, polygon_parts
from sumo3dviz_pt.model.geometry import Colour, Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.world.areas.covers import Area

WHITE: Colour = (0.52, 0.52, 0.50)
"""Reflectance of lines that are no road markings."""

_BAY, _DEEP, _AISLE, _LINE = 2.5, 5.0, 6.0, 0.10  # of bays, their depth, lanes and lines [m]
_TRACK: Colour = (0.105, 0.085, 0.058)
_PATH: Colour = (0.25, 0.225, 0.185)
_LEAVES: Colour = (0.050, 0.085, 0.022)
_SOIL: Colour = (0.125, 0.092, 0.060)
_MOST_ROWS = 160  # strips of drilled crops on a field, at most


@dataclass(frozen=True, slots=True, eq=False)
class PatternShapes:
    """Shapes that lie on an area, of one colour.

    Attributes:
        shapes: In plan [m].
        colour: Mean linear reflectance.
        surface: A surface's name; None for plain paint.
        height: Of blocks that stand on it [m]; 0 for what lies flat.
        trodden: Whether it is a path, on which nothing grows.
    """

    shapes: tuple[shapely.Geometry, ...]
    colour: Colour
    surface: str | None = None
    height: float = 0.0
    trodden: bool = False


class _PatternLook(NamedTuple):
    """A share of chance in [0, 1), and the area's reflectance."""

    chance: float
    colour: Colour


@dataclass(frozen=True, slots=True, eq=False)
class _Rectangle:
    """The smallest upright or turned rectangle around a shape.

    Attributes:
        corner: (2,) [m].
        along: Unit vector of its long side, (2,).
        across: Unit vector of its short side, (2,).
        length: Of its long side [m].
        width: Of its short side [m].
    """

    corner: Floats
    along: Floats
    across: Floats
    length: float
    width: float

    def box(self, u0: float, v0: float, u1: float, v1: float) -> shapely.Polygon:
        """Return a rectangle between two corners, given along and across [m]."""
        ends = ((u0, v0), (u1, v0), (u1, v1), (u0, v1))
        return shapely.Polygon([self.at(u, v) for u, v in ends])

    def at(self, u: float, v: float) -> Floats:
        """Return a point by its distances along and across [m]."""
        return np.asarray(self.corner + u * self.along + v * self.across)


def drawn_on(
    pattern: str, area: Area, shape: shapely.Geometry, *, seed: int
) -> list[PatternShapes]:
    """Return what is drawn on an area.

    Args:
        pattern: A cover's.
        area: Its name and colour count.
        shape: What is seen of the area [m].
        seed: Of all chance.
    """
    drawn: list[PatternShapes] = []
    for number, part in enumerate(polygon_parts(shape)):
        frame = _frame(part)
        if frame is not None:
            chance = share_of(seed, "pattern", area.id, str(number))
            drawn += _PATTERNS[pattern](part, frame, _PatternLook(chance, area.colour or _SOIL))
    return [some for some in drawn if some.shapes]


def _frame(part: shapely.Polygon) -> _Rectangle | None:
    """The rectangle around a polygon, or None for one without width."""
    ring = shapely.get_coordinates(shapely.minimum_rotated_rectangle(part))
    if len(ring) < 5:
        return None
    one, other = ring[1] - ring[0], ring[3] - ring[0]
    if np.hypot(*one) < np.hypot(*other):
        one, other = other, one
    length, width = float(np.hypot(*one)), float(np.hypot(*other))
    if width < 1.0:
        return None
    return _Rectangle(ring[0], one / length, other / width, length, width)


def _within(part: shapely.Polygon, shapes: Sequence[shapely.Polygon]) -> list[shapely.Polygon]:
    """Shapes that lie inside a polygon."""
    shapely.prepare(part)
    inside = shapely.covers(part, list(shapes)) if shapes else []
    return [shape for shape, stays in zip(shapes, inside, strict=True) if stays]


def _clipped(
    part: shapely.Polygon, shapes: Sequence[shapely.Geometry]
) -> tuple[shapely.Geometry, ...]:
    """What of shapes lies inside a polygon."""
    cut = (common(shape, part) for shape in shapes)
    return tuple(shape for shape in cut if not shape.is_empty)


def _bays(part: shapely.Polygon, frame: _Rectangle, look: _PatternLook) -> list[PatternShapes]:
    """Rows of bays with lanes between them."""
    lines: list[shapely.Polygon] = []
    rim, v = 0.3, 0.3
    deep = min(_DEEP, frame.width - 2 * rim)
    if deep < 4.2:
        return []
    row = 0
    while v + deep <= frame.width - rim + 1e-6:
        count = int((frame.length - 2 * rim) / _BAY)
        start = 0.5 * (frame.length - count * _BAY)
        bays = [
            frame.box(start + k * _BAY, v, start + (k + 1) * _BAY, v + deep) for k in range(count)
        ]
        shapely.prepare(part)
        inside = shapely.covers(part, bays) if bays else np.zeros(0, dtype=np.bool_)
        for k in range(count + 1):
            beside = (k < count and inside[k]) or (k > 0 and inside[k - 1])
            if beside:
                u = start + k * _BAY
                lines.append(frame.box(u - _LINE / 2, v, u + _LINE / 2, v + deep))
        # A lane lies between every two rows: bay, lane, bay, bay, lane, bay.
        v += deep + (_AISLE if row % 2 == 0 else 0.0)
        row += 1
    return [PatternShapes(_clipped(part, lines), WHITE)]


def _ring(
    frame: _Rectangle, u: tuple[float, float], v: tuple[float, float], wide: float
) -> shapely.Geometry:
    """A frame of lines around a rectangle."""
    outer = frame.box(u[0], v[0], u[1], v[1])
    inner = frame.box(u[0] + wide, v[0] + wide, u[1] - wide, v[1] - wide)
    return shapely.difference(outer, inner)


def _pitch(part: shapely.Polygon, frame: _Rectangle, look: _PatternLook) -> list[PatternShapes]:
    """Lines of a football pitch in stripes of mown grass, or of a small court."""
    if frame.length < 30.0 or frame.width < 18.0:
        return _court(part, frame, look)
    # Stripes that the mower leaves.
    width = 5.5
    stripes = [
        frame.box(u, 0.0, min(u + width, frame.length), frame.width)
        for u in np.arange(0.0, frame.length, 2.0 * width)
    ]
    drawn = [PatternShapes(_clipped(part, stripes), (0.068, 0.124, 0.031), "ground_grass")]
    rim = 2.0
    length, wide = frame.length - 2 * rim, frame.width - 2 * rim
    field = frame.box(rim, rim, rim + length, rim + wide)
    if length < 45.0 or not shapely.covers(part.buffer(0.5), field):
        return drawn
    line, middle, half = 0.12, 0.5 * frame.width, 0.5 * frame.length
    size = min(length / 105.0, wide / 68.0)
    lines = [_ring(frame, (rim, rim + length), (rim, rim + wide), line)]
    lines.append(frame.box(half - line / 2, rim, half + line / 2, rim + wide))
    centre = shapely.Point(frame.at(half, middle))
    lines.append(centre.buffer(9.15 * size).difference(centre.buffer(9.15 * size - line)))
    lines.append(centre.buffer(0.15))
    for deep, broad in ((16.5 * size, 20.16 * size), (5.5 * size, 9.16 * size)):
        across = (middle - broad, middle + broad)
        lines.append(_ring(frame, (rim, rim + deep), across, line))
        lines.append(_ring(frame, (rim + length - deep, rim + length), across, line))
    return [*drawn, PatternShapes(_clipped(part, lines), WHITE)]


def _court(part: shapely.Polygon, frame: _Rectangle, look: _PatternLook) -> list[PatternShapes]:
    """Border and middle line of a court."""
    if frame.length < 8.0 or frame.width < 5.0:
        return []
    line, rim = 0.06, 1.0
    lines = [
        _ring(frame, (rim, frame.length - rim), (rim, frame.width - rim), line),
        frame.box(frame.length / 2 - line / 2, rim, frame.length / 2 + line / 2, frame.width - rim),
    ]
    return [PatternShapes(_clipped(part, lines), WHITE)]


def _tramlines(part: shapely.Polygon, frame: _Rectangle, look: _PatternLook) -> list[PatternShapes]:
    """Pairs of wheel tracks along a field, and the strip at its rim that is ploughed across."""
    inner = part.buffer(-1.2)
    if inner.is_empty:
        return []
    gap = 18.0 + 9.0 * look.chance
    tracks: list[shapely.Polygon] = []
    for v in np.arange(0.5 * gap, frame.width, gap):
        for side in (-0.9, 0.9):
            tracks.append(frame.box(0.0, v + side - 0.22, frame.length, v + side + 0.22))
    # Passes of the drill are a little lighter and darker in turn.
    wide = max(1.5, frame.width / (2.0 * _MOST_ROWS))
    rows = [
        frame.box(0.0, v, frame.length, v + wide) for v in np.arange(0.0, frame.width, 2.0 * wide)
    ]
    red, green, blue = (0.86 * value for value in look.colour)
    return [
        PatternShapes(_clipped(part, rows), (red, green, blue), "ground_grass"),
        PatternShapes(_clipped(inner, tracks), _TRACK, "ground_gravel"),
    ]


def _vines(part: shapely.Polygon, frame: _Rectangle, look: _PatternLook) -> list[PatternShapes]:
    """Rows of low plants with bare soil below."""
    inner = part.buffer(-1.5)
    if inner.is_empty:
        return []
    step = max(2.2, frame.width / _MOST_ROWS)
    middles = np.arange(1.5, frame.width, step)
    soil = [frame.box(0.0, v - 0.55, frame.length, v + 0.55) for v in middles]
    rows = [frame.box(0.0, v - 0.3, frame.length, v + 0.3) for v in middles]
    return [
        PatternShapes(_clipped(inner, soil), _SOIL, "ground_gravel"),
        PatternShapes(_clipped(inner, rows), _LEAVES, "ground_grass"),
    ]


def _paths(part: shapely.Polygon, frame: _Rectangle, look: _PatternLook) -> list[PatternShapes]:
    """Two curved paths of gravel that cross in a park."""
    if frame.width < 25.0:
        return []
    wide = 1.1 if frame.width < 60.0 else 1.5
    share = np.linspace(-0.02, 1.02, 40)
    swing = 0.10 * frame.width * np.sin(2.0 * np.pi * (share * 1.5 + look.chance))
    long = [
        frame.at(u * frame.length, 0.5 * frame.width + s) for u, s in zip(share, swing, strict=True)
    ]
    swing = 0.06 * frame.length * np.sin(2.0 * np.pi * (share + 0.3 + look.chance))
    short = [
        frame.at((0.35 + 0.3 * look.chance) * frame.length + s, u * frame.width)
        for u, s in zip(share, swing, strict=True)
    ]
    paths = [shapely.LineString(line).buffer(wide, cap_style="flat") for line in (long, short)]
    return [
        PatternShapes(
            _clipped(part, [shapely.union_all(paths)]), _PATH, "ground_gravel", trodden=True
        )
    ]


def _graves(part: shapely.Polygon, frame: _Rectangle, look: _PatternLook) -> list[PatternShapes]:
    """Rows of graves between paths."""
    inner = part.buffer(-2.5)
    if inner.is_empty:
        return []
    stones: list[list[shapely.Polygon]] = [[] for _ in _STONES]
    beds: list[shapely.Polygon] = []
    paths: list[shapely.Polygon] = []
    for row, v in enumerate(np.arange(3.0, frame.width - 3.0, 3.4)):
        if row % 6 == 5:
            paths.append(frame.box(0.0, v - 0.4, frame.length, v + 1.6))
            continue
        for k, u in enumerate(np.arange(3.0, frame.length - 3.0, 1.7)):
            pick = (k * 7919 + row * 104729 + int(look.chance * 1000)) % 11
            if pick > 1:
                stone = _STONES[pick % len(_STONES)]
                left = u + 0.375 - 0.5 * stone.width
                stones[pick % len(_STONES)].append(frame.box(left, v, left + stone.width, v + 0.16))
                beds.append(frame.box(u - 0.1, v + 0.2, u + 0.85, v + 1.9))
    return [
        PatternShapes(_clipped(part, paths), _PATH, "ground_gravel", trodden=True),
        PatternShapes(tuple(_within(inner, beds)), (0.085, 0.075, 0.048), "ground_gravel"),
        *(
            PatternShapes(tuple(_within(inner, some)), stone.colour, None, height=stone.height)
            for stone, some in zip(_STONES, stones, strict=True)
        ),
    ]


class _Gravestone(NamedTuple):
    """A kind of gravestones: width and height [m], and reflectance."""

    width: float
    height: float
    colour: Colour


_STONES = (
    _Gravestone(0.70, 0.85, (0.20, 0.195, 0.185)),
    _Gravestone(0.55, 1.05, (0.055, 0.055, 0.058)),
    _Gravestone(0.90, 0.65, (0.17, 0.13, 0.115)),
    _Gravestone(0.60, 0.45, (0.28, 0.275, 0.26)),
)

_PATTERNS: Mapping[
    str, Callable[[shapely.Polygon, _Rectangle, _PatternLook], list[PatternShapes]]
] = {
    "bays": _bays,
    "pitch": _pitch,
    "court": _court,
    "tramlines": _tramlines,
    "vines": _vines,
    "paths": _paths,
    "graves": _graves,
}
