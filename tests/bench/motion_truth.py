"""The truth about motion: SUMO at steps of 0.04 s, and the coarse logs that are cut from it.

Thinned logs hold what SUMO would have logged at longer steps, rounded to its 1 cm. Logs of
Euler's kind say the mean speed since the row before instead of the speed of the moment, as
SUMO's own logs do whose step is that of the simulation.
"""

from __future__ import annotations

import csv
import hashlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from bench.motion_nets import (
    CROSSING_ENDS,
    EIDM,
    LAYERED,
    MOTORWAY_WAYS,
    NET,
    PLAIN,
    ROUTES,
    SLOW,
    Town,
    Traffic,
    city_ways,
    crossing,
    motorway,
    pairs,
    queue,
    roundabout,
    run,
    tool,
    write_city,
    write_net,
    write_traffic,
)

from sumo3dviz_pt.model.geometry import Floats

STEP = 0.04
"""Of the true runs [s]."""

SMOOTH = ("--lanechange.duration", "3")
"""Lane changes that take time, or the truth itself could not be driven."""

SUBLANE = ("--lateral-resolution", "0.8")
COLUMNS = ("x", "y", "angle", "speed", "pos", "odometer")


@dataclass(frozen=True, eq=False)
class Drive:
    """What one vehicle truly did.

    Attributes:
        id: SUMO's id.
        type_id: Its vType.
        times: (n,) [s], every 0.04 s.
        positions: (n, 2) [m].
        angles: SUMO's, unwrapped, (n,) [deg].
        speeds: (n,) [m/s].
        offsets: Place along the lane, (n,) [m].
        ways: Odometer, (n,) [m].
        lanes: Ids, (n,).
    """

    id: str
    type_id: str
    times: Floats
    positions: Floats
    angles: Floats
    speeds: Floats
    offsets: Floats
    ways: Floats
    lanes: np.ndarray

    @property
    def yaws(self) -> Floats:
        """Counter-clockwise from east, unwrapped, (n,) [rad]."""
        return np.pi / 2.0 - np.radians(self.angles)

    @cached_property
    def changes(self) -> Floats:
        """Times of lane changes [s]: another lane of the same edge, or a jump to the side."""
        edges = np.array([lane.rsplit("_", 1)[0] for lane in self.lanes])
        moved = (self.lanes[1:] != self.lanes[:-1]) & (edges[1:] == edges[:-1])
        chords = np.linalg.norm(np.diff(self.positions, axis=0), axis=1)
        return self.times[1:][moved | (chords - np.diff(self.ways) > 0.4)]

    def kept(self, stride: int) -> np.ndarray:
        """Which samples a log has that keeps every `stride`-th step, as indices."""
        return np.flatnonzero(np.rint(self.times / STEP).astype(int) % stride == 0)


@dataclass(frozen=True)
class Scenario:
    """One true run.

    Attributes:
        name: Unique.
        held_out: Nothing may be tuned on it.
        what: For the table.
        make: Writes net and routes into a folder.
        options: Of sumo.
        begin: First time that is logged [s].
        end: Last one [s].
        seed: SUMO's.
    """

    name: str
    held_out: bool
    what: str
    make: Callable[[Path], None]
    options: tuple[str, ...] = SMOOTH
    begin: float = 60.0
    end: float = 120.0
    seed: int = 7


def _made(town: Town, traffic: Traffic) -> Callable[[Path], None]:
    """Writes a town and its traffic."""

    def make(folder: Path) -> None:
        write_net(town, folder)
        write_traffic(traffic, folder)

    return make


def _city(net_seed: int, size: int, traffic_seed: int) -> Callable[[Path], None]:
    """Writes an irregular town and its traffic."""

    def make(folder: Path) -> None:
        write_city(folder, seed=net_seed, size=size)
        ways = city_ways(folder, count=200, seed=traffic_seed)
        write_traffic(Traffic(MIXED, ways, 75, (35.0, 115.0), traffic_seed, ANY_LANE), folder)

    return make


