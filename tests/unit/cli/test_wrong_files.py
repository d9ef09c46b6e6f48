"""`init` and `check` refuse, repair or note every kind of wrong file, in one clear sentence."""

import gzip
import re
from itertools import cycle

import pytest
from builders import complaints
from wrong_logs import FLAT, NOTED, REFUSED, changed, fcd, rows

from sumo3dviz_pt.cli import main

SCENE = """scenario: {network: n.net.xml, trajectories: fcd.xml}
template: abstract
quality: draft
ground: {horizon: flat, planting: none}
street: {fronts: none, lamps: none, signs: none, furniture: none}
cameras: {post: {mode: eulerian, position: [200, 0, 6], look_at: [210, 30, 0]}}
shots: [{camera: post, from: %s, to: %s}]
output: {size: [64, 36], fps: 10}
"""
RIGHT = fcd(rows())
STEPS = RIGHT.removeprefix("<fcd-export>").removesuffix("</fcd-export>").split("</timestep>")[:-1]


def text_of(steps):
    return "<fcd-export>" + "".join(f"{step}</timestep>" for step in steps) + "</fcd-export>"


def twice():
    """Rows with one more of a vehicle that is already there."""
    found = rows()
    return [*found[:60], dict(found[59], x=found[59]["x"] + 40.0), *found[60:]]


FILES = {
    # kind: the log, the network, what the error says
    "an empty file": (b"", FLAT, "fcd.xml: the file is empty; write it again"),
    "no time step": ("<fcd-export></fcd-export>", FLAT, "fcd.xml: the log holds no time step"),
    "a torn log": (RIGHT[: len(RIGHT) // 2], FLAT, "the log breaks off after 12 complete"),
    "another encoding": (
        RIGHT.replace('"v0"', '"vü"').encode("latin-1"),
        FLAT,
        "is not written in UTF-8",
    ),
    "a web page": ("<html><body>404</body></html>", FLAT, "its root element is <html>"),
    "a file of routes": ("<routes/>", FLAT, "its root element is <routes>, not <fcd-export>"),
    "no XML": ("version https://git-lfs.github.com/spec/v1\n", FLAT, "is no XML, and no table"),
    "a picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(range(256)), FLAT, "is a picture; name"),
    "a grid of heights": ("ncols 2\nnrows 1\n1 2\n", FLAT, "is a grid of heights, for --heights"),
    "words": ("To whom it may concern,\nthe log is lost.\n", FLAT, "is no XML, and no table"),
    "numbers without names": ("1 2 3 4\n5 6 7 8\n", FLAT, "is no XML, and no table"),
    "bytes": (bytes(range(256)) * 9, FLAT, "is no XML, and no table"),
    "packed words": (gzip.compress(b"lost"), FLAT, "is no XML, and no table"),
    "Vissim without places": (
        "$VISION\n$VEHICLE:NO;SIMSEC;SPEED;POS\n1;0;50;2\n",
        FLAT,
        "have no COORDFRONT and COORDREAR; add them in Vissim's list of attributes",
    ),
    "a number that is none": (
        RIGHT.replace('x="40.0"', 'x="nan"', 1),
        FLAT,
        'x="nan" must be a finite number',
    ),
    "an attribute is missing": (
        re.sub(' angle="[^"]*"', "", RIGHT),
        FLAT,
        'the attribute "angle" is missing; log at least x,y,angle',
    ),
    "a time that is none": (
        RIGHT.replace('time="3.0"', 'time="three"'),
        FLAT,
        'time="three" must be seconds',
    ),
    "a torn network": (RIGHT, FLAT[:500], "n.net.xml:8: the file ends in the middle"),
    "a log as network": (RIGHT, RIGHT, "n.net.xml:1: is not a SUMO network"),
    "another network": (
        RIGHT,
        FLAT.replace("0,30,0 400,30,0", "0,90,0 400,90,0").replace("300,", "90,"),
        "the log does not lie on the network (n.net.xml): only 20 of 300 vehicles",
    ),
}

SAID = {
    # kind: the log, the network, what the note says
    "an id twice in a step": (
        fcd(twice()),
        FLAT,
        "a road user is at two places at one time, once (first: `v11` at 4 s)",
    ),
    "decreasing times": (text_of(STEPS[::-1]), FLAT, "time goes backward 24 times"),
    "two runs joined": (text_of(STEPS[:20] + STEPS[10:]), FLAT, "from 19 s to 10 s"),
    "an odd network": (
        RIGHT,
        FLAT.replace('length="300" width="3.2"', 'length="0" width="0"'),
        "1 lane without a width, drawn 3.2 m wide",
    ),
}

SILENT = {
    # kind: the log, which is read as it is
    "the right log": RIGHT,
    "UTF-16": ('<?xml version="1.0" encoding="UTF-16"?>' + RIGHT).encode("utf-16"),
    "a later version of SUMO": RIGHT.replace(" speed=", ' future="x" speed=').replace(
        "</timestep>", "<future/></timestep>"
    ),
    "an early version of SUMO": fcd(changed(pos=lambda _: None, type=lambda _: "DEFAULT_VEHTYPE")),
}


def by_turns(kinds):
    """Each kind, with the command that is given it: what one reads, the other reads alike."""
    return list(zip(kinds, cycle(("init", "check")), strict=False))


def said_by(command, folder, log, net, capsys, *, window=(4, 5)):
    """Exit code and standard error of a command for a log and a network."""
    for name, content in (("fcd.xml", log), ("n.net.xml", net)):
        data = content if isinstance(content, bytes) else content.encode()
        (folder / name).write_bytes(data)
    scene = folder / "scene.yaml"
    scene.write_text(SCENE % window, encoding="utf-8")
    named = ["--network", str(folder / "n.net.xml"), "--trajectories", str(folder / "fcd.xml")]
    begin = ["init", str(folder), *named, "-o", str(folder / "new.yaml")]
    code = main(begin if command == "init" else ["check", str(scene)])
    return code, capsys.readouterr().err


def check_refused(command, folder, log, net, capsys):
    """Return the one sentence with which a command refuses files."""
    code, said = said_by(command, folder, log, net, capsys)
    (sentence,) = complaints(said)
    assert code == 2 and "Traceback" not in said
    assert ": note: " not in said
    return sentence


@pytest.mark.parametrize("command", ["init", "check"])
@pytest.mark.parametrize("kind", FILES)
def test_wrong_files_are_refused(kind, command, tmp_path, capsys):
    log, net, words = FILES[kind]
    assert words in check_refused(command, tmp_path, log, net, capsys)


@pytest.mark.parametrize("command", ["init", "check"])
@pytest.mark.parametrize("kind", REFUSED)
def test_wrong_logs_are_refused(kind, command, tmp_path, capsys):
    found, words = REFUSED[kind]
    assert re.search(words, check_refused(command, tmp_path, fcd(found), FLAT, capsys))


def notes_about(files, said):
    """Notes of a command that name one of the files."""
    lines = [line for line in said.splitlines() if ": note: " in line]
    return [line for line in lines if any(name in line for name in files)]


def check_noted(command, folder, log, net, capsys, *, window=(4, 5)):
    """Return the one note that a command says of the files."""
    code, said = said_by(command, folder, log, net, capsys, window=window)
    assert code == 0 and not complaints(said)
    (note,) = notes_about(("fcd.xml", "n.net.xml"), said)
    return note


@pytest.mark.parametrize(("kind", "command"), by_turns(SAID))
def test_odd_files_are_noted(kind, command, tmp_path, capsys):
    log, net, words = SAID[kind]
    assert words in check_noted(command, tmp_path, log, net, capsys)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "command"), by_turns(NOTED))
