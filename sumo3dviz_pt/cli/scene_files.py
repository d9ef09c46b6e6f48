"""`init`, `import-sumo3dviz` and `schema`: write, translate and describe scene files."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import PROGRAM
from sumo3dviz_pt.cli.progress import progress
from sumo3dviz_pt.model.news import Doing

SIMULATING = 30.0
"""What running a simulation usually takes [s]."""

_READING, _SCOUTING = 4.0, 3.0
"""What reading a scenario and looking for cameras usually take [s]."""


def add_init(commands: Any) -> None:
    """Say what `init` takes."""
    sub = commands.add_parser("init", help="write a commented, running scene file")
    sub.add_argument("scenario", type=Path, help=".sumocfg, or a folder searched by content")
    sub.add_argument("--network", type=Path, help="this network instead of the one found")
    sub.add_argument("--trajectories", type=Path, action="append", default=[], help="this FCD log")
    sub.add_argument("--signals", type=Path, action="append", default=[], help="this signal log")
    sub.add_argument(
        "--additional", type=Path, action="append", default=[], help="more POIs or vTypes"
    )
    sub.add_argument(
        "--allow-misfit", action="store_true", help="take a log that seems wrong, with a note"
    )
    sub.add_argument(
        "--record", action="store_true", help="run the .sumocfg first; see the command record"
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
        *("--force", "--overwrite"), action="store_true", help="replace a scene file that exists"
    )


def _init(options: argparse.Namespace) -> int:
    """Write a scene file for a simulation."""
    from sumo3dviz_pt.job.settings import ScenarioSettings
    from sumo3dviz_pt.pipeline.progress.build import WorkStep
    from sumo3dviz_pt.pipeline.proposal import propose
    from sumo3dviz_pt.pipeline.schema import FILE, write_schema

    _check_target(options)
    own = ScenarioSettings(
        network=options.network,
        trajectories=tuple(options.trajectories),
        signals=tuple(options.signals),
        additional=tuple(options.additional),
        allow_misfit=options.allow_misfit,
    )
    steps = [WorkStep(Doing.READ, _READING), WorkStep(Doing.SCOUT, _SCOUTING)]
    if options.record:
        steps.insert(0, WorkStep(Doing.SIMULATE, SIMULATING))
    with progress(options.output.name, steps):
        scenario = _recorded(options) if options.record else options.scenario
        text, notes = propose(scenario, output=options.output, template=options.template, own=own)
    write_schema(options.output.with_name(FILE))
    return _written(options.output, text, notes)


def _recorded(options: argparse.Namespace) -> Path:
    """Run a simulation beside the scene file; return the recording's configuration."""
    from sumo3dviz_pt.pipeline.recording.run import RecordOrder, record

    folder = options.output.with_suffix(".recorded")
    return record(options.scenario, RecordOrder(folder, overwrite=options.force))[0]


def _import(options: argparse.Namespace) -> int:
    """Write a scene file from a configuration of sumo3Dviz."""
    from sumo3dviz_pt.pipeline.import_sumo3dviz import translate

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
    from sumo3dviz_pt.pipeline import schema
    from sumo3dviz_pt.pipeline.schema import LINE, write_schema
    from sumo3dviz_pt.pipeline.studies import schema as study

    text = study.study_schema_text() if options.study else schema.schema_text()
    if options.output is None:
        print(text, end="")
        return 0
    write_schema(options.output, title=study.TITLE if options.study else schema.TITLE, text=text)
    line = LINE.rpartition("=")[0]
    print(f"wrote {options.output}; editors find it by this line: {line}={options.output.name}")
    return 0


def _check_target(options: argparse.Namespace) -> None:
    """Refuse to replace a scene file without `--force`."""
    from sumo3dviz_pt.pipeline.stills.still import check_free

    if not options.force:
        check_free(options.output, option="--force")


def _written(path: Path, text: str, notes: Sequence[str]) -> int:
    """Write a scene file, and say what there is to know about it; the exit code."""
    from sumo3dviz_pt.files.whole import write_whole

    write_whole(path, text)
    for note in notes:
        print(note)
    print(f"wrote {path}; next: {PROGRAM} check {path}")
    return 0
