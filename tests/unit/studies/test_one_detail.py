"""Things are drawn alike in all films of a study, whatever else stands there."""

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.shot import build
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study

STUDY = """
scene: scene.yaml
factors:
  trees:
    levels:
      street: {}
      none: {objects: {trees: null}}
"""


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ("", (6, 200_000)),
        ("common: {vehicles.full_models: 2, objects.triangles: 50000}", (2, 50_000)),
    ],
)
def test_a_study_says_how_fine_things_are(tmp_path, said, wanted):
    write_scenario(tmp_path, vehicles=3, trees=True)
    (tmp_path / "study.yaml").write_text(STUDY + said, encoding="utf-8")
    for stimulus in plan_study(load_study(tmp_path / "study.yaml")).stimuli:
        job = stimulus.job
        assert (job.vehicles.full_models, job.objects.triangles) == wanted


def test_what_stands_does_not_change_how_cars_are_drawn(tmp_path, monkeypatch):
    """Trees left fewer triangles to cars: those in less detail do not nod, and stood 2 cm off."""
    write_scenario(tmp_path, vehicles=8, spacing=12.0, trees=True)
    (tmp_path / "study.yaml").write_text(STUDY, encoding="utf-8")
    first, second = plan_study(load_study(tmp_path / "study.yaml")).stimuli
    shown = []
    for stimulus, budget in ((first, 1_450_000), (second, 200_000)):
        monkeypatch.setattr(build, "SHOT_TRIANGLES", budget)
        times = Pace.of(stimulus.job, stimulus.shot).times(stimulus.shot)
        production = prepare(stimulus.job, Request(camera=stimulus.shot.camera), times)
        shown.append([production.shot.frame_at(float(time)) for time in times])
    for one, other in zip(*shown, strict=True):
        assert len(one.everyone) == len(other.everyone) > 0
        for a, b in zip(one.everyone, other.everyone, strict=True):
            assert (a.name, a.prototype) == (b.name, b.prototype)
            np.testing.assert_array_equal(a.world_from_body.matrix, b.world_from_body.matrix)
