"""Commands that need no rendering: init, check, help; and the API's words."""

import json
import subprocess
import sys

import pytest
from builders import write_scenario
from PIL import Image

import sumo3dviz_pt as sv
from sumo3dviz_pt.api import _gathered
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.production import Request, check_target, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job


@pytest.mark.slow
def test_init_writes_a_scene_that_runs(tmp_path, capsys):
    write_scenario(tmp_path, signals=True, trees=True, vehicles=8, end=30.0)
    (tmp_path / "scene.yaml").unlink()
    target = tmp_path / "sub" / "my scene.yaml"
    target.parent.mkdir()
    assert main(["init", str(tmp_path), "-o", str(target)]) == 0
    assert "next: sumo3dviz-pt check" in capsys.readouterr().out
    text = target.read_text(encoding="utf-8")
    assert "#" in text and str(tmp_path) not in text, "commented, and with relative paths"
    job = load_job(target)
    assert set(job.cameras) >= {"overview", "driver", "chase", "flight"}
    assert job.scenario.network.resolve() == (tmp_path / "net.net.xml").resolve()
    for shot in job.shots:
        times = frame_times(shot.start, shot.end, 1)
        made = prepare(job, Request(camera=shot.camera), times).shot
        assert len(made.frame_at(float(times[0])).movers) > 0
    assert main(["check", str(target)]) == 0
    assert "triangles" in capsys.readouterr().out
    assert main(["check", str(target), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["log"]["end"] == 30.0


def test_init_with_own_files_and_without_cars(tmp_path, capsys):
    write_scenario(tmp_path, vehicles=0, persons=3, signals=True)
    arguments = ["--signals", tmp_path / "tls.xml", "--network", tmp_path / "net.net.xml"]
    target = tmp_path / "s.yaml"
    assert main([str(a) for a in ["init", tmp_path, *arguments, "-o", target]]) == 0
    assert set(load_job(target).cameras) == {"overview", "corner", "walk", "flight"}


@pytest.mark.parametrize("pictured", [False, True])
def test_init_invents_no_houses_on_a_picture_of_the_land(tmp_path, pictured):
    write_scenario(tmp_path, vehicles=4)
    Image.new("RGB", (40, 40), (80, 90, 70)).save(tmp_path / "aerial.png")
    if pictured:
        decal = '<decal file="aerial.png" centerX="0" centerY="0" width="900" height="900"/>'
        (tmp_path / "view.xml").write_text(f"<viewsettings>{decal}</viewsettings>")
    target = tmp_path / "s.yaml"
    assert main(["init", str(tmp_path), "-o", str(target)]) == 0
    job = load_job(target)
    assert (job.ground.picture is not None) == pictured
    assert (job.street.town == "none") == pictured


def test_init_of_nobody(tmp_path, capsys):
    write_scenario(tmp_path, vehicles=0)
    assert main(["init", str(tmp_path), "-o", str(tmp_path / "s.yaml")]) == 2
    assert "no traffic" in capsys.readouterr().err and not (tmp_path / "s.yaml").exists()


@pytest.mark.parametrize(
    "command", ["", "demo", "init", "check", "still", "render", "develop", "doctor"]
)
def test_help(command, capsys):
    with pytest.raises(SystemExit) as left:
        main([*([command] if command else []), "--help"])
    assert left.value.code == 0 and "usage: sumo3dviz-pt" in capsys.readouterr().out


def test_version(capsys):
    with pytest.raises(SystemExit):
        main(["--version"])
    assert sv.__version__ in capsys.readouterr().out


def test_help_and_import_are_light():
    """Neither the package nor its command line loads what takes seconds."""
    code = (
        "import sys, sumo3dviz_pt.cli as c\n"
        "try: c.main(['--help'])\n"
        "except SystemExit: pass\n"
        "print([m for m in ('mitsuba', 'drjit', 'trimesh', 'colour') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_public_names():
    assert sorted(sv.__all__) == sv.__all__
    assert all(hasattr(sv, name) for name in sv.__all__)


# The API ------------------------------------------------------------------------------------


def test_loose_keys_go_to_the_scenario():
    found = _gathered({"network": "a", "signals": ["b"], "seed": 3})
    assert found == {"scenario": {"network": "a", "signals": ["b"]}, "seed": 3}
    looks = _gathered({"folder": "x", "signals": {"show": False}})
    assert looks == {"scenario": {"folder": "x"}, "signals": {"show": False}}
    both = _gathered({"scenario": {"folder": "x"}, "network": "n"})
    assert both == {"scenario": {"folder": "x", "network": "n"}}
    assert _gathered({"seed": 1}) == {"seed": 1}


def test_api_errors_are_the_same(tmp_path):
    with pytest.raises(sv.ConfigError, match="did you mean 'quality'"):
        sv.Scene(network="a", trajectories="b", qualty="draft")
    with pytest.raises(sv.ConfigError, match="no such scene file"):
        sv.load(tmp_path / "no.yaml")
    scene = sv.load(write_scenario(tmp_path))
    with pytest.raises(sv.ConfigError, match="did you mean 'post'"):
        scene.still(time=4.0, camera="pots")
    with pytest.raises(sv.ConfigError, match="colour: this choice is unknown"):
        scene.render(tmp_path / "a.mp4", colour="red")


@pytest.mark.parametrize(
    ("name", "words"),
    [("a.jpg", "must end in .png or .exr"), ("no/a.png", "create it first"), ("d.png", "written")],
)
def test_targets(tmp_path, name, words):
    (tmp_path / "d.png").mkdir()
    with pytest.raises(sv.ConfigError, match=words):
        check_target(tmp_path / name, suffixes=(".png", ".exr"))
    check_target(tmp_path / "a.PNG", suffixes=(".png",))


@pytest.mark.parametrize(
    ("scenario", "words"),
    [({}, "give sumocfg or folder"), ({"network": "a.net.xml"}, "network and trajectories")],
)
def test_a_scene_needs_a_simulation(scenario, words):
    cameras = {"a": {"mode": "eulerian", "position": [0, 0, 1], "heading": 0}}
    with pytest.raises(sv.ConfigError, match=words):
        sv.Scene(scenario=scenario, cameras=cameras).still(time=0)


def test_a_camera_without_its_vehicle(tmp_path):
    place = write_scenario(tmp_path, vehicles=1, end=3.0)
    log = tmp_path / "fcd.xml"
    more = "".join(f'<timestep time="{t}.00"></timestep>' for t in range(4, 20))
    log.write_text(
        log.read_text(encoding="utf-8").replace("</fcd-export>", more + "</fcd-export>"),
        encoding="utf-8",
    )
    with pytest.raises(sv.ConfigError, match="v0"):
        sv.load(place).still(time=12.0, camera="driver")


def test_examples_are_found_by_name():
    assert sv.example("ronda").is_file()
    with pytest.raises(sv.ConfigError, match="did you mean 'ronda'"):
        sv.example("rondo")
