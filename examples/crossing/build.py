"""Makes the city example: `python -m examples.crossing.build` from the repository's root."""

from __future__ import annotations

import numpy as np

from examples import sumo_files as sf
from examples.crossing.network import ARMS, FOLDER, write_network
from examples.crossing.scenery import buildings, clear_of_rows, trees

SEED, BEGIN, END = 4, 420, 540
EDGE = {"NE": ("NE_end_to_NE", "NE_to_NE_end"), "SW": ("SW_end_to_SW", "SW_to_SW_end")}
EDGE |= {arm: (f"{arm}_in_far", f"{arm}_out_far") for arm in ARMS}
# Road users per hour from one border, or pavement, to another.
MOTOR = """
    E W 430, W E 450, N S 360, S N 340, E N 60, E S 90, W N 80, W S 60, N E 90, N W 60,
    S E 50, S W 80, NE S 50, NE W 40, E NE 40, N SW 30, SW N 40, SW E 50, W SW 40
"""
BICYCLES = "E W 110, W E 120, N S 50, S N 50, W N 30, SW E 40, E NE 20"
# No walk needs two of the lights' crossings: SUMO would let people jump from one to the other.
WALKS = """
    E_in W_out 60, W_in E_out 60, N_in S_out 50, S_in N_out 50, E_out N_out 40, S_in W_in 40,
    W_out S_out 40, N_in E_in 40, W_in_far N_in 40, E_in_far S_in 40, S_in_far E_in 40,
    N_in_far W_in 40, NE_to_E_side N_in 25, SW_to_S_side W_in 25
"""
# Bus stops: lane and begin [m]. Lines: where from, where to, and where they stop.
STOPS = {
    "north": ("N_out_1", 28.0),
    "north_far": ("N_out_far_1", 90.0),
    "south": ("S_out_1", 30.0),
    "south_far": ("S_out_far_1", 90.0),
}
LINES = {"10N": ("S", "N", ("north", "north_far")), "10S": ("N", "S", ("south", "south_far"))}
TYPES = {
    "walker": {"vClass": "pedestrian", "length": 0.3, "width": 0.5, "height": 1.72}
    | {"speedFactor": "normc(1,0.12,0.7,1.3)"},
    "bicycle": {"vClass": "bicycle", "length": 1.8, "width": 0.65, "height": 1.7}
    | {"maxSpeed": 6.0, "speedFactor": "normc(0.9,0.12,0.6,1.1)"},
    "citybus": {"vClass": "bus", "length": 12.0, "width": 2.55, "height": 3.2, "guiShape": "bus"},
}
DRIVE = {"departLane": "best", "departSpeed": "desired"}


def trips(table: str) -> list[tuple[str, str, float]]:
    """From, to and road users per hour of a table."""
    return [(a, b, float(rate)) for a, b, rate in (trip.split() for trip in table.split(","))]


def vehicles() -> list[str]:
    """Flows of motor vehicles and bicycles."""
    found = []
    for kind, table in (("traffic", MOTOR), ("bicycle", BICYCLES)):
        for a, b, rate in trips(table):
            words = sf.stream(f"{kind}_{a}_{b}", rate=rate, end=END) | {"type": kind}
            ends = {"from": EDGE[a][0], "to": EDGE[b][1]}
            found.append(sf.element("flow", words | ends | DRIVE))
    return found


def walkers() -> list[str]:
    """Flows of people on foot."""
    found = []
    for a, b, rate in trips(WALKS):
        words = sf.stream(f"walk_{a}_{b}", rate=rate, end=END)
        walk = sf.element("walk", {"from": a, "to": b, "arrivalPos": "random"})
        words |= {"type": "walker", "departPos": "random"}
        found.append(sf.element("personFlow", words, [walk]))
    return found


def buses() -> list[str]:
    """Two bus lines, and the people who walk to a stop and ride."""
    found = []
    for line, (a, b, stops) in LINES.items():
        words = {"id": f"line_{line}", "type": "citybus", "line": line, "begin": 12, "end": END}
        words |= {"period": 100, "from": EDGE[a][0], "to": EDGE[b][1]}
        halts = [sf.element("stop", {"busStop": stop, "duration": 14}) for stop in stops]
        found.append(sf.element("flow", words | DRIVE, halts))
        walk = sf.element("walk", {"from": f"{a}_in", "busStop": stops[0]})
        ride = sf.element("ride", {"busStop": stops[1], "lines": line})
        words = sf.stream(f"ride_{line}", rate=90.0, end=END) | {"type": "walker"}
        found.append(sf.element("personFlow", words | {"departPos": "random"}, [walk, ride]))
    return found


def write_demand() -> None:
    """Write the road users, bus stops, the signal log's order and SUMO's configuration."""
    types = [sf.element("vType", {"id": name, **words}) for name, words in TYPES.items()]
    children = [*sf.vehicle_types(), *types, *vehicles(), *walkers(), *buses()]
    sf.write_xml(FOLDER / "crossing.rou.xml", "routes", children)
    stops = [
        sf.element("busStop", {"id": name, "lane": lane, "startPos": at, "endPos": at + 16.0})
        for name, (lane, at) in STOPS.items()
    ]
    sf.write_xml(FOLDER / "stops.add.xml", "additional", stops)
    sf.write_configuration(FOLDER, begin=BEGIN, end=END, seed=SEED, more=["stops.add.xml"])


def main() -> None:
    """Make all files of the example."""
    rng = np.random.default_rng(SEED)
    write_network()
    ground = sf.lane_ground(FOLDER / "crossing.net.xml.gz")
    standing = sf.thin(buildings(rng), ground)
    planted = sf.plant(trees(rng), ground, standing, spacing=5.5, clear=3.2)
    sf.write_objects(FOLDER, standing, clear_of_rows(planted, ground))
    write_demand()
    sf.simulate(FOLDER, begin=BEGIN)


if __name__ == "__main__":
    main()
