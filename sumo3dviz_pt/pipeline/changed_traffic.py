"""Changes recorded traffic as the scene file asks: other times and paces, fewer road users."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.surroundings import MOST_DELAY, RideEdit
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Scenario, Trace, TrafficLog, VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.traffic import delay_for, motion_of, plain_id

if TYPE_CHECKING:
    from sumo3dviz_pt.motion import LogMotion


log = logging.getLogger(__name__)

_STEP = 0.1
"""Time between moments at which bodies are compared [s]."""

_ROOM = 0.2
"""What bodies may overlap on each side, as recorded ones do [m]."""

_ROWS = ("times", "positions", "yaws", "speeds", "slopes", "lanes", "signals", "offsets")
"""What a trace has for each of its samples."""

_NEAR = 60.0
"""Who never comes so near to a changed ride, by place and time, is not compared with it [m, s]."""


@dataclass(frozen=True, slots=True)
class ChangedRide:
    """What was done to a ride.

    Attributes:
        key: Such as `vehicle:car.7`.
        words: What it was, for people.
        asked: The ride of the scene file for which it was done, such as `car.8`.
    """

    key: str
    words: str
    asked: str


def recorded_window(
    job: Job, begin: float | None, end: float | None, *, margin: float
) -> tuple[float | None, float | None]:
    """Return the part of the log that is shown within a window after changes.

    Args:
        job: The scene file.
        begin: First time to show [s]; None is the log's.
        end: Last time to show [s]; None is the log's.
        margin: What smoothing needs on both sides [s].
    """
    rides = () if job.traffic is None else tuple(job.traffic.rides.values())
    spans = [span for edit in rides for span in _spans(edit, begin, end, margin)]
    first, last = [a for a, _ in spans], [b for _, b in spans]
    return (
        None if begin is None else min([begin, *first]),
        None if end is None else max([end, *last]),
    )


def _spans(
    edit: RideEdit, begin: float | None, end: float | None, margin: float
) -> Iterator[tuple[float, float]]:
    """Yield the part of the log that a changed ride may come from; of an open side, nothing."""
    low = begin if begin is not None else end
    high = end if end is not None else begin
    if low is None or high is None:
        return
    room = MOST_DELAY if edit.gap is not None else abs(edit.delay or 0.0)
    ends = (low - margin - room, high + margin + room)
    if edit.pace is not None and edit.around is not None:
        around, pace = edit.around, edit.pace
        ends = (around + (ends[0] - around) * pace, around + (ends[1] - around) * pace)
    yield ends[0] + margin, ends[1] - margin


def changed(
    job: Job,
    scenario: Scenario,
    recorded: Scenario,
    *,
    begin: float | None = None,
    end: float | None = None,
    whole: bool = False,
) -> Scenario:
    """Return a simulation as the scene file's `traffic` changes it.

    Args:
        job: The scene file.
        scenario: As recorded, of the window that is shown and what smoothing needs.
        recorded: The same of `recorded_window`, from which changed rides come.
        begin: First time that is shown [s]; None is the scene file's shots'.
        end: Last time that is shown [s]; None is the scene file's shots'.
        whole: Whether road users come with all of their rows, whatever the window.

    Raises:
        ConfigError: If a ride cannot be changed so, or would lead through somebody.
    """
    if job.traffic is None:
        return scenario
    done: list[ChangedRide] = []
    for name, edit in job.traffic.rides.items():
        recorded, rides = _ridden(job, recorded, name, edit)
        done += rides
    ends = {} if whole else {"begin": begin, "end": end}
    log_now = _replaced(scenario.traffic, recorded.traffic, done, **ends)
    scenario = replace(scenario, traffic=replace(log_now, traces=_visible(job, log_now.traces)))
    for ride in done:
        for span in _shown(job, begin, end):
            _check_free(job, scenario, ride, span)
        log.warning("%s", ride.words, extra={"once": ride.words})
    return scenario


def _replaced(
    shown: TrafficLog,
    recorded: TrafficLog,
    rides: Sequence[ChangedRide],
    *,
    begin: float | None = None,
    end: float | None = None,
) -> TrafficLog:
    """Return a log with changed rides in the places of recorded ones.

    Args:
        shown: Of the window.
        recorded: Of a wider one, with the changed rides.
        rides: Which they are.
        begin: First time that is shown [s], or None.
        end: Last time that is shown [s], or None.
    """
    from sumo3dviz_pt.motion import MARGIN

    low = -np.inf if begin is None else begin - MARGIN
    high = np.inf if end is None else end + MARGIN
    names = tuple(dict.fromkeys((*shown.lane_names, *recorded.lane_names)))
    # The last number is for rows without a lane, which have -1.
    lanes = np.array([*(names.index(name) for name in recorded.lane_names), -1])
    wanted = {ride.key for ride in rides}
    traces_now = {
        trace.key: _within(replace(trace, lanes=lanes[trace.lanes]), low, high)
        for trace in recorded.traces
        if trace.key in wanted
    }
    traces = [traces_now.pop(trace.key, trace) for trace in shown.traces]
    # Those that are left come into the window only as they are changed.
    traces += traces_now.values()
    return replace(shown, traces=tuple(filter(None, traces)), lane_names=names)


def _within(trace: Trace, begin: float, end: float) -> Trace | None:
    """Return the samples of a ride within a span of time [s]; None if there are none."""
    inside = (trace.times >= begin - 1e-9) & (trace.times <= end + 1e-9)
    if not inside.any():
        return None
    rows = [name for name in _ROWS if len(getattr(trace, name)) == len(inside)]
    return replace(trace, **{name: getattr(trace, name)[inside] for name in rows})


# Fewer ------------------------------------------------------------------------------------


def _visible(job: Job, traces: Sequence[Trace]) -> tuple[Trace, ...]:
    """Return the road users that are shown."""
    shown = shows(job)
    for each in () if job.traffic is None else job.traffic.leave_out:
        words = (word for trace in traces for word in (trace.id, f"{trace.kind}:{trace.id}"))
        if not any(fnmatchcase(word, each) for word in words):
            note = f"traffic.leave_out: nobody near this time is called {each!r}"
            log.warning("%s", note, extra={"once": note})
    return tuple(trace for trace in traces if shown(trace.kind, trace.id))


def shows(job: Job) -> Callable[[str, str], bool]:
    """Return what tells whether a road user is shown, by its kind and SUMO's id."""
    traffic = job.traffic
    if traffic is None:
        return lambda kind, name: True
    named = {*traffic.rides, *(edit.behind for edit in traffic.rides.values())}
    named |= {*job.vehicles.by_id} | {
        camera.rides_with for camera in job.cameras.values() if camera.rides_with
    }

    def shown(kind: str, name: str) -> bool:
        words = (name, f"{kind}:{name}")
        if any(fnmatchcase(word, each) for each in traffic.leave_out for word in words):
            return False
        stays = kind != "vehicle" or any(word in named for word in words)
        return stays or share_of(job.seed, "traffic", name) < traffic.share

    return shown


