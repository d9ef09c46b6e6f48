"""Cameras that ride with a road user; what their views are is data in `scene_templates/camera`.

All views are pure functions of time: a camera that swings after its vehicle averages
the vehicle's heading over the last second instead of remembering its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any

import numpy as np

from sumo3dviz_pt.cast.articulation import UnitLinks
from sumo3dviz_pt.cast.bodies import Body
from sumo3dviz_pt.cast.cockpits import cabin_of
from sumo3dviz_pt.cast.fleet import Fleet, find_rider
from sumo3dviz_pt.cast.gait import effort, head_rise, stride_phase
from sumo3dviz_pt.cast.pose_sampler import first_frame, links_of, sway_of
from sumo3dviz_pt.catalog import did_you_mean, template
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import LagrangianCamera, LensSettings
from sumo3dviz_pt.library.vehicles.interior.cutaway import Cabin, has_dashboard
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.panes import Pane
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.shutter import INSTANT, Shutter
from sumo3dviz_pt.model.trajectory import MotionPiece, Trajectory
from sumo3dviz_pt.shot.cameras.aiming import Aim, aim_at
from sumo3dviz_pt.shot.cameras.build import ALWAYS, Camera, build_camera
from sumo3dviz_pt.shot.cameras.eyes import clear_eye
from sumo3dviz_pt.shot.cameras.lenses import lens_of
from sumo3dviz_pt.shot.falling.windscreen import pane_of

_LAG_SAMPLES = 49
_ON_BODY = frozenset({"eye", "bonnet"})
"""Anchors that lie in or on the body."""


@dataclass(frozen=True, slots=True)
class RidingView:
    """A preset of `scene_templates/camera`.

    Attributes:
        anchor: Where on the body: `eye`, `bonnet` (towards the windscreen, at its
            foot's height), `rear` or `middle` (at the roof's height).
        fov: Horizontal opening angle [deg].
        offset: From the anchor: ahead, left, up [m].
        side: Of the eye: `driver` or `passenger`.
        pitch_deg: Upwards [deg].
        heading_deg: To the kerb's side from straight ahead [deg].
        aim: A point to look at, from the anchor [m], instead of the pitch; or None.
        lag: Time over which the heading is averaged [s]; 0 turns with the body.
        cutaway: Whether the own cabin is not drawn.
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
        lens_of(settings.lens or LensSettings(), degrees=preset.fov),
        preset.lag,
        preset.cutaway,
        middle,
        body,
        fleet.suspension,
        first_step=fleet.first_step(trajectory.key) if settings.bobbing else None,
        mirrors=inside and cabin is Cabin.ROAD,
        pane=pane_of(body) if inside and settings.reflections else None,
    )


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
    anchors: Mapping[str, Floats] = {
        "eye": eye * (1.0, 1.0 if on_left else -1.0, 1.0),
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
