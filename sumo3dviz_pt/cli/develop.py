"""`develop`: makes pictures and films from stored frames."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overwrite
from sumo3dviz_pt.job.meanings import default


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("develop", help="pictures from EXR frames, without rendering again")
    sub.add_argument("frames", type=Path, help="folder of frames, or one .exr")
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        help="film.mp4 (or .mov, .mkv, .webm, .gif), out.png, or name_{frame}.png",
    )
    sub.add_argument(
        "--exposure", type=float, help="EV, the sky's own included, instead of the stored one"
    )
    sub.add_setting("--tone", "output.tone", after=" [the stored one]")
    sub.add_setting("--fps", "output.fps", after=" [the film's own]")
    codec = default("output.codec")
    sub.add_setting("--codec", "output.codec", default=codec, after=f" [{codec}]")
    sub.add_argument(
        "--final-exr",
        action="store_true",
        help="also write the finished frames' radiance, to a folder beside the output",
    )
    sub.add_argument(
        "--no-overlays", action="store_true", help="without the overlays that the film has"
    )
    add_overwrite(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Develop stored frames."""
    from sumo3dviz_pt.pipeline.films.develop import DevelopOrder, develop_frames

    order = DevelopOrder(
        options.output,
        options.exposure,
        options.tone,
        options.fps,
        options.codec,
        options.overwrite,
        options.final_exr,
        not options.no_overlays,
    )
    first, *others = develop_frames(options.frames, order)
    print(f"wrote {first}" + (f" to {others[-1].name}" if others else ""))
    return 0
