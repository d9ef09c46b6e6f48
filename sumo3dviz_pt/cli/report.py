"""`report`: a film in figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overwrite
from sumo3dviz_pt.cli.progress import progress


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("report", help="a film's frames in figures, or two films compared")
    sub.add_argument("frames", type=Path, help="folder of frames, or the film beside it")
    sub.add_argument("--against", type=Path, help="frames of the same times to compare with")
    sub.add_argument("-o", "--output", type=Path, required=True, help="folder for the report")
    add_overwrite(sub)


def run(options: argparse.Namespace) -> int:
    """Look at a film's frames, or compare two films."""
    from sumo3dviz_pt.report.compare import report_film

    with progress() as show:
        page = report_film(
            options.frames,
            options.output,
            against=options.against,
            overwrite=options.overwrite,
            on_frame=lambda *news: show(options.frames.name, *news),
        )
    print(f"wrote {page}")
    return 0
