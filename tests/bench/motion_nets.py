"""Roads and traffic of our own making for the truth of motion; netconvert and SUMO do the rest.

A town is a handful of named nodes and of streets between them; `a_b` is the edge from
`a` to `b`. Trips are drawn from a seed.
"""

from __future__ import annotations

import random
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

NET, ROUTES = "net.net.xml", "routes.rou.xml"
TRIP = 'departLane="best" departSpeed="max"'
PLAIN = 'carFollowModel="Krauss" sigma="0" speedFactor="normc(1,0.1,0.8,1.2)"'
EIDM = 'carFollowModel="EIDM" speedFactor="normc(1,0.1,0.8,1.2)"'
SLOW = 'sigma="0" maxSpeed="5.5" speedFactor="normc(0.9,0.12,0.6,1.1)"'
LAYERED = (
    '<lane index="0" width="1.8" allow="bicycle"/><lane index="1" disallow="bicycle pedestrian"/>'
)


@dataclass(frozen=True)
class Street:
    """A street from node to node, `a` and `b`.

    Attributes:
        a: Where it begins.
        b: Where it ends.
        lanes: In each direction.
        speed: Limit [m/s].
        both: Also from `b` to `a`.
        shape: Its middle from `a` to `b`, (n, 2) [m].
        inner: Elements inside the edge.
        rank: SUMO's priority.
    """

    a: str
    b: str
    lanes: int = 1
    speed: float = 13.9
    both: bool = True
    shape: Sequence[tuple[float, float]] = ()
    inner: str = ""
    rank: int = 1


@dataclass(frozen=True)
class Town:
    """Nodes (x, y, type, radius), streets, connections and further text for netconvert."""

    nodes: Mapping[str, tuple[float, float, str, float]]
    streets: Sequence[Street]
    connections: Sequence[tuple[str, str, int, int]] = ()
    extra: str = ""
    options: tuple[str, ...] = ()


@dataclass(frozen=True)
class Traffic:
    """Who drives: types by share, and trips between edges.

    Attributes:
        types: XML of a vType without its id, and its share, by id.
        ways: From edge, to edge, further attributes or children, and share.
        count: Trips.
        span: First and last departure [s].
        seed: Of all choices.
        trip: Attributes of every trip.
    """

    types: Mapping[str, tuple[str, float]]
    ways: Sequence[tuple[str, str, str, float]]
    count: int
    span: tuple[float, float]
    seed: int = 1
    trip: str = TRIP
    only: Mapping[str, str] = field(default_factory=dict)


def tool(name: str) -> str:
    """Path of one of SUMO's programs."""
    import sumo

    own = Path(sumo.SUMO_HOME) / "bin" / name
    found = shutil.which(name) if not own.exists() else str(own)
    if found is None:
        raise FileNotFoundError(f"{name} is missing: pip install eclipse-sumo")
    return found


