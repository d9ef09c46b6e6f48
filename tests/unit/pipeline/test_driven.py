"""Tracks in snow are those of the whole log, whichever part of it is shown."""

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.pipeline import worlds
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

SNOW = {"weather": {"season": "winter", "snow": {"depth": "4 cm", "roads": "tracked"}}}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("driven"), vehicles=6, end=60.0, speed=2.0)


@pytest.fixture(autouse=True)
def _nothing_remembered():
    worlds._whole.cache_clear()


def tracks(scene, *times, **changes):
    job = load_job(scene, {**SNOW, **changes})
    return prepare(job, Request(camera="post"), np.array(times)).shot.data.tracks


def test_two_windows_of_a_place_show_the_same_tracks(scene):
    one, other = tracks(scene, 2.0, 2.5), tracks(scene, 30.0)
    assert len(one.begins) > 100
    np.testing.assert_array_equal(one.begins, other.begins)
    np.testing.assert_array_equal(one.ends, other.ends)


def test_who_is_left_out_leaves_no_tracks(scene):
    everyone = tracks(scene, 2.0)
    some = tracks(scene, 2.0, traffic={"leave_out": ["*0", "*1"]})
    assert 0 < len(some.begins) < len(everyone.begins)


@pytest.mark.parametrize("weather", [None, {"wetness": 1.0}, {"snow": {"depth": "0 cm"}}])
def test_the_whole_log_is_read_only_where_snow_lies(scene, weather):
    prepare(load_job(scene, {"weather": weather}), Request(camera="post"), np.array([2.0]))
    assert worlds._whole.cache_info().misses == 0


def test_who_stands_through_the_log_is_parked_in_every_frame(tmp_path):
    """In a window of a second nobody could tell a parked car from one that waits."""
    place = write_scenario(tmp_path, vehicles=3, end=70.0, speed=0.0)
    shot = prepare(load_job(place, SNOW), Request(camera="post"), np.array([30.0])).shot
    assert shot.fleet.parked == {"vehicle:v0", "vehicle:v1", "vehicle:v2"}
    frame = shot.frame_at(30.0)
    assert frame.movers and all(mover.parked for mover in frame.movers)


def test_who_drives_is_not_parked(scene):
    shot = prepare(load_job(scene, SNOW), Request(camera="post"), np.array([2.0])).shot
    assert not shot.fleet.parked
    assert not any(mover.parked for mover in shot.frame_at(2.0).movers)
