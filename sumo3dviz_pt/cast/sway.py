"""What acceleration does to a body: it dives, squats and rolls on its springs, or leans.

A body on springs answers an acceleration as a damped oscillator does, which is a weighted
mean of the last second's accelerations: a pure function of time, smooth and without
memory of frames. Riders of cycles lean so that weight and centrifugal force go through
the tyres; they begin before the bend, so their mean looks ahead as far as it looks back.

References:
    T. D. Gillespie, Fundamentals of Vehicle Dynamics, SAE, 1992, chapter 6 (roll): cars
    roll by some 3 to 7 degrees per g; here 5. Sprung masses oscillate at 1 to 1.5 Hz
    (chapter 5). The dive of 1 degree at 5 m/s^2 is an estimate from pictures of braking cars.
    Lean: tan(angle) = v^2 curvature / g, as for any body that balances on a line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.trajectory import MotionPiece

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
class Sway:
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


def sway_at(piece: MotionPiece, time: float, *, springs: Springs) -> Sway:
    """Return what springs do to a body.

    Args:
        piece: A stretch of its motion.
        time: Within the stretch [s].
        springs: The body's.
    """
    along, across = _accelerations(piece, time - _BACK)
    dive = springs.dive * float(_ANSWER @ along)
    roll = springs.roll * float(_ANSWER @ across)
    return Sway(_limited(dive, springs.most_dive), _limited(roll, springs.most_roll))


def lean_at(piece: MotionPiece, time: float) -> Sway:
    """Return how far riders lean into a bend at a time [s]."""
    _, across = _accelerations(piece, time + _AROUND)
    lean = np.arctan(float(_SHARES @ across) / _GRAVITY)
    return Sway(roll=-float(np.clip(lean, -_MOST_LEAN, _MOST_LEAN)))


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
_AROUND = np.arange(-_LOOK, _LOOK + 1e-9, _STEP)
_SHARES = np.cos(np.pi / 2.0 * _AROUND / (_LOOK + _STEP)) ** 2
_SHARES /= _SHARES.sum()
