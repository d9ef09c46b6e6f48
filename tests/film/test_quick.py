"""Quick pictures show what a film's frame shows, wherever the camera is."""

from dataclasses import replace

import numpy as np
import pytest
from builders import view_at, write_scenario

from sumo3dviz_pt.job.settings import CinematicCamera, LagrangianCamera
from sumo3dviz_pt.pipeline.live import Ground, Live, joined
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.viewer.client import Client, Mean, Projector
from sumo3dviz_pt.viewer.keyframes import ViewerEye
from sumo3dviz_pt.viewer.messages import Frame, GoTo, KeyFrameOrder
from sumo3dviz_pt.viewer.state import ViewerState, advanced, obeyed

SIZE, SMALL = (96, 54), (48, 27)
SAMPLES = 48

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    scene = write_scenario(tmp_path_factory.mktemp("quick"), vehicles=4, persons=1, trees=True)
    job = load_job(scene, {"output.size": f"[{SIZE[0]}, {SIZE[1]}]"})
    opened = Live(job, Ground.of(job), size=SMALL, variant="llvm")
    yield opened
    opened.close()


def sample_of(live, time, view, size, number):
    """A small picture, or a large one from its four parts."""
    cut = size[0] // SMALL[0]
    parts = [live.glimpse(time, view, number=number, part=(k, cut)) for k in range(cut**2)]
    return joined(parts)


def seen_by(live, time, view, size, count=SAMPLES):
    mean = Mean.of(sample_of(live, time, view, size, 0))
    for number in range(1, count):
        mean = mean.with_sample(sample_of(live, time, view, size, number))
    return mean.value


def mean_of(live, time, view, size, count=SAMPLES):
    live.show(live.frame_at(time, view))
    return seen_by(live, time, view, size, count)


