"""How far a farm is, from the files on disk only: every worker and `farm status` see the same."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from sumo3dviz_pt.pipeline.farm.plan import FarmPlan, FarmTask
from sumo3dviz_pt.pipeline.farm.tries import Outcome, Try, tries_in

STOP = "stop"
"""A file in the farm's folder: as long as it is there, nobody begins anything."""

_IN_A_ROW = 3
"""So many frames set aside one after the other, with none stored between them, are no accident."""

_UNDONE = (Outcome.FAILED, Outcome.LOST)


class TaskState(StrEnum):
    """What becomes of a task, in the words of `farm status`."""

    WAITING = "waiting"
    """For tasks that come first."""
    READY = "ready"
    RUNNING = "running"
    DONE = "done"
    ASIDE = "incomplete"
    """Frames of it are set aside."""
    FAILED = "failed"
    BLOCKED = "blocked"
    """A task that comes first will not be done."""


OVER = frozenset({TaskState.DONE, TaskState.ASIDE, TaskState.FAILED, TaskState.BLOCKED})
"""States that nothing but `farm resume` changes."""


@dataclass(frozen=True)
class FarmState:
    """How far a farm is.

    Attributes:
        plan: What it does.
        tries: Of each task that has any, in order.
        states: Of each task.
        present: Numbers of the frames that exist, of each film.
        aside: Numbers of the frames that are set aside, of each film.
        stopping: Whether nobody is to begin anything.
    """

    plan: FarmPlan
    tries: Mapping[int, Sequence[Try]]
    states: Sequence[TaskState]
    present: Sequence[frozenset[int]]
    aside: Sequence[frozenset[int]]
    stopping: bool

    @property
    def over(self) -> bool:
        """Whether nothing is left to do, or to be done by anybody."""
        return all(state in OVER for state in self.states)

    @property
    def complete(self) -> bool:
        """Whether everything was made."""
        return all(state is TaskState.DONE for state in self.states)

    @property
    def frames(self) -> tuple[int, int]:
        """Frames that exist, and all."""
        total = sum(film.frames for film in self.plan.films)
        return sum(map(len, self.present)), total

    def ready(self) -> list[int]:
        """Return the numbers of the tasks that can be begun."""
        return [n for n, state in enumerate(self.states) if state is TaskState.READY]

    def missing(self, number: int) -> list[int]:
        """Return which frames of a task are neither there nor set aside."""
        return _missing(self.plan.tasks[number], self.present, self.aside)

    def last(self, number: int) -> Try | None:
        """Return a task's last try."""
        tries = self.tries.get(number)
        return tries[-1] if tries else None

    def why(self, number: int) -> str:
        """Return what a task that failed said last."""
        ends = [one.end for one in self.tries.get(number, ()) if one.end is not None]
        said = [end.said for end in ends if end.outcome in (*_UNDONE, Outcome.REFUSED) and end.said]
        return said[-1] if said else "its worker died"


def read_state(plan: FarmPlan, *, now: float | None = None) -> FarmState:
    """Return how far a farm is.

    Args:
        plan: What it does.
        now: The time [s, since 1970]; default the clock's.
    """
    now = time.time() if now is None else now
    tries = tries_in(plan.folder)
    films = range(len(plan.films))
    present = [_present(plan, film) for film in films]
    aside = [_aside(plan, tries, film) for film in films]
    states: list[TaskState] = []
    for number, task in enumerate(plan.tasks):
        own = tries.get(number, [])
        state = _state(plan, task, own, now=now, whole=not _missing(task, present, aside))
        states.append(_after([states[need] for need in task.needs], state))
    _keep_developed(plan, states, tries)
    return FarmState(plan, tries, states, present, aside, (plan.folder / STOP).exists())


def _present(plan: FarmPlan, film: int) -> frozenset[int]:
    """Return the numbers of a film's frames that exist."""
    count = plan.films[film].frames
    try:
        with os.scandir(plan.place / plan.films[film].folder) as entries:
            stems = [Path(e.name).stem for e in entries if e.name.endswith(".exr") and e.is_file()]
    except OSError:
        return frozenset()
    return frozenset(int(stem) for stem in stems if stem.isdecimal() and int(stem) < count)


def _aside(plan: FarmPlan, tries: Mapping[int, Sequence[Try]], film: int) -> frozenset[int]:
    """Return the numbers of a film's frames that failed too often."""
    counts = Counter(
        one.end.frame
        for number in plan.rendering()
        if plan.tasks[number].film == film
        for one in tries.get(number, ())
        if one.end is not None and one.end.outcome in _UNDONE and one.end.frame is not None
    )
    return frozenset(frame for frame, count in counts.items() if count >= plan.tries)


def _missing(
    task: FarmTask, present: Sequence[frozenset[int]], aside: Sequence[frozenset[int]]
) -> list[int]:
    """Return which frames of a task are neither there nor set aside."""
    if task.frames is None or task.film is None:
        return []
    there = present[task.film] | aside[task.film]
    return [number for number in range(*task.frames) if number not in there]


def _state(
    plan: FarmPlan, task: FarmTask, tries: Sequence[Try], *, now: float, whole: bool
) -> TaskState:
    """Return what becomes of a task, as if nothing came before it.

    Args:
        plan: The farm's.
        task: The task.
        tries: Its own, in order.
        now: The time [s, since 1970].
        whole: Whether all of its frames are there, or set aside.
    """
    if tries and tries[-1].alive(now=now, lease=plan.lease):
        return TaskState.RUNNING
    outcomes = {one.end.outcome for one in tries if one.end is not None}
    if Outcome.REFUSED in outcomes or _is_hopeless(plan, tries):
        return TaskState.FAILED
    if whole and Outcome.ASIDE in outcomes:
        return TaskState.ASIDE
    if whole and Outcome.DONE in outcomes:
        return TaskState.DONE
    return TaskState.READY


def _is_hopeless(plan: FarmPlan, tries: Sequence[Try]) -> bool:
    """Return whether a task fails whatever frame it begins with, or without any to blame."""
    failed: Counter[int | None] = Counter()
    row = 0
    for end in (one.end for one in tries if one.end is not None):
        if end.stored:
            row = 0
        if end.outcome in _UNDONE:
            failed[end.frame] += 1
            row += end.frame is not None and failed[end.frame] == plan.tries
        if row >= _IN_A_ROW or failed[None] >= plan.tries:
            return True
    return False


def _after(before: Sequence[TaskState], own: TaskState) -> TaskState:
    """Return a task's state, by those of the tasks that come first."""
    if own is not TaskState.READY:
        return own
    if any(state in OVER and state is not TaskState.DONE for state in before):
        return TaskState.BLOCKED
    if any(state is not TaskState.DONE for state in before):
        return TaskState.WAITING
    return own


def _keep_developed(
    plan: FarmPlan, states: list[TaskState], tries: Mapping[int, Sequence[Try]]
) -> None:
    """Count tasks as done whose frames are gone because their film is made."""
    for number, task in enumerate(plan.tasks):
        ends = [one.end for one in tries.get(number, ()) if one.end is not None]
        if task.frames is None and any(end.outcome is Outcome.DONE for end in ends):
            states[number] = TaskState.DONE
            for need in task.needs:
                states[need] = TaskState.DONE
