"""`export`: a scene leaves for other tools, or as a page that opens without a server."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import (
    add_overrides,
    add_overwrite,
    add_window,
    cpu_in_words,
    overrides_of,
    progress,
    sumo_time,
)
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.pipeline.costs import spent

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job

_PAGE_LASTS = 10.0
"""What a page shows where no times are given, from the first shot's begin [s]."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("export", help="the scene as .glb or .usd, with its motion")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--time", type=sumo_time, help="one moment [s]; or a stretch by")
    add_window(sub)
    add_fps(sub)
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        help="out.glb, out.usd (.usda, .usdc, .usdz), or a folder for a page",
    )
    add_overwrite(sub)
    add_overrides(sub)
    sub.set_defaults(run=run)


def add_fps(sub: argparse._ActionsContainer) -> None:
    """Let times per second be chosen."""
    sub.add_argument("--fps", type=float, default=10.0, help="times per second of a stretch [10]")


def run(options: argparse.Namespace) -> int:
    """Export a scene."""
    from sumo3dviz_pt.pipeline.scene_file import load_job

    job = load_job(options.scene, overrides_of(options))
    if options.time is not None:
        if options.start is not None or options.end is not None:
            raise ConfigError("--time is one moment; leave --from and --to out", key="--time")
        start = end = options.time
    elif options.start is None or options.end is None:
        raise ConfigError("give --time, or --from and --to", key="--time")
    else:
        start, end = options.start, options.end
    return write(options, job, (start, end), options.output)


def run_static(options: argparse.Namespace) -> int:
    """Write the page that `view --static` asks for."""
    from sumo3dviz_pt.pipeline.scene_file import load_job

    job = load_job(options.scene, overrides_of(options))
    first = job.shots[0].start if job.shots else None
    start = first if options.start is None else options.start
    if start is None:
        raise ConfigError("this scene has no shot; say --from and --to", key="--from")
    end = start + _PAGE_LASTS if options.end is None else options.end
    return write(options, job, (start, end), options.static)


def write(options: argparse.Namespace, job: Job, times: tuple[float, float], target: Path) -> int:
    """Export a scene and say what was written."""
    from sumo3dviz_pt.exports.order import ExportOrder, export
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.steps import export_steps

    order = ExportOrder(target, *times, options.fps, options.overwrite)
    order.check()
    spare_inputs(job, target)
    with progress(target.name, export_steps(job, order.count)):
        scene = export(job, order, title=options.scene.stem)
    for note in scene.notes:
        print(note)
    index = target / "index.html" if target.is_dir() else target
    files = [index] if target.is_file() else sorted(target.iterdir())
    size = sum(file.stat().st_size for file in files) / 1e6
    moments = counted(len(scene.times), "time")
    beside = [f" and {folder}" for folder in order.pictures if folder.is_dir()]
    print(
        f"wrote {index}{''.join(beside)}: {scene.triangles:,} triangles, {moments}, {size:.0f} MB"
        f" ({cpu_in_words(spent())})"
    )
    return 0
