"""Makes a network where there is none: lanes where tracks run densely, pavement where they cross.

Everything lies where vehicles drive, and is as wide as they need it; who leads where, and who has
right of way, nobody knows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.sumo.tracks.lanes import STEP, Road, Ways, roads_of
from sumo3dviz_pt.sumo.tracks.users import Track
from sumo3dviz_pt.sumo.values import LANE_WIDTH

_MOST = 1500
"""Number of tracks that tell where the pavement is; of more, so many from all over the table."""

_ROOM = 0.7  # pavement beside a body [m]
_NARROWEST = 3.2  # no pavement is narrower [m]
_GAP = 1.5  # strips between ways that are narrower than twice this are paved, too [m]
_ISLAND = 25.0  # smaller islands are paved [m2]
_SMOOTH = 0.15  # by how much outlines may be off [m]
_OVERLAP = 0.05  # parts of pavement that meet lap over each other [m]
_SLIVER = 0.3  # pavement beside lanes that is narrower than twice this is left out [m]
_MEETS = 4.0  # a road's end that is as near to pavement leads there [m]
_BEYOND = 12.0  # by how much a road leads on where it ends at nothing [m]
_LEFT = ' lefthand="true"'
_OPPOSITE = 12.0  # who drives against each other on one road is as near [m]
_MARGIN = 3.0  # floor around people [m]
_SLOWEST = 30 / 3.6  # no limit is lower [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class _Node:
    """A junction."""

    id: str
    place: tuple[float, float]
    area: shapely.Polygon | None = None


def network_text(
    tracks: Sequence[Track],
    known: Sequence[Road] = (),
    *,
    file: Path,
    projection: str = "!",
) -> str:
    """Return a network of SUMO made of roads, or of the ways that tracks' vehicles drive.

    Args:
        tracks: Everyone.
        known: Roads that something tells; none are sought then.
        file: For messages.
        projection: By which places on the Earth became metres.

    Raises:
        InputError: If nobody moves far enough to tell a road.
    """
    wheels = [track for track in tracks if track.kind == "vehicle"]
    if not wheels and not known:
        return _text([_floor(tracks)], [], projection, allow="pedestrian")
    chosen = wheels[:: max(1, len(wheels) // _MOST)]
    roads = list(known) or roads_of(_ways(chosen))
    if not roads:
        raise InputError(
            "the tracks are too short or too few to tell where roads are; name a network by"
            " --network",
            file=file,
        )
    covered = shapely.union_all([_strip(road) for road in roads])
    driven = shapely.Polygon() if known else _pavement(chosen)
    rest = driven.difference(covered.buffer(-_OVERLAP))
    rest = rest.buffer(-_SLIVER).buffer(_SLIVER).intersection(rest)
    parts = [part for part in _polygons(rest) if part.area >= _ISLAND]
    nodes = [
        _Node(f"pavement_{n}", _inside(part), part)
        for n, part in enumerate(each for part in parts for each in _without_holes(part))
    ]
    return _text(_led_on(roads, shapely.union_all([covered, *parts])), nodes, projection)


def _led_on(roads: Sequence[Road], paved: shapely.Geometry) -> list[Road]:
    """Return roads that lead on where they end at nothing: who comes and goes there has a body."""
    longer = []
    for road in roads:
        lanes = [lane.copy() for lane in road.lanes]
        for end, inner in ((0, 1), (-1, -2)):
            way = lanes[0][end] - lanes[0][inner]
            way /= max(float(np.linalg.norm(way)), 1e-9)
            tips = np.array([lane[end] for lane in lanes]) + _MEETS * way
            if not shapely.contains_xy(paved, *tips.T).any():
                for lane in lanes:
                    lane[end] += _BEYOND * way
        longer.append(Road((*lanes,), road.widths, road.speed))
    return longer


def _floor(tracks: Sequence[Track]) -> Road:
    """Return one wide lane that holds everybody, where all are on foot."""
    places = np.concatenate([track.fronts[:, :2] for track in tracks])
    middle = places.mean(axis=0)
    axes = np.linalg.svd(places[:: max(1, len(places) // 5000)] - middle, full_matrices=False)[2]
    along, side = axes if len(axes) > 1 else np.eye(2)
    ends, sides = ((places - middle) @ axis for axis in (along, side))
    centre = middle + side * (sides.max() + sides.min()) / 2
    tips = [centre + along * (ends.min() - _MARGIN), centre + along * (ends.max() + _MARGIN)]
    width = min(float(np.ptp(sides)) + 2 * _MARGIN, LANE_WIDTH.high)
    return Road((np.array(tips),), (width,), _SLOWEST)


def _ways(tracks: Sequence[Track]) -> Ways:
    """Return points along the ways of bodies' middles."""
    points, courses, owners, speeds = [], [], [], []
    for number, track in enumerate(tracks):
        middle = _middles(track)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))])
        moved = np.concatenate([[True], np.diff(along) > 1e-3])
        if along[-1] < 4 * STEP or moved.sum() < 4:
            continue
        at = np.arange(0.0, along[-1], STEP)
        known, times = along[moved], track.times[moved]
        line = np.column_stack([np.interp(at, known, axis) for axis in middle[moved].T])
        ways = np.gradient(line, axis=0)
        points.append(line)
        courses.append(np.arctan2(ways[:, 1], ways[:, 0]))
        owners.append(np.full(len(at), number))
        speeds.append(STEP / np.maximum(np.gradient(np.interp(at, known, times)), 1e-3))
    if not points:
        return Ways(np.empty((0, 2)), np.empty(0), np.empty(0, np.int64), np.empty(0))
    return Ways(*map(np.concatenate, (points, courses, owners, speeds)))


