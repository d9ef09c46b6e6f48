"""What a camera's settings say of its shutter, and of whom its lens keeps sharp."""

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.model.camera import INSTANT, Shutter
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.road_users import shutter_of


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (None, INSTANT),
        ({"angle": 180, "moments": 4}, Shutter(0.0, 0.02, 4, 0.0)),
        ({"time": "10 ms", "moments": 4}, Shutter(0.0, 0.01, 4, 0.0)),
        # Rows that are seen one after the other need moments, however short each is.
        ({"time": "0 ms", "rolling": "15 ms", "moments": 4}, Shutter(0.0, 0.0, 4, 0.015)),
        ({"time": "0 ms", "moments": 4}, Shutter(0.0, 0.0, 1, 0.0)),
    ],
)
def test_shutters_are_as_said(tmp_path, said, expected):
    job = load_job(write_scenario(tmp_path), {"cameras.post.shutter": said} if said else {})
    assert shutter_of(job.cameras["post"], 0.04) == expected


def test_the_middle_of_a_body_stays_sharp(tmp_path):
    scene = write_scenario(tmp_path, vehicles=1)
    focus = {"cameras.post.lens": {"fov": 60, "focus": {"vehicle": "v0"}, "f_number": 2.8}}
    # From high above, so that the body's height counts.
    above = {"cameras.post.position": [0, -10, 20], "cameras.post.look_at": [0, -4, 0]}
    shot = prepare(
        load_job(scene, {**above, **focus}), Request(camera="post"), np.array([4.0])
    ).shot
    view = shot.camera.view_at(4.0)
    _, _, height = shot.fleet.bodies[0].size
    middle = np.array([0.0 - 4.6 / 2, -4.8, height / 2])
    assert height > 1.2
    assert view.lens.focus == pytest.approx((middle - view.position) @ view.forward, abs=0.1)
