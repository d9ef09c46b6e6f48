"""In every weather a frame alone and a film that goes on are the film, to the bit."""

from __future__ import annotations

import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from builders import write_scenario
from film_frames import run

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.films.traced import FALLING, StoredFrame

pytestmark = pytest.mark.slow

TIMES = ["--from", "5", "--to", "5.3", "--fps", "10", "--quality", "draft", "--spp", "2"]
DAY, NIGHT = ({"template": f"city_{hour}"} for hour in ("day", "night"))
RIDE = {"camera": "driver"}
SHUTTER = {"camera": "driver", "cameras.driver.shutter": "{angle: 180, moments: 2}"}

FILMS = {
    "after_rain": DAY,
    "dense_fog": NIGHT | RIDE,
    "downpour": NIGHT | RIDE,
    "drizzle": NIGHT,
    "fog": DAY,
    "rain": DAY | SHUTTER,
    "snow": NIGHT,
    "snowfall": DAY | SHUTTER,
    "fog that comes by night": {
        "weather": "{fog: {visibility: 100 m, height: 30 m}, course: [{time: 5, fog:"
        " {visibility: 5 km}}, {time: 5.2, fog: {visibility: 60 m}}]}",
        "sky": "{preset: sky_night3}",
    },
    "rain that begins by day": {
        "weather": "{wind: {speed: 5 m/s}, course: [{time: 5, rain: {rate: 0}},"
        " {time: 5.4, rain: {rate: 9}}]}",
        "sky": "{preset: sky_blue}",
    },
    "snow that comes to lie": {
        "weather": "{season: winter, course: [{time: 5, snow: {depth: 1 cm, falling: 0.1}},"
        " {time: 5.4, snow: {depth: 6 cm, falling: 2}}]}",
        "sky": "{preset: sky_blue}",
    },
}
"""What each film's scene sets: all weathers, by day or by night, rides and shutters, courses."""

COURSES = [name for name, values in FILMS.items() if "weather" in values]


def test_every_weather_has_its_film():
    assert set(FILMS) - set(COURSES) == set(catalog.template_names("weather"))


def words_of(name: str) -> list[str]:
    """What a command says to make a film."""
    values = {"weather": f"{{preset: {name}}}", "camera": "post", **FILMS[name]}
    camera = ["--camera", values.pop("camera")]
    return [*TIMES, *camera, *(w for key in values for w in ("--set", f"{key}={values[key]}"))]


def frames_of(film: Path) -> dict[str, StoredFrame]:
    """All frames beside a film."""
    files = sorted(film.with_suffix(".frames").glob("*.exr"))
    return {path.name: StoredFrame.read(path) for path in files}


def assert_equal_frames(some: dict[str, StoredFrame], others: dict[str, StoredFrame]) -> None:
    """Assert that frames have the same layers, and the same before them that falls."""
    assert some and set(some) <= set(others)
    for name, frame in some.items():
        other = others[name]
        assert frame.strings.get(FALLING) == other.strings.get(FALLING)
        assert set(frame.layers) == set(other.layers)
        for layer, values in frame.layers.items():
            np.testing.assert_array_equal(values, other.layers[layer], err_msg=f"{name} {layer}")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("weather")
    return write_scenario(folder, signals=True, trees=True, vehicles=4, persons=1, end=20.0)


@pytest.fixture(scope="module", params=FILMS)
def film(request, place):
    """A film of three frames in a weather, and the name of that."""
    made = place.parent / f"{request.param}.mp4"
    run("render", place, *words_of(request.param), "-o", made)
    return made, request.param


def test_the_film_shows_its_weather(film):
    made, name = film
    account = json.loads(made.with_suffix(".json").read_text(encoding="utf-8"))
    told = [frame["weather"] for frame in account["frames"]]
    taken = [weather["extinction_per_km"] for weather in told]
    if name in COURSES:
        assert all(later > before for before, later in itertools.pairwise(taken))
    else:
        assert len(told) == 3 and all(weather == told[0] for weather in told)
    radiance = [frame.layers["radiance"] for frame in frames_of(made).values()]
    assert not np.array_equal(radiance[0], radiance[-1])


def test_a_film_that_lost_its_last_frame_goes_on_to_the_same(film, place, tmp_path):
    """The frame is made by a renderer that has seen none before it."""
    whole, name = film
    again = tmp_path / whole.name
    shutil.copy(whole.with_suffix(".json"), again.with_suffix(".json"))
    shutil.copytree(whole.with_suffix(".frames"), again.with_suffix(".frames"))
    (again.with_suffix(".frames") / "000002.exr").unlink()
    run("render", place, *words_of(name), "--resume", "-o", again)
    made, frames = frames_of(again), frames_of(whole)
    assert len(made) == len(frames) == 3
    assert_equal_frames(made, frames)
    assert again.read_bytes() == whole.read_bytes()


def test_weather_is_refused_where_mitsuba_traces(place, tmp_path, capsys):
    asked = ["still", str(place), "--time", "5", "--set", "weather={preset: fog}"]
    for more in (["--quality", "reference_path"], ["--variant", "scalar"]):
        assert main([*asked, *more, "-o", str(tmp_path / "x.png")]) == 2
        assert "only our own kernel" in capsys.readouterr().err
