"""Frame rates, slow motion and time-lapse; films as numbered pictures."""

from fractions import Fraction

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.exr import PROVENANCE, write_exr
from sumo3dviz_pt.inspection.checks import check_scene
from sumo3dviz_pt.model.numbers import in_short, ratio_of
from sumo3dviz_pt.pipeline.films.encoding import DevelopOrder, develop_frames
from sumo3dviz_pt.pipeline.films.film import FilmOrder, frames_folder, render_film, shots_of
from sumo3dviz_pt.pipeline.films.frames import check_sequence, film_name, is_sequence, numbered
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.production import Request, frame_times
from sumo3dviz_pt.pipeline.scene_file import load_job, make_job

NTSC = Fraction(30000, 1001)


def job_of(*shots, **output):
    cameras = {"a": {"mode": "eulerian", "position": [0, 0, 1], "heading": 0}}
    return make_job({"scenario": {}, "cameras": cameras, "shots": list(shots), "output": output})


def shot_of(**more):
    return {"camera": "a", "from": 0, "to": 2, **more}


# Ratios -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "exact", "short"),
    [
        ("30000/1001", NTSC, "30000/1001"),
        (29.97, Fraction(2997, 100), 29.97),
        ("29.97", Fraction(2997, 100), 29.97),
        (25, Fraction(25), 25),
        (" 1 / 4 ", Fraction(1, 4), 0.25),
        ("2.5/5", Fraction(1, 2), 0.5),
        (np.float64(12.5), Fraction(25, 2), 12.5),
    ],
)
def test_ratios_are_what_is_written(written, exact, short):
    assert ratio_of(written) == exact and in_short(exact) == short
    assert ratio_of(in_short(exact)) == exact


@pytest.mark.parametrize(
    "wrong", ["", "1/0", "0", -1, "1e9", True, "nan", float("inf"), "9" * 5000]
)
def test_what_is_no_ratio(wrong):
    with pytest.raises(ValueError, match="positive number or a ratio"):
        ratio_of(wrong)


def test_scene_files_keep_rates_exactly():
    assert job_of(fps="30000/1001").output.fps == NTSC
    assert job_of(fps=29.97).output.fps == Fraction(2997, 100)
    assert job_of(fps="30000/1001").output.model_dump(mode="json")["fps"] == "30000/1001"
    assert job_of(fps=25).output.model_dump(mode="json")["fps"] == 25
    for wrong in (0, -3, 241, "25/0", "fast", [25], None):
        with pytest.raises(ConfigError, match=r"output\.fps"):
            job_of(fps=wrong)


def test_the_schema_says_how_rates_are_written():
    from sumo3dviz_pt.job.settings import Job

    fps = Job.model_json_schema()["$defs"]["OutputSettings"]["properties"]["fps"]
    assert fps["anyOf"][0] == {"type": "number", "minimum": 0.01, "maximum": 240.0}
    assert fps["anyOf"][1]["type"] == "string" and ratio_of(fps["default"]) == 25


# Speed --------------------------------------------------------------------------------------


def test_slow_motion_has_more_frames_at_exact_times():
    plain = frame_times(460.0, 462.0, 25)
    slow = frame_times(460.0, 462.0, 25, Fraction(1, 4))
    assert (len(plain), len(slow)) == (50, 200)
    np.testing.assert_array_equal(slow[::4], plain)
    exact = [460.0 + float(n * Fraction(1, 4) / 25) for n in range(200)]
    np.testing.assert_array_equal(slow, exact)


def test_time_lapse_of_an_odd_rate():
    times = frame_times(0.0, 60.0, "30000/1001", Fraction(30))
    assert len(times) == 60 and times[59] == float(59 * 30 * Fraction(1001, 30000))


def test_shots_have_a_speed_and_the_command_wins():
    job = job_of(shot_of(speed=0.25), fps=10)
    (shot,) = job.shots
    assert Pace.of(job, shot) == Pace(Fraction(10), Fraction(1, 4))
    assert len(Pace.of(job, shot).times(shot)) == 80
    asked = Pace.of(job, shot, fps="30000/1001", speed="10")
    assert (asked.fps, asked.speed) == (NTSC, 10)
    assert asked.account() == {"fps": float(NTSC), "frame_rate": "30000/1001", "speed": 10.0}
    ((alone, _),) = shots_of(job, Request(camera="a"), FilmOrder(job_path()))
    assert alone.speed == Fraction(1, 4), "asked for by its camera it is the same film"