# Other times and paces ---------------------------------------------------------------------


def _ridden(
    job: Job, scenario: Scenario, name: str, edit: RideEdit
) -> tuple[Scenario, list[ChangedRide]]:
    """Return a simulation with a ride changed, and what was done; nothing if nobody is there."""
    from sumo3dviz_pt.motion.samples import paced

    motion = motion_of(job, scenario)
    number = _number(motion, name)
    if number is None:
        note = f"traffic.rides: nobody near this time is called {name!r}, so nothing is changed"
        log.warning("%s", note, extra={"once": note})
        return scenario, []
    key, changes = scenario.traffic.traces[number].key, list[str]()
    if edit.pace is not None and edit.around is not None:
        (own,) = motion.smooth(_only(motion, number))
        step = scenario.traffic.step
        traces = list(scenario.traffic.traces)
        traces[number] = paced(traces[number], own, pace=edit.pace, around=edit.around, step=step)
        scenario = replace(scenario, traffic=replace(scenario.traffic, traces=tuple(traces)))
        changes.append(f"at {edit.pace:g} x its pace")
    if edit.gap is None:
        words = _ride_words(name, changes, edit.delay or 0.0)
        return _later(scenario, number, edit.delay or 0.0, ChangedRide(key, words, name))
    gap = delay_for(job, scenario, name, edit)
    if gap.mover == name:
        words = _ride_words(name, changes, gap.delay) + gap.words
        return _later(scenario, number, gap.delay, ChangedRide(key, words, name))
    done = [ChangedRide(key, _ride_words(name, changes, 0.0), name)] if changes else []
    ahead = _number(motion, gap.mover)
    assert ahead is not None
    words = _ride_words(gap.mover, [], gap.delay) + gap.words
    ride = ChangedRide(scenario.traffic.traces[ahead].key, words, name)
    scenario, more = _later(scenario, ahead, gap.delay, ride)
    return scenario, [*done, *more]


