"""`study verify`: whatever is done to a study's folder is found, and named by file and frame."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import write_scenario
from needed import skip_if
from viewer.browser import chromium

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_layers, write_exr
from sumo3dviz_pt.pipeline.accounts.provenance import file_hash
from sumo3dviz_pt.pipeline.films.proof import sealed
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path
from sumo3dviz_pt.video.picture import film_pictures

pytestmark = pytest.mark.slow

SIZE = (96, 54)
STUDY = """scene: scene.yaml
clip: {camera: driver, from: 2, to: 2.6}
common: {quality: draft, output.size: [96, 54], output.fps: 10}
factors:
  light:
    about: the sky, clear or closed
    levels:
      clear: {sky: {preset: sky_blue}}
      grey: {sky: {preset: sky_overcast}}
certificate: {frames: 2}
report: {write: false}
calibration: null
tools: {write: [psychds]}
about: {title: Two skies, authors: [Ada Example], date: 2026-11-27}
"""
CLEAR, GREY = "materials/clear.mp4", "materials/grey.mp4"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verified")
    write_scenario(folder, vehicles=2)
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def made(place):
    """A whole study, by the command."""
    assert main(["study", str(place / "study.yaml"), "-o", str(place / "out"), "-q"]) == 0
    return place / "out"


def verify(folder, capsys, *more) -> tuple[int, dict[str, Any]]:
    """The exit code, and what was found."""
    capsys.readouterr()
    code = main(["study", "verify", str(folder), "--json", "-q", *more])
    return code, json.loads(capsys.readouterr().out)


def test_an_untouched_folder_is_proven(made, capsys):
    code, found = verify(made, capsys)
    assert (code, found["faults"]) == (0, [])
    assert found["pictures"] == {"decoded": 12, "developed": 12}
    there = found["frames"]
    assert there["there"] == there["of"] == 2 * (3 * 6 + 2)
    assert found["digest"] == json.loads((made / "certificate.json").read_bytes())["digest"]
    assert verify(made, capsys, "--published", found["digest"])[0] == 0
    code, found = verify(made, capsys, "--published", "0" * 64)
    assert code == 1 and "published" in found["faults"][0]["what"]


# Twelve manipulations -----------------------------------------------------------------------


def recoded(folder: Path, change: Callable[[list[Any]], Any]) -> None:
    """Decode a film, change its pictures, encode it as before."""
    film = folder / GREY
    pictures = [each.astype(np.float32) / 255 for each in film_pictures(film, size=SIZE)]
    change(pictures)
    encode(pictures, film, size=SIZE, fps=10)


def edited(path: Path, change: Callable[[dict[str, Any]], Any], *, seal: bool = False) -> None:
    """Change a file of JSON, with its digest or without."""
    content = json.loads(path.read_bytes())
    change(content)
    path.write_text(json.dumps(sealed(content) if seal else content), encoding="utf-8")


def swap(folder):
    shutil.copy(folder / CLEAR, folder / GREY)


def recode(folder):
    film, again = folder / GREY, folder / "again.mp4"
    command = [ffmpeg_path(), "-loglevel", "error", "-i", str(film), "-crf", "45", str(again)]
    subprocess.run(command, check=True)
    again.replace(film)


def cast(folder):
    def warmer(pictures):
        for picture in pictures:
            picture[..., 0] = (picture[..., 0] + 3 / 255).clip(0, 1)

    recoded(folder, warmer)


def person(folder):
    def painted(pictures):
        for picture in pictures:
            picture[20:28, 60:66] = (0.35, 0.3, 0.3)  # 48 of 5184 pixels

    recoded(folder, painted)


def frames_swapped(folder):
    def swapped(pictures):
        pictures[2], pictures[3] = pictures[3], pictures[2]

    recoded(folder, swapped)


def black(folder):
    def darkened(pictures):
        pictures[4] = np.zeros_like(pictures[4])

    recoded(folder, darkened)


def truncated(folder):
    recoded(folder, lambda pictures: pictures.pop())


def other_frame(folder):
    frames = folder / "materials"
    shutil.copy(frames / "clear.frames" / "000003.exr", frames / "grey.frames" / "000003.exr")


def one_pixel(folder):
    path = folder / "materials" / "grey.frames" / "000002.exr"
    layers, strings = read_layers(path)
    changed = {name: np.array(layer) for name, layer in layers.items()}
    changed["radiance"][7, 11, 1] += 0.25
    write_exr(path, changed, half=True, attributes=dict(strings))


def account(folder):
    edited(folder / "materials" / "grey.json", lambda said: said.update(exposure=1.5))


def sealed_account(folder):
    edited(folder / "materials" / "grey.json", lambda said: said.update(exposure=1.5), seal=True)


def record(folder):
    edited(folder / "study.json", lambda said: said["films"]["grey"].update(rate="11"))


def certificate(folder):
    edited(folder / "certificate.json", lambda said: said.update(passed=True, pairs=[]))


def input_file(folder):
    path = folder / "inputs" / "fcd.xml"
    path.write_bytes(path.read_bytes().replace(b'speed="', b'speed="1', 1))


MANIPULATIONS = {
    swap: ("films", GREY, range(6)),
    recode: ("films", GREY, range(6)),
    cast: ("films", GREY, range(6)),
    person: ("films", GREY, range(6)),
    frames_swapped: ("films", GREY, (2, 3)),
    black: ("films", GREY, (4,)),
    truncated: ("films", GREY, (5,)),
    other_frame: ("frames", "materials/grey.frames/000003.exr", (3,)),
    one_pixel: ("frames", "materials/grey.frames/000002.exr", (2,)),
    account: ("inputs", "materials/grey.json", (None,)),
    sealed_account: ("inputs", "materials/grey.json", (None,)),
    record: ("inputs", "study.json", (None,)),
    certificate: ("inputs", "certificate.json", (None,)),
    input_file: ("inputs", "inputs/fcd.xml", (None,)),
}


@pytest.mark.parametrize("manipulate", MANIPULATIONS, ids=lambda each: each.__name__)
def test_a_folder_that_was_manipulated_is_not_proven(manipulate, made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    manipulate(folder)
    code, found = verify(folder, capsys)
    link, file, frames = MANIPULATIONS[manipulate]
    told = [(each["link"], each["file"]) for each in found["faults"]]
    assert code == 1 and set(told) == {(link, file)}
    assert any(each["frame"] in frames for each in found["faults"]), found["faults"]


# Replay -------------------------------------------------------------------------------------


def test_frames_that_are_drawn_by_lot_are_rendered_anew_bit_by_bit(made, tmp_path, capsys):
    code, found = verify(made, capsys, "--replay", "1")
    assert (code, found["faults"]) == (0, [])
    (said,) = [note for note in found["notes"] if note.startswith("rendered anew: ")]
    name, number = said.removeprefix("rendered anew: ").split()
    # Whoever forges a frame, and all that is said of it, is found when it is drawn.
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    frame = f"materials/{name}.frames/{int(number):06d}.exr"
    forge(folder, name, frame)
    code, found = verify(folder, capsys, "--replay", "12")
    replayed = [each for each in found["faults"] if each["link"] == "replay"]
    assert code == 1
    assert [(each["file"], each["frame"]) for each in replayed] == [(frame, int(number))]
    assert "1 of 5184 pixels are others" in replayed[0]["what"]


def forge(folder: Path, name: str, frame: str) -> None:
    """Change a pixel of a frame, and write the digest of it into all that holds it."""
    path = folder / frame
    layers, strings = read_layers(path)
    changed = {layer: np.array(values) for layer, values in layers.items()}
    changed["radiance"][7, 11, 1] += 0.25
    write_exr(path, changed, half=True, attributes=dict(strings))
    file = folder / "materials" / f"{name}.json"
    edited(file, lambda said: said["files"].update({frame[10:]: file_hash(path)}), seal=True)
    digest = json.loads(file.read_bytes())["digest"]
    record, certificate = folder / "study.json", folder / "certificate.json"
    edited(record, lambda said: said["films"][name].update(account=digest), seal=True)
    own = json.loads(record.read_bytes())["digest"]
    edited(certificate, lambda said: said["digests"].update({"study.json": own}), seal=True)


def test_a_replay_without_inputs_is_refused_in_one_sentence(made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder, ignore=shutil.ignore_patterns("*.exr"))
    (folder / "inputs" / "fcd.xml").unlink()
    assert main(["study", "verify", str(folder), "--replay", "1", "-q"]) == 2
    said = capsys.readouterr().err
    assert "a replay needs the study's inputs" in said and said.count("\n") == 1


def test_what_is_no_study_is_refused(tmp_path, capsys):
    assert main(["study", "verify", str(tmp_path), "-q"]) == 2
    assert "holds no study.json" in capsys.readouterr().err


# The page -----------------------------------------------------------------------------------


@skip_if(chromium() is None, "there is no Chromium on the PATH")
def test_the_page_is_printed_on_two_sheets_of_a4(made, tmp_path):
    command = [str(chromium()), "--headless", "--no-sandbox", "--disable-gpu"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", "--no-pdf-header-footer"]
    command += [f"--print-to-pdf={tmp_path / 'a.pdf'}", (made / "certificate.html").as_uri()]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    pdf = (tmp_path / "a.pdf").read_bytes()
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) == 2
    boxes = re.findall(rb"/MediaBox\s*\[\s*0\s+0\s+([\d.]+)\s+([\d.]+)", pdf)
    assert {(round(float(a)), round(float(b))) for a, b in boxes} == {(595, 842)}
