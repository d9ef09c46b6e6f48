"""Frame times are exact, and everyone in the log at that time is there."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from builders import write_scenario
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.camera import INSTANT, Shutter
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.orders import FilmOrder, shots_of, wanted_frames
from sumo3dviz_pt.pipeline.production import Request, frame_times, life_of, prepare, read
from sumo3dviz_pt.pipeline.scene_file import load_job, make_job
from sumo3dviz_pt.pipeline.worlds import world_of
from sumo3dviz_pt.shot.crowd import FAR_END
from sumo3dviz_pt.shot.road_users import everyone


@pytest.mark.parametrize("fps", [25, 29.97, 60, 23.976])
@pytest.mark.parametrize("start", [0.0, 4.0, 455.0, 28800.1])
def test_frames_lie_at_start_plus_n_over_fps(fps, start):
    times = frame_times(start, start + 20, fps)
    exact = [Fraction(start) + n / Fraction(str(fps)) for n in range(len(times))]
    assert max(abs(Fraction(float(t)) - e) for t, e in zip(times, exact, strict=True)) < 1e-9
    assert times[0] == start and times[-1] < start + 20
    assert times[-1] + 1.001 / fps >= start + 20


@pytest.mark.parametrize(
    ("start", "end", "fps", "count"),
    [(0, 2, 25, 50), (0, 0.04, 25, 1), (4.1, 6.1, 10, 20), (0.1, 0.4, 10, 3), (0, 1, 29.97, 30)],
)
def test_number_of_frames(start, end, fps, count):
    assert len(frame_times(start, end, fps)) == count


@given(st.floats(0, 1e5), st.floats(0.1, 60), st.sampled_from([12, 24, 25, 29.97, 50, 60]))
def test_any_window(start, length, fps):
    times = frame_times(start, start + length, fps)
    assert len(times) >= 1 and times[0] == start and times[-1] < start + length + 1e-6
    assert abs(len(times) - length * fps) < 1 + 1e-3


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("fps", [25, 29.97, 60])
def test_every_vehicle_of_the_log_is_in_the_frame(tmp_path, step, fps):
    scene = write_scenario(tmp_path, step=step, vehicles=40, persons=3)
    job = load_job(scene)
    times = frame_times(4.0, 4.5, fps)
    shot = prepare(job, Request(camera="post"), times).shot
    files, scenario, trajectories = read(job)
    fleet = everyone(world_of(scenario, job, files), trajectories)
    assert len(fleet.keys) == 43
    for number, time in enumerate(times):
        frame = shot.frame_at(float(time))
        assert abs(frame.time - (4.0 + number / fps)) < 1e-9
        drawn = [mover.id for mover in frame.everyone if not mover.part]
        assert len(drawn) == len(set(drawn))
        camera = frame.view.world_from_camera.matrix[:3, :3]
        for mover in fleet.movers_at(float(time)):
            x, y, z = (mover.world_from_body.position - frame.view.position) @ camera
            half = frame.view.lens.half_width
            seen = x > 0 and abs(y / x) < half and abs(z / x) < half * 36 / 64
            if seen and np.linalg.norm([x, y, z]) < FAR_END:
                assert mover.id in drawn


def test_fronts_are_where_the_log_has_them(tmp_path):
    scene = write_scenario(tmp_path, step=1.0, vehicles=4)
    shot = prepare(load_job(scene), Request(camera="post"), frame_times(4, 6, 10)).shot
    for time in (4.0, 4.7, 5.5):
        for index, mover in enumerate(shot.fleet.movers_at(time)):
            x, y, _ = mover.world_from_body.position
            assert x == pytest.approx(-40 + 18 * (index // 2) + 10 * time, abs=1e-6)
            assert y == pytest.approx(-4.8 + 3.2 * (index % 2), abs=1e-6)
            np.testing.assert_allclose(
                mover.world_from_body.matrix[:3, 0] @ [0, 1, 0], 0, atol=1e-9
            )


@pytest.mark.slow
def test_slots_suffice_for_every_frame_of_a_film(tmp_path):
    scene = write_scenario(tmp_path, vehicles=80, persons=4)
    times = frame_times(0, 12, 10)
    shot = prepare(load_job(scene), Request(camera="driver"), times).shot
    for time in times:
        frame = shot.frame_at(float(time))
        for kind, movers in (("near", frame.movers), ("far", frame.far)):
            room = getattr(shot.data.slots, kind)
            for name in {mover.prototype for mover in movers}:
                assert sum(mover.prototype == name for mover in movers) <= room[name]
                assert name in shot.data.prototypes


@pytest.mark.slow
def test_a_part_of_a_film_has_the_same_slots_and_frames(tmp_path):
    """Law 1: what a frame shows does not depend on the frames around it."""
    scene = write_scenario(tmp_path, vehicles=20)
    job = load_job(scene)
    whole = prepare(job, Request(camera="driver"), frame_times(2, 8, 10)).shot
    for time in (2.0, 5.3, 7.9):
        alone = prepare(job, Request(camera="driver"), np.array([time])).shot.frame_at(time)
        there = whole.frame_at(time)
        np.testing.assert_allclose(
            alone.view.world_from_camera.matrix, there.view.world_from_camera.matrix, atol=1e-9
        )
        assert [m.id for m in alone.movers] == [m.id for m in there.movers]
        for mine, other in zip(alone.movers, there.movers, strict=True):
            assert (mine.prototype, mine.colour) == (other.prototype, other.colour)
            np.testing.assert_allclose(
                mine.world_from_body.matrix, other.world_from_body.matrix, atol=1e-9
            )


def test_a_frame_shows_the_middle_of_its_exposure(tmp_path):
    """Cameras are instant; a shutter that stays open shows all of them in one moment, too."""
    scene = write_scenario(tmp_path, vehicles=4)
    shot = prepare(load_job(scene), Request(camera="driver"), frame_times(4, 5, 10)).shot
    assert shot.camera.shutter == INSTANT and shot.frame_at(4.1).time == 4.1
    camera = replace(shot.camera, shutter=Shutter(0.1, 0.3))
    frame, instant = replace(shot, camera=camera).frame_at(4.1), shot.frame_at(4.1 + 0.2)
    assert frame.time == pytest.approx(4.3)
    np.testing.assert_allclose(
        frame.view.world_from_camera.matrix, instant.view.world_from_camera.matrix, atol=1e-9
    )
    for mine, other in zip(frame.everyone, instant.everyone, strict=True):
        np.testing.assert_allclose(
            mine.world_from_body.matrix, other.world_from_body.matrix, atol=1e-9
        )


# Orders -------------------------------------------------------------------------------------


def job_with(*shots):
    cameras = {
        name: {"mode": "eulerian", "position": [0, 0, 1], "heading": 0} for name in ("a", "b")
    }
    return make_job({"scenario": {}, "cameras": cameras, "shots": list(shots)})


A, B = {"camera": "a", "from": 0, "to": 2}, {"camera": "b", "from": 1, "to": 3}


def test_shots_get_their_names(tmp_path):
    found = shots_of(job_with(A, B), Request(), FilmOrder(tmp_path / "x_{shot}.mp4"))
    assert [(shot.camera, path.name) for shot, path in found] == [
        ("a", "x_1_a.mp4"),
        ("b", "x_2_b.mp4"),
    ]


@pytest.mark.parametrize(
    ("camera", "times", "name"),
    [
        ("a", {}, "x_1_a.mp4"),
        ("b", {}, "x_2_b.mp4"),
        ("b", {"start": 0.5}, "x_2_b.mp4"),
        (None, {"start": 0.5}, "x_1_a.mp4"),
        ("top: left/right", {"start": 0.5, "end": 1.0}, "x_top- left-right.mp4"),
    ],
)
def test_one_camera_gets_its_name_too(tmp_path, camera, times, name):
    """`{shot}` stood in the film's name."""
    job = job_with(A, B)
    extra = {"top: left/right": job.cameras["a"]}
    job = job.model_copy(update={"cameras": {**job.cameras, **extra}})
    order = FilmOrder(tmp_path / "x_{shot}.mp4", **times)
    ((_, path),) = shots_of(job, Request(camera=camera), order)
    assert path == tmp_path / name


