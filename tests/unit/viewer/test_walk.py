"""How an eye moves by keys and turns by dragging."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.job.settings import EulerianCamera, VehicleSettings
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.shot.cameras.aiming import build_camera
from sumo3dviz_pt.viewer.keyframes import AXES, FASTER, STEEPEST, ViewerEye, moved, turned, wrapped

EAST = ViewerEye(np.array([10.0, 20.0, 5.0]), heading=90.0, pitch=-10.0, roll=3.0, fov=60.0)
WIDTH = 960.0

METRES = st.floats(-1e4, 1e4)
CODES = FASTER | {code for _, more, less in AXES for code in (*more, *less)}
KEYS = st.frozensets(st.sampled_from(sorted(CODES)))
EYES = st.builds(
    lambda x, y, z, *angles: ViewerEye(np.array([x, y, z]), *angles),
    METRES,
    METRES,
    METRES,
    st.floats(-1000, 1000),
    st.floats(-STEEPEST, STEEPEST),
    st.floats(-180, 180),
    st.floats(2, 170),
)


def values_of(eye):
    return np.array([*eye.position, eye.heading, eye.pitch, eye.roll, eye.fov])


def assert_same(one, other, **tolerance):
    difference = values_of(one) - values_of(other)
    for k in (3, 5):
        difference[k] = (difference[k] + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(difference, 0.0, **{"atol": 1e-6, **tolerance})


def seen_at(eye, direction, width=WIDTH):
    """Where a world direction is seen, right and down of the picture's middle [px]."""
    ahead, left, up = direction @ eye.view().world_from_camera.matrix[:3, :3]
    focal = width / 2 / np.tan(np.radians(eye.fov) / 2)
    assert ahead > 0
    return np.array([-left, -up]) * focal / ahead


@pytest.mark.parametrize(
    ("keys", "way"),
    [
        ("KeyW", (10, 0, 0)),
        ("ArrowUp", (10, 0, 0)),
        ("KeyS", (-10, 0, 0)),
        ("ArrowDown", (-10, 0, 0)),
        ("KeyA", (0, 10, 0)),
        ("ArrowLeft", (0, 10, 0)),
        ("KeyD", (0, -10, 0)),
        ("ArrowRight", (0, -10, 0)),
        ("KeyR", (0, 0, 10)),
        ("KeyF", (0, 0, -10)),
        ("KeyW ShiftLeft", (50, 0, 0)),
        ("KeyF ShiftRight", (0, 0, -50)),
        ("KeyW ArrowUp", (10, 0, 0)),
        ("KeyW KeyD", (50**0.5, -(50**0.5), 0)),
    ],
)
@pytest.mark.parametrize("seconds", [0.04, 1.0])
def test_keys_move_by_a_known_way(keys, way, seconds):
    eye = moved(EAST, frozenset(keys.split()), seconds)
    np.testing.assert_allclose(eye.position - EAST.position, seconds * np.array(way), atol=1e-12)
    np.testing.assert_array_equal(values_of(eye)[3:], values_of(EAST)[3:])


@pytest.mark.parametrize(
    ("keys", "heading", "pitch"),
    [
        ("KeyJ", -60, 0),
        ("KeyL", 60, 0),
        ("KeyI", 0, 60),
        ("KeyK", 0, -60),
        ("KeyL ShiftLeft", 60, 0),
        ("KeyJ KeyI", -60, 60),
    ],
)
def test_keys_turn_by_a_known_angle(keys, heading, pitch):
    eye = moved(EAST, frozenset(keys.split()), 0.5)
    np.testing.assert_array_equal(eye.position, EAST.position)
    assert eye.heading == pytest.approx(90 + 0.5 * heading)
    assert eye.pitch == pytest.approx(-10 + 0.5 * pitch)
    assert (eye.roll, eye.fov) == (EAST.roll, EAST.fov)


@pytest.mark.parametrize("keys", ["", "KeyW KeyS", "ShiftLeft", "Space KeyX", "KeyA ArrowRight"])
def test_nothing_moves_without_a_key_that_says_where(keys):
    assert moved(EAST, frozenset(keys.split()), 1.0) is EAST
    assert moved(EAST, frozenset({"KeyW"}), 0.0) is EAST
    assert moved(EAST, frozenset({"KeyW"}), -1.0) is EAST


def test_the_way_ahead_is_level_and_by_the_heading():
    steep = ViewerEye(np.zeros(3), heading=30.0, pitch=-80.0)
    way = moved(steep, frozenset({"KeyW"}), 1.0).position
    np.testing.assert_allclose(way, [10 * np.sin(np.pi / 6), 10 * np.cos(np.pi / 6), 0], atol=1e-9)


def test_turning_while_moving_leads_round_a_circle():
    eye = moved(EAST, frozenset({"KeyW", "KeyL"}), 6.0)
    assert_same(eye, EAST)
    half = moved(EAST, frozenset({"KeyW", "KeyL"}), 3.0)
    np.testing.assert_allclose(half.position - EAST.position, [0, -60 / np.pi, 0], atol=1e-9)


@settings(deadline=None)
@given(EYES, KEYS, st.floats(0, 5), st.floats(0, 5), st.floats(-100, 100))
def test_time_steps_add_up(eye, keys, first, second, ground):
    at_once = moved(eye, keys, first + second, ground=ground)
    in_steps = moved(moved(eye, keys, first, ground=ground), keys, second, ground=ground)
    assert_same(at_once, in_steps)


