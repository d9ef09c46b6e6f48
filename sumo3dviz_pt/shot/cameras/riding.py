"""Cameras that ride with a road user, their eyes, and the wet pane before a driver.

What their views are is data in `scene_templates/camera`. All views are pure functions of time: a
camera that swings after its vehicle averages the vehicle's heading over the last second instead of
remembering its own. An eye is kept out of the body that it rides with: out of heads, bonnets and
closed cabins. A pane says where it is, and how its wipers move.

References:
    Distance from a point to a triangle: Ericson, Real-Time Collision Detection (2005), 5.1.5.
    Rays and triangles: Moeller and Trumbore, Journal of Graphics Tools 2 (1997).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from sumo3dviz_pt.cast.axles import UnitLinks
from sumo3dviz_pt.cast.bodies import Body, cabin_of, has_windscreen
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.cast.fleet import Fleet, find_rider
from sumo3dviz_pt.cast.poses import effort, first_frame, head_rise, links_of, stride_phase, sway_of
from sumo3dviz_pt.catalog import did_you_mean, template
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job, LagrangianCamera, LensSettings
from sumo3dviz_pt.library.vehicles.interior.cutaway import has_dashboard
from sumo3dviz_pt.library.vehicles.interior.mirrors import INNER_PLACE
from sumo3dviz_pt.model.camera import INSTANT, Shutter
from sumo3dviz_pt.model.falling import Cabin, Pane, Windscreen
from sumo3dviz_pt.model.geometry import Floats, Ints, Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.projections import Distortion
from sumo3dviz_pt.model.scene import Prototype, View
from sumo3dviz_pt.model.trajectory import MotionPiece, Trajectory
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.shot.cameras.aiming import ALWAYS, Aim, Camera, aim_at, build_camera, lens_of

CLEAR = 0.17
"""Nothing of the own body is nearer to an eye [m]; springs and steps move it by 2 cm."""

_FREE = 4.0
"""And nothing of it stands straight before an eye within this way [m]."""

_STEP = 0.03
"""Of the search [m]."""


def clear_eye(eye: Floats, body: Body, *, opened: bool) -> Floats:
    """Move an eye forward until its own body is not before it.

    Args:
        eye: In the body's frame, (3,) [m].
        body: The body.
        opened: Whether its first unit is cut away around the eye; the others are drawn whole, and
            a ship's bridge is on the last.

    Returns:
        The first free place, (3,) [m]: at the latest just ahead of the body.
    """
    units = body.assembly.units[1:] if opened else body.assembly.units
    if not units:
        return eye
    corners = np.concatenate([each for unit in units for each in _triangles(body, unit)])
    reach = max(float(corners[..., 0].max()) + CLEAR - eye[0], 0.0)
    # Only what is about as high and as far aside can be near the way.
    across = corners[..., 1:] - eye[1:]
    near = corners[((across.min(axis=1) < CLEAR) & (across.max(axis=1) > -CLEAR)).all(axis=1)]
    for ahead in np.append(np.arange(0.0, reach, _STEP), reach):
        place = eye + np.array([ahead, 0.0, 0.0])
        if not _blocked(place, near) and _distance(place, near) >= CLEAR:
            break
    return np.asarray(place)


def _triangles(body: Body, unit: Unit) -> Iterator[Floats]:
    """All triangles of a unit in all its poses, in the body's frame, (m, 3, 3) each [m]."""
    for vertices, faces in _shapes(unit.prototype):
        scale = body.scale * [unit.stretch, 1.0, 1.0]
        yield (scale * vertices + body.scale * [unit.at, 0.0, 0.0])[faces]


def _shapes(prototype: Prototype) -> Iterator[tuple[Floats, Ints]]:
    """Vertices and faces of a body, once for each of its poses."""
    meshes = [part.mesh for part in prototype.parts]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([m.faces + first for m, first in zip(meshes, starts, strict=False)])
    if prototype.poses is None:
        yield np.concatenate([mesh.vertices for mesh in meshes]), faces
        return
    for vertices in prototype.poses.vertices:
        yield vertices, faces


