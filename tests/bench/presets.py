"""What each preset costs on the bundled motorway: load, first frame, later frames, memory.

Run from the repository's root, on a quiet machine, one process for each preset:

    python tests/bench/presets.py -o docs/_bench

Costs are CPU-seconds of all threads; `compiled` counts kernels that were compiled after
the third frame and must be 0.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

FRAMES = 8
PRESETS = ("draft", "preview", "standard")


def peak_memory() -> float:
    """Peak resident memory of this process [MB]; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0.0
    scale = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / scale


def run(preset: str, size: tuple[int, int]) -> dict[str, Any]:
    """Render a few frames with one preset."""
    import drjit as dr

    from sumo3dviz_pt.jobfile import load_job
    from sumo3dviz_pt.pipeline import Request, example, frame_times, opened, prepare

    started = time.process_time()
    request = Request(camera="overview", quality=preset, size=size)
    times = frame_times(492.0, 492.0 + FRAMES / 25, 25)
    production = prepare(load_job(example("ronda")), request, times)
    frames, compiled = [], 0
    with opened(production, film=True) as session:
        loaded = time.process_time() - started
        dr.set_flag(dr.JitFlag.KernelHistory, True)
        for number, at in enumerate(times):
            state = production.shot.frame_at(float(at))
            frames.append(session.render(state).cpu)
            misses = sum(not entry.get("cache_hit", True) for entry in dr.kernel_history())
            compiled += misses if number >= 3 else 0
    later = frames[3:]
    middle = {key: float(np.median([frame[key] for frame in later])) for key in later[0]}
    return {
        "preset": preset,
        "size": list(size),
        "in_view": len(state.movers) + len(state.distant),
        "load": loaded,
        "first": sum(frames[0].values()) - frames[0]["load"],
        "third": sum(frames[2].values()),
        **{key: middle[key] for key in ("update", "render", "guides", "denoise")},
        "later": sum(middle.values()) - middle["load"],
        "compiled": compiled,
        "memory_mb": peak_memory(),
    }


def bare_scene() -> float:
    """CPU-seconds of a fixed Mitsuba scene, so that machines can be compared."""
    code = (
        "import time, mitsuba as mi; mi.set_variant('llvm_ad_rgb');"
        "scene = mi.load_dict(mi.cornell_box()); mi.render(scene, spp=4).numpy();"
        "start = time.process_time(); mi.render(scene, spp=64, seed=1).numpy();"
        "print(time.process_time() - start)"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    return float(result.stdout.split()[-1])


def table(rows: list[dict[str, Any]], bare: float) -> list[str]:
    """A Markdown table."""
    lines = [
        "| preset | load | first frame | later frames | of which update | render | guides |"
        " denoise | peak memory | compiled after frame 3 | later / bare scene |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            f"| {row['preset']} | {row['load']:.1f} | {row['first']:.1f} | {row['later']:.2f} |"
            f" {row['update']:.2f} | {row['render']:.2f} | {row['guides']:.2f} |"
            f" {row['denoise']:.2f} | {row['memory_mb']:.0f} MB | {row['compiled']} |"
            f" {row['later'] / bare:.2f} |"
        )
    return lines


def main() -> None:
    """Measure all presets, each in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", help="measure this preset and print JSON")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720))
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(run(options.one, tuple(options.size))))
        return
    rows = []
    for preset in PRESETS:
        command = [sys.executable, __file__, "--one", preset, "--size", *map(str, options.size)]
        result = subprocess.run(command, capture_output=True, text=True, check=True)
        rows.append(json.loads(result.stdout.splitlines()[-1]))
    bare = bare_scene()
    lines = table(rows, bare)
    print("\n".join(lines))
    if options.output:
        options.output.mkdir(parents=True, exist_ok=True)
        record = {"machine": platform.processor(), "bare_scene_cpu": bare, "presets": rows}
        (options.output / "presets.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
        (options.output / "presets.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
