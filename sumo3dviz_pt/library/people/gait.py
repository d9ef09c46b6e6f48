"""How people stand and walk: postures for the phases of a stride.

The stance leg follows the foot, which rolls from heel to toe on a point of the ground;
the swinging leg follows measured angles of hip and knee.

References:
    D. A. Winter, The Biomechanics and Motor Control of Human Gait: Normal, Elderly and
    Pathological, 2nd ed., 1991, natural cadence (angles of hip and knee, foot pitch);
    J. Perry, Gait Analysis, 1992 (pelvis and trunk); M. P. Murray et al., Walking patterns
    of normal men, J. Bone Joint Surg. 46A, 1964 (arms, stride).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from sumo3dviz_pt.library.people.posture import FootPose, Posture, Swing, about_x, about_y, about_z
from sumo3dviz_pt.library.people.rig import SIDES, BodyMeasures, joints
from sumo3dviz_pt.library.people.stack import interpolated
from sumo3dviz_pt.model.geometry import Floats

PHASES = 8
"""Phases of a stride; the first is the right heel's strike."""

TOE_OFF = 0.61
"""Share of a stride after which a foot leaves the ground."""

_HIP = ((0.61, -4), (0.65, 2), (0.7, 9), (0.75, 16), (0.8, 20), (0.85, 23), (0.92, 23), (1.0, 21))
_KNEE = ((0.61, 40), (0.66, 56), (0.71, 64), (0.76, 61), (0.82, 46), (0.89, 21), (0.95, 7), (1, 5))
"""Angles [deg] of the thigh, forward, and of the knee, flexed, by share of a stride."""

_FOOT = (
    *((0.0, 21.0), (0.05, 7.0), (0.09, 0.0), (0.34, 0.0), (0.40, -6.0), (0.50, -24.0)),
    *((0.56, -42.0), (0.61, -60.0), (0.67, -64.0), (0.75, -44.0), (0.83, -10.0), (0.90, 12.0)),
    *((0.96, 22.0), (1.0, 21.0)),
)
"""Angles of the sole against the ground [deg] by share of a stride; toes up is positive."""

_TOE_BEND = np.radians(32.0)
"""How far the foot lifts before the toes follow [rad]."""

_STRIKE = 0.158
"""Where the heel strikes, before the hips, as a share of stature."""


def stride_length(body: BodyMeasures) -> float:
    """Return the distance of two steps at an easy pace [m]."""
    return float(0.79 * body.height * (1.0 - 0.03 * body.woman))


def standing(body: BodyMeasures) -> Posture:
    """Stand at ease: the weight a little on one leg, feet turned out."""
    rest = joints(body)
    h = body.height
    hips = np.array([0.0, 0.008 * h, rest["pelvis"][2] - 0.006 * h])
    feet = {
        "l": _flat(rest["foot_l"] + [-0.006 * h, 0.004 * h, 0.0], yaw=0.14),
        "r": _flat(rest["foot_r"] + [0.024 * h, -0.014 * h, 0.0], yaw=-0.26),
    }
    arms = {"l": Swing(-0.03, -0.05, 0.22), "r": Swing(0.02, -0.035, 0.30)}
    pelvis = about_x(0.03)
    return Posture(hips, pelvis, about_x(-0.012) @ about_y(0.01), about_z(0.12), feet, arms)


def _flat(ankle: Floats, *, yaw: float) -> FootPose:
    """Put a foot flat on the ground."""
    return FootPose(ankle, yaw=yaw)


def walking(body: BodyMeasures, phase: float) -> Posture:
    """Take the posture of one moment of a walk at an easy pace.

    Args:
        body: Measures of the person.
        phase: Share of a stride, [0, 1); 0 is the right heel's strike, 0.5 the left's.
    """
    h, turn = body.height, 2.0 * np.pi * phase
    sway = (0.009 + 0.004 * body.woman) * h
    hips = np.array([0.0, -sway * np.sin(turn - 0.35), _hip_height(body, phase)])
    pelvis = about_z(np.radians(5.0) * np.cos(turn)) @ about_x(
        np.radians(3.0 + 2.0 * body.woman) * np.sin(turn - 0.2) * -1.0
    )
    chest = about_z(-np.radians(6.0) * np.cos(turn)) @ about_y(np.radians(2.5))
    feet = {"r": _foot(body, phase, "r"), "l": _foot(body, (phase + 0.5) % 1.0, "l")}
    arms = {"r": _arm(phase), "l": _arm((phase + 0.5) % 1.0)}
    head = about_z(-np.radians(1.5) * np.cos(turn)) @ about_y(np.radians(1.5))
    return Posture(hips, pelvis, chest, head, feet, arms)


