"""`check`, `vehicles`, `motion`: the commands that look at a scene before it is rendered.

`check` says what a scene holds, leaves out and costs. `vehicles` lists the road users in the log,
says whom one follows, or which pairs pass a kerb. `motion` draws how one road user moves.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import (
    add_overrides,
    add_overwrite,
    add_size,
    add_variant,
    add_window,
    complain,
    overrides_of,
    progress,
    sumo_time,
)
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

    from sumo3dviz_pt.model.progress import Doing
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import WorkStep, checking_steps, reading_step

    if options.stress:
        return _stress(options)
    if options.camera is not None or options.time is not None or options.only:
        raise ConfigError("--camera, --time and --only belong to --stress", key="check")
    job = load_job(options.scene, {**_overrides(options), **overrides_of(options)})
    if options.motion:
        read = reading_step(job)
        with progress(options.scene.name, (read, WorkStep(Doing.MEASURE, read.seconds))):
            from sumo3dviz_pt.inspection.motion import motion_report

            words = motion_report(job, as_json=options.json)
        print(words)
        return 0
    presets = None if options.quality is None else [options.quality]
    with progress(options.scene.name, checking_steps(job)):
        # Loading takes a second or two, of which the user is to know.
        from sumo3dviz_pt.inspection.checks import check_scene, in_words

        report = check_scene(job, presets=presets)
    words = in_words(report, details=options.verbosity > 0)
    print(json.dumps(report, indent=1) if options.json else words)
    return 0


def _overrides(options: argparse.Namespace) -> dict[str, str]:
    """Return the size, frame rate and preset as values of the scene file."""
    overrides = {"output.fps": options.fps, "quality": options.quality}
    if options.size is not None:
        overrides["output.size"] = str(list(options.size))
    return {key: value for key, value in overrides.items() if value is not None}


def _stress(options: argparse.Namespace) -> int:
    """Put a scene under stress; 1 if a case fails."""
    import json

    from sumo3dviz_pt.model.progress import Doing
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import WorkStep, building_steps
    from sumo3dviz_pt.report.stress.stress import (
        StressOrder,
        chosen,
        in_words,
        put_under_stress,
        without_notes,
    )

    cases = chosen(options.only)
    ready_renderer(options.variant)
    job = load_job(options.scene, {**_overrides(options), **overrides_of(options)})
    order = StressOrder(options.camera, options.time, options.variant)
    steps = (*building_steps(job), WorkStep(Doing.MEASURE, _CASE * len(cases)))
    with progress(options.scene.name, steps), without_notes():
        report = put_under_stress(job, order, cases=cases)
    print(json.dumps(report.as_dict(), indent=1) if options.json else in_words(report))
    failed = report.count("failed")
    if failed:
        return complain(f"{failed} of {len(report.outcomes)} cases failed", 1)
    return 0


def add_vehicles(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "vehicles", help="list the road users of the log, to ride with or to colour"
    )
    sub.add_argument("scene", type=Path)
    sub.add_argument("--json", action="store_true", help="as JSON, with all edges")
    sub.add_argument(
        "--sort",
        metavar="KEY",
        help="begin, end, id, type, length, duration, mean, max or distance"
        " [begin; with --near distance]",
    )
    sub.add_argument("--type", metavar="GLOB", help='vType, vClass or person, as "bus*"')
    sub.add_argument(
        "--at", type=sumo_time, metavar="T", help="only road users that are there at this time [s]"
    )
    sub.add_argument(
        "--near",
        metavar="PLACE",
        help="only those that pass X,Y or a standing camera, within 30 m or X,Y,R or CAMERA,R [m]",
    )
    sub.add_argument(
        "--follow",
        metavar="ID",
        help="whom this road user follows over time: gap, time gap, time to collision, speeds",
    )
    sub.add_argument(
        "--kerb",
        metavar="PLACE",
        help="pairs of vehicles that pass a kerb one after the other, and a study of their gap: at"
        " X,Y or X,Y,RADIUS [m], or a standing camera, a crossing, an edge or a lane",
    )
    sub.add_argument("--pick", type=int, metavar="NO", help="propose this pair of --kerb")
    where = "--follow or --kerb [s]"
    add_window(sub, first=f"first time of {where}", last=f"last time of {where}")
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        help="table of --follow (.csv), or study file of --kerb (.yaml)",
    )
    add_overwrite(sub)
    add_overrides(sub)
    sub.set_defaults(run=run_vehicles)


_LIST, _FOLLOW, _KERB = "a list", "--follow", "--kerb"

_GOES_WITH = {
    "type": (_LIST,),
    "at": (_LIST,),
    "near": (_LIST,),
    "sort": (_LIST,),
    "start": (_FOLLOW, _KERB),
    "end": (_FOLLOW, _KERB),
    "output": (_FOLLOW, _KERB),
    "pick": (_KERB,),
    "follow": (_FOLLOW,),
    "kerb": (_KERB,),
}
"""Which flags go with what is asked for."""

_FLAGS = {"start": "--from", "end": "--to", "output": "-o"}


def run_vehicles(options: argparse.Namespace) -> int:
    """List road users, say whom one of them follows, or who passes a kerb."""
    task = _LIST
    if options.follow is not None:
        task = _FOLLOW
    elif options.kerb is not None:
        task = _KERB
    for name, fitting in _GOES_WITH.items():
        if getattr(options, name) is not None and task not in fitting:
            raise ConfigError(
                f"goes with {' and '.join(fitting)}, not with {task}",
                key=_FLAGS.get(name, f"--{name}"),
            )
    return {_LIST: _list, _FOLLOW: _follow, _KERB: _kerb}[task](options)


def _kerb(options: argparse.Namespace) -> int:
    """Say which pairs pass a kerb, and propose a study."""
    import json

    from sumo3dviz_pt.files.atomic import write_atomically
    from sumo3dviz_pt.pipeline.production import check_target
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import reading_step
    from sumo3dviz_pt.studies.kerb.proposal import as_study
    from sumo3dviz_pt.studies.kerb.vehicles import at_kerb, kerb_dicts, kerb_lines

    job, output = load_job(options.scene, overrides_of(options)), options.output
    if output is not None:
        check_target(output, suffixes=(".yaml", ".yml"), overwrite=options.overwrite)
        spare_inputs(job, output)
        if output.exists() and output.samefile(options.scene):
            raise ConfigError(f"{output} is the scene file", key="-o")
    window = {"begin": options.start, "end": options.end}
    with progress(options.scene.name, (reading_step(job),)):
        kerb = at_kerb(job, options.kerb, **window, pick=options.pick)
    study = "" if kerb.proposal is None else as_study(kerb.proposal, _from(output, options.scene))
    if options.json:
        print(json.dumps({**kerb_dicts(kerb), "study": study or None}, indent=1))
    else:
        print("\n".join(kerb_lines(kerb)))
    if output is not None and study:
        write_atomically(output, study)
        print(f"wrote {output}; next: sumo3dviz-pt study {output} -o OUT --dry-run")
    elif output is not None:
        raise ConfigError(f"no pair is proposed, so {output} is not written", key="--kerb")
    elif study and not options.json:
        print(f"\n{study}", end="")
    return 0


def _from(output: Path | None, scene: Path) -> str:
    """Return how a study file names a scene file; one that is only printed as the call does."""
    import os

    return (scene if output is None else Path(os.path.relpath(scene, output.parent))).as_posix()


def _follow(options: argparse.Namespace) -> int:
    """Say whom a road user follows, how far and how fast."""
    import json

    from sumo3dviz_pt.pipeline.production import check_target
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import reading_step
    from sumo3dviz_pt.studies.measured.traffic import follow, follow_lines, write_follow

    job = load_job(options.scene, overrides_of(options))
    if options.output is not None:
        check_target(options.output, suffixes=(".csv",), overwrite=options.overwrite)
        spare_inputs(job, options.output)
    with progress(options.scene.name, (reading_step(job),)):
        rows = follow(job, options.follow, begin=options.start, end=options.end)
    if options.output is not None:
        write_follow(options.output, rows)
        print(f"wrote {options.output}")
    elif options.json:
        plain = [{name: None if x == "" else x for name, x in row.items()} for row in rows]
        print(json.dumps(plain, indent=1))
    else:
        print("\n".join(follow_lines(rows)))
    return 0


def _list(options: argparse.Namespace) -> int:
    """List road users."""
    import json

    from sumo3dviz_pt.inspection.roster import RosterQuery, as_dicts, point_of, roster
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import reading_step

    job = load_job(options.scene, overrides_of(options))
    near = None if options.near is None else point_of(job, options.near)
    with progress(options.scene.name, (reading_step(job),)):
        users = roster(job, RosterQuery(options.type or "*", options.at, near, options.sort))
    print(json.dumps(as_dicts(users), indent=1) if options.json else users)
    return 0


def add_motion(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("motion", help="draw how one road user moves, on a map and over time")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--vehicle", metavar="ID", required=True, help="its id; persons count too")
    add_window(sub)
    sub.add_argument("-o", "--output", type=Path, required=True, help="plot.png")
    add_overwrite(sub)
    add_overrides(sub)
    sub.set_defaults(run=run_motion)


def run_motion(options: argparse.Namespace) -> int:
    """Draw how one road user moves."""
    from sumo3dviz_pt.inspection.drawing import MotionDrawing, draw_motion
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import reading_step

    job = load_job(options.scene, overrides_of(options))
    wanted = MotionDrawing(
        options.vehicle, options.output, options.start, options.end, options.overwrite
    )
    with progress(options.output.name, (reading_step(job),)):
        draw_motion(job, wanted)
    print(f"wrote {options.output}")
    return 0
