"""Lanes as strips between two borders: what they are for, and so what they look like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import EdgeStyle, RoadSettings
from sumo3dviz_pt.library.mesh.bands import offset, with_split_bends, without_repeats
from sumo3dviz_pt.library.street.road_styles import STYLES, style_name
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Connection, Edge, Lane, Network
from sumo3dviz_pt.world.memory import Memory

RAIL_CLASSES = frozenset(
    {"tram", "rail", "rail_urban", "rail_electric", "rail_fast", "subway", "cable_car"}
)
PAVING = "paving"
BICYCLE = "bicycle"
BICYCLES = (BICYCLE, "bicycle_green")
"""Surfaces of bicycle lanes in the colours of the road styles."""
BALLAST = "ground_stone"
GRASS_TRACK = "ground_grass"


@dataclass(frozen=True, slots=True)
class LaneLook:
    """How a lane is drawn.

    Attributes:
        surface: A surface key, see `library/materials.py`.
        raised: Whether it lies on the height of a kerb.
        lines: Whether carriageway lines are painted on it.
        rails: Whether two rails lie on it.
        width: [m].
    """

    surface: str
    raised: bool
    lines: bool
    rails: bool
    width: float


def style_of(edge_id: str, settings: RoadSettings) -> EdgeStyle:
    """Return how an edge is drawn: by the first override whose pattern fits, else as all roads."""
    patterns: Mapping[str, EdgeStyle] = settings.per_edge
    own = next((s for p, s in patterns.items() if fnmatchcase(edge_id, p)), EdgeStyle())
    width = None if settings.lane_width == "from_network" else settings.lane_width
    surface = own.surface or settings.surface
    return EdgeStyle(
        surface=surface,
        colour=own.colour or (None if own.surface else settings.colour),
        lane_width=own.lane_width or width,
        markings=settings.markings if own.markings is None else own.markings,
    )


def bicycle_surface(settings: RoadSettings) -> str:
    """Return the surface of bicycle lanes in the style of the settings; see `with_style`."""
    known = STYLES.get(settings.marking_style)
    return BICYCLE if known is None else known.bicycle_surface


def with_style(settings: RoadSettings, network: Network) -> RoadSettings:
    """Return settings that name the network's style where they left that to the network."""
    name = style_name(settings.marking_style, network)
    return settings.model_copy(update={"marking_style": name})


def is_skipped(lane: Lane) -> bool:
    """Return whether a lane is not drawn: waterways are not."""
    return bool(lane.allowed) and lane.allowed <= {"ship"}


def is_footway(lane: Lane) -> bool:
    """Return whether only pedestrians may use a lane."""
    return bool(lane.allowed) and lane.allowed <= {"pedestrian", "wheelchair"}


def has_rails(lane: Lane) -> bool:
    """Return whether a lane is for rail vehicles alone, or opened to trams on purpose.

    A lane without restrictions allows every class, so a tram counts only where
    other railways are kept out.
    """
    if lane.allowed and lane.allowed <= RAIL_CLASSES:
        return True
    return "tram" in lane.allowed and not lane.allowed & {"rail", "rail_electric"}


def look_of(lane: Lane, style: EdgeStyle, *, bicycle: str = BICYCLE) -> LaneLook:
    """Return how a lane of a normal edge is drawn.

    Args:
        lane: The lane.
        style: Of its edge.
        bicycle: Surface of bicycle lanes.
    """
    if is_footway(lane):
        return LaneLook(PAVING, raised=True, lines=False, rails=False, width=lane.width)
    rails = has_rails(lane)
    only_rails = bool(lane.allowed) and lane.allowed <= RAIL_CLASSES
    road = style.colour or style.surface or "asphalt"
    width = lane.width if style.lane_width is None or only_rails else style.lane_width
    if only_rails and "tram" not in lane.allowed:
        return LaneLook(BALLAST, raised=False, lines=False, rails=True, width=width)
    if only_rails:
        return LaneLook(road, raised=False, lines=False, rails=True, width=width)
    if lane.allowed and lane.allowed <= {"bicycle", "scooter"}:
        lines = bool(style.markings)
        return LaneLook(bicycle, raised=False, lines=lines, rails=False, width=lane.width)
    if "pedestrian" in lane.allowed and "passenger" not in lane.allowed:
        return LaneLook(PAVING, raised=False, lines=False, rails=False, width=lane.width)
    return LaneLook(road, raised=False, lines=bool(style.markings), rails=rails, width=width)


