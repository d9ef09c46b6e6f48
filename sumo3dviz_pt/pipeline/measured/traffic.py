"""How far road users are behind those ahead of them: gaps, headways, times to collision.

Who is ahead is asked of bodies and not of lanes: the nearest road user whose body reaches into the
corridor straight ahead, half a metre wider than the own body on each side, and that does not come
towards it. On a bend the corridor leaves the road, so that far gaps are missing there.

* gap: from the own front to the other's rear, along the own heading [m];
* time gap: gap / own speed; headway: (gap + the other's length) / own speed, from front to front;
* time to collision: gap / (own speed - the other's speed along it), while the gap closes.

References:
    Hayward, "Near-miss determination through use of a scale of danger", Highway Research Record
    384, 1972 (time to collision); SAE J2944, 2015 (gap and headway).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.job.settings import LagrangianCamera
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Trace
from sumo3dviz_pt.pipeline.films.pace import Pace
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus

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

_STANDS = 0.1
"""Slower than this somebody stands, and times to where others are have no meaning [m/s]."""

Row = dict[str, str | int | float]


@dataclass(frozen=True, slots=True, eq=False)
class Traffic:
    """Everyone at the times of a film's frames.

    Attributes:
        keys: Such as `vehicle:car.7`, (n).
        sizes: Length and width, (n, 2) [m].
        alive: Who exists when, (n, t).
        fronts: Middles of front bumpers in SUMO's coordinates, (n, t, 2) [m].
        yaws: Counter-clockwise from east, (n, t) [rad].
        speeds: (n, t) [m/s].
        times: (t,) [s].
        ridden: Key of the one that the camera rides with; empty for none.
    """

    keys: Sequence[str]
    sizes: Floats
    alive: Bools
    fronts: Floats
    yaws: Floats
    speeds: Floats
    times: Floats
    ridden: str = ""


def traffic_of(stimulus: Stimulus, eyes: Floats) -> Traffic:
    """Read who drives where in a film, of all who come near its camera.

    Args:
        stimulus: What the film shows.
        eyes: Where its camera is in SUMO's coordinates, frame by frame, (t, 2) [m].
    """
    times = Pace.of(stimulus.job, stimulus.shot).times(stimulus.shot)[: len(eyes)]
    _, scenario = read_files(stimulus.job, begin=float(times[0]), end=float(times[-1]))
    location = scenario.network.location
    inside = location.inside(eyes)
    near = np.array([_is_near(each, inside) for each in scenario.traffic.traces], dtype=np.bool_)
    trajectories = motion_of(stimulus.job, scenario).smooth(near)
    types = scenario.vehicle_types
    kinds = [types.get(each.type_id, UNKNOWN_TYPES[each.kind]) for each in trajectories]
    motions = [each.sample(times) for each in trajectories]
    camera = stimulus.job.cameras[stimulus.shot.camera]
    ridden = camera.vehicle if isinstance(camera, LagrangianCamera) else ""
    keys = [each.key for each in trajectories]
    shape = (len(keys), len(times))
    return Traffic(
        keys,
        np.array([(kind.length, kind.width) for kind in kinds]).reshape(-1, 2),
        np.array([motion.alive for motion in motions], dtype=np.bool_).reshape(shape),
        location.outside([motion.positions[:, :2] for motion in motions]).reshape(*shape, 2),
        np.array([motion.yaws for motion in motions]).reshape(shape),
        np.array([motion.speeds for motion in motions]).reshape(shape),
        times,
        next((key for key in keys if ridden and ridden in (key, key.partition(":")[2])), ""),
    )


def _is_near(trace: Trace, eyes: Floats) -> bool:
    """Return whether somebody is ever logged near the box in which the camera moves."""
    inside = trace.positions[:, :2] > eyes.min(axis=0) - _NEAR
    inside &= trace.positions[:, :2] < eyes.max(axis=0) + _NEAR
    return bool(inside.all(axis=1).any())


def traffic_rows(
    traffic: Traffic, cameras: Sequence[Mapping[str, Sequence[float]]]
) -> Iterator[Row]:
    """Yield a row for the ridden and the nearest road users of each frame.

    Args:
        traffic: Everyone.
        cameras: `position` and `forward` of each frame's camera.
    """
    for number, camera in enumerate(cameras):
        for role, k, away in _told(traffic, number, np.array(camera["position"][:2])):
            yield {
                "frame": number,
                "time": round(float(traffic.times[number]), 6),
                "role": role,
                "road_user": traffic.keys[k],
                "distance": round(away, 3),
                "speed": round(float(traffic.speeds[k, number]), 3),
                **_ahead_row(traffic, number, k),
            }


def _told(traffic: Traffic, number: int, eye: Floats) -> list[tuple[str, int, float]]:
    """Return who is told of in a frame: role, number and distance of the camera's eye [m]."""
    alive = np.flatnonzero(traffic.alive[:, number])
    away = np.linalg.norm(traffic.fronts[alive, number] - eye, axis=1)
    ranked = [(int(alive[k]), float(away[k])) for k in np.argsort(away, kind="stable").tolist()]
    ridden = [(k, d) for k, d in ranked if traffic.keys[k] == traffic.ridden]
    others = [(k, d) for k, d in ranked if traffic.keys[k] != traffic.ridden][:NEAREST]
    roles = [("ridden", *each) for each in ridden]
    return roles + [(f"nearest{place}", *each) for place, each in enumerate(others, start=1)]


