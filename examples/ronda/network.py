"""The roads of the motorway example.

An urban motorway of 2.6 km in a gentle S, three lanes per direction, with one-way
service roads. Per direction two on-ramps with meters and one off-ramp. Places are
given as (t, right): metres along a direction of travel and to the right of the middle.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from examples import sumo_files as sf

FOLDER = Path(__file__).resolve().parent
LENGTH = 2600
INNER, LANE, SERVICE = 2.0, 3.5, 46.0  # inner border, a lane's width, service road's border [m]
# Edges along a direction of travel: end [m], lanes. A lane more serves to join or to leave.
MAIN = ((520, 3), (740, 4), (1030, 3), (1190, 4), (1700, 3), (1920, 4), (LENGTH, 3))
SIDE = ((200, 2), (320, 3), (1390, 2), (1500, 3), (LENGTH, 2))
# Ramps: node by node, and where these lie [m]; the middle one of an on-ramp is the meter.
RAMPS = {
    "on1": (("S2", "R1", "M1"), (320, 430, 520)),
    "on2": (("S4", "R2", "M5"), (1500, 1610, 1700)),
    "off": (("M4", "S3"), (1190, 1390)),
}

_S = np.arange(-50.0, LENGTH + 51.0)
_HEADING = -0.42 * np.cos(2.0 * np.pi * _S / LENGTH)  # tightest radius 985 m
_STEPS = np.stack([np.cos(_HEADING), np.sin(_HEADING)], axis=1)
_MIDDLE = np.array([100.0, 900.0]) + np.cumsum(_STEPS, axis=0)


def place(way: str, t: sf.Floats, right: sf.Floats | float) -> sf.Floats:
    """Net coordinates, (n, 2) [m], of places along the eastern (`e`) or western (`w`) way."""
    sign, s = (1.0, t) if way == "e" else (-1.0, LENGTH - t)
    x, y, heading = (np.interp(s, _S, column) for column in (*_MIDDLE.T, _HEADING))
    return np.stack(
        [x + sign * right * np.sin(heading), y - sign * right * np.cos(heading)], axis=1
    )


def ramp_edge(name: str, t: sf.Floats) -> sf.Floats:
    """How far right of the middle a ramp's left edge runs [m]: an S without kinks."""
    cuts = RAMPS[name][1]
    u = (t - cuts[0]) / (cuts[-1] - cuts[0])
    u = 1.0 - u if name == "off" else u
    service, main = SERVICE - LANE, INNER + 3.0 * LANE
    return service + (main - service) * u**3 * (6.0 * u**2 - 15.0 * u + 10.0)


Edge = tuple[str, str, str, sf.Floats, int]


