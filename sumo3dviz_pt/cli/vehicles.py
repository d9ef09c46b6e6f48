"""`vehicles`: lists the road users in the log, or says whom one of them follows."""

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
    sub.add_argument(
        "--type", default="*", metavar="GLOB", help='vType, vClass or person, as "bus*"'
    )
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
    add_window(sub, first="first time of --follow [s]", last="last time of --follow [s]")
    sub.add_argument("-o", "--output", type=Path, help="table of --follow (.csv)")
    add_overwrite(sub)
    add_overrides(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """List road users, or say whom one of them follows."""
    if options.follow is not None:
        return _follow(options)
    alone = {"--from": options.start, "--to": options.end, "-o": options.output}
    for flag, value in alone.items():
        if value is not None:
            raise ConfigError("goes with --follow ID", key=flag)
    return _list(options)


def _follow(options: argparse.Namespace) -> int:
    """Say whom a road user follows, how far and how fast."""
    import json

    from sumo3dviz_pt.pipeline.measured.traffic import follow, follow_lines, write_follow
    from sumo3dviz_pt.pipeline.production import check_target
    from sumo3dviz_pt.pipeline.progress.expectations import reading_step
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.scene_file import load_job

    chosen = {"--near": options.near, "--at": options.at, "--sort": options.sort}
    for flag, value in chosen.items():
        if value is not None:
            raise ConfigError("goes with a list, not with --follow", key=flag)
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
        found = roster(job, RosterQuery(options.type, options.at, near, options.sort))
    print(json.dumps(as_dicts(found), indent=1) if options.json else found)
    return 0
