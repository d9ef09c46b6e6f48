"""What falls and flies before a camera, as values of one frame.

Of all lamps, it is lit by the few that give most light there. Spray that tyres throw up from wet
roads is made of puffs along the ways of wheels. Puffs are born at fixed times of the clock, where
wheels are then, and grow, slow down and thin out with their age. So a plume is a pure function of
the vehicle's motion and of time.

References:
    Kamm, W., Wunibald, I. and others measured that spray begins at about 30 to 50 km/h and grows
    with more than the square of speed; Pilkington, G. B., Splash and spray, ASTM STP 1031, 1990,
    doi:10.1520/STP23358S, gives that range. Sizes and depths of our puffs are chosen by eye.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from sumo3dviz_pt.cast.axles import rigid_frames
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.cast.poses import Present
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.falling import Cabin, Falling, Glows, Puffs, Throws
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import (
    Beam,
    FrameState,
    LampSet,
    Lobe,
    Mover,
    Prototype,
    RunningLights,
    SceneData,
    VehicleLamp,
    View,
)
from sumo3dviz_pt.model.traffic import RAIL_CLASSES
from sumo3dviz_pt.model.weather import Weather, WeatherCourse
from sumo3dviz_pt.shot.cameras.aiming import Camera
from sumo3dviz_pt.shot.cameras.riding import has_pane, windscreen_of

STEP = 0.08
"""Between the births of puffs [s]."""

LIFE = 1.4
"""After which nothing of a puff is left [s]."""

NEAR = 90.0
"""Vehicles whose spray is drawn are at most so far away [m]."""

_SLOWEST, _FULL = 7.0, 25.0  # speeds at which spray begins, and at which it is as dense as said
_DENSE = 0.15  # optical depth of a young puff then
_BORN = 0.12  # time in which a puff comes into being [s]
_DRAG = 0.5  # time in which air stops what a wheel throws after it [s]
_TAKEN = 0.45  # share of the vehicle's speed that spray has at first
_LIGHT = frozenset({"bicycle", "pedestrian", "scooter", "wheelchair", "ship", "aircraft", "drone"})


def spray(
    fleet: Fleet, present: Present, view: View, *, wetness: float, wind: tuple[float, float]
) -> Puffs:
    """Return the spray behind vehicles near a camera.

    Args:
        fleet: Everyone on the road.
        present: Who is there at the frame's time.
        view: The camera.
        wetness: Of roads, [0, 1].
        wind: Towards the east and the north [m/s].
    """
    away = np.linalg.norm(present.positions - view.position, axis=1)
    each = []
    for row in np.flatnonzero((away < NEAR) & (present.speeds > 0.5 * _SLOWEST)).tolist():
        body = fleet.bodies[int(present.users[row])]
        if body.vclass not in RAIL_CLASSES | _LIGHT:
            faded = float(np.clip(4.0 * (1.0 - away[row] / NEAR), 0.0, 1.0))
            each.append(_plume(fleet, present, row, wind=wind, dense=wetness * faded))
    if not each:
        return Puffs()
    at, radii, depths = (np.concatenate(column) for column in zip(*each, strict=True))
    ahead = depths > 1e-4
    return Puffs(at[ahead], radii[ahead], depths[ahead])


def _plume(
    fleet: Fleet, present: Present, row: int, *, wind: tuple[float, float], dense: float
) -> tuple[Floats, Floats, Floats]:
    """Return the puffs of a vehicle: places, radii, optical depths."""
    user = int(present.users[row])
    piece = fleet.presence.pieces[int(present.pieces[row])]
    length, width, _ = fleet.bodies[user].size
    born = _births(present.time, piece.begin, share_of(fleet.seed, fleet.keys[user], "spray"))
    motion = piece.sample(born)
    age = present.time - born
    ahead = np.column_stack([np.cos(motion.yaws), np.sin(motion.yaws), np.zeros(len(born))])
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0], np.zeros(len(born))])

    # It flies after the vehicle at first, then with the wind, and sinks.
    flown = _DRAG * -np.expm1(-age / _DRAG)
    blown = (age - flown)[:, None] * np.array([*wind, 0.0]) * 0.6
    thrown = (_TAKEN * motion.speeds * flown)[:, None] * ahead
    speed = np.clip((motion.speeds - _SLOWEST) / (_FULL - _SLOWEST), 0.0, 1.6)
    heavy = float(np.clip(length / 6.0, 0.7, 2.2))
    first = 0.22 + 0.1 * heavy
    radius = first + 0.75 * np.sqrt(age) * (0.6 + 0.4 * heavy)
    height = 0.25 + 0.5 * radius + 0.35 * age
    places, radii, depths = [], [], []
    wheels = [0.92 * length] if length < 7.0 else [0.25 * length, 0.6 * length, 0.92 * length]
    for back in wheels:
        for side in (-0.38 * width, 0.38 * width):
            middle = motion.positions - back * ahead + side * aside + thrown + blown
            middle[:, 2] += height
            young = np.clip(age / _BORN, 0.0, 1.0)
            old = np.clip((LIFE - age) / (0.6 * LIFE), 0.0, 1.0)
            depth = _DENSE * dense * heavy * speed**2 * first / radius * young * old**2
            places.append(middle)
            radii.append(radius)
            depths.append(depth)
    return np.concatenate(places), np.concatenate(radii), np.concatenate(depths)


def _births(time: float, begin: float, share: float) -> Floats:
    """Return when the puffs were born that still live at a time, the oldest first, (n,) [s]."""
    last = np.floor(time / STEP - share)
    numbers = last - np.arange(int(LIFE / STEP), -1, -1)
    born = (numbers + share) * STEP
    return np.asarray(born[(born >= begin) & (born <= time) & (time - born < LIFE)])


MOST_GLOWS, MOST_THROWS = 20, 6
"""Lamps, and vehicles with head lamps, whose light falls on drops."""

_AHEAD = 8.0  # the place before the eye that counts [m]
_FADE = 0.5  # above the weakest that is left out, in its light
_PATTERN = 64  # rows and columns of a beam's pattern
_OWN = frozenset({"dials", "screen"})  # inside the cabin


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """The lamps of a set as points.

    Attributes:
        id: Of the set.
        at: Middles, (n, 3) [m].
        axes: Unit, (n, 3).
        areas: (n,) [m^2].
        lobe: Floor and sharpness.
        radiance: Of lamps that never change, (n, 3), or None.
    """

    id: str
    at: Floats
    axes: Floats
    areas: Floats
    lobe: tuple[float, float]
    radiance: Floats | None

    @classmethod
    def of(cls, lamps: LampSet) -> Standing:
        """Return a set's lamps as points."""
        corners = lamps.mesh.vertices[lamps.mesh.faces]
        across = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area, count = np.linalg.norm(across, axis=1), len(lamps.lamps)
        lamp = np.asarray(lamps.lamp_of_face)

        def summed(values: Floats) -> Floats:
            columns = [np.bincount(lamp, weights=v, minlength=count) for v in values.T]
            return np.stack(columns, axis=1)

        areas = np.bincount(lamp, weights=area, minlength=count)
        axes, filled = summed(across), np.maximum(areas, 1e-12)[:, None]
        # What a lamp sends along its axis is its face as seen from there.
        facing = np.linalg.norm(axes, axis=1)
        return cls(
            lamps.id,
            summed(corners.mean(axis=1) * area[:, None]) / filled,
            axes / np.maximum(facing, 1e-12)[:, None],
            facing,
            (lamps.lobe.floor, lamps.lobe.sharpness),
            lamps.radiance,
        )

    def glows(self, lit: Mapping[str, Floats]) -> Glows:
        """Return its lamps as they shine in a frame.

        Args:
            lit: Radiance by set of those that change.
        """
        radiance = lit.get(self.id, self.radiance)
        if radiance is None:
            return Glows()
        intensity = np.asarray(radiance) * self.areas[:, None]
        return Glows(self.at, self.axes, intensity, np.tile(self.lobe, (len(self.at), 1)))


