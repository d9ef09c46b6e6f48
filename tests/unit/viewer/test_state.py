"""How orders lead from one stand to the next, as far as no scene is needed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.viewer.keyframes import ViewerEye
from sumo3dviz_pt.viewer.messages import KeyFrameOrder, StandAt
from sumo3dviz_pt.viewer.state import MOST_FRAMES, ViewerState, obeyed, said_of

HERE = ViewerState(ViewerEye(np.array([1.0, 2.0, 3.0]), 90.0), 455.1234567)


AT_ZERO, FAR = (SimpleNamespace(location=Location(origin=at)) for at in ((0, 0), (5e6, -1e7)))
"""As much of a scene as key frames and stands need: from where its places are counted."""


def ordered(state, *, scene=AT_ZERO, **words):
    return obeyed(KeyFrameOrder(do="keyframe", **words), state, scene)


def test_pages_say_and_hear_the_coordinates_of_sumo():
    (frame,) = ordered(HERE, scene=FAR, act="add").frames
    assert frame.position == (5_000_001.0, -9_999_998.0, 3.0)
    order = StandAt(do="eye", position=frame.position, heading=90.0, pitch=0.0, roll=0.0, fov=50.0)
    eye = obeyed(order, HERE, FAR).eye
    assert eye.position.tolist() == HERE.eye.position.tolist()
    assert said_of(eye.said(FAR.location))["position"] == list(frame.position)


@pytest.mark.parametrize("time", [455.0, 455.1234567, 1 / 3])
def test_key_frames_dropped_at_one_moment_follow_each_other(time):
    state = ordered(replace(HERE, time=time), act="add")
    there = replace(state, eye=ViewerEye(np.array([61.0, 2.0, 3.0]), 90.0))
    further = replace(ordered(there, act="add"), eye=HERE.eye)
    first, second, third = ordered(further, act="add").frames
    assert first.time == pytest.approx(time, abs=0.001)
    assert second.time == pytest.approx(first.time + 6.0, abs=0.001)
    assert third.time == pytest.approx(second.time + 6.0, abs=0.001)


def test_key_frames_of_another_time_go_where_they_belong():
    state = ordered(HERE, act="add")
    state = ordered(replace(state, time=450.0), act="add")
    assert [frame.time for frame in state.frames] == [450.0, 455.123]


def test_a_path_has_a_bound():
    """Thousands of key frames once took quadratic time and gigabytes."""
    state = HERE
    for _ in range(MOST_FRAMES):
        state = ordered(state, act="add")
    with pytest.raises(ConfigError, match=f"at most {MOST_FRAMES} key frames; save or clear it"):
        ordered(state, act="add")
    assert len(ordered(ordered(state, act="clear"), act="add").frames) == 1


def test_there_is_nothing_to_take_away_or_to_fly_through():
    with pytest.raises(ConfigError, match="no such key frame"):
        ordered(HERE, act="remove", index=0)
    with pytest.raises(ConfigError, match="at least two"):
        ordered(ordered(HERE, act="add"), act="play")
