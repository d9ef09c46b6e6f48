"""Films in weather: the same frames alone, in a film, in parts and resumed; and what is written."""

import itertools
import json

import numpy as np
import pytest
from builders import write_scenario
from film_frames import assert_equal_frames, frames_in, run

from sumo3dviz_pt.cli import main

pytestmark = pytest.mark.slow

TIMES = ["--from", "4", "--to", "4.6", "--fps", "10", "--spp", "1"]

WEATHERS = {
    "fog that comes by night": (
        "{fog: {visibility: 100 m, height: 30 m},"
        " course: [{time: 4, fog: {visibility: 5 km}}, {time: 4.5, fog: {visibility: 60 m}}]}",
        "{preset: sky_night3}",
    ),
    "rain that begins by day": (
        "{wind: {speed: 5 m/s}, course: [{time: 4, rain: {rate: 0}}, {time: 5, rain: {rate: 9}}]}",
        "{preset: sky_blue}",
    ),
    "snow that comes to lie": (
        "{season: winter, course: [{time: 4, snow: {depth: 1 cm, falling: 0.1}},"
        " {time: 5, snow: {depth: 6 cm, falling: 2}}]}",
        "{preset: sky_blue}",
    ),
}


@pytest.fixture(scope="module", params=WEATHERS)
def film(request, tmp_path_factory):
    """A film in a weather, and the words that made it."""
    folder = tmp_path_factory.mktemp("weather")
    place = write_scenario(folder, signals=True, vehicles=4)
    weather, sky = WEATHERS[request.param]
    words = ["--set", f"weather={weather}", "--set", f"sky={sky}"]
    made = folder / "whole.mp4"
    run("render", place, "--camera", "post", *TIMES, *words, "-o", made)
    return place, made, words


def test_the_weather_changes(film):
    """From frame to frame, and its account says how."""
    _, whole, _ = film
    frames = list(frames_in(whole.with_suffix(".frames")).values())
    assert not np.array_equal(frames[0], frames[-1])
    account = json.loads(whole.with_suffix(".json").read_text(encoding="utf-8"))
    taken = [frame["weather"]["extinction_per_km"] for frame in account["frames"]]
    assert len(taken) == 6 and all(b > a for a, b in itertools.pairwise(taken))


def test_a_frame_alone_is_that_of_the_film(film):
    place, whole, words = film
    alone = whole.parent / "part.mp4"
    run("render", place, "--camera", "post", *TIMES, *words, "--frames", "4:5", "-o", alone)
    one = frames_in(alone.with_suffix(".frames"))
    assert list(one) == ["000004.exr"]
    assert_equal_frames(one, frames_in(whole.with_suffix(".frames")))


def test_a_film_that_goes_on_is_the_same(film):
    place, whole, words = film
    again = whole.parent / "again.mp4"
    run("render", place, "--camera", "post", *TIMES, *words, "--frames", "3:6", "-o", again)
    run("render", place, "--camera", "post", *TIMES, *words, "--resume", "-o", again)
    one, two = (frames_in(each.with_suffix(".frames")) for each in (again, whole))
    assert set(one) == set(two)
    assert_equal_frames(one, two)


def test_weather_is_refused_where_mitsuba_traces(film, capsys):
    place, whole, words = film
    words = [str(each) for each in words]
    for more in (["--quality", "reference_path"], ["--variant", "scalar"]):
        asked = ["still", str(place), "--time", "4", *words, *more]
        assert main([*asked, "-o", str(whole.with_name("x.png"))]) == 2
        assert "only our own kernel" in capsys.readouterr().err
