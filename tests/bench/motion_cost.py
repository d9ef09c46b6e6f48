"""What smoothing costs: on a real log, over the number of rows, and in memory."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from bench.motion_truth import SCENARIOS, truth, write_log

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import TrafficLog, VehicleType
from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.sumo import read_network, read_trajectories, read_vehicle_types

Given = tuple[TrafficLog, Network, dict[str, VehicleType]]

ROWS = (10_000, 100_000, 1_000_000)
LONGER = (1, 2, 4, 8)
DEFAULT = "lane"
OWN = "city"


def costs(names: Sequence[str], data: Path, cache: Path) -> dict[str, Any]:
    """CPU-seconds and memory; what is missing is left out.

    Args:
        names: Smoothers.
        data: Folder that may hold `barcelona`.
        cache: Folder of the true runs.
    """
    chosen = DEFAULT if DEFAULT in names else names[-1]
    given = _own(cache)
    found: dict[str, Any] = {
        "smoother": chosen, "scaling": scaling(given, chosen),
        "memory": memory(given, chosen, cache),
    }  # fmt: skip
    if (data / "barcelona").is_dir():
        found["barcelona"] = barcelona(names, data / "barcelona")
    return found


def _own(cache: Path) -> Given:
    """A log of ours at steps of a second."""
    scenario = next(each for each in SCENARIOS if each.name == OWN)
    folder, path = cache / OWN, cache / OWN / "fcd_cost.xml"
    drives = [drive for drive in truth(scenario, cache) if len(drive.kept(25)) >= 3]
    write_log(drives, path, stride=25, euler=False)
    types = read_vehicle_types([folder / "routes.rou.xml"])
    return read_trajectories([path]), read_network(folder / "net.net.xml"), dict(types)


def _rows(log: TrafficLog) -> int:
    """Samples of a log."""
    return sum(len(trace.times) for trace in log.traces)


def barcelona(names: Sequence[str], folder: Path) -> dict[str, Any]:
    """CPU-seconds to smooth a real log and to ask for all positions at 25 frames a second."""
    start = time.process_time()
    log = read_trajectories([folder / "fcd.xml.gz"])
    network = read_network(folder / "net.net.xml.gz")
    types = dict(read_vehicle_types([folder / "vtypes.add.xml"]))
    found: dict[str, Any] = {
        "vehicles": len(log.traces), "rows": _rows(log), "seconds": log.end - log.begin,
        "read": time.process_time() - start, "smoothers": {},
    }  # fmt: skip
    for name in names:
        start = time.process_time()
        shown = smooth_log(log, smoother=name, network=network, types=types)
        smoothed = time.process_time()
        for trace, each in zip(log.traces, shown, strict=True):
            each.sample(np.arange(trace.times[0], trace.times[-1], 0.04))
        sampled = time.process_time()
        found["smoothers"][name] = {"smooth": smoothed - start, "sample": sampled - smoothed}
    return found


def tiled(log: TrafficLog, rows: int) -> TrafficLog:
    """The same vehicles again and again under other ids, until there are so many rows."""
    traces, count, turn = [], 0, 0
    while count < rows:
        for trace in log.traces:
            traces.append(replace(trace, id=f"{trace.id}~{turn}"))
            count += len(trace.times)
            if count >= rows:
                break
        turn += 1
    return replace(log, traces=tuple(traces))


def scaling(given: Given, smoother: str) -> list[dict[str, float]]:
    """CPU-seconds over rows."""
    log, network, types = given
    found = []
    for rows in ROWS:
        some = tiled(log, rows)
        start = time.process_time()
        smooth_log(some, smoother=smoother, network=network, types=types)
        found.append({"rows": _rows(some), "cpu": time.process_time() - start})
    return found


def memory(given: Given, smoother: str, cache: Path) -> list[dict[str, float]]:
    """Peak memory [MB] to read and smooth the last minute of ever longer logs."""
    _, network, types = given
    found = []
    for turns in LONGER:
        path = cache / OWN / "fcd_long.xml"
        span = _repeat(cache / OWN / "fcd_cost.xml", path, turns)
        tracemalloc.start()
        log = read_trajectories([path], begin=span[0], end=span[1], margin=2.0)
        shown = smooth_log(log, smoother=smoother, network=network, types=types)
        peak = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        found.append({"turns": turns, "rows": _rows(log), "shown": len(shown), "peak": peak})
    return found


def _repeat(source: Path, target: Path, turns: int) -> tuple[float, float]:
    """Write a log of a minute several times in a row; returns the last minute [s]."""
    steps = source.read_text(encoding="utf-8").split('<timestep time="')[1:]
    times = [float(step.partition('"')[0]) for step in steps]
    inside = [step.partition(">")[2].replace("</fcd-export>", "") for step in steps]
    span = times[-1] - times[0] + 1.0
    with target.open("w", encoding="utf-8") as file:
        file.write("<fcd-export>\n")
        for turn in range(turns):
            for at, rows in zip(times, inside, strict=True):
                rows = rows.replace('id="', f'id="{turn}_')
                file.write(f'<timestep time="{at + turn * span:.2f}">{rows}')
        file.write("</fcd-export>\n")
    return times[0] + (turns - 1) * span, times[-1] + (turns - 1) * span