def _later(
    scenario: Scenario, number: int, delay: float, ride: ChangedRide
) -> tuple[Scenario, list[ChangedRide]]:
    """Return a simulation in which a ride comes by later [s], and what was done."""
    from sumo3dviz_pt.motion.samples import delayed

    traces = list(scenario.traffic.traces)
    traces[number] = delayed(traces[number], delay)
    return replace(scenario, traffic=replace(scenario.traffic, traces=tuple(traces))), [ride]


def _ride_words(name: str, changes: Sequence[str], delay: float) -> str:
    """Return how a ride was changed, and by how much later it comes [s]."""
    late = [f"{abs(delay):.2f} s {'later' if delay > 0.0 else 'earlier'}"] if delay != 0.0 else []
    return f"{name} rides {' and '.join([*changes, *late]) or 'as recorded'}"


def _number(motion: LogMotion, name: str) -> int | None:
    """Return the number of a ride by its id or key; None if there is none."""
    index = np.flatnonzero(motion.named(name))
    return int(index[0]) if index.size else None


def _only(motion: LogMotion, number: int) -> Bools:
    """Return a mask of one ride, (n,)."""
    return np.asarray(np.arange(len(motion.ids)) == number)


def _type(types: Mapping[str, VehicleType], trace: Trace) -> VehicleType:
    """Return what a road user is."""
    return types.get(trace.type_id, UNKNOWN_TYPES[trace.kind])


# Nobody rides through anybody --------------------------------------------------------------


def _shown(job: Job, begin: float | None, end: float | None) -> list[tuple[float, float]]:
    """Return the spans of time that are shown [s]; all of it if there are no shots."""
    if begin is None or end is None:
        spans = [(shot.start, shot.end) for shot in job.shots]
        return spans or [(-np.inf, np.inf)]
    return [(begin, end)]


def _check_free(job: Job, scenario: Scenario, ride: ChangedRide, span: tuple[float, float]) -> None:
    """Refuse a changed ride that leads through somebody while it is shown.

    Raises:
        ConfigError: Names both, and when.
    """
    for own, other, time in _collisions(job, scenario, ride, span):
        raise ConfigError(
            f"{own} would drive through {other} at {time:.1f} s; choose"
            f" {_way_out(job, ride, other)}",
            key=f"traffic.rides.{ride.asked}",
        )


def _way_out(job: Job, ride: ChangedRide, other: str) -> str:
    """Return what to choose where a ride leads through another one.

    Nobody whose ride is changed or followed is to be left out: the gap would go, too.
    """
    assert job.traffic is not None
    rides = job.traffic.rides
    edit = rides[ride.asked]
    if edit.behind and plain_id(other) in map(plain_id, (edit.behind, ride.asked)):
        return "a larger gap" + (", or another pace" if edit.pace is not None else "")
    pairs = {*rides, *(each.behind for each in rides.values() if each.behind)}
    ways = "another delay, gap or pace"
    return ways if plain_id(other) in map(plain_id, pairs) else f"{ways}, or leave {other} out"


