"""Collect what a picture of one road user's motion needs, for `sumo3dviz-pt motion`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.inspection.motion import User, users_of
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Scenario
from sumo3dviz_pt.model.trajectory import find_trajectory
from sumo3dviz_pt.motion import laws
from sumo3dviz_pt.motion.lanes import LaneGraph
from sumo3dviz_pt.motion.laws import LaneKeeping
from sumo3dviz_pt.pipeline.production import check_target, read
from sumo3dviz_pt.pipeline.reading import spare_inputs
from sumo3dviz_pt.report.machine import check_extra
from sumo3dviz_pt.report.motion import Drive, MotionCourse, Road, motion_plot

_STEP = 0.02
"""Time between the points of a curve, unless there would be too many [s]."""

_MOST_TIMES = 20_000
"""Largest number of points of a curve."""

_NEAR = 60.0
"""Lanes that come at least this near to the path are drawn [m]."""

_OFF = 8.0
"""A road user that is farther than this from the centres of its lanes is in none of them [m]."""


@dataclass(frozen=True, slots=True)
class MotionDrawing:
    """Which motion to draw, and where to.

    Attributes:
        vehicle: SUMO's id, or the key such as `person:walker_1`.
        path: The PNG to write.
        begin: First time [s]; None is the first sample's.
        end: Last time [s]; None is the last sample's.
        overwrite: Whether a picture that exists is replaced.
    """

    vehicle: str
    path: Path
    begin: float | None = None
    end: float | None = None
    overwrite: bool = False


def draw_motion(job: Job, wanted: MotionDrawing) -> None:
    """Draw one road user's motion.

    Raises:
        ConfigError: If there is no such road user, it is not there at that time, the
            picture cannot be written, or matplotlib is missing.
        InputError: If a file is wrong.
    """
    check_extra("matplotlib")
    check_target(wanted.path, suffixes=(".png",), overwrite=wanted.overwrite)
    spare_inputs(job, wanted.path)
    _, scenario, trajectories = read(job)
    user = find_user(users_of(scenario, trajectories), wanted.vehicle)
    motion_plot(drive_of(user, scenario, job, wanted), wanted.path)


def find_user(users: Sequence[User], name: str) -> User:
    """Return a road user by SUMO's id or by its key.

    Raises:
        ConfigError: If the log has none of that name; the message suggests some.
    """
    trajectory = find_trajectory([user.trajectory for user in users], name)
    return next(user for user in users if user.trajectory is trajectory)


def drive_of(user: User, scenario: Scenario, job: Job, wanted: MotionDrawing) -> Drive:
    """Collect everything that is drawn of a road user.

    Args:
        user: The road user.
        scenario: The simulation.
        job: The scene file.
        wanted: The window of time.

    Raises:
        ConfigError: If it is not there at the wanted times.
    """
    first, last = _window(user, wanted)
    keeping = LaneKeeping(LaneGraph(scenario.network), user.lane_names)
    centres = [lane.shape[:, :2] for lane in keeping.lanes_of(user.trace)]
    logged = _logged(user, first, last, centres)
    shown = _shown(user, first, last, centres)
    roads = _roads(scenario.network, shown.places)
    unknown = UNKNOWN_TYPES[user.trajectory.kind]
    body = scenario.vehicle_types.get(user.trajectory.type_id, unknown)
    location = scenario.network.location
    roads = [replace(r, shape=location.outside(r.shape)) for r in roads]
    return Drive(
        title=f"{user.trajectory.kind} {user.trajectory.id}",
        subtitle=f"{user.trajectory.type_id or 'type unknown'}, {first:.12g} to {last:.12g} s,"
        f" smoother {job.motion.smoother}, {len(logged.times)} samples",
        shown=replace(shown, places=location.outside(shown.places)),
        logged=replace(logged, places=location.outside(logged.places)),
        roads=roads,
        remarks=[r for r in user.trajectory.remarks if r.begin <= last and r.end >= first],
        size=(body.length, body.width),
    )


def _window(user: User, wanted: MotionDrawing) -> tuple[float, float]:
    """Return the first and the last time to draw [s]."""
    pieces = user.trajectory.pieces
    begin, end = pieces[0].begin, pieces[-1].end
    first = begin if wanted.begin is None else max(begin, wanted.begin)
    last = end if wanted.end is None else min(end, wanted.end)
    if first > last:
        raise ConfigError(
            f"{wanted.vehicle!r} is not there then; it is there"
            f" from {begin:.12g} s to {end:.12g} s",
            key="--from" if wanted.begin is not None else "--to",
        )
    return first, last


def _shown(user: User, first: float, last: float, lines: Sequence[Floats]) -> MotionCourse:
    """Return the displayed motion within a window; NaN where the road user does not exist."""
    count = min(int((last - first) / _STEP) + 2, _MOST_TIMES)
    times = np.linspace(first, last, count)
    step = float(times[1] - times[0]) or _STEP
    motion = user.trajectory.sample(times)
    known = laws.measure(motion, step=step, length=user.length)
    places = motion.positions[:, :2]
    return MotionCourse(
        times,
        places,
        motion.yaws,
        motion.speeds,
        _in_lane(places, lines),
        known.accelerations,
        known.sideways,
    )


def _logged(user: User, first: float, last: float, lines: Sequence[Floats]) -> MotionCourse:
    """Return the samples within a window."""
    trace = user.trace
    inside: Bools = (trace.times >= first - 1e-6) & (trace.times <= last + 1e-6)
    if not inside.any():
        inside[np.argmin(np.abs(trace.times - first))] = True
    places = trace.positions[inside, :2]
    nothing = np.empty(0)
    return MotionCourse(
        trace.times[inside],
        places,
        trace.yaws[inside],
        trace.speeds[inside],
        _in_lane(places, lines),
        nothing,
        nothing,
    )


def _in_lane(places: Floats, lines: Sequence[Floats]) -> Floats:
    """Return signed distances from the lanes' centres, (n,) [m]; NaN outside the lanes."""
    offsets = np.full(len(places), np.nan)
    known = np.isfinite(places).all(axis=1)
    offsets[known] = laws.offsets(places[known], lines)
    offsets[np.abs(offsets) > _OFF] = np.nan
    return offsets


def _roads(network: Network, places: Floats) -> list[Road]:
    """Return the lanes near a path."""
    known = places[np.isfinite(places).all(axis=1)]
    reach = max(_NEAR, 0.2 * float(np.ptp(known, axis=0).max()))
    low, high = known.min(axis=0) - reach, known.max(axis=0) + reach
    roads = []
    for lane in network.lanes.values():
        edge = network.edges.get(lane.edge_id)
        function = edge.function if edge else "normal"
        shape = lane.shape[:, :2]
        near = (shape.max(axis=0) >= low).all() and (shape.min(axis=0) <= high).all()
        if near and function != "walkingarea":
            roads.append(Road(shape, lane.width, function in ("internal", "crossing")))
    return roads
