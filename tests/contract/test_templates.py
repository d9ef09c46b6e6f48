"""One word changes the whole look; every look keeps the budget of triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt import catalog
from sumo3dviz_pt.inspection.checks import SHARED, TRIANGLE_BUDGET, check_scene
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

CROSSING = catalog.data_root("examples") / "crossing" / "scene.yaml"
WANTED = {
    *("highway_day", "highway_golden_hour", "city_day", "city_dusk", "city_night"),
    *("village_day", "overcast", "abstract"),
}
QUICK = {"abstract", "city_day", "city_dusk"}
"""Built wherever the tests run; CI builds all of them."""


def test_all_templates_are_there() -> None:
    assert set(catalog.template_names("scene")) >= WANTED


@pytest.mark.parametrize(
    "template",
    [
        pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow)
        for name in sorted(catalog.template_names("scene"))
    ],
)
def test_template_leaves_out_what_it_does_not_need(template: str, tmp_path: Path) -> None:
    job = load_job(write_scenario(tmp_path, vehicles=4), {"template": template})
    data = prepare(job, Request(camera="post"), np.array([4.0])).shot.data
    night = template in ("city_night", "city_dusk")
    assert data.running is not None
    assert (data.running.beam is not None) == night
    assert data.running.sampled == night
    assert night or not any(lamps.sampled for lamps in data.lamps)
    assert night or not any(lamps.radiance is not None for lamps in data.lamps)


@pytest.mark.slow
def test_check_proves_the_budget() -> None:
    shots = "[{camera: driver, from: 488, to: 489}]"
    report = check_scene(load_job(CROSSING, {"template": "city_night", "shots": shots}))
    (shot,) = report["shots"]
    assert not shot["over_budget"]
    triangles = shot["triangles"]
    assert 500_000 < triangles["total"] - triangles[SHARED] <= TRIANGLE_BUDGET
    assert triangles["total"] <= 1.6 * TRIANGLE_BUDGET
    assert "lit windows" not in {item["what"] for item in shot["left_out"]}
