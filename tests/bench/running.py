"""A simulation that runs while a browser looks: pictures a second, their steps, memory.

Run from the repository's root, on a quiet machine, with the extra sumo:

    python tests/bench/running.py --minutes 10 -o docs/_bench/running.md

SUMO makes streets of three by three signalled junctions with some 200 road users at a time;
`sumo3dviz-pt view` runs it as users start it, and headless Chromium plays it on the same machine.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

if Path(sys.path[0]).resolve() == Path(__file__).resolve().parent:
    sys.path.pop(0)  # in this folder, `viewer` is a file
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import small_simulations as small
from viewer.browser import Browser
from viewer.program import Program

from sumo3dviz_pt.report.machine import machine

SPIES = """
window.spies = {shown: [], end: -1};
window.WebSocket = class extends WebSocket {
  constructor(...words) {
    super(...words);
    this.addEventListener('message', event => {
      if (typeof event.data !== 'string') return;
      const said = JSON.parse(event.data);
      if (said.kind === 'span') { spies.end = said.end; spies.users = said.users; }
      if (said.kind === 'frame') spies.shown.push([performance.now(), said.time, spies.end]);
    });
  }
};
"""
"""Notes when each picture comes, its time, and how far the simulation has come."""

RATE = 1.9
"""Road users that set out a second; each stays for some 100 s."""


def city(folder: Path, seconds: float) -> Path:
    """Streets full of cars and people; the configuration."""
    small._grid(folder)
    draw = np.random.default_rng(3)
    ways = [
        ("A0A1", "C2C1"),
        ("C0B0", "A2B2"),
        ("A2A1", "C0C1"),
        ("C2B2", "A0B0"),
        ("B0B1", "C1C2"),
    ]
    trips = []
    for number, depart in enumerate(np.arange(0.0, seconds, 1.0 / RATE)):
        begin, end = ways[int(draw.integers(len(ways)))]
        how = f'id="f.{number}" depart="{depart:.2f}"'
        if number % 4 == 3:
            trips.append(f'<person {how}><walk from="{begin}" to="{end}"/></person>')
        else:
            trips.append(f'<trip {how} from="{begin}" to="{end}" departLane="best"/>')
    return small._put(folder, "".join(trips), end=int(seconds), step=0.5)


def measure(minutes: float, size: str) -> list[tuple[str, str]]:
    """Rows of names and values."""
    before = os.getloadavg()[1]
    readings = []
    with tempfile.TemporaryDirectory() as folder:
        simulation = city(Path(folder), 60.0 * minutes + 400.0)
        with (
            Program(simulation, "--size", size, "--seed", "5") as program,
            Browser() as web,
        ):
            page = web.open(program.address, before=SPIES)
            page.wait_for("!!window.viewer && !!viewer.frame", seconds=600.0)
            # Until the streets are full.
            page.focus("#picture")
            page.press("Space")
            page.wait_for("viewer.frame.time > 120", seconds=600.0)
            page.evaluate("spies.shown.length = 0")
            start = time.monotonic()
            while (now := time.monotonic() - start) < 60.0 * minutes:
                readings.append((now, program.memory, len(page.evaluate("spies.users || []"))))
                time.sleep(2.0)
            shown = np.array(page.evaluate("spies.shown"), dtype=float)
            errors = page.errors
    assert not errors, errors
    kept, gaps = np.array(readings), np.diff(shown[:, 0])
    first = kept[kept[:, 0] < 60.0, 1]
    last = kept[kept[:, 0] > 60.0 * minutes - 60.0, 1]
    half = kept[len(kept) // 2 :]
    return [
        ("size", size),
        (
            "road users that the page is told of (200 at most), median",
            f"{np.median(kept[:, 2]):.0f}",
        ),
        ("pictures", str(len(shown))),
        ("of them without their step", str(int(np.sum(shown[:, 1] > shown[:, 2] + 1e-6)))),
        (
            "of them that wait for SUMO, at the end of what it has said",
            # A picture shows the last frame before that, of 25 a second.
            str(int(np.sum(shown[:, 2] - shown[:, 1] < 0.041))),
        ),
        ("pictures a second", f"{1000.0 / gaps.mean():.1f}"),
        ("gap between pictures, 90 % below", f"{np.quantile(gaps, 0.9):.0f} ms"),
        ("pauses of more than a second", str(int(np.sum(gaps > 1000.0)))),
        ("simulated seconds a second", f"{np.ptp(shown[:, 1]) / np.ptp(shown[:, 0]) * 1000.0:.2f}"),
        ("memory, median of the first minute", f"{np.median(first):.0f} MiB"),
        (f"memory, median of the last of {minutes:g} minutes", f"{np.median(last):.0f} MiB"),
        (
            "growth over the second half",
            f"{np.polyfit(half[:, 0] / 60, half[:, 1], 1)[0]:+.2f} MiB/min",
        ),
        ("machine", f"{machine()['cpu']}, {machine()['threads']} threads"),
        ("load before the start, mean of 5 minutes", f"{before:.1f} processes"),
    ]


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="to watch [10]")
    parser.add_argument("--size", default="480x270", help="WxH [480x270]")
    parser.add_argument("-o", "--output", type=Path, help="write the table here")
    options = parser.parse_args()
    rows = measure(options.minutes, options.size)
    lines = ["| | |", "|---|--:|", *(f"| {name} | {value} |" for name, value in rows)]
    print("\n".join(lines))
    if options.output:
        options.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
