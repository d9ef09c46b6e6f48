"""Slabs beside lanes: parking bays, platforms and yards of stops, and where JuPedSim walks.

Bays lie level with the road, because that is the height at which SUMO parks cars. Walkable areas
of JuPedSim lie level with footways, so that no kerb stands between both; its obstacles are columns
where they are slim, else low blocks, unless a param `height` says more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.library.materials import KERB, metres_per_tile, planar_uvs
from sumo3dviz_pt.library.mesh.bands import walls
from sumo3dviz_pt.library.mesh.planar import (
    areal,
    closing,
    polygon_parts,
    subtract,
    triangulate_many,
    union,
)
from sumo3dviz_pt.library.street.furniture import FURNITURE, SHELTER
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform, arc_length
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.scene import LeftOut, Part
from sumo3dviz_pt.model.traffic import Bay, ParkingArea, Polygon, Scenario, Stop
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT
from sumo3dviz_pt.world.street.places import offset

SOURCE = "stops"
"""The `source` of the areas of stops."""

REACH = 1500.0
"""Slabs farther from every camera than this are left out [m]."""

_DETAIL = 400.0  # lines, shelters and posts lie at most this far from a camera [m]
_LINE = 0.10  # width of lines [m]
_AISLE = 3.2  # half of the widest lane between facing rows of bays [m]
_PLATFORM, _YARD = 3.0, 8.0  # depth of platforms and of yards for containers [m]
_GAP = 0.08  # between rails' lane and platform [m]
_DEFAULT_TOP = 0.55
_TOPS: Mapping[str, float] = {"tram": 0.28, "rail_urban": 0.76, "subway": 0.95}
"""Heights of platforms over the lane, by vClass [m]."""

_POSTS = 4  # charging posts at a station, at most
_DEEP = 0.4  # how far walls of slabs go into the ground [m]
_SMALLEST = 3.0  # smaller pieces of platforms are left out [m2]

WALKABLE, OBSTACLE = "jupedsim.walkable_area", "jupedsim.obstacle"
"""Types of polygons that SUMO's pedestrian model JuPedSim reads."""

_OVER_GROUND = 0.03 + SIDEWALK_HEIGHT  # of footways; the ground lies below roads [m]
_SLIM, _COLUMN, _BLOCK = 1.2, 2.6, 0.9  # width of columns at most, heights of both sorts [m]
_TALLEST = 60.0  # of obstacles [m]
_STEPPED_ON = frozenset({"platform", "plaza"})
_SAME_LEVEL = 3.0  # people farther above or below a plaza are not on it [m]
_STEP_OFF = 0.4  # people climb and leave slabs over this distance beside them [m]


@dataclass(frozen=True, slots=True, eq=False)
class Paving:
    """What is paved beside roads.

    Attributes:
        shapes: In plan [m].
        top_at: Its height at places, (n, 2) -> (n,) [m].
    """

    shapes: Sequence[shapely.Polygon]
    top_at: HeightAt


@dataclass(frozen=True, slots=True, eq=False)
class Slab:
    """A slab beside a lane.

    Attributes:
        id: Unique.
        kind: `bays`, `platform`, `yard`, `plaza` or `obstacle`.
        shape: Its outline, which roads may cut [m].
        bays: Of a parking area.
        top: Height over the road beside it, or of an obstacle over what it stands on [m].
        lane: The lane beside it; None where JuPedSim walks.
        line: Its border towards the lane, (n, 2) [m].
    """

    id: str
    kind: str
    shape: shapely.Geometry
    bays: tuple[Bay, ...]
    top: float
    lane: Lane | None
    line: Floats


