"""Skeletons of figures and their postures: where hands and feet are, how the bones follow.

A skeleton says where joints are, and how bones carry the skin.

References:
    Segment lengths as shares of stature: R. Drillis, R. Contini, Body Segment Parameters,
    1966, as in D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed.,
    figure 4.1; children after the head-height canon of six heads.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.model.geometry import Floats

_LIMBS = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes")

BONES: tuple[str, ...] = (
    "pelvis",
    "chest",
    "head",
    *(f"{limb}_{side}" for side in ("l", "r") for limb in _LIMBS),
)
"""Bones in the order of weights and matrices."""

SIDES: Mapping[str, float] = {"l": 1.0, "r": -1.0}
"""Sign of y of each side."""

FORWARD, LEFT, UP = np.eye(3)

# Sole, ankle, knee, crotch, hips, waist, chest, shoulders, neck, chin, top: shares of the stature.
_ADULT = (0.0, 0.039, 0.285, 0.47, 0.53, 0.60, 0.715, 0.812, 0.848, 0.870, 1.0)
_CHILD = (0.0, 0.040, 0.265, 0.435, 0.49, 0.56, 0.68, 0.775, 0.810, 0.835, 1.0)
_REST_ABDUCTION = np.radians(9.0)


@dataclass(frozen=True, slots=True)
class BodyMeasures:
    """What a body is like.

    Attributes:
        height: Stature [m].
        woman: 0 a man's outline, 1 a woman's.
        build: Girth against the average, [0.8, 1.4].
        child: 0 an adult's proportions, 1 those of a child of six or seven.
    """

    height: float = 1.75
    woman: float = 0.0
    build: float = 1.0
    child: float = 0.0

    def z(self, share: Floats | float) -> Floats:
        """Return the height of a level that an adult has at a share of the stature [m]."""
        child = np.interp(share, _ADULT, _CHILD)
        return np.asarray(self.height * (share + self.child * (child - np.asarray(share))))

    def rise(self, low: float, high: float, z: Floats) -> Floats:
        """Rise smoothly from 0 at one level to 1 at another.

        Args:
            low: Level where it begins, as a share of an adult's stature; may be the upper one.
            high: Level where it ends.
            z: Heights, any shape [m].
        """
        return smoothstep(float(self.z(low)), float(self.z(high)), z)

    @property
    def head(self) -> float:
        """Factor of the head's size against a man's of 1.75 m."""
        adult = 0.94 - 0.02 * self.woman + 0.2 * (self.height - 1.72)
        return float(adult + self.child * (0.90 - adult))

    @property
    def shoulder(self) -> float:
        """Distance of the shoulder joints from the middle [m]."""
        return float(self.height * (0.108 - 0.012 * self.woman - 0.006 * self.child))

    @property
    def foot(self) -> float:
        """Factor of the foot's length against one of 0.27 m."""
        return float(0.152 * self.height * (1.0 - 0.04 * self.woman) / 0.27)


def joints(body: BodyMeasures) -> dict[str, Floats]:
    """Return where each bone begins, and `heel`, `tip` and `finger`, when standing straight [m]."""
    h = body.height
    points = {
        "pelvis": np.array([0.0, 0.0, float(body.z(0.53))]),
        "chest": np.array([-0.004 * h, 0.0, float(body.z(0.60))]),
        "head": np.array([-0.006 * h, 0.0, float(body.z(0.855))]),
    }
    arm = np.array([0.0, np.sin(_REST_ABDUCTION), -np.cos(_REST_ABDUCTION)])
    span = 1.0 - 0.05 * body.child
    for side, s in SIDES.items():
        flip = np.array([1.0, s, 1.0])
        shoulder = np.array([-0.010 * h, body.shoulder, float(body.z(0.812))])
        elbow = shoulder + 0.182 * span * h * arm
        wrist = elbow + 0.146 * span * h * (arm + np.array([0.06, -0.05, 0.0]))
        ankle = np.array([0.0, 0.046 * h, float(body.z(0.039))])
        places = {
            "upper_arm": shoulder,
            "forearm": elbow,
            "hand": wrist,
            "thigh": np.array([0.0, 0.050 * h, float(body.z(0.53))]),
            "shank": np.array([0.004 * h, 0.048 * h, float(body.z(0.285))]),
            "foot": ankle,
            "toes": ankle + np.array([0.115 * body.foot, 0.004 * h, 0.018 - ankle[2]]),
            "heel": ankle * [1, 1, 0] - [0.060 * body.foot, 0, 0],
            "tip": ankle * [1, 1, 0] + [0.205 * body.foot, 0.006 * h, 0],
            "finger": wrist + 0.105 * span * h * arm,
        }
        points |= {f"{name}_{side}": flip * place for name, place in places.items()}
    return points