def junction_surface(network: Network, junction_id: str, settings: RoadSettings) -> str:
    """Return the surface key of most carriageway lanes that lead into a junction.

    Args:
        network: The network.
        junction_id: Of the junction.
        settings: Surfaces of roads.
    """
    junction = network.junctions[junction_id]
    lanes = [network.lanes[key] for key in junction.incoming_lanes if key in network.lanes]
    votes: dict[str, float] = {}
    for lane in lanes:
        if network.edges[lane.edge_id].function != "normal" or is_footway(lane):
            continue
        surface = look_of(lane, style_of(lane.edge_id, settings)).surface
        # Roads run on over a level crossing, and the track's bed does not.
        weight = 1e-6 if surface in {BICYCLE, BALLAST} else lane.width
        votes[surface] = votes.get(surface, 0.0) + weight
    road = settings.colour or settings.surface
    return max(votes, key=lambda key: (votes[key], key)) if votes else road


def is_quiet(edge: Edge) -> bool:
    """Return whether an edge is a 30 km/h street, which bears no lines in Europe."""
    return max((lane.speed for lane in edge.lanes if not is_footway(lane)), default=0.0) < 8.5


BoundsXY = tuple[float, float, float, float]
"""x0, y0, x1, y1 [m]."""

_SHARED = 1.0
"""Neighbouring lanes whose borders lie closer than this share one [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """A lane's surface.

    Attributes:
        lane: The lane.
        look: How it is drawn.
        right: Border on its right, (n, 3) [m].
        left: Border on its left, (n, 3) [m].
    """

    lane: Lane
    look: LaneLook
    right: Floats
    left: Floats

    @property
    def quads(self) -> Floats:
        """Corners, counter-clockwise from the right border's start, (n - 1, 4, 3) [m]."""
        right, left = self.right, self.left
        return np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)

    @property
    def polygon(self) -> shapely.Geometry:
        """The whole strip from above, valid."""
        ring = np.concatenate([self.right, self.left[::-1]])[:, :2]
        return shapely.make_valid(shapely.Polygon(ring))


def in_region(points: Floats, region: BoundsXY | None, *, margin: float = 0.0) -> bool:
    """Return whether the box around points touches a region.

    Args:
        points: (n, 2 or 3) [m].
        region: A box [m]; None is everywhere.
        margin: By which the points' box is widened [m].
    """
    if region is None or not len(points):
        return region is None
    low, high = points[:, :2].min(axis=0) - margin, points[:, :2].max(axis=0) + margin
    return bool((low <= region[2:]).all() and (high >= region[:2]).all())


def connections_in(network: Network, region: BoundsXY | None) -> tuple[Connection, ...]:
    """Return the connections that begin within a box [m]; None holds all."""
    if region is None:
        return network.connections
    x0, y0, x1, y1 = region

    def inside(connection: Connection) -> bool:
        x, y = network.lanes[connection.from_lane].shape[-1][:2]
        return bool(x0 <= x <= x1 and y0 <= y <= y1)

    return tuple(connection for connection in network.connections if inside(connection))


def distance_to(box: BoundsXY | None, points: Floats) -> Floats:
    """Return the distance from points, (n, 2 or 3), to a box [m], (n,); 0 without a box."""
    if box is None:
        return np.zeros(len(points))
    low, high = np.array(box[:2]), np.array(box[2:])
    outside = np.maximum(np.maximum(low - points[:, :2], points[:, :2] - high), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=1))