@dataclass(frozen=True, slots=True, eq=False)
class SlabGround:
    """What slabs are laid by.

    Attributes:
        outline: Everything that is paved.
        raised: Footways among it.
        standing: Height of whatever lies on top: road, footway or ground.
        ground_at: Height of the ground.
        around: Cameras and memory.
        near: A point of the network [m] near which texture coordinates are small.
    """

    outline: Sequence[shapely.Geometry]
    raised: Sequence[shapely.Geometry]
    standing: HeightAt
    ground_at: HeightAt
    around: Surroundings
    near: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """What people step onto.

    Attributes:
        shape: In plan [m].
        top: How far it lies above the lane's height [m].
        top_at: Its height at places, (n, 2) -> (n,) [m]; None where lanes lead along it.
    """

    shape: shapely.Polygon
    top: float
    top_at: HeightAt | None = None

    def climbed(self, points: Floats, rise: Floats, share: Floats) -> Floats:
        """Return the extra height at points beside it or on it, (n,) [m].

        Args:
            points: (n, 2 or 3) [m].
            rise: That of footways there, (n,) [m].
            share: How far people have climbed, (n,) in [0, 1].
        """
        if self.top_at is None:
            return np.maximum(rise, share * self.top)
        over = np.full(len(points), self.top)
        if points.shape[1] > 2:
            known = self.top_at(points[:, :2]) - points[:, 2]
            over = np.where(np.abs(known) < _SAME_LEVEL, known, rise)
        return np.asarray(rise + share * (over - rise))


