"""Workers of a Dask cluster: one that runs already, or one of this machine's own."""

from __future__ import annotations

import logging
from collections import Counter
from pathlib import Path
from types import TracebackType
from typing import Any

from sumo3dviz_pt.errors import ConfigError, MissingExtraError, RenderError
from sumo3dviz_pt.installation.processors import threads
from sumo3dviz_pt.pipeline.farm.plan import FarmPlan, read_plan
from sumo3dviz_pt.pipeline.farm.state import FarmState
from sumo3dviz_pt.pipeline.farm.worker import Orders, work

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
