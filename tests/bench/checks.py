"""Measures `check` of whole scenarios, with a cache that is empty.

Run from the repository's root:

    python tests/bench/checks.py FOLDER... -o docs/_bench/checks.json

A FOLDER holds a simulation, or a scene file `scene.yaml`; where there is none, `init` proposes it,
which is not measured. Each `check` runs in a process of its own. CPU-seconds are those of all its
threads; beside other work they are more, so the machine's load is written, too: the mean number of
busy processes of the last minute. What `check` first said about the time left stands beside what
it took. Rows of other scenarios stay in the file; a table for the manual is written beside it.
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
from pathlib import Path
from typing import Any

_LEFT = re.compile(r"about (?:(\d+):)?(\d+):(\d\d) left")
_CHECK = "import sys; from sumo3dviz_pt.cli import main; sys.exit(main())"


def check(scene: Path) -> dict[str, Any]:
    """Check a scene with an empty cache; return what it took and said."""
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "SUMO3DVIZ_PT_CACHE": cache}
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        command = [sys.executable, "-c", _CHECK, "check", str(scene), "--json"]
        run = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
        wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    report = json.loads(run.stdout)
    first = _LEFT.search(run.stderr)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {
        "lanes": report["network"]["lanes"],
        "shots": len(report["shots"]),
        "cpu_seconds": round(spent, 1),
        "wall_seconds": round(wall, 1),
        "load": round(os.getloadavg()[0], 1),
        "said_seconds": None if first is None else _seconds(first),
    }


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
    options = parser.parse_args()
    found = json.loads(options.output.read_text("utf-8")) if options.output.is_file() else {}
    with tempfile.TemporaryDirectory() as scratch:
        for folder in options.folders:
            found[folder.name] = check(scene_of(folder, Path(scratch)))
            print(folder.name, found[folder.name], flush=True)
            options.output.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
            options.output.with_suffix(".md").write_text(table(found), encoding="utf-8")


if __name__ == "__main__":
    main()
