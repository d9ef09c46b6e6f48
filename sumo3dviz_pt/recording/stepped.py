"""Runs SUMO step by step, and keeps what was seen of the run as `record` would.

SUMO sends both logs of `record` through one socket, step after step, and waits while nobody reads:
who reads a step lets time pass. SUMO is ahead of the reader by what the system holds on the way,
which changes nothing, as nobody interferes.
"""

from __future__ import annotations

import gzip
import re
import socket
import subprocess
import tempfile
import threading
import uuid
from collections.abc import Generator, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.files.atomic import put_in_place, write_atomically
from sumo3dviz_pt.recording.command import arguments, read_settings
from sumo3dviz_pt.recording.files import (
    EVENTS,
    LOG,
    SIGNALS,
    LoggedStep,
    RecordOrder,
    configuration,
    events,
)
from sumo3dviz_pt.recording.run import fault, remove_outputs, sumo_program

_OPENED = re.compile(r'\s*<timestep time="([^"]*)"')
_ROW = re.compile(r"\s*<(vehicle|person|container) ")
_LIGHT = re.compile(r'\s*<tlsState time="([^"]*)"')

_HOST = "127.0.0.1"
_PATIENCE = 0.2
"""Time after which it is looked whether SUMO still runs [s]."""

_ENDING = 10.0
"""Time that SUMO has to end after its last step [s]."""

_BUFFER = 1 << 16
"""Room for what SUMO has sent and nobody has read [bytes]."""


class SteppedRun:
    """A run of SUMO that goes on when it is asked for the next step. Close it after use.

    Args:
        path: A .sumocfg.
        folder: Where both logs are kept, under the names that `record` gives them, once it is
            closed; files of these names are replaced then.
        seed: SUMO's, instead of the configuration's.

    Attributes:
        stopped: Why there are no more steps; empty while there may be.

    Raises:
        InputError: If SUMO refuses the configuration.
        InstallationError: If there is no SUMO.
    """

    def __init__(self, path: Path, folder: Path, *, seed: int | None = None) -> None:
        self._settings, program = read_settings(path), sumo_program()
        self.stopped = self._newest = ""
        self._silence, self._closing = "", False
        self._turn = threading.Lock()
        self._folder, self._name = folder, path.name
        if (folder / path.name).absolute() == path.absolute():
            raise ConfigError(f"{folder} holds the simulation itself; give another", key="keep")
        folder.mkdir(parents=True, exist_ok=True)
        self._prefix = f"s3d{uuid.uuid4().hex[:8]}_"
        self._place = tempfile.TemporaryDirectory(dir=folder, prefix=".running-")
        part = Path(self._place.name)
        self._errors = (part / "errors.txt").open("w+b")
        self._log, self._lights = (_opened(part / name) for name in (LOG, SIGNALS))
        self._kept = self._lit = 0
        with socket.create_server((_HOST, 0)) as server:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
            port = server.getsockname()[1]
            order = RecordOrder(folder, seed=seed)
            words = arguments(self._settings, order, part, self._prefix, listener=f"{_HOST}:{port}")
            self._process = subprocess.Popen(
                [program, *words], stdout=subprocess.DEVNULL, stderr=self._errors
            )
            self._line: socket.socket | None = None
            try:
                self._line = self._answered(server)
            except BaseException:
                self._end()
                self._place.cleanup()
                raise
        self._steps = _steps_on(self._line)

    def _answered(self, server: socket.socket) -> socket.socket:
        """Wait until SUMO calls.

        Raises:
            InputError: If it ends instead; has its own words.
        """
        server.settimeout(_PATIENCE)
        while True:
            with suppress(TimeoutError):
                line, _ = server.accept()
                line.settimeout(None)
                return line
            if self._process.poll() is not None:
                raise InputError(f"SUMO stopped: {self._fault()}", file=self._settings.path)

    def next(self) -> LoggedStep | None:
        """Let SUMO do a step, and keep it.

        Returns:
            None at the end; `stopped` says why.
        """
        with self._turn:
            step = None if self._log.closed else next(self._steps, None)
            if step is None:
                self.stopped = self.stopped or self._farewell()
                return None
            self._log.write(step.text)
            self._lights.writelines(step.lights)
            self._kept, self._lit = self._kept + 1, self._lit + len(step.lights)
            self._newest = f" at {float(step.time):.12g} s"
            return step

    @property
    def trouble(self) -> str:
        """What went wrong with SUMO, though not all that it had sent may be read; else empty."""
        return self._trouble("")

    def _trouble(self, when: str) -> str:
        """Return what went wrong with SUMO, and when, as part of a sentence."""
        if self._closing or not (code := self._process.poll()):
            return self._silence
        if code < 0:
            return f"SUMO ended unexpectedly{when} (signal {-code})"
        return f"SUMO stopped{when}: {self._fault()}"

    def _farewell(self) -> str:
        """Return why SUMO sends no more."""
        try:
            self._process.wait(_ENDING)
        except subprocess.TimeoutExpired:
            self._silence = f"SUMO does not answer any more{self._newest}"
        if self._closing:
            return "the viewer has ended"
        return self._trouble(self._newest) or "the simulation has ended"

    def _fault(self) -> str:
        """Return SUMO's own words on why it stopped."""
        self._errors.seek(0)
        text = self._errors.read().decode("utf-8", errors="replace")
        return fault(text, self._process.wait())

    def close(self) -> Path | None:
        """End SUMO, and finish the recording of all steps that were read; twice does nothing.

        Returns:
            A configuration that `init` takes; None if no step was read.
        """
        target = self._folder / self._name if self._kept else None
        if self._log.closed:
            return target
        self._closing = True
        self._process.kill()  # so that nobody waits for a step any more
        with self._turn:
            return self._finished()

    def _finished(self) -> Path | None:
        """Close all files and move them to where they are kept."""
        target = self._folder / self._name if self._kept else None
        self._end()
        if target is not None:
            part = Path(self._place.name)
            put_in_place(part / LOG, self._folder / LOG)
            if self._lit:
                put_in_place(part / SIGNALS, self._folder / SIGNALS)
                write_atomically(self._folder / EVENTS, events(SIGNALS))
            text = configuration(self._settings, self._folder, signals=self._lit > 0)
            write_atomically(target, text)
        self._place.cleanup()
        return target

    def _end(self) -> None:
        """End SUMO and close all files."""
        self._process.kill()
        self._process.wait()
        for stream, root in ((self._log, "fcd-export"), (self._lights, "tlsStates")):
            stream.write(f"</{root}>\n")
            stream.close()
        self._errors.close()
        if self._line is not None:
            self._steps.close()
            self._line.close()
        remove_outputs(self._settings, self._prefix)


