"""Which edge or junction each face of the roads belongs to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.roads.layout import owners_of_roads
from sumo3dviz_pt.world.roads.roads import RoadParts, build_roads

EXAMPLES = Path(__file__).resolve().parents[4] / "examples"
CARS = frozenset({"passenger"})


def straight(name: str, start: tuple[float, ...], end: tuple[float, ...]) -> Edge:
    lane = Lane(f"{name}_0", name, 0, np.array([start, end], float), 3.2, 13.9, 100.0, CARS)
    return Edge(name, "normal", f"{name}a", f"{name}b", (lane,))


def owned(roads: RoadParts, part: StaticPart) -> tuple[np.ndarray, np.ndarray]:
    """Names of the faces of a part, and their middles."""
    mesh = part.part.mesh
    runs = owners_of_roads(roads.layout).things(part.id, mesh)
    assert sum(count for _, count in runs) == len(mesh.faces)
    names = np.repeat([name for name, _ in runs], [count for _, count in runs])
    return names, mesh.vertices[mesh.faces].mean(axis=1)


def test_roads_above_each_other_keep_their_names():
    edges = [straight("low", (-50, 0, 0), (50, 0, 0)), straight("high", (0, -50, 6), (0, 50, 6))]
    net = Network({edge.id: edge for edge in edges}, {}, (), Location())
    roads = build_roads(net, RoadSettings(), textured=True)
    seen = set()
    for part in roads.static:
        names, middles = owned(roads, part)
        for name, middle in zip(names, middles, strict=True):
            kind, _, edge = name.partition(":")
            assert edge == ("high" if middle[2] > 3.0 else "low"), part.id
            seen.add((kind, edge))
    assert {("edge", "low"), ("edge", "high"), ("marking", "low"), ("verge", "high")} <= seen


@pytest.mark.slow
def test_every_face_of_a_crossing_belongs_to_what_it_lies_on():
    (path,) = (EXAMPLES / "crossing").rglob("*.net.xml*")
    roads = build_roads(read_network(path), RoadSettings(), textured=True)
    kinds = set()
    for part in roads.static:
        names, _ = owned(roads, part)
        kinds |= {name.partition(":")[0] for name in names}
        if part.id.startswith("markings/"):
            assert all(name.startswith("marking:") for name in names)
        if part.id == "road/asphalt":
            a, b, c = np.moveaxis(part.part.mesh.vertices[part.part.mesh.faces], 1, 0)
            areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
            walks = np.array([name.startswith("sidewalk:") for name in names])
            assert areas[walks].sum() < 1e-6  # slivers along kerbs
    assert kinds >= {"edge", "junction", "sidewalk", "kerb", "marking", "verge"}
