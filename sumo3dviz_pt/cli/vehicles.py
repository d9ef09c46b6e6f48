"""`vehicles`: lists the road users in the log, whom one follows, or which pairs pass a kerb."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import (
    add_overrides,
    add_overwrite,
    add_window,
    overrides_of,
    sumo_time,
)
from sumo3dviz_pt.cli.progress import progress
from sumo3dviz_pt.errors import ConfigError


def add(commands: Any) -> None:
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
    sub.set_defaults(run=run)


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


def run(options: argparse.Namespace) -> int:
    """List road users, say whom one of them follows, or who passes a kerb."""
    asked = _LIST
    if options.follow is not None:
        asked = _FOLLOW
    elif options.kerb is not None:
        asked = _KERB
    for name, fitting in _GOES_WITH.items():
        if getattr(options, name) is not None and asked not in fitting:
            raise ConfigError(
                f"goes with {' and '.join(fitting)}, not with {asked}",
                key=_FLAGS.get(name, f"--{name}"),
            )
    return {_LIST: _list, _FOLLOW: _follow, _KERB: _kerb}[asked](options)


def _kerb(options: argparse.Namespace) -> int:
    """Say which pairs pass a kerb, and propose a study."""
    import json

    from sumo3dviz_pt.files.whole import write_whole
    from sumo3dviz_pt.pipeline.kerb.build import at_kerb, kerb_dicts, kerb_lines
    from sumo3dviz_pt.pipeline.kerb.proposal import as_study
    from sumo3dviz_pt.pipeline.production import check_target
    from sumo3dviz_pt.pipeline.progress.expectations import reading_step
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.scene_file import load_job

    job, output = load_job(options.scene, overrides_of(options)), options.output
    if output is not None:
        check_target(output, suffixes=(".yaml", ".yml"), overwrite=options.overwrite)
        spare_inputs(job, output)
        if output.exists() and output.samefile(options.scene):
            raise ConfigError(f"{output} is the scene file", key="-o")
    window = {"begin": options.start, "end": options.end}
    with progress(options.scene.name, (reading_step(job),)):
        found = at_kerb(job, options.kerb, **window, pick=options.pick)
    study = "" if found.proposal is None else as_study(found.proposal, _from(output, options.scene))
    if options.json:
        print(json.dumps({**kerb_dicts(found), "study": study or None}, indent=1))
    else:
        print("\n".join(kerb_lines(found)))
    if output is not None and study:
        write_whole(output, study)
        print(f"wrote {output}; next: sumo3dviz-pt study {output} -o OUT --dry-run")
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

    from sumo3dviz_pt.pipeline.measured.traffic import follow, follow_lines, write_follow
    from sumo3dviz_pt.pipeline.production import check_target
    from sumo3dviz_pt.pipeline.progress.expectations import reading_step
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.scene_file import load_job

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

    from sumo3dviz_pt.pipeline.progress.expectations import reading_step
    from sumo3dviz_pt.pipeline.roster import RosterQuery, as_dicts, point_of, roster
    from sumo3dviz_pt.pipeline.scene_file import load_job

    job = load_job(options.scene, overrides_of(options))
    near = None if options.near is None else point_of(job, options.near)
    with progress(options.scene.name, (reading_step(job),)):
        found = roster(job, RosterQuery(options.type or "*", options.at, near, options.sort))
    print(json.dumps(as_dicts(found), indent=1) if options.json else found)
    return 0