def steps_of(lines: Iterable[str]) -> Iterator[LoggedStep]:
    """Yield the steps of logs in one stream; one that breaks off is none.

    Args:
        lines: As SUMO writes them, an element to a line. The signals of a step come before its
            vehicles; people may stand in a second element of the same time.
    """
    time = ""
    rows: list[str] = []
    lights: list[str] = []
    whole = False
    for line in lines:
        opened, light = _OPENED.match(line), _LIGHT.match(line)
        begun = opened or light
        if begun is not None and begun[1] != time:
            if time and whole:
                yield LoggedStep(time, tuple(rows), tuple(lights))
            time, rows, lights, whole = begun[1], [], [], False
        if light is not None:
            lights.append(line)
        elif _ROW.match(line):
            rows.append(line)
        whole = whole or "</timestep>" in line or (opened is not None and line.endswith("/>\n"))
    if whole:
        yield LoggedStep(time, tuple(rows), tuple(lights))


def _steps_on(line: socket.socket) -> Generator[LoggedStep, None, None]:
    """Yield the steps that SUMO sends on a line."""
    with line, line.makefile("r", encoding="utf-8", newline="\n") as stream:
        yield from steps_of(_lines(stream))


def _lines(stream: IO[str]) -> Iterator[str]:
    """Yield lines until the other end is gone, however it goes."""
    with suppress(OSError, ValueError):
        yield from stream


def _opened(path: Path) -> IO[str]:
    """Open a packed log and begin it."""
    stream = gzip.open(path, "wt", encoding="utf-8", newline="\n", compresslevel=4)  # noqa: SIM115
    stream.write("<fcd-export>\n" if path.name == LOG else "<tlsStates>\n")
    return stream