def _blocked(place: Floats, triangles: Floats) -> bool:
    """Whether a triangle stands straight before a place."""
    a = triangles[:, 0] - place
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    # The ray runs along +x: whether it passes is a matter of y and z alone.
    scale = _cross(first, second)
    flat = np.abs(scale) < 1e-12
    scale = np.where(flat, 1.0, scale)
    u, v = _cross(-a, second) / scale, _cross(first, -a) / scale
    away = a[:, 0] + u * first[:, 0] + v * second[:, 0]
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & ~flat
    return bool((inside & (away > 0.0) & (away < _FREE)).any())


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross product of what vectors are across x, (n, 3); (n,)."""
    return np.asarray(a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1])


def _distance(place: Floats, triangles: Floats) -> float:
    """From a place to the nearest of some triangles [m]."""
    near = (triangles[..., 0].min(axis=1) < place[0] + CLEAR) & (
        triangles[..., 0].max(axis=1) > place[0] - CLEAR
    )
    corners = triangles[near] - place
    if not len(corners):
        return np.inf
    sides = [_to_side(corners[:, k], corners[:, (k + 1) % 3]) for k in range(3)]
    return float(min(*(side.min() for side in sides), _to_inner(corners).min(initial=np.inf)))


def _to_side(a: Floats, b: Floats) -> Floats:
    """From the origin to the nearest points of lines between points, (n, 3); (n,) [m]."""
    way = b - a
    squared = np.maximum((way * way).sum(axis=1), 1e-18)
    share = np.clip(-(a * way).sum(axis=1) / squared, 0.0, 1.0)
    return np.asarray(np.linalg.norm(a + share[:, None] * way, axis=1))


def _to_inner(corners: Floats) -> Floats:
    """From the origin to the planes of those triangles that its foot lies in, (m,) [m]."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    long = np.maximum(np.linalg.norm(normal, axis=1), 1e-18)
    high = (a * normal).sum(axis=1) / long
    foot = high[:, None] * normal / long[:, None]
    inside = np.ones(len(a), dtype=np.bool_)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(end - start, foot - start) * normal).sum(axis=1) >= 0.0
    return np.asarray(np.abs(high[inside]))


_RATES = ((0.0, 0.0), (0.2, 0.1), (1.0, 0.2), (4.0, 0.45), (10.0, 0.75), (25.0, 1.0), (50.0, 1.1))
"""Turns of wipers each second by the rate of rain [mm/h]: from an interval of ten seconds to the
65 a minute of the faster step."""

_RAISED = 0.12  # from the roof down to the pane's upper edge [m]
_BEFORE = 0.32  # from the eye to the upper edge, along the vehicle [m]
_WIDE = 0.8  # share of the vehicle's width
_SETTLING = (
    28.0  # drops large enough to be seen that settle on a square metre in a second, at 1 mm/h
)


_RARELY = 0.01  # turns each second that stand for wipers at rest


def has_pane(course: WeatherCourse | None, job: Job) -> bool:
    """Return whether rides look through a wet pane, with wipers, at any time.

    Args:
        course: The weather over time, or None.
        job: The scene file.
    """
    if course is None or not course.rains:
        return False
    return job.weather is None or job.weather.windscreen is not False


def windscreen_of(
    body: Body, cabin: Cabin, view: View, *, course: WeatherCourse, time: float
) -> Windscreen | None:
    """Return the pane before a camera that sits in a vehicle; it is dry while no rain falls.

    Ships, aircraft, containers and such have none.

    Args:
        body: What the vehicle shows.
        cabin: Where it is.
        view: The camera.
        course: The weather over time.
        time: [s].
    """
    if not has_windscreen(body):
        return None
    weather = course.at(time)
    rate = 0.0 if weather.rain is None else weather.rain.rate
    pane = pane_of(body)
    frame, (across, tall) = pane.world_from_pane.matrix, pane.size
    camera = view.world_from_camera.matrix
    placed = np.linalg.inv(camera) @ cabin.world_from_body @ frame
    # Two blades side by side that turn the same way, from the passenger's side.
    side = 1.0 if (np.linalg.inv(cabin.world_from_body) @ camera)[1, 3] >= 0.0 else -1.0
    pivots = np.array([[side * 0.36 * across, -0.04], [-side * 0.12 * across, -0.04]])
    long = min(0.47 * across, 0.95 * tall)
    turns = turned(course, time)
    per_second = max(_turns(rate), _RARELY)
    wet = _SETTLING * rate**0.8
    return Windscreen(
        placed, (across, tall), pivots, (0.1 * long, long), turns, 1.0 / per_second, wet
    )


def pane_of(body: Body) -> Pane:
    """Return the windscreen of a body, placed in the body's own frame."""
    _, width, height = body.size
    foot, eye = body.seat.cowl, body.seat.eye
    top = np.array([min(eye[0] + _BEFORE, foot[0] - 0.05), 0.0, height - _RAISED])
    top[2] = max(top[2], foot[2] + 0.3)
    frame, tall = _frame(np.array([foot[0], 0.0, foot[2]]), top)
    return Pane(Transform(frame), (_WIDE * width, tall))


