"""`converge`: measures error against run time."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import (
    PROGRAM,
    add_overrides,
    add_overwrite,
    add_size,
    add_variant,
    overrides_of,
    sumo_time,
)
from sumo3dviz_pt.cli.progress import progress

_USUAL = 900.0
"""How long measuring takes at the usual size, if there is no budget [s]."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("converge", help="error against run time of this very scene")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--time", type=sumo_time, required=True, help="SUMO's time [s]")
    sub.add_argument("-o", "--output", type=Path, required=True, help="folder of the report")
    sub.add_argument("--camera", help="a name from the scene's cameras")
    add_size(sub, (480, 270))
    sub.add_argument("--top", type=int, default=64, help="most samples that are judged [64]")
    sub.add_argument("--budget", type=float, metavar="SECONDS", help="begin nothing after it")
    add_variant(sub)
    add_overwrite(sub, "begin anew where a report lies, instead of going on with it")
    add_overrides(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Measure error against run time."""
    from sumo3dviz_pt.model.news import Doing
    from sumo3dviz_pt.pipeline.production import Request, ready_renderer
    from sumo3dviz_pt.pipeline.progress.build import WorkStep
    from sumo3dviz_pt.pipeline.progress.expectations import opening_steps
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.report.convergence.build import ConvergenceOrder, converge

    job = load_job(options.scene, overrides_of(options))
    request = Request(options.camera, size=options.size, variant=options.variant)
    order = ConvergenceOrder(
        options.output,
        options.time,
        scene=_scene_name(options.scene),
        command=shlex.join([PROGRAM, *options.words]),
        budget=options.budget,
        top=options.top,
        overwrite=options.overwrite,
    )
    ready_renderer(options.variant)
    steps = (*opening_steps(job), WorkStep(Doing.MEASURE, options.budget or _USUAL))
    with progress(options.output.name, steps):
        page = converge(job, request, order)
    print(f"wrote {page}")
    return 0


def _scene_name(scene: Path) -> str:
    """Return what tables call a scene: its file's name, or its folder's if that says nothing."""
    return scene.stem if scene.stem != "scene" else scene.resolve().parent.name
