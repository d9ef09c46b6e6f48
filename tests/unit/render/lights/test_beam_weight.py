"""How often paths aim at a beam, from frame to frame."""

from __future__ import annotations

import numpy as np
import pytest
from builders import view_at

from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.render.lights.running import beam_weight

VIEW = view_at((0.0, 0.0, 1.4), heading=90.0, fov=60.0)


def lamp_at(x, y, *, yaw=np.pi):
    return Transform.from_pose((x, y, 0.7), yaw=yaw)


@pytest.mark.parametrize("aside", [-3.5, 3.5, 7.0, 15.0])
@pytest.mark.parametrize("yaw", [np.pi, np.pi + 0.6, 0.0, np.pi / 2])
def test_no_beam_goes_out_while_a_vehicle_drives_by(aside, yaw):
    """A frame at 50 km/h is 0.56 m: a weight that falls by half leaves its light to chance."""
    along = np.arange(90.0, -60.0, -0.56)
    weights = np.array([beam_weight(lamp_at(x, aside, yaw=yaw), VIEW) for x in along])
    assert (weights > 0.0).all() and weights.max() <= 1.0
    assert weights.max() > 4.0 * weights.min()
    assert np.abs(np.diff(weights)).max() < 0.06
    seen = weights[:-1] > 0.1
    change = (weights[1:] / weights[:-1])[seen]
    assert change.min() > 0.6 and change.max() < 1.2


def test_light_in_the_picture_counts_most():
    near, far = (beam_weight(lamp_at(x, 3.5), VIEW) for x in (25.0, 120.0))
    behind = beam_weight(lamp_at(-60.0, 3.5), VIEW)
    following = beam_weight(lamp_at(-8.0, 3.5, yaw=0.0), VIEW)
    assert near > 4.0 * far > behind
    assert following > 4.0 * behind
    assert beam_weight(None, VIEW) == 0.0