def _frame(foot: Floats, top: Floats) -> tuple[Floats, float]:
    """Return the pane's placement in the body's frame, (4, 4), and its height [m]."""
    up = top - foot
    tall = float(np.linalg.norm(up))
    up /= tall
    left = np.array([0.0, 1.0, 0.0])
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = left, up, np.cross(left, up)
    frame[:3, 3] = foot
    return frame, tall


def turned(course: WeatherCourse, time: float) -> float:
    """Return how often wipers have turned since time 0."""
    low, high = sorted((0.0, time))
    moments = [low, *(at for at in course.times if low < at < high), high]
    # Finer steps between moments, as turns do not follow the rate evenly.
    times = np.unique(np.concatenate([np.linspace(a, b, 17) for a, b in pairwise(moments)]))
    rates = [course.at(float(at)).rain for at in times]
    each = np.array([_turns(0.0 if rain is None else rain.rate) for rain in rates])
    total = float((0.5 * (each[1:] + each[:-1]) * np.diff(times)).sum())
    return total if time >= 0.0 else -total


def _turns(rate: float) -> float:
    """Return the turns of wipers each second in a rain [mm/h]."""
    rates, turns = np.array(_RATES).T
    return float(np.interp(rate, rates, turns))


_LAG_SAMPLES = 49
_ON_BODY = frozenset({"eye", "mirror", "bonnet"})
"""Anchors that lie in or on the body."""


