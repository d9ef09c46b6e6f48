"""A land of our own making, with known heights, and two streets on it."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network

UTM = "+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
OFFSET = (-691000.0, -5334000.0)


def hill(x: Floats, y: Floats) -> Floats:
    """A land of our own making: a slope and a wide hill [m]."""
    return 500.0 + 0.02 * x + 0.01 * y + 12.0 * np.exp(-((x - 300) ** 2 + (y - 250) ** 2) / 2e5)


def network(*, projection: str = "!", z: float = 0.0) -> Network:
    """Return two streets that cross, far from nowhere."""

    def street(name: str, points: list[tuple[float, float]]) -> Edge:
        shape = np.array([(x, y, z) for x, y in points])
        length = float(np.linalg.norm(np.diff(shape, axis=0), axis=1).sum())
        lane = Lane(f"{name}_0", name, 0, shape, 3.2, 13.9, length, frozenset({"passenger"}))
        return Edge(name, "normal", "a", "b", (lane,))

    edges = {
        "east": street("east", [(0.0, 200.0), (280.0, 200.0), (600.0, 200.0)]),
        "north": street("north", [(300.0, 0.0), (300.0, 500.0)]),
    }
    outline = np.array([(295.0, 195.0, z), (305.0, 195.0, z), (305.0, 205.0, z)])
    junctions = {"a": Junction("a", "priority", np.array([300.0, 200.0, z]), outline)}
    offset = OFFSET if projection != "!" else (0.0, 0.0)
    place = Location(offset, (0.0, 0.0, 600.0, 500.0), projection)
    return Network(edges, junctions, (), place)