def running_glows(
    movers: Iterable[Mover], prototypes: Mapping[str, Prototype], lights: RunningLights
) -> Glows:
    """Return the lamps on road users.

    Args:
        movers: Road users and parts of them.
        prototypes: By name.
        lights: How bright lamps are.
    """
    at, axes, intensity, lobes = [], [], [], []
    for mover in movers:
        for lamp in prototypes[mover.prototype].lamps:
            if lamp.role not in mover.lit or lamp.role in _OWN or lamp.role not in lights.intensity:
                continue
            place, axis = _lamps_placed(mover, lamp)
            lobe = lights.lobes.get(lamp.role, Lobe())
            share = lights.heads.get(mover.prototype, 1.0) if lamp.role == "head" else 1.0
            at.append(place)
            axes.append(axis)
            intensity.append(share * np.array(lights.intensity[lamp.role]))
            lobes.append((lobe.floor, lobe.sharpness))
    if not at:
        return Glows()
    return Glows(np.array(at), np.array(axes), np.array(intensity), np.array(lobes))


def _lamps_placed(mover: Mover, lamp: VehicleLamp) -> tuple[Floats, Floats]:
    """Return a lamp's middle and axis in the world, (3,) each."""
    matrix = mover.world_from_body.matrix
    axis = matrix[:3, :3] @ np.array([np.cos(lamp.yaw), np.sin(lamp.yaw), 0.0])
    return matrix[:3, :3] @ np.array(lamp.at) + matrix[:3, 3], axis / np.linalg.norm(axis)


