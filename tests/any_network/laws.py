"""Laws of what is drawn of a network, whatever the network; each yields what breaks it.

Expectations come from SUMO's own description (lanes as lines with widths, outlines of junctions),
not from the code that lays roads out.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from sumo3dviz_pt.cast.poses import GroundedPiece
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.network import Connection, Edge, Lane, Network
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.model.traffic import Scenario, Trace
from sumo3dviz_pt.model.trajectory import Motion
from sumo3dviz_pt.world.roads.cells import Cells
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT, find_drops
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.mesh import surface_meshes
from sumo3dviz_pt.world.roads.roads import drawn_surface
from sumo3dviz_pt.world.signals.heads import Head
from sumo3dviz_pt.world.signals.signals import Signals

AREA = 0.005
"""Share of the road's area by which what is drawn may differ from the network."""

GAP = 0.01
"""Gaps between pieces that touch in the network are at most so wide [m]."""

OVERLAP = 1e-3
"""Pieces on one level share at most so much area [m2]."""

STAND = 0.05
"""A road user's height and that of the surface below it differ by at most so much [m]."""

CRUMB, WHEELS = 2.0, 0.8
"""Smallest area of footway that stands alone [m2]; how far wheels are from a way's middle [m]."""

VIEW = 3.0
"""What our code adds keeps so far from the axis of a standing camera [m]."""

_LEVEL = 2.5
"""Surfaces farther apart in height belong to different levels [m]."""

_SHARP = float(np.radians(10.0))
"""Ways that bend by more are not compared along their borders [rad]."""

_OFF_ROAD = frozenset({"pedestrian", "wheelchair", "bicycle", "scooter", "container", "ship"})
"""vClasses that do not keep to carriageways."""

_CARS = frozenset({"passenger", "bus", "truck", "delivery"})
"""vClasses that climb no kerbs."""

_FLYING = frozenset({"drone", "aircraft", "ship", "cable_car"})
"""vClasses that do not stand on roads."""

_RISES = (0.6, 1.4)
"""Heights above a lane at which its way is free [m]: of a bonnet and of a roof."""

_GROUND = frozenset({"ground", "roads", "markings", "grass"})
"""Families of what lies on the ground and does not stand on it."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A network and its laid-out roads.

    Attributes:
        network: The network.
        layout: Its roads.
    """

    network: Network
    layout: RoadLayout

    @cached_property
    def surface(self) -> shapely.Geometry:
        """All that is drawn, from above."""
        return shapely.union_all(self.layout.cells.polygons, grid_size=1e-4)

    @cached_property
    def lanes(self) -> Mapping[str, shapely.Geometry]:
        """Lanes that are to be drawn, as the network describes them, from above, by id."""
        return {
            lane.id: _lane_area(lane)
            for edge in self.network.edges.values()
            if edge.function in {"normal", "connector", "internal"}
            for lane in edge.lanes
            if _is_drawn(edge, lane)
        }

    @cached_property
    def triangles(self) -> Triangles:
        """Triangles of the road surface, as they are drawn."""
        cells = self.layout.cells
        drops = find_drops(self.network, cells, None)
        meshes = surface_meshes(cells, raised=self.layout.raised, near=(0.0, 0.0), drops=drops)
        corners = [mesh.vertices[mesh.faces] for mesh in meshes.values()]
        return Triangles(np.concatenate([np.zeros((0, 3, 3)), *corners]), cells)

    @cached_property
    def expected(self) -> shapely.Geometry:
        """Lanes, walking areas and junctions of the network from above."""
        shapes = list(self.lanes.values())
        shapes += [
            _outline(edge.lanes[0].shape)
            for edge in self.network.edges.values()
            if edge.function == "walkingarea"
        ]
        roads = {
            key
            for edge in self.network.edges.values()
            if any(not _is_waterway(lane) for lane in edge.lanes)
            for key in (edge.from_junction, edge.to_junction)
        }
        junctions = self.network.junctions
        shapes += [_outline(junctions[key].outline) for key in junctions if key in roads]
        return shapely.union_all(shapes, grid_size=1e-4)


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles of the road surface.

    Attributes:
        corners: (m, 3, 3) [m].
        cells: What they show.
    """

    corners: Floats
    cells: Cells

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Of them all from above."""
        return shapely.STRtree(shapely.polygons(self.corners[..., :2]))

    @cached_property
    def raised(self) -> Bools:
        """Which lie above a raised cell, (m,)."""
        tree = shapely.STRtree(self.cells.polygons[self.cells.raised])
        middles = shapely.points(self.corners[..., :2].mean(axis=1))
        found = np.zeros(len(self.corners), dtype=np.bool_)
        found[tree.query(middles, predicate="intersects")[0]] = True
        return found

    def below(self, points: Floats) -> tuple[Ints, Floats, Bools]:
        """Numbers of points, heights of triangles below or above each, and which are raised."""
        spots = shapely.points(points[:, :2])
        asked, face = self.tree.query(spots, predicate="dwithin", distance=0.02)
        a, b, c = (self.corners[face, k] for k in range(3))
        normal = np.cross(b - a, c - a)
        away = points[asked, :2] - a[:, :2]
        heights = a[:, 2] - (away * normal[:, :2]).sum(axis=1) / normal[:, 2]
        return asked, heights, self.raised[face]


