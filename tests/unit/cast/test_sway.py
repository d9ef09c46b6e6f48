"""Bodies on springs, riders in bends."""

from __future__ import annotations

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt.cast.poses import SPRINGS, BodySway, lean_at, sway_at

CAR, HEAVY = SPRINGS["car"], SPRINGS["heavy"]


def test_at_one_speed_straight_on_nothing_moves():
    sway = sway_at(PathPiece(), 8.0, springs=CAR)
    assert abs(sway.pitch) < 1e-9 and abs(sway.roll) < 1e-9


def test_braking_dives_and_lorries_less():
    piece = PathPiece(speed=40.0, gain=-2.0, end=18.0)
    car, lorry = (sway_at(piece, 10.0, springs=springs).pitch for springs in (CAR, HEAVY))
    assert np.degrees(car) == pytest.approx(-0.4, abs=0.02), "0.2 degrees per m/s^2"
    assert car < lorry < 0.0
    assert sway_at(PathPiece(speed=0.0, gain=3.0), 10.0, springs=CAR).pitch > 0.0


def test_a_left_bend_rolls_to_the_right_and_not_far():
    piece = PathPiece(speed=8.0, curvature=1 / 40.0, start=100.0)
    assert np.degrees(sway_at(piece, 9.0, springs=CAR).roll) == pytest.approx(0.77, abs=0.05)
    wild = PathPiece(speed=15.0, curvature=1 / 8.0, start=100.0)
    assert np.degrees(sway_at(wild, 9.0, springs=CAR).roll) < 2.5


def test_sway_is_smooth_when_brakes_are_let_go():
    class Stopping(PathPiece):
        def sample(self, times):
            speeds = np.maximum(8.0 - 4.0 * np.asarray(times), 0.0)
            motion = super().sample(times)
            return type(motion)(*(getattr(motion, name) for name in
                ("alive", "positions", "yaws", "pitches")), speeds, motion.travelled)  # fmt: skip

    times = np.arange(0.0, 5.0, 0.02)
    pitches = np.degrees([sway_at(Stopping(), t, springs=CAR).pitch for t in times])
    assert pitches.min() < -0.5
    assert np.abs(np.diff(pitches)).max() < 0.15
    assert pitches[times > 2.2].max() > 0.02, "the nose comes up after the stop"
    assert abs(pitches[-1]) < 0.02


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_riders_lean_as_gravity_asks(side):
    piece = PathPiece(speed=6.0, curvature=side / 15.0, start=100.0)
    lean = lean_at(piece, 8.0).roll
    assert lean == pytest.approx(-side * np.arctan(36.0 / 15.0 / 9.81), abs=0.01)
    fast = PathPiece(speed=20.0, curvature=side / 15.0, start=100.0)
    assert abs(lean_at(fast, 8.0).roll) == pytest.approx(np.radians(30.0))


def test_what_leans_turns_about_the_road():
    matrix = BodySway(roll=0.3).about(0.0, 0.0)
    np.testing.assert_allclose(matrix @ [-1.0, 0.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 1.0], atol=1e-12)
    top = matrix @ [0.0, 0.0, 1.0, 1.0]
    assert top[1] < 0.0, "right side down: the head goes right"
    dived = BodySway(pitch=-0.02).about(-2.0, 0.3) @ [0.0, 0.0, 0.5, 1.0]
    assert dived[2] < 0.5
