"""The roads of the city example.

Two streets of two lanes per direction cross at lights; near them a lane for
turning left takes the median's place. Four small junctions lie around, joined in pairs
by side streets. A place is (arm, s, left): metres from the middle outwards along the
arm `E`, `N`, `W` or `S`, and to the left of it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from examples import sumo_files as sf

FOLDER = Path(__file__).resolve().parent
MIDDLE, TURN, REACH = np.array([300.0, 300.0]), np.radians(6.0), 290.0
LANE, BIKE, WALK, MEDIAN = 3.25, 1.8, 3.0, 1.6  # widths [m]; the median's is half of it
# Per arm: how far it bends to the left at its end [m], its side junction [m], has bicycle lanes.
ARMS = {
    "E": (16.0, 120.0, True),
    "N": (-12.0, 105.0, False),
    "W": (10.0, 115.0, True),
    "S": (0.0, 110.0, False),
}
# Corners of the side streets: the junctions that they join, and their free end.
CORNERS = {"NE": ("EN", (105.0, 8.0)), "SW": ("WS", (-100.0, -14.0))}


def place(arm: str, s: sf.Floats, left: sf.Floats | float) -> sf.Floats:
    """Net coordinates, (n, 2) [m], of places along an arm."""
    angle = TURN + 0.5 * np.pi * "ENWS".index(arm)
    along, across = (
        np.array([np.cos(angle), np.sin(angle)]),
        np.array([-np.sin(angle), np.cos(angle)]),
    )
    line: sf.Floats = (
        MIDDLE + np.outer(s, along) + np.outer(left + ARMS[arm][0] * (s / REACH) ** 2, across)
    )
    return line


def lanes(driving: int, bike: bool, walk: float = WALK) -> list[str]:
    """The lanes of an edge from the kerb to the middle."""
    motor = {"width": LANE, "disallow": "pedestrian tram rail" + " bicycle" * bike}
    kinds: list[dict[str, object]] = [{"width": walk, "allow": "pedestrian", "speed": 2.78}]
    kinds += [{"width": BIKE, "allow": "bicycle"}] * bike + [motor] * driving
    return [sf.element("lane", {"index": i, **kind}) for i, kind in enumerate(kinds)]


def edge(
    name: str, ends: tuple[str, str], line: sf.Floats, inside: list[str], main: bool = True
) -> str:
    """One street in one direction, `line` being its left border."""
    rank = {"priority": 5, "speed": 13.89} if main else {"priority": 2, "speed": 8.33}
    words = {"id": name, "from": ends[0], "to": ends[1], "numLanes": len(inside), **rank}
    words |= {"type": "highway.primary" if main else "highway.residential", "spreadType": "right"}
    return sf.element("edge", words | {"shape": sf.points(line)}, inside)


def arm_edges(arm: str) -> list[str]:
    """The four edges of an arm: in and out, near the lights and beyond the side junction."""
    _, side, bike = ARMS[arm]
    near, far = np.linspace(0.0, side, 9), np.linspace(side, REACH, 12)
    c, j, end = "C", f"{arm}_side", f"{arm}_end"
    return [
        edge(f"{arm}_out", (c, j), place(arm, near, -MEDIAN), lanes(2, bike)),
        edge(f"{arm}_out_far", (j, end), place(arm, far, -MEDIAN), lanes(2, bike)),
        edge(f"{arm}_in_far", (end, j), place(arm, far, MEDIAN)[::-1], lanes(2, bike)),
        edge(f"{arm}_in", (j, c), place(arm, near, -MEDIAN)[::-1], lanes(3, bike)),
    ]


def corner(name: str) -> sf.Floats:
    """Where the side streets of two arms meet, (2,) [m]."""
    a, b = (place(arm, np.array([ARMS[arm][1]]), 0.0)[0] for arm in CORNERS[name][0])
    where: sf.Floats = a + b - MIDDLE
    return where


def nodes() -> dict[str, sf.Floats]:
    """All nodes by id, (2,) [m]."""
    found = {"C": MIDDLE}
    for arm, (_, side, _) in ARMS.items():
        found[f"{arm}_side"], found[f"{arm}_end"] = place(arm, np.array([side, REACH]), 0.0)
    for name, (_, end) in CORNERS.items():
        found[name], found[f"{name}_end"] = corner(name), corner(name) + end
    return found


def side_streets() -> list[tuple[str, str]]:
    """The pairs of nodes that side streets join."""
    pairs = [(f"{arm}_side", name) for name, (arms, _) in CORNERS.items() for arm in arms]
    return pairs + [(name, f"{name}_end") for name in CORNERS]


def write_network() -> None:
    """Write SUMO's plain network files and let netconvert make the network of them."""
    at = nodes()
    edges = [line for arm in ARMS for line in arm_edges(arm)]
    for a, b in side_streets():
        for ends in ((a, b), (b, a)):
            line = np.array([at[node] for node in ends])
            edges.append(edge("_to_".join(ends), ends, line, lanes(1, False, 2.5), main=False))
    zebras = [{"node": "C", "edges": f"{arm}_in {arm}_out", "width": 4.0} for arm in ARMS]
    zebras += [
        {"node": a, "edges": f"{a}_to_{b} {b}_to_{a}", "width": 3.5}
        for a, b in side_streets()
        if "side" in a
    ]
    plain = {
        "nod": [
            sf.element(
                "node", {"id": i, "x": float(x), "y": float(y), "type": kind, "radius": radius}
            )
            for i, (x, y) in at.items()
            for kind, radius in [("traffic_light", 8) if i == "C" else ("priority", 6)]
        ],
        "edg": edges,
        "con": [sf.element("crossing", zebra | {"priority": "true"}) for zebra in zebras],
    }
    for (suffix, children), root in zip(
        plain.items(), ("nodes", "edges", "connections"), strict=True
    ):
        sf.write_xml(FOLDER / f"crossing.{suffix}.xml", root, children)
    files = ["-n", "crossing.nod.xml", "-e", "crossing.edg.xml", "-x", "crossing.con.xml"]
    shape = [
        "--no-turnarounds",
        "--offset.disable-normalization",
        "--precision",
        "2",
        "--walkingareas",
    ]
    shape += ["--junctions.corner-detail", "9", "--junctions.internal-link-detail", "15"]
    lights = [
        "--tls.cycle.time",
        "90",
        "--tls.left-green.time",
        "9",
        "--tls.yellow.time",
        "3",
        "--tls.allred.time",
        "2",
    ]
    sf.run_tool("netconvert", *files, *shape, *lights, "-o", "crossing.net.xml.gz", folder=FOLDER)
    sf.clean(FOLDER / "crossing.net.xml.gz")
