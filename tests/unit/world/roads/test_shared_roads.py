"""Cameras that choose other roads of one network share what those have in common."""

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.world import outlook
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.surroundings import Tile
from sumo3dviz_pt.world.roads import areas, strips
from sumo3dviz_pt.world.roads.roads import build_roads


@pytest.fixture(scope="module")
def network():
    (file,) = example("ronda").parent.glob("**/*.net.xml*")
    return read_network(file)


def parts(network):
    """Two overlapping parts of a network, and a box in both of them."""
    shapes = [junction.outline for junction in network.junctions.values()]
    middle = np.median(np.concatenate([s[:, :2] for s in shapes if len(s)]), axis=0)
    focus = (*(middle - 10.0), *(middle + 10.0))
    column, row = (middle // 120.0).astype(int).tolist()
    tiles = [Tile(120.0, column + k, row) for k in (-1, 0, 1)]
    memory = Memory()
    chosen = (tuple(tiles[:2]), tuple(tiles[1:]))
    return [outlook._in_tiles(network, some, memory) for some in chosen], focus


def built(part, focus, memory):
    roads = build_roads(part, RoadSettings(), textured=True, focus=focus, memory=memory)
    return {static.id: static.part.mesh for static in roads.static}


@pytest.mark.slow
def test_roads_built_after_others_are_as_if_built_alone(network, monkeypatch):
    made = []
    for module, name in ((strips, "edge_strips"), (areas, "_junction_shape")):
        make = getattr(module, name)
        monkeypatch.setattr(
            module, name, lambda *a, make=make, **k: made.append(1) or make(*a, **k)
        )
    (first, second), focus = parts(network)
    alone = built(second, focus, Memory())
    once = len(made)
    memory = Memory()
    built(first, focus, memory.within("chosen", "first"))
    before = len(made)
    after = built(second, focus, memory.within("chosen", "second"))
    # Something was shared, and nothing differs by it.
    assert len(made) - before < once
    assert after.keys() == alone.keys()
    for name, mesh in after.items():
        assert np.array_equal(mesh.vertices, alone[name].vertices), name
        assert np.array_equal(mesh.faces, alone[name].faces), name
