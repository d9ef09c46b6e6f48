"""Who is on the road of a shot, whose motion it needs, and cameras with shutters and focus.

A shot needs the motion of those road users that its camera may see. Smoothing the motion of a whole
city takes longer than building what a driver sees of it. Where somebody is between logged samples
is known within metres before it is smoothed, which is enough to leave out those who are never in
view.

What a scene file says of shutter and focus is put to any camera.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet, build_fleet, find_rider
from sumo3dviz_pt.cast.lamps import vehicle_lights
from sumo3dviz_pt.cast.outfits import Air
from sumo3dviz_pt.job.cameras import FocusOn
from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.model.camera import INSTANT, CameraPath, Shutter, frame_step, in_view
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Trace
from sumo3dviz_pt.model.trajectory import Trajectory, find_trajectory
from sumo3dviz_pt.shot import crowd
from sumo3dviz_pt.shot.cameras.aiming import ALWAYS, Camera, build_camera
from sumo3dviz_pt.shot.cameras.riding import RidingCamera, has_pane
from sumo3dviz_pt.world.build import World, season_of

_MOST_VIEWS = 120
"""Views that stand for a camera's way, at most."""

_NEAREST = 0.05
"""What a lens is focused on lies at least so far away [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class SharpSubject:
    """Who stays sharp.

    Attributes:
        trajectory: Of the road user.
        middle: Of its body, in the body's frame, (3,) [m].
    """

    trajectory: Trajectory
    middle: Floats

    def distance(self, view: View, time: float) -> float:
        """Return how far its middle is from a camera at a time, along the axis if that is plane."""
        pieces = self.trajectory.pieces
        piece = min(pieces, key=lambda each: max(each.begin - time, time - each.end))
        motion = piece.sample(np.array([min(max(time, piece.begin), piece.end)]))
        yaw = float(motion.yaws[0])
        ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        place = motion.positions[0] + self.middle[0] * ahead + (0.0, 0.0, self.middle[2])
        towards = place - view.position
        along = towards @ view.forward if view.lens.projection == "perspective" else 0.0
        away = along if view.lens.projection == "perspective" else np.linalg.norm(towards)
        return max(float(away), _NEAREST)


@dataclass(frozen=True, slots=True, eq=False)
class ExposedCamera:
    """A camera with a shutter, or with a lens that follows somebody with its focus.

    Attributes:
        camera: Where it is and what it sees with.
        shutter: When it lets light in.
        subject: Who stays sharp; None for what the lens is focused on anyway.
    """

    camera: Camera
    shutter: Shutter = INSTANT
    subject: SharpSubject | None = None

    def view_at(self, time: float) -> View:
        """Return the view at a time [s]; errors as the camera's."""
        view = self.camera.view_at(time)
        if self.subject is None:
            return view
        lens = replace(view.lens, focus=self.subject.distance(view, time))
        return replace(view, lens=lens)

    def moments(self, times: tuple[float, float] = ALWAYS) -> tuple[float, ...]:
        """Return the camera's moments."""
        return self.camera.moments(times)


def exposed_camera(
    settings: CameraSettings,
    *,
    fleet: Fleet,
    left_hand: bool,
    step: float,
    focused: bool = True,
) -> Camera:
    """Build a camera with all that its settings say; a plain one stays as it is.

    Args:
        settings: Of the camera.
        fleet: Road users that it can ride with or be focused on.
        left_hand: Whether traffic keeps left.
        step: From a frame to the next [s].
        focused: Whether it must follow whom it is focused on; they need not be there if not.

    Raises:
        ConfigError: If whom it rides with or is focused on is unknown.
    """
    camera = build_camera(settings, fleet=fleet, left_hand=left_hand)
    shutter = shutter_of(settings, step)
    target = focus_target(settings) if focused else None
    if shutter == INSTANT and target is None:
        return camera
    if isinstance(camera, RidingCamera):
        # The last frame's shutter closes after whom it rides with is gone.
        camera = replace(camera, slack=max(camera.slack, shutter.lasts))
    return ExposedCamera(camera, shutter, None if target is None else _subject(fleet, target))


def shutter_of(settings: CameraSettings, step: float) -> Shutter:
    """Return a camera's shutter: it opens at the frame's time.

    Args:
        settings: Of the camera.
        step: From a frame to the next [s].
    """
    shutter = settings.shutter
    if shutter is None:
        return INSTANT
    span = shutter.span(step)
    moments = shutter.moments if span > 0.0 or shutter.rolling > 0.0 else 1
    return Shutter(0.0, span, moments, shutter.rolling)


def focus_target(settings: CameraSettings) -> str | None:
    """Return the id of the road user that a camera is focused on; None where it is on none."""
    focus = settings.lens.focus if settings.lens is not None else None
    return focus.vehicle if isinstance(focus, FocusOn) else None


def moments_of(camera: Camera, times: Floats) -> Floats:
    """Return the moments that a camera's frames at times, (n,) [s], show, all in one array [s]."""
    shutters = (camera.shutter.at(time) for time in times.tolist())
    return np.array([moment for shutter in shutters for moment in _moments(shutter)])


