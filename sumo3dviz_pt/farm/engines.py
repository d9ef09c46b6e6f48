"""Engines of farms: workers on this machine, of a Dask cluster, of Slurm.

On this machine each worker is a process of its own. A Dask cluster runs already, or is one of this
machine's own.

Slurm gets batch scripts: an array of chunks, an array of films, and a job for what is left. The
second array waits for the first, and the last job for the second, however these end; the files in
the farm's folder say what is still to be done.
"""

from __future__ import annotations

import logging
import math
import re
import shlex
import shutil
import subprocess
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from sumo3dviz_pt.errors import ConfigError, MissingExtraError, RenderError
from sumo3dviz_pt.farm.plan import PROGRAM, FarmPlan, read_plan
from sumo3dviz_pt.farm.state import FarmState, this_host
from sumo3dviz_pt.farm.worker import Orders, work
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.installation.dependencies import threads

_SPARE = 3
"""Deaths of workers that no try of a task explains."""


class LocalRun:
    """Keeps so many workers alive as were asked for.

    Args:
        plan: The farm's.
    """

    follows = True

    def __init__(self, plan: FarmPlan) -> None:
        self._plan = plan
        self._workers: list[subprocess.Popen[bytes]] = []
        self._begun = 0
        self._most = len(plan.tasks) * (plan.tries + 1) + _SPARE

    def __enter__(self) -> LocalRun:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Wait for all workers; they end by themselves when nothing is left, or at a stop."""
        for worker in self._workers:
            worker.wait()

    @property
    def where(self) -> str:
        """Where the work is done, in words."""
        count = self._plan.engine.workers or 1
        return f"{count} worker{'' if count == 1 else 's'} on {this_host().split()[0]}"

    def tend(self, state: FarmState) -> None:
        """Replace workers that have died.

        Raises:
            RenderError: If they die again and again.
        """
        self._workers = [worker for worker in self._workers if worker.poll() is None]
        for _ in range((self._plan.engine.workers or 1) - len(self._workers)):
            if self._begun >= self._most:
                logs = self._plan.folder / "workers"
                raise RenderError(f"workers die again and again; what they said is in {logs}")
            self._workers.append(self._started())

    def _started(self) -> subprocess.Popen[bytes]:
        """Start a worker."""
        self._begun += 1
        folder = self._plan.folder / "workers"
        folder.mkdir(parents=True, exist_ok=True)
        words = ["farm", "work", str(self._plan.folder)]
        with (folder / f"{self._begun:03d}.txt").open("ab") as stream:
            return subprocess.Popen(
                [*PROGRAM, *words],
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C is for the command that follows them
            )


log = logging.getLogger(__name__)

_TRIES = 3
"""How often Dask may fail to run a task before it has begun."""

_CONNECT = 30
"""How long the scheduler may take to answer [s]."""


def run_task(folder: str, number: int, cores: int | None) -> None:
    """Work at one task until it is over; this runs on a worker of Dask.

    Args:
        folder: The farm's.
        number: The task's.
        cores: Threads that it uses; None is its share of the worker's machine.
    """
    from distributed import get_worker

    if cores is None:
        cores = max(1, threads() // max(1, get_worker().state.nthreads))
    work(read_plan(Path(folder)), Orders(threads=cores), only=number, tell=log.info)


class DaskRun:
    """Gives every task that is ready to the cluster.

    Args:
        plan: The farm's.

    Raises:
        MissingExtraError: If Dask is not installed.
        ConfigError: If the scheduler does not answer.
    """

    follows = True

    def __init__(self, plan: FarmPlan) -> None:
        try:
            import distributed
        except ImportError as error:
            raise MissingExtraError("the engine dask needs distributed", extra="dask") from error
        self._plan = plan
        self._futures: dict[int, Any] = {}
        self._sent: Counter[int] = Counter()
        self._cluster: Any = None
        address = plan.engine.scheduler
        if address is None:
            self._cluster = distributed.LocalCluster(
                n_workers=plan.engine.workers or 1, threads_per_worker=1, dashboard_address=None
            )
            self._client = distributed.Client(self._cluster)
            return
        try:
            if address.endswith(".json"):
                self._client = distributed.Client(scheduler_file=address, timeout=_CONNECT)
            else:
                self._client = distributed.Client(address, timeout=_CONNECT)
        except (OSError, ValueError) as error:
            raise ConfigError(
                f"no Dask scheduler answers at {address} ({error})", key="scheduler"
            ) from error

    def __enter__(self) -> DaskRun:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Wait for tasks that run, which end at a stop; leave the cluster."""
        from distributed import wait

        if error is None or isinstance(error, KeyboardInterrupt):
            wait(list(self._futures.values()))
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()

    @property
    def where(self) -> str:
        """Where the work is done, in words."""
        known = self._client.scheduler_info()
        count = len(known["workers"])
        return f"{count} Dask worker{'' if count == 1 else 's'} of {known['address']}"

    def tend(self, state: FarmState) -> None:
        """Give tasks to the cluster that can be begun, and those again that came back undone.

        Raises:
            RenderError: If Dask cannot run them.
        """
        for number in state.ready():
            future = self._futures.get(number)
            if future is not None and not future.done():
                continue
            if future is not None and future.status == "error":
                self._check(number, state, future)
            self._sent[number] += 1
            self._futures[number] = self._client.submit(
                run_task,
                str(self._plan.folder.resolve()),
                number,
                self._plan.engine.threads,
                key=f"sumo3dviz-pt-{self._plan.folder.stem}-{number}-{self._sent[number]}",
                pure=False,
            )

    def _check(self, number: int, state: FarmState, future: Any) -> None:
        """Give up what Dask failed to run several times though no worker of ours began it."""
        if self._sent[number] >= _TRIES and not state.tries.get(number):
            raise RenderError(
                f"the Dask workers cannot run task {number}: {future.exception()};"
                " they need this version of sumo3dviz_pt and the shared folder"
            )


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
        write_atomically(folder / f"{name}.sbatch", _script(plan, name, tasks))
        place = shlex.quote((folder.resolve() / f"{name}.sbatch").as_posix())
        lines.append(f"{name}=$(sbatch --parsable{after} {place})")
        after = f" --dependency=afterany:${{{name}%%;*}}"
        ids.append(f"${{{name}%%;*}}")
    jobs = shlex.quote((folder.resolve() / _JOBS).as_posix())
    lines.append(f"echo {' '.join(ids)} >{jobs}")
    write_atomically(folder / "submit.sh", "\n".join([*lines, ""]))
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
        "gres": choice.gpus,
        "partition": choice.partition,
        "account": choice.account,
        "requeue": "",
        "open-mode": "append",
        "signal": f"B:TERM@{_WARNING}",
        "output": f'"{output}"',
    }
    words = [*PROGRAM, "farm", "work", folder.as_posix()]
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
            ["sh", str(self._script)],
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            check=False,
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
            ["squeue", "--noheader", "--jobs", ids],
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            check=False,
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
            ["scancel", "--state=PENDING", *ids],
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            check=False,
        )
