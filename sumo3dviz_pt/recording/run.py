"""Runs a simulation of SUMO with the outputs that a film needs, and nothing else changed.

Seed, step and everything else stay as the configuration says. What the simulation writes for its
owner would replace what an earlier run wrote; so it gets other names, and is removed afterwards.
SUMO's warnings are passed on as notes: each kind once, with a count where there are many.

The vehicle log is gone over afterwards: only what lies near a vehicle may stay, and broken steps
are joined. SUMO writes an element to a line, and people and containers after the vehicles of a
step: in a second element of the same time where its owner wants a log of their own.
"""

from __future__ import annotations

import gzip
import logging
import os
import re
import shutil
import subprocess
import tempfile
import uuid
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import IO
from xml.sax.saxutils import unescape

from sumo3dviz_pt.errors import ConfigError, InputError, InstallationError
from sumo3dviz_pt.files.atomic import atomic_path, put_in_place, write_atomically
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.recording.command import PEOPLE, arguments, end_of, read_settings
from sumo3dviz_pt.recording.files import EVENTS, LOG, SIGNALS, SumoSettings, configuration, events
from sumo3dviz_pt.recording.files import RecordOrder as RecordOrder

_NEAR_STEP = re.compile(r'\s*<timestep time="([^"]*)"')
_ROW = re.compile(r'\s*<(vehicle|person|container) id="([^"]*)" x="([^"]*)" y="([^"]*)"')

Keep = Callable[[list[str]], list[str]]
"""Chooses rows of a step."""


def keep_near(log: Path, name: str, *, radius: float) -> None:
    """Leave in a log only what is near a vehicle, while it is there.

    Args:
        log: SUMO's, packed; it is replaced.
        name: Id of the vehicle.
        radius: [m], on the map.

    Raises:
        ConfigError: If no such vehicle is in the log.
    """
    present = {"vehicle": False, "person": False, "container": False}

    def near(rows: list[str]) -> list[str]:
        known = [(row, _ROW.match(row)) for row in rows]
        users = [(row, match) for row, match in known if match is not None]
        own = {match[1]: match for _, match in users if _plain(match[2]) == name}
        present.update(dict.fromkeys(own, True))
        if "vehicle" not in own:
            return []
        x, y = _place(own["vehicle"])
        places = [(row, _place(match)) for row, match in users]
        return [row for row, (e, n) in places if (e - x) ** 2 + (n - y) ** 2 <= radius**2]

    _rewrite(log, near)
    if not present["vehicle"]:
        kind = next((kind for kind, there in present.items() if there), None)
        why = "" if kind is None else f"; it is a {kind}, and only a vehicle can be followed"
        raise ConfigError(f"no vehicle {name!r} drives in this window{why}", key="follow")


def join_steps(log: Path) -> None:
    """Put what a log tells of one time into one element.

    Args:
        log: SUMO's, packed; it is replaced.
    """
    _rewrite(log, list)


def _plain(text: str) -> str:
    """Return an attribute as it was before it was written as XML."""
    return unescape(text, {"&quot;": '"', "&apos;": "'"})


def _place(row: re.Match[str]) -> tuple[float, float]:
    """Return east and north of a row [m]."""
    return float(row[3]), float(row[4])


def _rewrite(log: Path, keep: Keep) -> None:
    """Write a log again, with some rows of each step."""
    with atomic_path(log) as part, gzip.open(part, "wt", encoding="utf-8", newline="\n") as out:
        out.write("<fcd-export>\n")
        for time, rows in _near_steps(log):
            out.write(f'    <timestep time="{time}">\n{"".join(keep(rows))}    </timestep>\n')
        out.write("</fcd-export>\n")


