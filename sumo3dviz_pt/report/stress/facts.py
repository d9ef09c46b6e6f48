"""Finds out what a scene has to offer to the cases of `check --stress`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import Mover, Prototype, SceneData, View
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.production import Production
from sumo3dviz_pt.report.stress.cases import Facts, NearbyUser

_ABOVE_ROOF = 3.0
"""Height above a riding camera at which a standing copy sees more than the cabin [m]."""

_MOST_MOMENTS = 20_000


def facts_of(
    production: Production, scenario: Scenario, trajectories: Sequence[Trajectory], *, time: float
) -> Facts:
    """Collect what a shot has to offer.

    Args:
        production: The shot, prepared for one time.
        scenario: The whole log.
        trajectories: Its smoothed motion.
        time: The shot's [s].
    """
    from sumo3dviz_pt.pipeline.doctor import physical_memory

    shot = production.shot
    view = shot.camera.view_at(time)
    eye, forward = _standing(view)
    road, along = nearest_lane(scenario.network, eye)
    lanes = [lane.shape for lane in scenario.network.lanes.values()]
    corners = np.concatenate(lanes) if lanes else eye[None]
    users = shot.fleet.movers_at(time)
    return Facts(
        eye=eye,
        forward=forward,
        fov=float(np.degrees(view.lens.opening)),
        road=road,
        along=along,
        box=np.stack([corners.min(axis=0), corners.max(axis=0)]),
        sun=shot.data.sky.sun_direction,
        body=nearest_body(users, shot.fleet.prototypes, eye),
        times={"shot": time, **moments(scenario, trajectories)},
        memory=physical_memory() / 1e6,
        triangles=_triangles(shot.data),
    )


def _standing(view: View) -> tuple[Floats, Floats]:
    """Return the eye and viewing direction of a standing camera that shows the same."""
    if view.rides_in is None:
        return view.position, view.forward
    level = np.array([view.forward[0], view.forward[1], -0.15])
    return view.position + np.array([0.0, 0.0, _ABOVE_ROOF]), level / np.linalg.norm(level)


def nearest_lane(network: Network, eye: Floats) -> tuple[Floats, Floats]:
    """Return the lane's point nearest to an eye, (3,) [m], and its direction there, (3,)."""
    roads = [lane.shape for lane in network.lanes.values() if _is_road(network, lane.edge_id)]
    starts = np.concatenate([shape[:-1] for shape in roads] or [eye[None] - [0.0, 0.0, 2.0]])
    ends = np.concatenate([shape[1:] for shape in roads] or [eye[None] + [1.0, 0.0, -2.0]])
    along = ends - starts
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    share = np.einsum("ij,ij->i", eye - starts, along) / length**2
    points = starts + np.clip(share, 0.0, 1.0)[:, None] * along
    # Pieces of lanes that are too short have no direction.
    distance = np.where(length > 0.1, np.linalg.norm(points - eye, axis=1), np.inf)
    best = int(np.argmin(distance))
    return points[best], along[best] / length[best]


def _is_road(network: Network, edge: str) -> bool:
    """Return whether an edge's lanes have the direction of driving; a walking area's do not."""
    found = network.edges.get(edge)
    return found is None or found.function == "normal"


def nearest_body(
    users: Iterable[Mover], prototypes: Mapping[str, Prototype], eye: Floats
) -> NearbyUser | None:
    """Return the vehicle nearest to an eye; another road user if there is none.

    Args:
        users: Road users of a frame.
        prototypes: Their bodies.
        eye: (3,) [m].
    """

    def order(user: Mover) -> tuple[bool, float]:
        distance = np.linalg.norm(user.world_from_body.position - eye)
        return not user.id.startswith("vehicle:"), float(distance)

    nearest = min(users, key=order, default=None)
    if nearest is None:
        return None
    parts = prototypes[nearest.prototype].parts
    points = np.concatenate([part.mesh.vertices for part in parts])
    low, high = points.min(axis=0), points.max(axis=0)
    side = _on_side(points, low, high)
    middle, paint = nearest.world_from_body.points(np.stack([(low + high) / 2, side]))
    outward = nearest.world_from_body.directions(np.array([[0.0, 1.0, 0.0]]))[0]
    return NearbyUser(nearest.id, middle, paint, outward / np.linalg.norm(outward))


def _on_side(points: Floats, low: Floats, high: Floats) -> Floats:
    """Return a point on the left side of a body at half height, behind the mirrors."""
    size = high - low
    share = (points - low) / np.maximum(size, 1e-9)
    band: Bools = (np.abs(share[:, 0] - 0.4) < 0.15) & (np.abs(share[:, 2] - 0.5) < 0.15)
    if not band.any():
        return np.array([low[0] + 0.4 * size[0], high[1], low[2] + 0.5 * size[2]])
    return np.asarray(points[band][np.argmax(points[band, 1])])


def moments(scenario: Scenario, trajectories: Sequence[Trajectory]) -> dict[str, float]:
    """Return the edges of the log that exist: `first`, `last`, `empty`, `crowded` [s]."""
    log = scenario.traffic
    found = {"first": log.begin, "last": log.end}
    count = 1 if log.step <= 0 else round((log.end - log.begin) / log.step) + 1
    times = np.linspace(log.begin, log.end, max(1, min(count, _MOST_MOMENTS)))
    lives = [(p.begin, p.end) for trajectory in trajectories for p in trajectory.pieces]
    begins, ends = np.sort(np.array(lives).reshape(-1, 2), axis=0).T
    alive = np.searchsorted(begins, times, "right") - np.searchsorted(ends, times, "left")
    if alive.min() == 0:
        found["empty"] = float(times[np.argmin(alive)])
    if alive.max() > 0:
        found["crowded"] = float(times[np.argmax(alive)])
    return found


def _triangles(data: SceneData) -> int:
    """Return about how many triangles the renderer holds."""
    static = sum(len(part.part.mesh.faces) for part in data.static)
    return static + sum(prototype.triangles for prototype in data.prototypes.values())
