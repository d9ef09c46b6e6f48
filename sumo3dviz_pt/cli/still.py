"""`still`: renders one image."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overwrite, add_request, overrides_of, request_of, sumo_time
from sumo3dviz_pt.cli.progress import cpu_in_words, progress


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("still", help="render one image")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--time", type=sumo_time, required=True, help="SUMO's time [s]")
    sub.add_argument("-o", "--output", type=Path, required=True, help="out.png or out.exr")
    add_overwrite(sub)
    add_request(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Render one image."""
    from sumo3dviz_pt.pipeline.production import check_target, get_ready
    from sumo3dviz_pt.pipeline.progress.costs import spent
    from sumo3dviz_pt.pipeline.progress.expectations import still_steps
    from sumo3dviz_pt.pipeline.progress.room import check_memory
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.stills.open_shot import render_still

    check_target(options.output, suffixes=(".png", ".exr"), overwrite=options.overwrite)
    job, request = load_job(options.scene, overrides_of(options)), request_of(options)
    spare_inputs(job, options.output)
    check_memory(job, request)
    get_ready(job, request)
    with progress(options.output.name, still_steps(job, request)):
        still = render_still(job, request, options.time)
    still.save(options.output)
    print(f"wrote {options.output} ({cpu_in_words(spent())})")
    return 0
