"""A study from its file to a folder: films that differ, nothing lost, only what changed anew."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from builders import fcd_xml, write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.pipeline.films.film import prepared
from sumo3dviz_pt.pipeline.films.orders import FilmOrder
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.run import (
    StudyOrder,
    check_study,
    film_tasks,
    finish_study,
    render_task,
)

pytestmark = pytest.mark.slow

STUDY = """scene: scene.yaml
clip: {camera: post, from: 2, to: 2.2}
common: {quality: draft, output.size: [32, 18]}
factors:
  light:
    about: the sky
    levels:
      clear: {sky: {preset: sky_blue}}
      grey: {sky: {preset: sky_overcast}}
  price: {levels: {low: {}, high: {}}}
certificate: {write: false}
report: {write: false}
tools: {url: "https://example.org/s"}
"""

MEASURED = STUDY.replace("certificate: {write: false}\nreport: {write: false}\n", "").replace(
    "to: 2.2}\ncommon: {", "to: 2.6}\ncommon: {output.fps: 25, "
)
"""With certificate and report, and films in which there is time to be broken off."""

OVERLAID = MEASURED.replace(
    "[32, 18]",
    """[32, 18], overlays: {
  text: [{text: Look, size: 0.5}], before: [{show: fixation, seconds: 0.4}]}""",
)

CLI = [sys.executable, "-m", "sumo3dviz_pt.cli"]


def plan_in(folder, text=STUDY):
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    return plan_study(load_study(folder / "study.yaml"))


def digests(folder):
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    write_scenario(folder, vehicles=2)
    return folder


@pytest.fixture(scope="module")
def made(place):
    """A whole study, by the command."""
    plan_in(place)
    folder = place / "out"
    arguments = ["study", str(place / "study.yaml"), "-o", str(folder), "--variant", "scalar"]
    assert main([*arguments, "--discard-frames"]) == 0
    return folder


def test_the_folder_holds_films_tables_and_digests(made):
    names = set(digests(made))
    assert {"materials/clear.mp4", "materials/grey.mp4", "index.html", "study.json"} <= names
    listed = dict(
        reversed(line.split("  "))
        for line in (made / "checksums.sha256").read_text("utf-8").splitlines()
    )
    assert listed == {k: v for k, v in digests(made).items() if k != "checksums.sha256"}
    (table,) = (made / "data").glob("*description-stimuli*")
    rows = list(csv.DictReader(table.read_text("utf-8").splitlines()))
    assert {(row["light"], row["price"]) for row in rows} == {
        (light, price) for light in ("clear", "grey") for price in ("low", "high")
    }
    assert {row["film"] for row in rows} == {"materials/clear.mp4", "materials/grey.mp4"}
    assert {row["duration"] for row in rows} == {"0.2"}


def test_the_record_names_the_pair_and_no_path_of_this_machine(made, place):
    record = json.loads((made / "study.json").read_text("utf-8"))
    (pair,) = record["pairs"]
    assert (pair["factor"], pair["one"], pair["other"]) == ("light", "clear", "grey")
    assert pair["changed"] == ["sky.preset: sky_blue -> sky_overcast"]
    assert not record["notes"]


def test_no_file_of_a_study_or_a_film_tells_of_this_machine(made, place, tmp_path):
    """Accounts told the command, and it the whole path of the study file."""
    words = ["render", str(place / "scene.yaml"), "-o", str(tmp_path / "film.mp4")]
    small = ["--set", "output.size=[32, 18]", "--from", "4", "--to", "4.1", "--quality", "draft"]
    assert main([*words, *small, "--variant", "scalar"]) == 0
    assert len(digests(tmp_path)) == 4
    for folder in (made, tmp_path):
        for path in folder.rglob("*"):
            content = path.read_bytes() if path.is_file() else b""
            for word in (place, tmp_path, f"{Path.home()}/"):
                assert str(word).encode() not in content, path


def test_a_pack_makes_the_same_films_elsewhere(made, tmp_path):
    pack, there = tmp_path / "study.zip", tmp_path / "there"
    assert main(["study", "pack", str(made), "-o", str(pack)]) == 0
    assert main(["study", "unpack", str(pack), "-o", str(there)]) == 0
    assert digests(there) == digests(made)
    words = ["study", str(there / "inputs" / "study.yaml"), "-o", str(tmp_path / "again")]
    assert main([*words, "--variant", "scalar", "--discard-frames"]) == 0
    again, once = digests(tmp_path / "again"), digests(made)
    other = {name for name in again | once if again.get(name) != once.get(name)}
    # Accounts tell the command, and lists their digests.
    assert not [name for name in other if name.startswith("inputs/") or name.endswith(".mp4")]


def test_a_film_that_was_lost_comes_back_with_the_same_bytes(made, place, tmp_path):
    plan, folder = plan_in(place), tmp_path / "out"
    shutil.copytree(made, folder)
    (folder / "materials" / "grey.mp4").unlink()
    order = StudyOrder(folder, resume=True, discard_frames=True, variant="scalar")
    assert [task.stimulus.name for task in film_tasks(plan, order)] == ["grey"]
    # The command line is part of a film's account.
    account = json.loads((made / "materials" / "grey.json").read_text("utf-8"))
    order = replace(order, command=account["command"])
    check_study(plan, order)
    (missing,) = film_tasks(plan, order)
    render_task(plan, order, missing)
    finish_study(plan, order)
    assert digests(folder) == digests(made)


def test_only_the_level_that_changed_is_rendered_anew(made, place, tmp_path):
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    before = digests(folder)
    changed = plan_in(place, STUDY.replace("sky_overcast", "sky_blue, rotation: 90"))
    order = StudyOrder(folder, resume=True, variant="scalar")
    assert [task.stimulus.name for task in film_tasks(changed, order)] == ["grey"]
    renamed = plan_in(place, STUDY.replace("grey:", "dull:"))
    assert [task.stimulus.name for task in film_tasks(renamed, order)] == ["dull"]
    assert digests(folder) == before


def test_films_are_not_overwritten_without_an_order(made, place):
    plan = plan_in(place)
    with pytest.raises(ConfigError, match="--resume keeps what fits, --overwrite replaces all"):
        check_study(plan, StudyOrder(made, variant="scalar"))


METERED = STUDY.replace("common: {", "common: {cameras.post.exposure: auto, ")


def test_a_film_that_is_made_alone_has_the_exposure_of_all(place, tmp_path):
    """Each machine metered its own film, so that films of one study were developed otherwise."""
    (place / "metered.yaml").write_text(METERED, encoding="utf-8")
    plan = plan_study(load_study(place / "metered.yaml"))
    first, last = plan.stimuli
    words = ["study", str(place / "metered.yaml"), "-o", str(tmp_path), "--variant", "scalar"]
    assert main([*words, "--film", last.name]) == 0
    account = json.loads((tmp_path / "materials" / f"{last.name}.json").read_text("utf-8"))

    def metered(stimulus):
        order = FilmOrder(tmp_path / "a.mp4")
        return prepared(stimulus.job, Request(variant="scalar"), order).metered

    assert account["exposure"] == metered(first) != metered(last)
    order = StudyOrder(tmp_path, resume=True, variant="scalar")
    assert [task.stimulus.name for task in film_tasks(plan, order)] == [first.name]
    assert film_tasks(plan, order)[0].request.metered == account["exposure"]


@pytest.fixture(scope="module")
def whole(place):
    """A study with certificate and report, in one go."""
    (place / "measured.yaml").write_text(MEASURED, encoding="utf-8")
    study(place, "whole")
    return place / "whole"


def study(place, output, *more, name="measured.yaml"):
    """Make a study by a command of its own."""
    words = [*CLI, "study", name, "-o", str(output), "-q", *more]
    done = subprocess.run(words, cwd=place, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.skipif(os.name == "nt", reason="a process there is asked to end in another way")
def test_a_study_that_was_broken_off_and_gone_on_with_has_the_same_bytes(whole, place):
    broken = place / "broken"
    command = [*CLI, "study", "measured.yaml", "-o", "broken", "-q"]
    with subprocess.Popen(command, cwd=place, stderr=subprocess.DEVNULL) as process:
        frames = broken / "materials" / "clear.frames"  # of the second film
        while not list(frames.glob("*.exr")):
            assert process.poll() is None, "it ended before it could be broken off"
            time.sleep(0.01)
        process.send_signal(signal.SIGTERM)
        assert process.wait() == 130
    assert (broken / "materials" / "grey.mp4").is_file()
    assert not (broken / "materials" / "clear.mp4").exists()
    wanted = len(list((whole / "materials" / "clear.frames").glob("*.exr")))
    assert len(list(frames.glob("*.exr"))) < wanted == 15
    study(place, "broken", "--resume")
    found, once = digests(broken), digests(whole)
    assert {name for name in found | once if found.get(name) != once.get(name)} == set()
    assert {"certificate.json", "report.json", "materials/clear.json"} <= set(found)


def test_a_level_that_changes_leaves_the_other_films_as_they_lie(whole, place, tmp_path):
    folder = tmp_path / "out"
    shutil.copytree(whole, folder)

    def stamps(level):
        own = [path for path in (folder / "materials").rglob("*") if path.is_file()]
        names = [path.relative_to(folder).as_posix() for path in own]
        of_level = [n for n in names if n.startswith(f"materials/{level}.")]
        return {n: ((folder / n).stat().st_mtime_ns, digests(folder)[n]) for n in of_level}

    clear, grey = stamps("clear"), stamps("grey")
    changed = MEASURED.replace("sky_overcast", "sky_overcast, rotation: 90")
    (place / "changed.yaml").write_text(changed, encoding="utf-8")
    study(place, folder, "--resume", name="changed.yaml")
    assert len(clear) > 45 and stamps("clear") == clear
    film = "materials/grey.mp4"
    assert stamps("grey")[film][1] != grey[film][1]
    record = json.loads((folder / "study.json").read_text("utf-8"))
    assert "sky.rotation: 0.0 -> 90.0" in record["pairs"][0]["changed"]


LOG = """scene: scene.yaml
clip: {camera: post, from: 4, to: 4.2}
common: {quality: draft, output.size: [64, 36]}
factors:
  gap: {levels: {short: {}, long: {scenario: {trajectories: other.xml}}}}
