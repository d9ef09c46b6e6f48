"""Forecasts of cost: `check --size --fps --quality` and `render --dry-run`."""

import json

import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.progress.costs import (
    cost_of,
    help_cost,
    memory_forecast,
    space_in_words,
    threads,
    time_in_words,
)
from sumo3dviz_pt.pipeline.scene_file import quality_preset

HD = {"size": (1280, 720), "triangles": 1_400_000, "frames": 250, "cores": 2}

MEASURED = {
    # `ronda`, overview: CPU-seconds of a later frame, megabytes of half-precision frames.
    ("draft", (1280, 720)): (5.1, 8.2),
    ("preview", (1280, 720)): (5.8, 8.2),
    ("standard", (1280, 720)): (12.7, 8.2),
    ("study", (1280, 720)): (33.7, 8.2),
}


@pytest.mark.parametrize(("preset", "size"), MEASURED)
def test_forecasts_are_near_what_was_measured(preset, size):
    cost = cost_of(quality_preset(preset, together=True), **{**HD, "size": size})
    seconds, megabytes = MEASURED[preset, size]
    assert cost.cpu_seconds_per_frame == pytest.approx(seconds, rel=0.25)
    assert cost.frames_mb == pytest.approx(250 * megabytes, rel=0.15)


def test_costs_grow_as_they_must():
    def cost(preset="standard", **changes):
        return cost_of(quality_preset(preset), **{**HD, **changes})

    base = cost()
    assert cost("study").cpu_hours > 2 * base.cpu_hours > 2 * cost("draft").cpu_hours
    twice = cost(frames=500)
    assert twice.frames_mb == 2 * base.frames_mb and twice.film_mb == 2 * base.film_mb
    assert 1.8 * base.wall_seconds < twice.wall_seconds < 2 * base.wall_seconds
    assert base.wall_seconds < 3600 * base.cpu_hours < 2.01 * base.wall_seconds
    assert cost(cores=1).wall_seconds == pytest.approx(3600 * base.cpu_hours)
    assert cost(half=False).frames_mb == 2 * base.frames_mb
    assert base.memory_mb == memory_forecast(0.9216, 1_400_000) > memory_forecast(0.2, 1_000_000)
    assert threads() >= 1


@pytest.mark.parametrize(("preset", "frames"), [("standard", 250), ("standard", 3), ("study", 250)])
def test_films_pay_for_the_help_of_frames(preset, frames):
    quality = quality_preset(preset)
    alone, film = (
        cost_of(quality, **{**HD, "frames": count}).cpu_seconds_per_frame for count in (1, frames)
    )
    helped = help_cost(quality, size=HD["size"], frames=frames)
    assert film - alone == pytest.approx(helped) and (helped > 0) == (quality.accumulate > 0)


@pytest.mark.parametrize(
    ("seconds", "words"), [(42, "42 s"), (600, "10 min"), (5400, "1.5 h"), (90_000, "25.0 h")]
)
def test_times_in_words(seconds, words):
    assert time_in_words(seconds) == words


def test_spaces_in_words():
    assert [space_in_words(mb) for mb in (0.2, 640, 3170)] == ["1 MB", "640 MB", "3.2 GB"]


def test_check_forecasts_what_was_asked(tmp_path, capsys):
    scene = write_scenario(tmp_path)
    asked = ["--size", "1920x1080", "--fps", "30000/1001", "--quality", "study"]
    assert main(["check", str(scene), "--json", *asked]) == 0
    (shot,) = json.loads(capsys.readouterr().out)["shots"]
    assert shot["size"] == [1920, 1080] and shot["fps"] == "30000/1001" and shot["frames"] == 30
    (name, cost), *others = shot["forecast"].items()
    assert name == "study" and not others
    assert set(cost) >= {"cpu_hours", "wall_seconds", "memory_mb", "frames_mb", "film_mb"}
    assert main(["check", str(scene), *asked]) == 0
    words = capsys.readouterr().out
    assert "30 frames of 1920x1080, 30000/1001 a second" in words
    assert "time here" in words and "memory" in words and "draft" not in words
    assert main(["check", str(scene), "--quality", "studdy"]) == 2
    assert "did you mean 'study'" in capsys.readouterr().err


def test_a_dry_run_says_what_would_be_done_and_does_nothing(tmp_path, capsys):
    scene = write_scenario(tmp_path)
    frames = tmp_path / "slow.frames"
    frames.mkdir()
    (frames / "000003.exr").write_bytes(b"")
    before = sorted(tmp_path.rglob("*"))
    command = ["render", str(scene), "--dry-run", "-o", str(tmp_path / "slow.mp4")]
    assert main([*command, "--speed", "0.5", "--size", "320x180"]) == 0
    said = capsys.readouterr().out
    assert "shot    post, 4 to 5 s, speed 0.5" in said
    assert "frames  20, 320x180, 10 a second, draft" in said
    assert "there   1 of these frames in" in said and "the film does not exist" in said
    assert "CPU-hours" in said and "of memory" in said
    assert sorted(tmp_path.rglob("*")) == before
    assert main([*command, "--frames", "5:8"]) == 0
    assert "frames  3 from number 5" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "said"),
    [(("--fps", "0"), "ratio"), (("--frames", "5:99"), "0:10"), (("--size", "63x36"), "even")],
)
def test_a_dry_run_refuses_what_render_would(tmp_path, capsys, options, said):
    scene = write_scenario(tmp_path)
    command = ["render", str(scene), "--dry-run", "-o", str(tmp_path / "a.mp4"), *options]
    assert main(command) == 2
    assert said in capsys.readouterr().err