def _ahead_row(traffic: Traffic, number: int, k: int) -> Row:
    """Return who is ahead of a road user in a frame, and how far; empty where nobody is."""
    row: Row = dict.fromkeys(("leader", "gap", "time_gap", "headway", "time_to_collision"), "")
    found = leader(traffic, number, k)
    if found is None:
        return row
    other, gap = found
    own = float(traffic.speeds[k, number])
    turned = float(traffic.yaws[other, number] - traffic.yaws[k, number])
    closing = own - float(traffic.speeds[other, number]) * float(np.cos(turned))
    row |= {"leader": traffic.keys[other], "gap": round(gap, 3)}
    if own > _STANDS:
        length = float(traffic.sizes[other, 0])
        row |= {"time_gap": round(gap / own, 3), "headway": round((gap + length) / own, 3)}
    if closing > _STANDS:
        row["time_to_collision"] = round(max(gap, 0.0) / closing, 3)
    return row


def leader(traffic: Traffic, number: int, k: int) -> tuple[int, float] | None:
    """Return who is ahead of a road user in a frame, and the gap [m]; None where nobody is.

    Args:
        traffic: Everyone.
        number: The frame's.
        k: The road user's number.
    """
    yaw = traffic.yaws[k, number]
    forward = np.array([np.cos(yaw), np.sin(yaw)])
    left = np.array([-forward[1], forward[0]])
    directions = np.stack(
        [np.cos(traffic.yaws[:, number]), np.sin(traffic.yaws[:, number])], axis=1
    )
    fronts = traffic.fronts[:, number] - traffic.fronts[k, number]
    rears = fronts - directions * traffic.sizes[:, :1]
    ends = np.stack([fronts, rears], axis=1)
    along, across = ends @ forward, ends @ left
    reach = (traffic.sizes[k, 1] + traffic.sizes[:, 1]) / 2.0 + _SIDE
    inside = (across.min(axis=1) < reach) & (across.max(axis=1) > -reach)
    gaps = along.min(axis=1)
    fits = inside & traffic.alive[:, number] & (directions @ forward > _TOWARDS)
    fits &= (along.max(axis=1) > 0.0) & (gaps > -_OVERLAP) & (gaps < _AHEAD)
    fits[k] = False
    if not fits.any():
        return None
    found = np.flatnonzero(fits)
    nearest = int(found[np.argmin(gaps[found])])
    return nearest, float(gaps[nearest])
