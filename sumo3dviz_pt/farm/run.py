"""Runs a farm: begins it, follows it by the files on disk, stops it, goes on with it."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.farm.engines import DaskRun, LocalRun, SlurmRun, cancel_pending
from sumo3dviz_pt.farm.plan import EngineChoice, FarmPlan, write_plan
from sumo3dviz_pt.farm.state import (
    OVER,
    STOP,
    FarmState,
    TaskState,
    Try,
    forget,
    log_file,
    read_state,
)
from sumo3dviz_pt.installation.dependencies import threads
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.costs import time_in_words
from sumo3dviz_pt.pipeline.films.frames import frame_file, listed
from sumo3dviz_pt.pipeline.steps import WorkStep

_RECENT = 900.0
"""The pace is that of this time [s]."""

_FEWEST = 2
"""Frames that tell a pace."""

_TIRED = 40
"""Most rows about workers."""


@dataclass(frozen=True, slots=True)
class Problem:
    """What will not be made without somebody's help.

    Attributes:
        what: In a sentence, with the reason.
        log: What the command said; None where no command ran.
    """

    what: str
    log: Path | None


@dataclass(frozen=True, slots=True)
class FarmStatus:
    """How far a farm is, in figures.

    Attributes:
        state: On disk.
        now: When that was [s, since 1970].
        pace: Frames an hour of late; None where none were made.
        left: Estimate of the time left [s]; None where nobody works or nothing is left.
        workers: Tries that are alive.
        problems: What needs somebody.
    """

    state: FarmState
    now: float
    pace: float | None
    left: float | None
    workers: tuple[Try, ...]
    problems: tuple[Problem, ...]

    @property
    def word(self) -> str:
        """All of it in a word."""
        if self.state.complete:
            return "done"
        if self.state.over:
            return "failed"
        if self.state.stopping:
            return "stopping" if self.workers else "stopped"
        return "working" if self.workers else "waiting"

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        done, total = self.state.frames
        return {
            "state": self.word,
            "frames": {"done": done, "total": total},
            "tasks": counts(self.state),
            "frames_per_hour": None if self.pace is None else round(self.pace, 1),
            "seconds_left": None if self.left is None else round(self.left),
            "workers": [
                {"task": one.task, "try": one.number, "host": one.host, "pid": one.pid}
                for one in self.workers
            ],
            "set_aside": {
                film.path: sorted(aside)
                for film, aside in zip(self.state.plan.films, self.state.aside, strict=True)
                if aside
            },
            "problems": [problem.what for problem in self.problems],
        }

    def __str__(self) -> str:
        done, total = self.state.frames
        tasks = counts(self.state)
        share = 100 * done / max(total, 1)
        lines = [
            f"{self.state.plan.folder}: {self.word}",
            f"  frames    {done} of {total} ({share:.0f} %)",
            f"  tasks     {', '.join(f'{count} {name}' for name, count in tasks.items())}",
        ]
        if self.pace is not None:
            lines.append(f"  pace      {self.pace:.3g} frames an hour")
        if self.left is not None:
            lines.append(f"  left      about {time_in_words(self.left)}")
        for one in self.workers[:_TIRED]:
            since = time_in_words(self.now - one.began)
            lines.append(f"  worker    {_machine(one.host)}, task {one.task}, for {since}")
        if len(self.workers) > _TIRED:
            lines.append(f"  worker    and {len(self.workers) - _TIRED} more")
        for problem in self.problems:
            log = "" if problem.log is None else f" (see {problem.log})"
            lines.append(f"  problem   {problem.what}{log}")
        return "\n".join(lines)


def _machine(host: str) -> str:
    """Return a machine's name without its container's; a try that is being written has none yet."""
    return host.partition(" ")[0] or "a machine"


def status_of(state: FarmState, *, now: float | None = None) -> FarmStatus:
    """Return how far a farm is.

    Args:
        state: On disk.
        now: The time [s, since 1970]; default the clock's.
    """
    now = time.time() if now is None else now
    last = (state.last(number) for number in range(len(state.states)))
    alive = tuple(
        one for one in last if one is not None and state.states[one.task] is TaskState.RUNNING
    )
    pace = _pace(state, now)
    return FarmStatus(state, now, pace, _left(state, alive, now), alive, problems_of(state))


def counts(state: FarmState) -> Mapping[str, int]:
    """Return how many tasks are in each state that any is in."""
    tally = Counter(state.states)
    return {str(one): tally[one] for one in TaskState if tally[one]}


def problems_of(state: FarmState) -> tuple[Problem, ...]:
    """Return what will not be made without somebody's help."""
    plan, problems = state.plan, []
    for number, film in enumerate(plan.films):
        if state.aside[number]:
            frames = state.aside[number]
            problems.append(
                Problem(
                    f"{film.path}: set aside after {plan.tries} tries:"
                    f" {counted(len(frames), 'frame')} ({listed(frames)}):"
                    f" {_why_aside(state, number)}",
                    _log_of(state, number),
                )
            )
    for number, one in enumerate(state.states):
        if one is TaskState.FAILED:
            last = state.last(number)
            log = None if last is None else log_file(plan.folder, last)
            problems.append(Problem(f"task {number} failed: {state.why(number)}", log))
    return tuple(problems)


