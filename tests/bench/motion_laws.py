"""How many road users are drawn otherwise than they drive, by smoother, for the manual.

Run from the repository's root; needs SUMO; it takes minutes. Counts of an older version stand
beside them: they are made by the same command there, with `motion/laws.py`, `alignment.py` and
`resting.py` of this one, which are what counts:

    python tests/bench/motion_laws.py --before BEFORE.json -o docs/_bench

A plain grid, the networks of `any_network` and logs with stop-and-go, wiggles, teleports and steps
of 0.04 to 10 s are made here; the examples are in the repository, the other scenarios are not, and
are left out where they lack.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from any_network.programs import call
from any_network.recipes import RECIPES
from any_network.simulation import simulate
from any_traffic import LANES, STEPS, network, traffic
from drives import TYPES, log_of

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import TrafficLog, VehicleType
from sumo3dviz_pt.motion import smooth_log, smoother_names
from sumo3dviz_pt.motion.laws import breaches
from sumo3dviz_pt.motion.setting import body_length
from sumo3dviz_pt.motion.smoothers.registry import SMOOTHERS
from sumo3dviz_pt.sumo import find_scenario, read_scenario

ROOT = Path(__file__).resolve().parents[2]
SHARED = ("bologna_acosta", "doerpfeldstr", "badhersfeld", "barcelona", "monaco_west_hills")
DRAWN = 140
"""Logs drawn by a seed."""

Counts = Mapping[str, Mapping[str, int]]
Simulated = tuple[str, TrafficLog, Network, dict[str, VehicleType]]


def simulations(data: Path, folder: Path) -> Iterator[Simulated]:
    """Yield what is looked at: its row of the table, log, network and types."""
    grid(folder)
    yield of_place(folder, "plain grid")
    places = [ROOT / "examples" / "crossing", ROOT / "examples" / "ronda"]
    places += [data / name for name in SHARED if (data / name).is_dir()]
    for place in places:
        yield of_place(place, place.name)
    for number in range(len(RECIPES)):
        yield of_place(simulate(number, folder / str(number)), f"{len(RECIPES)} kinds of networks")
    for net in sorted((data / "cases").glob("*/net.net.xml*")):
        if any(net.parent.glob("fcd.xml*")):
            yield of_place(net.parent, "small cases")
    chance = np.random.default_rng(0)
    for seed in range(DRAWN):
        step = STEPS[seed % len(STEPS)]
        euler, sublane = (bool(each) for each in chance.integers(2, size=2))
        drawn = traffic(seed, step=step, euler=euler, sublane=sublane)
        log = log_of(replace(drawn, id=str(seed)), names=LANES, step=step)
        yield "drawn logs", log, network(), dict(TYPES)


def of_place(place: Path, row: str) -> Simulated:
    """Read a folder's simulation for a row of the table."""
    read = read_scenario(find_scenario(place))
    return row, read.traffic, read.network, dict(read.vehicle_types)


def grid(folder: Path) -> None:
    """Let SUMO drive 308 cars through a plain grid of one lane."""
    words = ["--grid", "--grid.number", "5", "--grid.length", "150", "--tls.guess", "true"]
    call("netgenerate", [*words, "--seed", "3", "-o", "net.net.xml"], folder=folder)
    text = (folder / "net.net.xml").read_text(encoding="utf-8")
    edges = sorted(set(re.findall(r'<edge id="([A-Z]\d[A-Z]\d)"', text)))
    chance = np.random.default_rng(4)
    trips = ['<routes><vType id="c" vClass="passenger" length="4.6" sigma="0"/>']
    for number in range(308):
        start, end = chance.choice(edges, 2, replace=False)
        trips.append(
            f'<trip id="t{number}" type="c" depart="{number * 0.9:.0f}" from="{start}" to="{end}"/>'
        )
    (folder / "trips.rou.xml").write_text("\n".join([*trips, "</routes>"]), encoding="utf-8")
    words = ["-n", "net.net.xml", "-r", "trips.rou.xml", "--fcd-output", "fcd.xml", "--end", "600"]
    call("sumo", [*words, "--seed", "5", "--no-step-log", "--no-warnings"], folder=folder)


def counted(simulated: Simulated) -> dict[str, int]:
    """Return how many road users there are, and how many of them break a law, by smoother."""
    _, log, net, types = simulated
    found = {"all": len(log.traces)}
    for smoother in smoother_names():
        shown = smooth_log(log, smoother=smoother, network=net, types=types)
        blur, wrong = SMOOTHERS[smoother].blur, 0
        for trace, drawn in zip(log.traces, shown, strict=True):
            length = body_length(trace, types)
            laws = breaches(trace, drawn, step=log.step, length=length, blur=blur)
            wrong += any(True for _ in laws)
        found[smoother] = wrong
    return found


def page(before: Counts, now: Counts) -> str:
    """Return the manual's table: before, then now."""
    names = smoother_names()
    lines = ["| road users | all | " + " | ".join(f"`{name}`" for name in names) + " |"]
    lines.append("|---|--:|" + "--:|" * len(names))
    for name, row in now.items():
        old = before.get(name, {})
        cells = [(f"{old[each]} → " if each in old else "") + str(row[each]) for each in names]
        lines.append(f"| {name} | {row['all']} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Count, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", type=Path, help="counts of an older version")
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found: dict[str, Counter[str]] = {}
        for each in simulations(options.data, Path(folder)):
            found.setdefault(each[0], Counter()).update(counted(each))
    text = json.dumps(found, indent=1) + "\n"
    (options.output / "motion_laws.json").write_text(text, encoding="utf-8")
    before = json.loads(options.before.read_text(encoding="utf-8")) if options.before else {}
    (options.output / "motion_laws.md").write_text(page(before, found), encoding="utf-8")


if __name__ == "__main__":
    main()
