"""Road users stand on the road that is drawn; from above they stay where the log says."""

from __future__ import annotations

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt.cast.poses import GroundedPiece, grounded
from sumo3dviz_pt.model.trajectory import Trajectory

TIMES = np.linspace(0.0, 4.0, 101)


def on(rise, *, length=4.5, **path) -> tuple[PathPiece, GroundedPiece]:
    piece = PathPiece(end=4.0, **path)
    return piece, GroundedPiece(piece, rise, length)


def nothing(points):
    return np.zeros(len(points))


def hump(points):
    """A surface 0.3 m too high in a junction 20 m wide, without steps."""
    return 0.3 * np.cos(np.clip(points[:, 0] - 20.0, -10.0, 10.0) * np.pi / 20.0) ** 2


def step(points):
    return np.where(points[:, 0] > 20.0, 0.06, 0.0)


def test_nothing_changes_where_the_log_lies_on_the_surface():
    piece, moved = on(nothing, curvature=0.02, grade=0.05)
    before, after = piece.sample(TIMES), moved.sample(TIMES)
    for name in ("positions", "yaws", "pitches", "speeds", "travelled"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), abs=1e-12)
    assert (moved.begin, moved.end) == (piece.begin, piece.end)


def test_fronts_follow_the_surface_and_stay_in_place_from_above():
    piece, moved = on(hump)
    before, after = piece.sample(TIMES), moved.sample(TIMES)
    assert (after.positions[:, :2] == before.positions[:, :2]).all()
    assert (after.speeds == before.speeds).all()
    expected = before.positions[:, 2] + hump(before.positions)
    assert np.abs(after.positions[:, 2] - expected).max() < 0.01
    assert np.ptp(after.positions[:, 2]) > 0.25


def test_rears_follow_the_surface_too():
    _, moved = on(hump)
    motion = moved.sample(TIMES)
    rear = motion.positions - 4.5 * np.column_stack(
        [np.cos(motion.pitches) * np.cos(motion.yaws), 0.0 * TIMES, np.sin(motion.pitches)]
    )
    assert np.abs(rear[:, 2] - hump(rear)).max() < 0.02
    steep = PathPiece(end=4.0, grade=0.4)
    upright = GroundedPiece(steep, hump, 0.0).sample(TIMES)
    assert steep.sample(TIMES).pitches.min() > 0.3 and not upright.pitches.any()


def test_small_steps_are_climbed_gradually_and_nobody_leaves_the_surface():
    _, moved = on(step)
    heights = moved.sample(TIMES).positions
    assert np.abs(heights[:, 2] - step(heights)).max() < 0.05
    assert np.abs(np.diff(heights[:, 2])).max() < 0.04
    ahead = np.abs(heights[:, 0] - 20.0) < 0.8
    assert len(np.unique(np.round(heights[ahead, 2], 4))) > 2


def test_trails_lie_on_the_surface():
    piece, moved = on(hump)
    distances = np.array([0.0, 3.0, 8.0])
    before, after = piece.trail(TIMES, distances), moved.trail(TIMES, distances)
    assert (after[..., :2] == before[..., :2]).all()
    flat = before.reshape(-1, 3)
    assert after[..., 2].ravel() == pytest.approx(flat[:, 2] + hump(flat))


def test_a_trajectory_keeps_its_name_and_stretches():
    pieces = (PathPiece(end=2.0), PathPiece(begin=3.0, end=4.0))
    moved = grounded(Trajectory("a", "vehicle", "car", pieces), hump, length=4.5)
    assert moved.key == "vehicle:a" and moved.type_id == "car"
    assert [(p.begin, p.end) for p in moved.pieces] == [(0.0, 2.0), (3.0, 4.0)]