def blurred(pixels):
    """Means of 3 x 3 pixels: what noise of some samples leaves."""
    height, width = (side // 3 * 3 for side in pixels.shape[:2])
    cut = pixels[:height, :width].astype(float)
    return cut.reshape(height // 3, 3, width // 3, 3, 3).mean(axis=(1, 3))


def test_it_shows_what_a_still_shows(live):
    """Levels of detail differ in nothing here; what is left is noise, and no bias."""
    time, view = live.ground.begin + 4.0, live.home
    still = live.still(time, view, quality="standard")
    shown = live.develop(mean_of(live, time, view, SIZE), view)
    off = blurred(shown) - blurred(still)
    assert abs(off.mean()) < 1.0 and np.sqrt((off**2).mean()) < 8.0
    assert blurred(still).std() > 15.0, "there is something to see"


@pytest.mark.parametrize("eyes", [None, [[0.0, 0.0, 5.0]], [[9e3, 0.0, 5.0]]])
def test_room_is_made_once_for_who_comes_later(live, eyes):
    """A body that nobody thought of lacks room until the scene is built again, and then no more,
    not even where nobody looks."""
    everyone = replace(live.ground, growing=eyes is not None)
    (walker,) = (each for each in everyone.trajectories if each.kind == "person")
    looks = {"models": {"pedestrian": ["woman_bob"]}, "by_id": {walker.id: {"model": "man_suit"}}}
    job = type(live.job).model_validate({**live.job.model_dump(), "vehicles": looks})
    drivers = tuple(each for each in everyone.trajectories if each.kind == "vehicle")
    few = replace(live.ground, trajectories=drivers)
    opened = Live(job, few, size=SMALL, variant="llvm")
    try:
        assert opened.carry_on(opened.carried_on(everyone))
        opened.rebuild(eyes=None if eyes is None else np.array(eyes))
        assert not opened.carry_on(opened.carried_on(everyone))
        frame = opened.frame_at(walker.pieces[0].begin + 1.0, opened.home)
        assert walker.key in {mover.id for mover in (*frame.deforming, *frame.far)}
    finally:
        opened.close()


def test_all_sizes_show_the_same(live):
    time, view = live.ground.begin + 4.0, live.home
    large, small = (mean_of(live, time, view, size) for size in (SIZE, SMALL))
    ratios = {name: large[name].mean(axis=(0, 1)) / small[name].mean(axis=(0, 1)) for name in small}
    # A few distances near the horizon make up most of the mean of all.
    most = {"radiance": 0.01, "hit": 0.01, "depth": 0.15}
    assert {name: np.abs(ratios[name] - 1.0).max() < most[name] for name in most} == dict.fromkeys(
        ratios, True
    )


def test_parts_join_without_a_seam(live):
    """Across the cuts, pixels differ no more than elsewhere, and each part is where it belongs."""
    time, view = live.ground.begin + 4.0, live.home
    large, small = (mean_of(live, time, view, size)["radiance"] for size in (SIZE, SMALL))
    halves = large.reshape(SMALL[1], 2, SMALL[0], 2, 3).mean(axis=(1, 3))
    apart = np.abs(halves - small).mean(axis=2)
    height, width = apart.shape
    for corner in (apart[: height // 2, : width // 2], apart[height // 2 :, width // 2 :]):
        assert corner.mean() < 0.25 * small.std()
    for turned in (halves[::-1], halves[:, ::-1]):
        assert np.abs(turned - small).mean() > 1.5 * apart.mean(), "a mirrored one would not fit"


def test_a_moved_camera_sees_from_its_new_place(live):
    """Only the sensor changes, and the picture is that of the new view."""
    time, home = live.ground.begin + 4.0, live.home
    there = view_at(tuple(home.position + np.array([6.0, 4.0, 3.0])), heading=200.0, pitch=-20.0)
    live.show(live.frame_at(time, home))
    moved = seen_by(live, time, there, SIZE, count=16)
    fresh = mean_of(live, time, there, SIZE, count=16)
    for name in ("depth", "hit"):
        np.testing.assert_allclose(moved[name], fresh[name], rtol=1e-3, atol=2e-2)


def test_distances_are_those_of_the_scene(live):
    """Straight down from 50 m above the street, the ground is 50 m away."""
    x, y, _ = live.home.position
    ground = live.ground_at(live.home.position)
    down = view_at((x, y, ground + 50.0), pitch=-90.0)
    seen = mean_of(live, live.ground.begin, down, SIZE, count=4)
    depth = np.median(seen["depth"] / np.maximum(seen["hit"], 1e-6))
    assert depth == pytest.approx(50.0, rel=0.12) and seen["hit"].min() == 1.0


def test_the_same_sample_is_the_same_picture(live):
    time, view = live.ground.begin + 1.0, live.home
    live.show(live.frame_at(time, view))
    one, other, next_one = (live.glimpse(time, view, number=n) for n in (3, 3, 4))
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])
    assert (one["radiance"] != next_one["radiance"]).any()


def test_a_clean_picture_keeps_its_light(live):
    time, view = live.ground.begin + 4.0, live.home
    mean = mean_of(live, time, view, SIZE, count=16)
    raw, clean = (live.develop(mean, view, smooth=smooth) for smooth in (False, True))
    assert abs(clean.mean() / raw.mean() - 1.0) < 0.03
    assert (
        np.abs(np.diff(clean.astype(float), axis=1)).mean()
        < np.abs(np.diff(raw.astype(float), axis=1)).mean()
    )


def test_nobody_is_there_without_traffic(live):
    time, view = live.ground.begin + 4.0, live.home
    with_all = mean_of(live, time, view, SIZE, count=8)
    live.show(live.frame_at(time, view, dynamic=False))
    alone = seen_by(live, time, view, SIZE, count=8)
    assert np.abs(with_all["radiance"] - alone["radiance"]).max() > 0.1


@pytest.mark.parametrize("away", [(0.0, 0.0, 1e3), (4e3, 4e3, 50.0), (0.0, 0.0, -30.0)])
def test_far_and_odd_places_give_finite_pictures(live, away):
    view = view_at(tuple(live.home.position + np.array(away)), pitch=-10.0)
    live.show(live.frame_at(live.ground.begin, view))
    seen = live.glimpse(live.ground.begin, view, number=0)
    assert all(np.isfinite(layer).all() and (layer >= 0.0).all() for layer in seen.values())
    assert live.develop(seen, view).dtype == np.uint8


def test_who_loses_a_ride_keeps_his_switches(live):
    """The vehicle is gone: the camera stays where it was, and so does all that was chosen."""
    ride = LagrangianCamera(mode="lagrangian", vehicle="v1", view="chase")
    chosen = {"dynamic": False, "denoise": True, "exposure": 1.5}
    gone = live.life_of(ride)[1] + 1.0
    told = []
    client = Client(
        ViewerState(ViewerEye.of(live.home), gone, playing=True, ride=ride, **chosen),
        told.append,
        wake=lambda: None,
        leave=lambda _: None,
    )
    Projector(live, SIZE).picture(client)
    state = client.state
    assert {name: getattr(state, name) for name in chosen} == chosen
    assert state.ride is None and not state.playing and state.time == gone
    assert any("v1" in str(m.content) for m in told if not isinstance(m, Frame))
    assert any(isinstance(message, Frame) for message in told)


def test_going_to_a_flight_keeps_key_frames_that_are_not_saved(live, monkeypatch):
    keys = [
        {"time": 1.0, "position": (0, 0, 9), "heading": 10},
        {"time": 2.0, "position": (9, 0, 9), "heading": 10},
    ]
    flight = CinematicCamera.model_validate({"mode": "cinematic", "keyframes": keys})
    job = live.job.model_copy(update={"cameras": {**live.job.cameras, "flight": flight}})
    monkeypatch.setattr(live, "job", job)
    go, add = GoTo(do="camera", name="flight"), KeyFrameOrder(do="keyframe", act="add")
    there = obeyed(go, ViewerState(ViewerEye.of(live.home), 5.0), live)
    assert there.time == 1.0 and there.eye.position.tolist() == [0, 0, 9]
    assert [frame.time for frame in there.frames] == [1.0, 2.0]
    assert obeyed(go, there, live).frames == there.frames
    dropped = obeyed(add, ViewerState(ViewerEye.of(live.home), 5.0), live)
    back = obeyed(go, dropped, live)
    assert back.frames == dropped.frames and back.time == 1.0


def test_playing_shows_the_films_frames_and_loses_no_time(live):
    begin, end, step = live.ground.begin, live.ground.end, 1.0 / float(live.job.output.fps)
    state = ViewerState(ViewerEye.of(live.home), begin, playing=True)
    passed = 0.0
    for seconds in (0.013, 0.21, 0.0, 0.034, 0.0799, 0.004):
        state, passed = advanced(state, seconds, live), passed + seconds
        number = (state.time - begin) / step
        assert number == pytest.approx(round(number), abs=1e-6)
        assert 0.0 <= begin + passed - state.time < step + 1e-9
        assert state.time == live.frame_before(state.time)
    state = advanced(state, end, live)
    assert (state.time, state.playing) == (end, False)


def test_playing_goes_on_from_any_time_and_never_backwards(live):
    between = live.ground.begin + 0.3 / float(live.job.output.fps)
    state = ViewerState(ViewerEye.of(live.home), between, playing=True)
    times = [(state := advanced(state, 0.005, live)).time for _ in range(20)]
    assert times[0] == between and times == sorted(times)
    assert times[-1] == live.frame_before(between + 0.1)
