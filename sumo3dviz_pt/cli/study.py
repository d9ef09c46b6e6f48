"""`study`: from a design to films that differ in one thing, and the files of survey tools."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import (
    add_overrides,
    add_overwrite,
    add_variant,
    command_in,
    overrides_of,
)
from sumo3dviz_pt.cli.progress import progress

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.certificate.build import Certificate


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("study", help="make the films and files of a designed study")
    sub.add_argument("study", type=Path, help="study file (.yaml)")
    sub.add_argument(
        "-o", "--output", type=Path, required=True, help="folder of all that comes out"
    )
    sub.add_argument(
        "--dry-run", action="store_true", help="only say what would be shown, and its cost"
    )
    sub.add_argument(
        "--resume", action="store_true", help="keep films and frames that match, render the others"
    )
    add_overwrite(sub, "replace films and frames that exist")
    sub.add_argument(
        "--discard-frames", action="store_true", help="keep frames only while others need them"
    )
    add_variant(sub)
    add_overrides(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Make the films of a study, or say what would be done."""
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.progress.expectations import film_steps
    from sumo3dviz_pt.pipeline.scene_file import override_values
    from sumo3dviz_pt.pipeline.studies.file import load_study
    from sumo3dviz_pt.pipeline.studies.plan import plan_study
    from sumo3dviz_pt.pipeline.studies.run import (
        check_study,
        film_tasks,
        finish_study,
        render_task,
    )
    from sumo3dviz_pt.pipeline.studies.words import in_words

    order = _order(options)
    plan = plan_study(load_study(options.study), override_values(overrides_of(options)))
    if options.dry_run:
        check_study(plan, replace(order, resume=True))
        print(in_words(plan, order))
        return 0
    check_study(plan, order)
    tasks = film_tasks(plan, order)
    if tasks:
        ready_renderer(options.variant)
    for number, task in enumerate(tasks, start=1):
        name = f"{task.order.path.name} ({number} of {len(tasks)})"
        with progress(name, film_steps(task.stimulus.job, task.request, task.order)):
            render_task(plan, order, task)
    finished = finish_study(plan, order)
    for note in plan.notes:
        print(f"note: {note}")
    print(
        f"wrote {options.output}: {len(plan.stimuli)} films ({len(tasks)} rendered),"
        f" {len(plan.trials)} trials, {len(plan.playlists)} playlists, {len(finished.files)} files"
    )
    return 0 if finished.certificate is None else say(finished.certificate)


def say(certificate: Certificate) -> int:
    """Print what a certificate found; return the exit code."""
    for pair in certificate.failed:
        more = f" (and {len(pair.faults) - 1} more)" if len(pair.faults) > 1 else ""
        print(f"failed: {pair}: {pair.faults[0]}{more}")
    print(f"{certificate}; see certificate.html")
    return 0 if certificate.passed else 1


def _order(options: argparse.Namespace) -> Any:
    """Return what is to be made."""
    from sumo3dviz_pt.pipeline.studies.run import StudyOrder

    return StudyOrder(
        options.output,
        options.resume,
        options.overwrite,
        options.discard_frames,
        options.variant,
        command_in(options.words),
    )
