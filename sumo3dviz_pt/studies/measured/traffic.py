"""How far road users are behind those ahead of them: gaps, headways, times to collision.

The stimulus report and `vehicles --follow` ask here, so that both say the same.

Who is ahead is asked of bodies and not of lanes: the nearest road user whose body reaches into the
corridor straight ahead, half a metre wider than the own body on each side, and that does not come
towards it. On a bend the corridor leaves the road, so that far gaps are missing there.

* gap: from the own front to the other's rear, along the own heading [m];
* time gap: gap / own speed; headway: (gap + the other's length) / own speed, from front to front;
* time to collision: gap / (own speed - the other's speed along it), while the gap closes.

Speeds are those of the drawn motion, which the smoother makes of logged places; `logged_speed` is
the log's own word, interpolated between its rows. In a log of SUMO's Euler steps that word is about
the step before: whoever speeds up is drawn faster than logged, by half a step's acceleration.

References:
    Hayward, "Near-miss determination through use of a scale of danger", Highway Research Record
    384, 1972 (time to collision); SAE J2944, 2015 (gap and headway).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.surroundings import RideEdit
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Scenario, ScenarioFiles, Trace
from sumo3dviz_pt.model.trajectory import Trajectory, find_trajectory
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.traffic import kept_gap, mover_of, plain_id
from sumo3dviz_pt.studies.stimuli import Stimulus
from sumo3dviz_pt.studies.tools.content import write_table

if TYPE_CHECKING:
    from sumo3dviz_pt.motion import LogMotion


NEAREST = 3
"""How many road users near the camera are told of, beside the one that it rides with."""

_SIDE = 0.5
"""How much wider than the own body the corridor ahead is, on each side [m]."""

_AHEAD = 100.0
"""How far ahead somebody is looked for [m]."""

_NEAR = 300.0
"""Who stays farther from the camera's box than this is not looked at [m]."""

_TOWARDS = -0.2
"""Cosine of the angle between headings from which on somebody comes towards."""

_OVERLAP = 0.5
"""How far rears may lie behind the own front [m]; further back is beside, not ahead."""

STANDS = 0.1
"""Slower than this somebody stands, and times to where others are have no meaning [m/s]."""

Row = dict[str, str | int | float]


@dataclass(frozen=True, slots=True, eq=False)
class Traffic:
    """Everyone at some times, such as those of a film's frames.

    Attributes:
        keys: Such as `vehicle:car.7`, (n).
        sizes: Length, width and height, (n, 3) [m].
        alive: Who exists when, (n, t).
        fronts: Middles of front bumpers on the ground in SUMO's coordinates, (n, t, 3) [m].
        yaws: Counter-clockwise from east, (n, t) [rad].
        speeds: As drawn, (n, t) [m/s].
        logged: As the log says, (n, t) [m/s]; NaN where it says nothing.
        times: (t,) [s].
        ridden: Key of the one that the camera rides with; empty for none.
    """

    keys: Sequence[str]
    sizes: Floats
    alive: Bools
    fronts: Floats
    yaws: Floats
    speeds: Floats
    logged: Floats
    times: Floats
    ridden: str = ""

    def number(self, name: str) -> int | None:
        """Return the number of a road user by its id or key; None if there is none."""
        wanted = (name, *(f"{kind}:{name}" for kind in ("vehicle", "person", "container")))
        return next((k for k, key in enumerate(self.keys) if key in wanted), None)


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """A film's simulation, as far as it is read.

    Attributes:
        scenario: Of the film's times, and what smoothing needs around them.
        motion: Of everyone in it; what it has smoothed is kept.
        traffic: Everyone near the film's camera, at the frames' times.
    """

    scenario: Scenario
    motion: LogMotion
    traffic: Traffic


def simulated(stimulus: Stimulus, near: Floats, *, count: int) -> Simulated:
    """Read who drives where in a film, of all who come near some places, and the simulation.

    Args:
        stimulus: What the film shows.
        near: Where its camera is in SUMO's coordinates, and further places, (k, 2) [m].
        count: How many frames it has.
    """
    times = Pace.of(stimulus.job, stimulus.shot).times(stimulus.shot)[:count]
    _, scenario = read_files(stimulus.job, begin=float(times[0]), end=float(times[-1]))
    ridden = stimulus.job.cameras[stimulus.shot.camera].rides_with
    motion = motion_of(stimulus.job, scenario)
    traffic = traffic_at(motion, scenario, times, near=near, ridden=ridden)
    return Simulated(scenario, motion, traffic)


