"""Runs a farm: begins it, follows it by the files on disk, stops it, goes on with it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Protocol

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.installation.processors import threads
from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.pipeline.farm.engines.choice import EngineChoice
from sumo3dviz_pt.pipeline.farm.engines.dask import DaskRun
from sumo3dviz_pt.pipeline.farm.engines.local import LocalRun
from sumo3dviz_pt.pipeline.farm.engines.slurm import SlurmRun, cancel_pending
from sumo3dviz_pt.pipeline.farm.plan import FarmPlan, write_plan
from sumo3dviz_pt.pipeline.farm.state import (
    OVER,
    STOP,
    FarmState,
    TaskState,
    read_state,
)
from sumo3dviz_pt.pipeline.farm.tries import forget
from sumo3dviz_pt.pipeline.progress.build import WorkStep

_LOOK = 0.5
"""Time between two looks at the disk [s], at first."""

_SLOW_LOOK = 5.0
"""The same for long films: thousands of files are listed each time [s]."""


class Run(Protocol):
    """Workers somewhere.

    Attributes:
        follows: Whether the command stays and watches.
    """

    follows: bool

    @property
    def where(self) -> str:
        """Where the work is done, in words."""

    def tend(self, state: FarmState) -> None:
        """Do what is to be done now and then: replace workers, hand out tasks."""


class _Opened(Run, AbstractContextManager[Run], Protocol):
    """Workers that are left, or waited for, at the end of a `with` statement."""


ENGINES: Mapping[str, Callable[[FarmPlan], _Opened]] = {
    "local": LocalRun,
    "dask": DaskRun,
    "slurm": SlurmRun,
}
"""Engines by name."""


def check_engine(choice: EngineChoice) -> EngineChoice:
    """Return an engine with the threads that its workers share on this machine.

    Raises:
        ConfigError: If there is no engine of that name; suggests one.
    """
    if choice.name not in ENGINES:
        hint = did_you_mean(choice.name, ENGINES)
        raise ConfigError(f"no engine is called {choice.name!r}{hint}", key="engine")
    several = choice.workers or 1
    own = choice.name == "local" or (choice.name == "dask" and choice.scheduler is None)
    if own and several > 1 and choice.threads is None:
        return replace(choice, threads=max(1, threads() // several))
    return choice


def run_farm(plan: FarmPlan, *, tell: Callable[[str], None]) -> FarmState:
    """Begin a farm or go on with it, and follow it to its end.

    Args:
        plan: What it does.
        tell: Is told where the work is done.

    Returns:
        How far it is when it is over, or when somebody stopped it.

    Raises:
        ConfigError: If the engine cannot be reached.
        RenderError: If the engine fails.
        KeyboardInterrupt: After Ctrl-C or SIGTERM, when all frames that were begun are finished.
    """
    write_plan(plan)
    (plan.folder / STOP).unlink(missing_ok=True)
    with ENGINES[plan.engine.name](plan) as run:
        tell(run.where)
        if not run.follows:
            return read_state(plan)
        try:
            return _followed(plan, run)
        except KeyboardInterrupt:
            if plan.engine.name != "slurm":
                stop_farm(plan)
            raise


def _followed(plan: FarmPlan, run: Run) -> FarmState:
    """Watch a farm until it is over, or stopped."""
    while True:
        state = read_state(plan)
        _announce(state)
        running = TaskState.RUNNING in state.states
        if state.over or (state.stopping and not running):
            return state
        if not state.stopping:
            run.tend(state)
        time.sleep(_LOOK if state.frames[1] < 2000 else _SLOW_LOOK)


def _announce(state: FarmState) -> None:
    """Say how far it is."""
    numbers = state.plan.rendering()
    if all(state.states[number] in OVER for number in numbers):
        announce(Doing.ENCODE)
    else:
        announce(Doing.RENDER, *state.frames)


def farm_steps(plan: FarmPlan, state: FarmState) -> tuple[WorkStep, WorkStep]:
    """Return the steps that are left of a farm, with their expected durations.

    Args:
        plan: What it does.
        state: How far it is.
    """
    cores = (plan.engine.threads or threads()) * (plan.engine.workers or 1)
    render, rest = (
        sum(
            task.cpu
            for number, task in enumerate(plan.tasks)
            if (task.frames is not None) == rendering and state.states[number] not in OVER
        )
        for rendering in (True, False)
    )
    return WorkStep(Doing.RENDER, render / cores), WorkStep(Doing.ENCODE, rest / cores)


def stop_farm(plan: FarmPlan) -> None:
    """Let workers finish the frames that they have begun, and begin nothing more."""
    (plan.folder / STOP).touch()
    cancel_pending(plan)


def renew(plan: FarmPlan) -> int:
    """Forget failures, so that `resume` tries those tasks again; return how many there were."""
    state = read_state(plan)
    bad = [
        number
        for number, one in enumerate(state.states)
        if one in (TaskState.FAILED, TaskState.ASIDE)
    ]
    for number in bad:
        forget(plan.folder, number)
    return len(bad)
