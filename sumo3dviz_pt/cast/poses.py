"""How road users stand at a time: where, how they step, lean, bend, on wheels that roll.

Everything is a function of the time alone. Frames are sampled in blocks, because a sample of one
time costs as much as one of thirty. Blocks hold the frames of a shot, counted from its first one;
what a frame shows does not depend on them. What is expensive and the same for a whole stretch of
motion, such as the way of a wheel, is computed when it is first used, and kept.

Road users stand on the road that is drawn, whatever heights the log gives them. Their places from
above stay SUMO's. Only heights change, and how steeply bodies point up or down: front and rear of
each body stand on the surface. How far people have walked tells which phase of a stride they show.

A body that accelerates dives, squats and rolls on its springs, or leans. A body on springs answers
an acceleration as a damped oscillator does, which is a weighted mean of the last second's
accelerations: a pure function of time, smooth and without memory of frames. Riders of cycles lean
so that weight and centrifugal force go through the tyres; they begin before the bend, so their mean
looks ahead as far as it looks back.

References:
    T. D. Gillespie, Fundamentals of Vehicle Dynamics, SAE, 1992, chapter 6 (roll): cars
    roll by some 3 to 7 degrees per g; here 5. Sprung masses oscillate at 1 to 1.5 Hz
    (chapter 5). The dive of 1 degree at 5 m/s^2 is an estimate from pictures of braking cars.
    Lean: tan(angle) = v^2 curvature / g, as for any body that balances on a line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.cast.axles import Hub, Rolling, UnitLinks, rigid_frames, unit_frames
from sumo3dviz_pt.cast.bodies import Body
from sumo3dviz_pt.cast.drawing import AT_REST, Stance
from sumo3dviz_pt.cast.lamps import DerivedLamps, derived_lamps
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Transform
from sumo3dviz_pt.model.traffic import RAIL_CLASSES
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Trajectory

_RISE = 0.02
"""Half of a head's way up and down [m]: 3 to 5 cm in all at 1 to 1.5 m/s (Thorstensson, Nilsson,
Carlson and Zomlefer, Acta Physiologica Scandinavica 121, 1984)."""

_FULL_SPEED = 0.5
"""From this speed on people show whole strides; slower ones smaller ones [m/s]."""


def stride_phase(travelled: float, *, stride: float, start: float) -> float:
    """Return the phase of the stride, [0, 1): it depends on the way only, so that no foot slides.

    Args:
        travelled: How far a person has walked [m].
        stride: Length of two steps [m], > 0.
        start: Phase at the walk's beginning, so that not all walk in step.
    """
    return float((start + travelled / stride) % 1.0)


def head_rise(phase: float, share: float) -> float:
    """Return how much higher a walking head is than on average [m]: twice in a stride up and down.

    Args:
        phase: Of the stride, [0, 1); at 0 a heel strikes, and the head is lowest.
        share: How much of a stride is shown, [0, 1].
    """
    return float(-_RISE * share * np.cos(4.0 * np.pi * phase))


def effort(speed: float) -> float:
    """Return how much of a stride is shown at a speed [m/s]: 0 standing, 1 walking."""
    return float(np.clip(speed / _FULL_SPEED, 0.0, 1.0))


Rise = Callable[[Floats], Floats]
"""How far the drawn surface lies above points, (n, 3) -> (n,) [m]."""

_GROUNDED_AROUND = np.linspace(-0.9, 0.9, 7)
"""Heights are means over these places before and behind a point [m], so that edges of the
surface are felt as tyres and springs feel them; ..."""

_WEIGHTS = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]) / 16.0

_MOST_OFF = 0.04
"""... but they stay within this distance of the surface [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class GroundedPiece:
    """A stretch of motion on the drawn surface.

    Attributes:
        piece: The stretch at the log's heights.
        rise: How far the drawn surface lies above points.
        length: Of the body [m]; 0 of those that stay upright.
    """

    piece: MotionPiece
    rise: Rise
    length: float

    @property
    def begin(self) -> float:
        """First time at which the road user exists [s]."""
        return self.piece.begin

    @property
    def end(self) -> float:
        """Last time at which it exists [s]."""
        return self.piece.end

    def sample(self, times: Floats) -> Motion:
        """Return motion at times within [begin, end], (n,) [s]."""
        motion = self.piece.sample(times)
        front = motion.positions
        ahead = np.column_stack([np.cos(motion.yaws), np.sin(motion.yaws), np.tan(motion.pitches)])
        ups = self._mean_rise(front, ahead)
        # Who walks stays upright on any slope, of which the log tells.
        pitches = np.zeros_like(motion.pitches)
        if self.length:
            pitches = motion.pitches
            level = self.length * np.cos(pitches)
            behind = self._mean_rise(front - level[:, None] * ahead, ahead)
            pitches = np.arctan(np.tan(pitches) + (ups - behind) / level)
        return replace(motion, positions=_lifted(front, ups), pitches=pitches)

    def trail(self, times: Floats, distances: Floats) -> Floats:
        """Return points behind the front, (n, k, 3) [m]; see `MotionPiece.trail`."""
        points = self.piece.trail(times, distances)
        flat = points.reshape(-1, 3)
        return _lifted(flat, self.rise(flat)).reshape(points.shape)

    def _mean_rise(self, points: Floats, ahead: Floats) -> Floats:
        """The mean rise around points, (n,) [m], along directions, (n, 3)."""
        around = points[:, None] + _GROUNDED_AROUND[:, None] * ahead[:, None]
        rises = self.rise(around.reshape(-1, 3)).reshape(-1, len(_GROUNDED_AROUND))
        here = rises[:, len(_GROUNDED_AROUND) // 2]
        return np.asarray(here + _MOST_OFF * np.tanh((rises @ _WEIGHTS - here) / _MOST_OFF))


def grounded(trajectory: Trajectory, rise: Rise, *, length: float) -> Trajectory:
    """Return a trajectory on the drawn surface.

    Args:
        trajectory: At the log's heights.
        rise: How far the drawn surface lies above points, (n, 3) -> (n,) [m].
        length: Of the body [m]; 0 of those that stay upright.
    """
    pieces = tuple(GroundedPiece(piece, rise, length) for piece in trajectory.pieces)
    return replace(trajectory, pieces=pieces)


def _lifted(points: Floats, ups: Floats) -> Floats:
    """Points, (n, 3), moved up, (n,) [m]."""
    return np.column_stack([points[:, :2], points[:, 2] + ups])


BLOCK = 32
"""Frames that are sampled together."""

_COLUMNS = 7


@dataclass(frozen=True, slots=True, eq=False)
class Present:
    """All road users that exist at a time, in the order of the trajectories.

    Attributes:
        time: SUMO's [s].
        users: Index of each road user, (n,).
        pieces: Index of its stretch of motion, (n,).
        positions: Front's middle on the ground, (n, 3) [m].
        yaws: (n,) [rad].
        pitches: Nose up, (n,) [rad].
        speeds: (n,) [m/s].
        travelled: Since the stretch began, (n,) [m].
    """

    time: float
    users: Ints
    pieces: Ints
    positions: Floats
    yaws: Floats
    pitches: Floats
    speeds: Floats
    travelled: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _MotionBlock:
    """Motion of all stretches that live within a block: (p,), (t,) and (p, t, columns)."""

    pieces: Ints
    times: Floats
    values: Floats


class Presence:
    """Looks up which road users exist at a time."""

    def __init__(self, trajectories: Sequence[Trajectory], times: Floats | None = None) -> None:
        """Index the stretches of motion.

        Args:
            trajectories: Of all road users.
            times: Of a shot's frames, increasing, (n,) [s]; other times take longer.
        """
        owned = [(k, piece) for k, t in enumerate(trajectories) for piece in t.pieces]
        self.pieces: tuple[MotionPiece, ...] = tuple(piece for _, piece in owned)
        self.owners: Ints = np.array([k for k, _ in owned], dtype=np.int64)
        lives = [(piece.begin, piece.end) for _, piece in owned]
        self.lives: Floats = np.array(lives, dtype=np.float64).reshape(-1, 2)
        self._times = np.empty(0) if times is None else np.asarray(times, dtype=np.float64)
        self._cached: tuple[int, _MotionBlock] | None = None

    def at(self, time: float) -> Present:
        """Return all road users that exist at a time [s]."""
        block = self._block(time)
        alive = self._alive(np.array([time]))[block.pieces, 0]
        column = int(np.searchsorted(block.times, time))
        values = block.values[alive, column]
        pieces = block.pieces[alive]
        users = self.owners[pieces]
        return Present(time, users, pieces, values[:, :3], *values[:, 3:].T)

    def _block(self, time: float) -> _MotionBlock:
        """The block that a time belongs to, from the last call or new."""
        index = int(np.searchsorted(self._times, time))
        if index == len(self._times) or self._times[index] != time:
            return self._sampled(np.array([time]))
        number = index // BLOCK
        cached = self._cached
        if cached is None or cached[0] != number:
            cached = number, self._sampled(self._times[number * BLOCK : (number + 1) * BLOCK])
            self._cached = cached
        return cached[1]

    def _sampled(self, times: Floats) -> _MotionBlock:
        """Sample all road users that exist at some of the times."""
        alive = self._alive(times)
        pieces = np.flatnonzero(alive.any(axis=1))
        values = np.empty((len(pieces), len(times), _COLUMNS))
        for row, number in enumerate(pieces.tolist()):
            live = alive[number]
            begin, end = self.lives[number]
            motion = self.pieces[number].sample(np.clip(times[live], begin, end))
            values[row, live, :3] = motion.positions
            values[row, live, 3], values[row, live, 4] = motion.yaws, motion.pitches
            values[row, live, 5], values[row, live, 6] = motion.speeds, motion.travelled
        return _MotionBlock(pieces, times, values)

    def _alive(self, times: Floats) -> Bools:
        """Which stretches exist at which times, (p, t)."""
        begin, end = self.lives[:, :1], self.lives[:, 1:]
        return np.asarray((begin - 1e-9 <= times) & (times <= end + 1e-9))


_GRAVITY = 9.81
_FREQUENCY = 1.3  # of the body on its springs [Hz]
_DAMPING = 0.5
_LASTS = 1.2  # how long an acceleration is felt [s]
_STEP = 0.05
_LOOK = 0.4  # of riders, ahead and back [s]
_MOST_LEAN = float(np.radians(30.0))


@dataclass(frozen=True, slots=True)
class Springs:
    """How a body answers acceleration.

    Attributes:
        dive: Pitch per longitudinal acceleration [rad s^2/m].
        roll: Roll per lateral acceleration [rad s^2/m].
        most_dive: Limit of the pitch [rad].
        most_roll: Limit of the roll [rad].
        height: Of the axis of roll over the ground [m].
    """

    dive: float
    roll: float
    most_dive: float
    most_roll: float
    height: float


def _springs(
    *, dive: float, roll: float, most_dive: float, most_roll: float, height: float
) -> Springs:
    """Springs whose angles are given in degrees."""
    dive, roll, most_dive, most_roll = np.radians([dive, roll, most_dive, most_roll]).tolist()
    return Springs(dive, roll, most_dive, most_roll, height)


SPRINGS: Mapping[str, Springs] = {
    "car": _springs(dive=0.20, roll=0.50, most_dive=1.5, most_roll=2.5, height=0.30),
    "heavy": _springs(dive=0.10, roll=0.40, most_dive=0.8, most_roll=2.0, height=0.60),
}
"""Springs by the sort of body; bodies that lean have none."""


@dataclass(frozen=True, slots=True)
class BodySway:
    """What a body does at a time.

    Attributes:
        pitch: Nose up [rad].
        roll: Right side down [rad].
    """

    pitch: float = 0.0
    roll: float = 0.0

    def about(self, x: float, height: float) -> Floats:
        """Return the motion in the body's frame, (4, 4), about a point of its middle plane.

        Args:
            x: Of the point, forward [m].
            height: Of the point [m].
        """
        point = np.array([x, 0.0, height])
        turned = Transform.from_pose((0.0, 0.0, 0.0), pitch=self.pitch, roll=self.roll).matrix
        matrix = turned.copy()
        matrix[:3, 3] = point - turned[:3, :3] @ point
        return matrix


def sway_at(piece: MotionPiece, time: float, *, springs: Springs) -> BodySway:
    """Return what springs do to a body.

    Args:
        piece: A stretch of its motion.
        time: Within the stretch [s].
        springs: The body's.
    """
    along, across = _accelerations(piece, time - _BACK)
    dive = springs.dive * float(_ANSWER @ along)
    roll = springs.roll * float(_ANSWER @ across)
    return BodySway(_limited(dive, springs.most_dive), _limited(roll, springs.most_roll))


def lean_at(piece: MotionPiece, time: float) -> BodySway:
    """Return how far riders lean into a bend at a time [s]."""
    _, across = _accelerations(piece, time + _SWAY_AROUND)
    lean = np.arctan(float(_SHARES @ across) / _GRAVITY)
    return BodySway(roll=-float(np.clip(lean, -_MOST_LEAN, _MOST_LEAN)))


def _accelerations(piece: MotionPiece, times: Floats) -> tuple[Floats, Floats]:
    """Along the path and to the left, (n,) [m/s^2] each; 0 outside the piece's life."""
    edges = np.concatenate([times - _STEP / 2.0, times + _STEP / 2.0])
    motion = piece.sample(np.clip(edges, piece.begin, piece.end))
    speeds, yaws = (values.reshape(2, -1) for values in (motion.speeds, motion.yaws))
    turns = (yaws[1] - yaws[0] + np.pi) % (2.0 * np.pi) - np.pi
    return (speeds[1] - speeds[0]) / _STEP, speeds.mean(axis=0) * turns / _STEP


def _limited(angle: float, most: float) -> float:
    """An angle that approaches a limit smoothly [rad]."""
    return float(most * np.tanh(angle / most))


def _answer(times: Floats) -> Floats:
    """Weights of an oscillator's answer to accelerations of some time ago, (n,)."""
    free = 2.0 * np.pi * _FREQUENCY
    swing = free * np.sqrt(1.0 - _DAMPING**2)
    weights = np.exp(-_DAMPING * free * times) * np.sin(swing * times)
    return np.asarray(weights / weights.sum())


_BACK = np.arange(0.0, _LASTS + 1e-9, _STEP)
_ANSWER = _answer(_BACK)
_SWAY_AROUND = np.arange(-_LOOK, _LOOK + 1e-9, _STEP)
_SHARES = np.cos(np.pi / 2.0 * _SWAY_AROUND / (_LOOK + _STEP)) ** 2
_SHARES /= _SHARES.sum()


_ON_WATER = frozenset(["ship"])


class PoseSampler:
    """Looks up how road users stand."""

    def __init__(
        self,
        trajectories: Sequence[Trajectory],
        bodies: Sequence[Body],
        presence: Presence,
        *,
        suspension: bool,
    ) -> None:
        """Keep references to what poses depend on.

        Args:
            trajectories: Of all road users.
            bodies: What each shows.
            presence: Their stretches of motion.
            suspension: Whether bodies move on their springs.
        """
        self._trajectories, self._bodies, self._presence = trajectories, bodies, presence
        self._suspension = suspension
        self._rolling: dict[int, Rolling] = {}
        self._derived: dict[int, DerivedLamps] = {}

    def stance(self, piece: int, time: float, *, full: bool, ridden: bool) -> Stance:
        """Return how a road user stands.

        Args:
            piece: Index of its stretch of motion.
            time: SUMO's [s].
            full: Whether it is drawn in full detail, with separate wheels.
            ridden: Whether the camera rides with it.
        """
        body = self._bodies[self._presence.owners[piece]]
        motion, links = self._presence.pieces[piece], links_of(body)
        units = None if links is None else unit_frames(motion, np.array([time]), links)[0]
        springs = springs_of(body) if self._suspension and (full or ridden) else None
        sway = None if springs is None else _swayed(body, sway_at(motion, time, springs=springs))
        wheels = self._wheels(piece).at(time) if full else None
        if units is None and sway is None and wheels is None:
            return AT_REST
        return Stance(units, sway, wheels)

    def lean(self, piece: int, time: float) -> Floats:
        """Return what riders of a cycle add to its placement, in its frame, (4, 4)."""
        return lean_at(self._presence.pieces[piece], time).about(0.0, 0.0)

    def derived(self, piece: int) -> DerivedLamps:
        """Return when the lamps of a vehicle without logged signals shine."""
        if piece not in self._derived:
            user = int(self._presence.owners[piece])
            steers = self._bodies[user].vclass not in RAIL_CLASSES | _ON_WATER
            remarks = self._trajectories[user].remarks
            motion = self._presence.pieces[piece]
            self._derived[piece] = derived_lamps(motion, remarks, steers=steers)
        return self._derived[piece]

    def _wheels(self, piece: int) -> Rolling:
        """The wheels of a road user that has full detail."""
        if piece not in self._rolling:
            body = self._bodies[self._presence.owners[piece]]
            motion, links = self._presence.pieces[piece], links_of(body)
            hubs = [
                Hub.of(number, place, body.scale * [unit.stretch, 1.0, 1.0])
                for number, unit in enumerate(body.assembly.units)
                for place in unit.wheels
            ]
            if body.ride == "lean":  # forks are part of the body, and riders lean to steer
                hubs = [replace(hub, steered=False) for hub in hubs]
            self._rolling[piece] = Rolling.of(
                motion.begin, motion.end, hubs, lambda times: _frames(motion, times, links)
            )
        return self._rolling[piece]


def links_of(body: Body) -> UnitLinks | None:
    """Return where the units of a body are held, as drawn; None where it is rigid."""
    return body.assembly.links(body.scale) if body.assembly.bends else None


def springs_of(body: Body) -> Springs | None:
    """Return the springs of a body, or None where it has none."""
    return SPRINGS.get(body.ride)


def first_frame(piece: MotionPiece, time: float, links: UnitLinks | None) -> Floats:
    """Return the placement of a road user's first unit, unscaled, (4, 4).

    Args:
        piece: A stretch of its motion.
        time: Within the stretch [s].
        links: Where its units are held; None where it is rigid.
    """
    return np.asarray(_frames(piece, np.array([time]), links)[0, 0])


def sway_of(body: Body, piece: MotionPiece, time: float) -> Floats:
    """Return what springs or riders do to a body's first unit, in its frame, (4, 4).

    Args:
        body: The body.
        piece: A stretch of its motion.
        time: Within the stretch [s].
    """
    springs = springs_of(body)
    if springs is not None:
        sway = sway_at(piece, time, springs=springs)
        return np.asarray(_swayed(body, sway)[0])
    return lean_at(piece, time).about(0.0, 0.0) if body.ride == "lean" else np.eye(4)


def _frames(piece: MotionPiece, times: Floats, links: UnitLinks | None) -> Floats:
    """Placements of all units at times, (n, u, 4, 4), unscaled."""
    if links is not None:
        return unit_frames(piece, times, links)
    motion = piece.sample(times)
    return rigid_frames(motion.positions, motion.yaws, motion.pitches)[:, None]


def _swayed(body: Body, sway: BodySway) -> Floats:
    """What springs do to all units, each in its frame, (u, 4, 4).

    Units that are joined roll together and do not dive: they would part at the joint.
    """
    units = body.assembly.units
    height = SPRINGS[body.ride].height
    if len(units) == 1:
        return sway.about(-body.size[0] / 2.0, height)[None]
    rolled = BodySway(roll=sway.roll).about(0.0, height)
    return np.broadcast_to(rolled, (len(units), 4, 4))
