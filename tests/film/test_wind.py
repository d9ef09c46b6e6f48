"""Films in wind: a frame hangs on its time alone, and a shutter shows how leaves moved."""

import numpy as np
import pytest
from builders import SCENE, write_scenario
from film_frames import frames_of, run

from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

pytestmark = pytest.mark.slow

TIMES = ["--from", "4", "--to", "4.3", "--fps", "10", "--spp", "1", "--size", "96x54"]
WINDY = "weather={wind: {speed: 7 m/s}}"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A post that looks at two trees."""
    look = SCENE.format(files="  additional: trees.add.xml\n", x0=15, y0=-2, x1=10, y1=14)
    return write_scenario(tmp_path_factory.mktemp("wind"), trees=True, vehicles=2, scene=look)


@pytest.fixture(scope="module")
def film(place):
    made = place.parent / "whole.mp4"
    run("render", place, "--camera", "post", *TIMES, "--set", WINDY, "-o", made)
    return made


def test_a_frame_alone_is_that_of_the_film(place, film):
    alone = place.parent / "part.mp4"
    words = ["--camera", "post", *TIMES, "--set", WINDY, "--frames", "1:2", "-o", alone]
    run("render", place, *words)
    whole, one = frames_of(film), frames_of(alone)
    assert list(one) == ["000001.exr"] and len(whole) == 3
    np.testing.assert_array_equal(one["000001.exr"], whole["000001.exr"])


def test_a_shutter_shows_leaves_at_several_moments(place):
    """The shot's moments have other times, so leaves are elsewhere in each of them."""
    shutter = {"cameras.post.shutter": {"time": "40 ms"}, "weather": {"wind": {"speed": "7 m/s"}}}
    made = prepare(load_job(place, shutter), Request(camera="post"), np.array([4.0]))
    frame = made.shot.exposed_at(4.0, samples=4)
    assert made.shot.data.swaying
    times = {moment.frame.time for moment in frame.exposure}
    assert len(times) > 1
    assert {moment.frame.weather.wind.speed for moment in frame.exposure} == {7.0}


@pytest.mark.parametrize("weather", [None, {"wind": {"speed": "0 m/s"}}, {"rain": {"rate": 5}}])
def test_without_wind_no_plant_is_apart(place, weather):
    changes = {} if weather is None else {"weather": weather}
    made = prepare(load_job(place, changes), Request(camera="post"), np.array([4.0]))
    assert made.shot.data.swaying == {}
    assert not [part.id for part in made.shot.data.static if part.id.endswith("/wind")]
