"""Batch scripts for Slurm: an array of chunks, an array of films, and a job for what is left.

The second array waits for the first, and the last job for the second, however these end; the
files in the farm's folder say what is still to be done.
"""

from __future__ import annotations

import math
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.files.whole import write_whole
from sumo3dviz_pt.pipeline.farm.plan import FarmPlan
from sumo3dviz_pt.pipeline.farm.state import FarmState

SCRIPTS = "slurm"
"""Folder of the scripts, and of what the jobs say."""

_JOBS = "jobs.txt"

_MOST = 1000
"""Tasks of an array; Slurm takes 1,000 unless its administrator allows more."""

_THREADS = 16
"""Threads of a job, unless others are asked for."""

_WARNING = 120
"""So long before its time is over a job is told [s]."""

_GONE = 30.0
"""So long no job of ours is known before they count as ended [s]."""

_LOOK = 10.0
"""Time between two questions to Slurm [s]."""


def write_scripts(plan: FarmPlan) -> Path:
    """Write the batch scripts, and the one that submits them.

    Args:
        plan: The farm's; its folder exists.

    Returns:
        The script that submits the others.
    """
    folder = plan.folder / SCRIPTS
    folder.mkdir(parents=True, exist_ok=True)
    frames = plan.rendering()
    films = [n for n, task in enumerate(plan.tasks) if task.frames is None and not _last(plan, n)]
    lines = ["#!/bin/sh", "# Submits all jobs; each waits for those before it.", "set -e"]
    after, ids = "", []
    for name, tasks in (("frames", frames), ("films", films), ("rest", [])):
        if name == "films" and len(films) < 2:
            continue  # the last job makes it
        write_whole(folder / f"{name}.sbatch", _script(plan, name, tasks))
        place = shlex.quote((folder.resolve() / f"{name}.sbatch").as_posix())
        lines.append(f"{name}=$(sbatch --parsable{after} {place})")
        after = f" --dependency=afterany:${{{name}%%;*}}"
        ids.append(f"${{{name}%%;*}}")
    jobs = shlex.quote((folder.resolve() / _JOBS).as_posix())
    lines.append(f"echo {' '.join(ids)} >{jobs}")
    write_whole(folder / "submit.sh", "\n".join([*lines, ""]))
    return folder / "submit.sh"


def _last(plan: FarmPlan, number: int) -> bool:
    """Return whether a task is the one that ends a study."""
    return plan.tasks[number].film is None


def _script(plan: FarmPlan, name: str, tasks: Sequence[int]) -> str:
    """Return a batch script; without tasks it works at all that is left."""
    choice, folder = plan.engine, plan.folder.resolve()
    single = tasks and len(tasks) <= _MOST
    output = (folder / SCRIPTS / f"{name}{'-%a' if tasks else ''}.txt").as_posix()
    options = {
        "job-name": re.sub(r"[^A-Za-z0-9._-]+", "-", f"{plan.folder.stem}-{name}"),
        "array": _array(tasks, choice.workers),
        "cpus-per-task": str(choice.threads or _THREADS),
        "ntasks": "1",
        "time": choice.time or _time_limit(plan),
        "mem": choice.memory,
        "partition": choice.partition,
        "account": choice.account,
        "requeue": "",
        "open-mode": "append",
        "signal": f"B:TERM@{_WARNING}",
        "output": f'"{output}"',
    }
    words = [sys.executable, "-m", "sumo3dviz_pt.cli", "farm", "work", folder.as_posix()]
    which = ' --task "$SLURM_ARRAY_TASK_ID"' if single else ""
    return "\n".join(
        [
            "#!/bin/sh",
            *(
                f"#SBATCH --{key}{'=' if value else ''}{value}"
                for key, value in options.items()
                if value is not None
            ),
            "# The worker itself is told when the time is over, and finishes its frame.",
            f"exec {shlex.join(words)}{which}",
            "",
        ]
    )


def _array(tasks: Sequence[int], at_once: int | None) -> str | None:
    """Return an array's places: the tasks' own numbers, or workers where there are too many."""
    if not tasks:
        return None
    first, last = (tasks[0], tasks[-1]) if len(tasks) <= _MOST else (0, _MOST - 1)
    return f"{first}-{last}" + ("" if at_once is None else f"%{at_once}")


def _time_limit(plan: FarmPlan) -> str:
    """Return a limit for each job: three times the forecast of the longest task, and some more."""
    cores = plan.engine.threads or _THREADS
    # A quarter of the work is one thread's.
    longest = max(task.cpu for task in plan.tasks) * (0.25 + 0.75 / cores)
    tens = math.ceil((3 * longest + 1200) / 600)
    return f"{tens // 6}:{tens % 6}0:00"


class SlurmRun:
    """Submits the jobs and asks Slurm whether they are still there.

    Args:
        plan: The farm's.

    Raises:
        RenderError: If Slurm refuses them.
    """

    def __init__(self, plan: FarmPlan) -> None:
        self._plan, self._jobs = plan, ""
        self._script = write_scripts(plan)
        self._asked = self._known = time.monotonic()
        self.follows = shutil.which("sbatch") is not None and not plan.engine.detach
        if shutil.which("sbatch") is None:
            return
        done = subprocess.run(
            ["sh", str(self._script)], capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RenderError(f"Slurm refuses the jobs: {done.stderr.strip() or done.stdout}")
        self._jobs = (self._script.with_name(_JOBS)).read_text(encoding="utf-8").strip()

    def __enter__(self) -> SlurmRun:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the jobs to Slurm."""

    @property
    def where(self) -> str:
        """Where the work is done, in words."""
        if not self._jobs:
            return f"Slurm is not here; where it is, run: sh {self._script}"
        return f"Slurm's jobs {', '.join(self._jobs.split())}"

    def tend(self, state: FarmState) -> None:
        """Ask Slurm for the jobs.

        Raises:
            RenderError: If they have ended and not all is done.
        """
        now = time.monotonic()
        if now - self._asked < _LOOK:
            return
        self._asked = now
        if self._count():
            self._known = now
        elif now - self._known > _GONE:
            raise RenderError(
                "Slurm's jobs have ended, and not all is done; what they said is in"
                f" {self._script.parent}; go on by `sumo3dviz-pt farm resume {self._plan.folder}`"
            )

    def _count(self) -> int:
        """Return how many of the jobs Slurm has; one if it does not answer."""
        ids = ",".join(self._jobs.split())
        done = subprocess.run(
            ["squeue", "--noheader", "--jobs", ids], capture_output=True, text=True, check=False
        )
        if done.returncode:
            # Jobs that ended some minutes ago are forgotten one by one.
            return 0 if "Invalid job id" in done.stderr else 1
        return len(done.stdout.split("\n")) - 1


def cancel_pending(plan: FarmPlan) -> None:
    """Take jobs back that have not begun; those that have are told by the farm's folder."""
    jobs = plan.folder / SCRIPTS / _JOBS
    if jobs.is_file() and shutil.which("scancel"):
        ids = jobs.read_text(encoding="utf-8").split()
        subprocess.run(
            ["scancel", "--state=PENDING", *ids], capture_output=True, text=True, check=False
        )
