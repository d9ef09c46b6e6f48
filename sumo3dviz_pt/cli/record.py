"""`record`: runs SUMO with the outputs that a film needs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import PROGRAM, sumo_time
from sumo3dviz_pt.cli.progress import progress
from sumo3dviz_pt.cli.scene_files import SIMULATING
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.news import Doing


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("record", help="run SUMO and keep what a film needs")
    sub.add_argument("configuration", type=Path, help=".sumocfg; seed and step stay its own")
    sub.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    sub.add_argument(
        "--from", dest="start", type=sumo_time, metavar="T", help="first time to keep [s]"
    )
    sub.add_argument("--to", dest="end", type=sumo_time, metavar="T", help="last time to keep [s]")
    sub.add_argument("--around", metavar="X,Y,R", help="only within R of a place [m]")
    sub.add_argument(
        "--follow", metavar="ID", help="only around this vehicle, and as long as it is"
    )
    sub.add_argument(
        "--radius", type=float, default=300.0, metavar="R", help="how far around it [300 m]"
    )
    sub.add_argument("--seed", type=int, help="SUMO's seed instead of the configuration's")
    sub.add_argument("--overwrite", action="store_true", help="replace a recording that is there")
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Record a simulation."""
    from sumo3dviz_pt.pipeline.progress.build import WorkStep
    from sumo3dviz_pt.pipeline.recording.run import RecordOrder, record

    order = RecordOrder(
        options.output,
        options.start,
        options.end,
        None if options.around is None else _around(options.around),
        options.follow,
        options.radius,
        options.seed,
        options.overwrite,
    )
    with progress(options.output.name, (WorkStep(Doing.SIMULATE, SIMULATING),)):
        files = record(options.configuration, order)
    print(f"wrote {', '.join(str(path) for path in files)}")
    print(f"next: {PROGRAM} init {files[0]} -o scene.yaml")
    return 0


def _around(text: str) -> tuple[float, float, float]:
    """Return east, north and radius [m].

    Raises:
        ConfigError: If these are no three numbers.
    """
    try:
        east, north, radius = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError(
            f"--around takes X,Y,R in metres, such as 250,-80,150, not {text!r}"
        ) from None
    return east, north, radius
