"""Laws of cameras that fly."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.job.settings import CinematicCamera, KeyFrame
from sumo3dviz_pt.shot.cameras.free import build_flight

NUMBERS = st.floats(-1000, 1000)


@st.composite
def flights(draw):
    gaps = draw(st.lists(st.floats(0.1, 100), min_size=1, max_size=6))
    keys = [
        KeyFrame(
            time=time,
            position=(draw(NUMBERS), draw(NUMBERS), draw(NUMBERS)),
            heading=draw(st.floats(-720, 720)),
            pitch=draw(st.floats(-90, 90)),
            roll=draw(st.floats(-30, 30)),
            fov=draw(st.floats(10, 120)),
        )
        for time in np.cumsum(gaps)
    ]
    return CinematicCamera(mode="cinematic", keyframes=tuple(keys))


@pytest.mark.slow
@settings(max_examples=tries(50), deadline=None)
@given(flights(), st.floats(0, 1))
def test_views_are_rigid_and_within_their_key_frames(flight, share):
    camera = build_flight(flight)
    keys = flight.keyframes
    for first, last in pairwise(keys):
        view = camera.view_at(first.time + share * (last.time - first.time))
        rotation = view.world_from_camera.matrix[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(rotation) > 0
        # Places are rounded to 1e-7 m, so that a shifted scenario gives the same.
        low = np.minimum(first.position, last.position) - 1e-7
        high = np.maximum(first.position, last.position) + 1e-7
        assert (view.position >= low).all()
        assert (view.position <= high).all()
        fovs = sorted(np.radians([first.fov, last.fov]))
        assert fovs[0] - 1e-12 <= view.lens.opening <= fovs[1] + 1e-12


@settings(max_examples=tries(50), deadline=None)
@given(flights())
def test_turns_are_never_longer_than_half_a_circle(flight):
    camera = build_flight(flight)
    for values in np.diff(camera.angles.values[:, :3], axis=0):
        assert (np.abs(values) <= np.pi + 1e-9).all()


@settings(max_examples=tries(30), deadline=None)
@given(flights(), st.floats(0, 1))
def test_motion_is_continuous(flight, share):
    camera = build_flight(flight)
    first, last = flight.keyframes[0].time, flight.keyframes[-1].time
    time = first + share * (last - first)
    near = camera.view_at(time + 1e-7).position - camera.view_at(time).position
    assert np.linalg.norm(near) < 1e-7 * 3 * 3500 / 0.1 + 1e-9