def arc(
    centre: tuple[float, float], radius: float, begin: float, end: float, count: int = 9
) -> list[tuple[float, float]]:
    """Points of an arc, from angle to angle [deg]."""
    angles = np.radians(np.linspace(begin, end, count))
    return [(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angles]


def write_net(town: Town, folder: Path) -> None:
    """Let netconvert build a town."""
    nodes = [
        f'<node id="{name}" x="{x:.2f}" y="{y:.2f}" type="{kind}" radius="{radius:g}"/>'
        for name, (x, y, kind, radius) in town.nodes.items()
    ]
    edges = [line for street in town.streets for line in _edges(street)]
    links = [
        f'<connection from="{a}" to="{b}" fromLane="{i}" toLane="{j}"/>'
        for a, b, i, j in town.connections
    ]
    _write(folder / "n.nod.xml", "nodes", nodes)
    _write(folder / "n.edg.xml", "edges", [*edges, town.extra])
    _write(folder / "n.con.xml", "connections", links)
    files = ["-n", folder / "n.nod.xml", "-e", folder / "n.edg.xml", "-x", folder / "n.con.xml"]
    run([tool("netconvert"), *files, "-o", folder / NET, "--no-warnings", *town.options])


def _edges(street: Street) -> Iterable[str]:
    """The one or two edges of a street."""
    shapes = [(street.a, street.b, list(street.shape))]
    if street.both:
        shapes.append((street.b, street.a, list(street.shape)[::-1]))
    for a, b, shape in shapes:
        points = " ".join(f"{x:.3f},{y:.3f}" for x, y in shape)
        words = f' shape="{points}"' if points else ""
        yield (
            f'<edge id="{a}_{b}" from="{a}" to="{b}" numLanes="{street.lanes}"'
            f' speed="{street.speed:g}" priority="{street.rank}"{words}>{street.inner}</edge>'
        )


def write_traffic(traffic: Traffic, folder: Path) -> None:
    """Draw trips from the seed."""
    chance = random.Random(traffic.seed)
    types = [f'<vType id="{name}" {words}/>' for name, (words, _) in traffic.types.items()]
    names, shares = list(traffic.types), [share for _, share in traffic.types.values()]
    weights = [way[3] for way in traffic.ways]
    trips = []
    for number in range(traffic.count):
        begin, end, words, _ = chance.choices(traffic.ways, weights)[0]
        kind = traffic.only.get(begin) or chance.choices(names, shares)[0]
        at = chance.uniform(*traffic.span)
        inner = words if words.startswith("<") else ""
        more = "" if inner else words
        trips.append(
            (at, f'<trip id="v{number}" type="{kind}" depart="{at:.2f}" from="{begin}"'
             f' to="{end}" {traffic.trip} {more}>{inner}</trip>')
        )  # fmt: skip
    _write(folder / ROUTES, "routes", types + [line for _, line in sorted(trips)])


def run(command: Sequence[object]) -> None:
    """Run a program; what it says is shown only if it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{command[0]}: {done.stderr[-2000:]}")


def _write(path: Path, root: str, lines: Sequence[str]) -> None:
    """An XML file."""
    text = "\n".join([f"<{root}>", *lines, f"</{root}>"])
    path.write_text(text + "\n", encoding="utf-8")


def pairs(ends: Mapping[str, str], words: str = "") -> list[tuple[str, str, str, float]]:
    """All ways from one end node to another; `ends` gives the node inside of each."""
    return [(f"{a}_{ends[a]}", f"{ends[b]}_{b}", words, 1.0) for a in ends for b in ends if a != b]


def walk(
    start: tuple[float, float], heading: float, parts: Iterable[tuple[float, float]]
) -> list[tuple[float, float]]:
    """Points 5 m apart along parts of a length [m] and a curvature [1/m] each."""
    points, (x, y) = [start], start
    for length, curvature in parts:
        count = max(round(length / 5.0), 1)
        for _ in range(count):
            step = length / count
            heading += curvature * step / 2.0
            x, y = x + step * float(np.cos(heading)), y + step * float(np.sin(heading))
            heading += curvature * step / 2.0
            points.append((x, y))
    return points


def motorway(*, lanes: int, speed: float, bend: float, ramp: float) -> Town:
    """A bent carriageway with a ramp in and out and a weaving lane in between.

    Args:
        lanes: Through lanes.
        speed: Limit [m/s].
        bend: Radius of the carriageway [m].
        ramp: Radius of the ramps [m].
    """
    weave = walk((600.0, 0.0), 0.0, [(30, 0), (350, 1 / bend), (30, 0)])
    heading, border = 350.0 / bend, 3.2 * lanes
    ahead = np.array([np.cos(heading), np.sin(heading)])
    end, right = np.array(weave[-1]), np.array([ahead[1], -ahead[0]])
    # Away from the carriageway and into a tight bend; the way in is the same, mirrored.
    parts = [(40, 0), (40, -1 / 200), (40, 1 / 200), (20, 0), (1.4 * ramp, -1 / ramp), (60, 0)]
    leave = walk(tuple((end + border * right).tolist()), heading, parts)
    mirrored = [(length, -curvature) for length, curvature in parts]
    enter = walk((600.0, -border), np.pi, mirrored)[::-1]
    nodes = {
        "m0": (0.0, 0.0), "m1": (600.0, 0.0), "m2": weave[-1], "r0": enter[0], "r1": leave[-1],
        "m3": tuple((end + 500.0 * ahead).tolist()),
    }  # fmt: skip
    inside, slow = range(lanes), float(np.sqrt(3.5 * ramp))
    links = [("m0_m1", "m1_m2", i, i + 1) for i in inside] + [("r0_m1", "m1_m2", 0, 0)]
    links += [("m1_m2", "m2_m3", i + 1, i) for i in inside] + [("m1_m2", "m2_r1", 0, 0)]
    return Town(
        {name: (*place, "priority", 4.0) for name, place in nodes.items()},
        [
            Street("m0", "m1", lanes, speed, both=False, rank=9),
            Street("m1", "m2", lanes + 1, speed, both=False, shape=weave, rank=9),
            Street("m2", "m3", lanes, speed, both=False, rank=9),
            Street("r0", "m1", 1, slow, both=False, shape=enter, rank=5),
            Street("m2", "r1", 1, slow, both=False, shape=leave, rank=5),
        ],
        links,
    )


MOTORWAY_WAYS = [
    ("m0_m1", "m2_m3", "", 6.0), ("m0_m1", "m2_r1", "", 2.0), ("r0_m1", "m2_m3", "", 2.0),
    ("r0_m1", "m2_r1", "", 0.5),
]  # fmt: skip


def crossing(*, radii: Sequence[float], lanes: int = 2, inner: str = "") -> Town:
    """Lights in the middle and four small junctions around, of the given radii."""
    around = {"e": (110, 8), "n": (-6, 105), "w": (-115, -5), "s": (4, -100)}
    nodes = {"c": (0.0, 0.0, "traffic_light", radii[0])}
    streets = []
    for number, (name, (x, y)) in enumerate(around.items(), 1):
        nodes[name] = (x, y, "priority", radii[number % len(radii)])
        nodes[name + "o"] = (2.0 * x, 2.0 * y + 9.0, "priority", 5.0)
        nodes[name + "x"] = (x + 0.9 * y, y - 0.9 * x, "priority", 5.0)
        streets += [
            Street("c", name, lanes, inner=inner, rank=3),
            Street(name, name + "o", lanes, inner=inner, rank=3),
            Street(name, name + "x", lanes if inner else 1, 8.3, inner=inner),
        ]
    return Town(nodes, streets)


CROSSING_ENDS = {f"{arm}{kind}": arm for arm in "enws" for kind in "ox"}


def roundabout(*, radius: float, arms: int = 4, inner: float = 8.3) -> Town:
    """A ring with arms at its nodes; their far ends let vehicles turn back."""
    step = 360.0 / arms
    nodes, streets = {}, []
    for arm in range(arms):
        angle = np.radians(arm * step)
        away = np.array([np.cos(angle), np.sin(angle)])
        nodes[f"r{arm}"] = (*(radius * away).tolist(), "priority", 4.0)
        nodes[f"o{arm}"] = (*((radius + 130.0 + 8 * arm) * away).tolist(), "priority", 5.0)
        shape = arc((0, 0), radius, arm * step, (arm + 1) * step)
        streets.append(
            Street(f"r{arm}", f"r{(arm + 1) % arms}", 1, inner, both=False, shape=shape, rank=4)
        )
        streets.append(Street(f"r{arm}", f"o{arm}"))
    ring = [f"r{arm}_r{(arm + 1) % arms}" for arm in range(arms)]
    names = " ".join(f"r{arm}" for arm in range(arms))
    return Town(nodes, streets, extra=f'<roundabout nodes="{names}" edges="{" ".join(ring)}"/>')


def queue(*, speed: float = 16.7) -> Town:
    """Two lanes become one, then lights with little green."""
    nodes = {
        "a": (0, 0, "priority", 4), "b": (420, 0, "priority", 4),
        "c": (700, 30, "traffic_light", 6), "d": (1000, 30, "priority", 4),
        "x": (700, -120, "priority", 4), "y": (700, 180, "priority", 4),
    }  # fmt: skip
    ways = [("a", "b", 2), ("b", "c", 1), ("c", "d", 1), ("x", "c", 1), ("c", "y", 1)]
    return Town(nodes, [Street(a, b, lanes, speed, both=False) for a, b, lanes in ways])


def write_city(folder: Path, *, seed: int, size: int) -> None:
    """An irregular town with lanes for turning, by netgenerate."""
    words = (
        f"--rand --rand.iterations {size} --rand.max-distance 190 --rand.min-distance 70"
        f" --rand.min-angle 50 --rand.random-lanenumber --default.lanenumber 2"
        f" --default.junctions.radius 6 --turn-lanes 1 --turn-lanes.length 35 --tls.guess"
        f" --default.speed 13.9 --no-turnarounds.except-deadend --seed {seed} --no-warnings"
    )
    run([tool("netgenerate"), *words.split(), "-o", folder / NET])


def city_ways(folder: Path, *, count: int, seed: int) -> list[tuple[str, str, str, float]]:
    """Random pairs of the edges of a net."""
    from sumo3dviz_pt.sumo import read_network

    network = read_network(folder / NET)
    edges = sorted(name for name, edge in network.edges.items() if edge.function == "normal")
    chance = random.Random(seed)
    return [(*chance.sample(edges, 2), "", 1.0) for _ in range(count)]
