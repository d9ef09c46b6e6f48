"""The camera modes: what holds for all of them, and what each of them does."""

import numpy as np
import pytest

from sumo3dviz_pt.cast.bodies import Body
from sumo3dviz_pt.cast.drawing import Assembly, Unit
from sumo3dviz_pt.cast.figures import car_seat, class_seat
from sumo3dviz_pt.cast.fleet import Fleet, build_fleet
from sumo3dviz_pt.catalog import template_names
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.inspection.roster import Cameras
from sumo3dviz_pt.job.settings import (
    CameraSettings,
    CinematicCamera,
    EulerianCamera,
    KeyFrame,
    LagrangianCamera,
    LensSettings,
    Settings,
    VehicleSettings,
)
from sumo3dviz_pt.job.values import mode_of, models_in
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.shot.cameras.aiming import build_camera, clearance_of
from sumo3dviz_pt.shot.cameras.riding import parse_view, read_view

NOBODY = build_fleet((), {}, VehicleSettings(), seed=0)

MODES = {mode_of(model): model for model in models_in(CameraSettings)}

SAMPLES = {
    "eulerian": {"position": (1, 2, 3), "heading": 90},
    "lagrangian": {"vehicle": "ego"},
    "cinematic": {
        "keyframes": [
            {"time": 3, "position": (1, 2, 3), "heading": 90},
            {"time": 5, "position": (9, 2, 3), "look_at": (20, 2, 0)},
        ]
    },
}
"""Settings of each mode beside the mode's name; a new mode needs its own here."""


def trajectory_of(xy, yaws, *, name="ego", kind="vehicle", times=None, slope=0.0):
    times = 10.0 + np.arange(len(xy)) if times is None else np.asarray(times, dtype=float)
    positions = np.column_stack([xy, np.zeros(len(xy))]).astype(float)
    ones = np.ones(len(xy))
    none = np.full(len(xy), -1)
    trace = Trace(
        name, kind, "", times, positions, yaws * ones, np.nan * ones, slope * ones, none, none
    )
    return smooth(trace, smoother="paper_symmetric", step=1.0)


def plate(name):
    mesh = Mesh(np.array([[0, 0, 0], [-5, 0.9, 0], [-5, -0.9, 1.5]]), np.array([[0, 1, 2]]))
    return Prototype(name, (Part(mesh, "paint"),), ())


def fleet_of(*trajectories, size=(5.0, 1.8, 1.5), vclass=None):
    seat = car_seat(np.array([-2.0, 0.37, 1.18]), cowl=np.array([-1.1, 0.0, 0.95]))
    if vclass:
        seat = class_seat(vclass, np.array(size))
    body = Body(Assembly("box", (Unit(plate("box")),)), np.ones(3), size, seat)
    count = len(trajectories)
    return Fleet(trajectories, (body,) * count, ((0.5,) * 3,) * count, {"box": body.prototype})


EAST = trajectory_of(np.column_stack([10 * np.arange(11), np.zeros(11)]), 0.0)


def ride(view, fleet=None, *, time=15.0, left_hand=False, **more):
    settings = LagrangianCamera(mode="lagrangian", vehicle="ego", view=view, **more)
    camera = build_camera(settings, fleet=fleet or fleet_of(EAST), left_hand=left_hand)
    return camera.view_at(time)


def sample(mode, **more):
    return MODES[mode].model_validate({"mode": mode, **SAMPLES[mode], **more})


def up(view):
    return view.world_from_camera.matrix[:3, 2]