# Surfaces -----------------------------------------------------------------------------------


def wrong_area(drawn: Drawn) -> Iterator[str]:
    """Yield how the drawn area differs from the union of lanes and junctions."""
    wanted = drawn.expected.area
    if not wanted:
        return
    parts = {
        "is missing": drawn.expected.difference(drawn.surface),
        "is drawn beyond the network": drawn.surface.difference(drawn.expected),
    }
    for fault, part in parts.items():
        if part.area > AREA * wanted:
            largest = max(shapely.get_parts(part), key=lambda piece: piece.area)
            yield (
                f"{part.area:.2f} m2 of {wanted:.0f} m2 {fault},"
                f" {largest.area:.2f} m2 of it near {_place(largest)}"
            )


def gaps(drawn: Drawn) -> Iterator[str]:
    """Yield where a piece that touches another in the network leaves a gap in the drawing."""
    solid = drawn.surface.buffer(1e-3)
    shapely.prepare(solid)
    for line, name in _seams(drawn):
        if solid.covers(line):
            continue
        left = line.difference(solid)
        width = max((part.length for part in shapely.get_parts(left)), default=0.0)
        if width > GAP:
            yield f"{name}: a gap of {width:.3f} m near {_place(left)}"


def _seams(drawn: Drawn) -> Iterator[tuple[shapely.Geometry, str]]:
    """Lines that the drawing must cover without a gap, and what they cross.

    Along connections they run from a metre before the end of one lane to a metre behind the
    beginning of the next; across an edge from the middle of a lane to that of its neighbour.
    """
    for link in drawn.network.connections:
        way = (link.from_lane, link.via, link.to_lane) if link.via else ()
        for first, second in itertools.pairwise(way or (link.from_lane, link.to_lane)):
            if first in drawn.lanes and second in drawn.lanes:
                lanes = drawn.network.lanes[first], drawn.network.lanes[second]
                yield from ((line, f"{first} to {second}") for line in _joints(*lanes))
    for edge in drawn.network.edges.values():
        lanes = [lane for lane in edge.lanes if lane.id in drawn.lanes]
        for one, other in itertools.pairwise(lanes if edge.function == "normal" else ()):
            yield from ((line, f"{one.id} beside {other.id}") for line in _across(one, other))


def _joints(first: Lane, second: Lane) -> Iterator[shapely.Geometry]:
    """Lines from the end of a lane to the beginning of the next, where they touch."""
    before, after = first.shape[:, :2], second.shape[:, :2]
    if np.linalg.norm(before[-1] - after[0]) > GAP:
        return
    # Where the way bends sharply, a wedge is missing on the outside, in the network too.
    straight = _bend(before, after) < _SHARP
    half = 0.4 * min(first.width, second.width)
    for aside in (-half, 0.0, half) if straight else (0.0,):
        ends = [_end(before, aside), _end(after[::-1], -aside)[::-1]]
        yield shapely.LineString(np.concatenate(ends))


