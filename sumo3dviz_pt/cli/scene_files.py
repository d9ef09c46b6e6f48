"""`init`, `import-sumo3dviz`, `schema`, `record`: the commands that begin a scene.

`init`, `import-sumo3dviz` and `schema` write, translate and describe scene files. `record` runs
SUMO with the outputs that a film needs.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import (
    PROGRAM,
    progress,
    sumo_time,
)
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.progress import Doing

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import ScenarioSettings


SIMULATING = 30.0
"""What running a simulation usually takes [s]."""

_READING, _SCOUTING = 4.0, 3.0
"""What reading a scenario and looking for cameras usually take [s]."""


def add_init(commands: Any) -> None:
    """Say what `init` takes."""
    sub = commands.add_parser("init", help="write a commented, running scene file")
    sub.add_argument(
        "scenario",
        type=Path,
        help=".sumocfg, folder searched by content, vehicle log, table of trajectories, or map"
        " (.xodr, .osm)",
    )
    sub.add_argument("--network", type=Path, help="this network instead of the one found")
    sub.add_argument("--trajectories", type=Path, action="append", default=[], help="this FCD log")
    sub.add_argument("--signals", type=Path, action="append", default=[], help="this signal log")
    sub.add_argument(
        "--additional", type=Path, action="append", default=[], help="more POIs or vTypes"
    )
    sub.add_argument("--heights", type=Path, help="the land's heights (GeoTIFF, .asc, .hgt)")
    sub.add_argument(
        "--allow-misfit", action="store_true", help="take a log that seems wrong, with a note"
    )
    sub.add_argument(
        "--record", action="store_true", help="run the .sumocfg first; see the command record"
    )
    sub.add_argument(
        "--traffic", type=float, metavar="S", help="invent so much traffic on an .osm map [s]"
    )
    sub.add_setting("--template", "template", after=" [chosen by the roads]")
    _add_target(sub)
    sub.set_defaults(run=_init)


def add_import(commands: Any) -> None:
    """Say what `import-sumo3dviz` takes."""
    sub = commands.add_parser(
        "import-sumo3dviz", help="write a scene file from a configuration of sumo3Dviz 1.0"
    )
    sub.add_argument("config", type=Path, help="its YAML file")
    sub.add_argument("--root", type=Path, help="folder that its paths refer to")
    sub.add_argument("--trajectories", type=Path, help="this FCD log instead of its own")
    _add_target(sub)
    sub.set_defaults(run=_import)


def add_schema(commands: Any) -> None:
    """Say what `schema` takes."""
    sub = commands.add_parser(
        "schema", help="the scene file as JSON schema, for editors that complete and check"
    )
    sub.add_argument("-o", "--output", type=Path, help="file; else it is printed")
    sub.add_argument("--study", action="store_true", help="that of study files instead")
    sub.set_defaults(run=_schema)


def _add_target(sub: argparse.ArgumentParser) -> None:
    """Let the scene file be named, and one that exists be replaced."""
    sub.add_argument("-o", "--output", type=Path, default=Path("scene.yaml"), help="scene file")
    sub.add_argument(
        *("--overwrite", "--force"), action="store_true", help="replace a scene file that exists"
    )


def _init(options: argparse.Namespace) -> int:
    """Write a scene file for a simulation."""
    from sumo3dviz_pt.inspection.schema import write_schema
    from sumo3dviz_pt.job.settings import ScenarioSettings
    from sumo3dviz_pt.pipeline.scene_file import FILE
    from sumo3dviz_pt.pipeline.steps import WorkStep
    from sumo3dviz_pt.proposals.proposal import propose
    from sumo3dviz_pt.recording.maps import is_map

    _check_target(options)
    own = ScenarioSettings(
        network=options.network,
        trajectories=tuple(options.trajectories),
        signals=tuple(options.signals),
        additional=tuple(options.additional),
        allow_misfit=options.allow_misfit,
    )
    steps = [WorkStep(Doing.READ, _READING), WorkStep(Doing.SCOUT, _SCOUTING)]
    drawn = is_map(options.scenario)
    if options.traffic is not None and not drawn:
        raise ConfigError("traffic is invented on a map (.osm) only", key="--traffic")
    if options.record or drawn:
        steps.insert(0, WorkStep(Doing.SIMULATE, SIMULATING))
    with progress(options.output.name, steps):
        scenario = _recorded(options) if options.record else options.scenario
        if drawn:
            scenario, own = _made_of_map(options, own)
        text, notes = propose(
            scenario,
            output=options.output,
            template=options.template,
            own=own,
            heights=options.heights,
        )
    write_schema(options.output.with_name(FILE))
    return _written(options.output, text, notes)


def _made_of_map(
    options: argparse.Namespace, own: ScenarioSettings
) -> tuple[Path, ScenarioSettings]:
    """Make a network of a map beside the scene file; return what is to be read."""
    from sumo3dviz_pt.recording.maps import make_of_map

    folder = options.output.with_suffix(".made")
    made = make_of_map(
        options.scenario,
        folder,
        traffic=options.traffic,
        driven=bool(options.trajectories),
        replace=options.overwrite,
    )
    if made.simulation is not None:
        return made.simulation, own
    # Lanes of a network that was made of OpenDRIVE have other names than logs know.
    more = {
        "network": made.network,
        "additional": own.additional + made.additional,
        "allow_misfit": own.allow_misfit or not made.additional,
    }
    return options.scenario.parent, own.model_copy(update=more)


def _recorded(options: argparse.Namespace) -> Path:
    """Run a simulation beside the scene file; return the recording's configuration."""
    from sumo3dviz_pt.recording.run import RecordOrder, record

    folder = options.output.with_suffix(".recorded")
    return record(options.scenario, RecordOrder(folder, overwrite=options.overwrite))[0]


