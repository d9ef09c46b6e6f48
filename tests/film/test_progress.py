"""Films and stills tell what they do, from their first step on."""

import pytest
from builders import write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.model.progress import Doing, ProgressEvent, heard_by
from sumo3dviz_pt.pipeline.costs import spent
from sumo3dviz_pt.pipeline.films.film import FilmOrder, render_film
from sumo3dviz_pt.pipeline.live import render_still
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.steps import film_steps, still_steps

CHEAP = Request("post", "draft", (32, 18), 1)


def test_films_announce_every_step_that_is_expected_and_all_their_cpu_time(tmp_path):
    job = load_job(write_scenario(tmp_path, vehicles=2))
    order = FilmOrder(tmp_path / "film.mp4", start=4.0, end=4.3, fps=10)
    heard, before = [], spent()
    with heard_by(heard.append):
        (report,) = render_film(job, CHEAP, order)
    whole = spent() - before
    frames = [ProgressEvent(Doing.RENDER, done, 3) for done in range(4)]
    assert heard == [
        ProgressEvent(Doing.READ),
        ProgressEvent(Doing.BUILD),
        ProgressEvent(Doing.OPEN),
        *frames,
        ProgressEvent(Doing.ENCODE),
    ]
    expected = [step.doing for step in film_steps(job, CHEAP, order)]
    assert expected == list(dict.fromkeys(event.doing for event in heard))
    assert whole - 0.2 <= sum(report.cpu.values()) <= whole + 0.01


def test_what_is_resumed_is_not_expected_again(tmp_path):
    job = load_job(write_scenario(tmp_path, vehicles=2))
    order = FilmOrder(tmp_path / "film.mp4", start=4.0, end=4.2, fps=10, resume=True)
    costs = []
    for _ in range(2):
        costs.append(next(s for s in film_steps(job, CHEAP, order) if s.doing is Doing.RENDER))
        render_film(job, CHEAP, order)
    assert costs[0].seconds > 1 and costs[1].seconds == 0


def test_stills_announce_their_passes(tmp_path):
    job = load_job(write_scenario(tmp_path, vehicles=2))
    heard = []
    with heard_by(heard.append):
        render_still(job, CHEAP, 4.0)
    doings = list(dict.fromkeys(event.doing for event in heard))
    assert doings == [step.doing for step in still_steps(job, CHEAP)]
    assert heard[-1].done == heard[-1].total > 0


@pytest.mark.slow
def test_the_command_and_python_say_it_in_logs(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sumo3dviz_pt.pipeline.steps._PROGRESS_FIRST", 0.0)
    place = write_scenario(tmp_path, vehicles=2)
    small = ["--camera", "post", "--spp", "1", "--size", "32x18"]
    assert main(["still", str(place), "--time", "4", "-o", str(tmp_path / "a.png"), *small]) == 0
    out, err = capsys.readouterr()
    assert err.startswith("a.png: ") and "about 0:" in err
    assert "CPU-seconds" in out
    scene = sv.load(place)
    scene.still(time=4.0, camera="post", spp=1, size=(32, 18))
    assert capsys.readouterr().err == "", "neither a terminal nor a notebook"
    scene.still(time=5.5, camera="post", spp=1, size=(32, 18), progress=True)
    assert capsys.readouterr().err.startswith("still at 5.5 s: ")


def test_quiet_commands_say_nothing(tmp_path, capsys):
    place = write_scenario(tmp_path, vehicles=2)
    assert main(["-q", "check", str(place)]) == 0
    assert capsys.readouterr().err == ""