def test_every_mode_has_a_sample():
    assert set(SAMPLES) == set(MODES)


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_is_built_and_has_views_along_its_way(mode):
    camera = build_camera(sample(mode), fleet=fleet_of(EAST))
    moments = camera.moments()
    assert moments and list(moments) == sorted(set(moments))
    for time in moments:
        assert np.isfinite(camera.view_at(time).world_from_camera.matrix).all()
        assert camera.view_at(time).lens.opening > 0.0
    assert camera.shutter.is_instant


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_either_rides_or_can_have_a_clear_view(mode):
    camera = build_camera(sample(mode), fleet=fleet_of(EAST))
    rides = camera.view_at(camera.moments()[0]).rides_in is not None
    assert rides != ("clear_view" in MODES[mode].model_fields)
    assert len(clearance_of([sample(mode)], aspect=0.5).ways) == (0 if rides else 1)
    if not rides:
        assert clearance_of([sample(mode, clear_view=False)], aspect=0.5).ways == ()


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_has_words(mode):
    (line,) = repr(Cameras({"mine": sample(mode)})).splitlines()
    name, words = line.split("  ")
    assert name == "mine" and words == sample(mode).in_words() and len(words) > 10


@pytest.mark.parametrize("mode", MODES)
def test_errors_name_every_mode_but_not_in_the_key(mode):
    def error_of(**camera):
        with pytest.raises(ConfigError) as caught:
            make_job({"scenario": {"folder": "any"}, "cameras": {"mine": camera}})
        return caught.value

    assert mode in str(error_of(**SAMPLES[mode]))
    assert mode in str(error_of(**SAMPLES[mode], mode="surely_none"))
    assert error_of(**SAMPLES[mode], mode=mode, surplus=1).key == "cameras.mine.surplus"


def test_a_ride_has_a_moment_only_where_its_vehicle_exists():
    camera = build_camera(sample("lagrangian"), fleet=fleet_of(EAST))
    spans = ((0.0, 9.0), (0.0, 30.0), (13.0, 30.0), (21.0, 30.0))
    assert [camera.moments(span) for span in spans] == [(), (10.0,), (13.0,), ()]


def test_eulerian_heading_pitch_roll():
    settings = EulerianCamera(
        mode="eulerian", position=(1, 2, 3), heading=90, lens=LensSettings(fov=90)
    )
    camera = build_camera(settings, fleet=NOBODY)
    view = camera.view_at(5.0)
    assert view is camera.view_at(77.0)
    np.testing.assert_allclose(view.position, [1, 2, 3])
    np.testing.assert_allclose(view.forward, [1, 0, 0], atol=1e-12)
    assert view.lens.opening == pytest.approx(np.pi / 2)
    assert view.rides_in is None
    north = EulerianCamera(mode="eulerian", position=(0, 0, 0), heading=0, pitch=30, roll=10)
    view = build_camera(north, fleet=NOBODY).view_at(0)
    np.testing.assert_allclose(view.forward, [0, np.cos(np.pi / 6), 0.5], atol=1e-12)
    # Clockwise for the viewer who looks north: the top leans east.
    assert up(view)[0] == pytest.approx(np.sin(np.radians(10)))


def test_eulerian_look_at():
    settings = EulerianCamera(mode="eulerian", position=(0, 0, 10), look_at=(10, 10, 0))
    view = build_camera(settings, fleet=NOBODY).view_at(0)
    np.testing.assert_allclose(view.forward, np.array([1, 1, -1]) / np.sqrt(3), atol=1e-12)
    down = EulerianCamera(mode="eulerian", position=(0, 0, 10), look_at=(0, 0, 0))
    view = build_camera(down, fleet=NOBODY).view_at(0)
    np.testing.assert_allclose(up(view), [0, 1, 0], atol=1e-12)
    itself = EulerianCamera(mode="eulerian", position=(0, 0, 10), look_at=(0, 0, 10))
    with pytest.raises(ConfigError, match="own position"):
        build_camera(itself, fleet=NOBODY)


def test_other_settings_are_no_camera():
    with pytest.raises(TypeError, match="no camera"):
        build_camera(Settings(), fleet=NOBODY)