@dataclass(frozen=True, slots=True)
class RidingView:
    """A preset of `scene_templates/camera`.

    Attributes:
        anchor: Where on the body: `eye`, `mirror` (as far ahead and as high as the inner one, on
            the axis), `bonnet` (towards the windscreen, at its foot's height), `rear` or `middle`
            (at the roof's height).
        fov: Horizontal opening angle [deg].
        offset: From the anchor: ahead, left, up [m].
        side: Of the eye: `driver` or `passenger`.
        pitch_deg: Upwards [deg].
        heading_deg: To the kerb's side from straight ahead [deg].
        aim: A point to look at, from the anchor [m], instead of the pitch; or None.
        lag: Time over which the heading is averaged [s]; 0 turns with the body.
        cutaway: Whether the own cabin is opened and a driver's built in it.
        distortion: Of a lens that the scene file does not describe, as OpenCV's k1 and k2.
        mirrors: Whether the own mirrors may be in view.
    """

    anchor: str
    fov: float
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    side: str = "driver"
    pitch_deg: float = 0.0
    aim: tuple[float, float, float] | None = None
    lag: float = 0.0
    cutaway: bool = False
    heading_deg: float = 0.0
    distortion: Distortion = (0.0, 0.0)
    mirrors: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class RidingCamera:
    """A Lagrangian camera.

    Attributes:
        trajectory: Of the road user that it rides with.
        eye: In the body's frame, (3,) [m].
        aim: In the body's frame [rad].
        lens: What it sees with.
        lag: Time over which the heading is averaged [s]; 0 turns with the body.
        cutaway: Whether the own cabin is not drawn.
        turns_about: The point that stays at rest in the picture, (3,) [m].
        body: The body whose first unit it sits in; None is a rigid one.
        springs: Whether the body's springs move the eye and nod the view. They never roll it:
            people keep their heads upright, and a rolling horizon makes sick.
        shutter: When it lets light in.
        slack: How long before and after its road user's life it stays where that is first or last
            [s].
        first_step: Phase with which its strides begin, if the view rises with each step.
        mirrors: Whether the mirrors of the own vehicle are before the eye.
        pane: The windscreen in the body's frame, if its reflections are wanted.
    """

    trajectory: Trajectory
    eye: Floats
    aim: Aim
    lens: Lens
    lag: float
    cutaway: bool
    turns_about: Floats
    body: Body | None = None
    springs: bool = False
    shutter: Shutter = INSTANT
    slack: float = 1e-9
    first_step: float | None = None
    mirrors: bool = False
    pane: Pane | None = None

    def view_at(self, time: float) -> View:
        """Return the view at a time [s].

        Raises:
            ConfigError: If the road user does not exist then; the message says when it does.
        """
        piece = self._piece(time)
        inside = min(max(time, piece.begin), piece.end)
        body = Transform(first_frame(piece, inside, self._links))
        if self.lag <= 0.0:
            placed = self._seated(piece, inside, body)
        else:
            pivot = body.points(self.turns_about[None])[0]
            swung, tilt = self._swung(piece, time)
            turned = Transform.from_pose((0.0, 0.0, 0.0), yaw=swung, pitch=tilt)
            body = Transform.from_pose(
                pivot - turned.points(self.turns_about[None])[0], yaw=swung, pitch=tilt
            )
            placed = body @ self.aim.placed(self.eye)
        if self.first_step is not None:
            placed = self._stepped(placed, piece, inside)
        mirrors = -body.matrix[:3, 0] if self.mirrors else None
        return View(
            placed,
            self.lens,
            rides_in=self.trajectory.key,
            cutaway=self.cutaway,
            mirrors=mirrors,
            pane=self._pane_in(body),
        )

    def moments(self, times: tuple[float, float] = ALWAYS) -> tuple[float, ...]:
        """Return the first time of a span at which its road user exists, if it does [s]."""
        begin, end = self.trajectory.pieces[0].begin, self.trajectory.pieces[-1].end
        return () if begin > times[1] or end < times[0] else (max(begin, times[0]),)

    def _pane_in(self, body: Transform) -> Pane | None:
        """The windscreen in the world, if its reflections are wanted."""
        if self.pane is None:
            return None
        return Pane(body @ self.pane.world_from_pane, self.pane.size)

    @property
    def _links(self) -> UnitLinks | None:
        """Where the units of an articulated vehicle are held."""
        return None if self.body is None else links_of(self.body)

    def _seated(self, piece: MotionPiece, time: float, frame: Transform) -> Transform:
        """The eye in a body that moves on its springs; the view nods with it."""
        if self.body is None or not self.springs:
            return frame @ self.aim.placed(self.eye)
        swayed = sway_of(self.body, piece, time)
        eye = frame.points((swayed @ [*self.eye, 1.0])[None, :3])[0]
        level = frame.matrix.copy()
        level[:3, 3] = 0.0
        nod = float(np.arcsin(np.clip(swayed[2, 0], -1.0, 1.0)))
        turned = Transform.from_pose((0.0, 0.0, 0.0), pitch=nod)
        seated = Transform(level) @ turned @ self.aim.placed(np.zeros(3))
        matrix = seated.matrix.copy()
        matrix[:3, 3] = eye
        return Transform(matrix)

    def _stepped(self, placed: Transform, piece: MotionPiece, time: float) -> Transform:
        """The eye as high as steps bring it."""
        stride = None if self.body is None else self.body.stride
        if stride is None or self.first_step is None:
            return placed
        motion = piece.sample(np.array([time]))
        travelled, speed = float(motion.travelled[0]), float(motion.speeds[0])
        phase = stride_phase(travelled, stride=stride, start=self.first_step)
        matrix = placed.matrix.copy()
        matrix[2, 3] += head_rise(phase, effort(speed))
        return Transform(matrix)

    def _piece(self, time: float) -> MotionPiece:
        """The stretch of motion at a time."""
        for piece in self.trajectory.pieces:
            if piece.begin - self.slack <= time <= piece.end + self.slack:
                return piece
        lives = ", ".join(
            f"{piece.begin:.12g} to {piece.end:.12g} s" for piece in self.trajectory.pieces
        )
        raise ConfigError(
            f"{self.trajectory.id!r} is not there at {time:.12g} s; it is there from {lives}",
            key="cameras",
        )

    def _swung(self, piece: MotionPiece, time: float) -> tuple[float, float]:
        """Mean yaw and pitch over the lag, of the piece only [rad]."""
        share = (np.arange(_LAG_SAMPLES) + 0.5) / _LAG_SAMPLES
        motion = piece.sample(np.clip(time - share * self.lag, piece.begin, piece.end))
        weights = np.sin(np.pi * share) ** 2
        weights /= weights.sum()
        yaw = np.arctan2(weights @ np.sin(motion.yaws), weights @ np.cos(motion.yaws))
        return float(yaw), float(weights @ motion.pitches)


