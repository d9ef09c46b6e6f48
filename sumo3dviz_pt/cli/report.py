"""`report`: describes a film in figures, or compares two."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overwrite
from sumo3dviz_pt.cli.progress import progress

_USUAL = 5.0
"""How long a report on a film of some seconds takes; counting frames corrects it [s]."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("report", help="a film's frames in figures, or two films compared")
    sub.add_argument("frames", type=Path, help="folder of frames, or the film beside it")
    sub.add_argument("--against", type=Path, help="frames of the same times to compare with")
    sub.add_argument("-o", "--output", type=Path, required=True, help="folder for the report")
    add_overwrite(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Look at a film's frames, or compare two films."""
    from sumo3dviz_pt.model.news import Doing
    from sumo3dviz_pt.pipeline.progress.build import WorkStep
    from sumo3dviz_pt.report.films.build import report_film

    with progress(options.output.name, (WorkStep(Doing.MEASURE, _USUAL),)):
        page = report_film(
            options.frames,
            options.output,
            against=options.against,
            overwrite=options.overwrite,
        )
    print(f"wrote {page}")
    return 0
