"""What lanes are for, and so what they look like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

from sumo3dviz_pt.job.settings import EdgeStyle, RoadSettings
from sumo3dviz_pt.library.street.road_styles import STYLES, style_name
from sumo3dviz_pt.model.network import Edge, Lane, Network

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
        surface: A surface key, see `library/materials/by_key.py`.
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
