"""Repairs and damage of lanes and junctions near the camera.

They are patches, sealed cracks, joints and manholes, and rubber marks inside junctions. Lanes are
divided into stretches; each holds one detail at most, so none overlap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.bands import Band, band_along, on_lane, without_repeats
from sumo3dviz_pt.library.mesh.planar import GRID, areal
from sumo3dviz_pt.model.geometry import Bools, Floats, arc_length
from sumo3dviz_pt.model.network import Edge
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.world.memory import digest_of
from sumo3dviz_pt.world.roads.cells import Cells, Polygons, quad_polygons
from sumo3dviz_pt.world.roads.graded import Graded, graded_on, joined
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, distance_to, is_driven
from sumo3dviz_pt.world.roads.wear.lanes import (
    TRACK_PLACE,
    DrivenJunction,
    brightness,
    built_inside,
    near_junctions,
)

_STRETCH = 13.0
"""Length of lane that holds one detail at most [m]."""

_FARTHEST = 250.0
"""Lanes farther from the camera's path [m] show none."""

_MARGIN = 2.0
"""Ends of stretches stay free [m]."""

# fmt: off
_KINDS   = ("patch", "snake", "crack", "joint", "manhole", "none")
_CITY    = (0.13,    0.16,    0.14,    0.05,    0.07,      0.45)
_FAST    = (0.05,    0.09,    0.07,    0.07,    0.0,       0.72)
_VILLAGE = (0.13,    0.16,    0.14,    0.05,    0.0,       0.52)
# fmt: on
"""How likely a stretch has which kind: in towns, outside, on streets without footways."""

_FAST_FROM = 20.0  # speed limit [m/s]
_SEAL = 0.38  # factor of brightness of fresh bitumen


@dataclass(frozen=True, slots=True, eq=False)
class FreeStretch:
    """A free stretch of road.

    Attributes:
        middle: Its middle line, (n, 3) [m].
        half: From there to its border [m].
        start: Where details may begin along it [m].
        end: Where they end [m].
        name: Chance depends on it.
    """

    middle: Floats
    half: float
    start: float
    end: float
    name: str

    def chance(self, word: str, low: float, high: float) -> float:
        """Return a random number that is always the same for this stretch and a word.

        Args:
            word: What the number is for.
            low: Lower bound.
            high: Upper bound.
        """
        return low + (high - low) * share_of(0, "road", self.name, word)

    def at(self, flat: Floats) -> Floats:
        """Return quads given by station and offset to the left, (n, 4, 2), as (n, 4, 3)."""
        return on_lane(flat, self.middle)

    def band(self, line: Floats, width: float) -> Floats:
        """Return quads of a ribbon.

        Args:
            line: Its middle: distances along the lane and offsets to its left, (n, 2) [m].
            width: Of the ribbon [m].
        """
        points = on_lane(line, self.middle)
        return band_along(points, right=-0.5 * width, left=0.5 * width).whole()

    def box(self, along: tuple[float, float], across: tuple[float, float]) -> Floats:
        """Return the quads of a rectangle on the lane.

        Args:
            along: Where it begins and ends along the lane [m].
            across: Offsets of its right and left border to the left of the middle [m].
        """
        band: Band = band_along(self.middle, right=across[0], left=across[1])
        return band.quads(*along)


def road_details(
    layout: RoadLayout, *, surfaces: frozenset[str], focus: BoundsXY | None, fast: frozenset[str]
) -> dict[str, Graded]:
    """Build details of lanes near the camera's path, by surface key.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; without one no lane is near.
        fast: Edges outside towns.
    """
    chosen: dict[str, list[Graded]] = {}
    # Sewers lie below streets with footways.
    town = {key for key, group in layout.strips.items() if any(s.look.raised for s in group)}
    for lane in _near_lanes(layout, surfaces, focus):
        weights = _FAST if lane.edge in fast else _CITY if lane.edge in town else _VILLAGE
        course = digest_of(lane.strip.right, lane.strip.left)
        for place in _places(lane.strip, lane.free):
            kind = _KINDS[pick(weights, place.chance("kind", 0.0, 1.0))]
            name = ("detail", place.name, kind, course)
            made = layout.memory.by_content.of(name, partial(_detail, place, kind))
            chosen.setdefault(lane.strip.look.surface, []).extend(made)
    return {surface: joined(pieces) for surface, pieces in chosen.items()}