def test_views_are_data():
    assert set(template_names("camera")) >= {"driver", "passenger", "hood", "chase", "top"}
    for name in template_names("camera"):
        read_view(name)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"anchor": "eye", "fov": 50, "pich_deg": 3}, "did you mean 'pitch_deg'"),
        ({"anchor": "eye"}, "'fov' is missing"),
    ],
)
def test_wrong_views_are_said(content, message):
    with pytest.raises(ConfigError, match=message):
        parse_view(content, name="mine")


@pytest.mark.parametrize(
    ("view", "left_hand", "y"),
    [
        ("driver", False, 0.37),
        ("passenger", False, -0.37),
        ("driver", True, -0.37),
        ("passenger", True, 0.37),
    ],
)
def test_driver_sits_on_the_right_side(view, left_hand, y):
    seen = ride(view, left_hand=left_hand)
    np.testing.assert_allclose(seen.position, [48.0, y, 1.2], atol=1e-9)
    assert seen.rides_in == "vehicle:ego"
    assert seen.cutaway
    assert seen.forward[0] > 0.99


@pytest.mark.parametrize("left_hand", [False, True])
def test_a_dash_camera_hangs_in_the_middle_below_the_mirror(left_hand):
    seen = ride("dashcam", left_hand=left_hand)
    np.testing.assert_allclose(seen.position, [48.55, 0.0, 1.14], atol=1e-9)
    assert seen.cutaway and seen.mirrors is None
    assert seen.lens.opening == pytest.approx(np.radians(92))
    assert seen.lens.distortion[0] < 0.0, "a barrel"


def test_a_lens_of_the_scene_file_wins_over_that_of_a_dash_camera():
    wide = ride("dashcam", lens=LensSettings(fov=110)).lens
    assert wide.opening == pytest.approx(np.radians(110)) and not any(wide.distortion)
    straight = ride("dashcam", lens=LensSettings(distortion=0)).lens
    assert straight.opening == pytest.approx(np.radians(92)) and not any(straight.distortion)
    sharp = ride("dashcam", lens=LensSettings(f_number=2.0)).lens
    assert sharp.opening == pytest.approx(np.radians(92)) and any(sharp.distortion)
    assert not any(ride("driver").lens.distortion)


def test_unknown_views_and_anchors_are_said_with_what_there_is(monkeypatch):
    with pytest.raises(ConfigError, match="did you mean 'dashcam'"):
        ride("dash_cam")
    with pytest.raises(ConfigError, match=r"known: .*chase, .*dashcam, .*driver"):
        ride("nothing_alike_at_all")
    content = {"anchor": "engine", "fov": 50}
    monkeypatch.setattr("sumo3dviz_pt.shot.cameras.riding.template", lambda *_: content)
    with pytest.raises(ConfigError, match=r"no anchor is called 'engine'; known: .*mirror"):
        ride("mine")


def test_eye_height_heading_pitch_and_lens_override():
    seen = ride("driver", eye_height=1.6, heading=90, pitch=0, lens=LensSettings(fov=33))
    assert seen.position[2] == pytest.approx(1.6)
    np.testing.assert_allclose(seen.forward, [0, -1, 0], atol=1e-9)
    assert seen.lens.opening == pytest.approx(np.radians(33))


def test_mirrors_and_panes_are_only_before_who_sits_in_a_cabin():
    inside, outside = ride("driver", heading=90), ride("hood")
    np.testing.assert_allclose(inside.mirrors, [-1, 0, 0], atol=1e-9)
    assert outside.mirrors is None and outside.pane is None and inside.pane is None
    assert ride("chase", reflections=True).pane is None
    bicycle = fleet_of(EAST, size=(1.6, 0.6, 1.7), vclass="bicycle")
    assert ride("driver", bicycle, reflections=True).mirrors is None


