"""What our code builds around roads that lie above one another leaves every way free."""

from __future__ import annotations

import numpy as np
import pytest
from any_network.laws import Drawn, blocked_ways

from sumo3dviz_pt.job.settings import GroundSettings, RoadSettings
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.world.land.ground import build_ground
from sumo3dviz_pt.world.land.horizon import built_points, land_around
from sumo3dviz_pt.world.land.terrain import ground_between
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.plants.trees import Plot
from sumo3dviz_pt.world.plants.wayside import verges
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.structures.deep_roads import tunnels_of

CARS = frozenset({"passenger", "bus", "truck"})
STRAIGHT, UP, ASLANT = ((0, 300), (600, 300)), ((300, 0), (300, 600)), ((80, 80), (520, 520))


def roads(*heights: float) -> Network:
    """Fast roads of two lanes through one place, each at its own height."""
    edges = {}
    for number, ((start, end), z) in enumerate(zip((STRAIGHT, UP, ASLANT), heights, strict=False)):
        line = np.array([[*start, z], [*end, z]], dtype=np.float64)
        way = (line[1] - line[0])[:2] / np.linalg.norm(line[1] - line[0])
        right = np.array([way[1], -way[0], 0.0])
        key = f"road{number}"
        shapes = [line + aside * right for aside in (1.6, -1.6)]
        lanes = tuple(
            Lane(f"{key}_{k}", key, k, shape, 3.2, 30.0, 600.0, CARS)
            for k, shape in enumerate(shapes)
        )
        edges[key] = Edge(key, "normal", f"{key}a", f"{key}b", lanes)
    return Network(edges, {}, (), Location(boundary=(0.0, 0.0, 600.0, 600.0)))


@pytest.mark.slow
@pytest.mark.parametrize("heights", [(0.0, -7.0), (0.0, 7.0, 14.0), (14.0, 0.0, 7.0)])
def test_decks_above_one_another_are_free(heights):
    network = roads(*heights)
    layout = layout_roads(network, RoadSettings())
    ground = build_ground(GroundSettings(), network, roads=layout, textured=True)
    around = surroundings(network, seed=1, height_at=ground.height_at)
    green = verges(network, Plot(layout.outline), around=around)
    assert {part.id for part in green} >= {"ground/gravel"}
    faults = list(blocked_ways(Drawn(network, layout), (*ground.static, *green)))
    assert not faults, "\n".join(faults)


def test_the_lowest_of_three_decks_runs_in_no_tunnel():
    network = roads(0.0, 7.0, 14.0)
    layout = layout_roads(network, RoadSettings())
    land = land_around(
        built_points(layout.outline, network.location.boundary), horizon="flat", surface="", seed=0
    )
    assert not tunnels_of(layout, ground_between(layout, network, land))
