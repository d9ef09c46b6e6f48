"""How fast vehicle logs are read: megabytes per CPU-second of each form, and the second start.

    python tests/bench/logs.py [--rows N] [--repeat N] [--out FILE.json]

The logs are made here, as SUMO 1.28 writes them by default. CPU time of the best of several runs
counts, because machines do other work as well.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import platform
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sumo3dviz_pt.sumo import read_trajectories

_COLUMNS = ("id", "x", "y", "angle", "type", "speed", "pos", "lane", "slope")
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n\n<!-- made for a bench -->\n\n<fcd-export>\n'
_USERS = 400


def rows(count: int) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """Yield steps: the time, and a row for each of some hundred vehicles."""
    rng = np.random.default_rng(1)
    places = rng.uniform(0.0, 5000.0, (_USERS, 2))
    headings = rng.uniform(0.0, 360.0, _USERS)
    speeds = rng.uniform(0.0, 20.0, _USERS)
    moves = np.column_stack([np.sin(np.radians(headings)), np.cos(np.radians(headings))])
    for step in range(-(-count // _USERS)):
        places += moves * speeds[:, None]
        yield (
            f"{step}.00",
            [
                (
                    *(f"flow_{n % 20}.{n}", f"{places[n, 0]:.2f}", f"{places[n, 1]:.2f}"),
                    *(f"{headings[n]:.2f}", f"type_{n % 7}", f"{speeds[n]:.2f}"),
                    *(f"{speeds[n] * step % 400:.2f}", f"edge{n % 90}#1_{n % 3}", "0.00"),
                )
                for n in range(_USERS)
            ],
        )


def write_logs(folder: Path, count: int) -> list[Path]:
    """Write the same log in every form; Parquet only where pyarrow is installed."""
    steps = list(rows(count))
    xml, csv = folder / "log.xml", folder / "log.csv"
    with xml.open("w", encoding="utf-8", newline="\n") as file:
        file.write(_HEAD)
        for at, users in steps:
            file.write(f'    <timestep time="{at}">\n')
            for user in users:
                words = " ".join(f'{k}="{v}"' for k, v in zip(_COLUMNS, user, strict=True))
                file.write(f"        <vehicle {words}/>\n")
            file.write("    </timestep>\n")
        file.write("</fcd-export>\n")
    with csv.open("w", encoding="utf-8", newline="\n") as file:
        file.write(";".join(["timestep_time", *(f"vehicle_{name}" for name in _COLUMNS)]) + "\n")
        for at, users in steps:
            file.writelines(";".join([at, *user]) + "\n" for user in users)
    packed = folder / "log.xml.gz"
    packed.write_bytes(gzip.compress(xml.read_bytes(), 6))
    return [xml, packed, csv, *_write_parquet(folder, steps)]


def _write_parquet(folder: Path, steps: list[tuple[str, list[tuple[str, ...]]]]) -> list[Path]:
    """Write the log as Parquet, if that is possible."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        return []
    columns = list(zip(*((at, *user) for at, users in steps for user in users), strict=True))
    texts = {"id", "type", "lane"}
    table = {
        f"vehicle_{name}": values if name in texts else np.array(values, dtype=np.float64)
        for name, values in zip(_COLUMNS, columns[1:], strict=True)
    }
    times = {"timestep_time": np.array(columns[0], dtype=np.float64)}
    path = folder / "log.parquet"
    pyarrow.parquet.write_table(pyarrow.table(times | table), path)
    return [path]


def measured(log: Path, repeat: int, cache: Path) -> dict[str, object]:
    """Return what reading a log costs, at first and when it was kept."""
    first, again = [], []
    for number in range(repeat):
        os.environ["SUMO3DVIZ_PT_CACHE"] = str(cache / f"{log.name}-{number}")
        for found in (first, again):
            begin = time.process_time()
            traffic = read_trajectories([log])
            found.append(time.process_time() - begin)
    size = log.stat().st_size / 1e6
    count = sum(len(trace.times) for trace in traffic.traces)
    return {
        "log": log.name,
        "megabytes": round(size, 1),
        "rows": count,
        "cpu_seconds": round(min(first), 3),
        "megabytes_per_cpu_second": round(size / min(first), 1),
        "microseconds_per_row": round(min(first) / count * 1e6, 2),
        "second_start_cpu_seconds": round(min(again), 3),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=400_000)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        logs = write_logs(Path(folder), asked.rows)
        results = [measured(log, asked.repeat, Path(folder) / "cache") for log in logs]
    report = {"machine": platform.machine(), "python": platform.python_version(), "logs": results}
    print(json.dumps(report, indent=1))
    if asked.out:
        asked.out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
