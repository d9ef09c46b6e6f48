"""Rain and snow in films: frames are functions of themselves, and dry films know nothing of it."""

import subprocess
import sys

import numpy as np
import pytest
from builders import write_scenario
from film_frames import run

from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.pipeline.films.traced import FALLING, StoredFrame

pytestmark = pytest.mark.slow

FILM = ["--camera", "post", "--from", "4", "--to", "4.4", "--fps", "10", "--quality", "draft"]
RAIN = ["--set", "weather.preset=downpour"]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("falling"), trees=True, vehicles=4)


@pytest.fixture(scope="module")
def wet(place):
    """A film of four frames in rain, with finished ones beside it."""
    film = place.parent / "wet.mp4"
    run("render", place, *FILM, *RAIN, "--final-exr", "-o", film)
    return film


def test_frames_say_what_falls_before_them(wet):
    frames = [StoredFrame.read(path) for path in sorted((wet.parent / "wet.frames").glob("*.exr"))]
    assert len(frames) == 4 and all(FALLING in frame.strings for frame in frames)
    texts = {frame.strings[FALLING] for frame in frames}
    assert len(texts) == 4


def test_parts_alone_give_the_same_frames_and_film(place, wet):
    parts = place.parent / "parts.mp4"
    run("render", place, *FILM, *RAIN, "--frames", "2:3", "-o", parts)
    run("render", place, *FILM, *RAIN, "--resume", "--final-exr", "-o", parts)
    for path in sorted((wet.parent / "wet.frames").glob("*.exr")):
        one, other = (
            StoredFrame.read(path.parents[1] / f"{n}.frames" / path.name) for n in ("wet", "parts")
        )
        assert one.strings[FALLING] == other.strings[FALLING]
        for name, layer in one.layers.items():
            np.testing.assert_array_equal(layer, other.layers[name])
        finished = (read_exr(wet.parent / f"{n}.final" / path.name)[0] for n in ("wet", "parts"))
        np.testing.assert_array_equal(*finished)
    assert wet.read_bytes() == parts.read_bytes()


def test_developing_needs_no_scene(place, wet):
    again = place.parent / "again.mp4"
    run("develop", wet.parent / "wet.frames", "--final-exr", "-o", again)
    for path in sorted((wet.parent / "wet.final").glob("*.exr")):
        one, other = (read_exr(wet.parent / f"{n}.final" / path.name)[0] for n in ("wet", "again"))
        np.testing.assert_array_equal(one, other)


def test_streaks_are_laid_over_the_finished_frame_only(place, wet):
    """The same rain without streaks is traced to the same light."""
    plain = place.parent / "plain.mp4"
    none = ["--set", "weather.rain.streaks=0"]
    run("render", place, *FILM, *RAIN, *none, "--final-exr", "-o", plain)
    folders = [place.parent / f"{name}.frames" / "000001.exr" for name in ("wet", "plain")]
    one, other = (StoredFrame.read(path) for path in folders)
    for name, layer in one.layers.items():
        np.testing.assert_array_equal(layer, other.layers[name])
    finished = [read_exr(place.parent / f"{n}.final" / "000001.exr")[0] for n in ("wet", "plain")]
    assert (finished[0] != finished[1]).any(axis=-1).mean() > 0.02


def test_dry_films_load_nothing_of_it(place):
    """In a process of its own, as others have loaded it here."""
    target = place.parent / "dry.mp4"
    told = [str(argument) for argument in ("render", place, *FILM, "-o", target)]
    code = (
        "import sys; from sumo3dviz_pt.cli import main; code = main(sys.argv[1:]);"
        "loaded = [name for name in sys.modules if name.startswith('sumo3dviz_pt.render.falling')];"
        "sys.exit(code or (9 if loaded else 0))"
    )
    made = subprocess.run([sys.executable, "-c", code, *told], check=False)
    assert made.returncode == 0
    frame = StoredFrame.read(place.parent / "dry.frames" / "000000.exr")
    assert FALLING not in frame.strings
