"""A walker is seen at each moment of an exposure where it is then, and in the stride of then."""

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job


def test_walkers_go_on_and_swing_their_legs_during_an_exposure(tmp_path):
    place = write_scenario(tmp_path, vehicles=1, persons=2)
    shutter = {"time": "200 ms", "moments": 5}
    job = load_job(place, {"cameras.post.shutter": shutter})
    shot = prepare(job, Request(camera="post"), np.array([4.0, 5.0])).shot
    frame = shot.exposed_at(4.0, samples=16)
    seen = [
        {each.id: each for each in (*moment.frame.deforming, *moment.frame.movers)}
        for moment in frame.exposure
    ]
    walker = [moment["person:p1"] for moment in seen]
    assert len(walker) == 5
    places = np.array([each.world_from_body.matrix[0, 3] for each in walker])
    # 1.2 m/s, and moments 40 ms apart.
    np.testing.assert_allclose(np.diff(places), 1.2 * 0.04, rtol=0.05)
    strides = np.diff([each.phase for each in walker]) % 1.0
    assert strides.min() > 0.01 and np.ptp(strides) < 0.01
    assert places[2] == pytest.approx(5.0 + 1.2 * 4.1, abs=0.1)