def _import(options: argparse.Namespace) -> int:
    """Write a scene file from a configuration of sumo3Dviz."""
    from sumo3dviz_pt.proposals.sumo3dviz import translate

    _check_target(options)
    text, notes = translate(
        options.config,
        output=options.output,
        root=options.root,
        trajectories=options.trajectories,
    )
    return _written(options.output, text, notes)


def _schema(options: argparse.Namespace) -> int:
    """Print or write the schema."""
    from sumo3dviz_pt.inspection import schema
    from sumo3dviz_pt.inspection.schema import write_schema
    from sumo3dviz_pt.pipeline.scene_file import LINE
    from sumo3dviz_pt.studies import file as study

    text = study.study_schema_text() if options.study else schema.schema_text()
    if options.output is None:
        print(text, end="")
        return 0
    write_schema(options.output, title=study.TITLE if options.study else schema.TITLE, text=text)
    line = LINE.rpartition("=")[0]
    print(f"wrote {options.output}; editors find it by this line: {line}={options.output.name}")
    return 0


def _check_target(options: argparse.Namespace) -> None:
    """Refuse to replace a scene file without `--overwrite`."""
    from sumo3dviz_pt.pipeline.still import check_free

    if not options.overwrite:
        check_free(options.output)


def _written(path: Path, text: str, notes: Sequence[str]) -> int:
    """Write a scene file, and say what there is to know about it; the exit code."""
    from sumo3dviz_pt.files.atomic import write_atomically

    write_atomically(path, text)
    for note in notes:
        print(note)
    print(f"wrote {path}; next: {PROGRAM} check {path}")
    return 0


def add_record(commands: Any) -> None:
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
    sub.set_defaults(run=run_record)


def run_record(options: argparse.Namespace) -> int:
    """Record a simulation."""
    from sumo3dviz_pt.pipeline.steps import WorkStep
    from sumo3dviz_pt.recording.run import RecordOrder, record

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
