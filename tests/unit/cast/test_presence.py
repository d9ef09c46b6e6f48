"""Who exists when: the same alone or in a block of frames."""

from __future__ import annotations

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt.cast.poses import BLOCK, Presence
from sumo3dviz_pt.model.trajectory import Trajectory

FRAMES = 3.0 + np.arange(3 * BLOCK) / 25.0
NAMES = ("positions", "yaws", "pitches", "speeds", "travelled")


def trajectories():
    pieces = [
        (PathPiece(end=4.1, curvature=0.02, start=30.0), PathPiece(begin=5.0, end=9.0, yaw=1.0)),
        (PathPiece(begin=3.5, end=3.5),),
        (PathPiece(begin=-5.0, end=90.0, grade=0.05),),
    ]
    return [Trajectory(str(k), "vehicle", "", some) for k, some in enumerate(pieces)]


def test_blocks_change_nothing():
    users = trajectories()
    block, alone = Presence(users, FRAMES), Presence(users)
    for time in np.random.default_rng(1).permutation(FRAMES):
        a, b = block.at(float(time)), alone.at(float(time))
        np.testing.assert_array_equal(a.users, b.users)
        np.testing.assert_array_equal(a.pieces, b.pieces)
        for name in NAMES:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_everyone_is_there_for_their_life():
    presence = Presence(trajectories(), FRAMES)
    assert presence.at(3.0).users.tolist() == [0, 2]
    assert presence.at(3.5).users.tolist() == [0, 1, 2]
    assert presence.at(4.5).users.tolist() == [2]
    assert presence.at(6.0).users.tolist() == [0, 2]
    assert presence.at(500.0).users.tolist() == []
    found = presence.at(3.32)
    assert found.positions[1] == pytest.approx([83.2, 0.0, 4.16])


def test_nobody_is_nobody():
    found = Presence([]).at(1.0)
    assert found.positions.shape == (0, 3) and found.speeds.shape == (0,)


def test_a_block_samples_each_stretch_once():
    calls = []

    class Counted(PathPiece):
        def sample(self, times):
            calls.append(len(times))
            return super().sample(times)

    presence = Presence([Trajectory("a", "vehicle", "", (Counted(),))], FRAMES)
    for time in FRAMES[:BLOCK]:
        presence.at(float(time))
    assert calls == [BLOCK]
