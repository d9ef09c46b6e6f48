"""`motion`: draws how one road user moves."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overrides, add_overwrite, add_window, overrides_of
from sumo3dviz_pt.cli.progress import progress


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("motion", help="draw how one road user moves, on a map and over time")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--vehicle", metavar="ID", required=True, help="its id; persons count too")
    add_window(sub)
    sub.add_argument("-o", "--output", type=Path, required=True, help="plot.png")
    add_overwrite(sub)
    add_overrides(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Draw how one road user moves."""
    from sumo3dviz_pt.pipeline.motion.drawing import MotionDrawing, draw_motion
    from sumo3dviz_pt.pipeline.progress.expectations import reading_step
    from sumo3dviz_pt.pipeline.scene_file import load_job

    job = load_job(options.scene, overrides_of(options))
    wanted = MotionDrawing(
        options.vehicle, options.output, options.start, options.end, options.overwrite
    )
    with progress(options.output.name, (reading_step(job),)):
        draw_motion(job, wanted)
    print(f"wrote {options.output}")
    return 0
