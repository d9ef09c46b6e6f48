"""Whom a road user of the log follows, how far and how fast, over time: `vehicles --follow`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sumo3dviz_pt.cast.finding import find_trajectory
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.tools.rows import write_table
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scenario import ScenarioFiles
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.gaps import plain_id
from sumo3dviz_pt.pipeline.measured.traffic import Row, ahead_row, traffic_at
from sumo3dviz_pt.pipeline.reading import motion_of, read_files


def follow(
    job: Job, name: str, *, begin: float | None = None, end: float | None = None
) -> list[Row]:
    """Return whom a road user follows, how far and how fast, over time.

    Args:
        job: The scene file.
        name: The road user's id, or its key.
        begin: First time [s]; None is its first.
        end: Last time [s]; None is its last.

    Raises:
        ConfigError: If there is none of that name, or it is not there then.
        InputError: If a file is missing or damaged.
    """
    files, scenario = read_files(job, begin=begin, end=end)
    motion = motion_of(job, scenario)
    which = motion.named(name)
    if not which.any():
        raise _not_there(files, name, motion.smooth())
    (own,) = motion.smooth(np.arange(len(which)) == np.argmax(which))
    times = _steps(own, scenario.traffic.step, begin, end)
    seen = own.sample(times)
    times = times[seen.alive]
    if not times.size:
        raise _not_there(files, name, (own,))
    near = scenario.network.location.outside(seen.positions[seen.alive, :2])
    traffic = traffic_at(job, scenario, times, near=near, ridden=own.key)
    k = traffic.keys.index(own.key)
    return [
        {"time": round(float(time), 6), **ahead_row(traffic, n, k)} for n, time in enumerate(times)
    ]


def _not_there(files: ScenarioFiles, name: str, others: Sequence[Trajectory]) -> ConfigError:
    """Return an error about somebody who is not there in a window: when it is, or who else is."""
    from sumo3dviz_pt.sumo import whereabouts

    spans = whereabouts(files.trajectories, name).spans
    if not spans:
        find_trajectory(others, name)  # raises: it knows names that are alike
    lives = ", ".join(f"{begin:g} to {end:g} s" for begin, end in spans[:4])
    return ConfigError(f"{name!r} is not there then; the log has it from {lives}", key="--from")


def _steps(own: Trajectory, step: float, begin: float | None, end: float | None) -> Floats:
    """Return the log's steps in a ride's life within a window, (n,) [s]."""
    step = step if step > 0.0 else 1.0
    first, last = own.pieces[0].begin, own.pieces[-1].end
    first = first if begin is None else max(first, begin)
    last = last if end is None else min(last, end)
    if last < first:
        return np.empty(0)
    return np.asarray(first + step * np.arange(int((last - first) / step + 1e-6) + 1), dtype=float)


def write_follow(path: Path, rows: Sequence[Row]) -> None:
    """Write whom a road user follows as a table."""
    write_table(path, rows)


def follow_lines(rows: Sequence[Row]) -> list[str]:
    """Return whom a road user follows as people read it: a line for each time, after a head."""
    heads = {
        **{"time": "time [s]", "speed": "speed [m/s]", "logged_speed": "logged"},
        **{"leader": "behind", "gap": "gap [m]", "time_gap": "gap [s]", "headway": "headway [s]"},
        **{"time_to_collision": "to collision [s]", "leader_speed": "its speed [m/s]"},
        "leader_logged_speed": "logged",
    }
    cells = [[*heads.values()], *([_cell(row[name]) for name in heads] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(map(str.rjust, row, widths)).rstrip() for row in cells]


def _cell(value: str | int | float) -> str:
    """Return a cell; a dash where there is nothing."""
    if value == "":
        return "-"
    return f"{value:.2f}" if isinstance(value, float) else plain_id(str(value))
