"""Measures `check` of whole scenarios, with a cache that is empty.

Run from the repository's root:

    python tests/bench/checks.py FOLDER... -o docs/_bench/checks.json [--said]

A FOLDER holds a simulation, or a scene file `scene.yaml`; where there is none, `init` proposes it,
which is not measured. Each `check` runs in a process of its own. CPU-seconds are those of all its
threads; beside other work they are more, so the machine's load is written, too: the mean number of
busy processes of the last minute. Rows of other scenarios stay in the file; a table for the manual
is written beside it.

From all rows follow the constants of the forecast, which are written into the package. Then each
`check` is begun again, to its first words about the time left: these stand beside what it took.
They are said by the processor's clock, which other work does not move. `--said` leaves what `check`
takes as it was measured before, and the constants follow from that; such a run needs no quiet
machine.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.steps import CHECKS, REACHED, network_megabytes

_LEFT = re.compile(r"about (?:(\d+):)?(\d+):(\d\d) left")
_CHECK = "import sys; from sumo3dviz_pt.cli import main; sys.exit(main())"
_BY_CPU = (
    "import time, types; from sumo3dviz_pt.pipeline import build;"
    " build.time = types.SimpleNamespace(monotonic=time.process_time,"
    " process_time=time.process_time); "
)
"""The work's clock is the processor's: what it is told does not hang on other work."""


def check(scene: Path) -> dict[str, Any]:
    """Check a scene with an empty cache; return what it took."""
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "SUMO3DVIZ_PT_CACHE": cache}
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        command = [sys.executable, "-c", _CHECK, "check", str(scene), "--json"]
        run = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
        wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    report = json.loads(run.stdout)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {
        "lanes": report["network"]["lanes"],
        "shots": len(report["shots"]),
        "cpu_seconds": round(spent, 1),
        "wall_seconds": round(wall, 1),
        "load": round(os.getloadavg()[0], 1),
    }


def said_first(scene: Path) -> int | None:
    """Return what `check` first says about the time left [s]; it is stopped then."""
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "SUMO3DVIZ_PT_CACHE": cache}
        command = [sys.executable, "-c", _BY_CPU + _CHECK, "check", str(scene)]
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as run:
            assert run.stderr is not None
            first = next((found for line in run.stderr if (found := _LEFT.search(line))), None)
            run.kill()
    return None if first is None else _seconds(first)


def fitted(rows: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Return the constants by which all rows are said best, by factors that they are off."""
    reached = np.minimum([row["network_mb"] for row in rows.values()], REACHED)
    taken = np.array([row["cpu_seconds"] for row in rows.values()])
    found = least_squares(
        lambda asked: np.log((asked[0] + asked[1] * reached) / taken),
        [10.0, 10.0],
        bounds=(1.0, np.inf),
    )
    return dict(zip(("always", "per_megabyte"), found.x.round(1).tolist(), strict=True))


def _seconds(left: re.Match[str]) -> int:
    """Return the time left that was said [s]."""
    hours, minutes, seconds = (int(part or 0) for part in left.groups())
    return 3600 * hours + 60 * minutes + seconds


def scene_of(folder: Path, scratch: Path) -> Path:
    """Return a folder's scene file, or one that `init` proposes."""
    scene = folder / "scene.yaml"
    if scene.is_file():
        return scene
    proposed = scratch / folder.name / "scene.yaml"
    proposed.parent.mkdir(exist_ok=True)
    command = [sys.executable, "-c", _CHECK, "init", str(folder), "-o", str(proposed)]
    subprocess.run(command, check=True, capture_output=True)
    return proposed


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Return the table of the manual."""
    lines = [
        "| scenario | lanes | shots | CPU-s | s | said first [s] | load |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for name, row in rows.items():
        cells = (row["cpu_seconds"], row["wall_seconds"], row["said_seconds"], row["load"])
        numbers = " | ".join(f"{cell:.0f}" if cell is not None else "" for cell in cells)
        lines.append(f"| {name} | {row['lanes']:,} | {row['shots']} | {numbers} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the file and its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--said", action="store_true", help="record the first words only")
    options = parser.parse_args()
    found = json.loads(options.output.read_text("utf-8")) if options.output.is_file() else {}

    def write() -> None:
        options.output.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        options.output.with_suffix(".md").write_text(table(found), encoding="utf-8")

    with tempfile.TemporaryDirectory() as scratch:
        scenes = {folder.name: scene_of(folder, Path(scratch)) for folder in options.folders}
        for name, scene in scenes.items():
            taken = found[name] if options.said else check(scene)
            size = round(network_megabytes(load_job(scene)), 3)
            found[name] = {**taken, "said_seconds": None, "network_mb": size}
            print(name, found[name], flush=True)
            write()
        CHECKS.write_text(json.dumps(fitted(found), indent=1) + "\n", encoding="utf-8")
        for name, scene in scenes.items():
            found[name]["said_seconds"] = said_first(scene)
            print(name, found[name]["said_seconds"], "s said", flush=True)
            write()


if __name__ == "__main__":
    main()
