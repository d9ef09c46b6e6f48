"""Bad input through the command line: exit code 2, one sentence, nothing half-written."""

import gzip
import os
import subprocess
import sys

import pytest
from builders import SIGNALS, complaints, fcd_xml, write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.cli.options import PROGRAM

STILL = ["still", "{scene}", "--time", "4.5", "-o", "{out}/a.png"]
RENDER = ["render", "{scene}", "--from", "4", "--to", "4.2", "-o", "{out}/a.mp4"]
CHECK = ["check", "{scene}"]


def rewrite(name, change):
    """A preparation that changes one file of the scenario."""

    def prepare(folder):
        path = folder / name
        data = change(path.read_bytes()) if path.exists() else change(b"")
        path.unlink(missing_ok=True)
        if data is not None:
            path.write_bytes(data)

    return prepare


def replaced(old, new):
    return lambda data: data.replace(old.encode(), new.encode(), 1)


def scene(old, new):
    return rewrite("scene.yaml", replaced(old, new))


def appended(text):
    return rewrite("scene.yaml", lambda data: data + text.encode())


def packed(folder):
    """A log that is gzipped and cut off."""
    data = gzip.compress((folder / "fcd.xml").read_bytes(), mtime=0)
    (folder / "fcd.xml.gz").write_bytes(data[: len(data) // 2])
    scene("fcd.xml", "fcd.xml.gz")(folder)


def unwritable(folder):
    """A folder in which nothing may be made; a root user may write anywhere."""
    if os.geteuid() == 0:
        pytest.skip("root writes everywhere")
    (folder / "out").chmod(0o500)


CASES = {
    "no scene file": (rewrite("scene.yaml", lambda _: None), STILL, ("scene.yaml", "no such")),
    "no network": (rewrite("net.net.xml", lambda _: None), STILL, ("net.net.xml",)),
    "no log": (rewrite("fcd.xml", lambda _: None), STILL, ("fcd.xml",)),
    "network cut off": (
        rewrite("net.net.xml", lambda d: d[: len(d) // 2]),
        STILL,
        ("net.net.xml:",),
    ),
    "log cut off": (rewrite("fcd.xml", lambda d: d[:600]), STILL, ("fcd.xml:",)),
    "gzip cut off": (packed, STILL, ("fcd.xml.gz",)),
    "log is no xml": (rewrite("fcd.xml", lambda _: b"hello"), STILL, ("fcd.xml: is no XML",)),
    "log is a network": (
        scene("trajectories: fcd.xml", "trajectories: net.net.xml"),
        STILL,
        ("net.net.xml", "fcd"),
    ),
    "empty log": (rewrite("fcd.xml", lambda _: b"<fcd-export></fcd-export>"), STILL, ("fcd.xml",)),
    "empty file": (rewrite("fcd.xml", lambda _: b""), STILL, ("fcd.xml",)),
    "NaN position": (
        rewrite("fcd.xml", replaced('x="-40.000"', 'x="nan"')),
        CHECK,
        ("fcd.xml:2", "v0"),
    ),
    "word as position": (
        rewrite("fcd.xml", replaced('x="-40.000"', 'x="left"')),
        CHECK,
        ("fcd.xml:2",),
    ),
    "no angle": (rewrite("fcd.xml", replaced('angle="90" ', "")), CHECK, ("fcd.xml:2", "angle")),
    "log elsewhere": (
        rewrite("fcd.xml", lambda _: fcd_xml(offset=(9e4, 0)).encode()),
        STILL,
        ("fcd.xml", "network"),
    ),
    "unknown vehicle": (
        scene("vehicle: v0", "vehicle: v00"),
        [*STILL, "--camera", "driver"],
        ("v00", "did you mean", "'v0'"),
    ),
    "unknown camera": (None, [*STILL, "--camera", "pots"], ("did you mean 'post'",)),
    "window outside the log": (
        None,
        [*STILL[:3], "99", *STILL[4:]],
        ("fcd.xml", "from 0 s to 12 s"),
    ),
    "time is no number": (None, [*STILL[:3], "nan", *STILL[4:]], ("nan",)),
    "film outside the log": (
        None,
        [*RENDER[:3], "40", "--to", "41", *RENDER[6:]],
        ("fcd.xml", "12 s"),
    ),
    "reversed window": (None, [*RENDER[:3], "5", "--to", "4", *RENDER[6:]], ("--to", "later")),
    "reversed shot": (
        scene("from: 4, to: 5", "from: 5, to: 4"),
        RENDER,
        ("scene.yaml:", "shots.0", "later"),
    ),
    "unknown key": (appended("wheels: 4\n"), STILL, ("scene.yaml:", "wheels", "unknown")),
    "misspelt key": (
        appended("sgnals: {show: false}\n"),
        STILL,
        ("sgnals", "did you mean 'signals'"),
    ),
    "wrong type": (scene("seed: 3", "seed: three"), STILL, ("scene.yaml:", "seed", "integer")),
    "duplicate key": (appended("seed: 4\n"), STILL, ("scene.yaml:", "seed", "twice")),
    "no yaml": (appended("a: [1\n"), STILL, ("scene.yaml:", "YAML")),
    "unknown texture": (
        appended("ground: {texture: ground_gras}\n"),
        STILL,
        ("did you mean 'ground_grass'",),
    ),
    "unknown surface": (
        appended("roads: {surface: asphald}\n"),
        STILL,
        ("did you mean 'asphalt'",),
    ),
    "unknown model": (
        appended("vehicles: {passenger: [sedam]}\n"),
        STILL,
        ("did you mean 'sedan'",),
    ),
    "unknown view": (
        scene("view: driver", "view: drivr"),
        [*STILL, "--camera", "driver"],
        ("did you mean 'driver'",),
    ),
    "unknown sky": (appended("sky: {preset: sky_blu}\n"), STILL, ("did you mean 'sky_blue'",)),
    "unknown template": (
        scene("template: abstract", "template: abstrakt"),
        STILL,
        ("did you mean 'abstract'",),
    ),
    "unknown quality": (None, [*STILL, "--quality", "drat"], ("did you mean 'draft'",)),
    "unknown tone": (None, [*STILL, "--set", "output.tone=agy"], ("agy", "agx")),
    "unknown codec": (None, [*RENDER, "--set", "output.codec=h246"], ("h246", "h264")),
    "unknown smoother": (None, [*STILL, "--set", "motion.smoother=papr"], ("paper",)),
    "unknown variant": (None, [*STILL, "--variant", "lvm"], ("did you mean 'llvm'",)),
    "bad colour": (appended("roads: {colour: redd}\n"), STILL, ("redd",)),
    "fps 0": (None, [*RENDER, "--fps", "0"], ("fps", "positive number or a ratio")),
    "fps NaN": (None, [*RENDER, "--fps", "nan"], ("fps",)),
    "negative size": (None, [*STILL, "--size", "-64x36"], ("size",)),
    "zero size": (None, [*STILL, "--size", "0x36"], ("0x36", "1280x720")),
    "giant size": (None, [*STILL, "--size", "99999x36"], ("16384",)),
    "odd size": (None, [*RENDER, "--size", "63x36"], ("63", "even")),
    "no samples": (None, [*STILL, "--spp", "0"], ("spp",)),
    "negative seed": (None, [*STILL, "--seed", "-1"], ("seed",)),
    "no folder": (None, [*STILL[:-1], "{out}/none/a.png"], ("no folder", "none")),
    "file as folder": (None, [*STILL[:-1], "{scene}/a.png"], ("is a file", "scene.yaml")),
    "unwritable folder": (unwritable, STILL, ("cannot be written",)),
    "wrong suffix": (None, [*STILL[:-1], "{out}/a.jpg"], (".png or .exr",)),
    "frames beyond": (None, [*RENDER, "--frames", "1:9"], ("frames", "0:2")),
    "frames no range": (None, [*RENDER, "--frames", "1-9"], ("1-9", "10:20")),
    "override without value": (None, [*STILL, "--set", "seed"], ("seed", "no value")),
    "override no yaml": (None, [*STILL, "--set", "seed=[1"], ("YAML",)),
    "override of nothing": (None, [*STILL, "--set", "cameras.past.roll=3"], ("cameras.past",)),
    "two scenes, one name": (
        None,
        ["render", "{scene}", "{scene}", "-o", "{out}/a.mp4"],
        ("{scene}",),
    ),
    "no command": (None, [], ("--help",)),
    "unknown option": (None, [*STILL, "--colour", "red"], ("--colour",)),
    "no frames to develop": (None, ["develop", "{out}", "-o", "{out}/a.mp4"], ("no .exr frames",)),
    "nothing to develop": (None, ["develop", "{out}/x", "-o", "{out}/a.mp4"], ("no such folder",)),
    "init of nothing": (None, ["init", "{out}", "-o", "{out}/s.yaml"], ("out",)),
    "init into nothing": (None, ["init", "{folder}", "-o", "{out}/no/s.yaml"], ("no folder",)),
    "init of an unknown template": (
        None,
        ["init", "{folder}", "-o", "{out}/s.yaml", "--template", "day"],
        ("day",),
    ),
    "demo into nothing": (None, ["demo", "-o", "{out}/none"], ("no folder",)),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_input(name, tmp_path, capsys):
    prepare, arguments, words = CASES[name]
    write_scenario(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    if prepare is not None:
        prepare(tmp_path)
    places = {"scene": str(tmp_path / "scene.yaml"), "out": str(out), "folder": str(tmp_path)}
    code = main([_filled(argument, places) for argument in arguments])
    said = capsys.readouterr()
    lines = complaints(said.err)
    assert code == 2, said.err
    assert len(lines) == 1 and lines[0].startswith(f"{PROGRAM}: "), said.err
    assert "Traceback" not in said.err
    for word in words:
        assert word in lines[0]
    assert list(out.iterdir()) == [], "nothing half-written stays"


def _filled(argument, places):
    for key, value in places.items():
        argument = argument.replace("{" + key + "}", value)
    return argument


def test_signal_log_of_another_network_is_told(tmp_path, capsys):
    scene_file = write_scenario(tmp_path, signals=True)
    (tmp_path / "tls.xml").write_text(SIGNALS.replace('state="Gr"', 'state="G"'), encoding="utf-8")
    code = main(["check", str(scene_file)])
    said = capsys.readouterr()
    assert code in (0, 2) and "Traceback" not in said.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["still", "{scene}", "--time", "99", "-o", "{out}/a.png"],
            "the log goes from 0 s to 12 s",
        ),
        (["check", "{out}/none.yaml"], "no such scene file"),
    ],
)
def test_as_a_process(arguments, words, tmp_path):
    scene_file = write_scenario(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    places = {"scene": str(scene_file), "out": str(out)}
    done = subprocess.run(
        [sys.executable, "-m", "sumo3dviz_pt.cli", *(_filled(a, places) for a in arguments)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr
    assert len(complaints(done.stderr)) == 1 and list(out.iterdir()) == []


def test_an_option_is_named_as_it_was_typed(tmp_path, capsys):
    words = ["render", str(write_scenario(tmp_path)), "--camera", "post", "--from", "4"]
    assert main([*words, "-o", str(tmp_path / "a.mp4"), "--to=2"]) == 2
    assert capsys.readouterr().err == f"{PROGRAM}: --to: 2 s must be later than --from, 4 s\n"
    # What stands in the scene file has that file's words.
    scene("from: 4, to: 5", "from: 5, to: 4")(tmp_path)
    assert main(["check", str(tmp_path / "scene.yaml")]) == 2
    assert "--" not in capsys.readouterr().err.removeprefix(PROGRAM)