def edges(way: str) -> list[Edge]:
    """Name, nodes, left border, (n, 2) [m], and number of lanes of every edge of a way."""
    found: list[Edge] = []
    for letter, table in (("m", MAIN), ("s", SIDE)):
        for i, (end, lanes) in enumerate(table):
            begin = table[i - 1][0] if i else 0
            right = INNER if letter == "m" else SERVICE - LANE * (lanes == 3)
            line = place(way, np.linspace(begin, end, (end - begin) // 10 + 1), right)
            found.append(
                (f"{letter}{i}", f"{letter.upper()}{i}", f"{letter.upper()}{i + 1}", line, lanes)
            )
    for name, (nodes, cuts) in RAMPS.items():
        for part, i in zip("ab", range(len(cuts) - 1), strict=False):
            t = np.linspace(cuts[i], cuts[i + 1], (cuts[i + 1] - cuts[i]) // 5 + 1)
            found.append(
                (name + part, nodes[i], nodes[i + 1], place(way, t, ramp_edge(name, t)), 1)
            )
    return found


# Which lanes lead on: from, to, lanes, and how much their numbers change.
LINKS = """
    m0 m1 012 1, on1b m1 0 0, m1 m2 123 -1, m2 m3 012 1, m3 m4 123 -1, m3 offa 0 0,
    m4 m5 012 1, on2b m5 0 0, m5 m6 123 -1, s0 s1 01 0, s1 s2 01 0, s1 on1a 2 -2,
    s2 s3 01 0, offa s3 0 2, s3 s4 01 0, s3 on2a 2 -2, on1a on1b 0 0, on2a on2b 0 0
"""
# Type and speed [m/s] by the first letter of an edge's name.
KINDS = {
    "m": ("highway.motorway", 22.22),
    "s": ("highway.secondary", 13.89),
    "o": ("highway.motorway_link", 13.89),
}


def node_elements(way: str) -> list[str]:
    """The nodes of a way: every place where an edge begins or ends, once."""
    ends: dict[str, sf.Floats] = {}
    for _, a, b, line, _ in edges(way):
        ends.setdefault(a, line[0])
        ends.setdefault(b, line[-1])
    return [
        sf.element("node", {"id": f"{way}_{node}", "x": x, "y": y, "type": kind})
        for node, (x, y) in ends.items()
        for kind in ["traffic_light" if node[0] == "R" else "priority"]
    ]


def edge_elements(way: str) -> list[str]:
    """The edges of a way, closed to slow traffic."""
    found = []
    for name, a, b, line, lanes in edges(way):
        kind, speed = KINDS[name[0]]
        words: sf.Words = {"id": f"{way}_{name}", "from": f"{way}_{a}", "to": f"{way}_{b}"}
        words |= {
            "type": kind,
            "numLanes": lanes,
            "width": LANE,
            "speed": speed,
            "spreadType": "right",
        }
        words |= {"disallow": "pedestrian bicycle tram rail", "shape": sf.points(line)}
        found.append(sf.element("edge", words))
    return found


def link_elements(way: str) -> list[str]:
    """Which lane of a way leads into which."""
    found = []
    for a, b, lanes, change in (link.split() for link in LINKS.split(",")):
        for lane in map(int, lanes):
            words = {"from": f"{way}_{a}", "to": f"{way}_{b}", "fromLane": lane}
            found.append(sf.element("connection", words | {"toLane": lane + int(change)}))
    return found


def meter_elements(way: str) -> list[str]:
    """The ramp meters of a way: 45 s green, 15 s red, each beginning at its own time."""
    phases = [sf.element("phase", {"duration": d, "state": s}) for d, s in ((45, "G"), (15, "r"))]
    found = []
    for number, ramp in enumerate(("on1", "on2")):
        name = f"{way}_{RAMPS[ramp][0][1]}"
        light: sf.Words = {"id": name, "type": "static", "programID": "meter"}
        light |= {"offset": 25 + 13 * (number + 2 * (way == "w"))}
        ends: sf.Words = {
            "from": f"{way}_{ramp}a",
            "to": f"{way}_{ramp}b",
            "fromLane": 0,
            "toLane": 0,
        }
        found.append(sf.element("tlLogic", light, phases))
        found.append(sf.element("connection", ends | {"tl": name, "linkIndex": 0}))
    return found


def write_network() -> None:
    """Write SUMO's plain network files and let netconvert make the network of them."""
    plain = {
        "nodes": ("nod", node_elements),
        "edges": ("edg", edge_elements),
        "connections": ("con", link_elements),
        "tlLogics": ("tll", meter_elements),
    }
    files = []
    for option, (root, (suffix, elements)) in zip("nexi", plain.items(), strict=True):
        children = [child for way in "ew" for child in elements(way)]
        sf.write_xml(FOLDER / f"ronda.{suffix}.xml", root, children)
        files += [f"-{option}", f"ronda.{suffix}.xml"]
    # All edges meet at no angle, so a junction is the line where they do.
    shape = ["--junctions.endpoint-shape", "--no-turnarounds", "--offset.disable-normalization"]
    sf.run_tool("netconvert", *files, *shape, "-o", "ronda.net.xml.gz", folder=FOLDER)
    sf.clean(FOLDER / "ronda.net.xml.gz")
