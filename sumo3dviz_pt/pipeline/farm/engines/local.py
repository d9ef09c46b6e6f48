"""Workers on this machine, each a process of its own."""

from __future__ import annotations

import subprocess
import sys
from types import TracebackType

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.pipeline.farm.plan import FarmPlan
from sumo3dviz_pt.pipeline.farm.state import FarmState
from sumo3dviz_pt.pipeline.farm.tries import this_host

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
                [sys.executable, "-m", "sumo3dviz_pt.cli", *words],
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C is for the command that follows them
            )
