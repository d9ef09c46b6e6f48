"""Houses beside roads and each other."""

import numpy as np
import pytest

from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.world.objects.houses import fitted, rectangles
from sumo3dviz_pt.world.placement.lanes import build_lane_index

PLAN = np.array([[[-5.0, -6.0], [5.0, 6.0]]])


def index(y=0.0):
    shape = np.array([(0.0, y, 0.0), (100.0, y, 0.0)])
    lane = Lane("e_0", "e", 0, shape, 3.2, 14, 100, frozenset({"passenger"}))
    return build_lane_index(
        Network({"e": Edge("e", "normal", "", "", (lane,))}, {}, (), Location())
    )


def test_houses_with_room_keep_their_size():
    sizes = fitted(np.array([(50.0, 20.0)]), np.zeros(1), PLAN, np.array([1.1]), index=index())
    assert sizes == pytest.approx([1.1])


def test_houses_over_a_road_shrink_but_not_below_half():
    places = np.array([(50.0, 7.0), (20.0, 3.0)])
    sizes = fitted(places, np.zeros(2), np.repeat(PLAN, 2, 0), np.ones(2), index=index())
    assert 6.0 * sizes[0] <= 7.0 - 1.6 - 0.3
    assert sizes[0] > 0.8
    assert sizes[1] == 0.5


def test_neighbours_share_the_room():
    places = np.array([(50.0, 30.0), (58.0, 30.0)])
    sizes = fitted(places, np.zeros(2), np.repeat(PLAN, 2, 0), np.ones(2), index=index())
    assert sizes[0] == pytest.approx(sizes[1])
    assert 10.0 * sizes[0] < 8.0


def test_plans_turn_with_their_fronts():
    (turned,) = rectangles(np.array([(1.0, 2.0)]), np.array([np.pi / 2]), PLAN)
    assert turned.bounds == pytest.approx((1 - 6, 2 - 5, 1 + 6, 2 + 5))