def build_ride(settings: LagrangianCamera, *, fleet: Fleet, left_hand: bool) -> RidingCamera:
    """Seat a camera.

    Args:
        settings: Which road user it rides with, and how.
        fleet: Road users that it can ride with.
        left_hand: Whether traffic keeps left, so that drivers sit on the right.

    Raises:
        ConfigError: If the road user or the view is unknown; the message suggests some.
    """
    # Find the vehicle, and the eye in it.
    preset = read_view(settings.view)
    trajectory = find_rider(fleet, settings.vehicle)
    body = fleet.body(trajectory.key)
    anchor = _anchor(preset, body, left_hand=left_hand)
    eye = anchor + np.array(preset.offset)
    if settings.eye_height is not None:
        eye[2] = settings.eye_height
    if preset.anchor in _ON_BODY:
        eye = clear_eye(eye, body, opened=preset.cutaway)
    # Aim it; the scene file's angles win over the preset's.
    aim = _aim(preset, anchor, eye=eye)
    pitch = aim.pitch if settings.pitch is None else float(np.radians(settings.pitch))
    kerb = -preset.heading_deg if left_hand else preset.heading_deg
    turn = -float(np.radians(settings.heading + kerb))
    middle = np.array([-body.size[0] / 2.0, 0.0, 0.0])
    cabin = cabin_of(body)
    inside = preset.cutaway and has_dashboard(float(body.size[1]), cabin)
    if preset.aim is not None:
        # A camera that looks at its vehicle goes round it instead of looking away.
        eye = middle + Transform.from_pose((0.0, 0.0, 0.0), yaw=turn).points(eye - middle)
    return RidingCamera(
        trajectory,
        eye,
        Aim(aim.yaw + turn, pitch),
        _lens(settings.lens or LensSettings(), preset),
        preset.lag,
        preset.cutaway,
        middle,
        body,
        fleet.suspension,
        first_step=fleet.first_step(trajectory.key) if settings.bobbing else None,
        mirrors=inside and preset.mirrors and cabin.is_driven,
        pane=pane_of(body) if inside and settings.reflections else None,
    )


def _lens(settings: LensSettings, preset: RidingView) -> Lens:
    """Return the lens of the scene file, as wide as the preset's where it does not say how wide."""
    lens = lens_of(settings, degrees=preset.fov)
    if not settings.is_left_to_the_view:
        return lens
    return replace(lens, distortion=preset.distortion)


@build_camera.register
def _(settings: LagrangianCamera, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """Build a camera that rides with a road user."""
    return build_ride(settings, fleet=fleet, left_hand=left_hand)


def read_view(name: str) -> RidingView:
    """Read a preset of `scene_templates/camera`.

    Raises:
        ConfigError: If there is no such preset, or a key in it is wrong.
    """
    return parse_view(template("camera", name), name=name)


def parse_view(content: Mapping[str, Any], *, name: str) -> RidingView:
    """Take a preset's content as a view.

    Raises:
        ConfigError: If a key is unknown or missing; the message suggests one.
    """
    known = {item.name: item for item in fields(RidingView)}
    for key in content:
        if key not in known:
            raise ConfigError(
                f"unknown key {key!r}{did_you_mean(key, known)}", key=f"camera.{name}"
            )
    missing = [key for key, item in known.items() if item.default is MISSING and key not in content]
    if missing:
        raise ConfigError(f"key {missing[0]!r} is missing", key=f"camera.{name}")
    return RidingView(**{key: _tupled(value) for key, value in content.items()})


def _tupled(value: Any) -> Any:
    """Lists as tuples of numbers."""
    return tuple(map(float, value)) if isinstance(value, list) else value


def _anchor(preset: RidingView, body: Body, *, left_hand: bool) -> Floats:
    """The anchor in the body's frame, (3,) [m].

    Raises:
        ConfigError: If the preset names an unknown one.
    """
    length, _, height = body.size
    eye, cowl = body.seat.eye, body.seat.cowl
    on_left = (preset.side == "driver") != left_hand
    ahead, _, up = body.scale * INNER_PLACE
    anchors: Mapping[str, Floats] = {
        "eye": eye * (1.0, 1.0 if on_left else -1.0, 1.0),
        "mirror": np.array([eye[0] + ahead, 0.0, eye[2] + up]),
        "bonnet": cowl * (0.8, 1.0, 1.0),
        "rear": np.array([-length, 0.0, height]),
        "middle": np.array([-length / 2.0, 0.0, height]),
    }
    if preset.anchor not in anchors:
        message = f"no anchor is called {preset.anchor!r}{did_you_mean(preset.anchor, anchors)}"
        raise ConfigError(message, key="camera.anchor")
    return anchors[preset.anchor]


def _aim(preset: RidingView, anchor: Floats, *, eye: Floats) -> Aim:
    """The preset's viewing direction in the body's frame."""
    if preset.aim is not None:
        return aim_at(anchor + np.array(preset.aim) - eye)
    return Aim(0.0, float(np.radians(preset.pitch_deg)))
