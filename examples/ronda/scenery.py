"""What stands beside the motorway: buildings, trees and guard rails."""

from __future__ import annotations

import numpy as np
import shapely

from examples import sumo_files as sf
from examples.ronda.network import FOLDER, LENGTH, edges, place

# What stands along the service roads: how far it reaches [m] and which kinds, row by row.
QUARTERS = {
    "e": (
        (330, "home home"),
        (620, "shop block"),
        (900, "block"),
        (1200, "home home"),
        (1480, "shop home"),
        (1800, "block block"),
        (2100, "home block"),
        (2300, "shop"),
        (LENGTH, "home"),
    ),
    "w": (
        (280, "block"),
        (560, "home home"),
        (760, "shop home"),
        (1100, "block block"),
        (1330, "home"),
        (1650, "home block"),
        (1900, "shop block"),
        (2250, "home home"),
        (LENGTH, "block"),
    ),
}
CLEAR_ZONE = 10.0  # distance of trees from motorway and ramps [m]
PITCH = {"home": 23.0, "shop": 31.0, "block": 43.0}


def buildings(rng: np.random.Generator) -> list[tuple[str, float, float, float]]:
    """Places for buildings in rows along the service roads, fronts towards the road."""
    found = []
    for way, quarters in QUARTERS.items():
        begin = 20.0
        for end, kinds in quarters:
            right = 53.0
            for kind in kinds.split():
                right += sf.SETBACK[kind] + rng.uniform(0.5, 3.0)
                for t in np.arange(begin + 12.0, end - 8.0, PITCH[kind]):
                    if rng.random() < 0.8:
                        at = t + rng.normal(0.0, 1.2)
                        x, y = place(way, np.array([at]), right + rng.normal(0.0, 0.8))[0]
                        road = place(way, np.array([at]), 53.0)[0]
                        front = np.degrees(np.arctan2(road[0] - x, road[1] - y)) % 360.0
                        found.append((kind, float(x), float(y), float(front)))
                right += sf.FOOTPRINT[kind] + 2.0
            begin = end
    return found


def trees(rng: np.random.Generator) -> sf.Floats:
    """Places for trees: clumps in the verges, a row at the service roads, groves behind."""
    found = []
    for way in "ew":
        t = rng.uniform(0.0, LENGTH, 2600)
        clump = np.sin(t / 31.0) + np.sin(t / 83.0 + 2.0) + rng.normal(0.0, 0.5, t.size) > 0.6
        t = t[clump][:260]
        found.append(place(way, t, rng.uniform(18.0, 42.0, t.size)))
        t = np.arange(8.0, LENGTH - 8.0, 16.0)
        t += rng.normal(0.0, 2.0, t.size)
        found.append(place(way, t[rng.random(t.size) < 0.8], 57.5))
        t = rng.uniform(0.0, LENGTH, 300)
        t = t[np.sin(t / 57.0 + 1.0) + rng.normal(0.0, 0.6, t.size) > 0.1]
        found.append(place(way, t, 62.0 + rng.gamma(3.0, 35.0, t.size)))
    spots = np.concatenate(found)
    return spots[shapely.distance(shapely.points(spots), carriageways()) > CLEAR_ZONE]


def carriageways() -> shapely.Geometry:
    """What motorway and ramps pave."""
    return shapely.union_all(
        [
            shapely.Polygon(np.concatenate([line, sf.offset(line, 3.5 * lanes)[::-1]])).buffer(0.0)
            for way in "ew"
            for name, _, _, line, lanes in edges(way)
            if name[0] in "mo"
        ]
    )


def write_fences() -> None:
    """Write guard rails: in the median, and around motorway and ramps until these turn away."""
    strips = [
        shapely.Polygon(np.concatenate([line, sf.offset(line, 3.5 * lanes)[::-1]]))
        for way in "ew"
        for name, _, _, line, lanes in edges(way)
        if name[0] in "mo"
    ]
    t = np.arange(25.0, LENGTH - 24.0, 10.0)
    belt = shapely.LineString(place("e", t, 0.0)).buffer(31.0, cap_style="flat")
    # Closing gaps up to 6 m wide ends the rails before the sharp wedge where a ramp leaves.
    paved = shapely.union_all(strips).buffer(4.3).buffer(-3.0)
    boundary = shapely.segmentize(paved.boundary.simplify(0.03), 12.0)
    rails = shapely.line_merge(shapely.intersection(boundary, belt))
    shapes = [np.array(line.coords) for line in shapely.get_parts(rails) if line.length > 15.0]
    shapes.append(place("e", t, 0.0))
    polys = [
        sf.element(
            "poly",
            {"id": f"fence_{i}", "type": "fence", "fill": 0, "layer": 0, "shape": sf.points(line)},
        )
        for i, line in enumerate(shapes)
    ]
    sf.write_xml(FOLDER / "fences.add.xml", "additional", polys)