@dataclass(frozen=True, slots=True, eq=False)
class SlabParts:
    """Slabs, ready for the scene.

    Attributes:
        parts: With materials whose names begin with `area:` where they show a surface.
        pavings: What they cover; no two slabs share a place.
        left_out: What has no room.
        steps: What people step onto.
    """

    parts: tuple[Part, ...] = ()
    pavings: tuple[Paving, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    steps: tuple[Step, ...] = ()

    @property
    def shapes(self) -> tuple[shapely.Polygon, ...]:
        """What all of them cover."""
        return tuple(shape for some in self.pavings for shape in some.shapes)

    def walked_on(self, footway: HeightAt) -> HeightAt:
        """Return the extra height of all that people walk on: footways, platforms and plazas.

        Args:
            footway: The same of footways alone, (n, 2 or 3) [m] -> (n,) [m].

        Returns:
            The same of all. Given heights, too, (n, 3), people on a plaza stand on it, whatever
            height a lane far away gave them.
        """
        if not self.steps:
            return footway
        tree = shapely.STRtree([step.shape for step in self.steps])

        def rise_at(points: Floats) -> Floats:
            """Return the extra height at points, (n, 2 or 3) -> (n,) [m]."""
            rise = np.array(footway(points), dtype=np.float64)
            flat = np.asarray(points, dtype=np.float64)
            spots = shapely.points(flat[:, :2])
            near, number = tree.query(spots, predicate="dwithin", distance=_STEP_OFF)
            share = eased(1.0 - shapely.distance(spots[near], tree.geometries[number]) / _STEP_OFF)
            for k in np.unique(number).tolist():
                own, part = near[number == k], share[number == k]
                rise[own] = self.steps[k].climbed(flat[own], rise[own], part)
            return rise

        return rise_at


def slabs_of(scenario: Scenario) -> tuple[Slab, ...]:
    """Return the slabs of a scenario's parking areas, platforms, yards and walkable areas."""
    network = scenario.network
    slabs = [slab for area in scenario.parking if (slab := _parking(area, network)) is not None]
    for stop in scenario.stops:
        lane = network.lanes.get(stop.lane)
        if lane is None or stop.kind not in ("train", "container"):
            continue
        deep = _PLATFORM if stop.kind == "train" else _YARD
        kind = "platform" if stop.kind == "train" else "yard"
        line, shape = _strip(lane, stop, deep, left_hand=network.left_hand)
        tops = [_TOPS.get(name, _DEFAULT_TOP) for name in sorted(lane.allowed) if name in _RAILS]
        top = min(tops, default=_DEFAULT_TOP) if kind == "platform" else 0.0
        slabs.append(Slab(f"{stop.kind}:{stop.id}", kind, shape, (), top, lane, line))
    return (*slabs, *_walked(scenario.polygons))


def _walked(polygons: Sequence[Polygon]) -> list[Slab]:
    """Where JuPedSim lets people walk, and what stands in their way outside of buildings."""
    rings = {kind: [p for p in polygons if p.type == kind] for kind in (WALKABLE, OBSTACLE)}
    slabs = [_of_jupedsim(item, "plaza", SIDEWALK_HEIGHT) for item in rings[WALKABLE]]
    if rings[OBSTACLE]:
        houses = [
            shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
            for item in polygons
            if len(item.shape) > 2 and kind_of(item.type, item.source) == "buildings"
        ]
        solid = shapely.STRtree(houses)
        for item in rings[OBSTACLE]:
            slab = _of_jupedsim(item, "obstacle", 0.0)
            if slab is not None and not len(solid.query(slab.shape, predicate="intersects")):
                slabs.append(replace(slab, top=_obstacle_height(item, slab.shape)))
    return [slab for slab in slabs if slab is not None]


def _of_jupedsim(item: Polygon, kind: str, top: float) -> Slab | None:
    """A polygon of JuPedSim as a slab; None for one without an area."""
    if len(item.shape) < 3:
        return None
    shape = areal(shapely.make_valid(shapely.Polygon(item.shape[:, :2])))
    if shape.is_empty:
        return None
    return Slab(f"{kind}:{item.id}", kind, shape, (), top, None, item.shape[:, :2])


def _obstacle_height(item: Polygon, shape: shapely.Geometry) -> float:
    """How high an obstacle is [m]."""
    try:
        given = float(item.params.get("height", ""))
    except ValueError:
        given = 0.0
    if 0.0 < given <= _TALLEST:
        return given
    return _COLUMN if shapely.minimum_bounding_radius(shape) * 2.0 <= _SLIM else _BLOCK


_RAILS = frozenset({"tram", "rail_urban", "rail", "rail_electric", "rail_fast", "subway"})


def slab_polygons(scenario: Scenario) -> tuple[Polygon, ...]:
    """Return slabs as areas on which nothing else may stand."""
    polygons = []
    for slab in slabs_of(scenario):
        for number, part in enumerate(polygon_parts(slab.shape)):
            ring = shapely.get_coordinates(part.exterior)
            polygons.append(Polygon(f"slab:{slab.id}:{number}", "slab", ring, True, None, SOURCE))
    return tuple(polygons)


def build_slabs(scenario: Scenario, ground: SlabGround) -> SlabParts:
    """Build the slabs, their lines, and the shelters and posts that stand at stops.

    Args:
        scenario: Its stops and parking areas.
        ground: What they are laid by.
    """
    slabs = ground.around.memory.of(("slabs",), partial(slabs_of, scenario))
    parts: list[Part] = []
    pavings: list[Paving] = []
    steps: list[Step] = []
    cramped = 0
    for slab in slabs:
        middle = np.array(slab.shape.centroid.coords[0])[None]
        away = float(ground.around.distances(middle)[0])
        if away > REACH:
            continue
        if slab.kind == "obstacle":
            parts += _block(slab, pavings, ground)
            continue
        low, high = np.reshape(slab.shape.bounds, (2, 2))
        near = _near(ground.outline, low, high)
        free = subtract(slab.shape, [union(near)]) if near else slab.shape
        pieces = [part for part in polygon_parts(free) if part.area > _SMALLEST]
        # Bays of two parking areas may share a place, which the first one paves.
        own = _apart(pieces, pavings)
        if slab.kind == "platform" and not pieces:
            cramped += 1
            continue
        pavings.append(Paving(own, _top_of(slab, ground)))
        steps += _steps_of(slab, own, ground)
        parts += _slab_parts(slab, own, ground)
        if away < _DETAIL:
            parts += _on_slab(slab, pieces, ground)
    shown = [stop for stop in scenario.stops if stop.kind == "charging"]
    for stop in shown:
        parts += _posts(stop, scenario.network, slabs, ground)
    why = LeftOut(f"{cramped} platforms", "there is no room beside the rails")
    left_out = (why,) if cramped else ()
    return SlabParts(tuple(parts), tuple(pavings), left_out, tuple(steps))


def _steps_of(slab: Slab, pieces: Sequence[shapely.Polygon], ground: SlabGround) -> list[Step]:
    """What people step onto of a slab; nothing of what only cars and containers use."""
    if slab.kind not in _STEPPED_ON:
        return []
    level = _top_of(slab, ground) if slab.lane is None else None
    return [Step(piece, slab.top, level) for piece in pieces]


def _block(slab: Slab, pavings: Sequence[Paving], ground: SlabGround) -> list[Part]:
    """An obstacle, upright on whatever is highest below it."""
    pieces = polygon_parts(slab.shape)
    ring = np.concatenate([shapely.get_coordinates(piece.exterior) for piece in pieces])
    below = float(ground.standing(ring).max())
    for paving in pavings:
        if any(shape.intersects(slab.shape) for shape in paving.shapes):
            below = max(below, float(paving.top_at(ring).max()))
    return _body(pieces, "concrete", lambda places: np.full(len(places), below + slab.top), ground)


def _near(shapes: Sequence[shapely.Geometry], low: Floats, high: Floats) -> list[shapely.Geometry]:
    """What of shapes lies near a box."""
    if not len(shapes):
        return []
    return [
        shape
        for shape in shapely.clip_by_rect(list(shapes), *(low - 2.0), *(high + 2.0))
        if not shape.is_empty
    ]


def _parking(area: ParkingArea, network: Network) -> Slab | None:
    """The asphalt of a parking area, from its bays to the lane."""
    lane = network.lanes.get(area.lane)
    if lane is None:
        return None
    side = 1.0 if network.left_hand else -1.0
    edge = offset(lane.shape, side * (lane.width / 2.0 + 0.02))[:, :2]
    border = shapely.LineString(edge)
    shapes: list[shapely.Geometry] = []
    for number, bay in enumerate(area.bays):
        corners = bay.corners()
        shape = shapely.Polygon(corners)
        if number < area.roadside:
            feet = shapely.line_interpolate_point(
                border, shapely.line_locate_point(border, shapely.points(corners))
            )
            shape = shapely.MultiPoint([*corners, *shapely.get_coordinates(feet)]).convex_hull
        shapes.append(shape.buffer(0.12, join_style="mitre"))
    whole = closing(union(shapes), _AISLE if not area.roadside else 0.3)
    return Slab(f"parking:{area.id}", "bays", whole, area.bays, 0.0, lane, edge)


def _strip(
    lane: Lane, stop: Stop, deep: float, *, left_hand: bool
) -> tuple[Floats, shapely.Geometry]:
    """The border of a strip beside a lane, (n, 2) [m], and the strip."""
    side = 1.0 if left_hand else -1.0
    shape = lane.shape[:, :2]
    knots = arc_length(shape)
    low, high = (share * knots[-1] for share in stop.span(lane.length))
    inner = knots[(knots > low + 0.01) & (knots < high - 0.01)]
    at = np.concatenate([[low], inner, [max(high, low + 1.0)]])
    part = np.column_stack([np.interp(at, knots, column) for column in shape.T])
    line = offset(part, side * (lane.width / 2.0 + _GAP))
    back = offset(part, side * (lane.width / 2.0 + _GAP + deep))
    strip = shapely.make_valid(shapely.Polygon(np.concatenate([line, back[::-1]])))
    return line, shapely.MultiPolygon(polygon_parts(strip))


def _apart(
    pieces: Sequence[shapely.Polygon], pavings: Sequence[Paving]
) -> Sequence[shapely.Polygon]:
    """What of pieces is not paved before."""
    whole = union(pieces)
    others = [shape for some in pavings for shape in some.shapes if shape.intersects(whole)]
    if not others:
        return pieces
    left = subtract(whole, [union(others)])
    return [part for part in polygon_parts(left) if part.area > _SMALLEST]


def _top_of(slab: Slab, ground: SlabGround) -> HeightAt:
    """Height of a slab at places, (n, 2) -> (n,) [m]: it follows its lane, or else the ground."""
    lane = slab.lane
    if lane is None:
        return lambda places: np.asarray(ground.ground_at(places) + _OVER_GROUND - 0.004)
    return lambda places: np.asarray(_lane_heights(lane, places) + slab.top - 0.004)


def _slab_parts(slab: Slab, pieces: Sequence[shapely.Polygon], ground: SlabGround) -> list[Part]:
    """A slab and its walls."""
    surface = {"bays": "asphalt_old", "yard": "concrete"}.get(slab.kind, "paving")
    return _body(pieces, surface, _top_of(slab, ground), ground)


def _on_slab(slab: Slab, pieces: Sequence[shapely.Polygon], ground: SlabGround) -> list[Part]:
    """What is painted or stands on a slab."""
    top_at = _top_of(slab, ground)
    if slab.kind == "bays":
        return _lines(_bay_lines(slab), pieces, top_at, ground)
    if slab.kind != "platform":
        return []
    edge = shapely.LineString(slab.line)
    stripe = edge.buffer(0.62, cap_style="flat").difference(edge.buffer(0.5, cap_style="flat"))
    return [*_lines([stripe], pieces, top_at, ground), *_shelter(slab, pieces, top_at)]


def _lane_heights(lane: Lane, places: Floats) -> Floats:
    """Height of a lane beside places, (n,) [m]."""
    shape = lane.shape
    knots = arc_length(shape[:, :2])
    at = shapely.line_locate_point(shapely.LineString(shape[:, :2]), shapely.points(places))
    return np.asarray(np.interp(at, knots, shape[:, 2]))


def _body(
    pieces: Sequence[shapely.Polygon], surface: str, top_at: HeightAt, ground: SlabGround
) -> list[Part]:
    """Top and walls of a slab."""
    whole = [shapely.orient_polygons(shapely.segmentize(piece, 3.0)) for piece in pieces]
    made = triangulate_many(whole)
    if not len(made.faces):
        return []
    points = np.column_stack([made.vertices, top_at(made.vertices)])
    uvs = planar_uvs(points, tile=metres_per_tile(surface), near=ground.near)
    parts = [Part(Mesh(points, made.faces, None, uvs), f"area:{surface}")]
    rings, feet = [], []
    for piece in whole:
        for ring in (piece.exterior, *piece.interiors):
            flat = shapely.get_coordinates(ring)[:-1]
            rings.append(np.column_stack([flat, top_at(flat)]))
            low = np.minimum(top_at(flat), ground.ground_at(flat)) - _DEEP
            feet.append(np.column_stack([flat, low]))
    return [*parts, Part(walls(rings, feet), KERB)]


def _bay_lines(slab: Slab) -> list[shapely.Geometry]:
    """Lines between bays; along a lane also towards it."""
    way = slab.line[-1] - slab.line[0]
    heading = np.arctan2(way[1], way[0])
    lines: list[shapely.Geometry] = []
    for bay in slab.bays:
        a, b, c, d = bay.corners()
        parallel = abs(np.sin(bay.yaw - heading)) < 0.2
        sides = ((a, b), (c, d), (b, c)) if parallel else ((b, c), (d, a))
        for one, other in sides:
            line = shapely.LineString([one, other])
            lines.append(line.buffer(_LINE / 2.0, cap_style="square"))
    return [union(lines)] if lines else []


def _lines(
    shapes: Sequence[shapely.Geometry],
    pieces: Sequence[shapely.Polygon],
    top_at: HeightAt,
    ground: SlabGround,
) -> list[Part]:
    """White lines on a slab and on footways, but not on carriageways."""
    if not shapes:
        return []
    whole = union(list(shapes))
    low, high = np.reshape(whole.bounds, (2, 2))
    roads = subtract(
        union(_near(ground.outline, low, high)), [union(_near(ground.raised, low, high))]
    )
    free = polygon_parts(shapely.segmentize(subtract(whole, [roads]), 1.0))
    made = triangulate_many(free)
    if not len(made.faces):
        return []
    places = made.vertices
    inside = np.zeros(len(places), dtype=np.bool_)
    for piece in pieces:
        inside |= shapely.intersects_xy(piece.buffer(0.02), places)
    z = top_at(places) + 0.006
    if not inside.all():
        z[~inside] = ground.standing(places[~inside]) + 0.010
    return [Part(Mesh(np.column_stack([places, z]), made.faces), "line_white")]


def _shelter(slab: Slab, pieces: Sequence[shapely.Polygon], top_at: HeightAt) -> list[Part]:
    """A shelter at the back of a platform, in its middle, where there is room."""
    line = shapely.LineString(slab.line)
    if line.length < SHELTER[0] + 2.0:
        return []
    middle = np.array(line.interpolate(0.5, normalized=True).coords[0])
    ahead = np.array(line.interpolate(min(0.5 + 1.0 / line.length, 1.0), normalized=True).coords[0])
    way = (ahead - middle) / max(float(np.hypot(*(ahead - middle))), 1e-9)
    inward = np.array(slab.shape.centroid.coords[0]) - middle
    normal = np.array([-way[1], way[0]])
    out = normal if normal @ inward > 0.0 else -normal
    place = middle + (_PLATFORM - SHELTER[1] / 2.0 - 0.3) * out
    foot = shapely.Point(place).buffer(SHELTER[1] / 2.0)
    if not any(shapely.covers(piece, foot) for piece in pieces):
        return []
    yaw = float(np.arctan2(-out[1], -out[0]))
    stand = Transform.from_pose((*place, float(top_at(place[None])[0])), yaw=yaw)
    return [replace(p, mesh=stand.mesh(p.mesh)) for p in FURNITURE["bus_shelter"](0)]


def _posts(stop: Stop, network: Network, slabs: Sequence[Slab], ground: SlabGround) -> list[Part]:
    """Posts of a charging station beside its lane, behind bays if there are some."""
    lane = network.lanes.get(stop.lane)
    if lane is None:
        return []
    low, high = (share for share in stop.span(lane.length))
    side = 1.0 if network.left_hand else -1.0
    count = int(np.clip((high - low) * lane.length / 6.0, 1, _POSTS))
    parts: list[Part] = []
    for k in range(count):
        share = low + (high - low) * (k + 0.5) / count
        spot = _post_spot(lane, share, side, slabs, ground)
        if spot is not None:
            place, yaw = spot
            z = float(ground.standing(place[None])[0])
            stand = Transform.from_pose((*place, z), yaw=yaw)
            posts: Callable[[int], list[Part]] = FURNITURE["charging_post"]
            parts += [replace(p, mesh=stand.mesh(p.mesh)) for p in posts(0)]
    return parts


def _post_spot(
    lane: Lane, share: float, side: float, slabs: Sequence[Slab], ground: SlabGround
) -> tuple[Floats, float] | None:
    """Where a post stands, (2,) [m], and its direction [rad]; None without room near a camera."""
    shape = lane.shape[:, :2]
    knots = arc_length(shape)
    at = share * knots[-1]
    spot = np.array([np.interp(at, knots, column) for column in shape.T])
    if float(ground.around.distances(spot[None])[0]) > _DETAIL:
        return None
    ends = np.clip([at - 0.5, at + 0.5], 0.0, knots[-1])
    a, b = (np.array([np.interp(end, knots, column) for column in shape.T]) for end in ends)
    way = (b - a) / max(float(np.hypot(*(b - a))), 1e-9)
    out = side * np.array([-way[1], way[0]])
    roads = subtract(
        union(_near(ground.outline, spot - 12.0, spot + 12.0)),
        [union(_near(ground.raised, spot - 12.0, spot + 12.0))],
    )
    for away in (0.55, 1.2, 2.4, 3.8, 5.6, 7.5):
        place = spot + (lane.width / 2.0 + away) * out
        point = shapely.Point(place)
        taken = [slab for slab in slabs if slab.kind == "bays" and slab.shape.dwithin(point, 0.25)]
        if not taken and not roads.dwithin(point, 0.3):
            return place, float(np.arctan2(-out[1], -out[0]))
    return None
