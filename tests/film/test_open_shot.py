"""The renderer stays open between stills, a still is the film's frame, frames come as arrays."""

import pickle

import numpy as np
import pytest
from builders import write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.api import Films
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.pipeline.films.film import FilmOrder, render_film
from sumo3dviz_pt.pipeline.live import plan_times, render_still
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job

pytestmark = pytest.mark.slow

CHEAP = {"quality": "draft", "spp": 1}
SHOT = "shots: [{camera: driver, from: 4, to: 5}]\noutput: {size: [64, 36], fps: 10}\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A scene with a shot, so that stills of its window have its plan."""
    file = write_scenario(tmp_path_factory.mktemp("open"), signals=True, trees=True, vehicles=12)
    head, _, tail = file.read_text(encoding="utf-8").partition("shots:")
    file.write_text(head + SHOT + tail.partition("output:")[2].partition("\n")[2], encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def scene(place):
    with sv.load(place) as opened:
        yield opened


def test_a_still_belongs_to_the_shot_that_shows_its_time(place):
    job = load_job(place)
    driver = Request(camera="driver")
    assert len(plan_times(job, driver, 4.0)) == len(plan_times(job, driver, 4.55)) == 10
    np.testing.assert_array_equal(plan_times(job, driver, 4.9)[[0, -1]], [4.0, 4.9])
    # After the last frame, before the first, and of a camera without a shot.
    for request, time in ((driver, 4.95), (driver, 3.9), (Request(camera="post"), 4.5)):
        np.testing.assert_array_equal(plan_times(job, request, time), [time])


def test_a_still_is_the_films_frame_bit_by_bit(place, scene, tmp_path):
    """Of a preset whose frames do not help each other: a still has no neighbours."""
    alone = {**CHEAP, "quality": "reference"}
    request = Request(camera="driver", **alone)
    (report,) = render_film(load_job(place), request, FilmOrder(tmp_path / "whole.mp4"))
    for number in (0, 3, 9):
        frame = read_exr(report.folder / f"{number:06d}.exr")[0]
        still = scene.still(camera="driver", time=4 + number / 10, **alone)
        np.testing.assert_array_equal(still.radiance.astype(np.float16), frame.astype(np.float16))
        assert still.provenance["frame"] == number


def test_the_renderer_stays_open_for_stills_of_one_shot(scene):
    first = scene.still(camera="driver", time=4.0, **CHEAP)
    later = scene.still(camera="driver", time=4.7, **CHEAP)
    again = scene.still(camera="driver", time=4.0, **CHEAP)
    assert later.rendered.cpu["load"] == again.rendered.cpu["load"] == 0.0
    np.testing.assert_array_equal(first.radiance, again.radiance)
    assert not np.array_equal(first.radiance, later.radiance)


def test_another_quality_is_taken_without_opening_again(place, scene):
    scene.still(camera="driver", time=4.2, **CHEAP)
    finer = scene.still(camera="driver", time=4.2, quality="preview")
    assert finer.rendered.cpu["load"] == 0.0 and finer.provenance["spp"] == 4
    alone = render_still(load_job(place), Request(camera="driver", quality="preview"), 4.2)
    np.testing.assert_array_equal(finer.radiance, alone.radiance)
    assert finer.provenance == alone.provenance


@pytest.mark.parametrize("change", [{"seed": 5}, {"size": (32, 18)}, {"camera": "post"}])
def test_what_makes_another_shot_opens_another_one(scene, change):
    scene.still(camera="driver", time=4.2, **CHEAP)
    other = scene.still(**{"camera": "driver", "time": 4.2, **CHEAP, **change})
    assert other.rendered.cpu["load"] > 0.0


def test_a_closed_scene_opens_again(scene):
    before = scene.still(camera="driver", time=4.2, **CHEAP)
    scene.close()
    scene.close()
    after = scene.still(camera="driver", time=4.2, **CHEAP)
    assert after.rendered.cpu["load"] > 0.0
    np.testing.assert_array_equal(before.radiance, after.radiance)


def test_two_open_scenes_with_other_variants_do_not_disturb_each_other(place, scene):
    before = scene.still(camera="driver", time=4.2, **CHEAP)
    with sv.load(place) as other:
        other.still(camera="driver", time=4.2, variant="scalar", **CHEAP)
        after = scene.still(camera="driver", time=4.2, **CHEAP)
    np.testing.assert_array_equal(before.radiance, after.radiance)


def test_frames_come_as_arrays(scene):
    frames = list(scene.frames(camera="driver", start=4.0, end=4.3, **CHEAP))
    assert [round(frame.time, 6) for frame in frames] == [4.0, 4.1, 4.2]
    for frame in frames:
        assert frame.radiance.shape == (36, 64, 3)
        np.testing.assert_array_equal(np.asarray(frame), frame.develop())


def test_frames_refuse_what_is_wrong_before_the_first(scene):
    with pytest.raises(sv.ConfigError, match="must be later"):
        next(scene.frames(camera="driver", start=5.0, end=4.0))


def test_scenes_and_stills_can_be_sent_to_other_processes(place, scene):
    still = scene.still(camera="driver", time=4.2, **CHEAP)
    copy = pickle.loads(pickle.dumps(still))
    np.testing.assert_array_equal(copy.radiance, still.radiance)
    assert copy.provenance == still.provenance
    other = pickle.loads(pickle.dumps(scene))
    assert other.job == scene.job and repr(other) == repr(scene)
    picture = other.still(camera="driver", time=4.2, **CHEAP)
    other.close()
    np.testing.assert_array_equal(picture.radiance, still.radiance)


def test_what_is_shown_of_a_scene_and_a_still(place, scene):
    assert repr(scene) == f"<Scene {place}: cameras post, driver; 1 shot; draft>"
    still = scene.still(camera="driver", time=4.2, **CHEAP)
    assert repr(still) == "<Still 64x36, driver at 4.2 s>"


def test_notebooks_show_films(scene, tmp_path):
    films = scene.render(tmp_path / "a.mp4", camera="driver", start=4.0, end=4.2, **CHEAP)
    assert films == [tmp_path / "a.mp4"]
    assert films._repr_html_().startswith('<video src="data:video/mp4;base64,')
    folder = Films([tmp_path / "<a>.frames"])
    assert "&lt;a&gt;.frames" in folder._repr_html_() and "<video" not in folder._repr_html_()


def test_a_still_between_frames_has_room_for_those_in_no_frame_together(tmp_path):
    """A car leaves and its like comes between two frames: only there are there two of them."""
    file = write_scenario(tmp_path, vehicles=1, step=0.1, speed=2.0)
    log = tmp_path / "fcd.xml"
    steps = log.read_text(encoding="utf-8").splitlines()
    for n, step in enumerate(steps):
        if "<timestep" in step:
            time = float(step.partition('time="')[2].partition('"')[0])
            car = step[step.index("<vehicle") : step.index("</timestep>")]
            first = car.replace('id="v0"', 'id="first"').replace('y="-4.800"', 'y="-1.600"')
            like = first.replace('id="first"', 'id="like"').replace('x="-', 'x="-1')
            there = [car, first if time < 4.65 else "", like if time > 4.35 else ""]
            steps[n] = f'<timestep time="{time:.2f}">{"".join(there)}</timestep>'
    log.write_text("\n".join(steps), encoding="utf-8")
    text = file.read_text(encoding="utf-8").replace("fps: 10", "fps: 1").replace("to: 5}", "to: 6}")
    same = "vehicles: {by_id: {first: {model: sedan}, like: {model: sedan}}}\n"
    file.write_text(text + same, encoding="utf-8")
    with sv.load(file) as opened:
        stills = [opened.still(camera="post", time=time, **CHEAP) for time in (4.0, 4.5, 5.0)]
    assert all(np.isfinite(still.radiance).all() for still in stills)
