"""`check --motion` and `motion`, on small scenarios and on the shipped examples."""

import json

import pytest
from builders import complaints, write_scenario
from matplotlib import image

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.report import machine


def checked(scene, capsys, *more):
    """The report as JSON."""
    assert main(["check", str(scene), "--motion", "--json", *more]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_small_log_in_words(tmp_path, capsys):
    scene = write_scenario(tmp_path, vehicles=4, persons=2)
    assert main(["check", str(scene), "--motion"]) == 0
    words = capsys.readouterr().out
    assert "0 to 12 s every 1 s: 4 vehicles, 2 persons" in words
    assert "births   0 within the log; deaths 0" in words
    assert "0 frames with a jump" in words and "gap" not in words


@pytest.mark.parametrize("smoother", ["lane", "hermite", "linear"])
def test_steady_cars_do_nothing_that_is_reported(smoother, tmp_path, capsys):
    scene = write_scenario(tmp_path, vehicles=4)
    report = checked(scene, capsys, "--set", f"motion.smoother={smoother}")
    assert report["smoother"] == smoother and report["fps"] == 10.0
    (group,) = report["groups"]
    assert group["kind"] == "vehicle" and group["users"] == 4 and group["broken"] == 0
    limits = {"acceleration": 0.5, "jerk": 10.0, "heading rate": 0.1}
    for extreme in group["extremes"]:
        if extreme["name"] in limits:
            worst = max(abs(each["value"]) for each in extreme["worst"])
            assert worst < limits[extreme["name"]], extreme["name"]
    assert group["jumps"] == 0


def test_what_the_founding_method_does_at_the_ends_is_reported(tmp_path, capsys):
    """Its windows pull the first and last positions inwards."""
    scene = write_scenario(tmp_path, vehicles=2)
    report = checked(scene, capsys, "--set", "motion.smoother=paper")
    acceleration = report["groups"][0]["extremes"][0]
    assert abs(acceleration["worst"][0]["value"]) > 10.0
    assert acceleration["worst"][0]["time"] in (
        pytest.approx(0.4, abs=1),
        pytest.approx(11.6, abs=1),
    )


def with_rows(path, keep):
    """The log with only some of its rows."""
    steps = path.read_text(encoding="utf-8").split("<timestep")
    for number, step in enumerate(steps):
        rows = step.split("<vehicle")
        steps[number] = "<vehicle".join(
            row for row in rows if 'id="v' not in row or keep(number - 1, row)
        )
        if "</timestep>" not in steps[number] and number:
            steps[number] += "</timestep>\n"
    text = "<timestep".join(steps)
    path.write_text(text if "</fcd-export>" in text else text + "</fcd-export>", encoding="utf-8")


def test_birth_death_and_gap_are_found_in_the_picture(tmp_path, capsys):
    """v0 appears late, v1 vanishes early, v2 is missing in between; the post sees them."""
    scene = write_scenario(tmp_path, vehicles=4)
    text = scene.read_text(encoding="utf-8").replace("from: 4, to: 5", "from: 1, to: 11")
    scene.write_text(text, encoding="utf-8")
    gone = {"v0": range(4), "v1": range(7, 13), "v2": range(5, 8)}
    with_rows(
        tmp_path / "fcd.xml",
        lambda second, row: not any(f'id="{k}"' in row and second in v for k, v in gone.items()),
    )
    report = checked(scene, capsys)
    assert (report["births"], report["deaths"]) == (2, 2)
    gaps = [each for each in report["remarks"] if each["kind"] == "gap"]
    assert [(each["id"], each["time"], each["end"]) for each in gaps] == [("v2", 4.0, 8.0)]
    (shot,) = report["pop_ups"]
    assert {each["id"] for each in shot["births"]} <= {"v0", "v2"}
    assert {each["id"] for each in shot["deaths"]} <= {"v1", "v2"}
    assert shot["births"] and shot["deaths"]
    assert all(0.0 < each["value"] < 500.0 for each in shot["births"])


def test_of_a_scene_without_shots_all_cameras_are_asked(tmp_path, capsys):
    scene = write_scenario(tmp_path, vehicles=2)
    text = scene.read_text(encoding="utf-8")
    start = text.index("shots:")
    scene.write_text(text[:start] + text[text.index("output:") :], encoding="utf-8")
    assert [shot["camera"] for shot in checked(scene, capsys)["pop_ups"]] == ["post", "driver"]


def test_a_log_of_nobody(tmp_path, capsys):
    scene = write_scenario(tmp_path, vehicles=0)
    report = checked(scene, capsys)
    assert report["groups"] == [] and report["speeds"] == "none"
    assert main(["check", str(scene), "--motion"]) == 0
    assert "every 1 s: empty" in capsys.readouterr().out


def test_stress_and_motion_exclude_each_other(tmp_path, capsys):
    scene = write_scenario(tmp_path, vehicles=2)
    assert main(["check", str(scene), "--motion", "--stress"]) == 2
    assert "not allowed with" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["v1", "vehicle:v1", "p0"])
def test_motion_draws_anybody(name, tmp_path, capsys):
    scene = write_scenario(tmp_path, vehicles=3, persons=1)
    target = tmp_path / "plot.png"
    drawn = ["motion", str(scene), "--vehicle", name, "--from", "3", "--to", "9.5"]
    assert main([*drawn, "-o", str(target)]) == 0
    assert "wrote" in capsys.readouterr().out
    pixels = image.imread(target)[..., :3]
    assert min(pixels.shape[:2]) > 700 and (pixels < 0.8).any(axis=-1).mean() > 0.01


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vehicle", "v11"], "no vehicle or person is called 'v11'; did you mean 'v1'"),
        (["--vehicle", "tram"], "for example 'v0', 'v1' exist"),
        (["--vehicle", "v1", "--from", "99"], "it is there from 0 s to 12 s"),
        (["--vehicle", "v1", "--to", "-1"], "it is there from 0 s to 12 s"),
        (["--vehicle", "v1", "-o", "plot.pdf"], "must end in .png"),
        ([], "--vehicle"),
    ],
)
def test_wrong_orders_end_in_one_sentence(arguments, words, tmp_path, capsys):
    scene = write_scenario(tmp_path, vehicles=2)
    given = ["motion", str(scene), "-o", str(tmp_path / "plot.png"), *arguments]
    assert main(given) == 2
    (said,) = complaints(capsys.readouterr().err)
    assert words in said
    assert not (tmp_path / "plot.png").exists()


def test_without_matplotlib_one_sentence(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(machine, "find_spec", lambda name: None)
    scene = write_scenario(tmp_path, vehicles=2)
    assert main(["motion", str(scene), "--vehicle", "v0", "-o", str(tmp_path / "a.png")]) == 2
    err = capsys.readouterr().err
    assert "matplotlib" in err and "flip" not in err and 'pip install ".[report]"' in err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "vehicle"), [("ronda", "e_joining.46"), ("crossing", "traffic_SW_N.3")]
)
def test_examples(name, vehicle, tmp_path, capsys):
    scene = example(name)
    report = checked(scene, capsys)
    assert report["speeds"] == "last step" and report["births"] > 10
    assert [shot["camera"] for shot in report["pop_ups"]]
    vehicles = report["groups"][0]
    assert vehicles["kind"] == "vehicle" and vehicles["broken"] == 0
    assert all(each["worst"] for each in vehicles["extremes"][:5])
    target = tmp_path / "plot.png"
    assert main(["motion", str(scene), "--vehicle", vehicle, "-o", str(target)]) == 0
    assert target.stat().st_size > 50_000
