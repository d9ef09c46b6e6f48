"""Wheels roll: the point that touches the road stands still."""

from __future__ import annotations

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt.cast.axles import Hub, Rolling, rigid_frames
from sumo3dviz_pt.cast.drawing import wheel_matrix
from sumo3dviz_pt.library.vehicles.recipe import WheelPlace

PLACES = tuple(
    WheelPlace((x, y, 0.33), 0.33, steered=x > -2.0) for x in (-0.9, -3.7) for y in (0.75, -0.75)
)
SCALE = np.array([1.1, 1.0, 0.95])
HUBS = [Hub.of(0, place, SCALE) for place in PLACES]
RADIUS = 0.33 * 0.95


def frames_of(piece):
    def frames(times):
        motion = piece.sample(times)
        return rigid_frames(motion.positions, motion.yaws, motion.pitches)[:, None]

    return frames


def rolling_of(piece):
    return Rolling.of(piece.begin, piece.end, HUBS, frames_of(piece))


def test_straight_on_the_angle_is_the_way_by_the_radius():
    piece = PathPiece(speed=7.0, gain=0.5, yaw=2.0)
    rolling = rolling_of(piece)
    for time in (0.0, 0.33, 5.0, 19.99):
        state = rolling.at(time)
        turned = np.mod(piece.way(np.array(time)) / RADIUS, 2 * np.pi)
        off = np.mod(state[:, 0] - turned + np.pi, 2 * np.pi) - np.pi
        np.testing.assert_allclose(off, 0.0, atol=0.01)
        np.testing.assert_allclose(state[:, 1], 0.0, atol=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_no_wheel_slips_on_a_circle(side):
    """Hub's speed along the wheel equals radius x turning speed; steered ones do not slide."""
    piece = PathPiece(speed=5.0, curvature=side / 8.0, start=200.0)
    rolling, frames = rolling_of(piece), frames_of(piece)
    time, step = 7.7, 0.02
    before, after = rolling.at(time - step), rolling.at(time + step)
    spin = np.mod(after[:, 0] - before[:, 0], 2 * np.pi) / (2 * step)
    (now,) = frames(np.array([time]))[:, 0]
    hubs = np.stack([frames(np.array([time + d]))[0, 0] @ [*h.at, 1] for d in (-step, step)
                     for h in HUBS]).reshape(2, 4, 4)  # fmt: skip
    moved = (hubs[1] - hubs[0])[:, :3] / (2 * step)
    for k, hub in enumerate(HUBS):
        steer = rolling.at(time)[k, 1]
        ahead = now[:3, :3] @ [np.cos(steer), np.sin(steer), 0.0]
        assert spin[k] * hub.radius == pytest.approx(moved[k] @ ahead, rel=0.01)
        if hub.steered:
            across = now[:3, :3] @ [-np.sin(steer), np.cos(steer), 0.0]
            # Both front wheels have one angle; Ackermann's difference is left out.
            assert abs(moved[k] @ across) < 0.06 * 5.0
            assert side * steer > np.radians(10)
    outer, inner = (0, 1) if side < 0 else (1, 0)
    assert spin[outer] > 1.05 * spin[inner]


def test_steering_is_there_at_a_standstill_and_back():
    class Waiting(PathPiece):
        def way(self, times):
            return 4.0 * np.minimum(np.asarray(times), 6.0)

    piece = Waiting(curvature=1 / 10.0, start=50.0)
    rolling = rolling_of(piece)
    angles = [rolling.at(t)[0, 1] for t in (6.5, 12.0, 20.0)]
    assert np.ptp(angles) < 1e-9 and angles[0] > np.radians(6)
    assert rolling.at(9.0)[0, 0] == rolling.at(15.0)[0, 0]


def test_who_never_moves_does_not_steer():
    rolling = rolling_of(PathPiece(speed=0.0, curvature=0.2, start=30.0))
    np.testing.assert_array_equal(rolling.at(3.0), 0.0)


def test_backwards_wheels_turn_back_and_keep_their_steering():
    piece = PathPiece(speed=-2.0, curvature=1 / 9.0, start=120.0)
    rolling = rolling_of(piece)
    first, later = rolling.at(5.0), rolling.at(5.1)
    spin = np.mod(later[:, 0] - first[:, 0] + np.pi, 2 * np.pi) - np.pi
    assert (spin < 0.0).all()
    assert np.radians(8) < first[0, 1] < np.radians(40)


def test_a_sharp_turn_stops_at_the_wheel_arch():
    rolling = rolling_of(PathPiece(speed=2.0, curvature=1 / 4.2, start=60.0, length=8.0))
    assert rolling.at(6.0)[0, 1] == pytest.approx(np.radians(40))


@pytest.mark.parametrize("place", PLACES)
def test_the_touching_point_goes_backwards_on_both_sides(place):
    """Turned a little, the lowest point of the wheel lies behind, whichever face looks out."""
    frame = np.eye(4)
    rest = wheel_matrix(frame, np.ones(3), place)
    turned = wheel_matrix(frame, np.ones(3), place, turned=0.1)
    low = np.linalg.inv(rest) @ [place.at[0], place.at[1], 0.0, 1.0]
    assert (turned @ low)[0] == pytest.approx(place.at[0] - 0.33 * np.sin(0.1))
    steered = wheel_matrix(frame, np.ones(3), place, steered=0.3)
    axis = steered[:3, :3] @ (np.linalg.inv(rest[:3, :3]) @ [0.0, 1.0, 0.0])
    assert axis[0] == pytest.approx(-np.sin(0.3)), "to the left"
