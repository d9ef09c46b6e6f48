"""`init`: a scene file for a simulation."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import PROGRAM, add_force


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("init", help="write a commented, running scene file")
    sub.add_argument("scenario", type=Path, help=".sumocfg, or a folder searched by content")
    sub.add_argument("--network", type=Path, help="this network instead of the one found")
    sub.add_argument("--trajectories", type=Path, action="append", default=[], help="this FCD log")
    sub.add_argument("--signals", type=Path, action="append", default=[], help="this signal log")
    sub.add_argument("--additional", type=Path, action="append", default=[], help="more POIs")
    sub.add_argument("-o", "--output", type=Path, default=Path("scene.yaml"), help="scene file")
    sub.add_argument("--template", default="highway_day", help="scene template [highway_day]")
    add_force(sub)


def run(options: argparse.Namespace) -> int:
    """Write a scene file."""
    from sumo3dviz_pt.files.whole import write_whole
    from sumo3dviz_pt.job.settings import ScenarioSettings
    from sumo3dviz_pt.pipeline.proposal import propose
    from sumo3dviz_pt.pipeline.schema import FILE, write_schema
    from sumo3dviz_pt.pipeline.stills.still import check_free

    if not options.force:
        check_free(options.output, option="--force")
    text, notes = propose(
        options.scenario,
        output=options.output,
        template=options.template,
        own=ScenarioSettings(
            network=options.network,
            trajectories=tuple(options.trajectories),
            signals=tuple(options.signals),
            additional=tuple(options.additional),
        ),
    )
    write_schema(options.output.with_name(FILE))
    write_whole(options.output, text)
    for note in notes:
        print(note)
    print(f"wrote {options.output}; next: {PROGRAM} check {options.output}")
    return 0
