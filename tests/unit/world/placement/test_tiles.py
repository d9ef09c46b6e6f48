"""Tiles: each place lies in one, and cameras decide only which are looked at."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.surroundings import Tile, edges_in, surroundings, tiles_seen

EMPTY = Network({}, {}, (), Location())
PLACES = st.tuples(st.floats(-5e4, 5e4), st.floats(-5e4, 5e4))


@given(PLACES, st.sampled_from([250.0, 500.0]))
def test_each_place_lies_in_one_tile_of_a_size(place, size):
    at = np.array([place])
    spots = surroundings(EMPTY, seed=1, viewpoints=np.array([[*place, 2.0]]))
    tiles = tiles_seen(spots, size=size, reach=size, beyond=0.0)
    assert sum(bool(tile.holds(at)[0]) for tile in tiles) == 1
    (own,) = (tile for tile in tiles if tile.holds(at)[0])
    assert -1e-6 <= own.depth(at)[0] <= size / 2.0
    assert own.box(0.001).covers(shapely.Point(place))


def test_tiles_are_those_within_reach_and_in_the_same_order():
    around = surroundings(EMPTY, seed=1, viewpoints=np.array([[100.0, 100.0, 2.0]]))
    tiles = tiles_seen(around, size=250.0, reach=600.0, beyond=0.0)
    eye = shapely.Point(100.0, 100.0)
    assert tiles == sorted(tiles)
    assert all(tile.box().distance(eye) <= 602.0 for tile in tiles)
    every = [Tile(250.0, x, y) for x in range(-9, 9) for y in range(-9, 9)]
    assert {tile for tile in every if tile.box().distance(eye) < 600.0} <= set(tiles)


def test_a_camera_that_looks_north_needs_no_tiles_in_the_far_south():
    north = CameraPath(np.array([[0.0, 0.0, 2.0]]), np.array([[0.0, 1.0, 0.0]]), np.array([0.4]))
    around = surroundings(EMPTY, seed=1, camera_path=north, height_at=lambda at: np.zeros(len(at)))
    tiles = tiles_seen(around, size=250.0, reach=2000.0, beyond=30.0)
    middles = np.array([tile.middle for tile in tiles])
    assert middles[:, 1].max() > 1500.0 and middles[:, 1].min() > -600.0


def test_without_cameras_there_are_no_tiles():
    assert tiles_seen(surroundings(EMPTY, seed=1), size=250.0, reach=900.0, beyond=0.0) == []


@pytest.mark.parametrize(("x", "names"), [(0.0, ["a"]), (500.0, ["a", "b"]), (2000.0, [])])
def test_edges_are_found_by_place_in_the_order_of_their_ids(x, names):
    def edge(name, x0, x1):
        shape = np.array([[x0, 0.0, 0.0], [x1, 0.0, 0.0]])
        allowed = frozenset({"passenger"})
        lane = Lane(f"{name}_0", name, 0, shape, 3.2, 13.9, abs(x1 - x0), allowed)
        return Edge(name, "normal", "A", "B", (lane,))

    net = Network({"b": edge("b", 450, 900), "a": edge("a", 0, 500)}, {}, (), Location())
    found = edges_in(net, shapely.box(x, -5.0, x + 20.0, 5.0), Memory())
    assert [edge.id for edge in found] == names