def test_a_windscreen_with_reflections_is_before_the_eye_and_leans_back():
    seen = ride("driver", reflections=True)
    frame = seen.pane.world_from_pane.matrix
    assert frame[0, 3] > seen.position[0], "its foot is ahead"
    assert frame[2, 1] > 0.3 and frame[0, 1] < 0.0, "up and back"
    assert frame[0, 2] > 0.0 and frame[2, 2] > 0.0, "its outer side is ahead and above"


def test_driver_of_a_bus_sits_high_and_near_the_front():
    fleet = fleet_of(EAST, size=(12.0, 2.5, 3.4), vclass="bus")
    seen = ride("driver", fleet)
    assert seen.position[2] == pytest.approx(2.3)
    assert 1.1 < 50 - seen.position[0] < 1.6


def test_camera_follows_the_slope():
    hill = trajectory_of(np.column_stack([10 * np.arange(11), np.zeros(11)]), 0.0, slope=0.1)
    level, steep = ride("hood"), ride("hood", fleet_of(hill))
    pitch = [np.arcsin(view.forward[2]) for view in (level, steep)]
    assert pitch[1] - pitch[0] == pytest.approx(0.1)
    assert not level.cutaway


def test_chase_looks_at_its_vehicle_from_behind():
    seen = ride("chase")
    assert seen.position[0] < 45 - 4
    assert seen.position[2] > 2
    to_car = np.array([47.5, 0, 0.8]) - seen.position
    assert seen.forward @ (to_car / np.linalg.norm(to_car)) > np.cos(np.radians(8))


def test_chase_with_heading_goes_round():
    seen = ride("chase", heading=180)
    assert seen.position[0] > 50
    assert seen.forward[0] < -0.9


