"""Cameras that nobody carries: they stand still or fly through key frames.

Positions, angles and opening angle follow monotone cubic curves in time: between equal key frames
nothing moves, and nothing overshoots. Angles go the shortest way; as heading, pitch and roll are
interpolated and not a quaternion, a level camera keeps its horizon. Between two key frames that
look at points, the point is interpolated instead, so that the subject stays in the middle.

References:
    F. N. Fritsch, R. E. Carlson: Monotone piecewise cubic interpolation, SIAM J. Numer.
    Anal. 17, 1980, doi:10.1137/0717021.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.cameras import FOV
from sumo3dviz_pt.job.settings import CinematicCamera, EulerianCamera, KeyFrame
from sumo3dviz_pt.job.values import Point
from sumo3dviz_pt.model.camera import INSTANT, Shutter
from sumo3dviz_pt.model.geometry import Floats, frozen
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.network import UNPLACED, Location
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.shot.cameras.aiming import (
    ALWAYS,
    Aim,
    Camera,
    aim_at,
    aim_of,
    build_camera,
    lens_of,
)


@dataclass(frozen=True, slots=True, eq=False)
class StandingCamera:
    """An Eulerian camera: the same view at all times.

    Attributes:
        view: Where it stands and what it sees.
        shutter: When it lets light in.
    """

    view: View
    shutter: Shutter = INSTANT

    def view_at(self, time: float) -> View:
        """Return the view, whatever the time."""
        return self.view

    def moments(self, times: tuple[float, float] = ALWAYS) -> tuple[float, ...]:
        """Return a single time, as all views are the same."""
        return (0.0,)


def standing_view(settings: EulerianCamera, location: Location = UNPLACED) -> View:
    """Return what a camera that stands still sees.

    Args:
        settings: In SUMO's coordinates.
        location: From where ours are counted.

    Raises:
        ConfigError: If it looks at the point where it stands.
    """
    placed = aim_of(settings, location).placed(location.inside(settings.position))
    return View(placed, lens_of(settings.lens))


@build_camera.register
def _(settings: EulerianCamera, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """Build a camera that stands still."""
    return StandingCamera(standing_view(settings, fleet.location))


_NEAR = 0.01
"""Closer than this a point says nothing about where to look [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class MonotoneCurve:
    """A monotone cubic curve that holds its ends.

    Attributes:
        times: Strictly increasing, (n,) [s], n >= 1.
        values: (n, k).
    """

    times: Floats
    values: Floats
    _between: PchipInterpolator | None = field(init=False)

    def __post_init__(self) -> None:
        """Find the slopes once."""
        between = None
        if len(self.times) > 1:
            with np.errstate(over="ignore"):  # slopes so small that their inverse is infinite
                between = PchipInterpolator(self.times, self.values, axis=0)
        object.__setattr__(self, "_between", between)

    def at(self, time: float) -> Floats:
        """Return the value at any time [s], (k,)."""
        if self._between is None:
            return np.asarray(self.values[0])
        inside = min(max(time, float(self.times[0])), float(self.times[-1]))
        value = self._between(inside)
        # Between two key frames lies nothing outside them, not even by rounding.
        k = min(int(np.searchsorted(self.times, inside, side="right")), len(self.times) - 1)
        low, high = self.values[k - 1], self.values[k]
        return np.asarray(np.clip(value, np.minimum(low, high), np.maximum(low, high)))


@dataclass(frozen=True, slots=True, eq=False)
class FlyingCamera:
    """A cinematic camera.

    Attributes:
        path: Positions, k = 3 [m].
        angles: Unwrapped yaw, pitch and roll, and the opening angle, k = 4 [rad].
        subjects: Points looked at, k = 3 [m], with the times from the first to the last
            of neighbouring key frames that look at points.
        lens: What it sees with, but for the opening angle.
        shutter: When it lets light in.
    """

    path: MonotoneCurve
    angles: MonotoneCurve
    subjects: tuple[MonotoneCurve, ...]
    lens: Lens
    shutter: Shutter = INSTANT

    def view_at(self, time: float) -> View:
        """Return the view at a time [s]; before the first and after the last key frame, theirs."""
        position = self.path.at(time)
        yaw, pitch, roll, opening = self.angles.at(time).tolist()
        aim = Aim(yaw, pitch, roll)
        for subject in self.subjects:
            if subject.times[0] <= time <= subject.times[-1]:
                direction = subject.at(time) - position
                if np.linalg.norm(direction) > _NEAR:
                    aim = aim_at(direction, roll=roll)
        lens = self.lens if self.lens.kind.is_parallel else replace(self.lens, opening=opening)
        return View(aim.placed(position), lens)

    def moments(self, times: tuple[float, float] = ALWAYS) -> tuple[float, ...]:
        """Return the times of all key frames [s]."""
        return tuple(self.path.times.tolist())


def build_flight(settings: CinematicCamera, location: Location = UNPLACED) -> FlyingCamera:
    """Lay the curves through the key frames.

    Args:
        settings: In SUMO's coordinates.
        location: From where ours are counted.

    Raises:
        ConfigError: If a key frame looks at the point where it stands.
    """
    keys = settings.keyframes
    times = frozen([key.time for key in keys])
    aims = [aim_of(key, location) for key in keys]
    turns = np.unwrap([(aim.yaw, aim.pitch, aim.roll) for aim in aims], axis=0)
    own = settings.lens.degrees(FOV)
    fovs = np.radians([own if key.fov is None else key.fov for key in keys])
    return FlyingCamera(
        MonotoneCurve(times, frozen(location.inside([key.position for key in keys]))),
        MonotoneCurve(times, frozen(np.column_stack([turns, fovs]))),
        tuple(_subjects(keys, location)),
        lens_of(settings.lens),
    )


@build_camera.register
def _(settings: CinematicCamera, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """Build a camera that flies through key frames."""
    return build_flight(settings, fleet.location)


def _subjects(keys: Sequence[KeyFrame], location: Location) -> list[MonotoneCurve]:
    """Curves of the points that neighbouring key frames look at."""
    runs: list[list[tuple[float, Point]]] = [[]]
    for key in keys:
        if key.look_at is None:
            runs.append([])
        else:
            runs[-1].append((key.time, key.look_at))
    return [
        MonotoneCurve(
            frozen([time for time, _ in run]),
            frozen(location.inside([point for _, point in run])),
        )
        for run in runs
        if len(run) > 1
    ]
