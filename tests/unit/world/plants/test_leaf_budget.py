"""How many triangles of leaves the examples' shots have, from cameras that stand."""

import numpy as np
import pytest

from sumo3dviz_pt.api import example, load
from sumo3dviz_pt.pipeline.production import Request, prepare

MOST = 250_000


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "camera", "time"), [("ronda", "overview", 490.0), ("crossing", "corner", 455.0)]
)
def test_leaves_of_the_examples_keep_their_budget(name, camera, time):
    job = load(example(name)).job
    shot = prepare(job, Request(camera=camera), np.array([time])).shot
    parts = [one.part for one in shot.data.static if one.part.material == "leaf"]
    assert 50_000 < sum(len(part.mesh.faces) for part in parts) < MOST
