"""In a dense place roads are built in detail near the cameras only."""

import numpy as np
import pytest

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.world import outlook
from sumo3dviz_pt.world.outlook import choose_roads
from sumo3dviz_pt.world.placement.surroundings import surroundings


@pytest.fixture(scope="module")
def network():
    (file,) = example("ronda").parent.glob("**/*.net.xml*")
    return read_network(file)


def _around(network, positions):
    path = CameraPath(
        np.array(positions, dtype=float),
        np.tile([1.0, 0.0, 0.0], (len(positions), 1)),
        np.full(len(positions), 0.5),
    )
    return surroundings(network, seed=1, camera_path=path)


def _middle(network):
    shapes = [lane.shape for lane in network.lanes.values()]
    return np.median(np.concatenate(shapes), axis=0) + np.array([0.0, 0.0, 1.5])


def test_a_small_place_is_built_whole(network):
    choice = choose_roads(network, None, _around(network, [_middle(network)]))
    assert choice.detailed is network
    assert choice.plain is None


def test_without_cameras_everything_is_built(network, monkeypatch):
    monkeypatch.setattr(outlook, "MOST_LANES", 10)
    assert choose_roads(network, None, _around(network, np.zeros((0, 3)))).plain is None


def test_every_road_of_a_dense_place_is_built_in_one_way(network, monkeypatch):
    monkeypatch.setattr(outlook, "MOST_LANES", 10)
    choice = choose_roads(network, None, _around(network, [_middle(network)]))
    detailed, plain = choice.detailed, choice.plain
    assert detailed.edges.keys() | plain.edges.keys() == network.edges.keys()
    assert not detailed.edges.keys() & plain.edges.keys()
    assert detailed.junctions.keys() | plain.junctions.keys() == network.junctions.keys()
    assert not detailed.junctions.keys() & plain.junctions.keys()
    assert 0 < len(detailed.edges) < len(network.edges)
    for link in detailed.connections:
        assert {link.from_lane, link.to_lane} <= detailed.lanes.keys()


def test_what_is_near_or_seen_is_in_detail(network, monkeypatch):
    monkeypatch.setattr(outlook, "MOST_LANES", 10)
    eye = _middle(network)
    choice = choose_roads(network, None, _around(network, [eye]))
    for edge in choice.plain.edges.values():
        for lane in edge.lanes:
            to = lane.shape[:, :2] - eye[:2]
            away = np.hypot(*to.T)
            ahead = np.abs(np.arctan2(to[:, 1], to[:, 0])) < 0.5
            assert (away > 60.0).all()
            assert not (ahead & (away < 400.0)).any()


def test_a_camera_high_above_sees_details_farther_away(network, monkeypatch):
    monkeypatch.setattr(outlook, "MOST_LANES", 10)
    eye = _middle(network)
    low = choose_roads(network, None, _around(network, [eye]))
    high = choose_roads(network, None, _around(network, [eye + np.array([0.0, 0.0, 150.0])]))
    assert len(high.detailed.edges) >= len(low.detailed.edges)
    assert high.name != low.name