def nearest(glows: Sequence[Glows], view: View) -> Glows:
    """Return those lamps that give most light before the eye.

    Args:
        glows: All that shine.
        view: The camera.
    """
    whole = Glows(
        *(
            np.concatenate([getattr(each, name) for each in glows])
            for name in ("at", "axes", "intensity", "lobes")
        )
    )
    share = _shares(whole.at, whole.intensity, view, MOST_GLOWS)
    near = np.flatnonzero(share > 0.0)
    intensity = whole.intensity[near] * share[near, None]
    return Glows(whole.at[near], whole.axes[near], intensity, whole.lobes[near])


def throws(
    movers: Iterable[Mover], prototypes: Mapping[str, Prototype], lights: RunningLights, view: View
) -> Throws:
    """Return the head lamps that light the air before the eye.

    Args:
        movers: Road users and parts of them.
        prototypes: By name.
        lights: How bright lamps are.
        view: The camera.
    """
    if lights.beam is None:
        return Throws()
    frames, powers = [], []
    for mover in movers:
        heads = [lamp.at for lamp in prototypes[mover.prototype].lamps if lamp.role == "head"]
        if "head" in mover.lit and heads:
            frame = mover.world_from_body.matrix.copy()
            frame[:3, 3] = frame[:3, :3] @ np.mean(heads, axis=0) + frame[:3, 3]
            frame[:3, :3] /= np.linalg.norm(frame[:3, :3], axis=0)
            frames.append(frame)
            powers.append(lights.heads.get(mover.prototype, 1.0))
    if not frames:
        return Throws()
    placed = np.array(frames)
    intensity = np.array(powers)[:, None] * np.array(lights.beam.intensity)
    share = _shares(placed[:, :3, 3], intensity, view, MOST_THROWS)
    near = np.flatnonzero(share > 0.0)
    pattern = _coarse(lights.beam)
    edge = float(np.tan(lights.beam.half_angle))
    return Throws(placed[near], intensity[near] * share[near, None], pattern, edge)


def _coarse(beam: Beam) -> Floats:
    """Return a beam's pattern with fewer rows and columns."""
    block = max(1, len(beam.pattern) // _PATTERN)
    count = len(beam.pattern) // block
    whole_blocks = np.asarray(beam.pattern[: count * block, : count * block], dtype=np.float64)
    return np.asarray(whole_blocks.reshape(count, block, count, block).mean(axis=(1, 3)))


def _shares(at: Floats, intensity: Floats, view: View, most: int) -> Floats:
    """Return how much of lamps counts, so that none comes or goes suddenly, (n,) in [0, 1]."""
    away = np.linalg.norm(at - (view.position + _AHEAD * view.forward), axis=1)
    light = (intensity @ LUMINANCE) / (away**2 + 4.0)
    if len(light) <= most:
        return np.asarray((light > 0.0).astype(np.float64))
    weakest = max(float(np.sort(light)[-most - 1]), 1e-30)
    return np.asarray(np.clip((light / weakest - 1.0) / _FADE, 0.0, 1.0))


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
        if course is None or not (course.has_falling() or course.is_wet):
            return None
        standing = tuple(Standing.of(lamps) for lamps in data.lamps if lamps.sampled)
        weather = job.weather
        strength = None if weather is None or weather.rain is None else weather.rain.streaks
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
        rates: dict[str, Any] = {**weather.rates}
        exposure = exposure_of(camera)
        wind = (0.0, 0.0) if weather.wind is None else (weather.wind.east, weather.wind.north)
        lens = view.lens
        falling = Falling(
            time,
            exposure,
            self.seed,
            _ends(camera, view, time, exposure),
            **rates,
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
    place = partial(_falling_placed, camera)
    before, after = place(time - 0.5 * exposure), place(time + 0.5 * exposure)
    # At the ends of its life a camera goes on as it does on the other side.
    if before is None and after is None:
        return np.stack([here, here])
    if before is None and after is not None:
        before = here @ np.linalg.inv(after) @ here
    if after is None and before is not None:
        after = here @ np.linalg.inv(before) @ here
    return np.array([before, after])


def _falling_placed(camera: Camera, time: float) -> Floats | None:
    """Return where a camera is at a time, (4, 4); None when it is not there."""
    try:
        return camera.view_at(time).world_from_camera.matrix
    except ConfigError:
        return None