def lane_line(lane: Lane) -> Floats:
    """Return a lane's centre line with sharp bends split, (n, 3) [m]."""
    return with_split_bends(without_repeats(lane.shape))


def edge_strips(
    edge: Edge, settings: RoadSettings, *, left_hand: bool = False
) -> tuple[Strip, ...]:
    """Return strips of an edge's lanes from right to left; neighbours share their border exactly.

    Args:
        edge: The edge.
        settings: Surfaces and widths of lanes.
        left_hand: Whether lanes are counted from the left, as left-hand networks do.
    """
    style = style_of(edge.id, settings)
    strips: list[Strip] = []
    for lane in reversed(edge.lanes) if left_hand else edge.lanes:
        line = lane_line(lane)
        if is_skipped(lane) or len(line) < 2 or np.hypot(*np.ptp(line[:, :2], axis=0)) < 0.05:
            continue
        look = look_of(lane, style, bicycle=bicycle_surface(settings))
        right, left = offset(line, -0.5 * look.width), offset(line, 0.5 * look.width)
        before = strips[-1] if strips else None
        shared = None if before is None else _shared_border(before, line, lane)
        if before is not None and shared is not None:
            strips[-1] = Strip(before.lane, before.look, before.right, shared)
            right = shared
        strips.append(Strip(lane, look, np.round(right, 3), np.round(left, 3)))
    return tuple(strips)


def _shared_border(before: Strip, line: Floats, lane: Lane) -> Floats | None:
    """The border between a strip and the lane that follows it, if they touch.

    It goes by the network's widths, because cars keep to the network's centre
    lines even where the scene file makes lanes wider.
    """
    if abs(before.lane.index - lane.index) != 1 or len(before.right) != len(line):
        return None
    sides = [
        offset(lane_line(before.lane), 0.5 * before.lane.width),
        offset(line, -0.5 * lane.width),
    ]
    if np.abs(sides[0][:, :2] - sides[1][:, :2]).max() > _SHARED:
        return None
    return np.round(0.5 * (sides[0] + sides[1]), 3)


def cached_strips(
    edge: Edge, settings: RoadSettings, *, left_hand: bool, memory: Memory
) -> tuple[Strip, ...]:
    """Return what `edge_strips` gives, made once for all choices of roads.

    Args:
        edge: The edge.
        settings: Surfaces and widths of lanes.
        left_hand: Whether lanes are counted from the left.
        memory: Of the network's world.
    """
    make = partial(edge_strips, edge, settings, left_hand=left_hand)
    return memory.by_content.of(("strips", edge.id), make)


def network_strips(
    network: Network, settings: RoadSettings, *, region: BoundsXY | None, memory: Memory
) -> dict[str, tuple[Strip, ...]]:
    """Return strips of all normal edges that touch a region, by edge id.

    Args:
        network: The network.
        settings: Surfaces and widths of lanes.
        region: A box [m]; None is everywhere.
        memory: Of the network's world.
    """
    edges = (edge for edge in network.edges.values() if edge.function in {"normal", "connector"})
    return {
        edge.id: strips
        for edge in edges
        if any(in_region(lane.shape, region, margin=lane.width) for lane in edge.lanes)
        and (strips := cached_strips(edge, settings, left_hand=network.left_hand, memory=memory))
    }


def junction_of(internal_edge_id: str) -> str:
    """Return the junction that an internal edge, crossing or walking area belongs to.

    SUMO writes `:<junction>_<number>`, `:<junction>_c<number>`, `:<junction>_w<number>`.
    """
    return internal_edge_id[1:].rpartition("_")[0]


def is_driven(strip: Strip) -> bool:
    """Return whether motor vehicles drive on a strip."""
    allowed = strip.lane.allowed
    return not strip.look.rails and (not allowed or bool(allowed & {"passenger", "bus", "truck"}))