certificate: {frames: 2}
report: {write: false}
calibration: null
"""


def test_a_level_that_swaps_the_log_is_not_read_as_proof_of_a_gap(tmp_path, capsys):
    """It was certified as different in its factor alone, whatever else moved otherwise."""
    write_scenario(tmp_path, vehicles=4)
    other = fcd_xml(vehicles=3).replace('id="v0"', 'id="w0"')
    (tmp_path / "other.xml").write_text(other, encoding="utf-8")
    (tmp_path / "study.yaml").write_text(LOG, encoding="utf-8")
    out = tmp_path / "out"
    assert main(["study", str(tmp_path / "study.yaml"), "-o", str(out), "-q"]) == 0
    assert "alone; in 1 of them everything that moves may differ" in capsys.readouterr().out
    assert main(["study", "verify", str(out), "-q"]) == 0
    said = "its levels change the whole traffic log, so everything that moves may differ: of 5 road"
    assert f"note: not tested: gap: short and long: {said}" in capsys.readouterr().out
    page = (out / "certificate.html").read_text("utf-8")
    assert said in page and "3 are in one of them only and 0 of the others move" in page


def measures(path):
    """What a report says of films, but for the size of the files that are delivered."""
    rows = csv.DictReader(path.read_text("utf-8").splitlines())
    files = ("megabytes", "load_")
    return [{k: v for k, v in row.items() if not k.startswith(files)} for row in rows]


def test_a_study_with_overlays_is_measured_on_the_films_without_them(whole, place):
    """What is drawn over films, and the pictures before them, are in no measurement."""
    (place / "overlaid.yaml").write_text(OVERLAID, encoding="utf-8")
    study(place, "overlaid", "--discard-frames", name="overlaid.yaml")
    folder = place / "overlaid"
    found, plain = digests(folder), digests(whole)
    for level in ("clear", "grey"):
        film = f"materials/{level}.mp4"
        assert found[f"materials/{level}.plain.mp4"] == plain[film] != found[film]
    assert found["report/frames.csv"] == plain["report/frames.csv"]
    rows = [measures(one / "report" / "films.csv") for one in (folder, whole)]
    assert rows[0] == rows[1]
    pairs = [
        json.loads((one / "certificate.json").read_bytes())["pairs"] for one in (folder, whole)
    ]
    assert pairs[0] == pairs[1]
    for made, seconds in ((whole, "0.6"), (folder, "1.0")):
        (table,) = (made / "data").glob("*description-stimuli*")
        rows = list(csv.DictReader(table.read_text("utf-8").splitlines()))
        assert {row["duration"] for row in rows} == {seconds}
    # Frames that are gone are not tested, and their digests stand for them.
    assert main(["study", "verify", str(folder), "-q"]) == 0
    # What is measured can be measured again: of a film's own frames, not of pictures before it.
    study(place, "overlaid", "--resume", "--discard-frames", name="overlaid.yaml")
    again = digests(folder)
    assert {name for name in found | again if found.get(name) != again.get(name)} == set()


def test_a_report_without_a_certificate_tells_visible_shares_and_can_be_made_again(whole, place):
    """No layer was traced for it, and the shares were missing without a word."""
    text = MEASURED + "certificate: {write: false}\n"
    (place / "reported.yaml").write_text(text, encoding="utf-8")
    study(place, "reported", "--discard-frames", name="reported.yaml")
    folder = place / "reported"
    rows = list(csv.DictReader((folder / "report" / "shares.csv").read_text("utf-8").splitlines()))
    for name in ("clear", "grey"):
        for frame in range(15):
            of_frame = [r for r in rows if (r["stimulus"], r["frame"]) == (name, str(frame))]
            classes = [float(row["share"]) for row in of_frame if row["kind"] == "class"]
            assert len(classes) > 2 and sum(classes) == pytest.approx(1.0, abs=1e-5)
    kept = sorted(path.name for path in (folder / "materials" / "clear.frames").glob("*.exr"))
    assert kept == [f"{number:06d}.exr" for number in (0, 4, 7, 10, 14)]
    once = digests(folder)
    # Which layers lie beside a film is no part of it.
    films = [f"materials/{name}.mp4" for name in ("clear", "grey")]
    assert [once[film] for film in films] == [digests(whole)[film] for film in films]
    study(place, "reported", "--resume", "--discard-frames", name="reported.yaml")
    again = digests(folder)
    assert {name for name in once | again if once.get(name) != again.get(name)} == set()
