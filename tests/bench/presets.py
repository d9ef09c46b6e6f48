"""What presets cost and how wrong they are, beside a bare Mitsuba scene of the same run.

Run from the repository's root, on a quiet machine; one process for each preset:

    python tests/bench/presets.py -o docs/_bench

Costs are CPU-seconds of all threads for the bundled motorway at 1280x720; `compiled`
counts kernels that were compiled after the third frame and must be 0. Frames are those of a film:
`finish` is averaging with the frames around and denoising. Files and the film are not counted. The
bare scene
(Mitsuba's Cornell box) is timed before every preset: ratios to its median can be compared
between machines. Errors are those that `tests/bench/curves.py` measured at 480x270; it is
run first if they are missing.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.pipeline.films.traced import helped, new_averager
from sumo3dviz_pt.pipeline.production import Request, example, frame_times, opened, prepare
from sumo3dviz_pt.pipeline.provenance import versions
from sumo3dviz_pt.pipeline.scene_file import load_job, quality_preset
from sumo3dviz_pt.render.passes.finish import Finishing
from sumo3dviz_pt.report.convergence.table import median, read_rows
from sumo3dviz_pt.report.machine import machine, peak_memory

PRESETS = ("draft", "preview", "standard", "study")
WARM, COUNTED = 3, 5
"""Frames that compile and do not count, and frames that do."""

ERRORS = ("flip", "psnr", "ssim", "mean_bias", "flicker_mc")
PHASES = ("update", "render", "finish")
CURVE = "ronda"


@dataclass(frozen=True)
class Film:
    """What is filmed.

    Attributes:
        scene: The scene file.
        camera: Its name.
        start: SUMO's time of the first frame [s].
    """

    scene: Path
    camera: str
    start: float


def motorway() -> Film:
    """The bundled motorway from above."""
    return Film(example("ronda"), "overview", 492.0)


def run(preset: str, size: tuple[int, int], film: Film | None = None) -> dict[str, Any]:
    """Render a few frames with one preset."""
    import drjit as dr

    film = film or motorway()
    started = time.process_time()
    request = Request(camera=film.camera, quality=preset, size=size)
    window = quality_preset(preset, together=True).accumulate
    count = max(WARM + COUNTED, 2 * window + COUNTED)
    times = frame_times(film.start, film.start + count / 25, 25)
    production = prepare(load_job(film.scene), request, times, together=True)
    shelf = Window(window)
    clocks, compiled = [], 0
    with opened(production) as session:
        loaded = time.process_time() - started
        dr.set_flag(dr.JitFlag.KernelHistory, True)
        for number, at in enumerate(times):
            state = production.shot.frame_at(float(at))
            samples = session.samples(state)
            clocks.append(dict(session.clock.seconds))
            white, spp = session.settings.white, production.quality.spp
            traced = TracedFrame(samples.apart, state.view, white, spp, samples.movers)
            misses = sum(not entry.get("cache_hit", True) for entry in dr.kernel_history())
            compiled += misses if number >= WARM else 0
            shelf.add(traced, session.finishing_of(state))
            # What averages is compiled once the first window is full.
            dr.kernel_history_clear()
        dr.set_flag(dr.JitFlag.KernelHistory, False)
    phases = {key: float(np.median([clock.get(key, 0.0) for clock in clocks[WARM:]]))
              for key in ("update", "render")}  # fmt: skip
    phases["finish"] = float(np.median(shelf.costs))
    return {
        "preset": preset,
        "size": list(size),
        "spp": production.quality.spp,
        "in_view": len(state.users),
        "load": loaded,
        "first": sum(clocks[0].values()) - clocks[0]["load"] + phases["finish"],
        "third": sum(clocks[2].values()) + phases["finish"],
        **phases,
        "later": sum(phases.values()),
        "compiled": compiled,
        "memory_mb": peak_memory(),
    }


class Window:
    """Finishes frames as a film does: each as soon as those after it that help it are traced.

    Memory holds a window, as a film's does, so that the peak that is measured is a film's.

    Args:
        width: How many frames before and after help.

    Attributes:
        costs: CPU-seconds of each frame that was finished.
    """

    def __init__(self, width: int) -> None:
        self._width = width
        self._averager = new_averager()
        self._held: deque[tuple[TracedFrame, Finishing]] = deque(maxlen=2 * width + 1)
        self.costs: list[float] = []

    def add(self, frame: TracedFrame, how: Finishing) -> None:
        """Take the next frame, and finish the one in the middle if its window is full."""
        self._held.append((frame, how))
        if len(self._held) < 2 * self._width + 1:
            return
        began = time.process_time()
        centre, its_own = self._held[self._width]
        others = [one for one, _ in self._held if one is not centre]
        helped(centre, others, its_own, averager=self._averager).finished()
        self.costs.append(time.process_time() - began)


def bare_scene() -> float:
    """CPU-seconds of a fixed Mitsuba scene, so that machines can be compared."""
    code = (
        "import time, mitsuba as mi;"
        "from sumo3dviz_pt.render.backend import choose_backend; choose_backend('llvm');"
        "scene = mi.load_dict(mi.cornell_box()); mi.render(scene, spp=4).numpy();"
        "start = time.process_time(); mi.render(scene, spp=64, seed=1).numpy();"
        "print(time.process_time() - start)"
    )
    return float(output_of([sys.executable, "-c", code]))


def output_of(command: list[str]) -> str:
    """Last line that a command prints."""
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    return result.stdout.splitlines()[-1]


def errors(folder: Path) -> dict[str, dict[str, float]]:
    """Errors by preset, measured if they are missing."""
    path = folder / CURVE / "convergence.csv"
    if not path.exists():
        curves = Path(__file__).with_name("curves.py")
        subprocess.run([sys.executable, curves, "--only", CURVE, "-o", folder], check=True)
    rows = read_rows(path)
    own = {name: [row for row in rows if row["preset"] == name] for name in PRESETS}
    return {name: {key: median(some, key) for key in ERRORS} for name, some in own.items()}


def table(rows: list[dict[str, Any]], bare: float) -> list[str]:
    """A Markdown table."""
    lines = [
        "| preset | load | first frame | later frames | of which update | render | finish |"
        " peak memory | compiled after frame 3 | later / bare scene | FLIP | flicker [codes] |",
        "|---|" + "--:|" * 11,
    ]
    for row in rows:
        phases = " | ".join(f"{row[key]:.2f}" for key in PHASES)
        lines.append(
            f"| `{row['preset']}` | {row['load']:.1f} | {row['first']:.1f} | {row['later']:.2f} |"
            f" {phases} | {row['memory_mb']:.0f} MB | {row['compiled']} |"
            f" {row['later'] / bare:.2f} | {row['errors']['flip']:.3f} |"
            f" {row['errors']['flicker_mc']:.1f} |"
        )
    return lines


def main() -> None:
    """Measure all presets, each in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", help="measure this preset and print JSON")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720))
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/_bench"))
    options = parser.parse_args()
    if options.one:
        print(json.dumps(run(options.one, tuple(options.size))))
        return
    wrong = errors(options.output)
    rows, bare = [], []
    for preset in PRESETS:
        bare.append(bare_scene())
        size = [str(side) for side in options.size]
        command = [sys.executable, __file__, "--one", preset, "--size", *size]
        rows.append({**json.loads(output_of(command)), "errors": wrong[preset]})
    bare.append(bare_scene())
    lines = table(rows, float(np.median(bare)))
    print("\n".join(lines))
    options.output.mkdir(parents=True, exist_ok=True)
    record = {
        "machine": machine(),
        "versions": versions(),
        "bare_scene_cpu": bare,
        "errors_of": f"{CURVE}/convergence.csv",
        "presets": rows,
    }
    (options.output / "presets.json").write_text(
        json.dumps(record, indent=1) + "\n", encoding="utf-8"
    )
    (options.output / "presets.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
