"""Gathers what overlays show: views, road users, their ways, and the lanes of the map."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.job.overlays import OverlaySettings
from sumo3dviz_pt.job.settings import LagrangianCamera
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.overlays.facts import FilmFacts, FrameFacts, named
from sumo3dviz_pt.overlays.following import TRAIL_REACH
from sumo3dviz_pt.pipeline.nearby import Nearby, nearby

if TYPE_CHECKING:
    from sumo3dviz_pt.cast.fleet import Fleet
    from sumo3dviz_pt.pipeline.production import Production

log = logging.getLogger(__name__)

_TRAIL_STEP = 0.1  # between points of a trail [s]
_CORNERS = 1.5  # how far the corners of a map are, in its radii
_ON_FOOT = frozenset({"walkingarea", "crossing"})


def film_facts(production: Production, wanted: OverlaySettings, *, rate: float) -> FilmFacts:
    """Return what a film's overlays show.

    Args:
        production: The film's.
        wanted: The overlays.
        rate: Frames per second.
    """
    from sumo3dviz_pt.cast.fleet import find_rider

    # Say which ids mean nobody; find whom the camera rides with, and where it is.
    for pattern in unknown_ids(wanted, production.shot.fleet.keys):
        log.warning("overlays: nobody near the camera of this film is called %s", pattern)
    job, fleet = production.job, production.shot.fleet
    camera = job.cameras[production.camera]
    rides = isinstance(camera, LagrangianCamera)
    ridden = find_rider(fleet, camera.vehicle).key if isinstance(camera, LagrangianCamera) else ""
    views = [production.shot.frame_at(at).view for at in production.times.tolist()]
    around = _around(production, views, wanted)
    frames = [
        _frame(production, at, view, reach=_reach(wanted), ridden=ridden, around=around)
        for at, view in zip(production.times.tolist(), views, strict=True)
    ]
    lanes, widths = ([], []) if around is None else _lanes(around.network, views, wanted)
    return FilmFacts(
        wanted,
        job.output.size,
        rate,
        fleet.keys,
        fleet.sizes,
        ridden,
        frames,
        _paths(fleet, production.times, wanted),
        lanes,
        widths,
        inside=rides and bool(views[0].rides_in),
    )


def unknown_ids(wanted: OverlaySettings, keys: Sequence[str]) -> list[str]:
    """Return the ids and patterns of overlays that mean none of some road users.

    Args:
        wanted: The overlays.
        keys: Of road users.
    """
    groups = [each.ids for each in wanted.labels]
    groups += [each.ids for each in wanted.highlights]
    groups += [each.ids for each in wanted.trails]
    patterns = dict.fromkeys(pattern for group in groups for pattern in group)
    names = [*keys, *map(named, keys)]
    return [each for each in patterns if not any(fnmatchcase(name, each) for name in names)]


def _reach(wanted: OverlaySettings) -> float:
    """Return how far the farthest road users are that an overlay may be about [m]."""
    reaches = [each.reach for each in wanted.labels]
    reaches += [each.reach for each in wanted.highlights]
    reaches += [TRAIL_REACH] if wanted.trails else []
    reaches += [wanted.dots.reach] if wanted.dots else []
    return max(reaches, default=0.0)


def _frame(
    production: Production,
    at: float,
    view: View,
    *,
    reach: float,
    ridden: str,
    around: Nearby | None,
) -> FrameFacts:
    """Return what one frame shows."""
    present, fleet = production.shot.present_at(at), production.shot.fleet
    poses = np.column_stack([present.positions, present.yaws, present.pitches, present.speeds])
    keep = np.linalg.norm(poses[:, :3] - view.position, axis=1) <= reach
    # A speed may be asked for whoever it is of.
    speed = production.job.overlays and production.job.overlays.speed
    asked = {ridden, *((speed.vehicle, f"vehicle:{speed.vehicle}") if speed else ())}
    keep |= np.array([fleet.keys[user] in asked for user in present.users.tolist()], dtype=bool)
    return FrameFacts(at, view, present.users[keep], poses[keep], _map_rows(around, at))


# The map -----------------------------------------------------------------------------------


def _around(
    production: Production, views: Sequence[View], wanted: OverlaySettings
) -> Nearby | None:
    """Return who comes onto the map; None without one."""
    if wanted.map is None:
        return None
    eyes = np.array([view.position for view in views])
    return nearby(production, eyes, radius=_CORNERS * wanted.map.radius)


def _map_rows(around: Nearby | None, at: float) -> Floats:
    """Return everyone on the map at a time, as `FrameFacts.around`."""
    rows = []
    everyone = zip(around.trajectories, around.types, strict=True) if around else ()
    for trajectory, kind in everyone:
        pose = trajectory.at(at)
        if pose is not None:
            x, y, _ = pose.position
            rows.append([x, y, pose.yaw, kind.length, kind.width, pose.speed])
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def _lanes(
    network: Network, views: Sequence[View], wanted: OverlaySettings
) -> tuple[list[Floats], list[float]]:
    """Return the centre lines of lanes on the map, (n, 2) each, and their widths [m]."""
    assert wanted.map is not None
    reach = _CORNERS * wanted.map.radius
    eyes = np.array([view.position[:2] for view in views])
    low, high = eyes.min(axis=0) - reach, eyes.max(axis=0) + reach
    found: list[Floats] = []
    widths: list[float] = []
    for edge in network.edges.values():
        for lane in () if edge.function in _ON_FOOT else edge.lanes:
            line = lane.shape[:, :2]
            if (line.max(axis=0) >= low).all() and (line.min(axis=0) <= high).all():
                found.append(line)
                widths.append(lane.width)
    return found, widths


# Trails ------------------------------------------------------------------------------------


def _paths(fleet: Fleet, times: Floats, wanted: OverlaySettings) -> Mapping[str, Floats]:
    """Return where road users with trails drove, as `FilmFacts.paths`."""
    if not wanted.trails:
        return {}
    back = max(trail.seconds for trail in wanted.trails)
    steps = np.arange(times[0] - back, times[-1] + _TRAIL_STEP, _TRAIL_STEP)
    patterns = [pattern for trail in wanted.trails for pattern in trail.ids]
    found = {}
    for trajectory in fleet.trajectories:
        names = (trajectory.id, trajectory.key)
        if any(fnmatchcase(name, pattern) for pattern in patterns for name in names):
            motion = trajectory.sample(steps)
            points = np.column_stack([steps, motion.positions, motion.speeds])
            found[trajectory.key] = points[motion.alive]
    return found