def camera_path_of(camera: Camera, times: Floats, aspect: float) -> CameraPath:
    """Return where a camera is and looks over a whole shot, by a few of its views."""
    every = max(1, -(-len(times) // _MOST_VIEWS))
    return CameraPath.of([camera.view_at(float(time)) for time in times[::every]], aspect=aspect)


def _moments(shutter: Shutter) -> Iterator[float]:
    """Yield the moments that a frame shows [s]: the middle of its exposure, and all others."""
    yield shutter.middle
    if not shutter.is_instant:
        yield from (moment for moment, _ in shutter.exposures())


def _subject(fleet: Fleet, target: str) -> SharpSubject:
    """Return who stays sharp."""
    trajectory = find_rider(fleet, target)
    length, _, height = fleet.body(trajectory.key).size
    return SharpSubject(trajectory, np.array([-0.5 * length, 0.0, 0.5 * height]))


def countable(
    world: World, trajectories: Sequence[Trajectory], camera: CameraSettings
) -> frozenset[str]:
    """Return keys of those whose shape a report does not need: all but whom a camera rides in.

    Args:
        world: Says whether a report is made of it.
        trajectories: Of everyone on the road.
        camera: The shot's camera.
    """
    if world.outlook is None:
        return frozenset()
    keys = {each.key for each in trajectories}
    if camera.rides_with:
        keys.discard(find_trajectory(trajectories, camera.rides_with).key)
    return frozenset(keys)


def everyone(
    world: World, trajectories: Sequence[Trajectory], *, counted: Container[str] = ()
) -> Fleet:
    """Return everyone on the road.

    Args:
        world: Says which types there are, and whether they have lights on.
        trajectories: Their smoothed motion.
        counted: Keys of those whose numbers of triangles are enough.
    """
    scenario, job = world.scenario, world.job
    fleet = build_fleet(
        trajectories,
        scenario.vehicle_types,
        job.vehicles,
        seed=job.seed,
        counted=counted,
        air=Air.in_season(season_of(job)),
    )
    traffic = scenario.traffic
    lights = vehicle_lights(
        traffic.traces,
        dark=world.dark,
        seed=job.seed,
        weather=world.weather,
        taken=traffic.taken,
    )
    parked = frozenset[str]() if world.driven is None else world.driven.parked
    location, suspension = scenario.network.location, job.motion.suspension
    return replace(fleet, lights=lights, location=location, suspension=suspension, parked=parked)


def with_seat(fleet: Fleet, camera: CameraSettings, *, world: World) -> Fleet:
    """Return the same fleet; the vehicle that a camera rides in can be opened.

    Args:
        fleet: Everyone on the road.
        camera: Its settings.
        world: Tells on which side drivers sit, and whether wipers move.
    """
    if not camera.rides_with:
        return fleet
    key, wet = find_rider(fleet, camera.rides_with).key, has_pane(world.weather, world.job)
    return fleet.with_cockpit(key, left_hand=world.left_hand, wipers=not wet)


_SLACK, _SWERVE = 20.0, 20.0
"""Distance between where somebody is and the line between two samples, at most [m]: at once, and
for each second between the samples."""

_CHUNK = 400
"""Traces that are looked at at once."""


def way_of(
    world: World, riders: Sequence[Trajectory], *, camera: CameraSettings, times: Floats
) -> CameraPath:
    """Return where a camera is and looks in each moment that a shot shows.

    Args:
        world: What exists, and the log.
        riders: The smoothed motion of those whom the camera rides with.
        camera: Its settings.
        times: Of the shot's frames, (t,) [s].
    """
    return _way(world, riders, camera=camera, times=times)[0]


def _way(
    world: World, riders: Sequence[Trajectory], *, camera: CameraSettings, times: Floats
) -> tuple[CameraPath, Floats]:
    """Return a camera's way and the moments that it consists of [s]; arguments as in `way_of`."""
    # The place of an eye does not depend on an opened cockpit, so none is built.
    built = exposed_camera(
        camera,
        fleet=everyone(world, riders),
        left_hand=world.left_hand,
        step=frame_step(times, fps=float(world.job.output.fps)),
        focused=False,
    )
    moments = moments_of(built, times)
    aspect = world.job.output.size[1] / world.job.output.size[0]
    views = [built.view_at(each) for each in moments.tolist()]
    return CameraPath.of(views, aspect=aspect), moments


def users_in_view(
    world: World, riders: Sequence[Trajectory], *, camera: CameraSettings, times: Floats
) -> Bools:
    """Return which traces of a world's log a camera may see, (n,), and no others but a few.

    Args:
        world: What exists, and the log.
        riders: The smoothed motion of those whom the camera rides with.
        camera: Its settings.
        times: Of the shot's frames, (t,) [s].
    """
    camera_path, moments = _way(world, riders, camera=camera, times=times)
    # Look for everyone near the lines between their samples.
    scenario = world.scenario
    traces = scenario.traffic.traces
    types = [
        scenario.vehicle_types.get(trace.type_id, UNKNOWN_TYPES[trace.kind]) for trace in traces
    ]
    slack = _SLACK + _SWERVE * scenario.traffic.step
    reach = np.array([crowd.reach(kind.length) + slack for kind in types]).reshape(-1, 1)
    ridden = {rider.id for rider in riders}
    mask = np.array([trace.id in ridden for trace in traces], dtype=np.bool_)
    for first in range(0, len(traces), _CHUNK):
        part = slice(first, first + _CHUNK)
        for frames in crowd.chunks(len(moments)):
            places = _places(traces[part], moments[frames])
            seen = in_view(camera_path.slice(frames), places, radius=reach[part])
            away = np.linalg.norm(places - camera_path.slice(frames).positions, axis=-1)
            near = away < crowd.FAR_END + reach[part]
            mask[part] |= (seen & near).any(axis=1)
    return mask


def _places(traces: Sequence[Trace], times: Floats) -> Floats:
    """Where somebody is at times, (n, t, 3) [m], about; the first or last place beyond the log."""
    return np.array(
        [
            [np.interp(times, trace.times, trace.positions[:, axis]) for axis in range(3)]
            for trace in traces
        ]
    ).transpose(0, 2, 1)