ANY_LANE = 'departLane="random" departSpeed="max"'
CAR = f'vClass="passenger" length="4.6" {PLAIN}'
CARS = {"car": (CAR, 1.0)}
MIXED = {
    "car": (CAR, 8.0),
    "van": (f'vClass="delivery" length="5.9" {PLAIN}', 1.0),
    "truck": (f'vClass="truck" length="8.5" {PLAIN}', 1.0),
    "motorcycle": (f'vClass="motorcycle" length="2.2" {PLAIN}', 1.0),
}
FAST = {
    "car": (CAR, 6.0),
    "eidm": (f'vClass="passenger" length="4.3" {EIDM}', 2.0),
    "semi": (f'vClass="trailer" length="16.5" {PLAIN}', 1.5),
}
HALT = '<stop lane="c_{0}_0" endPos="60" duration="8"/>'
BUSES = {
    "bus": (f'vClass="bus" length="12" {PLAIN}', 1.0),
    "articulated": (f'vClass="bus" length="18" {PLAIN}', 1.0),
}
CYCLES = {"bicycle": (f'vClass="bicycle" length="1.8" {SLOW}', 4.0), "car": (CAR, 1.0)}
OLD_TOWN = {
    "eidm": (f'vClass="passenger" length="4.2" {EIDM}', 5.0),
    "bus": (f'vClass="bus" length="10.5" {PLAIN}', 1.0),
    "moped": ('vClass="moped" length="2.1" sigma="0"', 1.0),
}
ARMS = {f"o{arm}": f"r{arm}" for arm in range(5)}
FOUR = {name: inside for name, inside in ARMS.items() if name != "o4"}
HALTS = [(f"{a}o_{a}", f"{b}_{b}o", HALT.format(b), 1.0) for a in "enws" for b in "enws" if a != b]
BACK = [
    (f"o{a}_r{a}", f"r{a}_o{a}", f'via="r{b}_o{b}"', 1.0)
    for a in range(4) for b in range(4) if a != b
]  # fmt: skip
_MOTORWAY = _made(
    motorway(lanes=3, speed=30.0, bend=600.0, ramp=60.0),
    Traffic(FAST, MOTORWAY_WAYS, 80, (0.0, 110.0), 1),
)
_FASTER = motorway(lanes=4, speed=36.0, bend=420.0, ramp=42.0)

SCENARIOS = (
    Scenario(
        "motorway", False, "three lanes, 30 m/s, ramps, lorries; changes of lanes take 3 s",
        _MOTORWAY,
    ),
    Scenario(
        "motorway_instant", False, "the same with SUMO's default changes of lanes, in one step",
        _MOTORWAY, options=(),
    ),
    Scenario(
        "crossing", False, "lights, two lanes, tight turns (6 to 8 m)",
        _made(crossing(radii=(7.0, 6.0, 8.0)),
              Traffic(MIXED, pairs(CROSSING_ENDS), 75, (0.0, 110.0), 2)),
    ),
    Scenario(
        "roundabout", False, "ring of 16 m, four arms",
        _made(roundabout(radius=16.0), Traffic(MIXED, pairs(FOUR), 40, (20.0, 110.0), 3)),
    ),
    Scenario(
        "u_turn", False, "ring of 22 m, turns at dead ends",
        _made(roundabout(radius=22.0), Traffic(CARS, BACK, 36, (20.0, 110.0), 4)),
    ),
    Scenario(
        "queue", False, "two lanes into one, lights, EIDM",
        _made(queue(), Traffic({"eidm": (f'vClass="passenger" length="4.4" {EIDM}', 1.0)},
                               [("a_b", "c_d", "", 4.0), ("x_c", "c_y", "", 1.0)],
                               60, (0.0, 115.0), 5, ANY_LANE)),
        end=150.0,
    ),
    Scenario(
        "bicycles", False, "bicycle lanes, turns of 5 and 6 m",
        _made(crossing(radii=(6.0, 5.0), inner=LAYERED),
              Traffic(CYCLES, pairs(CROSSING_ENDS), 45, (0.0, 110.0), 6)),
    ),
    Scenario(
        "buses", False, "12 and 18 m, stops",
        _made(crossing(radii=(9.0, 8.0)), Traffic(BUSES, HALTS, 26, (0.0, 100.0), 7)),
    ),
    Scenario(
        "city", True, "irregular town by netgenerate, lanes for turning, lights",
        _city(11, 60, 21),
    ),
    Scenario(
        "city_instant", True, "another one, changes of lanes in one step",
        _city(31, 60, 22), options=(), seed=9,
    ),
    Scenario(
        "motorway_sublane", True, "four lanes, 36 m/s, tighter bends, sublane model",
        _made(_FASTER, Traffic(FAST, MOTORWAY_WAYS, 90, (0.0, 110.0), 23)),
        options=SUBLANE, seed=5,
    ),
    Scenario(
        "old_town", True, "left-hand traffic, one lane, turns of 4 to 10 m, EIDM, buses, mopeds",
        _made(
            Town(**{**crossing(radii=(5.0, 4.0, 10.0), lanes=1).__dict__,
                    "options": ("--lefthand",)}),
            Traffic(OLD_TOWN, pairs(CROSSING_ENDS), 55, (0.0, 110.0), 24)),
        seed=13,
    ),
    Scenario(
        "small_ring", True, "ring of 11 m, five arms",
        _made(roundabout(radius=11.0, arms=5, inner=6.9),
              Traffic(MIXED, pairs(ARMS), 45, (10.0, 110.0), 25)),
        seed=17,
    ),
)  # fmt: skip
"""All runs; those that are held out have other roads, radii, speeds, rules and seeds."""


