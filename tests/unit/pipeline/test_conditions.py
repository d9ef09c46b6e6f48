"""Whichever command forecasts a film, nights and weathers count at their price."""

from pathlib import Path

import pytest
from builders import write_scenario

from sumo3dviz_pt.farm.making import FarmOrder, plan_films, plan_study_films
from sumo3dviz_pt.farm.plan import EngineChoice
from sumo3dviz_pt.pipeline.films.film import plans
from sumo3dviz_pt.pipeline.films.orders import FilmOrder
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import forecast, plan_study
from sumo3dviz_pt.studies.run import StudyOrder

CONDITIONS = {
    "night": {"lights": "on"},
    "sunset": {"sky": {"sun": {"azimuth": 90.0, "elevation": -6.0}}},
    "rain": {"weather.preset": "rain"},
    "snow": {"weather.preset": "snow"},
    "night and fog": {"lights": "on", "weather.preset": "fog"},
}
FARM = FarmOrder(EngineChoice(), frames=3)

STUDY = """scene: scene.yaml
certificate: {write: false}
report: {write: false}
factors: {noise: {levels: {one: {}, two: {seed: 5}}}}
"""


def rendered(folder: Path, settings) -> float:
    """What `render --dry-run` says of a film in size of a small picture [CPU-s]."""
    job = load_job(folder / "scene.yaml", settings)
    (plan,) = plans(job, Request(), FilmOrder(folder / "a.mp4"))
    return 3600 * plan.cost.cpu_hours


def farmed(folder: Path, settings) -> float:
    """The same of a farm, with a start for each of its tasks."""
    job = load_job(folder / "scene.yaml", settings)
    plan = plan_films(job, Request(), FilmOrder(folder / "a.mp4"), words=("render",), farm=FARM)
    return sum(task.cpu for task in plan.tasks)


def studied(folder: Path, settings) -> float:
    """The same of a study of two films, by their number."""
    plan = plan_study(load_study(folder / "study.yaml"), settings)
    return 3600 * forecast(plan, plan.stimuli).cpu_hours / len(plan.stimuli)


def studied_by_farm(folder: Path, settings) -> float:
    """The same of a farm that makes such a study."""
    plan = plan_study(load_study(folder / "study.yaml"), settings)
    farm = plan_study_films(plan, StudyOrder(folder / "out"), words=("study",), farm=FARM)
    return sum(task.cpu for task in farm.tasks) / len(plan.stimuli)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("conditions")
    scene = write_scenario(folder)
    text = scene.read_text("utf-8").replace("[64, 36]", "[1280, 720]")
    scene.write_text(text, encoding="utf-8")
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    return folder


@pytest.mark.parametrize("command", [farmed, studied, studied_by_farm])
@pytest.mark.parametrize("name", CONDITIONS)
def test_a_film_costs_as_much_more_whoever_forecasts_it(name, command, place):
    more, found = (f(place, CONDITIONS[name]) - f(place, {}) for f in (rendered, command))
    assert more > 2.0, "seconds"
    # Farms round each task to a tenth of a second.
    assert found == pytest.approx(more, abs=0.5)
