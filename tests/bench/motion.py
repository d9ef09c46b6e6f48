"""Every smoother against the truth, for the manual; and what smoothing costs.

Run from the repository's root; needs `pip install ".[dev]"` for SUMO:

    python tests/bench/motion.py -o docs/_bench

True runs, thinned logs and the worst vehicles stay under `build/motion`; table, page and
plot go to the manual. Smoothers come from the registry.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.motion_cost import costs
from bench.motion_page import publish
from bench.motion_scores import (
    MOVING,
    Frames,
    Pool,
    errors,
    excess,
    feel,
    lane_distances,
    near,
    summary,
    turning,
)
from bench.motion_truth import SCENARIOS, Drive, Scenario, truth, write_log

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import TrafficLog, VehicleType
from sumo3dviz_pt.model.trajectory import Remark, Trajectory
from sumo3dviz_pt.motion import smooth_log, smoother_names
from sumo3dviz_pt.sumo import read_network, read_trajectories, read_vehicle_types

STRIDES = (3, 12, 25, 50)
"""Steps of the truth from row to row: 0.12, 0.48, 1 and 2 s."""

FAST = 60.0
"""The other frame rate, for logs of one second [1/s]."""

BLIND = ("linear", "paper", "paper_symmetric")
"""These never look at speeds, so logs of Euler's kind change nothing."""

AWAY = 5.0
"""Positions count this far from lane changes [s]."""

AROUND = 3.0
"""Lane changes are judged this far around them [s]."""

STANDING = 0.5
"""[m/s]."""

BEND = np.radians(20.0)
"""Who turns by more within a second to both sides is in a bend; there corners are felt too."""

WORST = ("distance", "lateral", "heading", "acceleration", "jerk", "yaw_rate", "excess", "peak")


@dataclass(frozen=True, eq=False)
class Log:
    """One thinned log and where it comes from."""

    scenario: Scenario
    drives: Sequence[Drive]
    network: Network
    shapes: dict[str, Floats]
    types: dict[str, VehicleType]
    traffic: TrafficLog
    stride: int
    kind: str

    def row(self, smoother: str, fps: float) -> dict[str, Any]:
        """What the table says of a case before its numbers."""
        return {
            "scenario": self.scenario.name, "held_out": self.scenario.held_out,
            "step": round(self.stride * 0.04, 2), "speed": self.kind, "smoother": smoother,
            "fps": fps,
        }  # fmt: skip


def true_frames(drive: Drive, times: Floats) -> Frames:
    """The truth at times within its life, (n,) [s]."""

    def at(values: Floats) -> Floats:
        return np.interp(times, drive.times, values)

    places = np.column_stack([at(column) for column in drive.positions.T])
    return Frames(times, places, at(drive.yaws), at(drive.speeds))


def shown_frames(trajectory: Trajectory, times: Floats) -> Frames:
    """What is shown at times, (n,) [s]; yaws are unwrapped, NaN stays."""
    motion = trajectory.sample(times)
    yaws = motion.yaws.copy()
    yaws[motion.alive] = np.unwrap(yaws[motion.alive])
    return Frames(times, motion.positions[:, :2], yaws, motion.speeds)


def frame_times(drive: Drive, kept: np.ndarray, fps: float | None) -> Floats:
    """Those of the truth itself at 25 frames a second, or of a film at another rate [s]."""
    if fps is None:
        return drive.times[kept[0] : kept[-1] + 1]
    first, last = drive.times[kept[0]], drive.times[kept[-1]]
    return np.arange(np.ceil(first * fps - 1e-6), np.floor(last * fps + 1e-6) + 1) / fps


