"""The certificate: eight clean films pass, and no seeded violation gets through."""

from __future__ import annotations

import csv
import gzip
import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.certificate.build import certify
from sumo3dviz_pt.pipeline.films.build import FilmOrder, render_film
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.studies.file import load_study
from sumo3dviz_pt.pipeline.studies.plan import plan_study
from sumo3dviz_pt.pipeline.studies.records import film_path

pytestmark = pytest.mark.slow

# Traffic light C changes at 495 s, the second frame. The driver stands behind the white or red car.
STUDY = """scene: scene.yaml
clip: {camera: driver, from: 494.96, to: 495.08}
common:
  quality: draft
  output.size: [96, 54]
  cameras.driver: {vehicle: traffic_S_N.35, eye_height: 1.34}
factors:
  light:
    levels: {day: {template: city_day}, night: {template: city_night}}
  trees:
    levels: {street: {}, none: {ground: {planting: none}}}
  ahead:
    levels:
      white: {vehicles: {by_id: {traffic_S_N.34: {colour: "#ffffff"}}}}
      red: {vehicles: {by_id: {traffic_S_N.34: {colour: "#c00000"}}}}
certificate: {frames: 3}
"""

PAIR = ("day_street_white", "day_street_red")
"""Films that should differ in the colour of the car ahead; the second one is spoilt."""


@dataclass(frozen=True)
class Violation:
    """What is done to a film.

    Attributes:
        said: What the certificate says of it.
        values: Of the scene file, by dotted key.
        edit: A file of the simulation, what is found in it, and what takes its place.
        visible: Whether pixels tell it, whatever the account says.
    """

    said: str
    values: dict[str, object] | None = None
    edit: tuple[str, str, str] | None = None
    visible: bool = True


VIOLATIONS = {
    "another seed": Violation(r"seed: 7 -> 8", {"seed": 8}),
    "a car's colour": Violation(
        r"another colour: vehicle:line_10N\.4",
        {"vehicles": {"by_id": {"line_10N.4": {"colour": "#30a040"}}}},
    ),
    "one frame more": Violation(r"have 3 and 4 frames", {"shots.0.to": 495.12}, visible=False),
    "exposure": Violation(r"exposure \[EV\] is", {"output.exposure": 0.1}),
    "tone curve": Violation(r"tone curve is neutral .* and filmic", {"output.tone": "filmic"}),
    "camera": Violation(r"camera is another .* 1 cm", {"cameras.driver.eye_height": 1.35}),
    "lens": Violation(r"lenses of 60 and 61 deg", {"cameras.driver.lens.fov": 61}),
    "time": Violation(r"shows 494\.96 s .* and 495 s", {"shots.0.from": 495, "shots.0.to": 495.12}),
    "signal": Violation(
        r"traffic light C goes to \S+ at frame 1 in the first",
        edit=("signals.xml.gz", r'time="495\.00"( id="C")', r'time="495.04"\1'),
        visible=False,
    ),
    "vehicle": Violation(
        r"only one film shows .*vehicle:line_10N\.4",
        edit=("fcd.xml.gz", r'<vehicle id="line_10N\.4"[^>]*/>', ""),
    ),
    "tree": Violation(
        r"trees\.add\.xml: other content",
        edit=("trees.add.xml", r'<poi id="tree_(3[2-5]|48|49|50)"[^>]*/>', ""),
    ),
}  # fmt: skip


