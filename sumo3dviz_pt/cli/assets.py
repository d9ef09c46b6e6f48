"""`assets`: lists the library as a table, draws it as pictures, makes its files again."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overwrite, add_size
from sumo3dviz_pt.cli.progress import progress

_BAKING, _DRAWING = 150.0, 120.0
"""How long baking all vehicles usually takes, and drawing a sheet [s]."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("assets", help="the library: as a table, as pictures, made again")
    sub.add_argument("action", choices=("list", "sheet", "build"), help="what to do")
    sub.add_argument("chosen", nargs="*", help="families, or vehicles/NAME to build; default all")
    sub.add_argument(
        "-o", "--output", type=Path, help="folder for sheets or to build in, or one sheet's .png"
    )
    sub.add_setting("--quality", "quality", default="preview", after=" [preview]")
    add_size(sub, (480, 270), before="each picture's ")
    add_overwrite(sub, "replace sheets that exist")
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """List, draw or rebuild the library."""
    from sumo3dviz_pt.model.news import Doing
    from sumo3dviz_pt.pipeline.baking import build, listing
    from sumo3dviz_pt.pipeline.progress.build import WorkStep

    if options.action == "sheet":
        return _sheets(options)
    if options.action == "list":
        print("\n".join(listing(options.chosen)))
        return 0
    with progress("assets", (WorkStep(Doing.BAKE, _BAKING),)):
        build(options.chosen, into=options.output)
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