def truth(scenario: Scenario, cache: Path) -> list[Drive]:
    """Run SUMO unless that was done before, and read what truly happened."""
    folder = cache / scenario.name
    log, stamp = folder / "truth.csv", folder / "stamp"
    if not (stamp.exists() and stamp.read_text(encoding="utf-8") == _stamp()):
        folder.mkdir(parents=True, exist_ok=True)
        scenario.make(folder)
        files = ["-n", folder / NET, "-r", folder / ROUTES, "--fcd-output", log]
        words = (
            f"--step-length {STEP} --precision 6 --begin 0 --end {scenario.end}"
            f" --device.fcd.begin {scenario.begin} --seed {scenario.seed} --no-step-log"
            f" --no-warnings --time-to-teleport -1 --output.column-header plain"
            f" --fcd-output.attributes type,lane,{','.join(COLUMNS)}"
        )
        run([tool("sumo"), *files, *words.split(), *scenario.options])
        stamp.write_text(_stamp(), encoding="utf-8")
    return read_truth(log)


def _stamp() -> str:
    """Changes with the text of the modules that make the runs."""
    own = [Path(__file__), Path(__file__).with_name("motion_nets.py")]
    return hashlib.sha256(b"".join(path.read_bytes() for path in own)).hexdigest()


def read_truth(path: Path) -> list[Drive]:
    """Read a true run; vehicles with less than five seconds are left out."""
    rows: dict[tuple[str, str], list[list[float]]] = defaultdict(list)
    lanes: dict[tuple[str, str], list[str]] = defaultdict(list)
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file, delimiter=";"):
            if not row["id"]:
                continue
            key = (row["id"], row["type"])
            rows[key].append([float(row["time"]), *(float(row[name]) for name in COLUMNS)])
            lanes[key].append(row["lane"])
    drives = [_drive(key, np.array(rows[key]), np.array(lanes[key])) for key in rows]
    return [drive for drive in drives if drive.times[-1] - drive.times[0] >= 5.0]


def _drive(key: tuple[str, str], table: Floats, lanes: np.ndarray) -> Drive:
    """One vehicle of a table of time and `COLUMNS`."""
    angles = np.degrees(np.unwrap(np.radians(table[:, 3])))
    return Drive(
        *key, table[:, 0], table[:, 1:3], angles, table[:, 4], table[:, 5], table[:, 6], lanes
    )


def write_log(drives: Sequence[Drive], path: Path, *, stride: int, euler: bool) -> None:
    """Write every `stride`-th step as SUMO would log it, to the centimetre.

    Args:
        drives: The truth.
        path: The vehicle log to write.
        stride: Steps of the truth from row to row.
        euler: Speeds are way over time since the row before.
    """
    steps: dict[float, list[str]] = defaultdict(list)
    for drive in drives:
        kept = drive.kept(stride)
        speeds = drive.speeds[kept].copy()
        if euler:
            speeds[1:] = np.diff(drive.ways[kept]) / np.diff(drive.times[kept])
        for index, speed in zip(kept, speeds, strict=True):
            x, y = drive.positions[index]
            steps[round(float(drive.times[index]), 3)].append(
                f'<vehicle id="{drive.id}" x="{x:.2f}" y="{y:.2f}"'
                f' angle="{drive.angles[index] % 360.0:.2f}" type="{drive.type_id}"'
                f' speed="{speed:.2f}" pos="{drive.offsets[index]:.2f}"'
                f' lane="{drive.lanes[index]}" slope="0.00"/>'
            )
    lines = [
        f'<timestep time="{at:.2f}">\n' + "\n".join(rows) + "\n</timestep>"
        for at, rows in sorted(steps.items())
    ]
    text = "\n".join(["<fcd-export>", *lines, "</fcd-export>"])
    path.write_text(text + "\n", encoding="utf-8")
