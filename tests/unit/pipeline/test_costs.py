"""Forecasts of cost: `check --size --fps --quality` and `render --dry-run`."""

import json
from dataclasses import replace

import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.job.settings import OutputSettings
from sumo3dviz_pt.pipeline.conditions import MEASURED as BENCH
from sumo3dviz_pt.pipeline.conditions import film_cost, lacking
from sumo3dviz_pt.pipeline.costs import (
    GPU,
    PROCESSOR,
    cost_of,
    memory_forecast,
    rates_of,
    space_in_words,
    stages_of,
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
    assert base.memory_mb == memory_forecast(0.9216, 1_400_000) > memory_forecast(0.2, 1_000_000)
    assert threads() >= 1


def test_full_precision_takes_twice_the_disk():
    size = {"size": (1280, 720)}
    half, full = (
        film_cost(
            quality_preset("standard"),
            OutputSettings(**size, half=kept),
            triangles=1_400_000,
            frames=250,
            factor=1.0,
        )
        for kept in (True, False)
    )
    assert full == replace(half, frames_mb=2 * half.frames_mb)


def test_a_gpu_has_rates_of_its_own():
    def traced(preset, rates):
        quality = quality_preset(preset, together=True)
        stages = stages_of(quality, size=HD["size"], frames=1, rates=rates)
        return stages.trace

    # What the card took of a frame beside copying, which more samples do not change.
    more = traced("study", GPU).wall(16) - traced("standard", GPU).wall(16)
    assert more == pytest.approx(0.178 - 0.039, rel=0.1)
    assert traced("study", GPU).wall(16) == traced("study", GPU).wall(1), "cores do not matter"
    assert traced("study", PROCESSOR).wall(16) > 5 * traced("study", GPU).wall(16)
    assert rates_of("cuda") is GPU and rates_of("llvm") is rates_of("scalar") is PROCESSOR


@pytest.mark.parametrize(("preset", "frames"), [("standard", 250), ("standard", 3), ("study", 250)])
def test_films_pay_for_the_help_of_frames(preset, frames):
    quality = quality_preset(preset)
    alone, film = (
        cost_of(quality, **{**HD, "frames": count}).cpu_seconds_per_frame for count in (1, frames)
    )
    helped = PROCESSOR.help_of(quality, size=HD["size"], frames=frames)
    assert film - alone == pytest.approx(helped) and (helped > 0) == (quality.accumulate > 0)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        *[(42, "42 s"), (600, "10 min"), (5400, "1 h 30 min"), (19_100, "5 h 20 min")],
        *[(7200, "2 h"), (90_000, "25 h"), (3600 * 310, "13 days"), (3.6e7, "417 days")],
    ],
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
    assert "of CPU time" in said and "of memory" in said and "of the GPU" not in said
    assert main([*command, "--variant", "cuda"]) == 0
    said = capsys.readouterr().out
    assert "of GPU time" in said and "those of an H200; `sumo3dviz-pt doctor --frame`" in said
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


def test_a_dry_run_ends_where_the_log_ends(tmp_path, capsys):
    scene = write_scenario(tmp_path, end=5.0)
    command = ["render", str(scene), "--dry-run", "-o", str(tmp_path / "a.mp4")]
    assert main([*command, "--from", "4", "--to", "60"]) == 0
    said = capsys.readouterr()
    assert "frames  11, " in said.out, "ten frames a second, the last one at 5 s"
    assert "the log ends at 5 s, and the film with it: 11 frames instead of 560" in said.err


def test_a_farm_plans_no_frames_after_the_log(tmp_path, capsys):
    """Its tasks would be refused, one after the other."""
    scene = write_scenario(tmp_path, end=5.0)
    farm = ["farm", str(scene), "--dry-run", "-o", str(tmp_path / "a.mp4"), "--from", "4"]
    assert main([*farm, "--to", "60", "--task-frames", "8"]) == 0
    said = capsys.readouterr()
    assert "--frames 0:6 " in said.out and "--frames 6:11 " in said.out
    assert said.out.count("--frames") == 2
    assert "the log ends at 5 s, and the film with it: 11 frames instead of 560" in said.err


def test_pictures_beyond_all_memory_are_refused_in_one_sentence(tmp_path, capsys):
    scene = write_scenario(tmp_path)
    huge = ["--size", "16384x16384"]
    film = ["render", str(scene), "-o", str(tmp_path / "a.mp4"), *huge]
    still = ["still", str(scene), "--time", "4", "-o", str(tmp_path / "a.png"), *huge]
    for command in ([*film, "--dry-run"], film, still):
        assert main(command) == 2
        said = capsys.readouterr().err
        assert "16384x16384 need about 297" in said and "smaller --size" in said
        assert said.count("\n") == 1


def test_too_little_memory_or_disk_is_said(tmp_path):
    cost = cost_of(quality_preset("draft"), **HD)
    assert list(lacking(cost, tmp_path / "a.mp4")) == []
    memory, disk = (
        list(lacking(replace(cost, **{key: 1e9}), tmp_path / "new" / "a.mp4"))
        for key in ("memory_mb", "frames_mb")
    )
    assert "of memory, and this machine has" in memory[0] and len(memory) == 1
    assert "of disk" in disk[0] and "--discard-frames" in disk[0] and len(disk) == 1


def test_nights_and_weathers_are_counted_at_their_price(tmp_path, capsys):
    """The factors are those of the bench's file."""
    rows = {(*row["size"], row["hour"]): row for row in json.loads(BENCH.read_text())["rows"]}
    day, night = (rows[640, 360, hour] for hour in ("day", "night"))
    scene = write_scenario(tmp_path)
    costs = {}
    for name, settings in {
        "day": [],
        "night": ["--set", "lights=on"],
        "rain": ["--set", "weather.preset=rain"],
    }.items():
        assert main(["check", str(scene), "--json", "--quality", "draft", *settings]) == 0
        (shot,) = json.loads(capsys.readouterr().out)["shots"]
        costs[name] = shot["forecast"]["draft"]["cpu_seconds_per_frame"]
    assert costs["night"] / costs["day"] == pytest.approx(night["dry"] / day["dry"], rel=0.05)
    assert costs["rain"] / costs["day"] == pytest.approx(day["rain"] / day["dry"], rel=0.05)


def test_the_bench_writes_what_forecasts_read():
    from bench.weathers import rows_of

    lines = [
        "| hour | weather | picture | developing | frame | beside dry |",
        "|---|---|" + "--:|" * 4,
        "| day | dry | 1.50 | 0.40 | 1.90 | 1.00 |",
        "| day | drizzle | 1.50 | 0.40 | 1.90 | 1.00 |",
        "| night | fog | 2.60 | 0.40 | 3.00 | 1.04 |",
    ]
    assert rows_of(lines, (640, 360)) == [
        {"size": [640, 360], "hour": "day", "dry": 1.9},
        {"size": [640, 360], "hour": "night", "fog": 3.0},
    ]
    assert {(*row["size"], row["hour"]) for row in json.loads(BENCH.read_text())["rows"]} == {
        (*size, hour) for size in ((640, 360), (1280, 720)) for hour in ("day", "night")
    }