def _end(points: Floats, aside: float) -> Floats:
    """The last metre of a line, moved to the left, (2, 2) [m]."""
    steps = points[-1] - points
    far = np.flatnonzero(np.hypot(*steps.T) > 1e-3)
    step = steps[far[-1]] if len(far) else np.array([1e-3, 0.0])
    along = step / np.hypot(*step)
    left = np.array([-along[1], along[0]])
    back = min(1.0, float(np.hypot(*step)))
    return np.array([points[-1] - back * along, points[-1]]) + aside * left


def _bend(before: Floats, after: Floats) -> float:
    """The angle between the end of a line and the beginning of the next [rad]."""
    one, other = (np.diff(ends, axis=0)[0] for ends in (_end(before, 0.0), _end(after[::-1], 0.0)))
    cosine = -float(one @ other) / float(np.hypot(*one) * np.hypot(*other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _across(one: Lane, other: Lane) -> Iterator[shapely.Geometry]:
    """Lines between the middles of lanes whose borders touch in the network."""
    first, second = (shapely.LineString(lane.shape[:, :2]) for lane in (one, other))
    apart = 0.5 * (one.width + other.width)
    for share in (0.1, 0.3, 0.5, 0.7, 0.9):
        start = shapely.line_interpolate_point(first, share, normalized=True)
        end = second.interpolate(second.project(start))
        if abs(start.distance(end) - apart) <= GAP:
            yield shapely.LineString([start, end])


def overlaps(drawn: Drawn) -> Iterator[str]:
    """Yield pieces of the surface that lie in one another on one level."""
    cells = drawn.layout.cells
    tree = shapely.STRtree(cells.polygons)
    one, other = tree.query(cells.polygons, predicate="intersects")
    ordered = one < other
    one, other = one[ordered], other[ordered]
    shared = shapely.intersection(cells.polygons[one], cells.polygons[other])
    real = shapely.area(shared) > OVERLAP
    one, other, shared = one[real], other[real], shared[real]
    if not len(one):
        return
    places = shapely.get_coordinates(shapely.point_on_surface(shared))
    apart = np.abs(cells.heights(one, places) - cells.heights(other, places))
    for a, b, area, gap in zip(one, other, shared, apart, strict=True):
        if gap < _LEVEL:
            yield (
                f"{cells.owners[a]} and {cells.owners[b]} share {area.area:.4f} m2"
                f" near {_place(area)}, {gap:.2f} m apart in height"
            )


def kerbs_in_the_way(drawn: Drawn) -> Iterator[str]:
    """Yield kerbs that stand where vehicles drive, and crumbs of footways amid carriageways."""
    raised = drawn.layout.raised
    tree = shapely.STRtree(raised)
    for area in raised:
        if area.area < CRUMB and len(tree.query(area, predicate="dwithin", distance=0.05)) == 1:
            yield f"a kerb around {area.area:.2f} m2 alone near {_place(area)}"
    for edge in drawn.network.edges.values():
        for lane in edge.lanes if edge.function == "internal" else ():
            if lane.id in drawn.lanes and lane.allowed & _CARS:
                line = shapely.LineString(lane.shape[:, :2]).buffer(min(WHEELS, 0.4 * lane.width))
                for k in tree.query(line, predicate="intersects"):
                    shared = shapely.intersection(line, raised[k])
                    if shared.area > 0.05 and _on_one_level(drawn, lane, shared):
                        where = f"{shared.area:.2f} m2 of kerb near {_place(shared)}"
                        yield f"{lane.id} leads over {where}"


def _on_one_level(drawn: Drawn, lane: Lane, shared: shapely.Geometry) -> bool:
    """Whether a footway that a lane passes is neither above nor below it."""
    spot = shapely.get_coordinates(shapely.point_on_surface(shared))[:1]
    cells = drawn.layout.cells
    near = shapely.STRtree(cells.polygons).query(shapely.Point(spot[0]), predicate="intersects")
    near = near[cells.raised[near]]
    z = lane.shape[np.argmin(np.hypot(*(lane.shape[:, :2] - spot).T)), 2]
    heights = cells.heights(near, np.repeat(spot, len(near), axis=0))
    return bool((np.abs(heights - z) < _LEVEL).any())


def floating_users(drawn: Drawn, scenario: Scenario) -> Iterator[str]:
    """Yield road users whose front stands on no drawn surface of its own kind.

    What is measured is what is drawn: the front as the cast places it for a row of the log,
    above the triangles of the road. From above it must be where the log says, and no farther
    above or below than a level is high. Rows beside their own lane are left out; some logs have
    them in bends.
    """
    for trace in scenario.traffic.traces:
        kind = scenario.vehicle_types[trace.type_id].vclass
        if trace.kind == "container" or kind in _FLYING:
            continue
        lanes = [scenario.traffic.lane_names[k] if k >= 0 else "" for k in trace.lanes]
        spots = shapely.points(trace.positions[:, :2])
        rows = [
            row
            for row, lane in enumerate(lanes)
            if lane in drawn.lanes and shapely.dwithin(drawn.lanes[lane], spots[row], 0.01)
        ]
        if not rows:
            continue
        placed = _placed(drawn, trace, scenario)[rows]
        asked, heights, raised = drawn.triangles.below(placed)
        # People climb kerbs, which the shot adds.
        climbs = trace.kind != "vehicle" or kind in _OFF_ROAD
        kerb = np.where(raised & climbs, SIDEWALK_HEIGHT, 0.0)
        fits = np.abs(heights - kerb - placed[asked, 2]) <= STAND
        bad = set(range(len(rows))) - set(asked[fits].tolist())
        moved = np.abs(placed - trace.positions[rows])
        bad |= set(np.flatnonzero((moved > [1e-9, 1e-9, _LEVEL]).any(axis=1)).tolist())
        if not bad:
            continue
        first = min(bad)
        (x, y, z), logged = placed[first], trace.positions[rows[first], 2]
        below = heights[asked == first]
        what = f"surfaces at {np.round(below, 2).tolist()} m" if len(below) else "no surface"
        yield (
            f"{trace.kind} {trace.id} ({kind}): {len(bad)} of {len(rows)} rows, first on"
            f" {lanes[rows[first]]} at ({x:.2f}, {y:.2f}, {z:.2f}), logged at {logged:.2f}: {what}"
        )


def _placed(drawn: Drawn, trace: Trace, scenario: Scenario) -> Floats:
    """Fronts of a road user as the cast places them for the rows of the log, (n, 3) [m]."""
    surface = drawn_surface(drawn.layout)
    if surface is None:
        return trace.positions
    names = scenario.traffic.lane_names
    lanes = [drawn.network.lanes.get(names[k]) if k >= 0 else None for k in trace.lanes]
    places = zip(trace.positions, lanes, strict=True)
    rows = _Rows(trace, np.array([_slope_at(place, lane) for place, lane in places]))
    times = np.arange(len(trace.times), dtype=np.float64)
    length = scenario.vehicle_types[trace.type_id].length
    return GroundedPiece(rows, surface.rise_at, length).sample(times).positions


def _slope_at(place: Floats, lane: Lane | None) -> float:
    """How steeply a lane climbs beside a place [rad]."""
    if lane is None:
        return 0.0
    steps = np.diff(lane.shape, axis=0)
    sides = shapely.linestrings(np.stack([lane.shape[:-1, :2], lane.shape[1:, :2]], axis=1))
    step = steps[int(np.argmin(shapely.distance(sides, shapely.Point(place[:2]))))]
    return float(np.arctan2(step[2], np.hypot(step[0], step[1])))


@dataclass(frozen=True, eq=False)
class _Rows:
    """The rows of a log as motion along lanes of some slopes; their numbers stand for times."""

    trace: Trace
    slopes: Floats
    begin = 0.0

    @property
    def end(self) -> float:
        """The number of the last row."""
        return float(len(self.trace.times) - 1)

    def sample(self, times: Floats) -> Motion:
        """The logged poses, whatever the times."""
        trace, still = self.trace, np.zeros(len(times))
        alive = np.ones(len(times), dtype=np.bool_)
        return Motion(alive, trace.positions, trace.yaws, self.slopes, still, still)


# Signals ------------------------------------------------------------------------------------


def wrong_heads(network: Network, signals: Signals) -> Iterator[str]:
    """Yield signalled links without a head, where people walk without two, or with doubled ones.

    Heads over the lanes of a wide road repeat those on its pole and do not count; those beyond a
    junction repeat them once or twice. A link number that guards several edges has a head at
    each of them.
    """
    ends = {"vehicles": Counter[tuple[str, int]](), "people": Counter[tuple[str, int]]()}
    for (tls, number, _), walks in _guarded(network).items():
        ends["people" if walks else "vehicles"][tls, number] += 2 if walks else 1
    heads: dict[str, dict[tuple[str, int], list[Head]]] = {"vehicles": {}, "people": {}}
    for head in signals.heads:
        if not head.over_road or head.kind == "rail":
            own = heads["people" if head.walks else "vehicles"]
            for number in head.links:
                own.setdefault((head.tls, number), []).append(head)
    for whom, wanted in ends.items():
        for key in sorted(set(wanted) | set(heads[whom])):
            found = heads[whom].get(key, [])
            most = wanted[key] if whom == "people" else 3 * wanted[key]
            places = {tuple(np.round(head.position, 1)) for head in found}
            if not wanted[key] <= len(found) <= most or len(places) < len(found):
                yield (
                    f"link {key[1]} of {key[0]}: {len(found)} heads for {whom} at {len(places)}"
                    f" places, {wanted[key]} expected"
                )


def _guarded(network: Network) -> dict[tuple[str, int, str], bool]:
    """Links with a light by traffic light, number and guarded edge; whether people walk there.

    Level crossings have barriers.
    """
    found = {}
    rail = {key for key, node in network.junctions.items() if node.type == "rail_crossing"}
    for link in network.connections:
        if link.tls and link.link_index >= 0 and link.tls not in rail:
            edge, walks = _guarded_edge(network, link)
            if edge is not None:
                found[link.tls, link.link_index, edge.id] = walks
    return found


def _guarded_edge(network: Network, link: Connection) -> tuple[Edge | None, bool]:
    """The edge that a link guards, and whether people walk there; none inside junctions."""
    start, end = (
        network.edges[network.lanes[key].edge_id] for key in (link.from_lane, link.to_lane)
    )
    if start.function in {"crossing", "walkingarea"}:
        return (end if end.function == "crossing" else start), True
    return (None if start.function == "internal" else start), False


# What stands --------------------------------------------------------------------------------


def standing_on_roads(drawn: Drawn, static: Sequence[StaticPart]) -> Iterator[str]:
    """Yield things that stand where vehicles drive, up to the height of a person."""
    cells = drawn.layout.cells
    drivable = np.flatnonzero(~cells.raised)
    areas = shapely.buffer(cells.polygons[drivable], -0.05)
    tree = shapely.STRtree(areas)
    for part in _things(static):
        points = _spread(part)
        asked, found = tree.query(shapely.points(points[:, :2]), predicate="intersects")
        above = points[asked, 2] - cells.heights(drivable[found], points[asked, :2])
        bad = (above > 0.15) & (above < 2.0)
        if bad.any():
            x, y, z = points[asked[bad][0]]
            owners = sorted({cells.owners[drivable[k]] for k in found[bad]})
            yield (
                f"{part.id}: {int(bad.sum())} points over {', '.join(owners[:3])},"
                f" first at ({x:.2f}, {y:.2f}, {z:.2f})"
            )


def blocked_ways(drawn: Drawn, static: Sequence[StaticPart]) -> Iterator[str]:
    """Yield what stands across the way of road users, whatever it belongs to.

    Along the middle of each drawn lane nothing is met at the heights of a bonnet and of a roof.
    """
    ways = list(_ways(drawn))
    if not ways:
        return
    pieces, names = np.concatenate([piece for piece, _ in ways]), [n for _, n in ways]
    owner = np.repeat(np.arange(len(ways)), [len(piece) for piece, _ in ways])
    tree = shapely.STRtree(shapely.linestrings(pieces[..., :2]))
    for part in static:
        corners = part.part.mesh.vertices[part.part.mesh.faces]
        low, high = corners.min(axis=1), corners.max(axis=1)
        face, piece = tree.query(shapely.box(*low[:, :2].T, *high[:, :2].T))
        met = face[:0], face[:0]
        for rise in _RISES:
            way = pieces[piece] + [0.0, 0.0, rise]
            hit = _pierced(corners[face], way)
            met = np.append(met[0], face[hit]), np.append(met[1], piece[hit])
        if len(met[0]):
            x, y, z = corners[met[0][0]].mean(axis=0)
            lanes = sorted({names[owner[k]] for k in met[1]})
            yield (
                f"{part.id}: {len(met[0])} faces across {', '.join(lanes[:3])},"
                f" first at ({x:.2f}, {y:.2f}, {z:.2f})"
            )


def _ways(drawn: Drawn) -> Iterator[tuple[Floats, str]]:
    """Pieces of the middles of lanes that vehicles use, (n, 2, 3) [m], and the lane's id."""
    for edge in drawn.network.edges.values():
        for lane in edge.lanes:
            # Tracks pass below platforms' roofs, and people through doors.
            if lane.id in drawn.lanes and lane.allowed & (_CARS | {"bicycle"}):
                line = lane.shape
                if len(line) > 1:
                    yield np.stack([line[:-1], line[1:]], axis=1), lane.id


def _pierced(triangles: Floats, ways: Floats) -> Bools:
    """Which triangles, (n, 3, 3), straight lines, (n, 2, 3), go through."""
    a, b, c = (triangles[:, k] for k in range(3))
    start, step = ways[:, 0], ways[:, 1] - ways[:, 0]
    one, other = b - a, c - a
    normal = np.cross(one, other)
    facing = (normal * step).sum(axis=1)
    flat = np.abs(facing) < 1e-9
    facing = np.where(flat, 1.0, facing)
    along = (normal * (a - start)).sum(axis=1) / facing
    aside = np.cross(start - a, step)
    u, v = -(other * aside).sum(axis=1) / facing, (one * aside).sum(axis=1) / facing
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    return np.asarray(~flat & inside & (along > 0.0) & (along < 1.0))


def before_camera(eye: Floats, target: Floats, static: Sequence[StaticPart]) -> Iterator[str]:
    """Yield things close to the axis of a standing camera, as far as that is above heads.

    Args:
        eye: Where the camera stands, (3,) [m].
        target: What it looks at, (3,) [m].
        static: All that does not move.
    """
    ahead = target - eye
    reach = float(np.linalg.norm(ahead))
    ahead = ahead / reach
    if ahead[2] < 0.0:
        reach = max(0.0, reach + VIEW / float(ahead[2]))
    for part in _things(static):
        points = _spread(part)
        along = np.clip((points - eye) @ ahead, 0.0, reach)
        away = np.linalg.norm(points - eye - along[:, None] * ahead, axis=1)
        near = int(np.argmin(away))
        if away[near] < VIEW:
            x, y, z = points[near]
            yield (
                f"{part.id} is {away[near]:.2f} m from the camera's axis"
                f" at ({x:.2f}, {y:.2f}, {z:.2f}), {along[near]:.1f} m ahead"
            )


def _things(static: Sequence[StaticPart]) -> Iterator[StaticPart]:
    """Parts of what stands on the ground."""
    return (part for part in static if part.family not in _GROUND and len(part.part.mesh.faces))


def _spread(part: StaticPart) -> Floats:
    """Corners and middles of a part's triangles, (n, 3) [m]."""
    mesh = part.part.mesh
    return np.concatenate([mesh.vertices, mesh.vertices[mesh.faces].mean(axis=1)])


# The network's own description --------------------------------------------------------------


def _is_drawn(edge: Edge, lane: Lane) -> bool:
    """Whether a lane has a surface of its own: waterways have none, nor lanes without length."""
    length = float(np.hypot(*np.ptp(lane.shape[:, :2], axis=0)))
    return not _is_waterway(lane) and length >= (1e-3 if edge.function == "internal" else 0.05)


def _is_waterway(lane: Lane) -> bool:
    """Whether a lane is for ships alone."""
    return bool(lane.allowed) and lane.allowed <= {"ship"}


def _lane_area(lane: Lane) -> shapely.Geometry:
    """A lane from above: its line, as wide as it is."""
    line = shapely.LineString(lane.shape[:, :2])
    return line.buffer(0.5 * lane.width, cap_style="flat", join_style="mitre", mitre_limit=2.0)


def _outline(points: Floats) -> shapely.Geometry:
    """An outline as an area."""
    if len(points) < 3:
        return shapely.Polygon()
    return shapely.make_valid(shapely.Polygon(points[:, :2]))


def _place(shape: shapely.Geometry) -> str:
    """A point of a shape, as text."""
    point = shape.representative_point()
    return f"({point.x:.2f}, {point.y:.2f})"
