"""Roads of the bundled and the shared networks: no overlaps, no gaps, within the budget."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.roads.cells import overlaps
from sumo3dviz_pt.world.roads.layout import RoadLayout, layout_roads
from sumo3dviz_pt.world.roads.roads import build_roads

ROOT = Path(__file__).parents[2]
DATA, EXAMPLES = ROOT.parent / "shared" / "data", ROOT / "examples"
BUNDLED = ["crossing", "ronda"]
absent = pytest.mark.skipif(not DATA.is_dir(), reason="the shared data is not here")
SHARED = ["barcelona", "doerpfeldstr", "bologna_acosta", "badhersfeld"]
FLAT = [*BUNDLED, *(pytest.param(name, marks=[absent, pytest.mark.slow]) for name in SHARED)]
HILLS = pytest.param("monaco_west_hills", marks=[absent, pytest.mark.slow])


@cache
def network(name: str) -> Network:
    if name in BUNDLED:
        return read_network(EXAMPLES / name / f"{name}.net.xml.gz")
    return read_network(DATA / name / "net.net.xml.gz")


@cache
def layout(name: str) -> RoadLayout:
    return layout_roads(network(name), RoadSettings())


@pytest.mark.slow
@pytest.mark.parametrize("name", FLAT)
def test_no_two_pieces_share_area(name):
    cells = layout(name).cells
    assert len(overlaps(cells, above=1e-4).winners) == 0
    whole = shapely.union_all(cells.polygons, grid_size=1e-6).area
    assert shapely.area(cells.polygons).sum() == pytest.approx(whole, rel=1e-5)


@pytest.mark.parametrize("name", [*FLAT, HILLS])
def test_every_lane_lies_on_a_surface(name):
    net = network(name)
    tree = shapely.STRtree(layout(name).cells.polygons)
    missing, count = 0, 0
    # Four points of `crossing` lie up to 4 mm off: SUMO wrote centimetres.
    near = 0.005 if name in BUNDLED else 0.002
    for lane in net.lanes.values():
        if net.edges[lane.edge_id].function not in {"normal", "internal"}:
            continue
        line = shapely.LineString(lane.shape[:, :2])
        at = np.arange(0.0, line.length, 2.0)
        here = shapely.get_coordinates(shapely.line_interpolate_point(line, at))
        ahead = shapely.get_coordinates(shapely.line_interpolate_point(line, at + 0.05))
        along = (ahead - here) / np.maximum(np.linalg.norm(ahead - here, axis=1), 1e-9)[:, None]
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        points = np.concatenate([here + k * lane.width * across for k in (-0.45, 0.0, 0.45)])
        hit = tree.query(shapely.points(points), predicate="dwithin", distance=near)[0]
        missing += len(points) - len(np.unique(hit))
        count += len(points)
    assert missing / count < 1e-4


@pytest.mark.slow
@absent
def test_two_kilometres_of_motorway_stay_within_the_budget():
    net = network("barcelona")
    region = (18000.0, 16500.0, 20000.0, 18500.0)
    roads = build_roads(net, RoadSettings(), textured=True, region=region)
    assert sum(len(p.part.mesh.faces) for p in roads.static) < 150_000


@pytest.mark.slow
@absent
def test_hills_have_no_overlap_on_one_level():
    cells = layout("monaco_west_hills").cells
    # A handful of places are 2.5 m apart at one end and less at the other.
    assert len(overlaps(cells, above=1e-4).winners) <= 5
