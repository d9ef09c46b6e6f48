"""Runs of one simulation with several seeds are levels of a factor."""

from __future__ import annotations

from builders import write_scenario

from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study

SCENE = """scenario: {folder: run_1}
template: abstract
cameras:
  post: {mode: eulerian, position: [30, -22, 6], look_at: [5, -3, 0]}
shots: [{camera: post, from: 4, to: 5}]
"""

STUDY = """scene: scene.yaml
factors:
  run:
    levels:
      first: {scenario: {folder: run_1}}
      second: {scenario: {folder: run_2}}
"""


def test_each_run_is_a_film_of_its_own_log(tmp_path):
    for number in (1, 2):
        (tmp_path / f"run_{number}").mkdir()
        write_scenario(tmp_path / f"run_{number}", vehicles=1 + number)
        (tmp_path / f"run_{number}" / "scene.yaml").unlink()
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "study.yaml").write_text(STUDY, encoding="utf-8")
    plan = plan_study(load_study(tmp_path / "study.yaml"))
    logs = [scenario_files(each.job).trajectories for each in plan.stimuli]
    assert [log.parent.name for (log,) in logs] == ["run_1", "run_2"]
    assert len({each.digest for each in plan.stimuli}) == 2
    assert [pair.factor for pair in plan.pairs] == ["run"]
    only = plan.only(plan.stimuli[1].name)
    assert [each.name for each in only.stimuli] == [plan.stimuli[1].name]
