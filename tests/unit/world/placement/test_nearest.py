"""The nearest point, whatever the last bit of a distance says."""

import numpy as np
import pytest

from sumo3dviz_pt.world.placement.lanes import Nearest

STREETS = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 0.0], [0.0, 10.0], [20.0, 0.0], [0.0, 0.0]])


def test_it_is_the_nearest():
    rng = np.random.default_rng(2)
    points, places = rng.uniform(-100, 100, (300, 2)), rng.uniform(-120, 120, (500, 2))
    away, index = Nearest(points).query(places)
    distances = np.linalg.norm(places[:, None] - points, axis=2)
    np.testing.assert_array_equal(index, distances.argmin(axis=1))
    np.testing.assert_allclose(away, distances.min(axis=1), atol=3e-6)


@pytest.mark.parametrize(
    ("place", "index"),
    [((0.0, 0.0), 0), ((10.0, 0.0), 1), ((5.0, 0.0), 0), ((15.0, 0.0), 1), ((5.0, 5.0), 0)],
)
def test_of_equally_near_ones_the_first_counts(place, index):
    noise = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) * 2.0**-40
    _, found = Nearest(STREETS).query(np.array(place) + noise)
    np.testing.assert_array_equal(found, index)


def test_one_point_is_enough():
    away, index = Nearest(np.zeros((1, 2))).query(np.array([[3.0, 4.0]]))
    assert index.tolist() == [0] and away.tolist() == [5.0]
