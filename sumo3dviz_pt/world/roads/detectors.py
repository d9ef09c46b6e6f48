"""Loops of detectors: slots that were sawn into the asphalt and sealed.

They are drawn only if the scene file asks for them: SUMO's detectors often stand for cameras, or
for nothing that a street has. What has no body at all is named among what is left out.

References:
    Traffic Detector Handbook, 3rd edition, FHWA-HRT-06-108, 2006, chapter 5: loops of 1.8 m by
    1.8 m with cut corners and a slot to the edge of the pavement. The sealed line is drawn wider
    than the slot of 6 to 10 mm, as sealant lies beside it, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.job.settings import ObjectsSettings
from sumo3dviz_pt.library.materials import KERB
from sumo3dviz_pt.library.mesh.bands import on_lane, without_repeats
from sumo3dviz_pt.model.geometry import Floats, arc_length
from sumo3dviz_pt.model.network import Lane
from sumo3dviz_pt.model.scene import LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import Loop, Scenario
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.roads.markings.lines import Paint
from sumo3dviz_pt.world.roads.markings.markings import decal_meshes
from sumo3dviz_pt.world.roads.roads import RoadParts

_MATERIAL = "sealant"
_LIFT = 0.0042  # between repairs and paint [m]
_LONG, _CORNER = 1.8, 0.25  # length of a loop, and what is cut off its corners [m]
_BESIDE = 0.6  # between a loop and the borders of its lane [m]
_LINE = 0.025  # width of sealant [m]
_REACH = 150.0  # loops farther from every camera are too fine to be seen [m]


@dataclass(frozen=True, slots=True, eq=False)
class LoopParts:
    """Loops in the asphalt.

    Attributes:
        static: Their sealant.
        left_out: What is not drawn of all that detects, counts or steers.
    """

    static: tuple[StaticPart, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def build_loops(
    scenario: Scenario, settings: ObjectsSettings, roads: RoadParts, around: Surroundings
) -> LoopParts:
    """Build the loops of a scenario's detectors near the cameras.

    Args:
        scenario: Has them.
        settings: Whether they are drawn.
        roads: What they are sawn into.
        around: Where cameras are.
    """
    left_out = [
        LeftOut(f"{count} {name}", "they have no body on a street")
        for name, count in sorted(scenario.unseen.items())
    ]
    loops = scenario.loops
    if loops and not settings.detectors:
        left_out.append(LeftOut(f"{len(loops)} detector loops", "`objects.detectors` is not set"))
        loops = ()
    paint = [one for loop in loops if (one := _slots(loop, scenario, around)) is not None]
    if not paint:
        return LoopParts(left_out=tuple(left_out))
    below = [
        part.part.mesh
        for part in roads.static
        if part.id.count("/") == 1 and part.id.startswith("road/") and part.part.material != KERB
    ]
    meshes = decal_meshes(paint, roads.layout, surface=below, lift=_LIFT)
    static = tuple(
        StaticPart(f"road/loops/{name}", "roads", Part(mesh, name)) for name, mesh in meshes.items()
    )
    return LoopParts(static, tuple(left_out))


def _slots(loop: Loop, scenario: Scenario, around: Surroundings) -> Paint | None:
    """The sealant of one loop; None far from cameras, and where no lane has room."""
    lane = scenario.network.lanes.get(loop.lane)
    if lane is None:
        return None
    middle = without_repeats(lane.shape)
    length = float(arc_length(middle[:, :2])[-1])
    at = loop.at + lane.length if loop.at < 0.0 else loop.at
    station = float(np.clip(at * length / max(lane.length, 1e-9), 0.0, length))
    half = min(0.5 * _LONG, 0.5 * length)
    station = float(np.clip(station, half, length - half))
    side = 0.5 * lane.width - _BESIDE
    if side < 2.0 * _CORNER or half < 2.0 * _CORNER:
        return None
    place = on_lane(np.array([[station, 0.0]]), middle)
    if float(around.distances(place[:, :2])[0]) > _REACH:
        return None
    outward = _outward(lane, left_hand=scenario.network.left_hand)
    quads = [_quad(a, b) for a, b in _lines(station, half, side, outward=outward)]
    return Paint(lane.edge_id, _MATERIAL, on_lane(np.array(quads), middle))


def _outward(lane: Lane, *, left_hand: bool) -> float:
    """The half of a lane's width towards the kerb, to the left [m]."""
    return 0.5 * lane.width if left_hand else -0.5 * lane.width


def _lines(
    station: float, half: float, side: float, *, outward: float
) -> Sequence[tuple[Floats, Floats]]:
    """The lines of a loop and of the slot to the lane's border, by station and offset [m]."""
    c = _CORNER
    ring = np.array([
        (half, side - c), (half - c, side), (c - half, side), (-half, side - c),
        (-half, c - side), (c - half, -side), (half - c, -side), (half, c - side),
    ])  # fmt: skip
    ring[:, 0] += station
    slot = np.array([(station, np.sign(outward) * side), (station, outward)])
    return [*zip(ring, np.roll(ring, -1, axis=0), strict=True), (slot[0], slot[1])]


def _quad(start: Floats, end: Floats) -> Floats:
    """A line as wide as its sealant, corners counter-clockwise, (4, 2) [m]."""
    along = (end - start) / np.hypot(*(end - start))
    across = 0.5 * _LINE * np.array([-along[1], along[0]])
    return np.stack([start - across, end - across, end + across, start + across])