def test_top_looks_straight_down_with_the_front_up():
    seen = ride("top")
    np.testing.assert_allclose(seen.forward, [0, 0, -1], atol=1e-9)
    np.testing.assert_allclose(up(seen), [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(seen.position[:2], [47.5, 0], atol=1e-9)


def test_chase_swings_more_gently_than_the_body():
    angle = np.clip((np.arange(21) - 8) / 3, 0, 1) * np.pi / 2
    steps = 6 * np.column_stack([np.cos(angle), np.sin(angle)])
    turning = trajectory_of(np.cumsum(steps, axis=0), angle)
    settings = LagrangianCamera(mode="lagrangian", vehicle="ego", view="chase")
    camera = build_camera(settings, fleet=fleet_of(turning))
    times = np.arange(10, 30, 0.04)
    forwards = np.array([camera.view_at(t).forward for t in times])
    yaws = np.unwrap(np.arctan2(forwards[:, 1], forwards[:, 0]))
    bodies = np.unwrap(turning.sample(times).yaws)
    assert np.abs(np.diff(yaws)).max() < np.abs(np.diff(bodies)).max()
    assert np.abs(np.diff(yaws, 2)).max() < 0.02
    assert yaws[-1] == pytest.approx(np.pi / 2, abs=1e-6)


@pytest.mark.parametrize("time", [9.9, 20.1])
def test_outside_its_life_the_message_says_when(time):
    with pytest.raises(ConfigError, match=r"'ego' is not there at .* from 10 to 20 s"):
        ride("chase", time=time)


def test_unknown_rider_and_view_get_suggestions():
    settings = LagrangianCamera(mode="lagrangian", vehicle="egg", view="driver")
    fleet = fleet_of(EAST, trajectory_of([[0, 0]], 0.0, name="other"))
    with pytest.raises(ConfigError, match=r"did you mean 'ego'.*'other'"):
        build_camera(settings, fleet=fleet)
    with pytest.raises(ConfigError, match="for example 'ego'"):
        build_camera(settings.model_copy(update={"vehicle": "zzzzz"}), fleet=fleet)
    with pytest.raises(ConfigError, match="nobody"):
        build_camera(settings, fleet=NOBODY)
    with pytest.raises(ConfigError, match="did you mean 'driver'"):
        ride("drivr")


def test_persons_can_be_ridden_with():
    walker = trajectory_of([[0, 0], [1, 0]], 0.0, name="ego", kind="person")
    fleet = fleet_of(walker, size=(0.215, 0.478, 1.719), vclass="pedestrian")
    assert ride("driver", fleet, time=10.5).rides_in == "person:ego"
    assert ride("driver", fleet, time=10.5).position[2] == pytest.approx(1.6, abs=0.01)


def flight(*keys, fov=50):
    frames = tuple(KeyFrame(**key) for key in keys)
    settings = CinematicCamera(mode="cinematic", keyframes=frames, lens=LensSettings(fov=fov))
    return build_camera(settings, fleet=NOBODY)


def test_flight_passes_and_holds_its_key_frames():
    camera = flight(
        {"time": 0, "position": (0, 0, 5), "heading": 0},
        {"time": 10, "position": (10, 0, 5), "heading": 90, "fov": 30},
        {"time": 20, "position": (10, 10, 9), "heading": 180},
    )
    np.testing.assert_allclose(camera.view_at(-5).position, [0, 0, 5])
    np.testing.assert_allclose(camera.view_at(10).position, [10, 0, 5])
    np.testing.assert_allclose(camera.view_at(99).position, [10, 10, 9])
    np.testing.assert_allclose(camera.view_at(10).forward, [1, 0, 0], atol=1e-12)
    assert camera.view_at(10).lens.opening == pytest.approx(np.radians(30))
    assert camera.view_at(99).lens.opening == pytest.approx(np.radians(50))


def test_equal_key_frames_stay_equal_in_between():
    # The peer's spline drifted by 116 m and 73 degrees between such key frames.
    camera = flight(
        {"time": 0, "position": (0, 0, 40), "heading": 10, "pitch": -20},
        {"time": 250, "position": (500, 300, 20), "heading": 300, "pitch": -5},
        {"time": 350, "position": (500, 300, 20), "heading": 300, "pitch": -5},
        {"time": 400, "position": (0, 900, 60), "heading": 200, "pitch": -20},
    )
    still = camera.view_at(250).world_from_camera.matrix
    for time in np.linspace(250, 350, 41):
        np.testing.assert_array_equal(camera.view_at(time).world_from_camera.matrix, still)


def test_flight_turns_the_shortest_way():
    camera = flight(
        {"time": 0, "position": (0, 0, 5), "heading": 350},
        {"time": 1, "position": (0, 0, 5), "heading": 10},
    )
    np.testing.assert_allclose(camera.view_at(0.5).forward, [0, 1, 0], atol=1e-12)


def test_subject_stays_in_the_middle():
    camera = flight(
        {"time": 0, "position": (0, 0, 5), "look_at": (20, 0, 1)},
        {"time": 10, "position": (20, 30, 15), "look_at": (20, 0, 1)},
        {"time": 20, "position": (60, 0, 5), "look_at": (20, 0, 1)},
        {"time": 30, "position": (60, 0, 5), "heading": 0},
    )
    for time in np.linspace(0, 20, 50):
        view = camera.view_at(time)
        direction = np.array([20, 0, 1]) - view.position
        assert view.forward @ direction == pytest.approx(np.linalg.norm(direction))
    np.testing.assert_allclose(camera.view_at(30).forward, [0, 1, 0], atol=1e-12)


def test_subject_passed_through_is_no_accident():
    camera = flight(
        {"time": 0, "position": (-10, 0, 0), "look_at": (0, 0, 0)},
        {"time": 10, "position": (10, 0, 0), "look_at": (0, 0, 0)},
    )
    assert np.isfinite(camera.view_at(5.0).world_from_camera.matrix).all()


def test_one_key_frame_is_a_standing_camera():
    camera = flight({"time": 3, "position": (1, 2, 3), "look_at": (1, 5, 3)})
    np.testing.assert_allclose(camera.view_at(0).forward, [0, 1, 0], atol=1e-12)
