"""Says where drawn motion breaks its laws: of a log in `check` and `init`, of a film in a note."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.traffic import Scenario, Trace
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.motion import LogMotion
from sumo3dviz_pt.motion.laws import HEADING, LEAPING, MOVING, Breach, breaches
from sumo3dviz_pt.motion.setting import body_length
from sumo3dviz_pt.motion.smoothers.registry import SMOOTHERS

logger = logging.getLogger(__name__)

_MOST_ROWS = 60_000
"""Rows of a log that `check` and `init` look at; of larger ones they take every n-th user."""

_ALWAYS = (-math.inf, math.inf)


@dataclass(frozen=True, slots=True)
class Lawfulness:
    """How drawn motion keeps its laws.

    Attributes:
        looked: Number of road users that were looked at.
        users: Number of all.
        breaches: What they break, each law at most once a road user; by time.
    """

    looked: int
    users: int
    breaches: tuple[Breach, ...] = ()

    @property
    def text(self) -> str:
        """One sentence that counts the breaches and names the first; empty if there are none."""
        if not self.breaches:
            return ""
        first = self.breaches[0]
        turned = f"{math.degrees(first.value):.1f} degrees"
        size = f"{first.value:.3f} m" if first.law in (MOVING, LEAPING) else turned
        counts = Counter(each.law for each in self.breaches)
        users = len({each.id for each in self.breaches})
        parts = ", ".join(f"{law}: {count}" for law, count in counts.most_common())
        part = "" if self.looked == self.users else f" (of {self.users} in all)"
        return (
            f"{users} of {self.looked} road users{part} are drawn otherwise than they drive"
            f" ({parts}). The first is {first.id} at {first.time:.12g} s, {size} too much;"
            " `motion` draws it, and `check --motion` measures all"
        )

    def as_dict(self) -> dict[str, object]:
        """Return it as JSON has it."""
        return {
            "looked_at": self.looked,
            "road_users": self.users,
            "breaches": dict(Counter(each.law for each in self.breaches)),
            "text": self.text,
        }


def lawfulness(motion: LogMotion) -> Lawfulness:
    """Smooth some of a log's road users, and say which laws their motion breaks."""
    traces = motion.log.traces
    rows = sum(len(trace.times) for trace in traces)
    which = np.zeros(len(traces), dtype=np.bool_)
    which[:: max(1, math.ceil(rows / _MOST_ROWS))] = True
    some = [trace for trace, chosen in zip(traces, which, strict=True) if chosen]
    listed = _breaches(motion, some, motion.smooth(which), _ALWAYS)
    return Lawfulness(len(some), len(traces), _sorted(listed))


def note_breaches(
    motion: LogMotion, trajectories: Sequence[Trajectory], *, span: tuple[float, float]
) -> None:
    """Say once a run which laws the motion of a film's road users breaks.

    Args:
        motion: What made it.
        trajectories: Of the road users.
        span: First and last time of the film [s].
    """
    pairs = zip(motion.ids, motion.log.traces, strict=True)
    by_key = {(trace.kind, name): trace for name, trace in pairs}
    traces = [by_key[each.kind, each.id] for each in trajectories]
    listed = _sorted(_breaches(motion, traces, trajectories, span))
    text = Lawfulness(len(traces), len(traces), listed).text
    if text:
        logger.warning("%s", text, extra={"once": f"laws of motion {span}"})


def lawfulness_of(scenario: Scenario) -> Lawfulness:
    """Return how the default smoother keeps the laws with a simulation."""
    return lawfulness(
        LogMotion.of(
            scenario.traffic,
            smoother="lane",
            network=scenario.network,
            types=scenario.vehicle_types,
        )
    )


def _breaches(
    motion: LogMotion,
    traces: Sequence[Trace],
    trajectories: Sequence[Trajectory],
    span: tuple[float, float],
) -> Iterator[Breach]:
    """Yield what some road users break; arguments as above."""
    blur = SMOOTHERS[motion.smoother].blur
    for trace, trajectory in zip(traces, trajectories, strict=True):
        if id(trace) in motion.lawful:
            continue
        length = body_length(trace, motion.settings.types)
        found = [
            *breaches(trace, trajectory, step=motion.log.step, length=length, blur=blur, span=span)
        ]
        if not found and span == _ALWAYS and id(trace) in motion.made:
            motion.lawful.add(id(trace))
        for each in found:
            # A dragged axle never slips, and so it heads elsewhere after a sharp turn.
            if motion.heading != "tractrix" or each.law != HEADING:
                yield each


def _sorted(listed: Iterator[Breach]) -> tuple[Breach, ...]:
    """Return breaches by time."""
    return tuple(sorted(listed, key=lambda each: (each.time, each.id, each.law)))
