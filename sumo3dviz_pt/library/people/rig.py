"""A figure's skeleton: where its joints are, and how its bones carry its skin.

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
    found = {
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
        found |= {f"{name}_{side}": flip * place for name, place in places.items()}
    return found