def plan_in(folder: Path, text: str = STUDY, name: str = "study.yaml"):
    (folder / name).write_text(text, encoding="utf-8")
    return plan_study(load_study(folder / name))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("certificate") / "crossing"
    shutil.copytree(data_root("examples") / "crossing", folder)
    scene = (folder / "scene.yaml").read_text("utf-8")
    (folder / "scene.yaml").write_text(re.sub(r"(?m)^template:.*\n", "", scene), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def made(place):
    """A whole study, by the command."""
    plan_in(place)
    assert main(["study", str(place / "study.yaml"), "-o", str(place / "out")]) == 0
    return place / "out"


def spoil(
    study: Path, out: Path, values: dict[str, object] | None = None, pair: tuple[str, str] = PAIR
) -> None:
    """Render the second film of a pair anew, with other values of the scene file."""
    plan = plan_study(load_study(study), values)
    stimulus = next(each for each in plan.stimuli if each.name == pair[1])
    film = film_path(out, plan, stimulus)
    shutil.rmtree(film.with_suffix(".frames"))
    render_film(stimulus.job, Request(), FilmOrder(film, overwrite=True))


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


def verdict_on_pair(out: Path, plan, pair: tuple[str, str] = PAIR):
    certificate = certify(out, plan)
    return next(each for each in certificate.pairs if (each.one, each.other) == pair)


def test_the_eight_clean_films_pass(made):
    said = json.loads((made / "certificate.json").read_text("utf-8"))
    assert said["passed"] and len(said["pairs"]) == 12
    assert all(pair["differing"] > 0 and pair["wrong"] == 0 for pair in said["pairs"])
    light = next(pair for pair in said["pairs"] if pair["factor"] == "light")
    assert any(word.startswith("exposure") for word in light["named"])
    ahead = next(pair for pair in said["pairs"] if pair["factor"] == "ahead")
    assert ahead["things"][0]["name"] == "vehicle:traffic_S_N.34"


def test_the_page_is_whole_and_lies_among_the_checksums(made):
    page = (made / "certificate.html").read_text("utf-8")
    assert page.count("<img alt=") == 12 and "12 of 12 pairs differ" in page
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    assert "certificate.html" in (made / "checksums.sha256").read_text("utf-8")


def table(made: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader((made / "report" / f"{name}.csv").read_text("utf-8").splitlines()))


def test_the_report_tells_light_traffic_events_and_shares(made):
    films = {row["stimulus"]: row for row in table(made, "films")}
    assert len(films) == 8
    day, night = films["day_street_white"], films["night_street_white"]
    assert float(day["scene_mean"]) > 100 * float(night["scene_mean"]) > 0
    assert 0 < float(day["shown_mean"]) < 100 and 0 < float(day["clutter"]) < 1
    ridden = [row for row in table(made, "traffic") if row["role"] == "ridden"]
    assert {row["road_user"] for row in ridden} == {"vehicle:traffic_S_N.35"}
    assert {row["leader"] for row in ridden} == {"vehicle:traffic_S_N.34"}
    signals = [row for row in table(made, "events") if row["kind"] == "signal"]
    assert {(row["frame"], row["id"]) for row in signals} == {("1", "C")}
    ahead = [row for row in table(made, "shares") if row["name"] == "vehicle:traffic_S_N.34"]
    assert len(ahead) == 24 and all(0.02 < float(row["share"]) < 0.5 for row in ahead)


def test_effects_show_what_factors_do(made):
    said = json.loads((made / "report.json").read_text("utf-8"))
    shares = {(each["factor"], each["measure"]): each["eta_squared"] for each in said["effects"]}
    assert shares["light", "scene_mean"] > 0.9 > shares["trees", "scene_mean"]
    # From this seat the mirror hides the gardens that the factor takes away; its trees are files'.
    assert shares["trees", "share vegetation"] == 0.0
    assert shares["light", "share vegetation"] == shares["light", "speed"] == 0.0
    assert "Eta squared" in (made / "report.html").read_text("utf-8")


@pytest.mark.parametrize("name", VIOLATIONS)
def test_a_violation_is_named(made, place, tmp_path, name):
    violation, out, plan = VIOLATIONS[name], tmp_path / "out", plan_in(place)
    shutil.copytree(made, out)
    source = edited(place, tmp_path / "edited", violation.edit) if violation.edit else place
    spoil(source / "study.yaml", out, violation.values)
    verdict = verdict_on_pair(out, plan)
    assert not verdict.passed
    assert any(re.search(violation.said, fault) for fault in verdict.faults), verdict.faults
    if not violation.visible:
        return
    # Pixels alone tell it, too, when the account keeps silent.
    shutil.copy(made / "materials" / f"{PAIR[1]}.json", out / "materials" / f"{PAIR[1]}.json")
    silent = verdict_on_pair(out, plan)
    assert silent.faults, f"wrong {silent.wrong}, light {silent.light}, codes {silent.codes}"
    assert all("where the factor does not act" in fault for fault in silent.faults)


# The same wind by dry weather and in rain, so that leaves have one shape.
WEATHER = (
    STUDY[: STUDY.index("factors:")].replace(
        "  quality:", "  weather.wind: {speed: 4 m/s, from: 270}\n  quality:"
    )
    + "factors: {weather: {levels: {dry: {}, rain: {weather.preset: rain}}}}\n"
    + "certificate: {frames: 3}\n"
)
WET = ("dry", "rain")


@pytest.fixture(scope="module")
def rained(place):
    """A study of the weather, by the command."""
    plan_in(place, WEATHER, "weather.yaml")
    assert main(["study", str(place / "weather.yaml"), "-o", str(place / "out_weather")]) == 0
    return place / "out_weather"


def test_a_clean_pair_of_weathers_passes(rained):
    said = json.loads((rained / "certificate.json").read_text("utf-8"))
    (pair,) = said["pairs"]
    assert pair["passed"] and pair["wrong"] == 0 and pair["differing"] > 0.5
    # Wipers of the own car rest by dry weather only.
    acts = pair["acts"].split("; ")
    assert acts[:2] == ["the shape of vehicle:traffic_S_N.35", "the colour of *"]
    films = {row["stimulus"]: row for row in table(rained, "films")}
    assert float(films["dry"]["scene_mean"]) > 2 * float(films["rain"]["scene_mean"]) > 0


@pytest.mark.parametrize(
    ("found", "edit"),
    [
        ("trees.add.xml: other content", VIOLATIONS["tree"].edit),
        (r"only one film shows .*vehicle:line_10N\.4", VIOLATIONS["vehicle"].edit),
    ],
    ids=["tree", "vehicle"],
)
def test_a_spoilt_pair_of_weathers_is_named(rained, place, tmp_path, found, edit):
    """In rain all may look otherwise, and nothing may be missing."""
    plan, out = plan_in(place, WEATHER, "weather.yaml"), tmp_path / "out"
    shutil.copytree(rained, out)
    spoil(edited(place, tmp_path / "edited", edit) / "weather.yaml", out, pair=WET)
    verdict = verdict_on_pair(out, plan, WET)
    assert any(re.search(found, fault) for fault in verdict.faults), verdict.faults
    shutil.copy(rained / "materials" / "rain.json", out / "materials" / "rain.json")
    silent = verdict_on_pair(out, plan, WET)
    assert silent.faults and silent.wrong > 0
    assert all("where the factor does not act" in fault for fault in silent.faults)