def about_z(angle: float) -> Floats:
    """Return the rotation that turns to the left by an angle [rad], (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def about_y(angle: float) -> Floats:
    """Return the rotation that lowers the front by an angle [rad], (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def about_x(angle: float) -> Floats:
    """Return the rotation that lifts the left side by an angle [rad], (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _frame(along: Floats, axis: Floats) -> Floats:
    """Return orthonormal columns, (3, 3), of a direction and an axis roughly across it."""
    z = along / np.linalg.norm(along)
    y = axis - (axis @ z) * z
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z], axis=1)


def rotation(rest: tuple[Floats, Floats], posed: tuple[Floats, Floats]) -> Floats:
    """Return the rotation that carries a direction and an axis onto others, (3, 3)."""
    return np.asarray(_frame(*posed) @ _frame(*rest).T)


def bent(root: Floats, target: Floats, lengths: tuple[float, float], pole: Floats) -> Floats:
    """Find the middle joint of two bones.

    Args:
        root: Where the first begins, (3,) [m].
        target: Where the second should end; nearer if it is out of reach, (3,) [m].
        lengths: Of the bones [m].
        pole: Roughly where the middle joint points to, (3,).

    Returns:
        Middle and end, (2, 3) [m].
    """
    first, second = lengths
    way = target - root
    reach = float(np.linalg.norm(way))
    way = way / reach
    reach = min(reach, 0.9995 * (first + second))
    along = (first**2 - second**2 + reach**2) / (2.0 * reach)
    side = pole - (pole @ way) * way
    side /= np.linalg.norm(side)
    out = np.sqrt(max(first**2 - along**2, 0.0))
    return np.stack([root + along * way + out * side, root + reach * way])


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """Where a hand is.

    Attributes:
        wrist: (3,) [m].
        fingers: Direction of the straight fingers, (3,).
        palm: Direction that the palm faces, (3,).
        elbow: Roughly where the elbow points to, (3,).
    """

    wrist: Floats
    fingers: Floats
    palm: Floats
    elbow: Floats


@dataclass(frozen=True, slots=True)
class Swing:
    """How an arm hangs [rad].

    Attributes:
        forward: Of the upper arm.
        outward: Of the upper arm, against its rest.
        elbow: Flexion.
    """

    forward: float = 0.0
    outward: float = 0.0
    elbow: float = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class FootPose:
    """Where a foot is.

    Attributes:
        ankle: (3,) [m].
        pitch: Toes up against the ground [rad].
        toes: Toes up against the ground, of the toes alone [rad].
        yaw: Toes to the left [rad].
        knee: Roughly where the knee points to, (3,).
    """

    ankle: Floats
    pitch: float = 0.0
    toes: float = 0.0
    yaw: float = 0.0
    knee: Floats | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """A pose of the whole skeleton.

    Attributes:
        hips: Middle of the hip joints, (3,) [m].
        pelvis: Its rotation, (3, 3).
        chest: Its rotation in the world, (3, 3).
        head: Its rotation in the world, (3, 3).
        feet: By side.
        arms: By side.
    """

    hips: Floats
    pelvis: Floats
    chest: Floats
    head: Floats
    feet: Mapping[str, FootPose]
    arms: Mapping[str, Hold | Swing]


def matrices(body: BodyMeasures, posture: Posture) -> Floats:
    """Return the matrices that carry points at rest into a posture, (bones, 3, 4)."""
    rest = joints(body)
    chest = posture.hips + posture.pelvis @ (rest["chest"] - rest["pelvis"])
    head = chest + posture.chest @ (rest["head"] - rest["chest"])
    placed = {
        "pelvis": _carry(rest["pelvis"], posture.hips, posture.pelvis),
        "chest": _carry(rest["chest"], chest, posture.chest),
        "head": _carry(rest["head"], head, posture.head),
    }
    for side in SIDES:
        placed |= _leg(rest, posture, side)
        placed |= _arm(rest, posture, side, placed["chest"])
    return np.stack([placed[bone] for bone in BONES])


def _carry(rest: Floats, posed: Floats, rotation: Floats) -> Floats:
    """Return the matrix, (3, 4), that turns about a joint and moves the joint."""
    return np.column_stack([rotation, posed - rotation @ rest])


def _leg(rest: Mapping[str, Floats], posture: Posture, side: str) -> dict[str, Floats]:
    """Return the matrices of thigh, shank, foot and toes towards a foothold."""
    step = posture.feet[side]
    hip0, knee0, ankle0, ball0 = (rest[f"{n}_{side}"] for n in ("thigh", "shank", "foot", "toes"))
    hip = posture.hips + posture.pelvis @ (hip0 - rest["pelvis"])
    lengths = (float(np.linalg.norm(knee0 - hip0)), float(np.linalg.norm(ankle0 - knee0)))
    pole = step.knee
    if pole is None:
        pole = about_z(0.5 * step.yaw) @ posture.pelvis @ FORWARD
    knee, ankle = bent(hip, step.ankle, lengths, pole)
    way = (ankle - hip) / np.linalg.norm(ankle - hip)
    axis = np.cross(pole - (pole @ way) * way, way)
    foot = about_z(step.yaw) @ about_y(-step.pitch)
    ball = ankle + foot @ (ball0 - ankle0)
    toes = about_z(step.yaw) @ about_y(-step.toes)
    return {
        f"thigh_{side}": _carry(hip0, hip, rotation((knee0 - hip0, LEFT), (knee - hip, axis))),
        f"shank_{side}": _carry(
            knee0, knee, rotation((ankle0 - knee0, LEFT), (ankle - knee, axis))
        ),
        f"foot_{side}": _carry(ankle0, ankle, foot),
        f"toes_{side}": _carry(ball0, ball, toes),
    }


def _arm(
    rest: Mapping[str, Floats], posture: Posture, side: str, chest: Floats
) -> dict[str, Floats]:
    """Return the matrices of upper arm, forearm and hand, hanging or holding something."""
    names = ("upper_arm", "forearm", "hand", "finger")
    shoulder0, elbow0, wrist0, finger0 = (rest[f"{name}_{side}"] for name in names)
    arm = posture.arms[side]
    shoulder = chest[:, :3] @ shoulder0 + chest[:, 3]
    upper0, lower0 = elbow0 - shoulder0, wrist0 - elbow0
    if isinstance(arm, Swing):
        turn = chest[:, :3] @ about_y(-arm.forward) @ about_x(SIDES[side] * arm.outward)
        upper, lower = turn @ upper0, turn @ about_y(-arm.elbow) @ lower0
        elbow = shoulder + upper
        wrist, axis = elbow + lower, turn @ LEFT
        palm = rotation((lower0, LEFT), (lower, axis))
    else:
        lengths = (float(np.linalg.norm(upper0)), float(np.linalg.norm(lower0)))
        elbow, wrist = bent(shoulder, arm.wrist, lengths, arm.elbow)
        upper, lower = elbow - shoulder, wrist - elbow
        way = wrist - shoulder
        axis = -np.cross(arm.elbow, way / np.linalg.norm(way))
        palm = rotation((finger0 - wrist0, -SIDES[side] * LEFT), (arm.fingers, arm.palm))
    return {
        f"upper_arm_{side}": _carry(shoulder0, shoulder, rotation((upper0, LEFT), (upper, axis))),
        f"forearm_{side}": _carry(elbow0, elbow, rotation((lower0, LEFT), (lower, axis))),
        f"hand_{side}": _carry(wrist0, wrist, palm),
    }
