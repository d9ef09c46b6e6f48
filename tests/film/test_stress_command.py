"""`check --stress` on a small scene: real pictures at its edges, judged."""

import json

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.catalog import template_names
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.model.progress import Doing, heard_by
from sumo3dviz_pt.pipeline.production import Request, frame_times, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.report.stress.cases import Case
from sumo3dviz_pt.report.stress.stress import StressOrder, put_under_stress, under_sky

pytestmark = pytest.mark.slow


def stressed(place, *more):
    """Arguments of the command."""
    return ["check", str(place), "--stress", *more]


def only(*names):
    return [word for name in names for word in ("--only", name)]


def test_a_small_scene_stands_its_edges(tmp_path, capsys):
    place = write_scenario(tmp_path, vehicles=4, signals=True)
    cases = only("sun at -18 deg", "sun at 0 deg", "sun disc*30 deg", "camera*", "road at*")
    cases += only("field*", "*moment*", "most*", "nobody*", "picture of [18]x*", "film*")
    assert main(stressed(place, "--json", *cases)) == 0
    out, err = capsys.readouterr()
    report = json.loads(out)
    verdicts = {entry["name"]: entry["verdict"] for entry in report["outcomes"]}
    assert set(verdicts.values()) == {"ok", "left out"}
    assert [name for name, verdict in verdicts.items() if verdict == "left out"] == [
        "nobody on the road"
    ]
    assert report["camera"] == "post" and report["time"] == 4.0
    assert err.startswith("scene.yaml: ") and "note" not in err
    assert f"of {len(verdicts)}, about" in err


def test_a_log_of_nobody_says_what_it_leaves_out(tmp_path, capsys):
    place = write_scenario(tmp_path, vehicles=0)
    assert main(stressed(place, *only("camera inside*", "nobody*", "most*"))) == 0
    words = capsys.readouterr().out
    assert "nobody is on the road at the shot's time" in words
    assert "1 ok, 0 failed, 2 left out" in words


def test_a_driver_is_put_under_stress(tmp_path, capsys):
    place = write_scenario(tmp_path, vehicles=2)
    arguments = only("the shot itself", "first moment*", "exposure [+-]10 EV", "4096*")
    assert main(stressed(place, "--camera", "driver", "--time", "5", *arguments)) == 0
    words = capsys.readouterr().out
    assert words.startswith("shot driver at 5 s") and "5 ok" in words


@pytest.mark.parametrize(("camera", "hour"), [("post", "day"), ("driver", "night")])
def test_every_weather_stands(tmp_path, capsys, camera, hour):
    """A post by day and a driver by night: each weather meets both suns and both eyes."""
    place = write_scenario(tmp_path, vehicles=3, signals=True, trees=True)
    cases = only(f"* by {hour}")
    assert main(stressed(place, "--camera", camera, "--time", "5", "--json", *cases)) == 0
    outcomes = json.loads(capsys.readouterr().out)["outcomes"]
    expected = {f"{name} by {hour}" for name in template_names("weather")}
    assert {one["name"] for one in outcomes if one["verdict"] == "ok"} == expected


def test_a_failure_is_said_once_and_ends_in_one(tmp_path, capsys):
    """Half precision is too coarse for a moonless night that is lifted by seven stops."""
    place = write_scenario(tmp_path, vehicles=2)
    lifted = ["--set", "output.exposure=7", *only("sun at -18 deg")]
    assert main(stressed(place, *lifted)) == 1
    out, err = capsys.readouterr()
    assert "failed" in out and "of 255 codes" in out
    assert "sumo3dviz-pt: 1 of 1 cases failed" in err
    assert main(stressed(place, "--set", "output.half=false", *lifted)) == 0


def test_an_error_is_a_finding_and_the_rest_goes_on(tmp_path):
    """A lens that no camera takes stands for whatever a scene leads astray."""
    job = load_job(write_scenario(tmp_path, vehicles=2))
    cases = [Case("odd", "eye", fov=1.0), Case("odd too", "eye", fov=1.0), Case("fine")]
    events = []
    with heard_by(events.append):
        report = put_under_stress(job, StressOrder(), cases=cases)
    assert [outcome.verdict for outcome in report.outcomes] == ["failed", "failed", "ok"]
    assert all("fov" in outcome.why for outcome in report.outcomes[:2])
    measured = [each for each in events if each.doing is Doing.MEASURE]
    assert [(each.what, each.done, each.total) for each in measured][-1] == ("fine", 3, 3)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--only", "suns"], "no case is called"),
        (["--camera", "pots"], "did you mean 'post'"),
        (["--time", "1000"], "the log goes from"),
        (["--set", "output.tone=neutrl"], "did you mean 'neutral'"),
    ],
)
def test_wrong_wishes_end_in_two(tmp_path, capsys, more, words):
    assert main(stressed(write_scenario(tmp_path), *more)) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(("elevation", "built_again"), [(8, False), (-4, True)])
def test_another_sky_is_the_one_that_the_scene_file_would_give(tmp_path, elevation, built_again):
    """Swapping the sky of a shot gives the picture of a scene with that sky and its lamps."""
    place = write_scenario(tmp_path, vehicles=2, signals=True)
    sky = f"{{sun: {{azimuth: 120, elevation: {elevation}}}}}"
    times = frame_times(4.0, 4.1, 10)
    request = Request("post", "draft", (32, 18))
    direct = prepare(load_job(place, {"sky": sky}), request, times)
    base = prepare(load_job(place), request, times)
    swapped = under_sky(base, direct.job.sky)
    assert (swapped.shot.fleet is not base.shot.fleet) == built_again
    assert swapped.exposure == direct.exposure
    pictures = []
    for production in (direct, swapped):
        with opened(production) as session:
            pictures.append(session.render(production.shot.frame_at(4.0)).radiance)
    assert np.array_equal(*pictures)
