"""A study from its file to a folder: films that differ, nothing lost, only what changed anew."""

from __future__ import annotations

import csv
import hashlib
import json
import shutil
from dataclasses import replace

import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.pipeline.studies.file import load_study
from sumo3dviz_pt.pipeline.studies.plan import plan_study
from sumo3dviz_pt.pipeline.studies.run import StudyOrder, check_study, film_tasks, run_study

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
    for name in ("study.json", "inputs.sha256", "index.html", "README.md"):
        assert str(place) not in (made / name).read_text("utf-8")


def test_a_film_that_was_lost_comes_back_with_the_same_bytes(made, place, tmp_path):
    plan, folder = plan_in(place), tmp_path / "out"
    shutil.copytree(made, folder)
    (folder / "materials" / "grey.mp4").unlink()
    order = StudyOrder(folder, resume=True, discard_frames=True, variant="scalar")
    assert [task.stimulus.name for task in film_tasks(plan, order)] == ["grey"]
    # The command line is part of a film's account.
    account = json.loads((made / "materials" / "grey.json").read_text("utf-8"))
    order = replace(order, command=account["command"])
    assert len(list(run_study(plan, order))) == 1
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
