"""Plain roads cover what the network says, without kerbs and paint."""

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.world.roads.layout import Line, layout_roads, plain_roads, ribbons


@pytest.fixture(scope="module", params=["crossing", "ronda"])
def network(request):
    (file,) = example(request.param).parent.glob("**/*.net.xml*")
    return read_network(file)


def _areas(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k], :2] for k in range(3))
    u, v = b - a, c - a
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def test_a_straight_ribbon_has_its_width():
    made = ribbons([Line(np.array([[0.0, 0.0, 1.0], [30.0, 40.0, 2.0]]), 3.0)])
    assert _areas(made.mesh).sum() == pytest.approx(150.0)
    assert (_areas(made.mesh) > 0.0).all()
    assert shapely.area(made.outlines).sum() == pytest.approx(150.0)
    assert np.ptp(made.mesh.vertices[:, 2]) == pytest.approx(1.0)


def test_a_bend_leaves_no_gap():
    bend = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [20.0, 20.0, 0.0]])
    made = ribbons([Line(bend, 4.0), Line(bend + np.array([100.0, 0.0, 0.0]), 2.0)])
    assert shapely.area(made.outlines) == pytest.approx([160.0, 80.0])
    assert shapely.is_valid(made.outlines).all()


def test_doubled_points_do_no_harm():
    line = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    made = ribbons([Line(line, 2.0)])
    assert np.isfinite(made.mesh.vertices).all()
    assert _areas(made.mesh).sum() == pytest.approx(20.0)


def test_plain_roads_cover_the_same_ground_as_roads_in_detail(network):
    plain = plain_roads(network, RoadSettings(), near=(0.0, 0.0), textured=True)
    fine = shapely.union_all(layout_roads(network, RoadSettings()).outline)
    coarse = shapely.union_all(plain.outlines)
    assert coarse.intersection(fine).area > 0.98 * fine.area
    assert coarse.area < 1.02 * fine.area
    for mesh in plain.meshes.values():
        assert (_areas(mesh) > -1e-6).mean() > 0.99


def test_an_empty_place_has_none():
    assert ribbons([]).mesh.faces.shape == (0, 3)