def _blamed(state: FarmState, film: int) -> list[Try]:
    """Return the tries that ended at frames of a film that are set aside."""
    return [
        one
        for number, tries in state.tries.items()
        if state.plan.tasks[number].film == film
        for one in tries
        if one.end is not None and one.end.frame in state.aside[film]
    ]


def _why_aside(state: FarmState, film: int) -> str:
    """Return what was said of a frame that is set aside."""
    words = [one.end.said for one in _blamed(state, film) if one.end is not None and one.end.said]
    return words[-1] if words else "nothing was said"


def _log_of(state: FarmState, film: int) -> Path | None:
    """Return what the command said at a frame that is set aside."""
    blamed = _blamed(state, film)
    return log_file(state.plan.folder, blamed[-1]) if blamed else None


def _pace(state: FarmState, now: float) -> float | None:
    """Return the frames an hour of late, by the times of their files."""
    began = _first_began(state)
    if began is None:
        return None
    since = max(began, now - _RECENT)
    made = sum(time >= since for time in _times(state.plan, state))
    if made < _FEWEST or now <= since:
        return None
    return 3600 * made / (now - since)


def _first_began(state: FarmState) -> float | None:
    """Return when the first try began [s, since 1970]; None where none has."""
    return min((one.began for tries in state.tries.values() for one in tries), default=None)


def _times(plan: FarmPlan, state: FarmState) -> list[float]:
    """Return when frames were made [s, since 1970]."""
    times = []
    for number, film in enumerate(plan.films):
        folder = plan.place / film.folder
        for frame in state.present[number]:
            try:
                times.append(frame_file(folder, frame).stat().st_mtime)
            except OSError:  # it was just replaced
                continue
    return times


def _left(state: FarmState, alive: tuple[Try, ...], now: float) -> float | None:
    """Return the time left [s], by what the forecast of the work that is done took."""
    if state.over or not alive:
        return None
    plan = state.plan
    done = left = 0.0
    for number, task in enumerate(plan.tasks):
        over = state.states[number] in OVER
        share = 1.0
        if not over:
            share = 0.0
            if task.frames is not None:
                total = task.frames[1] - task.frames[0]
                share = 1.0 - len(state.missing(number)) / total
        done += share * task.cpu
        left += (1.0 - share) * task.cpu
    began = _first_began(state) or now
    passed = max(now - began, 1.0)
    if done <= 0.0:
        # Nothing is known yet but the forecast.
        return left / len(alive) / (plan.engine.threads or 1)
    return left * passed / done


_LOOK = 0.5
"""Time between two looks at the disk [s], at first."""

_SLOW_LOOK = 5.0
"""The same for long films: thousands of files are listed each time [s]."""


class FarmRun(Protocol):
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


class _Opened(FarmRun, AbstractContextManager[FarmRun], Protocol):
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


def _followed(plan: FarmPlan, run: FarmRun) -> FarmState:
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