def _hip_height(body: BodyMeasures, phase: float) -> float:
    """Return the height of the hips, lowest just after each heel strike [m]."""
    top = float(joints(body)["pelvis"][2])
    swing = np.cos(4.0 * np.pi * (phase - 0.30))
    return float(top - 0.0168 * body.height + 0.0088 * body.height * swing)


def _arm(phase: float) -> Swing:
    """Swing an arm backward while the leg of its side is forward."""
    wave = -np.cos(2.0 * np.pi * (phase - 0.02))
    return Swing(np.radians(-4.0 + 19.0 * wave), np.radians(-2.5), np.radians(21.0 + 11.0 * wave))


def _foot(body: BodyMeasures, phase: float, side: str) -> FootPose:
    """Place a foot at its own share of a stride."""
    yaw = SIDES[side] * np.radians(6.0)
    if phase <= TOE_OFF:
        return _stance(body, phase, side, yaw)
    return _swing(body, phase, side, yaw)


def _pitches(phase: float) -> tuple[float, float]:
    """Return the angles of the sole and of the toes against the ground [rad]."""
    turned = interpolated(phase, _FOOT) if phase < TOE_OFF else _foot_curve()(phase)
    pitch = float(np.radians(turned))
    return pitch, pitch if pitch > 0.0 else min(0.0, pitch + _TOE_BEND)


@cache
def _foot_curve() -> CubicSpline:
    """Interpolate the angle of the sole over a stride [deg]; the curve repeats with the stride."""
    angles = np.array(_FOOT)
    return CubicSpline(angles[:, 0], angles[:, 1], bc_type="periodic")


def _stance(body: BodyMeasures, phase: float, side: str, yaw: float) -> FootPose:
    """Place a foot on the ground, where it rolls over heel, sole, ball and toes."""
    rest = joints(body)
    ankle, heel, ball, tip = (rest[f"{n}_{side}"] for n in ("foot", "heel", "toes", "tip"))
    pitch, toes = _pitches(phase)
    turn, roll = about_z(yaw), about_y(-pitch)
    walked = stride_length(body) * phase
    strike = np.array([_STRIKE * body.height - walked, 0.0, 0.0])
    if pitch >= 0.0:
        place = strike + turn @ roll @ (ankle - heel)
    else:
        flat = turn @ (tip - heel)
        curl = turn @ about_y(-toes) @ (ball - tip)
        place = strike + flat + curl + turn @ roll @ (ankle - ball)
    place[1] += _track(body, side)
    return FootPose(place, pitch, toes, yaw)


def _track(body: BodyMeasures, side: str) -> float:
    """Return y of the line on which a foot comes down [m]."""
    return float(SIDES[side] * (0.034 - 0.010 * body.woman) * body.height)


def _swing(body: BodyMeasures, phase: float, side: str, yaw: float) -> FootPose:
    """Place a foot in the air by measured angles, shifted to meet the stance at both ends."""
    share = (phase - TOE_OFF) / (1.0 - TOE_OFF)
    found = _swung(body, phase, side)
    begin = _stance(body, TOE_OFF, side, yaw).ankle - _swung(body, TOE_OFF, side)
    end = _stance(body, 0.0, side, yaw).ankle - _swung(body, 1.0, side)
    pitch, toes = _pitches(phase)
    return FootPose(found + begin + share * (end - begin), pitch, toes, yaw)


def _swung(body: BodyMeasures, phase: float, side: str) -> Floats:
    """Return the ankle of a leg with the measured angles of hip and knee, (3,) [m]."""
    rest = joints(body)
    thigh = rest[f"thigh_{side}"][2] - rest[f"shank_{side}"][2]
    shank = rest[f"shank_{side}"][2] - rest[f"foot_{side}"][2]
    hip, knee = np.radians(interpolated(phase, _HIP)), np.radians(interpolated(phase, _KNEE))
    x = thigh * np.sin(hip) + shank * np.sin(hip - knee)
    z = _hip_height(body, phase) - thigh * np.cos(hip) - shank * np.cos(hip - knee)
    return np.array([float(x), _track(body, side), float(z)])
