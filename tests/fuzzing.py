"""Tries damaged files in a process of its own, which may hang, fall or ask for too much memory.

Run as a program, it reads cases from standard input, a kind and a number a line, and answers
each with a line of JSON.
"""

from __future__ import annotations

import contextlib
import io
import json
import logging
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from builders import complaints
from hypothesis import settings
from searching import tries

MOST_SECONDS = 20.0
"""A case may take so much of a processor [s]."""

_PATIENCE = 240.0
"""What takes so long hangs [s], unless the machine is so busy that it had no time yet."""

_TURNS = 10
"""So often is that waited, at most: what sleeps hangs, too."""

MOST_MEMORY = 1 << 30
"""A case may ask for so much beside what the program has already [bytes]."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a case.

    Attributes:
        kind: Of damage.
        seed: Its number.
        code: The command's exit code; -1 where it raised, -2 where it did not end.
        said: What it said on standard error, or the traceback.
        seconds: Of a processor that it took.
    """

    kind: str
    seed: int
    code: int
    said: str
    seconds: float

    @property
    def fault(self) -> str:
        """What is wrong with it; empty if it ended well or with one clear sentence."""
        if self.code not in (0, 2):
            return f"{self.kind} {self.seed}: ended with {self.code}: {self.said}"
        if self.seconds > MOST_SECONDS:
            return f"{self.kind} {self.seed}: took {self.seconds:.0f} s"
        lines = [line for line in self.said.splitlines() if not line.endswith(" left")]
        strange = [line for line in lines if not line.startswith("sumo3dviz-pt: ")]
        if len(complaints(self.said)) != (self.code != 0) or strange:
            return f"{self.kind} {self.seed}: said {self.said}"
        return ""


def seeds(usual: int) -> range:
    """Numbers of cases: always the same few, or many others in a random search."""
    first = 0 if settings.default.derandomize else int(np.random.default_rng().integers(10**9))
    return range(first, first + tries(usual))


def faults(kind: str, usual: int) -> list[str]:
    """What is wrong with cases of a kind, so many of them where the search is not random."""
    found = [each for each in outcomes([(kind, n) for n in seeds(usual)]) if each.fault]
    # A busy machine can make any case slow once; what is wrong is wrong again.
    again = outcomes([(case.kind, case.seed) for case in found])
    return [each.fault for each in again if each.fault]


def outcomes(cases: Sequence[tuple[str, int]]) -> Iterator[Outcome]:
    """Try cases, kinds and numbers, each within bounds of time and memory, in one process."""
    waiting = list(cases)
    while waiting:
        with _worker() as (process, answers):
            while waiting:
                kind, seed = waiting.pop(0)
                process.stdin.write(f"{kind} {seed}\n")
                process.stdin.flush()
                outcome = _answer(kind, seed, answers, process.pid)
                yield outcome
                if outcome.code == -2:
                    break


def _answer(kind: str, seed: int, answers: queue.Queue[str], worker: int) -> Outcome:
    try:
        line = _awaited(answers, worker)
    except queue.Empty:
        return Outcome(kind, seed, -2, f"did not end in {_PATIENCE:g} s", _PATIENCE)
    return Outcome(**json.loads(line)) if line else Outcome(kind, seed, -2, "the process fell", 0.0)


def _awaited(answers: queue.Queue[str], worker: int) -> str:
    """Wait for a line of a worker, a process's number; `queue.Empty` if it hangs."""
    before = _spent(worker)
    for _ in range(_TURNS):
        try:
            return answers.get(timeout=_PATIENCE)
        except queue.Empty:
            # Where nobody tells the time, the difference is no number.
            if not _spent(worker) - before <= MOST_SECONDS:
                raise
    raise queue.Empty


def _spent(process: int) -> float:
    """Time that a process had of processors [s]; endless where the system does not tell."""
    try:
        words = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
    except OSError:
        return float("inf")