@pytest.mark.parametrize(
    ("shots", "camera", "times", "words"),
    [
        ((A, B), None, {}, "2 shots; put {shot}"),
        ((), None, {}, "no shots"),
        ((A,), "b", {}, "no shot of 'b'; give --from and --to"),
        ((A,), "c", {}, "known: a, b"),
        ((A,), "a", {"start": 3.0}, "to: 2 s must be later than --from, 3 s"),
    ],
)
def test_wrong_orders(tmp_path, shots, camera, times, words):
    with pytest.raises(ConfigError, match=words):
        shots_of(job_with(*shots), Request(camera=camera), FilmOrder(tmp_path / "x.mp4", **times))


def test_the_command_wins_over_the_shots(tmp_path):
    order = FilmOrder(tmp_path / "x.mp4", start=0.5)
    ((shot, _),) = shots_of(job_with(A, B), Request(camera="b"), order)
    assert (shot.camera, shot.start, shot.end) == ("b", 0.5, 3)


def test_wanted_frames():
    assert list(wanted_frames(None, 3)) == [0, 1, 2]
    assert list(wanted_frames((1, 3), 3)) == [1, 2]
    for wrong in ((0, 4), (2, 2), (3, 1)):
        with pytest.raises(ConfigError, match="does not lie within 0:3"):
            wanted_frames(wrong, 3)


def test_places_of_frames(tmp_path):
    folder = frames_folder(tmp_path / "film.a.mp4")
    assert folder == tmp_path / "film.a.frames"
    assert frame_file(folder, 12).name == "000012.exr"


def test_life_of_cameras(tmp_path):
    job = load_job(write_scenario(tmp_path, end=9.0))
    _, scenario, trajectories = read(job)
    for name in ("post", "driver"):
        assert life_of(job.cameras[name], trajectories) == (0.0, 9.0)
    fleet = build_fleet(trajectories, scenario.vehicle_types, job.vehicles, seed=1)
    assert len(fleet.keys) == 6
    with pytest.raises(ConfigError, match="nobody moves"):
        life_of(job.cameras["post"], ())


@pytest.mark.slow
def test_a_production_key_knows_what_pixels_depend_on(tmp_path):
    scene = write_scenario(tmp_path)
    job, times = load_job(scene), frame_times(4, 5, 10)

    def key(request=None, **changes):
        asked = request or Request()
        return prepare(job.model_copy(update=changes), asked, times).key

    base = key()
    assert base == key()
    assert base == key(shots=()) == key(Request(variant="scalar"))
    different = [
        key(seed=9),
        key(Request(spp=7)),
        key(Request(size=(32, 18))),
        key(Request(camera="driver")),
        key(Request(quality="preview")),
    ]
    assert len({base, *different}) == 1 + len(different)
    log = tmp_path / "fcd.xml"
    log.write_text(log.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert key() != base
