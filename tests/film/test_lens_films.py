"""Films with lenses and shutters: pure frames, boxes in the file, one exposure per shot."""

import json

import numpy as np
import pytest
from builders import write_scenario
from film_frames import frames_of, run

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.layers import read_flow
from sumo3dviz_pt.pipeline.live import render_still
from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.video.spherical import Spherical

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("compiled")]

TIMES = ["--from", "4", "--to", "4.4", "--fps", "10", "--spp", "2"]
BLURRED = [
    *("--set", "cameras.post.shutter={angle: 180, moments: 4, rolling: 10 ms}"),
    *("--set", "cameras.post.lens={f_number: 2, focus: {vehicle: v0}}"),
    *("--set", "cameras.post.exposure=auto"),
]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("lens"), vehicles=6, persons=1)


@pytest.fixture(scope="module")
def whole(place):
    film = place.parent / "whole.mp4"
    run("render", place, "--camera", "post", *TIMES, *BLURRED, "-o", film)
    return film


def test_a_part_and_what_was_resumed_equal_the_whole(place, whole):
    part = place.parent / "part.mp4"
    run("render", place, "--camera", "post", *TIMES, *BLURRED, "--frames", "2:3", "-o", part)
    run("render", place, "--camera", "post", *TIMES, *BLURRED, "--resume", "-o", part)
    one, other = frames_of(whole), frames_of(part)
    assert list(one) == list(other) and len(one) == 4
    for name, picture in one.items():
        np.testing.assert_array_equal(picture, other[name], err_msg=name)


def test_a_still_is_the_films_frame(place, whole):
    """Within a shot of the scene file: the same moments, focus and exposure."""
    values = dict(said.split("=", 1) for said in BLURRED[1::2])
    values |= {"shots": "[{camera: post, from: 4, to: 4.4}]", "output.half": "false"}
    job = load_job(place, values)
    still = render_still(job, Request(camera="post", spp=2), 4.2)
    film = place.parent / "exact.mp4"
    sets = [word for key, value in values.items() for word in ("--set", f"{key}={value}")]
    run("render", place, "--spp", "2", *sets, "-o", film)
    np.testing.assert_array_equal(still.radiance, frames_of(film)["000002.exr"])
    account = json.loads(film.with_suffix(".json").read_text(encoding="utf-8"))
    assert still.exposure == account["exposure"]


def test_the_account_names_lens_shutter_and_exposure(whole):
    account = json.loads(whole.with_suffix(".json").read_text(encoding="utf-8"))
    metering = account["metering"]
    assert metering["mode"] == "auto" and account["exposure"] == metering["metered"]
    assert account["shutter"] == {"open": 0.05, "rolling": 0.01}
    focus = [frame["camera"]["lens"]["focus"] for frame in account["frames"]]
    assert len(set(focus)) == 4  # it follows
    assert account["frames"][0]["camera"]["lens"]["aperture"] > 0.0


def test_moments_lie_on_the_smoothers_own_curves(place):
    """A car that drives at 10 m/s is 5 cm further at each of the shutter's 10 moments of 50 ms."""
    job = load_job(place, {"cameras.post.shutter": "{angle: 180, moments: 10}"})
    made = prepare(job, Request(camera="post", spp=10), frame_times(4, 5, 10))
    frame = made.frame_at(4.0)
    assert [moment.rows for moment in frame.exposure] == [(0.0, 1.0)] * 10
    times = [moment.frame.time for moment in frame.exposure]
    assert times == pytest.approx([4.0 + (k + 0.5) * 0.005 for k in range(10)])
    names = {mover.name for mover in frame.everyone if mover.id == "vehicle:v2"}
    for name in names:
        places = np.array(
            [
                next(m for m in moment.frame.everyone if m.name == name).world_from_body.position
                for moment in frame.exposure
            ]
        )
        np.testing.assert_allclose(np.diff(places[:, 0]), 0.05, atol=1e-3)
    name = next(name for name in names if name.endswith("/body"))
    moments = [moment.frame for moment in frame.exposure]
    ways = [
        next(m for m in one.everyone if m.name == name).world_from_body.position[0]
        for one in (frame, *moments)
    ]
    assert ways[0] == pytest.approx(np.mean(ways[1:]), abs=1e-3)


def test_a_film_all_around_tells_players_and_has_flow(place):
    film = place.parent / "round.mp4"
    lens = "{projection: equirectangular, stereo: top_bottom}"
    sets = ["--set", "cameras.post.lens.fov=360", "--set", f"cameras.post.lens={lens}"]
    sets += ["--set", "output.layers=[depth, flow, ids]", "--set", "output.size=[64, 64]"]
    run("render", place, "--camera", "post", *TIMES, *sets, "-o", film)
    assert Spherical(1, 0.0).boxes in film.read_bytes()
    flow, known = read_flow(film.with_suffix(".layers") / "flow" / "000000.png")
    assert known.mean() > 0.9
    # A camera at rest sees what stands where it was, in both eyes' pictures.
    still = (np.abs(flow).max(axis=-1) < 0.1).mean()
    assert still > 0.8


def test_what_cannot_be_is_said_before_any_work(place):
    lens = {"cameras.post.lens": "{projection: equirectangular, fov: 360}"}
    with pytest.raises(ConfigError, match=r"size: \[64, 32\]"):
        render_still(load_job(place, lens), Request(camera="post"), 4.0)
    manual = {"cameras.post.exposure": "manual"}
    with pytest.raises(ConfigError, match="f_number"):
        render_still(load_job(place, manual), Request(camera="post"), 4.0)
    both = {"cameras.post.lens.stereo": "side_by_side", "overlays": "{clock: {}}"}
    with pytest.raises(ConfigError, match="overlays"):
        render_still(load_job(place, both), Request(camera="post"), 4.0)


def test_sunny_sixteen(place):
    """At f/16 and 1/100 s at ISO 100, white is what a sunny day's white is."""
    by_hand = {
        "cameras.post.exposure": "manual",
        "cameras.post.shutter": "{time: 1/100 s}",
        "cameras.post.lens.f_number": "16",
    }
    made = prepare(load_job(place, by_hand), Request(camera="post"), frame_times(4, 5, 10))
    assert made.exposure == pytest.approx(0.06, abs=0.01)


def test_a_walkers_view_bobs_only_if_asked(place):
    """It walks at 1.2 m/s; its steps lift the eye by two centimetres at most."""
    heights = {}
    for bobbing in ("false", "true"):
        camera = f"{{mode: lagrangian, vehicle: p0, view: pedestrian, bobbing: {bobbing}}}"
        job = load_job(place, {"cameras.walker": camera})
        made = prepare(job, Request(camera="walker"), frame_times(4, 7, 25))
        views = [made.shot.frame_at(float(time)).view for time in made.times]
        heights[bobbing] = np.array([view.position[2] for view in views])
    assert np.ptp(heights["false"]) < 1e-3
    assert 0.03 < np.ptp(heights["true"]) < 0.041
    rises = heights["true"] - heights["false"]
    assert np.abs(np.diff(rises)).max() < 0.02


@pytest.mark.parametrize("view", ["truck_driver", "bus_passenger", "cyclist"])
def test_views_of_other_eyes_are_pictures(place, view):
    job = load_job(place, {"cameras.driver.view": view})
    still = render_still(job, Request(camera="driver", spp=1), 4.5)
    assert np.isfinite(still.radiance).all() and still.radiance.std() > 0.0
