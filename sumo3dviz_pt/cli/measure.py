"""`converge`, `report`, `compare`: the commands that measure pictures and films.

`converge` measures error against run time. `report` describes a film in figures, or compares two.
`compare` says what differs between two pictures or films, by the accounts stored in them.
"""

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
    progress,
    sumo_time,
)

_CONVERGE_USUAL = 900.0
"""How long measuring takes at the usual size, if there is no budget [s]."""


def add_converge(commands: Any) -> None:
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
    sub.set_defaults(run=run_converge)


def run_converge(options: argparse.Namespace) -> int:
    """Measure error against run time."""
    from sumo3dviz_pt.model.progress import Doing
    from sumo3dviz_pt.pipeline.production import Request, ready_renderer
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import WorkStep, opening_steps
    from sumo3dviz_pt.report.convergence.convergence import ConvergenceOrder, converge

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
    steps = (*opening_steps(job), WorkStep(Doing.MEASURE, options.budget or _CONVERGE_USUAL))
    with progress(options.output.name, steps):
        page = converge(job, request, order)
    print(f"wrote {page}")
    return 0


def _scene_name(scene: Path) -> str:
    """Return what tables call a scene: its file's name, or its folder's if that says nothing."""
    return scene.stem if scene.stem != "scene" else scene.resolve().parent.name


_REPORT_USUAL = 5.0
"""How long a report on a film of some seconds takes; counting frames corrects it [s]."""


def add_report(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("report", help="a film's frames in figures, or two films compared")
    sub.add_argument("frames", type=Path, help="folder of frames, or the film beside it")
    sub.add_argument("--against", type=Path, help="frames of the same times to compare with")
    sub.add_argument("-o", "--output", type=Path, required=True, help="folder for the report")
    add_overwrite(sub)
    sub.set_defaults(run=run_report)


def run_report(options: argparse.Namespace) -> int:
    """Look at a film's frames, or compare two films."""
    from sumo3dviz_pt.model.progress import Doing
    from sumo3dviz_pt.pipeline.steps import WorkStep
    from sumo3dviz_pt.report.films.films import report_film

    with progress(options.output.name, (WorkStep(Doing.MEASURE, _REPORT_USUAL),)):
        page = report_film(
            options.frames,
            options.output,
            against=options.against,
            overwrite=options.overwrite,
        )
    print(f"wrote {page}")
    return 0


def add_compare(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("compare", help="say what two pictures or films were made from")
    of = "film.json, film.mp4, folder of frames, .exr or .png"
    sub.add_argument("one", type=Path, help=of)
    sub.add_argument("other", type=Path, help="what to compare it with, one of the same")
    sub.set_defaults(run=run_compare)


def run_compare(options: argparse.Namespace) -> int:
    """Say what differs; 1 if something does, as `diff` does."""
    from sumo3dviz_pt.pipeline.films.frames import account_in
    from sumo3dviz_pt.pipeline.provenance import differences

    one, other = account_in(options.one), account_in(options.other)
    lines = differences(one, other)
    print("\n".join(lines or ["nothing differs"]))
    if one.get("command") != other.get("command"):
        print(f"commands: {one.get('command') or '-'}\n          {other.get('command') or '-'}")
    return 1 if lines else 0