def job_path():
    from pathlib import Path

    return Path("x.mp4")


@pytest.mark.parametrize("speed", [0.01, 100, "1/4"])
def test_speeds_at_the_bounds(speed):
    assert job_of(shot_of(speed=speed)).shots[0].speed == ratio_of(speed)


@pytest.mark.parametrize("speed", [0.009, 101, 0, -1, "slow"])
def test_speeds_out_of_bounds(speed, tmp_path):
    with pytest.raises(ConfigError, match=r"shots\.0\.speed"):
        job_of(shot_of(speed=speed))
    with pytest.raises(ConfigError, match="speed"):
        render_film(job_of(shot_of()), Request(), FilmOrder(tmp_path / "a.mp4", speed=speed))


def test_check_counts_frames_at_the_shots_speed(tmp_path):
    scene = write_scenario(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("to: 5}", "to: 5, speed: 0.1}")
    scene.write_text(text, encoding="utf-8")
    assert check_scene(load_job(scene))["shots"][0]["frames"] == 100


# Numbered pictures --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "first", "film"),
    [
        ("drive_{frame}.png", "drive_000007.png", "drive.png"),
        ("drive_%06d.png", "drive_000007.png", "drive.png"),
        ("%04d.PNG", "0007.PNG", "{folder}.PNG"),
        ("d%d.png", "d7.png", "d.png"),
        ("{frame}-left.png", "000007-left.png", "left.png"),
    ],
)
def test_names_of_numbered_pictures(tmp_path, name, first, film):
    path = tmp_path / name
    assert is_sequence(path) and numbered(path, 7) == tmp_path / first
    assert film_name(path).name == film.replace("{folder}", tmp_path.name)
    check_sequence(path)


def test_other_names_are_films_as_before(tmp_path):
    for name in ("a.mp4", "a_{frame}.exr", "a%06d.mp4"):
        assert not is_sequence(tmp_path / name) and film_name(tmp_path / name) == tmp_path / name
    assert frames_folder(tmp_path / "d_{frame}.png") == tmp_path / "d.frames"
    with pytest.raises(ConfigError, match=r"such as .*drive_\{frame\}\.png"):
        check_sequence(tmp_path / "drive.png")


def test_pictures_of_a_film_need_a_number_before_any_work(tmp_path, capsys):
    scene = write_scenario(tmp_path)
    assert main(["render", str(scene), "-o", str(tmp_path / "a.png")]) == 2
    assert "a_{frame}.png" in capsys.readouterr().err
    assert main(["render", str(scene), "-o", str(tmp_path / "a.avi")]) == 2
    assert ".webm" in capsys.readouterr().err


def test_frames_develop_to_numbered_pictures(tmp_path):
    """With the frames' own numbers, of an odd size, each saying what it was made from."""
    from PIL import Image

    folder = tmp_path / "d.frames"
    folder.mkdir()
    for number in (3, 4):
        radiance = np.full((9, 15, 3), 0.1 * number, np.float32)
        write_exr(
            folder / f"{number:06d}.exr",
            {"radiance": radiance},
            attributes={PROVENANCE: '{"time": 7}'},
        )
    develop_frames(folder, DevelopOrder(tmp_path / "p_{frame}.png"))
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["p_000003.png", "p_000004.png"]
    with Image.open(tmp_path / "p_000004.png") as picture:
        assert picture.size == (15, 9) and '"time": 7' in picture.text["provenance"]
    with pytest.raises(ConfigError, match=r"p_000003\.png exists already"):
        develop_frames(folder, DevelopOrder(tmp_path / "p_{frame}.png"))
    develop_frames(folder, DevelopOrder(tmp_path / "p_{frame}.png", overwrite=True))
    develop_frames(folder, DevelopOrder(tmp_path / "d.gif", fps="25/2"))
    with Image.open(tmp_path / "d.gif") as film:
        assert (film.n_frames, film.info["duration"]) == (2, 80)
