"""Runs a simulation of SUMO with the outputs that a film needs, and nothing else changed.

Seed, step and everything else stay as the configuration says. What the simulation writes for its
owner would replace what an earlier run wrote; so it gets other names, and is removed afterwards.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import IO

from sumo3dviz_pt.errors import ConfigError, InputError, InstallationError
from sumo3dviz_pt.files.whole import write_whole
from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.motion import MARGIN
from sumo3dviz_pt.pipeline.recording.files import (
    EVENTS,
    LOG,
    SIGNALS,
    SumoSettings,
    configuration,
    events,
)
from sumo3dviz_pt.pipeline.recording.settings import read_settings

_PLACE = "sumo3dviz_place"
_CORNERS = 48
_DIGITS = "3"
"""Decimals of places: SUMO's two would move the wheels of a slow car by half a centimetre."""

_STEP = re.compile(rb"Step #(\d+(?:\.\d+)?)")


@dataclass(frozen=True, slots=True)
class RecordOrder:
    """What `record` is to keep.

    Attributes:
        folder: Where it goes.
        start: First time that a film may show [s]; None is the simulation's.
        end: Last time that a film may show [s]; None is the simulation's.
        around: East, north and radius of the place to keep [m]; None is everywhere.
        follow: Id of a vehicle around which is kept; None is everywhere.
        radius: How far around the one that is followed [m].
        seed: SUMO's, instead of the configuration's.
        overwrite: Whether a recording that is there is replaced.
    """

    folder: Path
    start: float | None = None
    end: float | None = None
    around: tuple[float, float, float] | None = None
    follow: str | None = None
    radius: float = 300.0
    seed: int | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no choice.

        Raises:
            ConfigError: If the window ends before it begins, or a radius is none.
        """
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise ConfigError(f"--to ({self.end:g}) must be later than --from ({self.start:g})")
        if self.around is not None and self.follow is not None:
            raise ConfigError("give either --around or --follow")
        radius = self.radius if self.around is None else self.around[2]
        if not 0.0 < radius < math.inf:
            raise ConfigError(f"a radius must be above 0 m, not {radius:g}")


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
            _run([program, *_arguments(settings, order, part, prefix)], settings, order)
        finally:
            _remove(settings, prefix)
        _check_log(part / f"{prefix}{LOG}", settings)
        kept = [order.folder / LOG]
        (part / f"{prefix}{LOG}").replace(kept[0])
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


# What SUMO is told ------------------------------------------------------------------------


def _arguments(settings: SumoSettings, order: RecordOrder, part: Path, prefix: str) -> list[str]:
    """Return SUMO's command line, without the program."""
    extra = part / EVENTS
    place = "" if order.around is None else _place(*order.around)
    write_whole(extra, events(str((part / SIGNALS).absolute()), place))
    additional = [*settings.additional, extra]
    found = ["-c", str(settings.path.absolute()), "--output-prefix", prefix]
    found += ["--additional-files", ",".join(str(each.absolute()) for each in additional)]
    found += ["--fcd-output", str((part / LOG).absolute()), "--fcd-output.acceleration", "true"]
    found += ["--fcd-output.signals", "true", "--precision", _DIGITS]
    # The configuration may thin its own log.
    found += ["--device.fcd.period", "0", "--no-step-log", "false", "--step-log.period", "10"]
    if order.follow is None:
        found += ["--device.fcd.probability", "1", "--person-device.fcd.probability", "1"]
    else:
        found += ["--device.fcd.probability", "0", "--device.fcd.explicit", order.follow]
        found += ["--device.fcd.radius", f"{order.radius:g}"]
    if order.around is not None:
        found += ["--fcd-output.filter-shapes", _PLACE]
    if order.start is not None:
        begin = max(order.start - MARGIN, settings.begin)
        found += ["--device.fcd.begin", f"{begin:g}"]
    if order.end is not None:
        found += ["--end", f"{_end(settings, order):g}"]
    return found + (["--seed", str(order.seed)] if order.seed is not None else [])


def _end(settings: SumoSettings, order: RecordOrder) -> float | None:
    """Return when the simulation ends [s]; None when nobody is left."""
    if order.end is None:
        return settings.end
    asked = order.end + MARGIN
    return asked if settings.end is None else min(asked, settings.end)


def _place(east: float, north: float, radius: float) -> str:
    """Return a circle as a polygon of SUMO."""
    turns = [2.0 * math.pi * k / _CORNERS for k in range(_CORNERS)]
    shape = " ".join(
        f"{east + radius * math.cos(turn):.2f},{north + radius * math.sin(turn):.2f}"
        for turn in turns
    )
    return f'    <poly id="{_PLACE}" shape="{shape}" color="0,0,0"/>\n'


# Running it -------------------------------------------------------------------------------


def _run(command: Sequence[str], settings: SumoSettings, order: RecordOrder) -> None:
    """Run SUMO and say how far it is.

    Raises:
        InputError: If it stops with an error; has SUMO's own words.
    """
    end = _end(settings, order)
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
