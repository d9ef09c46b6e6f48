"""The last minute of a running simulation, read and smoothed as `record` and films do.

Memory holds what a moving window of the log says; the log itself goes to a file. A picture at a
time is drawn from the steps until `delay` seconds after it, and nobody is ever drawn beyond the
last step.

How far the smoother looks: a road user's place between two samples hangs on the samples around it,
on those until the end of a change of lanes (8 s), and, by the rounding of its lane's places, on the
first and last sample that is known within 10 m of its way. So a place is the film's within 1e-6 m
where the window holds 12 s (`MARGIN`) and 30 m of way before and after it, or the road user's first
or last step. Who stands in a jam for the rest of the window may be off by some centimetres, and all
are nearer to the window's end: with 2 s of delay, of 206 vehicles of a grid with jams 95 % by at
most 1.3 cm and all by at most 7.2 cm, against the same moment of the whole log.
"""

from __future__ import annotations

import re
import tempfile
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.traffic import Scenario, SignalPhases, TrafficLog
from sumo3dviz_pt.motion import MARGIN
from sumo3dviz_pt.pipeline.reading import Ground
from sumo3dviz_pt.pipeline.traffic import motion_of
from sumo3dviz_pt.recording.files import LOG, LoggedStep
from sumo3dviz_pt.sumo.belonging import put_in_net
from sumo3dviz_pt.sumo.guesses import TypesOfUsers
from sumo3dviz_pt.sumo.plausibility.log import changed_types
from sumo3dviz_pt.sumo.reader import LogReader
from sumo3dviz_pt.sumo.rows import COLUMNS, RowsOfUsers, build_traces
from sumo3dviz_pt.sumo.scenario import on_land_of
from sumo3dviz_pt.sumo.types import read_vehicle_types
from sumo3dviz_pt.sumo.values import parse_time

HELD = 60.0
"""Time that the window holds of vehicles [s]."""

_WALKS = 600.0
"""The same of people [s]: how far they have walked says how they step."""

_PHASES = 600.0
"""The same of signals [s], as whether a light ever shows yellow is told by a whole cycle."""

_LIGHT = re.compile(r'id="([^"]*)".* state="([^"]*)"')


class LiveLog:
    """Holds a moving window of a running simulation's log. One thread may use it.

    Args:
        job: The scene file.
        base: The simulation as it was read beforehand, for its network and its types.
        delay: How far what is shown is behind the last step [s].
        start: First time that is shown [s]; None is the first step's.

    Attributes:
        delay: How far what is shown is behind the last step [s].
        newest: Time of the last step [s]; None before the first.

    Raises:
        ConfigError: If the scene file changes traffic, for which the whole log is needed.
    """

    def __init__(self, job: Job, base: Ground, *, delay: float, start: float | None = None) -> None:
        if job.traffic is not None:
            raise ConfigError(
                "a running simulation is shown as it is; leave this out, or view a recording",
                key="traffic",
            )
        self._job, self._base, self.delay = job, base, delay
        self._types = TypesOfUsers(
            read_vehicle_types(base.files.vehicle_types), dict(job.vehicles.types)
        )
        self.newest: float | None = None
        self._first: float | None = None
        self._start = -inf if start is None else start
        self._lanes: dict[str, int] = {}
        self._rows: RowsOfUsers = {}
        self._steps: list[float] = []
        self._phases: dict[str, list[tuple[float, str]]] = {}

    def forget(self) -> None:
        """Forget all steps: what comes next does not follow them."""
        self._rows, self._steps = {}, []

    def take(self, steps: Sequence[LoggedStep]) -> None:
        """Add steps, and forget what is older than the window.

        Raises:
            InputError: If a row is damaged.
        """
        for name, buffer in self._read(steps).items():
            if self._rows.setdefault(name, buffer) is not buffer:
                self._rows[name].extend(buffer)
        times = [parse_time(step.time) for step in steps]
        self._steps += times
        for time, step in zip(times, steps, strict=True):
            for light in filter(None, map(_LIGHT.search, step.lights)):
                own = self._phases.setdefault(light[1], [])
                if not own or own[-1][1] != light[2]:
                    own.append((time, light[2]))
        self.newest = times[-1]
        self._first = times[0] if self._first is None else self._first
        self._prune(self.newest)

    def _read(self, steps: Sequence[LoggedStep]) -> RowsOfUsers:
        """Return the packed rows of steps, by the reader of vehicle logs."""
        with tempfile.TemporaryDirectory(prefix="sumo3dviz_pt-") as name:
            file = Path(name, LOG).with_suffix("")
            text = "".join(step.text for step in steps)
            file.write_text(f"<fcd-export>\n{text}</fcd-export>\n", encoding="utf-8")
            reader = LogReader(file, (-inf, inf), self._lanes)
            reader.read(allow_truncated=False)
        put_in_net(reader.rows, {}, self._base.scenario.network.location)
        return reader.rows

    def _prune(self, newest: float) -> None:
        """Forget what is older than the window."""
        self._steps = [time for time in self._steps if time >= newest - HELD - 1e-9]
        changed_types(self._rows, step=self._step)
        for key, buffer in list(self._rows.items()):
            times = np.array(buffer[::COLUMNS])
            held = HELD if key[0] == "vehicle" or times[-1] < newest - HELD else _WALKS
            old = int(np.searchsorted(times, newest - held - 1e-9))
            if old:
                self._rows[key] = buffer[old * COLUMNS :]
            if old == len(times):
                del self._rows[key]
        for own in self._phases.values():
            while len(own) > 1 and own[1][0] <= newest - _PHASES:
                del own[0]

    @property
    def _step(self) -> float:
        """Median time between steps [s]; 0 for fewer than two."""
        steps = self._steps
        return round(float(np.median(np.diff(steps))), 6) if len(steps) > 1 else 0.0

    def ground(self, *, ended: bool = False, behind: float = inf) -> Ground | None:
        """Return the window as films see it; None before there is anything to show.

        Args:
            ended: Whether no step will follow, so that nothing has to be waited for.
            behind: How far a page that plays may be behind [s].
        """
        if self.newest is None or self._first is None:
            return None
        end = self.newest - (0.0 if ended else self.delay)
        # Only where the window reaches far enough back are places those of films.
        left = self._steps[0]
        begin = left if left <= self._first else min(left + MARGIN, end)
        begin = max(begin, self._start)
        if begin > end:
            return None
        scenario = self._scenario()
        trajectories = motion_of(self._job, scenario).smooth()
        return Ground(
            self._base.files,
            scenario,
            trajectories,
            begin,
            end,
            origin=max(self._first, self._start),
            growing=not ended,
            behind=behind,
        )

    def _scenario(self) -> Scenario:
        """Return the simulation in the window."""
        assert self.newest is not None
        base = self._base.scenario
        rows = {key: array("d", buffer) for key, buffer in self._rows.items()}
        traces, types = self._types.typed(build_traces(rows))
        log = TrafficLog(
            traces=on_land_of(traces, base.network),
            lane_names=tuple(self._lanes),
            begin=self._steps[0],
            end=self.newest,
            step=self._step,
        )
        return replace(
            base,
            traffic=log,
            vehicle_types={**base.vehicle_types, **types},
            signals=dict(self._signals()),
        )

    def _signals(self) -> Iterator[tuple[str, SignalPhases]]:
        """Yield the states of each traffic light in the window."""
        for tls, own in self._phases.items():
            times, states = zip(*own, strict=True)
            yield tls, SignalPhases(tls, times, states)
