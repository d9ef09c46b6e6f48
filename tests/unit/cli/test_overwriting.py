"""No command overwrites anything unasked: refused before any work, by one sentence."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from builders import write_scenario
from PIL import Image

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.cli.options import PROGRAM
from sumo3dviz_pt.pipeline.films.frames import frame_file
from sumo3dviz_pt.pipeline.films.reuse import LOCK, held

SHOT = ["--camera", "post", "--from", "4", "--to", "4.2"]

COMMANDS = {
    "init": (["init", "{folder}", "-o", "{out}/a.yaml"], "a.yaml", "--overwrite"),
    "import": (
        ["import-sumo3dviz", "{scene}", "-o", "{out}/a.yaml"],
        "a.yaml",
        "--overwrite",
    ),
    "film as pictures": (
        ["render", "{scene}", *SHOT, "-o", "{out}/a_{{frame}}.png"],
        "a_000001.png",
        "--resume keeps frames that fit",
    ),
    "still": (["still", "{scene}", "--time", "4", "-o", "{out}/a.png"], "a.png", "--overwrite"),
    "film": (["render", "{scene}", *SHOT, "-o", "{out}/a.mp4"], "a.mp4", "--overwrite"),
    "film's account": (
        ["render", "{scene}", *SHOT, "-o", "{out}/a.mp4"],
        "a.json",
        "--overwrite",
    ),
    "film's frames": (
        ["render", "{scene}", *SHOT, "-o", "{out}/a.mp4"],
        "a.frames/000007.exr",
        "--resume keeps frames that fit",
    ),
    "part of a film": (
        ["render", "{scene}", *SHOT, "--frames", "1:2", "-o", "{out}/a.mp4"],
        "a.frames/000001.exr",
        "--resume keeps frames that fit",
    ),
    "picture developed": (["develop", "{out}", "-o", "{out}/a.png"], "a.png", "--overwrite"),
    "film developed": (["develop", "{out}", "-o", "{out}/a.mp4"], "a.mp4", "--overwrite"),
    "motion": (
        ["motion", "{scene}", "--vehicle", "v0", "-o", "{out}/a.png"],
        "a.png",
        "--overwrite",
    ),
    "demo's film": (["demo", "-o", "{out}"], "demo.mp4", "--overwrite"),
    "demo's account": (["demo", "-o", "{out}"], "demo.json", "--overwrite"),
    "demo's picture": (["demo", "-o", "{out}"], "demo.png", "--overwrite"),
    "report": (["report", "{out}", "-o", "{out}/r"], "r/report.md", "--overwrite"),
    "converge": (
        ["converge", "{scene}", "--time", "4", "-o", "{out}/r"],
        "r/convergence.csv",
        "--overwrite",
    ),
    "sheet": (["assets", "sheet", "skies", "-o", "{out}"], "sheet_skies.png", "--overwrite"),
}


def filled(arguments, folder, out):
    places = {"folder": folder, "scene": folder / "scene.yaml", "out": out}
    return [argument.format(**places) if "{" in argument else argument for argument in arguments]


@pytest.fixture
def out(tmp_path):
    write_scenario(tmp_path, vehicles=2)
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.mark.parametrize("name", COMMANDS)
def test_what_exists_stays(name, out, capsys):
    arguments, taken, option = COMMANDS[name]
    mine = out / taken
    mine.parent.mkdir(exist_ok=True)
    mine.write_bytes(b"mine")
    before = sorted(path for path in out.rglob("*"))
    assert main(filled(arguments, out.parent, out)) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{PROGRAM}: output: ") and option in line
    assert mine.name in line or mine.parent.name in line
    assert mine.read_bytes() == b"mine" and sorted(out.rglob("*")) == before


@pytest.mark.parametrize("option", ["--force", "--overwrite"])
def test_init_replaces_when_asked(out, option):
    (out / "a.yaml").write_text("mine", encoding="utf-8")
    arguments = filled(COMMANDS["init"][0], out.parent, out)
    assert main([*arguments, option]) == 0
    assert "cameras:" in (out / "a.yaml").read_text(encoding="utf-8")


def test_motion_replaces_when_asked(out):
    (out / "a.png").write_bytes(b"mine")
    assert main([*filled(COMMANDS["motion"][0], out.parent, out), "--overwrite"]) == 0
    assert (out / "a.png").read_bytes().startswith(b"\x89PNG")


def test_films_from_python_overwrite_nothing_either(out):
    (out / "a.mp4").write_bytes(b"mine")
    scene = sv.load(out.parent / "scene.yaml")
    with pytest.raises(sv.ConfigError, match=r"a\.mp4 exists already: --resume .* --overwrite"):
        scene.render(out / "a.mp4", camera="post", start=4, end=4.2)


def test_two_scenes_of_one_name_are_refused(out, capsys):
    other = out / "scene.yaml"
    other.write_bytes((out.parent / "scene.yaml").read_bytes())
    films = ["-o", str(out / "{scene}.mp4")]
    assert main(["render", str(out.parent / "scene.yaml"), str(other), *films]) == 2
    assert "one name" in capsys.readouterr().err


# Two at once ------------------------------------------------------------------------------------

HOLD = """
import sys
from pathlib import Path
from sumo3dviz_pt.pipeline.films.reuse import held
with held(Path(sys.argv[1]), what="this is done"):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds a folder's lock."""
    folder = tmp_path / "a.frames"
    folder.mkdir()
    command = [sys.executable, "-c", HOLD, str(folder)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline().strip() == b"held"
        yield process, folder
        process.kill()


def test_one_film_is_rendered_once_at_a_time(holder, tmp_path, capsys):
    process, folder = holder
    scene = write_scenario(tmp_path, vehicles=1)
    for more in ([], ["--resume"], ["--overwrite"]):
        film = str(tmp_path / "a.mp4")
        assert main(["render", str(scene), *SHOT, *more, "-o", film]) == 2
        said = capsys.readouterr().err
        assert f"is being rendered by process {process.pid} on " in said
    assert [path.name for path in folder.iterdir()] == [LOCK]


@pytest.mark.parametrize("end", ["kill", "communicate"])
def test_a_lock_that_nobody_holds_is_taken_over(holder, end):
    process, folder = holder
    getattr(process, end)()
    process.wait()
    with held(folder, what="it is done"):
        said = json.loads((folder / LOCK).read_text(encoding="utf-8"))
        assert said["pid"] != process.pid
        with (
            pytest.raises(sv.ConfigError, match=f"it is done by process {said['pid']} on"),
            held(folder, what="it is done"),
        ):
            raise AssertionError("held twice")
    assert not (folder / LOCK).exists()


def test_a_lock_of_the_wrong_kind_says_little(tmp_path):
    """A process that has just begun has not written who it is."""
    with held(tmp_path, what="it is done"):
        (tmp_path / LOCK).write_bytes(b"")
        with (
            pytest.raises(sv.ConfigError, match="it is done by another process"),
            held(tmp_path, what="it is done"),
        ):
            raise AssertionError("held twice")


# Pictures from Python ---------------------------------------------------------------------------


def test_pictures_are_saved_over_others_as_everywhere_in_python(tmp_path):
    import numpy as np

    from sumo3dviz_pt.pipeline.still import Still

    still = Still(np.ones((4, 6, 3), np.float32), 0.0, "srgb", 0.0, True, {"seed": 3}, None)
    for _ in range(2):
        still.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as saved:
        assert saved.size == (6, 4)
    assert frame_file(Path("a"), 7).name == "000007.exr"