def _middles(track: Track) -> Floats:
    """Return the middle of a body, seen from above, (n, 2) [m]."""
    ahead = np.column_stack([np.cos(track.headings), np.sin(track.headings)])
    return np.asarray(track.fronts[:, :2] - track.size[0] / 2 * ahead)


def _strip(road: Road) -> shapely.Geometry:
    """Return what the lanes of a road cover."""
    return shapely.union_all(
        [
            shapely.LineString(lane).buffer(width / 2 + _OVERLAP, cap_style="flat")
            for lane, width in zip(road.lanes, road.widths, strict=True)
        ]
    )


def _pavement(tracks: Sequence[Track]) -> shapely.Geometry:
    """Return where vehicles drive, with some room beside them."""
    strips = []
    for track in tracks:
        line = shapely.LineString(np.vstack([_middles(track), _middles(track)[-1:] + 0.01]))
        wide = max(track.size[1] / 2 + _ROOM, _NARROWEST / 2)
        strips.append(line.simplify(_SMOOTH).buffer(wide, cap_style="flat"))
    closed = shapely.union_all(strips).buffer(_GAP).buffer(-_GAP).simplify(_SMOOTH)
    return shapely.union_all(
        [
            shapely.Polygon(
                part.exterior,
                [hole for hole in part.interiors if shapely.Polygon(hole).area >= _ISLAND],
            )
            for part in _polygons(closed)
        ]
    )


def _polygons(area: shapely.Geometry) -> list[shapely.Polygon]:
    """Return the polygons of an area."""
    parts = getattr(area, "geoms", [area])
    return [part for part in parts if isinstance(part, shapely.Polygon) and not part.is_empty]


def _without_holes(area: shapely.Polygon) -> Iterator[shapely.Polygon]:
    """Yield parts of an area that have no holes, because SUMO's shapes have none."""
    waiting = [area]
    while waiting:
        part = waiting.pop(0)
        if not part.interiors:
            yield part
            continue
        # Cut through the first hole.
        x = shapely.Polygon(part.interiors[0]).representative_point().x
        left, low, right, high = part.bounds
        for half in (
            (left - 1, low - 1, x + _OVERLAP, high + 1),
            (x, low - 1, right + 1, high + 1),
        ):
            waiting += _polygons(part.intersection(shapely.box(*half)))


def _inside(area: shapely.Polygon) -> tuple[float, float]:
    """Return a point of an area."""
    point = area.representative_point()
    return point.x, point.y


