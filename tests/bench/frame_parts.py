"""What the parts of a film's frame cost, from placing road users to the developed picture.

Run from the repository's root, on a quiet machine:

    python tests/bench/frame_parts.py -o docs/_bench [--films overview night] [--presets preview]
        [--size 1280x720] [--variant cuda]

Each film and preset is a process of its own, and takes about a minute on two cores. Times are
medians over frames whose windows are full, after kernels were compiled: CPU-seconds of all threads,
and wall seconds, as a GPU's work is no CPU-seconds. Memory holds a window of traced frames with all
of their layers, more than a film does.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.image.traced import packed
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.pipeline.films.traced import TRACED, new_averager, traced_by
from sumo3dviz_pt.pipeline.production import (
    Production,
    Request,
    example,
    frame_times,
    opened,
    prepare,
)
from sumo3dviz_pt.pipeline.provenance import versions
from sumo3dviz_pt.pipeline.scene_file import load_job, quality_preset
from sumo3dviz_pt.render.passes.finish import Finishing, finished
from sumo3dviz_pt.report.machine import machine, peak_memory

WARM, COUNTED = 3, 4
"""Frames that compile and do not count, and windows that do."""

PARTS = ("place", "update", "trace", "pack", "store", "average", "denoise", "develop")


@dataclass(frozen=True)
class Film:
    """What is filmed.

    Attributes:
        scene: The scene file.
        camera: Its name.
        start: SUMO's time of the first frame [s].
        changes: What differs from the scene file.
    """

    scene: Path
    camera: str
    start: float
    changes: dict[str, Any] = field(default_factory=dict)


_RAIN = {"template": "overcast", "weather.preset": "rain"}
FILMS = {
    "overview": Film(example("ronda"), "overview", 492.0),
    "driver": Film(example("ronda"), "driver", 462.0),
    "corner": Film(example("crossing"), "corner", 458.0),
    "night": Film(example("crossing"), "driver", 497.0, {"template": "city_night"}),
    "rain": Film(
        example("crossing"), "corner", 458.0, {"template": "overcast", "weather.preset": "rain"}
    ),
}


class Stopwatch:
    """CPU-seconds and wall seconds of parts, one entry for each time."""

    def __init__(self) -> None:
        self.cpu: dict[str, list[float]] = {}
        self.wall: dict[str, list[float]] = {}

    def time(self, part: str, work: Callable[[], Any]) -> Any:
        """Do some work and note what it took."""
        cpu, wall = time.process_time(), time.perf_counter()
        result = work()
        self.note(part, time.process_time() - cpu, time.perf_counter() - wall)
        return result

    def note(self, part: str, cpu: float, wall: float) -> None:
        """Note what a part took."""
        self.cpu.setdefault(part, []).append(cpu)
        self.wall.setdefault(part, []).append(wall)

    def medians(self, count: int) -> dict[str, dict[str, float]]:
        """Medians of each part over its last entries, as many as are counted."""
        return {
            kind: {part: float(np.median(noted[-count:])) for part, noted in parts.items()}
            for kind, parts in (("cpu", self.cpu), ("wall", self.wall))
        }


def measured(film: Film, preset: str, size: tuple[int, int], variant: str) -> dict[str, Any]:
    """Render as many frames as fill some windows, and time their parts."""
    started = time.process_time()
    window = quality_preset(preset, together=True).accumulate
    count = max(2 * window + COUNTED, WARM + COUNTED)
    times = frame_times(film.start, film.start + count / 25, 25)
    request = Request(camera=film.camera, quality=preset, size=size, variant=variant)
    production = prepare(load_job(film.scene, film.changes), request, times, together=True)
    watch = Stopwatch()
    loaded, first = _filmed(production, window, watch)
    return {
        **watch.medians(COUNTED),
        "load_cpu": loaded - started,
        "first_wall": first,
        "memory_mb": peak_memory(),
    }


def _filmed(production: Production, window: int, watch: Stopwatch) -> tuple[float, float]:
    """Trace, store and finish frames as a film does; return when it was loaded, by CPU-seconds, and
    how long the first frame took, by the wall.
    """
    averager = new_averager()
    held: deque[tuple[TracedFrame, Finishing]] = deque(maxlen=2 * window + 1)
    first = 0.0
    with opened(production) as session, tempfile.TemporaryDirectory() as folder:
        loaded, path = time.process_time(), Path(folder) / "frame.exr"
        for at in production.times.tolist():
            begun = time.perf_counter()
            state = watch.time("place", partial(production.shot.frame_at, at))
            cpu, wall = time.process_time(), time.perf_counter()
            samples = session.samples(state)
            update = session.clock.seconds.get("update", 0.0)
            watch.note("update", update, 0.0)
            watch.note("trace", time.process_time() - cpu - update, time.perf_counter() - wall)
            frame = traced_by(session, samples, state)
            layers, text = watch.time("pack", partial(packed, frame))
            watch.time("store", partial(write_exr, path, layers, attributes={TRACED: text}))
            first = first or time.perf_counter() - begun
            held.append((frame, session.finishing_of(state)))
            if len(held) == 2 * window + 1:
                _finish(held, window, averager, watch)
    return loaded, first


def _finish(
    held: Iterable[tuple[TracedFrame, Finishing]], window: int, averager: Any, watch: Stopwatch
) -> None:
    """Finish the frame in the middle of a window."""
    frames = [frame for frame, _ in held]
    centre, how = [*held][window]
    others = [frame for frame in frames if frame is not centre]
    helped = watch.time("average", lambda: averager.accumulated(centre, others).layers)
    radiance = watch.time("denoise", lambda: finished(helped, centre.view, how))
    watch.time("develop", lambda: develop_float(radiance))


def table(rows: list[dict[str, Any]], kind: str) -> list[str]:
    """A Markdown table of CPU-seconds or of wall seconds."""
    lines = [
        f"| {kind} [s] | preset | {' | '.join(PARTS)} | together |",
        "|---|---|" + "--:|" * (len(PARTS) + 1),
    ]
    for row in rows:
        costs = [row[kind].get(part, 0.0) for part in PARTS]
        cells = " | ".join(f"{cost:.2f}" for cost in (*costs, sum(costs)))
        lines.append(f"| {row['film']} | `{row['preset']}` | {cells} |")
    return lines


def main() -> None:
    """Measure, each film and preset in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", nargs=2, metavar=("FILM", "PRESET"), help="print its JSON")
    parser.add_argument("--films", nargs="*", choices=FILMS, default=list(FILMS))
    parser.add_argument("--presets", nargs="*", default=["preview", "standard"])
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--variant", default="llvm")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/_bench"))
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    if given.one:
        film, preset = given.one
        print(json.dumps(measured(FILMS[film], preset, (width, height), given.variant)))
        return
    rows = []
    for film in given.films:
        for preset in given.presets:
            command = [sys.executable, __file__, "--one", film, preset]
            command += ["--size", given.size, "--variant", given.variant]
            done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
            found = json.loads(done.stdout.splitlines()[-1])
            rows.append({"film": film, "preset": preset, **found})
            print(film, preset, found, flush=True)
    lines = [*table(rows, "cpu"), "", *table(rows, "wall")]
    print("\n".join(lines))
    given.output.mkdir(parents=True, exist_ok=True)
    record = {
        "machine": machine(),
        "versions": versions(),
        "variant": given.variant,
        "size": [width, height],
        "rows": rows,
    }
    name = "frame_parts" if given.variant == "llvm" else f"frame_parts_{given.variant}"
    text = json.dumps(record, indent=1) + "\n"
    (given.output / f"{name}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
