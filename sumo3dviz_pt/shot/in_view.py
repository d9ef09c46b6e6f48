"""Chooses the road users whose motion a shot needs: those that its camera may see.

Smoothing the motion of a whole city takes longer than building what a driver sees of it. Where
somebody is between logged samples is known within metres before it is smoothed, which is enough
to leave out those who are never in view.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.model.camera_path import CameraPath, in_view
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.shutter import frame_step
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Trace
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot import visibility
from sumo3dviz_pt.shot.exposing import exposed_camera, moments_of
from sumo3dviz_pt.shot.road_users import everyone, with_seat
from sumo3dviz_pt.world.build import World

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
    fleet = with_seat(everyone(world, riders), camera, world=world)
    built = exposed_camera(
        camera,
        fleet=fleet,
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
    reach = np.array([visibility.reach(kind.length) + slack for kind in types]).reshape(-1, 1)
    ridden = {rider.id for rider in riders}
    found = np.array([trace.id in ridden for trace in traces], dtype=np.bool_)
    for first in range(0, len(traces), _CHUNK):
        part = slice(first, first + _CHUNK)
        for frames in visibility.chunks(len(moments)):
            places = _places(traces[part], moments[frames])
            seen = in_view(camera_path.slice(frames), places, radius=reach[part])
            away = np.linalg.norm(places - camera_path.slice(frames).positions, axis=-1)
            near = away < visibility.FAR_END + reach[part]
            found[part] |= (seen & near).any(axis=1)
    return found


def _places(traces: Sequence[Trace], times: Floats) -> Floats:
    """Where somebody is at times, (n, t, 3) [m], about; the first or last place beyond the log."""
    return np.array(
        [
            [np.interp(times, trace.times, trace.positions[:, axis]) for axis in range(3)]
            for trace in traces
        ]
    ).transpose(0, 2, 1)