def _detail(place: FreeStretch, kind: str) -> list[Graded]:
    """One detail."""
    quads = detail_quads(place, kind)
    return [of_one_tone(some, factor) for some, factor in quads if len(some)]


def is_fast(edge: Edge) -> bool:
    """Return whether an edge is a road outside towns, by its speed limit."""
    return max(lane.speed for lane in edge.lanes) >= _FAST_FROM


@dataclass(frozen=True, slots=True, eq=False)
class _NearLane:
    """A driven lane near the camera's path.

    Attributes:
        strip: Its surface.
        edge: Id of its edge.
        free: Which quads of the strip lose nothing to another road, (n,).
    """

    strip: Strip
    edge: str
    free: Bools


def _near_lanes(
    layout: RoadLayout, surfaces: frozenset[str], focus: BoundsXY | None
) -> list[_NearLane]:
    """Driven lanes near the camera's path on surfaces that show wear."""
    lanes = []
    first = 0
    for edge, group in layout.strips.items():
        for strip in (s for s in group if not s.look.raised):
            index = np.arange(first, first + len(strip.quads))
            first += len(index)
            if focus is None or strip.look.surface not in surfaces or not is_driven(strip):
                continue
            if distance_to(focus, strip.lane.shape).min() < _FARTHEST:
                free = np.array([int(k) not in layout.cells.cutters for k in index])
                lanes.append(_NearLane(strip, edge, free))
    return lanes


def _places(strip: Strip, free: Bools) -> list[FreeStretch]:
    """Stretches of a strip that no other road covers."""
    middle = 0.5 * (strip.right + strip.left)
    stations = arc_length(middle[:, :2])
    half = 0.5 * float(np.linalg.norm((strip.left - strip.right)[:, :2], axis=1).min())
    count = int(stations[-1] / _STRETCH)
    if half < 1.2 or np.min(np.diff(stations), initial=1.0) < 1e-6:
        return []
    places = []
    for k in range(count):
        start, end = (k * _STRETCH + _MARGIN, (k + 1) * _STRETCH - _MARGIN)
        touched = (stations[1:] > start) & (stations[:-1] < end)
        if free[touched].all():
            places.append(FreeStretch(middle, half, start, end, f"{strip.lane.id}:{k}"))
    return places


def detail_quads(place: FreeStretch, kind: str) -> list[tuple[Floats, float]]:
    """Build quads of one detail, with their factors of brightness.

    Args:
        place: Where it lies.
        kind: `patch`, `snake`, `crack`, `joint`, `manhole` or `trench`; others are nothing.
    """
    makers = {"patch": _patch, "snake": _snake, "crack": _crack, "joint": _joint}
    makers |= {"manhole": _manhole, "trench": _trench}
    return makers[kind](place) if kind in makers else []


def _patch(place: FreeStretch) -> list[tuple[Floats, float]]:
    """A rectangle of other asphalt with a sealed seam."""
    length, width = place.chance("length", 1.2, 7.5), place.chance("width", 0.7, 2.0)
    width = min(width, 2.0 * place.half - 0.3)
    room = place.half - 0.5 * width - 0.1
    middle = place.chance("side", -room, room)
    start = place.start + place.chance("start", 0.0, place.end - place.start - length)
    right, left, end = middle - 0.5 * width, middle + 0.5 * width, start + length
    tone = place.chance("tone", 0.66, 0.86) if place.chance("age", 0, 1) < 0.7 else 1.13
    seam = 0.035
    rims = [
        place.box((start, end), (right - seam, right)),
        place.box((start, end), (left, left + seam)),
        place.box((start - seam, start), (right - seam, left + seam)),
        place.box((end, end + seam), (right - seam, left + seam)),
    ]
    return [(place.box((start, end), (right, left)), tone), *((rim, _SEAL) for rim in rims)]


