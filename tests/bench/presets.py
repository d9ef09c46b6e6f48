"""What presets cost and how wrong they are, beside a bare Mitsuba scene of the same run.

Run from the repository's root, on a quiet machine; one process for each preset:

    python tests/bench/presets.py -o docs/_bench

Costs are CPU-seconds of all threads for the bundled motorway at 1280x720; `compiled`
counts kernels that were compiled after the third frame and must be 0. The bare scene
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
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.pipeline.accounts.provenance import versions
from sumo3dviz_pt.report.convergence.table import median, read_rows
from sumo3dviz_pt.report.machine import machine, peak_memory

FRAMES = {"draft": 8, "preview": 8, "standard": 8, "study": 6}
"""Frames of each preset; those after the third count."""

ERRORS = ("flip", "psnr", "ssim", "mean_bias", "flicker_mc")
PHASES = ("update", "render", "guides", "denoise")
CURVE = "ronda"


def run(preset: str, size: tuple[int, int]) -> dict[str, Any]:
    """Render a few frames with one preset."""
    import drjit as dr

    from sumo3dviz_pt.pipeline.production import Request, example, frame_times, opened, prepare
    from sumo3dviz_pt.pipeline.scene_file import load_job

    started = time.process_time()
    request = Request(camera="overview", quality=preset, size=size)
    times = frame_times(492.0, 492.0 + FRAMES[preset] / 25, 25)
    production = prepare(load_job(example("ronda")), request, times)
    frames, compiled = [], 0
    with opened(production) as session:
        loaded = time.process_time() - started
        dr.set_flag(dr.JitFlag.KernelHistory, True)
        for number, at in enumerate(times):
            state = production.shot.frame_at(float(at))
            frames.append(session.render(state).cpu)
            misses = sum(not entry.get("cache_hit", True) for entry in dr.kernel_history())
            compiled += misses if number >= 3 else 0
    phases = {
        key: float(np.median([frame.get(key, 0.0) for frame in frames[3:]])) for key in PHASES
    }
    return {
        "preset": preset,
        "size": list(size),
        "spp": production.quality.spp,
        "in_view": len(state.users),
        "load": loaded,
        "first": sum(frames[0].values()) - frames[0]["load"],
        "third": sum(frames[2].values()),
        **phases,
        "later": sum(phases.values()),
        "compiled": compiled,
        "memory_mb": peak_memory(),
    }


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
    own = {name: [row for row in rows if row["preset"] == name] for name in FRAMES}
    return {name: {key: median(some, key) for key in ERRORS} for name, some in own.items()}


def table(rows: list[dict[str, Any]], bare: float) -> list[str]:
    """A Markdown table."""
    lines = [
        "| preset | load | first frame | later frames | of which update | render | guides |"
        " denoise | peak memory | compiled after frame 3 | later / bare scene | FLIP |"
        " flicker [codes] |",
        "|---|" + "--:|" * 12,
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
    for preset in FRAMES:
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