def enter(
    pool: Pool,
    log: Log,
    drive: Drive,
    frames: tuple[Frames, Frames],
    remarks: Sequence[Remark] = (),
) -> dict[str, Any]:
    """Enter one vehicle into a pool, and say where it is worst."""
    shown, true = frames
    alive = np.isfinite(shown.positions[:, 0])
    pool.add("missing", float((~alive).sum()))
    if alive.sum() < 4:
        return {}
    shown, true = shown.part(alive), true.part(alive)
    length, changes = log.types[drive.type_id].length, drive.changes
    calm = ~near(true.times, changes, AWAY)
    wrong, felt = errors(shown, true), feel(shown, length=length)
    for name, values in {**wrong, **felt}.items():
        pool.add(name, values[calm])
    pool.add("birth", wrong["distance"][0])
    pool.add("death", wrong["distance"][-1])
    kept = drive.kept(log.stride)
    rows = {"times": drive.times[kept], "speeds": drive.speeds[kept]}
    over, own = excess(shown, **rows), excess(true, **rows)
    # SUMO itself slides standing vehicles aside; nothing that is shown there keeps to a speed.
    slides = true.times[1:][(own > 0.0) & (true.speeds[1:] < STANDING)]
    over[_parking(shown.times[1:], remarks) | near(true.times[1:], slides, 1.0)] = np.nan
    pool.add("excess", over)
    _enter_lanes(pool, log, drive, shown.part(np.flatnonzero(calm)[::4]))
    busy = near(true.times, changes, AROUND) & (true.speeds > MOVING)
    for name in ("across", "yaw_rate", "crab"):
        pool.add(f"change_{name}", felt[name][busy])
    peaks = np.where(near(true.times, changes, AROUND), felt["acceleration"], np.nan)
    bend = turning(true, within=1.0, least=BEND)
    for change in changes:
        beside = near(true.times, np.array([change]), AROUND)
        for name, where in (("change_peak", beside & ~bend), ("bend_peak", beside & bend)):
            some = peaks[where & np.isfinite(peaks)]
            pool.add(name, some.max(initial=0.0))
    return _worst(
        true.times, calm, wrong | felt, {"excess": np.append(over, np.nan), "peak": peaks}
    )


def _parking(times: Floats, remarks: Sequence[Remark]) -> Bools:
    """Times of moves aside that were listed: there a standing vehicle may move."""
    inside = np.zeros(len(times), dtype=np.bool_)
    for remark in remarks:
        if remark.kind == "parking":
            inside |= (times >= remark.begin) & (times <= remark.end + 0.05)
    return inside


def _enter_lanes(pool: Pool, log: Log, drive: Drive, shown: Frames) -> None:
    """Distance from the centre of the lane."""
    index = np.clip(np.searchsorted(drive.times, shown.times - 1e-6), 0, len(drive.times) - 1)
    pool.add("lane", lane_distances(shown.positions, drive.lanes[index], log.shapes))


def _worst(
    times: Floats, calm: np.ndarray, away: dict[str, Floats], always: dict[str, Floats]
) -> dict[str, Any]:
    """The largest values of a vehicle and when; those of `away` far from lane changes."""
    found = {}
    for name in WORST:
        values = np.where(calm, away[name], np.nan) if name in away else always[name]
        if np.isfinite(values).any():
            index = int(np.nanargmax(values))
            found[name] = (float(values[index]), float(times[index]))
    return found


def measure(log: Log, smoother: str, rates: Sequence[float | None]) -> list[dict[str, Any]]:
    """Rows of one smoother on one log, by frame rate; `None` is the truth's own 25."""
    start = time.process_time()
    shown = smooth_log(log.traffic, smoother=smoother, network=log.network, types=log.types)
    by_id = {each.id: each for each in shown}
    spent, rows = time.process_time() - start, []
    for fps in rates:
        pool, worst, took, alive = Pool(), {}, 0.0, 0.0
        for drive in log.drives:
            times = frame_times(drive, drive.kept(log.stride), fps)
            start = time.process_time()
            frames = shown_frames(by_id[drive.id], times)
            took += time.process_time() - start
            alive += float(times[-1] - times[0])
            both = (frames, true_frames(drive, times))
            worst[drive.id] = enter(pool, log, drive, both, by_id[drive.id].remarks)
        row = log.row(smoother, fps or 25.0) | summary(pool)
        rows.append(row | {"us": 1e6 * (spent + took) / alive, "worst": worst})
    return rows