@settings(deadline=None)
@given(EYES, KEYS, st.floats(0, 5), st.floats(-100, 100))
def test_eyes_stay_above_the_ground_and_level_enough(eye, keys, seconds, ground):
    after = moved(eye, keys, seconds, ground=ground)
    assert np.isfinite(values_of(after)).all()
    assert after is eye or after.position[2] >= ground + 0.1
    assert abs(after.pitch) <= STEEPEST
    assert 0.0 <= after.heading < 360.0
    reach = 50.0 * seconds + max(ground + 0.1 - eye.position[2], 0.0)
    assert np.linalg.norm(after.position - eye.position) <= reach + 1e-6


@settings(deadline=None)
@given(EYES)
def test_an_eye_is_what_its_view_says(eye):
    view = eye.view()
    again = ViewerEye.of(view)
    assert_same(again, eye)
    np.testing.assert_allclose(
        again.view().world_from_camera.matrix, view.world_from_camera.matrix, atol=1e-12
    )
    assert again.view().lens.opening == pytest.approx(view.lens.opening, abs=1e-12)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2, 1.0, -2.0, 3.1])
@pytest.mark.parametrize("roll", [0.0, 0.4, -3.0])
def test_any_rotation_can_be_said_by_angles(pitch, roll):
    placed = Transform.from_pose([1.0, 2.0, 3.0], yaw=0.7, pitch=pitch, roll=roll)
    if abs(pitch) == np.pi / 2 and roll:
        placed = Transform.from_pose([1.0, 2.0, 3.0], yaw=0.7 + roll, pitch=pitch)
    found = ViewerEye.of(View(placed, Lens(1.0)))
    np.testing.assert_allclose(found.view().world_from_camera.matrix, placed.matrix, atol=1e-9)
    assert abs(found.pitch) <= 90.0


def test_angles_are_those_of_a_scene_file():
    nobody = build_fleet((), {}, VehicleSettings(), seed=0)
    settings = EulerianCamera(
        mode="eulerian", position=(1, 2, 3), heading=200, pitch=-20, roll=5, lens={"fov": 70}
    )
    view = build_camera(settings, fleet=nobody).view_at(0.0)
    assert_same(
        ViewerEye.of(view),
        ViewerEye(np.array([1.0, 2.0, 3.0]), 200.0, -20.0, 5.0, 70.0),
        atol=1e-12,
    )


@settings(deadline=None)
@given(
    EYES,
    st.floats(-0.1, 0.1),
    st.floats(-0.1, 0.1),
)
def test_what_was_in_the_middle_follows_the_pointer(eye, dx, dy):
    assume(abs(eye.pitch) < 60)
    # Within the picture, however wide its angle.
    dx, dy = dx * WIDTH, dy * WIDTH
    reach = np.degrees(np.arctan(np.hypot(dx, dy) * 2 * np.tan(np.radians(eye.fov) / 2) / WIDTH))
    assume(abs(eye.pitch) + 2 * reach < 85)
    after = turned(eye, dx, dy, WIDTH)
    np.testing.assert_allclose(seen_at(after, eye.view().forward), [dx, dy], atol=1e-4)
    np.testing.assert_array_equal(after.position, eye.position)
    assert (after.roll, after.fov) == (eye.roll, eye.fov)


@pytest.mark.parametrize("at", [(-300, 0), (200, 100), (0, -150), (-250, 150)])
def test_what_is_under_the_pointer_follows_it_nearly(at):
    eye = ViewerEye(np.zeros(3), 40.0, -12.0, 0.0, 60.0)
    focal = WIDTH / 2 / np.tan(np.radians(30))
    local = np.array([1.0, -at[0] / focal, -at[1] / focal])
    direction = eye.view().world_from_camera.directions(local[None])[0]
    for dx, dy in ((5, 0), (0, 5), (-4, 3)):
        found = seen_at(turned(eye, dx, dy, WIDTH), direction) - at
        assert np.linalg.norm(found - [dx, dy]) < 0.35 * np.hypot(dx, dy)


@settings(deadline=None)
@given(EYES, st.floats(-2000, 2000), st.floats(-2000, 2000), st.sampled_from([-90, -89, 89, 90]))
def test_drags_near_the_poles_stay_sound(eye, dx, dy, pitch):
    steep = ViewerEye(eye.position, eye.heading, pitch, eye.roll, eye.fov)
    for before in (eye, steep):
        after = turned(before, dx, dy, WIDTH)
        assert np.isfinite(values_of(after)).all()
        assert abs(after.pitch) <= STEEPEST or after is before
        assert 0.0 <= after.heading < 360.0


def test_a_small_drag_looking_down_turns_a_little():
    down = ViewerEye(np.zeros(3), heading=90.0, pitch=-90.0, fov=60.0)
    after = turned(down, 8.0, 0.0, WIDTH)
    assert 0.0 < 90.0 - after.heading < 3.0
    assert after.pitch == -STEEPEST


@pytest.mark.parametrize(("dx", "dy", "width"), [(0.0, 0.0, WIDTH), (3.0, 4.0, 0.0)])
def test_no_drag_changes_nothing(dx, dy, width):
    assert turned(EAST, dx, dy, width) is EAST


@settings(deadline=None)
@given(st.floats(-1e6, 1e6))
def test_headings_wrap(heading):
    found = wrapped(heading)
    assert 0.0 <= found < 360.0
    assert np.sin(np.radians(found)) == pytest.approx(np.sin(np.radians(heading)), abs=1e-6)