def _trench(place: FreeStretch) -> list[tuple[Floats, float]]:
    """A cable trench all along, filled with other asphalt between sealed seams."""
    half, seam = place.chance("width", 0.25, 0.5), 0.03
    along = (place.start, place.end)
    tone = place.chance("tone", 0.7, 0.9)
    return [
        (place.box(along, (-half, half)), tone),
        (place.box(along, (-half - seam, -half)), _SEAL),
        (place.box(along, (half, half + seam)), _SEAL),
    ]


def _wander(place: FreeStretch, count: int, step: float) -> Floats:
    """A random walk of small steps that begins and ends near 0, (count,)."""
    steps = [place.chance(f"wander{k}", -step, step) for k in range(count)]
    walk = np.cumsum(steps)
    return np.asarray(walk - np.linspace(walk[0], walk[-1], count))


def _snake(place: FreeStretch) -> list[tuple[Floats, float]]:
    """A crack along the lane, sealed with bitumen."""
    count = 14
    length = place.chance("length", 4.0, place.end - place.start)
    along = place.start + np.linspace(0.0, length, count)
    side = place.chance("side", -0.6, 0.6) * place.half
    across = np.clip(side + _wander(place, count, 0.16), 0.2 - place.half, place.half - 0.2)
    width = place.chance("seal", 0.035, 0.075)
    return [(place.band(np.stack([along, across], axis=1), width), _SEAL)]


def _crack(place: FreeStretch) -> list[tuple[Floats, float]]:
    """An open crack across the lane."""
    count = 11
    across = np.linspace(-0.96, place.chance("end", 0.1, 0.96), count) * place.half
    along = 0.5 * (place.start + place.end) + _wander(place, count, 0.14)
    width = place.chance("gap", 0.012, 0.03)
    return [(place.band(np.stack([along, across], axis=1)[::-1], width), 0.45)]


def _joint(place: FreeStretch) -> list[tuple[Floats, float]]:
    """A straight sealed joint across the lane, where a day's work ended."""
    at = place.chance("at", place.start, place.end)
    return [(place.box((at, at + 0.06), (0.02 - place.half, place.half - 0.02)), _SEAL)]


def _manhole(place: FreeStretch) -> list[tuple[Floats, float]]:
    """A round cover with studs in a collar of fresh asphalt."""
    at = np.array([0.5 * (place.start + place.end), place.chance("side", -0.25, 0.25)])
    rows = [(0.0, 0.07), (0.07, 0.14), (0.14, 0.21), (0.21, 0.27)]
    rings = [(_ring(place, at, (0.31, 0.42), odd=None), 0.70)]
    rings.append((_ring(place, at, (0.27, 0.31), odd=None), 0.30))
    for number, row in enumerate(rows):
        rings += [
            (_ring(place, at, row, odd=bool(number % 2)), 0.33),
            (_ring(place, at, row, odd=not number % 2), 0.55),
        ]
    return rings


def _ring(
    place: FreeStretch, at: Floats, radii: tuple[float, float], *, odd: bool | None
) -> Floats:
    """Quads of every second sector of a ring, or of all of them."""
    turn = np.linspace(0.0, 2.0 * np.pi, 17)
    spoke = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    inner, outer = (at + radius * spoke for radius in radii)
    flat = np.stack([inner[:-1], outer[:-1], outer[1:], inner[1:]], axis=1)
    return place.at(flat if odd is None else flat[int(odd) :: 2])


def of_one_tone(quads: Floats, factor: float) -> Graded:
    """Return quads of one brightness."""
    shares = np.tile([0.0, 1.0], (len(quads), 1))
    wear = np.tile([factor, 0.0, 0.0], (len(quads), 2, 2, 1))
    return graded_on(quads, shares, wear, polygons=quad_polygons(quads))


_LEAST = 80.0
"""Smaller junctions [m2] show none."""

_EACH = 110.0
"""Area for one detail [m2]."""

_JUNCTION_DETAILS_KINDS = (
    "manhole",
    "patch",
    "snake",
    "patch",
    "crack",
    "snake",
    "manhole",
    "patch",
)
_HALF = 2.2
"""From the middle of a detail's place to its border [m]."""