def traffic_at(
    motion: LogMotion, scenario: Scenario, times: Floats, *, near: Floats, ridden: str = ""
) -> Traffic:
    """Return who drives where at some times, of all who come near some places.

    Args:
        motion: Of everyone in the simulation.
        scenario: As read around these times.
        times: (t,) [s].
        near: In SUMO's coordinates, (k, 2) [m].
        ridden: Id of the one that the camera rides with; empty for none.
    """
    location = scenario.network.location
    inside = location.inside(near)
    logs = scenario.traffic.traces
    there = np.array([_is_near(each, inside) for each in logs], dtype=np.bool_)
    trajectories = motion.smooth(there)
    traces = [trace for trace, present in zip(logs, there.tolist(), strict=True) if present]
    types = scenario.vehicle_types
    kinds = [types.get(each.type_id, UNKNOWN_TYPES[each.kind]) for each in trajectories]
    motions = [each.sample(times) for each in trajectories]
    shape = (len(motions), len(times))
    known = Traffic(
        [each.key for each in trajectories],
        np.array([(kind.length, kind.width, kind.height) for kind in kinds]).reshape(-1, 3),
        np.array([motion.alive for motion in motions], dtype=np.bool_).reshape(shape),
        location.outside([motion.positions for motion in motions]).reshape(*shape, 3),
        np.array([motion.yaws for motion in motions]).reshape(shape),
        np.array([motion.speeds for motion in motions]).reshape(shape),
        np.array([np.interp(times, trace.times, trace.speeds) for trace in traces]).reshape(shape),
        times,
    )
    rider = known.number(ridden) if ridden else None
    return known if rider is None else replace(known, ridden=known.keys[rider])


def _is_near(trace: Trace, eyes: Floats) -> bool:
    """Return whether somebody is ever logged near the box in which the camera moves."""
    inside = trace.positions[:, :2] > eyes.min(axis=0) - _NEAR
    inside &= trace.positions[:, :2] < eyes.max(axis=0) + _NEAR
    return bool(inside.all(axis=1).any())


# Rows --------------------------------------------------------------------------------------


def traffic_rows(
    traffic: Traffic, cameras: Sequence[Mapping[str, Sequence[float]]]
) -> Iterator[Row]:
    """Yield a row for the ridden and the nearest road users of each frame.

    Args:
        traffic: Everyone.
        cameras: `position` and `forward` of each frame's camera.
    """
    for number, camera in enumerate(cameras):
        for role, k, away in _listed(traffic, number, np.array(camera["position"][:2])):
            yield {
                "frame": number,
                "time": round(float(traffic.times[number]), 6),
                "role": role,
                "road_user": traffic.keys[k],
                "distance": round(away, 3),
                **ahead_row(traffic, number, k),
            }


def _listed(traffic: Traffic, number: int, eye: Floats) -> list[tuple[str, int, float]]:
    """Return who is told of in a frame: role, number and distance of the camera's eye [m]."""
    alive = np.flatnonzero(traffic.alive[:, number])
    away = np.linalg.norm(traffic.fronts[alive, number, :2] - eye, axis=1)
    ranked = [(int(alive[k]), float(away[k])) for k in np.argsort(away, kind="stable").tolist()]
    ridden = [(k, d) for k, d in ranked if traffic.keys[k] == traffic.ridden]
    others = [(k, d) for k, d in ranked if traffic.keys[k] != traffic.ridden][:NEAREST]
    roles = [("ridden", *each) for each in ridden]
    return roles + [(f"nearest{place}", *each) for place, each in enumerate(others, start=1)]


