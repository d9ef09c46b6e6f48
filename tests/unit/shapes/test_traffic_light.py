"""Heads, lenses and poles."""

import numpy as np
import pytest

from sumo3dviz_pt.shapes.traffic_light import HOUSING, RADIUS, crossbar, housing, lens, mast, pole


@pytest.mark.parametrize("index", [0, 1, 2])
def test_lenses_are_domed_discs_that_look_backwards(index):
    disc = lens(index)
    assert 12 <= len(disc.faces) <= 16
    assert np.hypot(disc.vertices[:, 1], disc.vertices[:, 2] - HOUSING * (index + 0.5)).max() == (
        pytest.approx(RADIUS)
    )
    assert disc.vertices[0, 0] < disc.vertices[1, 0]
    a, b, c = (disc.vertices[disc.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 0] < 0).all()
    assert (disc.normals[:, 0] < 0).all()


@pytest.mark.parametrize("lamps", [2, 3])
def test_lenses_lie_in_front_of_the_housing(lamps):
    body = housing(lamps)
    assert body.bounds[1, 2] == pytest.approx(lamps * HOUSING + 0.1)
    front = body.vertices[np.abs(body.vertices[:, 1]) < 0.2]
    assert lens(0).vertices[:, 0].max() < -0.1
    assert front[:, 0].min() < lens(0).vertices[:, 0].min(), "visors reach over the lenses"
    assert len(body.faces) < 90
    assert len(housing(lamps, backing=False).faces) < len(body.faces)


def test_poles_reach_into_the_ground_and_arms_over_the_road():
    assert pole(3.0).bounds[:, 2] == pytest.approx([-0.5, 3.0], abs=0.02)
    left, right = mast(5.5, 7.0), mast(5.5, -7.0)
    assert left.bounds[1, 1] == pytest.approx(7.0, abs=0.1)
    assert right.bounds[0, 1] == pytest.approx(-7.0, abs=0.1)
    assert left.bounds[0, 2] == pytest.approx(-0.5, abs=0.02)
    assert crossbar(1.2, 2.9).bounds[:, 1] == pytest.approx([-0.6, 0.6], abs=0.01)