_RUBBER_WIDTH, _RUBBER_TONE = 0.17, 0.66
"""Width of a tyre's mark [m] and its factor of brightness in its middle."""

_RUBBED = 0.45
"""Share of ways with rubber marks."""

_TOUCH = 1e-4
"""Details that share less area [m2] only touch."""

_Tones = list[tuple[Floats, Floats]]
"""Quads, (n, 4, 3), and their brightness at both ends, (n, 2)."""


def junction_details(
    layout: RoadLayout, *, surfaces: frozenset[str], focus: BoundsXY | None
) -> dict[str, Graded]:
    """Build details of junctions near the camera's path, by surface key.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; without one no junction is near.
    """
    junctions = near_junctions(layout, surfaces=surfaces, focus=focus)
    large = (junction for junction in junctions if junction.polygon.area > _LEAST)
    return built_inside(layout, "repairs", large, partial(_repaired, layout.cells))


def _repaired(cells: Cells, junction: DrivenJunction) -> Graded:
    """Details of one junction, as dirty as what they lie on."""
    ways = junction.ways
    tones = [*_repairs(cells.owners[junction.cell], junction.polygon, ways), *_rubber(ways)]
    piece = _laid(tones, cells, junction.cell)
    worn = brightness(piece.vertices[:, :2], ways)[:, None] ** [1.0, 0.0, 0.0]
    return Graded(piece.vertices, piece.faces, piece.wear * worn)


def _repairs(name: str, polygon: shapely.Geometry, ways: Sequence[Strip]) -> _Tones:
    """Patches and the like along some ways, and a trench across them all."""
    # Choose places; what lies at each is a matter of its number.
    places = [_across(name, polygon, ways)]
    x0, y0, x1, y1 = polygon.bounds
    for k in range(int(polygon.area / _EACH) + 1):
        at = np.array(
            [
                x0 + (x1 - x0) * share_of(0, "repair", name, str(k), "x"),
                y0 + (y1 - y0) * share_of(0, "repair", name, str(k), "y"),
            ]
        )
        way = ways[int(share_of(0, "repair", name, str(k)) * len(ways))].lane.shape
        ahead = (way[1] - way[0])[:2] / max(float(np.hypot(*(way[1] - way[0])[:2])), 1e-9)
        line = np.column_stack([at + np.array([[-5.5], [5.5]]) * ahead, np.zeros(2)])
        places.append(
            (
                _JUNCTION_DETAILS_KINDS[k % len(_JUNCTION_DETAILS_KINDS)],
                FreeStretch(line, _HALF, 1.0, 10.0, f"{name}:{k}"),
            )
        )
    # Lay the first of those that would overlap.
    tones: _Tones = []
    taken = shapely.Polygon()
    for kind, place in places:
        details = [(quads, tone) for quads, tone in detail_quads(place, kind) if len(quads)]
        cover = shapely.union_all(np.concatenate([quad_polygons(quads) for quads, _ in details]))
        if cover.distance(taken) > 0.3 or taken.is_empty:
            taken = taken.union(cover.envelope)
            short = [(_shortened(quads), tone) for quads, tone in details]
            tones += [(quads, np.full((len(quads), 2), tone)) for quads, tone in short]
    return tones


def _shortened(quads: Floats) -> Floats:
    """Quads cut across every metre or so, so that their wear can follow what is around them."""
    sides = (quads[:, [1, 2]] - quads[:, [0, 3]])[..., :2]
    rows = np.maximum(np.linalg.norm(sides, axis=-1).max(axis=1).round().astype(np.int64), 1)
    index = np.repeat(np.arange(len(quads)), rows)
    step = np.arange(len(index)) - np.repeat(np.cumsum(rows) - rows, rows)
    low, high = ((step + k)[:, None, None] / rows[index][:, None, None] for k in (0, 1))
    start, end = quads[index][:, [0, 3]], quads[index][:, [1, 2]]
    near, far = start + low * (end - start), start + high * (end - start)
    return np.stack([near[:, 0], far[:, 0], far[:, 1], near[:, 1]], axis=1)


