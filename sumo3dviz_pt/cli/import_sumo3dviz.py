"""`import-sumo3dviz`: a scene file from a configuration of sumo3Dviz."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import PROGRAM, add_force


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "import-sumo3dviz", help="write a scene file from a configuration of sumo3Dviz 1.0"
    )
    sub.add_argument("config", type=Path, help="its YAML file")
    sub.add_argument("--root", type=Path, help="folder that its paths refer to")
    sub.add_argument("--trajectories", type=Path, help="this FCD log instead of its own")
    sub.add_argument("-o", "--output", type=Path, default=Path("scene.yaml"), help="scene file")
    add_force(sub)


def run(options: argparse.Namespace) -> int:
    """Write a scene file."""
    from sumo3dviz_pt.files.whole import write_whole
    from sumo3dviz_pt.pipeline.import_sumo3dviz import translate
    from sumo3dviz_pt.pipeline.stills.still import check_free

    if not options.force:
        check_free(options.output, option="--force")
    text, notes = translate(
        options.config,
        output=options.output,
        root=options.root,
        trajectories=options.trajectories,
    )
    write_whole(options.output, text)
    for note in notes:
        print(note)
    print(f"wrote {options.output}; next: {PROGRAM} check {options.output}")
    return 0
