"""What falls and flies before a camera, as values of one frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from sumo3dviz_pt.cast.articulation import rigid_frames
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.cast.presence import Present
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.falling import Cabin, Falling
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import FrameState, SceneData, View
from sumo3dviz_pt.model.weather import Weather, WeatherCourse
from sumo3dviz_pt.shot.cameras.build import Camera
from sumo3dviz_pt.shot.falling.lamps import Standing, nearest, running_glows, throws
from sumo3dviz_pt.shot.falling.spray import spray
from sumo3dviz_pt.shot.falling.windscreen import has_pane, windscreen_of

EXPOSURE = 1.0 / 125.0
"""How long drops are seen by a camera without a shutter [s], as by a camera in overcast light."""

STRONGER = 6.0
"""How many times their physical cover drops have where nothing is said: wide lenses hardly see
rain, but people who look at a film expect to see what falls."""

PUPIL = 0.002
"""Width of the hole through which a camera without an aperture sees drops [m]: as of a phone's."""

_EARTH, _WHITE = 0.12, 0.6
"""Share of light that the ground reflects without and with snow."""

_SNOWED_IN = 0.02
"""Depth of snow that covers the ground [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Flying:
    """What is the same for all frames of a shot in which something falls or flies.

    Attributes:
        course: The weather over time.
        data: What the shot shows.
        fleet: Everyone on the road.
        standing: Lamps that stand and light what falls; none by day.
        seed: The scene's.
        windscreen: Whether rides look through a wet pane.
        strength: Of drops in the air, as in `Falling`.
    """

    course: WeatherCourse
    data: SceneData
    fleet: Fleet
    standing: tuple[Standing, ...]
    seed: int
    windscreen: bool
    strength: float

    @classmethod
    def of(cls, data: SceneData, fleet: Fleet, *, job: Job) -> Flying | None:
        """Return what falls and flies in a shot; None where the weather has nothing of it.

        Args:
            data: What the shot shows.
            fleet: Everyone on the road.
            job: The scene file.
        """
        course = data.weather
        if course is None or not (course.rains or course.snows or course.is_wet):
            return None
        standing = tuple(Standing.of(lamps) for lamps in data.lamps if lamps.sampled)
        said = job.weather
        strength = None if said is None or said.rain is None else said.rain.streaks
        return cls(
            course,
            data,
            fleet,
            standing,
            job.seed,
            windscreen=has_pane(course, job),
            strength=STRONGER if strength is None else strength,
        )

    def at(self, frame: FrameState, *, present: Present, camera: Camera | None) -> Falling:
        """Return what falls and flies in a frame.

        Args:
            frame: Without it.
            present: Who is on the road.
            camera: Whose view it is, for its motion and shutter; None is one that stands.
        """
        time, view = frame.time, frame.view
        weather = self.course.at(time)
        exposure = exposure_of(camera)
        wind = (0.0, 0.0) if weather.wind is None else (weather.wind.east, weather.wind.north)
        lens = view.lens
        snow = 0.0 if weather.snow is None else weather.snow.falling
        falling = Falling(
            time,
            exposure,
            self.seed,
            _ends(camera, view, time, exposure),
            rain=0.0 if weather.rain is None else weather.rain.rate,
            snow=snow,
            wind=wind,
            drift=carried_by_wind(self.course, time),
            fog=0.0 if weather.fog is None else weather.fog.extinction,
            wetness=weather.wetness,
            strength=self.strength,
            aperture=2.0 * lens.aperture if lens.aperture > 0.0 else PUPIL,
            focus=lens.focus if lens.aperture > 0.0 else float("inf"),
            ground=_reflectance(weather),
            rolling=0.0 if camera is None else camera.shutter.rolling,
        )
        falling = self._lit(falling, frame)
        if falling.wetness > 0.0:
            puffs = spray(self.fleet, present, view, wetness=falling.wetness, wind=falling.wind)
            falling = replace(falling, puffs=puffs)
        return self._inside(falling, view, present)

    def _lit(self, falling: Falling, frame: FrameState) -> Falling:
        """Add the lamps that shine on it."""
        glows = [each.glows(frame.lamps) for each in self.standing]
        lights, bodies = self.data.running, self.data.prototypes
        if lights is not None and lights.sampled:
            movers = (*frame.movers, *frame.deforming, *frame.far)
            glows.append(running_glows(movers, bodies, lights))
            falling = replace(falling, throws=throws(movers, bodies, lights, frame.view))
        return replace(falling, glows=nearest(glows, frame.view)) if glows else falling

    def _inside(self, falling: Falling, view: View, present: Present) -> Falling:
        """Add the vehicle that the camera sits in, and its windscreen."""
        cabin = self._cabin(view, present)
        if cabin is None:
            return falling
        pane = None
        if self.windscreen:
            body = self.fleet.body(str(view.rides_in))
            pane = windscreen_of(body, cabin, view, course=self.course, time=falling.time)
        return replace(falling, cabin=cabin, windscreen=pane)

    def _cabin(self, view: View, present: Present) -> Cabin | None:
        """Return the vehicle around the camera, if it sits in one with a roof."""
        if view.rides_in is None or not view.cutaway:
            return None
        user = self.fleet.places.get(view.rides_in, -1)
        rows = np.flatnonzero(present.users == user)
        body = self.fleet.bodies[user] if user >= 0 else None
        if body is None or body.ride == "lean" or not len(rows):
            return None
        row = rows[:1]
        frame = rigid_frames(present.positions[row], present.yaws[row], present.pitches[row])[0]
        return Cabin(frame, np.array(body.size))


def exposure_of(camera: Camera | None) -> float:
    """Return how long a camera sees what falls [s]."""
    span = 0.0 if camera is None else camera.shutter.open_for
    return span if span > 0.0 else EXPOSURE


def carried_by_wind(course: WeatherCourse, time: float) -> tuple[float, float]:
    """Return how far the wind has carried the air since time 0, to east and north [m].

    The wind changes evenly between the moments of its course.
    """
    low, high = sorted((0.0, time))
    moments = [low, *(at for at in course.times if low < at < high), high]
    winds = [course.at(moment).wind for moment in moments]
    speeds = np.array([(0.0, 0.0) if w is None else (w.east, w.north) for w in winds])
    steps = np.diff(moments)[:, None]
    east, north = (0.5 * (speeds[1:] + speeds[:-1]) * steps).sum(axis=0)
    sign = 1.0 if time >= 0.0 else -1.0
    return sign * float(east), sign * float(north)


def _reflectance(weather: Weather) -> float:
    """Return which share of light the ground reflects."""
    depth = 0.0 if weather.snow is None else weather.snow.depth
    return _EARTH + (_WHITE - _EARTH) * min(1.0, depth / _SNOWED_IN)


def _ends(camera: Camera | None, view: View, time: float, exposure: float) -> Floats:
    """Return where a camera is when its shutter opens and closes, (2, 4, 4)."""
    here = view.world_from_camera.matrix
    if camera is None:
        return np.stack([here, here])
    place = partial(_placed, camera)
    before, after = place(time - 0.5 * exposure), place(time + 0.5 * exposure)
    # At the ends of its life a camera goes on as it does on the other side.
    if before is None and after is None:
        return np.stack([here, here])
    if before is None and after is not None:
        before = here @ np.linalg.inv(after) @ here
    if after is None and before is not None:
        after = here @ np.linalg.inv(before) @ here
    return np.array([before, after])


def _placed(camera: Camera, time: float) -> Floats | None:
    """Return where a camera is at a time, (4, 4); None when it is not there."""
    try:
        return camera.view_at(time).world_from_camera.matrix
    except ConfigError:
        return None