def _text(roads: Sequence[Road], nodes: list[_Node], projection: str, *, allow: str = "") -> str:
    """Return the network; `nodes` gets the ends of roads that lead to no pavement.

    Args:
        roads: All of them.
        nodes: Junctions with pavement.
        projection: PROJ string, or "!".
        allow: Who alone may be there; empty for everybody.
    """
    edges = []
    left = _drives_on_the_left(roads)
    for number, road in enumerate(roads):
        ends = [np.mean([lane[end] for lane in road.lanes], axis=0) for end in (0, -1)]
        begins, leads = (_node_at(nodes, end) for end in ends)
        turned = Road(road.lanes[::-1], road.widths[::-1], road.speed) if left else road
        edges += _edge_lines(f"road_{number}", turned, begins.id, leads.id, allow=allow)
    places = np.concatenate([lane for road in roads for lane in road.lanes])
    box = ",".join(f"{value:.2f}" for value in (*places.min(axis=0), *places.max(axis=0)))
    lines = [
        f'<net version="1.20" limitTurnSpeed="5.50"{_LEFT * left}>',
        f'    <location netOffset="0.00,0.00" convBoundary="{box}" origBoundary="{box}"'
        f' projParameter="{projection}"/>',
        *edges,
        *(_node_line(node) for node in nodes),
        "</net>",
    ]
    return "\n".join(lines) + "\n"


def _drives_on_the_left(roads: Sequence[Road]) -> bool:
    """Whether who comes towards somebody is on the right."""
    middles = [lane for road in roads for lane in (road.lanes[0], road.lanes[-1])]
    places = np.concatenate([lane[len(lane) // 2 :][:1] for lane in middles])
    ways = np.concatenate([(lane[-1] - lane[0])[None] for lane in middles])
    ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
    right = left = 0
    for place, way in zip(places, ways, strict=True):
        for lane, other in zip(middles, ways, strict=True):
            away = lane[int(np.argmin(np.linalg.norm(lane - place, axis=1)))] - place
            if way @ other > -0.9 or np.linalg.norm(away) > _OPPOSITE:
                continue
            side = way[0] * away[1] - way[1] * away[0]
            left, right = left + (side > 1.0), right + (side < -1.0)
    return bool(right > left)


def _node_at(nodes: list[_Node], place: Floats) -> _Node:
    """Return the junction at a road's end, a new one if there is none."""
    point = shapely.Point(place)
    for node in nodes:
        own = node.area or shapely.Point(node.place)
        if own.distance(point) < _MEETS:
            return node
    nodes.append(_Node(f"end_{len(nodes)}", (float(place[0]), float(place[1]))))
    return nodes[-1]


def _edge_lines(name: str, road: Road, begins: str, leads: str, *, allow: str) -> list[str]:
    """Return an edge; names of its lanes count from the kerb."""
    only = f' allow="{allow}"' if allow else ""
    speed = max(road.speed, _SLOWEST)
    lines = [f'    <edge id="{name}" from="{begins}" to="{leads}" priority="1">']
    for index, (lane, width) in enumerate(zip(road.lanes, road.widths, strict=True)):
        length = float(np.linalg.norm(np.diff(lane, axis=0), axis=1).sum())
        lines.append(
            f'        <lane id="{name}_{index}" index="{index}" speed="{speed:.2f}"'
            f' length="{length:.2f}" width="{width:.2f}"{only} shape="{_shape(lane)}"/>'
        )
    return [*lines, "    </edge>"]


def _node_line(node: _Node) -> str:
    """Return a junction."""
    shape = "" if node.area is None else _shape(np.array(node.area.exterior.coords[:-1]))
    kind = "dead_end" if node.area is None else "priority"
    x, y = node.place
    return (
        f'    <junction id="{node.id}" type="{kind}" x="{x:.2f}" y="{y:.2f}" incLanes=""'
        f' intLanes="" shape="{shape}"/>'
    )


def _shape(line: Floats) -> str:
    """Return a shape as SUMO writes it."""
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in line)
