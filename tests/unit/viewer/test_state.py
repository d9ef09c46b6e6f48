"""How orders lead from one stand to the next, as far as no scene is needed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.reading import Ground
from sumo3dviz_pt.viewer.keyframes import ViewerEye
from sumo3dviz_pt.viewer.messages import KeyFrameOrder, Play, Speed, StandAt
from sumo3dviz_pt.viewer.running import span_said
from sumo3dviz_pt.viewer.state import MOST_FRAMES, ViewerState, advanced, obeyed, said_of

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


def window_of(begin, end, **choices):
    """As much of a scene as the passing of time needs."""
    ground = Ground(None, None, (), begin, end, origin=0.0, **choices)
    frames = ground.frames(25.0)

    def frame_before(time):
        return float(frames[max(int(np.searchsorted(frames, time, side="right")) - 1, 0)])

    return SimpleNamespace(ground=ground, frame_before=frame_before, job=None)


@pytest.mark.parametrize("growing", [False, True])
def test_time_waits_at_the_end_only_of_what_still_grows(growing):
    window = window_of(400.0, 456.0, growing=growing)
    state = replace(HERE, time=455.9, playing=True)
    state = advanced(state, 0.25, window)
    assert state.playing is growing and state.time == pytest.approx(456.0)
    later = window_of(404.0, 460.0, growing=growing)
    after = advanced(state, 0.2, later)
    assert after.time == pytest.approx(456.2 if growing else 456.0, abs=0.04)


def test_time_runs_at_the_speed_that_was_asked_for():
    window = window_of(400.0, 500.0)
    state = obeyed(Speed(do="speed", factor=4.0), replace(HERE, time=450.0), window)
    state = obeyed(Play(do="play", on=True), state, window)
    for _ in range(10):
        state = advanced(state, 0.1, window)
    assert state.time == pytest.approx(454.0, abs=0.05)


def test_after_a_pause_keys_move_less_than_time():
    """A slow machine shows traffic as fast as it is, but nobody walks past what comes late."""
    window = window_of(400.0, 500.0)
    window.ground_at = lambda place: 0.0
    walking = replace(HERE, time=450.0, playing=True, keys=frozenset({"KeyW"}))
    slow, quick = (advanced(walking, seconds, window) for seconds in (0.9, 0.25))
    assert slow.time == pytest.approx(450.9, abs=0.04)
    assert quick.eye.position.tolist() != HERE.eye.position.tolist()
    assert slow.eye.position.tolist() == quick.eye.position.tolist()


def test_a_page_that_plays_keeps_up_with_a_loop_of_somebody():
    window = window_of(400.0, 480.0, growing=True, behind=6.0)
    state = advanced(replace(HERE, time=455.0, playing=True), 0.1, window)
    assert state.time == pytest.approx(474.0, abs=0.04)
    assert advanced(replace(state, playing=False), 5.0, window).time == state.time


def test_pages_are_told_who_has_entered_last_and_is_there():
    def user(name, *lives):
        pieces = tuple(SimpleNamespace(begin=begin, end=end) for begin, end in lives)
        return Trajectory(name, "vehicle", "", pieces)

    users = (
        user("old", (1, 60)),
        user("gone", (2, 9)),
        user("new", (8, 30)),
        user("late", (40, 60)),
    )
    ground = Ground(None, None, (*users, user("never")), 0.0, 30.0, growing=True)
    assert span_said(ground) == {
        "begin": 0.0, "end": 30.0, "running": True, "trouble": "", "users": ["new", "old"]
    }  # fmt: skip
