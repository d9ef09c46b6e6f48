"""Clearance: all cameras of a scene file count, in every shot, except those that ride."""

from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import CinematicCamera, EulerianCamera
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.cameras.aiming import clearance_of
from sumo3dviz_pt.world.placement.clearance import Clearance

CROSSING = Path(__file__).parents[4] / "examples" / "crossing" / "scene.yaml"


def flight(*keys):
    frames = [{"time": time, "position": at, "heading": 0.0} for time, at in keys]
    return CinematicCamera.model_validate({"mode": "cinematic", "keyframes": frames})


def standing(at, **aim):
    return EulerianCamera.model_validate({"mode": "eulerian", "position": at, **aim})


@pytest.fixture(scope="module")
def job():
    return load_job(CROSSING)


def clear(**cameras):
    return clearance_of(cameras.values(), aspect=0.5)


def test_what_a_camera_does_not_want_is_not_cleared():
    assert clear(a=standing((9, 9, 9), heading=0.0, clear_view=False)).ways == ()
    assert clear(a=flight((3.0, (1, 2, 3))).model_copy(update={"clear_view": False})).ways == ()


def test_cameras_that_ride_have_no_way(job):
    driver = job.cameras["driver"]
    assert clear(driver=driver).ways == ()
    assert len(clear(**job.cameras).ways) == len(job.cameras) - 1


def test_a_flight_s_way_has_its_key_frames_and_what_lies_between():
    keys = ((0.0, (0, 0, 5)), (10.0, (100, 0, 5)), (11.0, (100, 50, 5)))
    (way,) = clear(flight=flight(*keys)).ways
    for _, place in keys:
        assert np.linalg.norm(way.positions - place, axis=1).min() < 1e-9
    steps = np.linalg.norm(np.diff(way.positions, axis=0), axis=1)
    assert steps.max() < 15.0
    (still,) = clear(flight=flight((3.0, (1, 2, 3)))).ways
    assert still.positions.tolist() == [[1, 2, 3]]


def test_only_cameras_that_stay_have_outlooks():
    far = flight((0.0, (0, 0, 5)), (10.0, (300, 0, 5)))
    pan = flight((0.0, (0, 0, 5)), (10.0, (20, 0, 5)))
    found = clear(a=far, b=pan, c=standing((9, 9, 9), heading=0.0))
    assert [len(way.positions) > 1 for way in found.outlooks] == [True, False]


def test_distances_are_level_and_infinite_without_cameras():
    assert np.isinf(Clearance().distances(np.zeros((3, 2)))).all()
    assert Clearance().places.shape == (0, 3)
    one = Clearance((CameraPath.all_round(np.array([[3.0, 4.0, 50.0]])),))
    assert one.distances(np.zeros((1, 2))) == pytest.approx([5.0])


@pytest.mark.parametrize(
    ("place", "height", "hides"),
    [
        ((10.0, 0.0), 8.0, True),
        ((12.0, 6.0), 8.0, True),  # anywhere in the picture
        ((25.0, 1.0), 8.0, True),  # farther away only in its middle
        ((25.0, 9.0), 8.0, False),
        ((40.0, 0.0), 8.0, False),
        ((-8.0, 0.0), 8.0, False),  # behind the camera
        ((3.0, 12.0), 8.0, False),  # beside the picture
        ((10.0, 0.0), 2.5, False),  # lower than what the camera looks at
    ],
)
def test_what_would_stand_right_before_a_lens(place, height, hides):
    camera = standing((0, 0, 9), look_at=(40, 0, 1), lens={"fov": 60})
    found = clear(a=camera).before_lens(np.array([place]), np.zeros(1), height=height, reach=1.0)
    assert found.tolist() == [hides]


def test_what_reaches_into_a_picture_stands_before_it():
    way = clear(a=standing((0, 0, 9), look_at=(40, 0, 1), lens={"fov": 60}))
    beside = np.array([[5.0, 4.5]])
    hides = [way.before_lens(beside, np.zeros(1), height=9.0, reach=r)[0] for r in (0.0, 2.5)]
    assert hides == [False, True]
    assert not Clearance().before_lens(beside, np.zeros(1), height=9.0, reach=2.0).any()
    round_about = Clearance((CameraPath.all_round(np.array([[0.0, 0.0, 9.0]])),))
    assert not round_about.before_lens(beside, np.zeros(1), height=9.0, reach=2.0).any()


@pytest.mark.parametrize(
    ("place", "hides"),
    [
        ((38.0, 4.5), True),  # its arm hangs 2.5 m beside the axis
        ((38.0, -4.5), True),
        ((38.0, 6.0), False),
        ((56.0, 1.0), False),  # there the axis is at the height of heads
        ((-5.0, 1.0), False),
    ],
)
def test_no_lamp_hangs_beside_an_axis_that_is_above_heads(place, hides):
    way = clear(a=standing((0, 0, 9), look_at=(60, 0, 1), lens={"fov": 60}))
    found = way.before_lens(np.array([place]), np.zeros(1), height=8.0, reach=2.0)
    assert found.tolist() == [hides]


def test_a_low_camera_clears_no_lamps_far_ahead():
    way = clear(a=standing((0, 0, 2.2), look_at=(60, 0, 2.0), lens={"fov": 60}))
    found = way.before_lens(np.array([[45.0, 4.0]]), np.zeros(1), height=8.0, reach=2.0)
    assert not found.any()