def _near_steps(log: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield times and the rows of each, which may stand in several elements."""
    time, rows = "", list[str]()
    with gzip.open(log, "rt", encoding="utf-8") as stream:
        for line in stream:
            step = _NEAR_STEP.match(line)
            if step is not None and step[1] != time:
                if time:
                    yield time, rows
                time, rows = step[1], []
            elif _ROW.match(line):
                rows.append(line)
    if time:
        yield time, rows


log = logging.getLogger(__name__)

_HEAD = "Warning: "
_NAMES = re.compile(r"'[^']*'|\d+(?:\.\d+)?")
_OF_INSTALLATION = "Environment variable SUMO_HOME is not set"
"""What says nothing of the simulation: SUMO does not check XML against its schemes then."""

_KINDS = 12
"""Kinds of warnings that are told; a broken simulation has hundreds."""


def pass_on(output: str) -> None:
    """Log the warnings among what SUMO has printed.

    Args:
        output: All of it.
    """
    kinds: dict[str, list[str]] = {}
    for text in _warnings(output):
        kinds.setdefault(_NAMES.sub("", text), []).append(text)
    for same in list(kinds.values())[:_KINDS]:
        many = len(same) - 1
        more = f" ({many} more of this kind)" if many else ""
        log.warning("SUMO warns: %s%s", same[0], more)
    rest = sum(len(same) for same in list(kinds.values())[_KINDS:])
    if rest:
        log.warning("SUMO warns of more: %d times, of %d kinds", rest, len(kinds) - _KINDS)


def _warnings(output: str) -> list[str]:
    """Return the warnings; one that goes on in an indented line is one."""
    warnings: list[str] = []
    for line in output.splitlines():
        if line.startswith(_HEAD):
            warnings.append(line.removeprefix(_HEAD).strip())
        elif warnings and line[:1].isspace() and line.strip():
            warnings[-1] += f" {line.strip()}"
    return [text for text in warnings if not text.startswith(_OF_INSTALLATION)]


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
    check_folder(order, path)
    files = _simulated(settings, order, program)
    write_atomically(target, configuration(settings, order.folder, signals=len(files) > 1))
    return (target, *files)


def _simulated(settings: SumoSettings, order: RecordOrder, program: str) -> list[Path]:
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
            remove_outputs(settings, prefix)
        log = part / f"{prefix}{LOG}"
        if order.follow is not None:
            keep_near(log, order.follow, radius=order.radius)
        elif PEOPLE in settings.given:
            join_steps(log)
        _check_log(log, settings)
        files = [order.folder / LOG]
        put_in_place(log, files[0])
        signals = part / f"{prefix}{SIGNALS}"
        if signals.is_file():
            files += [order.folder / SIGNALS, order.folder / EVENTS]
            put_in_place(signals, files[1])
            write_atomically(files[2], events(SIGNALS))
    return files


def sumo_homes() -> list[Path]:
    """Return where SUMO may lie: the package eclipse-sumo, then SUMO_HOME."""
    spec = find_spec("sumo")
    homes = [*(spec.submodule_search_locations or ())] if spec is not None else []
    homes += [os.environ["SUMO_HOME"]] if "SUMO_HOME" in os.environ else []
    return [Path(home) for home in homes]


def sumo_program(name: str = "sumo") -> str:
    """Return a program of SUMO: of the package eclipse-sumo, of SUMO_HOME, or of the system.

    Raises:
        InstallationError: If there is none.
    """
    for home in sumo_homes():
        program = shutil.which(name, path=str(home / "bin"))
        if program is not None:
            return program
    program = shutil.which(name)
    if program is None:
        raise InstallationError("there is no SUMO here; install it with: pip install eclipse-sumo")
    return program


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
        text = errors.read().decode("utf-8", errors="replace")
    if process.returncode != 0:
        raise InputError(f"SUMO stopped: {fault(text, process.returncode)}", file=settings.path)
    pass_on(text)


def fault(output: str, code: int) -> str:
    """Return why SUMO stopped, in its own words where it has some.

    Args:
        output: What it printed as errors.
        code: Its exit code.
    """
    faults = [line.strip() for line in output.splitlines() if "rror" in line]
    return " ".join(faults[:2]) or f"it ended with code {code}"


def _steps(stream: IO[bytes]) -> Iterator[float]:
    """Yield the times that SUMO's step log tells [s]; its lines end in carriage returns."""
    rest = b""
    while chunk := stream.read1(4096):  # type: ignore[attr-defined]
        rest += chunk
        steps = list(_STEP.finditer(rest))
        yield from (float(step[1]) for step in steps)
        rest = rest[steps[-1].end() :] if steps else rest[-64:]


def remove_outputs(settings: SumoSettings, prefix: str) -> None:
    """Remove what the simulation wrote for its owner under another name."""
    inputs = (settings.path, *settings.additional, *settings.routes)
    for folder in {path.absolute().parent for path in inputs} | {Path.cwd()}:
        for path in folder.glob(f"{prefix}*"):
            path.unlink()


def check_folder(order: RecordOrder, path: Path, *, key: str = "output") -> None:
    """Refuse to replace a recording unasked, or the simulation's own files.

    Args:
        order: Names the folder.
        path: The simulation's .sumocfg.
        key: How the folder was asked for, for messages.

    Raises:
        ConfigError: If it would.
    """
    target = order.folder / path.name
    if order.folder.exists() and not order.folder.is_dir():
        raise ConfigError(f"{order.folder} is a file; give a folder", key=key)
    if target.absolute() == path.absolute():
        raise ConfigError(
            f"{order.folder} holds the simulation itself; give another folder", key=key
        )
    there = [each for each in (target, order.folder / LOG) if each.exists()]
    if there and not order.overwrite:
        raise ConfigError(f"{there[0]} exists already; --overwrite replaces it", key=key)


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