def measure_truth(log: Log) -> dict[str, Any]:
    """The truth's own row: what it feels like, at 25 frames a second."""
    pool = Pool()
    for drive in log.drives:
        frames = true_frames(drive, frame_times(drive, drive.kept(log.stride), None))
        enter(pool, log, drive, (frames, frames))
    life = sum(float(drive.times[-1] - drive.times[0]) for drive in log.drives)
    town = {"what": log.scenario.what, "vehicles": len(log.drives), "seconds": life}
    return log.row("truth", 25.0) | summary(pool) | {"us": 0.0, "worst": {}, **town}


def logs(scenario: Scenario, cache: Path) -> Iterable[Log]:
    """All thinned logs of a scenario."""
    drives = truth(scenario, cache)
    folder = cache / scenario.name
    network = read_network(folder / "net.net.xml")
    shapes = {name: lane.shape[:, :2] for name, lane in network.lanes.items()}
    types = dict(read_vehicle_types([folder / "routes.rou.xml"]))
    for stride in STRIDES:
        some = [drive for drive in drives if len(drive.kept(stride)) >= 3]
        for kind in ("moment", "Euler"):
            path = folder / f"fcd_{stride}_{kind}.xml"
            write_log(some, path, stride=stride, euler=kind == "Euler")
            traffic = read_trajectories([path])
            yield Log(scenario, some, network, shapes, types, traffic, stride, kind)


def table(scenarios: Sequence[Scenario], names: Sequence[str], cache: Path) -> list[dict[str, Any]]:
    """All rows."""
    rows: list[dict[str, Any]] = []
    for scenario in scenarios:
        for log in logs(scenario, cache):
            rates = (None, FAST) if log.stride == 25 else (None,)
            if log.kind == "moment":
                rows.append(measure_truth(log))
            for name in names:
                if log.kind == "moment" or name not in BLIND:
                    rows += measure(log, name, rates)
        print(f"{scenario.name}: {time.process_time():.0f} CPU-s so far", file=sys.stderr)
    return rows


def worst_vehicles(rows: Sequence[dict[str, Any]], count: int = 10) -> dict[str, Any]:
    """For each smoother, the worst vehicles by each measure, far from lane changes."""
    found: dict[str, Any] = {}
    for row in rows:
        where = {key: row[key] for key in ("scenario", "step", "speed")}
        for vehicle, values in row["worst"].items():
            for name, (value, at) in values.items():
                entry = {"value": value, "id": vehicle, "time": at, **where}
                found.setdefault(row["smoother"], {}).setdefault(name, []).append(entry)
    for lists in found.values():
        for name, entries in lists.items():
            lists[name] = sorted(entries, key=lambda entry: -entry["value"])[:count]
    return found


def main() -> None:
    """Measure what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=[each.name for each in SCENARIOS], action="append")
    parser.add_argument("--smoother", action="append", help="default: all that there are")
    parser.add_argument("--cache", type=Path, default=Path("build/motion"))
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument(
        "--part", choices=("table", "cost", "page"), help="keep what else was found"
    )
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    chosen = [each for each in SCENARIOS if options.only is None or each.name in options.only]
    names = options.smoother or smoother_names()
    if options.part in (None, "table"):
        rows = table(chosen, names, options.cache)
        _store(options.cache / "worst.json", worst_vehicles(rows))
        _store(options.cache / "rows.json", [row | {"worst": {}} for row in rows])
    if options.part in (None, "cost"):
        _store(options.cache / "cost.json", costs(names, options.data, options.cache))
    rows, spent = (_stored(options.cache / name) for name in ("rows.json", "cost.json"))
    print("\n".join(publish(rows or [], spent or {}, options.output)))


def _store(path: Path, value: Any) -> None:
    """Keep results."""
    path.write_text(json.dumps(value, indent=1, default=float) + "\n", encoding="utf-8")


def _stored(path: Path) -> Any:
    """Results that were kept, or None."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


if __name__ == "__main__":
    main()
