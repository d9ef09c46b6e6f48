"""`assets`, `doctor`: the commands that look at what is installed.

`assets` lists the library as a table or draws it as pictures. `doctor` says what this machine has
and lacks, and installs what is missing.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import add_overwrite, add_size, progress
from sumo3dviz_pt.errors import ConfigError, InstallationError

if TYPE_CHECKING:
    from sumo3dviz_pt.installation.doctor import Diagnosis
    from sumo3dviz_pt.installation.packages import InstallOrder


_DRAWING = 120.0
"""How long drawing a sheet usually takes [s]."""


def add_assets(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("assets", help="the library: as a table, as pictures")
    sub.add_argument("action", type=_action, choices=("list", "sheet"), help="what to do")
    sub.add_argument("chosen", nargs="*", help="families; default all")
    sub.add_argument("-o", "--output", type=Path, help="folder for sheets, or one sheet's .png")
    sub.add_setting("--quality", "quality", default="preview", after=" [preview]")
    add_size(sub, (480, 270), before="each picture's ")
    add_overwrite(sub, "replace sheets that exist")
    sub.set_defaults(run=run_assets)


def _action(word: str) -> str:
    """Return a word as it is; say what makes bodies of vehicles, which this command once did."""
    if word == "build":
        raise argparse.ArgumentTypeError(
            "bodies of vehicles travel ready made; in a checkout of the repository,"
            " python tools/bake.py vehicles/NAME makes them again"
        )
    return word


def run_assets(options: argparse.Namespace) -> int:
    """List or draw the library."""
    from sumo3dviz_pt.inspection.catalogue import listing

    if options.action == "sheet":
        return _sheets(options)
    print("\n".join(listing(options.chosen)))
    return 0


def _sheets(options: argparse.Namespace) -> int:
    """Draw contact sheets."""
    from sumo3dviz_pt.inspection.catalogue import SheetOrder, draw_sheet, sheet_files
    from sumo3dviz_pt.model.progress import Doing
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.steps import WorkStep
    from sumo3dviz_pt.pipeline.still import check_free

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


def add_doctor(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "doctor", help="what is installed here, what is missing, and how to get it"
    )
    sub.add_argument(
        "--install", action="store_true", help="install the shared libraries that are missing"
    )
    sub.add_argument("--yes", action="store_true", help="do not ask before installing")
    sub.add_argument(
        "--frame", action="store_true", help="also time frames of an example here, half a minute"
    )
    sub.set_defaults(run=run_doctor)


def run_doctor(options: argparse.Namespace) -> int:
    """Look at the installation, and mend it with --install; 0 if rendering works, even slowly."""
    from sumo3dviz_pt.installation.doctor import examine

    if options.yes and not options.install:
        raise ConfigError("goes with --install", key="--yes")
    diagnosis = examine()
    if options.install and _mended(diagnosis, yes=options.yes):
        diagnosis = examine()
    print("\n".join(diagnosis.lines), flush=True)
    if options.frame and diagnosis.healthy:
        _time_frames(("llvm", "cuda") if diagnosis.gpu else ("llvm",))
    return 0 if diagnosis.healthy else 1


def _time_frames(variants: Sequence[str]) -> None:
    """Say how long frames of an example take by some variants."""
    from sumo3dviz_pt.pipeline.production import example
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import opening_steps
    from sumo3dviz_pt.report.pace import pace_of

    job = load_job(example("ronda"))
    for variant in variants:
        with progress(f"frames by {variant}", opening_steps(job)):
            pace = pace_of(job, variant)
        print(f"{'frame':<15} {pace}", flush=True)


def _mended(diagnosis: Diagnosis, *, yes: bool) -> bool:
    """Install what is lacking; return whether anything was tried."""
    from sumo3dviz_pt.installation.packages import carry_out, order_for

    if not diagnosis.lacks:
        return False
    _tell(f"missing: {' and '.join(diagnosis.lacks)}")
    interactive = sys.stdin is not None and sys.stdin.isatty()
    try:
        order = order_for(diagnosis.lacks, interactive=interactive)
        if not (yes or _agreed(order)):
            return False
        carry_out(order, tell=_tell)
    except InstallationError as error:
        _tell(f"not everything was installed: {error}")
    return True


def _agreed(order: InstallOrder) -> bool:
    """Return whether the user agrees; say in any case what would be done."""
    if not order.interactive:
        _tell(f"nobody is there to ask; with --yes this would run: {order.in_words()}")
        return False
    try:
        answer = input(f"install by: {order.in_words()} [Y/n] ")
    except EOFError:
        return False
    return answer.strip().lower() in ("", "y", "yes")


def _tell(line: str) -> None:
    """Show a line before what the package manager prints next."""
    print(line, flush=True)
