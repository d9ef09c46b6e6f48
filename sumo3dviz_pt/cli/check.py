"""`check`: says what a scene holds, leaves out and costs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overrides, add_size, add_variant, overrides_of, sumo_time
from sumo3dviz_pt.cli.progress import complain, progress
from sumo3dviz_pt.errors import ConfigError

_CASE = 3.0
"""How long a case of --stress usually takes [s]."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("check", help="validate a scene; say what it holds and leaves out")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--json", action="store_true", help="as JSON")
    add_size(sub, before="forecast costs for: ")
    sub.add_setting("--fps", "output.fps", before="forecast costs for: ")
    sub.add_setting("--quality", "quality", before="forecast costs only for: ")
    instead = sub.add_mutually_exclusive_group()
    instead.add_argument(
        "--stress", action="store_true", help="render the scene's edges and judge every picture"
    )
    instead.add_argument(
        "--motion", action="store_true", help="measure how everyone in the log moves instead"
    )
    sub.add_argument("--camera", help="whose shot --stress starts from [the first shot's]")
    sub.add_argument("--time", type=sumo_time, help="its time, SUMO's [s; the shot's first]")
    sub.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="CASE",
        help='run only these cases of --stress, such as "sun*"',
    )
    add_variant(sub)
    add_overrides(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Validate a scene."""
    import json

    from sumo3dviz_pt.model.news import Doing
    from sumo3dviz_pt.pipeline.progress.build import WorkStep
    from sumo3dviz_pt.pipeline.progress.expectations import checking_steps, reading_step
    from sumo3dviz_pt.pipeline.scene_file import load_job

    if options.stress:
        return _stress(options)
    if options.camera is not None or options.time is not None or options.only:
        raise ConfigError("--camera, --time and --only belong to --stress", key="check")
    job = load_job(options.scene, {**_asked(options), **overrides_of(options)})
    if options.motion:
        read = reading_step(job)
        with progress(options.scene.name, (read, WorkStep(Doing.MEASURE, read.seconds))):
            from sumo3dviz_pt.pipeline.motion.checks import motion_report

            words = motion_report(job, as_json=options.json)
        print(words)
        return 0
    presets = None if options.quality is None else [options.quality]
    with progress(options.scene.name, checking_steps(job)):
        # Loading takes a second or two, of which the user is to know.
        from sumo3dviz_pt.pipeline.checks import check_scene, in_words

        report = check_scene(job, presets=presets)
    print(json.dumps(report, indent=1) if options.json else in_words(report))
    return 0


def _asked(options: argparse.Namespace) -> dict[str, str]:
    """Return the size, frame rate and preset as values of the scene file."""
    asked = {"output.fps": options.fps, "quality": options.quality}
    if options.size is not None:
        asked["output.size"] = str(list(options.size))
    return {key: value for key, value in asked.items() if value is not None}


def _stress(options: argparse.Namespace) -> int:
    """Put a scene under stress; 1 if a case fails."""
    import json

    from sumo3dviz_pt.model.news import Doing
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.progress.build import WorkStep
    from sumo3dviz_pt.pipeline.progress.expectations import building_steps
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.report.stress.build import (
        StressOrder,
        chosen,
        put_under_stress,
        without_notes,
    )
    from sumo3dviz_pt.report.stress.report import in_words

    cases = chosen(options.only)
    ready_renderer(options.variant)
    job = load_job(options.scene, {**_asked(options), **overrides_of(options)})
    order = StressOrder(options.camera, options.time, options.variant)
    steps = (*building_steps(job), WorkStep(Doing.MEASURE, _CASE * len(cases)))
    with progress(options.scene.name, steps), without_notes():
        report = put_under_stress(job, order, cases=cases)
    print(json.dumps(report.as_dict(), indent=1) if options.json else in_words(report))
    failed = report.count("failed")
    if failed:
        return complain(f"{failed} of {len(report.outcomes)} cases failed", 1)
    return 0