def _collisions(
    job: Job, scenario: Scenario, ride: ChangedRide, span: tuple[float, float]
) -> Iterator[tuple[str, str, float]]:
    """Yield through whom a changed ride leads within a span [s]: both ids, and when first [s]."""
    motion = motion_of(job, scenario)
    traces = scenario.traffic.traces
    number = next((k for k, trace in enumerate(traces) if trace.key == ride.key), None)
    if number is None:
        return
    (own,) = motion.smooth(_only(motion, number))
    begin, end = max(span[0], traces[number].times[0]), min(span[1], traces[number].times[-1])
    if begin > end:
        return
    times = np.arange(begin, end + 1e-9, _STEP)
    bodies = _bodies(own, _type(scenario.vehicle_types, traces[number]), times)
    places = own.sample(times).positions[:, :2]
    near = np.array([_comes_near(trace, places, begin, end) for trace in traces], dtype=np.bool_)
    near[number] = False
    for k, other in zip(np.flatnonzero(near).tolist(), motion.smooth(near), strict=True):
        others = _bodies(other, _type(scenario.vehicle_types, traces[k]), times)
        hits = np.flatnonzero(shapely.intersects(bodies, others))
        if hits.size:
            yield own.id, other.id, float(times[hits[0]])


def in_the_way(job: Job, scenario: Scenario, *, begin: float, end: float) -> tuple[str, ...]:
    """Return ids of all through whom changed rides would lead, instead of refusing them.

    Args:
        job: The scene file, with changed rides.
        scenario: As recorded, all of it.
        begin: First time that is shown [s].
        end: Last time that is shown [s].

    Raises:
        ConfigError: If a ride cannot be changed so.
    """
    assert job.traffic is not None
    done: list[ChangedRide] = []
    for name, edit in job.traffic.rides.items():
        scenario, rides = _ridden(job, scenario, name, edit)
        done += rides
    scenario = replace(
        scenario,
        traffic=replace(scenario.traffic, traces=_visible(job, scenario.traffic.traces)),
    )
    hits = (hit for ride in done for hit in _collisions(job, scenario, ride, (begin, end)))
    return tuple(dict.fromkeys(other for _, other, _ in hits))


def _bodies(trajectory: Trajectory, kind: VehicleType, times: Floats) -> Floats:
    """Return a body's outlines from above, a little smaller, (n,); none where it does not exist."""
    motion = trajectory.sample(times)
    length, half = kind.length, kind.width / 2.0
    corners = np.array(
        [
            (-_ROOM, half - _ROOM),
            (-_ROOM, _ROOM - half),
            (_ROOM - length, _ROOM - half),
            (_ROOM - length, half - _ROOM),
        ]
    )
    shapes = np.full(len(times), None, dtype=object)
    cos, sin = np.cos(motion.yaws), np.sin(motion.yaws)
    turn = np.stack([np.stack([cos, -sin], -1), np.stack([sin, cos], -1)], axis=1)
    outlines = motion.positions[:, None, :2] + np.einsum("nij,kj->nki", turn, corners)
    shapes[motion.alive] = shapely.polygons(outlines[motion.alive])
    return shapes


def _comes_near(trace: Trace, places: Floats, begin: float, end: float) -> bool:
    """Return whether a ride is logged near some places, (n, 2) [m], within a span of time [s]."""
    low, high = np.nanmin(places, axis=0) - _NEAR, np.nanmax(places, axis=0) + _NEAR
    inside = ((trace.positions[:, :2] > low) & (trace.positions[:, :2] < high)).all(axis=1)
    return bool((inside & (trace.times > begin - _NEAR) & (trace.times < end + _NEAR)).any())