def test_odd_logs_are_noted(kind, command, tmp_path, capsys):
    found, words = NOTED[kind]
    window = (4000, 4001) if kind == "times in milliseconds" else (4, 5)
    note = check_noted(command, tmp_path, fcd(found), FLAT, capsys, window=window)
    assert re.search(words, note)


@pytest.mark.parametrize(("kind", "command"), by_turns(SILENT))
def test_what_is_fine_is_read_without_a_word(kind, command, tmp_path, capsys):
    code, said = said_by(command, tmp_path, SILENT[kind], FLAT, capsys)
    assert code == 0 and not notes_about(("fcd.xml", "n.net.xml"), said)


@pytest.mark.parametrize(
    "option", ["", "--network", "--trajectories", "--signals", "--additional", "--heights"]
)
def test_every_file_that_init_is_given_must_be_there(option, tmp_path, capsys):
    """One sentence that names it, and no scene file."""
    (tmp_path / "fcd.xml").write_text(RIGHT, encoding="utf-8")
    (tmp_path / "n.net.xml").write_text(FLAT, encoding="utf-8")
    gone = str(tmp_path / "gone.any")
    named = [str(tmp_path), option, gone] if option else [gone]
    assert main(["init", *named, "-o", str(tmp_path / "new.yaml")]) == 2
    (sentence,) = complaints(capsys.readouterr().err)
    assert "gone.any: " in sentence and "does not exist; " in sentence and "Errno" not in sentence
    assert not (tmp_path / "new.yaml").exists()