@contextlib.contextmanager
def _worker() -> Iterator[tuple[subprocess.Popen[str], queue.Queue[str]]]:
    """A process that tries cases, ready to."""
    process = subprocess.Popen(
        [sys.executable, "-W", "error", __file__],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    )
    answers: queue.Queue[str] = queue.Queue()

    def listen() -> None:
        for line in process.stdout:
            answers.put(line)
        answers.put("")

    thread = threading.Thread(target=listen, daemon=True)
    thread.start()
    try:
        assert json.loads(_awaited(answers, process.pid))["code"] == 0, "the whole scenario is fine"
        yield process, answers
    finally:
        process.kill()
        process.wait()
        thread.join()
        process.stdin.close()
        process.stdout.close()


# In the process ----------------------------------------------------------------------------


def _bound_memory() -> None:
    """Ask for no more than the bound from now on; only POSIX systems can."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (ImportError, OSError):
        return
    most = pages * os.sysconf("SC_PAGE_SIZE") + MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _tried(kind: str, seed: int) -> Outcome:
    """Try one case."""
    from damage import write_case
    from damaged_work import CASES, command_of

    said, began = io.StringIO(), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        if kind in CASES:
            command = command_of(Path(folder), kind, seed)
        else:
            scene = write_case(Path(folder), kind, seed)
        try:
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
                code = _run(command) if kind in CASES else _way(kind)(scene, kind, seed)
        except BaseException:  # noqa: BLE001 - whatever it is, it is what this looks for
            code = -1
            said.write(traceback.format_exc())
    return Outcome(kind, seed, code, said.getvalue(), time.process_time() - began)


def _run(command: list[str]) -> int:
    """Run a command; whether two things differ is no fault."""
    from sumo3dviz_pt.cli import main

    code = main(command)
    return 0 if command[0] == "compare" and code == 1 else code


def _way(kind: str) -> Callable[[Path, str, int], int]:
    """Return what is done with a case."""
    return _WAYS.get(kind, _checked)


def _checked(scene: Path, kind: str, seed: int) -> int:
    """Check a scene as the command does."""
    from sumo3dviz_pt.cli import main

    return main(["check", str(scene)])


def _begun(scene: Path, kind: str, seed: int) -> int:
    """Write a scene file for a simulation as the command does."""
    from sumo3dviz_pt.cli import main

    configuration, output = scene.with_name("town.sumocfg"), scene.with_name("new.yaml")
    return main(["init", str(configuration), "-o", str(output)])


def _loaded(scene: Path, kind: str, seed: int) -> int:
    """Load a scene as a program does, with overrides."""
    from damage import chance_of, odd_overrides

    import sumo3dviz_pt as sv

    return _our_error(lambda: sv.load(scene, odd_overrides(chance_of(kind, seed))))


def _prepared(scene: Path, kind: str, seed: int) -> int:
    """Build a shot of any camera as films do."""
    import numpy as np

    from sumo3dviz_pt.pipeline.production import Request, prepare
    from sumo3dviz_pt.pipeline.scene_file import load_job

    camera = ("driver", "flight", "post")[seed % 3]
    times = np.array([4.0, 5.0])
    return _our_error(lambda: prepare(load_job(scene), Request(camera=camera), times))


def _our_error(work: Callable[[], object]) -> int:
    """Do something that may end in one of our errors."""
    from sumo3dviz_pt.errors import ConfigError, InputError

    try:
        work()
    except (ConfigError, InputError) as error:
        sys.stderr.write(f"sumo3dviz-pt: {error}\n")
        return 2
    return 0


_WAYS = {"configuration": _begun, "overrides": _loaded, "cameras": _prepared}
"""What is done with a case, where it is not checked."""


def _answer_all(lines: Iterable[str], answers: TextIO) -> None:
    """Try the whole scenario first, which loads what all cases need, then case by case."""

    def answer(kind: str, seed: str) -> None:
        answers.write(json.dumps(asdict(_tried(kind, int(seed)))) + "\n")
        answers.flush()

    answer("nothing", "0")
    _bound_memory()
    for line in lines:
        answer(*line.split())


if __name__ == "__main__":
    # Whatever is printed must not get among the answers.
    own = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    # Notes of what is called as a program calls it are no complaints.
    logging.getLogger("sumo3dviz_pt").addHandler(logging.NullHandler())
    _answer_all(sys.stdin, own)
