"""`assets`: lists the library as a table, draws it as pictures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overwrite, add_size
from sumo3dviz_pt.cli.progress import progress

_DRAWING = 120.0
"""How long drawing a sheet usually takes [s]."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("assets", help="the library: as a table, as pictures")
    sub.add_argument("action", type=_action, choices=("list", "sheet"), help="what to do")
    sub.add_argument("chosen", nargs="*", help="families; default all")
    sub.add_argument("-o", "--output", type=Path, help="folder for sheets, or one sheet's .png")
    sub.add_setting("--quality", "quality", default="preview", after=" [preview]")
    add_size(sub, (480, 270), before="each picture's ")
    add_overwrite(sub, "replace sheets that exist")
    sub.set_defaults(run=run)


def _action(word: str) -> str:
    """Return a word as it is; say what makes bodies of vehicles, which this command once did."""
    if word == "build":
        raise argparse.ArgumentTypeError(
            "bodies of vehicles travel ready made; in a checkout of the repository,"
            " python tools/bake.py vehicles/NAME makes them again"
        )
    return word


def run(options: argparse.Namespace) -> int:
    """List or draw the library."""
    from sumo3dviz_pt.pipeline.asset_table import listing

    if options.action == "sheet":
        return _sheets(options)
    print("\n".join(listing(options.chosen)))
    return 0


def _sheets(options: argparse.Namespace) -> int:
    """Draw contact sheets."""
    from sumo3dviz_pt.model.news import Doing
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.progress.build import WorkStep
    from sumo3dviz_pt.pipeline.sheets import SheetOrder, draw_sheet, sheet_files
    from sumo3dviz_pt.pipeline.stills.still import check_free

    files = sheet_files(options.chosen, into=options.output)
    if not options.overwrite:
        check_free(*files.values())
    ready_renderer()
    for name, path in files.items():
        order = SheetOrder(name, path, options.size, options.quality)
        with progress(path.name, (WorkStep(Doing.DRAW, _DRAWING),)):
            draw_sheet(order)
        print(f"wrote {order.path}")
    return 0
