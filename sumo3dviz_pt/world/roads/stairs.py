"""Stairs: steps on lanes whose edge is of a type such as `highway.steps` and that climb.

SUMO knows stairs as sloped lanes of which OpenStreetMap says that they are steps, and logs people
on the slope. Treads lie on it or above it, so that nothing shows through; people walk at the mean
height of treads, as no leg is drawn that climbs.

References:
    Blondel's rule, 2 risers + 1 tread = 60 to 65 cm (F. Blondel, Cours d'architecture, 1683), and
    the risers of DIN 18065 (14 to 20 cm): outdoors usually 15 to 16 cm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.bands import offset, without_repeats
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT
from sumo3dviz_pt.world.roads.strips import BoundsXY, distance_to

_RISER = 0.16  # [m]
_SHALLOWEST = 0.25  # treads are no shorter than this, however steep the slope is [m]
_FLATTEST = 0.05  # slopes below this are landings, not steps
_REACH = 150.0  # beyond this distance from the camera's path steps are not told from a slope [m]
_INSET = 0.02  # sides lie so far within those of the footway [m]
_SUNK = 0.05  # and reach so far below its surface [m]
_SAME = 0.5  # lanes whose ends lie nearer than this are one flight of stairs in two directions [m]
_CLIMBED = 0.3  # people step onto stairs over this distance [m]
_QUADS = np.array([
    # Corners: lower end right and left, upper end right and left; high, then the same low.
    # Tread, riser, right side, left side.
    (0, 2, 3, 1), (0, 1, 5, 4), (0, 4, 6, 2), (1, 3, 7, 5),
])  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Stairs:
    """All steps near a camera.

    Attributes:
        mesh: Treads, risers and sides.
        flights: In plan, (n,) [m].
        lifts: How far the mean of treads lies above the slope, (n,) [m].
    """

    mesh: Mesh
    flights: tuple[shapely.Polygon, ...] = ()
    lifts: tuple[float, ...] = ()

    def walked_on(self, footway: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
        """Return the extra height of footways with stairs on them.

        Args:
            footway: The same of footways alone, (n, 2) [m] -> (n,) [m].
        """
        if not self.flights:
            return footway
        tree, lifts = shapely.STRtree(self.flights), np.array(self.lifts)

        def rise_at(points: Floats) -> Floats:
            """Return the extra height at points, (n, 2) -> (n,) [m]."""
            spots = shapely.points(np.asarray(points, dtype=np.float64)[:, :2])
            near, flight = tree.query(spots, predicate="dwithin", distance=_CLIMBED)
            away = shapely.distance(spots[near], tree.geometries[flight])
            lift = np.zeros(len(spots))
            np.maximum.at(lift, near, eased(1.0 - away / _CLIMBED, lifts[flight]))
            return np.asarray(footway(points) + lift)

        return rise_at


def stairs_of(network: Network, focus: BoundsXY | None) -> Stairs:
    """Build the stairs of a network.

    Args:
        network: The network.
        focus: Box around the camera's path [m]; None has no stairs.
    """
    meshes: list[Mesh] = []
    flights: list[shapely.Polygon] = []
    lifts: list[float] = []
    known: list[Floats] = []
    for edge in network.edges.values() if focus is not None else ():
        if edge.function != "normal" or not edge.type.split("|")[0].endswith("steps"):
            continue
        for lane in edge.lanes:
            if distance_to(focus, lane.shape[:, :2]).min() > _REACH or _is_known(lane, known):
                continue
            for quad in _slopes(lane):
                mesh, riser = _steps(quad)
                meshes.append(mesh)
                flights.append(shapely.Polygon(quad[[0, 1, 3, 2], :2]))
                lifts.append(riser / 2.0)
    return Stairs(merge_meshes(meshes), tuple(flights), tuple(lifts))


def _is_known(lane: Lane, known: list[Floats]) -> bool:
    """Whether a lane lies on an earlier one, whose ends grow by its own if not."""
    ends = lane.shape[[0, -1], :2]
    for other in known:
        if min(np.abs(ends - other).max(), np.abs(ends - other[::-1]).max()) < _SAME:
            return True
    known.append(ends)
    return False


def _slopes(lane: Lane) -> list[Floats]:
    """Straight pieces of a lane that climb: foot right and left, head right and left, (4, 3)."""
    middle = without_repeats(lane.shape)
    middle = middle + np.array([0.0, 0.0, SIDEWALK_HEIGHT])
    half = lane.width / 2.0 - _INSET
    right, left = offset(middle, -half), offset(middle, half)
    quads = []
    for k, step in enumerate(np.diff(middle, axis=0)):
        if abs(float(step[2])) <= _FLATTEST * float(np.hypot(*step[:2])):
            continue
        quad = np.stack([right[k], left[k], right[k + 1], left[k + 1]])
        quads.append(quad if step[2] > 0.0 else quad[[3, 2, 1, 0]])
    return quads


def _steps(quad: Floats) -> tuple[Mesh, float]:
    """The steps on one slope, and the height of a riser [m].

    Args:
        quad: Foot right and left, head right and left, (4, 3) [m].
    """
    foot, head = quad[:2], quad[2:]
    climb = float(head[0, 2] - foot[0, 2])
    length = float(np.hypot(*(head.mean(axis=0) - foot.mean(axis=0))[:2]))
    count = max(1, min(round(climb / _RISER), int(length / _SHALLOWEST)))
    share = np.linspace(0.0, 1.0, count + 1)[:, None, None]
    lines = foot + share * (head - foot)
    tops = np.concatenate([lines[:-1], lines[1:]], axis=1)
    feet = tops.copy()
    feet[..., 2] -= _SUNK
    # A tread is as high as the slope at its upper end.
    tops[..., 2] = lines[1:, :1, 2]
    corners = np.concatenate([tops, feet], axis=1)
    start = 8 * np.arange(count)[:, None, None]
    quads = (start + _QUADS).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(corners.reshape(-1, 3), faces), climb / count
