"""Where signal heads stand: at every signalled stop line and crossing.

Vehicles: a pole 0.7 m beyond the edge's outer border (right in right-hand traffic),
sidewalk and bicycle lane included, 4.5 m behind the stop line, so that the pictures of drivers
who wait at the line show it, or nearer where a carriageway is in the way; it carries one head per
different course of the edge, in lane order. Edges with three or more signalled lanes
also get an arm with heads over each lane. Pedestrians: a pole at either end of a
crossing, or the pole of a road's heads or of another crossing that stands near.

References:
    Distance from stop line to signal: FGSV, Richtlinien fuer Lichtsignalanlagen (RiLSA),
    which asks for 2.5 m at least and 3.5 m usually.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Connection, Edge, Network
from sumo3dviz_pt.world.placement.driven_ground import DrivenGround
from sumo3dviz_pt.world.signals.beyond import far_side_heads
from sumo3dviz_pt.world.signals.heads import (
    ARM_BOTTOM,
    BESIDE,
    POLE_BOTTOM,
    RAIL_BOTTOM,
    SPACING,
    UP,
    WALK_BOTTOM,
    WALKS,
    WIDE,
    CourseOf,
    Head,
    HeadDesign,
    SignalGroup,
    Stand,
    Support,
    direction_at_end,
    freest,
    kind_of,
    leftward,
    row_offsets,
)
from sumo3dviz_pt.world.signals.sharing import with_shared_poles

_BEHIND = (4.5, 3.5, 2.0)  # places behind the stop line that are tried first [m]
_LAST = 0.5  # and the last one [m]
_STEPS = np.arange(0.0, 8.0, 0.5)  # how far a pole may move outwards [m]
_RAIL_BESIDE = 2.6  # from a track's middle to the mast of its signal [m]


def sites(
    network: Network,
    links: Sequence[Connection],
    *,
    ground: DrivenGround,
    course_of: CourseOf,
    lamps: int,
    far_side: str = "never",
) -> tuple[list[Head], list[Support]]:
    """Place signal heads and what carries them.

    Args:
        network: The road network.
        links: Signalled connections.
        ground: Keeps poles off carriageways.
        course_of: Says what a head for a link shows.
        lamps: Of a head for vehicles, 2 or 3.
        far_side: When a head stands beyond the junction, too; as in `SignalStyle`.
    """
    heads: list[Head] = []
    supports: list[Support] = []
    design = HeadDesign(network, ground, course_of, lamps, far_side)
    for edge, own in _by_edge(network, links).items():
        if network.edges[edge].function in WALKS:
            made = _crossing(network.edges[edge], design.groups(own, lamps=2), ground)
        elif all(kind_of(network, link) == "rail" for link in own):
            made = _rail_signal(network, network.edges[edge], own, design)
        else:
            made = _approach(network, network.edges[edge], own, design)
        heads += made[0]
        supports += made[1]
    return with_shared_poles(heads, supports)


def _by_edge(network: Network, links: Sequence[Connection]) -> Mapping[str, list[Connection]]:
    """Links by the edge whose end they guard, or by the crossing they let people onto."""
    found: dict[str, list[Connection]] = {}
    for link in links:
        start, end = (
            network.edges[network.lanes[lane].edge_id] for lane in (link.from_lane, link.to_lane)
        )
        if start.function in WALKS:
            crossing = end if end.function == "crossing" else start
            found.setdefault(crossing.id, []).append(link)
        elif start.function != "internal":
            found.setdefault(start.id, []).append(link)
    return found


def _approach(
    network: Network, edge: Edge, links: list[Connection], design: HeadDesign
) -> tuple[list[Head], list[Support]]:
    """Heads at the end of an edge."""
    # Choose what the heads on the pole show.
    lamps = design.lamps
    number = {lane.id: lane.index for lane in edge.lanes}
    links = sorted(links, key=lambda link: (number[link.from_lane], link.link_index))
    groups = design.groups(links, lamps=lamps)
    # Find a place for the pole.
    along, yaw = direction_at_end(edge.lanes[0].shape)
    outward = leftward(along) if network.left_hand else -leftward(along)
    bar = (len(groups) - 1) * SPACING
    # Lanes that end beside the pole do not cover its place behind their ends: probe there too.
    places = _feet(edge, along, outward, bar)
    row = [offset * -outward for offset in row_offsets(len(groups))]
    foot = freest(places, row, design.ground, wishes=(-2.0 * along, -4.5 * along))
    stand = Stand(foot, foot + POLE_BOTTOM * UP, -outward, along, yaw)
    heads = stand.row(groups, lamps=lamps)
    # Where the road is wide, an arm carries heads over each lane.
    driven = [k for k in links if kind_of(network, k) in ("vehicle", "tram")]
    over = {k.from_lane for k in driven}
    lanes = [lane for lane in edge.lanes if lane.id in over]
    height = POLE_BOTTOM + 0.3 * lamps + 0.12
    if len(lanes) < WIDE:
        beyond = far_side_heads(edge, driven, heads, groups, design)
        return [*heads, *beyond[0]], [Support(foot, yaw, height, bar=bar), *beyond[1]]
    for lane in lanes:
        own = design.groups([k for k in links if k.from_lane == lane.id], lamps=lamps)
        across = float((lane.shape[-1] - foot) @ -outward)
        bottom = foot - across * outward + (ARM_BOTTOM + 0.3 * (3 - lamps)) * UP
        heads += replace(stand, bottom=bottom).row(own, lamps=lamps)
    reach = max((float((lane.shape[-1] - foot) @ leftward(along)) for lane in lanes), key=abs)
    reach += 0.5 * float(np.sign(reach))
    beyond = far_side_heads(edge, driven, heads, groups, design)
    return [*heads, *beyond[0]], [Support(foot, yaw, ARM_BOTTOM + 1.0, reach, bar), *beyond[1]]


def _rail_signal(
    network: Network, edge: Edge, links: list[Connection], design: HeadDesign
) -> tuple[list[Head], list[Support]]:
    """A mast at the right of each track (left where traffic keeps left), at its end."""
    heads: list[Head] = []
    supports: list[Support] = []
    for lane in edge.lanes:
        groups = design.groups([k for k in links if k.from_lane == lane.id], lamps=2)
        if not groups:
            continue
        along, yaw = direction_at_end(lane.shape)
        outward = leftward(along) if network.left_hand else -leftward(along)
        aside = _RAIL_BESIDE + np.array([0.0, 0.4, -0.4, 0.8, 1.2, 1.8, 2.4, 3.0])
        back = np.array([0.0, -4.0, -8.0, -15.0, -25.0])
        places = lane.shape[-1] + (back[:, None, None] * along + aside[:, None] * outward)
        foot = freest(places.reshape(-1, 3), (), design.ground, margin=0.55)
        stand = Stand(foot, foot + RAIL_BOTTOM * UP, -outward, along, yaw)
        heads += stand.row(groups, lamps=2)
        bar = (len(groups) - 1) * SPACING
        supports.append(Support(foot, yaw, RAIL_BOTTOM + 0.75, bar=bar, rail=True))
    return heads, supports


def _crossing(
    edge: Edge, groups: Sequence[SignalGroup], ground: DrivenGround
) -> tuple[list[Head], list[Support]]:
    """Heads at both ends of a crossing, each looking over the road."""
    lane = edge.lanes[0]
    heads: list[Head] = []
    supports: list[Support] = []
    for shape in (lane.shape, lane.shape[::-1]):
        along, yaw = direction_at_end(shape)
        beside = -leftward(along) * (lane.width / 2 + 0.35)
        places = [
            shape[-1] + out * along + side * beside
            for side in (1.0, -1.0, 1.5, -1.5)
            for out in (0.4, 0.1, 0.9, 1.5, 2.2, 3.0)
        ]
        foot = freest(np.array(places), (), ground)
        stand = Stand(foot, foot + WALK_BOTTOM * UP, leftward(along), along, yaw)
        heads += stand.row(groups, lamps=2)
        bar = (len(groups) - 1) * SPACING
        supports.append(Support(foot, yaw, WALK_BOTTOM + 0.7, bar=bar))
    return heads, supports


def _feet(edge: Edge, along: Floats, outward: Floats, bar: float) -> Floats:
    """Places for a pole with a crossbar at an edge's end, best first, (n, 3) [m]."""
    outer, inner = edge.lanes[0], edge.lanes[-1]
    border = outer.shape[-1] + (outer.width / 2 + BESIDE + bar / 2) * outward
    near = [border + behind * along + _STEPS[:4, None] * outward for behind in _BEHIND]
    far = border + _LAST * along + _STEPS[:, None] * outward
    opposite = inner.shape[-1] + _LAST * along - (inner.width / 2 + BESIDE) * outward
    return np.vstack([*near, far, opposite])