def ahead_row(traffic: Traffic, number: int, k: int) -> Row:
    """Return a road user's speed, who is ahead of it, and how far; empty cells where nobody is.

    Args:
        traffic: Everyone.
        number: The time's.
        k: The road user's.
    """
    own = float(traffic.speeds[k, number])
    row: Row = {
        "speed": round(own, 3),
        "logged_speed": known(traffic.logged[k, number]),
        **dict.fromkeys(AHEAD, ""),
    }
    ahead = leader(traffic, number, k)
    if ahead is None:
        return row
    other, gap = ahead
    speed = float(traffic.speeds[other, number])
    turned = float(traffic.yaws[other, number] - traffic.yaws[k, number])
    closing = own - speed * float(np.cos(turned))
    row |= {"leader": traffic.keys[other], "gap": round(gap, 3), "leader_speed": round(speed, 3)}
    row["leader_logged_speed"] = known(traffic.logged[other, number])
    if own > STANDS:
        length = float(traffic.sizes[other, 0])
        row |= {"time_gap": round(gap / own, 3), "headway": round((gap + length) / own, 3)}
    if closing > STANDS:
        row["time_to_collision"] = round(max(gap, 0.0) / closing, 3)
    return row


AHEAD = (
    *("leader", "gap", "time_gap", "headway", "time_to_collision"),
    *("leader_speed", "leader_logged_speed"),
)
"""Cells about who is ahead."""


def known(value: float) -> float | str:
    """Return a number to a thousandth, or an empty cell where there is none."""
    return round(float(value), 3) + 0.0 if np.isfinite(value) else ""


# Who is ahead ------------------------------------------------------------------------------


def leader(traffic: Traffic, number: int, k: int) -> tuple[int, float] | None:
    """Return who is ahead of a road user in a frame, and the gap [m]; None where nobody is.

    Args:
        traffic: Everyone.
        number: The frame's.
        k: The road user's number.
    """
    along, across = _before(traffic, number, k)
    turned = np.cos(traffic.yaws[:, number] - traffic.yaws[k, number])
    reach = (traffic.sizes[k, 1] + traffic.sizes[:, 1]) / 2.0 + _SIDE
    inside = (across.min(axis=1) < reach) & (across.max(axis=1) > -reach)
    gaps = along.min(axis=1)
    fits = inside & traffic.alive[:, number] & (turned > _TOWARDS)
    fits &= (along.max(axis=1) > 0.0) & (gaps > -_OVERLAP) & (gaps < _AHEAD)
    fits[k] = False
    if not fits.any():
        return None
    ahead = np.flatnonzero(fits)
    nearest = int(ahead[np.argmin(gaps[ahead])])
    return nearest, float(gaps[nearest])


def _before(traffic: Traffic, number: int, k: int) -> tuple[Floats, Floats]:
    """Return how far all fronts and rears are ahead of a front, and left of it, (n, 2) [m] each."""
    yaws = traffic.yaws[:, number]
    directions = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    fronts = traffic.fronts[:, number, :2] - traffic.fronts[k, number, :2]
    ends = np.stack([fronts, fronts - directions * traffic.sizes[:, :1]], axis=1)
    forward = directions[k]
    return ends @ forward, ends @ np.array([-forward[1], forward[0]])


# Gaps that were asked for ------------------------------------------------------------------


def gap_rows(stimulus: Stimulus, traffic: Traffic) -> Iterator[Row]:
    """Yield what was kept of each gap that a scene file asks for, at its moment and in the film.

    Args:
        stimulus: What the film shows.
        traffic: Everyone, at the film's times.
    """
    edits = {} if stimulus.job.traffic is None else stimulus.job.traffic.rides
    for name, edit in edits.items():
        if edit.gap is None or edit.at is None or edit.behind is None:
            continue
        own, ahead = traffic.number(name), traffic.number(edit.behind)
        metres = seconds = np.empty(0)
        if own is not None and ahead is not None:
            metres, seconds = _gaps(traffic, own, ahead)
        yield {
            "follower": name,
            "leader": edit.behind,
            "moved": plain_id(mover_of(stimulus.job, name, edit)),
            "at": edit.at,
            "asked": edit.gap,
            "kept_at": _gap_at(stimulus.job, name, edit),
            **_spread("time_gap", seconds),
            **_spread("gap", metres),
        }


def _gaps(traffic: Traffic, own: int, ahead: int) -> tuple[Floats, Floats]:
    """Return gaps in all frames that show both, (f,) [m], and time gaps while one moves, [s]."""
    both = np.flatnonzero(traffic.alive[own] & traffic.alive[ahead]).tolist()
    metres = np.array([_before(traffic, n, own)[0][ahead].min() for n in both])
    speeds = traffic.speeds[own, both]
    moves = speeds > STANDS
    return metres, metres[moves] / speeds[moves]


