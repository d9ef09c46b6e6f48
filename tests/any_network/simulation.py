"""Makes a network and its logs in a folder, by SUMO's own programs."""

from __future__ import annotations

import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from any_network.programs import call
from any_network.recipes import RECIPES, Recipe
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.sumo import read_network

NET, LOG, SIGNALS, TYPES = "net.net.xml", "fcd.xml", "tls.xml", "types.add.xml"

CLASSES = (
    *("passenger", "taxi", "bus", "truck", "trailer", "delivery", "motorcycle", "bicycle"),
    *("coach", "emergency", "moped", "evehicle", "scooter", "army", "authority", "tram"),
    *("rail_urban", "rail", "rail_electric", "rail_fast", "ship", "private", "vip", "hov"),
    *("subway", "cable_car", "wheelchair", "drone", "custom1", "custom2"),
)
"""vClasses of vehicles."""

_NO_ROAD = frozenset(
    {"tram", "rail_urban", "rail", "rail_electric", "rail_fast", "ship", "subway", "cable_car"}
    | {"drone", "wheelchair"}
)
"""vClasses that belong on no road, though SUMO lets them onto lanes without restrictions."""

_SHORT = {"rail_urban": 50, "rail": 60, "rail_electric": 70, "rail_fast": 80, "subway": 40}
"""Lengths of trains [m], so that they find room on short tracks."""


def simulate(number: int, folder: Path) -> Path:
    """Make network, types, vehicle log and signal log of a number; return the folder."""
    recipe = RECIPES[number]
    folder.mkdir(parents=True, exist_ok=True)
    _write_network(recipe, folder, seed=number)
    network = read_network(folder / NET)
    _write_types(folder)
    _write_trips(recipe, network, folder, seed=number)
    _run(recipe, network, folder, seed=number)
    if recipe.after is not None:
        net = folder / NET
        net.write_text(recipe.after(net.read_text(encoding="utf-8")), encoding="utf-8")
    for name in ("n.nod.xml", "n.edg.xml", "n.con.xml", "trips.rou.xml", "lights.add.xml"):
        (folder / name).unlink(missing_ok=True)
    return folder


def _write_network(recipe: Recipe, folder: Path, *, seed: int) -> None:
    """Let netgenerate or netconvert write the network."""
    words = [*shlex.split(recipe.options), "--no-warnings", "-o", NET]
    if recipe.plain is None:
        own = [] if "--seed" in words else ["--seed", str(seed)]
        call("netgenerate", [*words, *own], folder=folder)
        return
    for name, text in recipe.plain.files().items():
        (folder / name).write_text(text, encoding="utf-8")
    given = ["-n", "n.nod.xml", "-e", "n.edg.xml", "-x", "n.con.xml"]
    call("netconvert", [*given, *words], folder=folder)


def _write_types(folder: Path) -> None:
    """Write one type of vehicle for each class."""
    types = "\n".join(
        f'<vType id="{name}" vClass="{name}"'
        + (f' length="{_SHORT[name]}"' if name in _SHORT else "")
        + "/>"
        for name in (*CLASSES, "pedestrian")
    )
    text = f"<additional>\n{types}\n</additional>"
    (folder / TYPES).write_text(text, encoding="utf-8")


def _write_trips(recipe: Recipe, network: Network, folder: Path, *, seed: int) -> None:
    """Write trips between edges drawn by a seed, each class on lanes that it may use."""
    rng = np.random.default_rng(seed)
    edges = [edge for edge in network.edges.values() if edge.function == "normal"]
    trips: list[tuple[float, str]] = []
    for index in range(recipe.vehicles):
        cars = recipe.classes == "cars" or index % 4 == 0
        kind = "passenger" if cars else CLASSES[int(rng.integers(len(CLASSES)))]
        every = recipe.classes == "every" or kind not in _NO_ROAD
        open_to = [e.id for e in edges if _takes(e, kind, every=every)]
        if not open_to:
            continue
        start, end = (open_to[int(rng.integers(len(open_to)))] for _ in range(2))
        depart = round(float(rng.uniform(0.0, 0.6 * recipe.end)), 1)
        trips.append(
            (
                depart,
                f'<trip id="{kind}{index}" type="{kind}" depart="{depart}" from="{start}"'
                f' to="{end}" departLane="best" departPos="random_free" departSpeed="avg"/>',
            )
        )
    walks = [e.id for e in edges if any("pedestrian" in lane.allowed for lane in e.lanes)]
    for index in range(recipe.persons):
        start, end = (walks[int(rng.integers(len(walks)))] for _ in range(2))
        depart = round(float(rng.uniform(0.0, 0.3 * recipe.end)), 1)
        trips.append(
            (
                depart,
                f'<person id="p{index}" type="pedestrian" depart="{depart}" departPos="random">'
                f'<walk from="{start}" to="{end}"/></person>',
            )
        )
    text = "\n".join(trip for _, trip in sorted(trips, key=lambda trip: trip[0]))
    (folder / "trips.rou.xml").write_text(f"<routes>\n{text}\n</routes>", encoding="utf-8")


def _takes(edge: Edge, kind: str, *, every: bool) -> bool:
    """Whether vehicles of a class are sent to an edge.

    Args:
        edge: The edge.
        kind: The class.
        every: Whether lanes that are open to cars too are good enough.
    """
    lanes = [lane.allowed for lane in edge.lanes if kind in lane.allowed]
    return any(every or "passenger" not in allowed for allowed in lanes)


def _run(recipe: Recipe, network: Network, folder: Path, *, seed: int) -> None:
    """Let SUMO drive."""
    lights = sorted({link.tls for link in network.connections if link.tls})
    events = "\n".join(
        f'<timedEvent type="SaveTLSStates" source="{name}" dest="{SIGNALS}"/>' for name in lights
    )
    (folder / "lights.add.xml").write_text(f"<additional>{events}</additional>", encoding="utf-8")
    words = [
        *("-n", NET, "-r", "trips.rou.xml", "-a", f"{TYPES},lights.add.xml"),
        *("--fcd-output", LOG, "--begin", "0", "--end", str(recipe.end)),
        *("--step-length", str(recipe.step), "--seed", str(seed)),
        *("--ignore-route-errors", "--no-step-log", "--no-warnings", "--xml-validation", "never"),
    ]
    words += ["--lateral-resolution", "0.8"] if recipe.sublane else []
    call("sumo", words, folder=folder)


def rows_in(log: Path) -> int:
    """Return how many rows of road users a log has."""
    return sum(len(step) for step in ET.parse(log).getroot().iter("timestep"))
