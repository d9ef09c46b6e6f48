"""`methods.md`: what the plan and records say, in sentences that a paper can take."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from make_corpus import CORPUS

from sumo3dviz_pt.studies.certificate.certificate import Certificate, verdicts_in
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.methods import FILE, FLIP, RMSE, write_methods
from sumo3dviz_pt.studies.plan import StudyPlan, plan_study
from sumo3dviz_pt.studies.records import noted_films
from sumo3dviz_pt.studies.tools.datasets import digest_of

BENCH = Path(__file__).resolve().parents[3] / "docs" / "_bench"
SHORTEST, LONGEST = 250, 450
"""Words of the page."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a small study, with its film's records."""
    shutil.copytree(CORPUS / "v0.1" / "town", tmp_path / "town")
    shutil.copytree(CORPUS / "v0.1" / "study_file", tmp_path / "study_file")
    return shutil.copytree(CORPUS / "v0.1" / "study", tmp_path / "study")


def plan_of(folder: Path, more: str = "") -> StudyPlan:
    path = folder.parent / "study_file" / "study.yaml"
    path.write_text(path.read_text(encoding="utf-8") + more, encoding="utf-8")
    return plan_study(load_study(path))


def certificate_in(folder: Path) -> Certificate:
    content = json.loads((folder / "certificate.json").read_bytes())
    return Certificate(tuple(verdicts_in(content)), ())


def written(folder: Path, plan: StudyPlan, certificate: Certificate | None) -> str:
    path = write_methods(folder, plan, noted_films(folder), certificate=certificate)
    assert path == folder / FILE
    return path.read_text(encoding="utf-8")


def test_it_says_what_plan_and_records_say(folder: Path) -> None:
    text = written(folder, plan_of(folder), certificate_in(folder))
    account = json.loads((folder / "materials" / "red.json").read_bytes())
    for fact in (
        *("# Methods: Paint", "2 films", "a full factorial design of 1 factor: paint, colour of"),
        *("levels red, blue", "2 playlists with the order `latin`", "the seed 4"),
        *("The log's step was 1 s.", "smoother `lane`", "1.5 cm (root mean square)"),
        *("The camera stood at (30, -22, 6)", "The sun stood at azimuth", "dry and clear summer"),
        *("32x18 pixels at 10 frames per second and lasted 0.2 s", "`draft`", "FLIP of 0.075"),
        *("(variant llvm)", f"sumo3dviz_pt {account['versions']['sumo3dviz_pt']}"),
        *("In 1 of 1 pair only what the factor acts on differed.", "seed was 3", "Ada Lovelace"),
        *("under CC-BY-4.0", digest_of(folder / "study.json"), account["package"]["code"]),
    ):
        assert fact in text, fact
    assert SHORTEST <= len(text.split()) <= LONGEST


def test_it_is_plain_sentences_in_the_past_tense(folder: Path) -> None:
    head, *paragraphs = written(folder, plan_of(folder), None).strip().split("\n\n")
    assert head.startswith("# ") and all(re.match(r"\*\*[A-Z]\w+\.\*\* ", p) for p in paragraphs)
    assert all(p.endswith(".") and "\n" not in p for p in paragraphs)
    assert "Films were not compared with each other." in paragraphs[3]


def test_what_failed_is_said(folder: Path) -> None:
    good = certificate_in(folder)
    (pair,) = good.pairs
    failed = replace(good, pairs=(replace(pair, faults=("the sky differs",)),))
    text = written(folder, plan_of(folder), failed)
    assert "In 0 of 1 pair" in text and "1 pair failed." in text
    unsure = replace(good, pairs=(replace(pair, not_judged=("another view",)),))
    assert "1 pair could not be judged." in written(folder, plan_of(folder), unsure)


def test_a_large_study_still_has_one_page(folder: Path) -> None:
    """Every level has a sky, a sun and a preset of its own, and words are long."""
    skies = ", ".join(
        f"l{n}: {{sky: {{sun: {{azimuth: {20 * n}, elevation: {5 + 3 * n}}}}}}}" for n in range(12)
    )
    others = "".join(
        f"  f{n}: {{about: {'long words ' * 30}, levels: {{a: {{}}, b: {{}}}}}}\n" for n in range(5)
    )
    path = folder.parent / "study_file" / "study.yaml"
    text = path.read_text(encoding="utf-8").replace("factors:\n", f"factors:\n{others}")
    path.write_text(
        text.replace("seed: 4", f"  hour: {{levels: {{{skies}}}}}\nseed: 4\ndesign: fraction"),
        encoding="utf-8",
    )
    plan = plan_study(load_study(path))
    films = {each.name: noted_films(folder)["red"] for each in plan.stimuli}
    for each in plan.stimuli:
        shutil.copy(folder / "materials" / "red.json", folder / "materials" / f"{each.name}.json")
    page = write_methods(folder, plan, films, certificate=certificate_in(folder))
    text = page.read_text(encoding="utf-8")
    assert "and 8 more" in text and "(by level)" in text
    assert SHORTEST <= len(text.split()) <= LONGEST


def test_errors_are_those_that_were_measured() -> None:
    presets = json.loads((BENCH / "presets.json").read_bytes())["presets"]
    assert {each["preset"]: round(each["errors"]["flip"], 3) for each in presets} == FLIP
    rows = (BENCH / "motion.md").read_text(encoding="utf-8")
    table = rows.partition("### All smoothers, logs of 1 s")[2].partition("\n### ")[0]
    measured = re.findall(r"^\| `(\w+)`, held out \| ([\d.]+) \|", table, re.M)
    assert {name: float(error) for name, error in measured} == RMSE