def _across(name: str, polygon: shapely.Geometry, ways: Sequence[Strip]) -> tuple[str, FreeStretch]:
    """A trench from kerb to kerb, a little askew."""
    middle = shapely.get_coordinates(polygon.centroid)[0]
    way = ways[0].lane.shape
    yaw = np.arctan2(*(way[1] - way[0])[1::-1]) + np.pi / 2
    yaw += 0.5 * share_of(0, "trench", name, "yaw") - 0.25
    ahead, aside = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    reach = 0.5 * float(np.hypot(*np.ptp(shapely.get_coordinates(polygon), axis=0)))
    shift = 0.35 * reach * (1.0 if share_of(0, "trench", name) < 0.5 else -1.0)
    ends = middle + shift * aside + np.array([[-reach], [reach]]) * ahead
    line = np.column_stack([ends, np.zeros(2)])
    return "trench", FreeStretch(line, _HALF, 0.0, 2.0 * reach, f"{name}:trench")


def _rubber(ways: Sequence[Strip]) -> _Tones:
    """Pairs of tyre marks along parts of some ways, fading at their ends."""
    tones: _Tones = []
    for way in ways:
        chance = [
            share_of(0, "rubber", way.lane.id, word) for word in ("any", "at", "long", "side")
        ]
        line = without_repeats(way.lane.shape)
        if chance[0] > _RUBBED or len(line) < 2:
            continue
        # Choose the stretch that tyres have marked.
        whole = float(arc_length(line[:, :2])[-1])
        start = 0.5 * chance[1] * whole
        long = min(3.0 + 6.0 * chance[2], whole - start)
        # Lay both tracks.
        for side in (-TRACK_PLACE, TRACK_PLACE):
            middle = side + 0.5 * chance[3] - 0.25
            half = 0.5 * _RUBBER_WIDTH
            band = band_along(line, right=middle - half, left=middle + half)
            marks = np.linspace(start, start + long, 9)
            fade = 1.0 - (1.0 - _RUBBER_TONE) * np.sin(np.linspace(0.0, np.pi, 9)) ** 0.7
            for k in range(8):
                quads = band.quads(float(marks[k]), float(marks[k + 1]))
                tone = np.linspace(fade[k], fade[k + 1], len(quads) + 1)
                tones.append((quads, np.stack([tone[:-1], tone[1:]], axis=1)))
    return tones


def _laid(tones: _Tones, cells: Cells, index: int) -> Graded:
    """Quads on one cell, cut at its border and at the height of the surface."""
    quads = np.concatenate([np.zeros((0, 4, 3)), *(quads for quads, _ in tones)])
    factor = np.concatenate([np.zeros((0, 2)), *(tone for _, tone in tones)])
    wear = np.zeros((len(quads), 2, 2, 3))
    wear[..., 0] = factor[:, :, None]
    left: Polygons = quad_polygons(quads)
    shapely.prepare(cells.polygons[index])
    cut = ~shapely.contains_properly(cells.polygons[index], left)
    left[cut] = shapely.intersection(left[cut], cells.polygons[index])
    left = _first_laid(left)
    piece = graded_on(quads, np.tile([0.0, 1.0], (len(quads), 1)), wear, polygons=left)
    heights = cells.heights(np.full(len(piece.vertices), index), piece.vertices[:, :2])
    return Graded(np.column_stack([piece.vertices[:, :2], heights]), piece.faces, piece.wear)


def _first_laid(polygons: Polygons) -> Polygons:
    """Return polygons without what earlier ones cover: two faces in one place would flicker."""
    free = polygons.copy()
    later, earlier = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    later, earlier = later[earlier < later], earlier[earlier < later]
    # Neighbours of one detail only touch.
    shared = shapely.area(shapely.intersection(polygons[later], polygons[earlier])) > _TOUCH
    later, earlier = later[shared], earlier[shared]
    for k in np.unique(later).tolist():
        before = shapely.union_all(polygons[earlier[later == k]])
        free[k] = areal(shapely.difference(areal(free[k]), before, grid_size=GRID))
    return free
