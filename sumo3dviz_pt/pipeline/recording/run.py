"""Runs a simulation of SUMO with the outputs that a film needs, and nothing else changed.

Seed, step and everything else stay as the configuration says. What the simulation writes for its
owner would replace what an earlier run wrote; so it gets other names, and is removed afterwards.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import uuid
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import IO

from sumo3dviz_pt.errors import ConfigError, InputError, InstallationError
from sumo3dviz_pt.files.whole import write_whole
from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.pipeline.recording.arguments import PEOPLE, arguments, end_of
from sumo3dviz_pt.pipeline.recording.files import (
    EVENTS,
    LOG,
    SIGNALS,
    SumoSettings,
    configuration,
    events,
)
from sumo3dviz_pt.pipeline.recording.near import join_steps, keep_near
from sumo3dviz_pt.pipeline.recording.notes import pass_on
from sumo3dviz_pt.pipeline.recording.order import RecordOrder as RecordOrder
from sumo3dviz_pt.pipeline.recording.settings import read_settings

_STEP = re.compile(rb"Step #(\d+(?:\.\d+)?)")


def record(path: Path, order: RecordOrder) -> tuple[Path, ...]:
    """Run a simulation and keep its vehicle log, its signals and a configuration for `init`.

    Args:
        path: A .sumocfg.
        order: What to keep, and where.

    Returns:
        The files, the new configuration first.

    Raises:
        ConfigError: If a recording is there already.
        InputError: If SUMO refuses the configuration, or nobody was on the road.
        InstallationError: If there is no SUMO.
    """
    settings = read_settings(path)
    program = sumo_program()
    target = order.folder / path.name
    _check_place(order, target, path)
    kept = _kept(settings, order, program)
    write_whole(target, configuration(settings, order.folder, signals=len(kept) > 1))
    return (target, *kept)


def _kept(settings: SumoSettings, order: RecordOrder, program: str) -> list[Path]:
    """Run a simulation and keep its logs; a folder that was not there goes if that fails."""
    new = not order.folder.exists()
    order.folder.mkdir(parents=True, exist_ok=True)
    try:
        return _recorded(settings, order, program)
    except BaseException:
        if new and not any(order.folder.iterdir()):
            order.folder.rmdir()
        raise


def _recorded(settings: SumoSettings, order: RecordOrder, program: str) -> list[Path]:
    """Run a simulation and keep its logs; the vehicle log is the first."""
    with tempfile.TemporaryDirectory(dir=order.folder, prefix=".recording-") as name:
        part = Path(name)
        prefix = f"s3d{uuid.uuid4().hex[:8]}_"
        try:
            _run([program, *arguments(settings, order, part, prefix)], settings, order)
        finally:
            _remove(settings, prefix)
        log = part / f"{prefix}{LOG}"
        if order.follow is not None:
            keep_near(log, order.follow, radius=order.radius)
        elif PEOPLE in settings.given:
            join_steps(log)
        _check_log(log, settings)
        kept = [order.folder / LOG]
        log.replace(kept[0])
        signals = part / f"{prefix}{SIGNALS}"
        if signals.is_file():
            kept += [order.folder / SIGNALS, order.folder / EVENTS]
            signals.replace(kept[1])
            write_whole(kept[2], events(SIGNALS))
    return kept


def sumo_program() -> str:
    """Return the program `sumo`: of the package eclipse-sumo, of SUMO_HOME, or of the system.

    Raises:
        InstallationError: If there is none.
    """
    spec = find_spec("sumo")
    homes = [*(spec.submodule_search_locations or ())] if spec is not None else []
    homes += [os.environ["SUMO_HOME"]] if "SUMO_HOME" in os.environ else []
    for home in homes:
        found = shutil.which("sumo", path=str(Path(home) / "bin"))
        if found is not None:
            return found
    found = shutil.which("sumo")
    if found is None:
        raise InstallationError("there is no SUMO here; install it with: pip install eclipse-sumo")
    return found


def _run(command: Sequence[str], settings: SumoSettings, order: RecordOrder) -> None:
    """Run SUMO and say how far it is.

    Raises:
        InputError: If it stops with an error; has SUMO's own words.
    """
    end = end_of(settings, order)
    total = 0 if end is None else max(1, round(end - settings.begin))
    announce(Doing.SIMULATE, 0, total)
    with tempfile.TemporaryFile() as errors:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors) as process:
            assert process.stdout is not None
            try:
                for time in _steps(process.stdout):
                    announce(Doing.SIMULATE, min(round(time - settings.begin), total), total)
            except BaseException:
                process.kill()
                raise
        errors.seek(0)
        said = errors.read().decode("utf-8", errors="replace")
    if process.returncode != 0:
        faults = [line.strip() for line in said.splitlines() if "rror" in line]
        why = " ".join(faults[:2]) or f"it ended with code {process.returncode}"
        raise InputError(f"SUMO stopped: {why}", file=settings.path)
    pass_on(said)


def _steps(stream: IO[bytes]) -> Iterator[float]:
    """Yield the times that SUMO's step log tells [s]; its lines end in carriage returns."""
    rest = b""
    while chunk := stream.read1(4096):  # type: ignore[attr-defined]
        rest += chunk
        found = list(_STEP.finditer(rest))
        yield from (float(step[1]) for step in found)
        rest = rest[found[-1].end() :] if found else rest[-64:]


def _remove(settings: SumoSettings, prefix: str) -> None:
    """Remove what the simulation wrote for its owner under another name."""
    inputs = (settings.path, *settings.additional, *settings.routes)
    for folder in {path.absolute().parent for path in inputs} | {Path.cwd()}:
        for path in folder.glob(f"{prefix}*"):
            path.unlink()


def _check_place(order: RecordOrder, target: Path, path: Path) -> None:
    """Refuse to replace a recording unasked, or the simulation's own files.

    Raises:
        ConfigError: If it would.
    """
    if order.folder.exists() and not order.folder.is_dir():
        raise ConfigError(f"{order.folder} is a file; give a folder", key="output")
    if target.absolute() == path.absolute():
        raise ConfigError(
            f"{order.folder} holds the simulation itself; give another folder", key="output"
        )
    there = [each for each in (target, order.folder / LOG) if each.exists()]
    if there and not order.overwrite:
        raise ConfigError(f"{there[0]} exists already; --overwrite replaces it", key="output")


def _check_log(log: Path, settings: SumoSettings) -> None:
    """Refuse a log in which nobody is.

    Raises:
        InputError: If nobody is.
    """
    import gzip

    with gzip.open(log, "rb") as stream:
        while chunk := stream.read(1 << 20):
            if b"<vehicle " in chunk or b"<person " in chunk:
                return
    raise InputError(
        "nobody was on the road in this window and place; choose others", file=settings.path
    )
