"""The certificate: clean pairs are proven, and no seeded violation gets through.

By night there are the pairs whose violations need it; `bench/violations.py` has all twelve. Most
violations are seeded into what accounts, levels and stored frames say (`tests/violations.py`);
some are rendered anew, so that what they look like is true, too.
"""

from __future__ import annotations

import csv
import gzip
import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from builders import write_scenario
from violations import FACTORS, Films, all_violations, confounded, write_study

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.films.film import FilmOrder, render_film
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.records import film_path

pytestmark = pytest.mark.slow

BY_NIGHT = ("ahead", "gap")
PAIRS = [*((factor, "day") for factor in FACTORS), *((factor, "night") for factor in BY_NIGHT)]
FILMS = len(PAIRS) + 2
"""Two more than pairs: by each light the one that the others differ from."""

CLAIMS = len(PAIRS) + 1 + len(BY_NIGHT)
"""Pairs of one factor: those, and films by day and by night that are alike in all else."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return write_study(tmp_path_factory.mktemp("certificate") / "crossing", by_night=BY_NIGHT)


@pytest.fixture(scope="module")
def made(study):
    """A whole study, by the command."""
    out = study.parent / "out"
    assert main(["study", str(study), "-o", str(out)]) == 0
    return Films(plan_study(load_study(study)), out)


def test_all_pairs_of_the_clean_study_are_proven(made):
    said = json.loads((made.folder / "certificate.json").read_text("utf-8"))
    assert said["passed"]
    assert len([pair for pair in said["pairs"] if " and " not in pair["factor"]]) == CLAIMS
    assert all(pair["differing"] > 0 and pair["wrong"] == 0 for pair in said["pairs"])
    assert {pair["claim"] for pair in said["pairs"]} == {"proven"}
    light = next(pair for pair in said["pairs"] if pair["factor"] == "light")
    assert any(word.startswith("exposure") for word in light["named"])
    ahead = next(pair for pair in said["pairs"] if pair["factor"] == "ahead")
    assert ahead["things"][0]["name"] == "vehicle:traffic_W_E.52"


def test_the_page_is_whole_and_lies_among_the_checksums(made):
    page = (made.folder / "certificate.html").read_text("utf-8")
    said = json.loads((made.folder / "certificate.json").read_text("utf-8"))
    assert page.count("<img alt=") == len(said["pairs"]) >= CLAIMS
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    assert "certificate.html" in (made.folder / "checksums.sha256").read_text("utf-8")


def table(made: Films, name: str) -> list[dict[str, str]]:
    path = made.folder / "report" / f"{name}.csv"
    return list(csv.DictReader(path.read_text("utf-8").splitlines()))


def test_the_report_tells_light_traffic_and_shares(made):
    films = {row["stimulus"]: row for row in table(made, "films")}
    assert len(films) == FILMS
    names = [made.pair("ahead", light).one for light in ("day", "night")]
    day, night = (float(films[name]["scene_mean"]) for name in names)
    assert day > 100 * night > 0
    rain = films[made.pair("water", "day").other]
    assert day > 2 * float(rain["scene_mean"])
    assert 0 < float(rain["shown_mean"]) < 100 and 0 < float(rain["clutter"]) < 1
    ridden = [row for row in table(made, "traffic") if row["role"] == "ridden"]
    assert {row["road_user"] for row in ridden} == {"vehicle:traffic_W_E.54"}
    assert {row["leader"] for row in ridden} == {"vehicle:traffic_W_E.52"}
    ahead = [row for row in table(made, "shares") if row["name"] == "vehicle:traffic_W_E.52"]
    assert len(ahead) == 2 * FILMS and all(0.01 < float(row["share"]) < 0.5 for row in ahead)


def test_the_report_tells_of_observers_and_what_boards_ask(made, tmp_path):
    ahead = [row for row in table(made, "observer") if row["road_user"].endswith("W_E.52")]
    assert len(ahead) == 2 * FILMS and {row["observer"] for row in ahead} == {"camera"}
    assert all(0.5 < float(row["seen"]) <= 1.0 for row in ahead)
    assert all(int(row["pixels"]) > 50 and 2 < float(row["angular_width"]) < 60 for row in ahead)
    said = json.loads((made.folder / "report.json").read_text("utf-8"))["safety"]["films"]
    assert len(said) == FILMS and not any(film["too_often"] for film in said.values())
    assert all(film["megabytes"] > 0 and film["load_5"] > 0 for film in said.values())
    assert "What ethics boards ask" in (made.folder / "report.html").read_text("utf-8")
    assert main(["study", "gaze", str(made.folder), "-o", str(tmp_path)]) == 0
    boxes = csv.DictReader((tmp_path / "boxes.csv").read_text("utf-8").splitlines())
    pixels = {
        (row["film"], row["frame"]): row["pixels"]
        for row in boxes
        if row["thing"].endswith("W_E.52")
    }
    assert pixels == {(row["stimulus"], row["frame"]): row["pixels"] for row in ahead}


def test_effects_show_what_factors_do(made):
    said = json.loads((made.folder / "report.json").read_text("utf-8"))
    shares = {(each["factor"], each["measure"]): each["eta_squared"] for each in said["effects"]}
    assert shares["light", "scene_mean"] > 0.4 > shares["trees", "scene_mean"]
    assert shares["trees", "share vegetation"] > 0.5
    assert shares["light", "speed"] == 0.0
    assert "Eta squared" in (made.folder / "report.html").read_text("utf-8")


@pytest.mark.parametrize(("factor", "light"), PAIRS)
def test_a_clean_pair_has_no_faults(made, factor, light):
    assert not made.judge(factor, light).faults


SEEDED = {name: each for name, each in all_violations().items() if not each.folder}
"""Folders are manipulated in `test_verify.py`."""


@pytest.mark.parametrize("name", SEEDED)
def test_a_seeded_violation_is_said(made, study, name, tmp_path):
    violation = SEEDED[name]
    if violation.film:
        said = made.judge_film(violation, tmp_path)
    elif violation.level:
        said = confounded(study.parent, violation.level)
    else:
        said = made.judge(violation.factor, violation.light, violation).faults
    assert violation.is_said(said), said


# Violations that are rendered ---------------------------------------------------------------


@dataclass(frozen=True)
class Spoilt:
    """What is done to a film.

    Attributes:
        said: What the certificate says of it.
        values: Of the scene file, by dotted key.
        edit: A file of the simulation, what is found in it, and what takes its place.
        factor: Of the pair whose second film is spoilt, by day.
    """

    said: str
    values: dict[str, object] | None = None
    edit: tuple[str, str, str] | None = None
    factor: str = "ahead"


VEHICLE = ("fcd.xml.gz", r'<vehicle id="traffic_W_E\.49"[^>]*/>', "")
TREES = ("trees.add.xml", r'<poi id="tree_[^>]*/>', "")
SPOILT = {
    "seed": Spoilt(r"seed: 7 -> 8", {"seed": 8}),
    "camera": Spoilt(r"camera is another in", {"cameras.driver.eye_height": 1.354}),
    "time": Spoilt(r"shows 453 s .* and 453\.04 s", {"shots.0.from": 453.04, "shots.0.to": 453.12}),
    "vehicle": Spoilt(r"only one film shows .*vehicle:traffic_W_E\.49", edit=VEHICLE),
    "trees in rain": Spoilt(r"trees\.add\.xml: ", edit=TREES, factor="water"),
}


def edited(place: Path, folder: Path, edit: tuple[str, str, str]) -> Path:
    """A copy of the simulation with something else in one of its files."""
    name, found, instead = edit
    shutil.copytree(place, folder, ignore=shutil.ignore_patterns("out*"))
    path = folder / name
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "rt", encoding="utf-8") as stream:
        before = stream.read()
    after = re.sub(found, instead, before)
    assert after != before
    with opened(path, "wt", encoding="utf-8") as stream:
        stream.write(after)
    return folder


@pytest.mark.parametrize("name", SPOILT)
def test_a_rendered_violation_is_named_and_seen(made, study, tmp_path, name):
    spoilt, out, pair = SPOILT[name], tmp_path / "out", made.pair(SPOILT[name].factor, "day")
    shutil.copytree(made.folder, out)
    source = edited(study.parent, tmp_path / "edited", spoilt.edit) if spoilt.edit else study.parent
    plan = plan_study(load_study(source / "study.yaml"), spoilt.values)
    place = made.plan.films
    profile = next(each for each in place if place[each].name == pair.other)
    film = film_path(out, made.plan, place[profile])
    shutil.rmtree(film.with_suffix(".frames"))
    render_film(plan.films[profile].job, Request(), FilmOrder(film, overwrite=True))
    said = Films(made.plan, out).judge(spoilt.factor, "day").faults
    assert any(re.search(spoilt.said, fault) for fault in said), said
    # Pixels alone tell it, too, when the account keeps silent.
    account = film.with_suffix(".json").name
    shutil.copy(made.folder / "materials" / account, out / "materials" / account)
    silent = Films(made.plan, out).judge(spoilt.factor, "day")
    assert silent.faults and all("where the factor does not act" in each for each in silent.faults)


# Other designs ------------------------------------------------------------------------------

COLOURS = "{{vehicles: {{by_id: {{{0}: {{colour: '{1}'}}}}}}}}"
FRACTION = f"""scene: scene.yaml
clip: {{camera: post, from: 2, to: 2.1}}
factors:
  light:
    levels:
      a: {{sky: {{preset: sky_blue}}}}
      b: {{sky: {{preset: sky_overcast}}}}
      c: {{lights: "on"}}
  road: {{levels: {{a: {{}}, b: {{roads.colour: "#703030"}}, c: {{roads.colour: "#307030"}}}}}}
  first:
    levels:
      a: {COLOURS.format("v0", "#f0f0f0")}
      b: {COLOURS.format("v0", "#b01010")}
      c: {COLOURS.format("v0", "#1010b0")}
  second:
    levels:
      a: {COLOURS.format("v1", "#f0f0f0")}
      b: {COLOURS.format("v1", "#b01010")}
      c: {COLOURS.format("v1", "#1010b0")[:-1]}, output.exposure: 0.5}}
design: fraction
certificate: {{frames: 1}}
report: {{write: false}}
calibration: null
"""
"""Four factors of three levels in nine films; one level is confounded."""


def test_a_fraction_gets_a_certificate_and_its_confounded_level_none(tmp_path):
    write_scenario(tmp_path, vehicles=2)
    (tmp_path / "study.yaml").write_text(FRACTION, encoding="utf-8")
    assert main(["study", str(tmp_path / "study.yaml"), "-o", str(tmp_path / "out")]) == 1
    said = json.loads((tmp_path / "out" / "certificate.json").read_text("utf-8"))
    pairs = {(pair["one"], pair["other"]): pair for pair in said["pairs"]}
    assert len(pairs) == 8 and all(pair["factor"].count(" and ") == 2 for pair in pairs.values())
    for names, pair in pairs.items():
        beside = len({name.endswith("_c") for name in names}) == 2
        assert pair["claim"] == ("failed" if beside else "proven"), pair["faults"]
        assert any("output.exposure" in fault for fault in pair["confounds"]) == beside
    assert {pair["claim"] for pair in pairs.values()} == {"failed", "proven"}
