"""Makes the motorway example: `python -m examples.ronda.build` from the repository's root."""

from __future__ import annotations

import numpy as np

from examples import sumo_files as sf
from examples.ronda.network import FOLDER, write_network
from examples.ronda.scenery import buildings, trees, write_fences

SEED, BEGIN, END = 46, 420, 540
# Vehicles per hour and the edges they use, per direction.
FLOWS = {
    "through": (4200, "m0 m1 m2 m3 m4 m5 m6"),
    "leaving": (450, "m0 m1 m2 m3 offa s3 s4"),
    "detour": (200, "m0 m1 m2 m3 offa s3 on2a on2b m5 m6"),
    "joining": (520, "s0 s1 on1a on1b m1 m2 m3 m4 m5 m6"),
    "later": (320, "s0 s1 s2 s3 on2a on2b m5 m6"),
    "local": (160, "s0 s1 s2 s3 s4"),
}


def write_demand() -> None:
    """Write vehicle types and flows, the signal log's order and SUMO's configuration."""
    flows = []
    depart = {"departLane": "best", "departSpeed": "desired", "departPos": "base"}
    for name, (rate, edges) in FLOWS.items():
        for way in "ew":
            route = {"edges": " ".join(f"{way}_{edge}" for edge in edges.split())}
            stream = sf.stream(f"{way}_{name}", rate=rate, end=END) | {"type": "traffic", **depart}
            flows.append(sf.element("flow", stream, [sf.element("route", route)]))
    sf.write_xml(FOLDER / "ronda.rou.xml", "routes", [*sf.vehicle_types(late=1.5), *flows])
    sf.write_configuration(FOLDER, begin=BEGIN, end=END, seed=SEED)


def main() -> None:
    """Make all files of the example."""
    rng = np.random.default_rng(SEED)
    write_network()
    ground = sf.lane_ground(FOLDER / "ronda.net.xml.gz")
    standing = sf.thin(buildings(rng), ground)
    sf.write_objects(FOLDER, standing, sf.plant(trees(rng), ground, standing))
    write_fences()
    write_demand()
    sf.simulate(FOLDER, begin=BEGIN)


if __name__ == "__main__":
    main()
