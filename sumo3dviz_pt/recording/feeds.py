"""Where windows of a running simulation come from: a run of our own, or somebody's loop.

A run of our own goes on as far as somebody looks. Somebody's loop goes on by itself and never
waits: steps that come faster than they can be shown are in its recording, but are not shown.
"""

from __future__ import annotations

import tempfile
import threading
from collections import deque
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.traffic import LogChoices, ScenarioFiles, SignalPhases
from sumo3dviz_pt.motion import MARGIN
from sumo3dviz_pt.pipeline.reading import Ground
from sumo3dviz_pt.recording.files import LoggedStep
from sumo3dviz_pt.recording.live_log import LiveLog
from sumo3dviz_pt.recording.recorder import settings_of
from sumo3dviz_pt.recording.stepped import SteppedRun
from sumo3dviz_pt.sumo import read_scenario

_MOST_STEPS = 1200
"""Steps that wait to be read, at most; of a loop that is faster, the oldest are not shown."""

_BEHIND = 6.0
"""How far a page that plays may be behind a loop of somebody's [s]."""

_PATIENCE = 0.3
"""Time that is waited for steps of a loop [s]."""


class RunFeed:
    """Windows of a run of our own, which waits for those who look; one thread may use it.

    Args:
        run: The run.
        log: Holds the window.
        start: First time that is shown [s]; None is the simulation's. What lies before is run
            through at the first call.
    """

    def __init__(self, run: SteppedRun, log: LiveLog, *, start: float | None = None) -> None:
        self._run, self._log = run, log
        self._start = -inf if start is None else start

    @property
    def stopped(self) -> str:
        """Why nothing more comes; empty while something may."""
        return self._run.stopped

    @property
    def trouble(self) -> str:
        """What went wrong with the simulation; empty while it is well."""
        return self._run.trouble

    def advance(self, until: float) -> Ground | None:
        """Let the simulation run until a time can be shown [s].

        Returns:
            The window then; None if there is nothing new.
        """
        steps: list[LoggedStep] = []
        newest = -inf if self._log.newest is None else self._log.newest
        until = max(until, self._start)
        while newest - self._log.delay < until and len(steps) < _MOST_STEPS:
            step = self._run.next()
            if step is None:
                break
            newest = float(step.time)
            if newest >= self._start - MARGIN:
                steps.append(step)
        if not steps and not self.stopped:
            return None
        if steps:
            self._log.take(steps)
        return self._log.ground(ended=bool(self.stopped))


def loop_ground(connection: Any, job: Job) -> Ground:
    """Return a simulation of somebody's loop before anything of it is known but its files.

    Args:
        connection: The module `libsumo` or `traci`, or a connection of `traci`.
        job: The scene file.

    Raises:
        InputError: If a file of the simulation is wrong.
    """
    inputs, time = settings_of(connection), float(connection.simulation.getTime())
    with tempfile.TemporaryDirectory(prefix="sumo3dviz_pt-") as name:
        nobody = Path(name, "fcd.xml")
        text = LoggedStep(f"{time:.3f}", ()).text
        nobody.write_text(f"<fcd-export>\n{text}</fcd-export>\n", encoding="utf-8")
        own = job.scenario
        files = ScenarioFiles(
            inputs.network,
            (nobody,),
            additional=inputs.additional + own.additional,
            vehicle_types=inputs.routes + inputs.additional + own.vehicle_types,
        )
        scenario = read_scenario(files, choices=LogChoices(classes=dict(job.vehicles.types)))
    # Lights that no log knows would not be built.
    lights = connection.trafficlight
    states = {name: lights.getRedYellowGreenState(name) for name in lights.getIDList()}
    signals = {name: SignalPhases(name, (time,), (state,)) for name, state in states.items()}
    files = replace(files, trajectories=())
    return Ground(files, replace(scenario, signals=signals), (), time, time, growing=True)


class LoopFeed:
    """Windows of somebody's loop. `put` and `stop` may be called from any thread.

    Args:
        log: Holds the window.

    Attributes:
        stopped: Why nothing more comes; empty while something may.
        trouble: What went wrong with the simulation; empty while it is well.
    """

    def __init__(self, log: LiveLog) -> None:
        self.stopped = self.trouble = ""
        self._log = log
        self._waiting: deque[LoggedStep] = deque()
        self._lost = False
        self._news = threading.Condition()

    def put(self, step: LoggedStep) -> None:
        """Take a step; never waits."""
        with self._news:
            if len(self._waiting) == _MOST_STEPS:
                self._waiting.popleft()
                self._lost = True
            self._waiting.append(step)
            self._news.notify_all()

    def stop(self, why: str, *, trouble: bool = False) -> None:
        """Say that no step follows, and why; `trouble` if something went wrong."""
        with self._news:
            self.stopped, self.trouble = why, why if trouble else self.trouble
            self._news.notify_all()

    def advance(self, until: float) -> Ground | None:
        """Return the window of all steps that came; None if there is nothing new after a while.

        Args:
            until: Has no effect, as the loop does not wait.
        """
        del until
        with self._news:
            self._news.wait_for(lambda: self._waiting or self.stopped, timeout=_PATIENCE)
            steps, lost, ended = list(self._waiting), self._lost, bool(self.stopped)
            self._waiting.clear()
            self._lost = False
        if not steps and not ended:
            return None
        if lost:
            self._log.forget()
        if steps:
            self._log.take(steps)
        return self._log.ground(ended=ended, behind=_BEHIND)
