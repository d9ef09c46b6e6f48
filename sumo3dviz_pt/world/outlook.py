"""What of a world one camera sees: which roads in detail, and its part of a shared place.

A small place has all of its roads in detail, a city those near cameras. A city has tens of
thousands of lanes, and a camera tells a kerb from a line of paint for a few hundred metres. So in a
dense place only tiles near cameras, and seen by them, get kerbs, paint and wear; the roads beyond
are plain ribbons. Which tiles they are depends on the camera; what is built in a tile of houses or
street furniture does not.

Cameras of one scene mostly stand within a few hundred metres. A report on them needs no more than
how much each of them sees, so the place is built once, as detailed as the nearest of them wants it,
and parted by squares. Films build each camera's own place.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.model.camera import CameraPath, in_view
from sumo3dviz_pt.model.geometry import Bools, Mesh
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.world.memory import Memory, Name
from sumo3dviz_pt.world.placement.surroundings import Surroundings, Tile, edges_in, tiles_seen
from sumo3dviz_pt.world.roads.strips import BoundsXY, in_region, junction_of

MOST_LANES = 3000
"""Places with more lanes in reach of a camera are built in detail near cameras only."""

REACH = 600.0
"""Up to this distance roads are built in detail there; cameras high above see farther [m]."""

_TILE = 250.0  # tiles of roads, those of street furniture [m]
_AROUND = 100.0  # what lies nearer than this is built in detail, whether it is seen or not [m]
DETAILED = (_TILE, _AROUND)
"""Side of the squares of which roads are built in detail, and how far beyond them [m]."""

_CLIMB = 6.0  # metres that a camera sees farther for each metre that it stands higher
_FARTHEST = 2000.0


@dataclass(frozen=True, slots=True, eq=False)
class RoadChoice:
    """The roads that are built.

    Attributes:
        name: Tells one choice of a network from another.
        region: Only what touches this box is built [m]; None is everywhere.
        detailed: Roads with all that belongs to them.
        plain: Roads that are too far to show more than their surface; None where there are none.
    """

    name: Name
    region: BoundsXY | None
    detailed: Network
    plain: Network | None = None


def choose_roads(network: Network, region: BoundsXY | None, around: Surroundings) -> RoadChoice:
    """Choose the roads that are built for a shot.

    Args:
        network: All roads.
        region: Nothing beyond this box is built [m]; None is no limit.
        around: The cameras, and what was built of the network's world.
    """
    memory = around.memory
    whole = RoadChoice((region,), region, network)
    if len(network.lanes) <= MOST_LANES or not len(around.viewpoints):
        return whole
    within = network if region is None else _within(network, region, memory)
    if len(within.lanes) <= MOST_LANES:
        return whole
    above = around.viewpoints[:, 2] - around.height_at(around.viewpoints[:, :2])
    reach = float(np.clip(REACH + _CLIMB * (above.max() - 15.0), REACH, _FARTHEST))
    tiles = tuple(tiles_seen(around, size=_TILE, reach=reach, beyond=_AROUND))
    detailed = memory.of(("near roads", region, tiles), partial(_in_tiles, within, tiles, memory))
    if len(detailed.edges) == len(within.edges):
        return whole
    rest = memory.of(("far roads", region, tiles), partial(_without, within, detailed))
    return RoadChoice((region, tiles), None, detailed, rest)


def _within(network: Network, region: BoundsXY, memory: Memory) -> Network:
    """Return the part of a network that touches a box."""

    def part() -> Network:
        box = shapely.box(*region)
        return _part(network, {edge.id for edge in edges_in(network, box, memory)}, [region])

    return memory.of(("within", region), part)


def _in_tiles(network: Network, tiles: tuple[Tile, ...], memory: Memory) -> Network:
    """Return the part of a network that touches some tiles."""
    edges = {edge.id for tile in tiles for edge in edges_in(network, tile.box(), memory)}
    return _part(network, edges & network.edges.keys(), [tile.bounds for tile in tiles])


def _part(network: Network, edges: set[str], boxes: Iterable[BoundsXY]) -> Network:
    """Return some edges of a network, the junctions in some boxes and what lies inside them."""
    some = list(boxes)
    junctions = {
        key: junction
        for key, junction in network.junctions.items()
        if any(in_region(junction.outline, box) for box in some)
    }
    own = {
        key: edge
        for key, edge in network.edges.items()
        if (key in edges if edge.function in _OWN else junction_of(key) in junctions)
    }
    return _network(network, set(own), set(junctions))


_OWN = ("normal", "connector")


def _without(network: Network, part: Network) -> Network:
    """Return what is left of a network without a part of it."""
    return _network(
        network, network.edges.keys() - part.edges.keys(), network.junctions.keys() - part.junctions
    )


def _network(network: Network, edges: set[str], junctions: set[str]) -> Network:
    """Return some edges and junctions of a network, in its order, and what connects them."""
    part = replace(
        network,
        edges={key: edge for key, edge in network.edges.items() if key in edges},
        junctions={key: node for key, node in network.junctions.items() if key in junctions},
    )
    lanes = part.lanes
    joined = tuple(
        connection
        for connection in network.connections
        if connection.from_lane in lanes
        and connection.to_lane in lanes
        and (not connection.via or connection.via in lanes)
    )
    return replace(part, connections=joined)


_ROADS = ("roads", "markings", "ground")
"""Families that are laid out by large squares, or all of which a camera of a small network has."""

_SQUARE = 32.0
"""Side of the squares by which a place is parted [m]."""

_TALL = 12.0
"""What stands on a square reaches so far above it and beyond it, about [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """What a report needs of a shot, which it counts and does not render.

    Attributes:
        camera_path: Ways of all cameras that share the shot's place; None where it is alone.
        memory: Holds the place, which may be larger than all else that a world remembers.
    """

    camera_path: CameraPath | None = None
    memory: Memory = field(default_factory=Memory)


def seen_of(
    static: Sequence[StaticPart], camera_path: CameraPath, *, lanes: int
) -> tuple[StaticPart, ...]:
    """Return what a camera's own place would hold of a shared one, about.

    Args:
        static: Of the shared place.
        camera_path: Where the camera is and looks.
        lanes: Of the network; roads of small ones are built whatever a camera sees.
    """
    whole = _ROADS if lanes <= MOST_LANES else ()
    seen_parts = []
    for part in static:
        shown = part
        if part.family not in whole and len(part.part.mesh.faces):
            roads = part.family in _ROADS
            shown = _with_faces(part, _seen(part.part.mesh, camera_path, roads=roads))
        seen_parts.append(shown)
    return tuple(part for part in seen_parts if len(part.part.mesh.faces))


def _seen(mesh: Mesh, camera_path: CameraPath, *, roads: bool) -> Bools:
    """Which faces of a mesh lie in squares that a camera sees, (m,)."""
    size, beyond = DETAILED if roads else (_SQUARE, _TALL)
    middles = mesh.vertices[mesh.faces[:, 0]]
    places = np.floor(middles[:, :2] / size).astype(np.int64)
    low, high = places.min(axis=0), places.max(axis=0)
    own = np.ravel_multi_index(tuple((places - low).T), tuple(high - low + 1))
    counts = np.bincount(own)
    used = np.flatnonzero(counts)
    heights = np.bincount(own, weights=middles[:, 2])[used] / counts[used]
    cells = low + np.column_stack(np.unravel_index(used, tuple(high - low + 1)))
    centres = np.column_stack([(cells + 0.5) * size, heights])
    seen = np.zeros(len(counts), dtype=np.bool_)
    seen[used] = in_view(camera_path, centres, radius=size * 0.5**0.5 + beyond).any(axis=1)
    return np.asarray(seen[own])


def _with_faces(part: StaticPart, shown: Bools) -> StaticPart:
    """Return a part with some of its faces."""
    if shown.all():
        return part
    mesh, tint = part.part.mesh, part.part.tint
    runs = [name for name, _ in mesh.things]
    owner = np.repeat(np.arange(len(runs)), [count for _, count in mesh.things])
    counts = np.bincount(owner[shown], minlength=len(runs)).tolist() if runs else []
    things = tuple((name, count) for name, count in zip(runs, counts, strict=True) if count)
    some = replace(mesh, faces=mesh.faces[shown], things=things)
    return replace(
        part, part=replace(part.part, mesh=some, tint=None if tint is None else tint[shown])
    )
