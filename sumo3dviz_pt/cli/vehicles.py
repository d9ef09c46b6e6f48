"""`vehicles`: lists the road users in the log."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overrides, overrides_of, sumo_time
from sumo3dviz_pt.cli.progress import progress


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
    add_overrides(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """List road users."""
    import json

    from sumo3dviz_pt.pipeline.progress.expectations import building_steps
    from sumo3dviz_pt.pipeline.roster import RosterQuery, as_dicts, point_of, roster
    from sumo3dviz_pt.pipeline.scene_file import load_job

    job = load_job(options.scene, overrides_of(options))
    near = None if options.near is None else point_of(job, options.near)
    with progress(options.scene.name, building_steps(job)[:1]):
        found = roster(job, RosterQuery(options.type, options.at, near, options.sort))
    print(json.dumps(as_dicts(found), indent=1) if options.json else found)
    return 0