def _gap_at(job: Job, name: str, edit: RideEdit) -> float | str:
    """Return the time gap at the moment for which it was asked [s]; empty if it never was."""
    assert edit.at is not None and edit.gap is not None
    _, scenario = read_files(job, begin=edit.at, end=edit.at + edit.gap)
    try:
        gap = kept_gap(job, scenario, name, edit)
    except ConfigError:  # the one behind is nowhere near then, which a note has said
        return ""
    return "" if gap is None else round(gap, 3)


def _spread(name: str, values: Floats) -> Row:
    """Return mean, least and largest of values; empty cells of none."""
    if not values.size:
        return dict.fromkeys((f"{name}_mean", f"{name}_min", f"{name}_max"), "")
    numbers = (values.mean(), values.min(), values.max())
    return {
        f"{name}_{word}": known(x) for word, x in zip(("mean", "min", "max"), numbers, strict=True)
    }


# One who is followed -----------------------------------------------------------------------


def follow(
    job: Job, name: str, *, begin: float | None = None, end: float | None = None
) -> list[Row]:
    """Return whom a road user follows, how far and how fast, over time.

    Args:
        job: The scene file.
        name: The road user's id, or its key.
        begin: First time [s]; None is its first.
        end: Last time [s]; None is its last.

    Raises:
        ConfigError: If there is none of that name, or it is not there then.
        InputError: If a file is missing or damaged.
    """
    files, scenario = read_files(job, begin=begin, end=end)
    motion = motion_of(job, scenario)
    which = motion.named(name)
    if not which.any():
        raise _not_there(files, name, motion.smooth())
    (own,) = motion.smooth(np.arange(len(which)) == np.argmax(which))
    times = _steps(own, scenario.traffic.step, begin, end)
    seen = own.sample(times)
    times = times[seen.alive]
    if not times.size:
        raise _not_there(files, name, (own,))
    near = scenario.network.location.outside(seen.positions[seen.alive, :2])
    traffic = traffic_at(motion, scenario, times, near=near, ridden=own.key)
    k = traffic.keys.index(own.key)
    return [
        {"time": round(float(time), 6), **ahead_row(traffic, n, k)} for n, time in enumerate(times)
    ]


def _not_there(files: ScenarioFiles, name: str, others: Sequence[Trajectory]) -> ConfigError:
    """Return an error about somebody who is not there in a window: when it is, or who else is."""
    from sumo3dviz_pt.sumo import whereabouts

    spans = whereabouts(files.trajectories, name).spans
    if not spans:
        find_trajectory(others, name)  # raises: it knows names that are alike
    lives = ", ".join(f"{begin:.12g} to {end:.12g} s" for begin, end in spans[:4])
    return ConfigError(f"{name!r} is not there then; the log has it from {lives}", key="--from")


def _steps(own: Trajectory, step: float, begin: float | None, end: float | None) -> Floats:
    """Return the log's steps in a ride's life within a window, (n,) [s]."""
    step = step if step > 0.0 else 1.0
    first, last = own.pieces[0].begin, own.pieces[-1].end
    first = first if begin is None else max(first, begin)
    last = last if end is None else min(last, end)
    if last < first:
        return np.empty(0)
    return np.asarray(first + step * np.arange(int((last - first) / step + 1e-6) + 1), dtype=float)


def write_follow(path: Path, rows: Sequence[Row]) -> None:
    """Write whom a road user follows as a table."""
    write_table(path, rows)


def follow_lines(rows: Sequence[Row]) -> list[str]:
    """Return whom a road user follows as people read it: a line for each time, after a head."""
    heads = {
        **{"time": "time [s]", "speed": "speed [m/s]", "logged_speed": "logged"},
        **{"leader": "behind", "gap": "gap [m]", "time_gap": "gap [s]", "headway": "headway [s]"},
        **{"time_to_collision": "to collision [s]", "leader_speed": "its speed [m/s]"},
        "leader_logged_speed": "logged",
    }
    cells = [[*heads.values()], *([_cell(row[name]) for name in heads] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(map(str.rjust, row, widths)).rstrip() for row in cells]


def _cell(value: str | int | float) -> str:
    """Return a cell; a dash where there is nothing."""
    if value == "":
        return "-"
    return f"{value:.2f}" if isinstance(value, float) else plain_id(str(value))
