"""`study verify`: whatever is done to a study's folder is found, and named by file and frame."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from manipulations import CLEAR, FOLDERS, GREY, is_said, signed_anew, write_small_study
from needed import skip_if
from viewer.browser import chromium

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_layers, write_exr
from sumo3dviz_pt.pipeline.films.encoding import delivered, developed, sealed
from sumo3dviz_pt.pipeline.provenance import code_of, file_hash
from sumo3dviz_pt.studies.certificate.comparison import PairVerdict
from sumo3dviz_pt.studies.certificate.page import write_page
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path

pytestmark = pytest.mark.slow

SIZE = (96, 54)
OWN = code_of("studies")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verified")
    return write_small_study(folder).parent


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
    assert there["there"] == there["of"] == 2 * (3 * 6 + 3)
    assert found["digest"] == json.loads((made / "certificate.json").read_bytes())["digest"]
    assert verify(made, capsys, "--published", found["digest"])[0] == 0
    code, found = verify(made, capsys, "--published", "0" * 64)
    assert code == 1 and "published" in found["faults"][0]["what"]


# Twelve manipulations -----------------------------------------------------------------------


def recoded(
    film: Path, change: Callable[[list[Any]], Any], frames: Path | None = None
) -> tuple[Any, ...]:
    """Develop a film's frames, change the pictures, encode it as before; the pictures' prints."""
    files = sorted((frames or film).with_suffix(".frames").glob("*.exr"))
    pictures = [np.array(each) for each in developed(files)]
    change(pictures)
    return encode(pictures, film, size=SIZE, fps=10)


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

    recoded(folder / GREY, warmer)


def paint(pictures):
    for picture in pictures:
        picture[20:28, 60:66] = (0.35, 0.3, 0.3)  # 48 of 5184 pixels


def person(folder):
    recoded(folder / GREY, paint)


def frames_swapped(folder):
    def swapped(pictures):
        pictures[2], pictures[3] = pictures[3], pictures[2]

    recoded(folder / GREY, swapped)


def black(folder):
    def darkened(pictures):
        pictures[4] = np.zeros_like(pictures[4])

    recoded(folder / GREY, darkened)


def truncated(folder):
    recoded(folder / GREY, lambda pictures: pictures.pop())


def other_frame(folder):
    frames = folder / "materials"
    shutil.copy(frames / "clear.frames" / "000003.exr", frames / "grey.frames" / "000003.exr")


def one_pixel(folder):
    changed_pixel(folder / "materials" / "grey.frames" / "000002.exr")


def changed_pixel(path: Path) -> None:
    """Brighten a pixel of a stored frame."""
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


WORDS = {
    swap: "is materials/clear.mp4, not the film",
    frames_swapped: "it is that of frame",
    other_frame: "is materials/clear.frames/000003.exr, not the frame",
    truncated: "has 5 pictures of 6",
}


def test_a_film_that_was_encoded_again_has_its_pictures_and_another_digest(made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    recoded(folder / GREY, lambda pictures: pictures)
    code, found = verify(folder, capsys, "--quick")
    what = "is not the film that was written"  # its comment is missing
    fault = {"link": "films", "file": GREY, "frame": None, "what": what}
    assert (code, found["faults"]) == (1, [fault])


@pytest.mark.parametrize("manipulate", MANIPULATIONS, ids=lambda each: each.__name__)
def test_a_folder_that_was_manipulated_is_not_proven(manipulate, made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    manipulate(folder)
    code, found = verify(folder, capsys)
    link, file, frames = MANIPULATIONS[manipulate]
    told = [(each["link"], each["file"]) for each in found["faults"]]
    assert code == 1 and set(told) == {(link, file), *ALSO.get(manipulate.__name__, ())}
    assert any(each["frame"] in frames for each in found["faults"]), found["faults"]
    said = WORDS.get(manipulate, "")
    assert any(said in each["what"] for each in found["faults"]), found["faults"]


ALSO = {
    "truncated": [("pictures", "certificate.json")],
    "account": [("films", GREY), ("folder", "materials/grey.json")],
    "sealed_account": [("films", GREY), ("folder", "materials/grey.json")],
    "certificate": [("folder", "certificate.html")],
    "input_file": [("inputs", "study.json")],
}
"""What else is no longer as it was said to be, by what was done."""


@pytest.mark.parametrize("name", FOLDERS)
def test_what_an_outsider_did_to_a_folder_is_found(name, made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    published = json.loads((made / "certificate.json").read_bytes())["digest"]
    change = FOLDERS[name]
    change.change(folder)
    code, found = verify(folder, capsys, *(["--published", published] if change.published else []))
    told = [f"{each['file']}: {each['what']}" for each in found["faults"]]
    assert code == 1 and is_said(change.said, told), told


def test_words_that_other_code_chose_are_not_compared_and_that_is_said(made, tmp_path, capsys):
    """A reworded page was found by its digest alone, and nothing told so."""
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    assert not any("words" in note for note in verify(folder, capsys, "--quick")[1]["notes"])

    def reworded(said):
        said["worded_by"] = "an earlier version"
        said["pairs"][0].update(acts="the sun", not_tested=[])

    edited(folder / "certificate.json", reworded, seal=True)
    signed_anew(folder)
    code, found = verify(folder, capsys)
    assert (code, found["faults"]) == (0, [])
    (note,) = (note for note in found["notes"] if "words" in note)
    assert note.startswith("not compared: the words of certificate.html and certificate.json")
    # With the same code each of them is a fault.
    edited(folder / "certificate.json", lambda said: said.update(worded_by=OWN), seal=True)
    signed_anew(folder)
    told = {each["what"] for each in verify(folder, capsys)[1]["faults"]}
    assert "does not say what certificate.json says" in told
    assert "clear and grey: says otherwise than its frames: acts" in told


def test_what_systems_and_people_leave_in_a_folder_is_no_fault(made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    for name in (".DS_Store", "materials/Thumbs.db", "data/answers.csv", "notes.md"):
        (folder / name).write_text("x", encoding="utf-8")
    assert verify(folder, capsys)[0] == 0


# Replay -------------------------------------------------------------------------------------


def test_frames_that_are_drawn_by_lot_are_rendered_anew_bit_by_bit(made, tmp_path, capsys):
    code, found = verify(made, capsys, "--replay", "1")
    assert (code, found["faults"]) == (0, [])
    assert found["notes"][0].startswith("rendered anew: ")
    # Whoever forges frames, and all that is said of them, is found when one is drawn.
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    for path in sorted(folder.glob("materials/*.frames/*.exr")):
        changed_pixel(path)
    resigned(folder, lambda name, said: said.update(files=rehashed(folder, said["files"])))
    code, found = verify(folder, capsys, "--replay", "1")
    (fault,) = (each for each in found["faults"] if each["link"] == "replay")
    assert code == 1 and fault["file"].endswith(".exr")
    assert "1 of 5184 pixels are others" in fault["what"]


def test_films_that_were_forged_with_all_digests_are_found_by_replay_or_publication(
    made, tmp_path, capsys
):
    folder = tmp_path / "out"
    shutil.copytree(made, folder, ignore=shutil.ignore_patterns("*.exr"))
    published = json.loads((made / "certificate.json").read_bytes())["digest"]

    def painted(name, account):
        film = folder / "materials" / f"{name}.mp4"
        prints = recoded(film, paint, frames=made / "materials" / film.name)
        codec = account["delivered"][film.name]["codec"]
        account["delivered"][film.name] = delivered(film, prints, codec=codec, size=SIZE)

    resigned(folder, painted)
    code, found = verify(folder, capsys)
    # Who can write all digests anew is not found so, but for the certificate's page, which is
    # written no less easily.
    assert {each["file"] for each in found["faults"]} <= {"certificate.html"}
    assert verify(folder, capsys, "--published", published)[0] == 1
    code, found = verify(folder, capsys, "--replay", "1")
    (fault,) = (each for each in found["faults"] if each["link"] == "replay")
    assert code == 1 and fault["file"].endswith(".mp4")


def rehashed(folder: Path, files: dict[str, str]) -> dict[str, str]:
    """Digests of files as they are now."""
    return {name: file_hash(folder / "materials" / name) for name in files}


def resigned(folder: Path, change: Callable[[str, dict[str, Any]], Any]) -> None:
    """Change the accounts of all films, and write all digests anew that tell of it."""
    for name in ("clear", "grey"):
        edited(folder / "materials" / f"{name}.json", partial(change, name), seal=True)
    signed_anew(folder)


def test_a_replay_without_inputs_is_refused_in_one_sentence(made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder, ignore=shutil.ignore_patterns("*.exr"))
    (folder / "inputs" / "fcd.xml").unlink()
    assert main(["study", "verify", str(folder), "--replay", "1", "-q"]) == 2
    said = capsys.readouterr().err
    assert "a replay needs the study's inputs" in said and said.count("\n") == 1


def test_a_machine_that_cannot_render_says_nothing_against_the_folder(made, tmp_path):
    """A machine without libatomic ended with 1, which means that something is wrong."""
    said = "libatomic.so.1: cannot open shared object file: No such file or directory"
    (tmp_path / "drjit.py").write_text(f"raise ImportError({said!r})\n", encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    words = [sys.executable, "-m", "sumo3dviz_pt.cli", "study", "verify", str(made), "-q"]
    env = {**os.environ, "PYTHONPATH": path}

    def verified(*more):
        done = subprocess.run([*words, *more], env=env, check=False, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    code, out, _ = verified("--quick")
    assert code == 0 and "proven: 2 films" in out
    for more in ((), ("--quick", "--replay", "1")):  # developing frames needs the renderer, too
        code, out, said = verified(*more)
        assert code == 2 and not out and "nothing was verified: drjit cannot be loaded" in said
        assert "--quick without --replay needs no renderer" in said


def test_damaged_files_are_faults_and_no_accidents(made, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(made, folder, ignore=shutil.ignore_patterns("*.exr"))
    grey = json.loads((made / "materials" / "grey.json").read_bytes())
    half = {"scene": {}, "frames": [{}], "files": {}, "inputs": {}, "delivered": {}, "x": 1}
    endless = json.dumps(grey).replace('"codec_error": [', '"codec_error": [NaN, ')
    for name, texts in {
        "certificate.json": ("[]", "{", '{"pairs": 3}', '{"pairs": [{}], "digests": 3}'),
        "materials/grey.json": ("", "{}", json.dumps(half), json.dumps(sealed(half)), endless),
        "study.json": ('{"films": {"grey": 3}}',),
    }.items():
        for text in texts:
            (folder / name).write_text(text, encoding="utf-8")
            code, found = verify(folder, capsys, "--quick")
            assert code == 1 and name in {each["file"] for each in found["faults"]}, text
        shutil.copy(made / name, folder / name)
    away = {"films": {"grey": {"file": "../elsewhere.mp4"}}}
    (folder / "study.json").write_text(json.dumps(away), encoding="utf-8")
    assert main(["study", "verify", str(folder), "-q"]) == 2
    assert "names a film outside of the folder" in capsys.readouterr().err


def test_a_study_that_was_packed_is_proven_where_it_is_unpacked(made, tmp_path, capsys):
    pack, folder = tmp_path / "a.zip", tmp_path / "elsewhere"
    assert main(["study", "pack", str(made), "-o", str(pack)]) == 0
    assert main(["study", "unpack", str(pack), "-o", str(folder)]) == 0
    code, found = verify(folder, capsys)
    assert (code, found["faults"]) == (0, [])
    assert found["pictures"] == {"decoded": 12, "developed": 0}
    assert found["frames"]["there"] == 0
    assert [note.partition(":")[0] for note in found["notes"]] == ["not tested", "not developed"]


def test_what_is_no_study_is_refused(tmp_path, capsys):
    assert main(["study", "verify", str(tmp_path), "-q"]) == 2
    assert "holds no study.json" in capsys.readouterr().err


# The page -----------------------------------------------------------------------------------


@skip_if(chromium() is None, "there is no Chromium on the PATH")
@pytest.mark.parametrize("times", [1, 40])
def test_the_page_is_printed_on_two_sheets_of_a4(times, made, tmp_path):
    content = json.loads((made / "certificate.json").read_bytes())
    (factor,), (pair,) = content["factors"].values(), content["pairs"]
    long = {**factor, "about": "how long it is until somebody comes, in seconds " * 4}
    content["factors"] = {f"light{n}": long for n in range(times)}
    content["pairs"] = [{**pair, "factor": name, "claim": "failed"} for name in content["factors"]]
    told = ("factor", "levels", "one", "other", "acts", "faults")
    verdicts = [PairVerdict(*(each[key] for key in told)) for each in content["pairs"]]
    page = write_page(tmp_path / "certificate.html", content, verdicts)
    command = [str(chromium()), "--headless", "--no-sandbox", "--disable-gpu"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", "--no-pdf-header-footer"]
    command += [f"--print-to-pdf={tmp_path / 'a.pdf'}", page.as_uri()]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    pdf = (tmp_path / "a.pdf").read_bytes()
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) == 2
    boxes = re.findall(rb"/MediaBox\s*\[\s*0\s+0\s+([\d.]+)\s+([\d.]+)", pdf)
    assert {(round(float(a)), round(float(b))) for a, b in boxes} == {(595, 842)}
