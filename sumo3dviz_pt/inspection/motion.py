"""Measures the motion of a whole log, for `check --motion`.

It also finds road users that appear or vanish within the picture of a shot, where viewers notice
it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.cast.outfits import Air
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CameraSettings, Job
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import UNPLACED, Location, Network
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traffic import Scenario, Trace, TrafficLog
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Trajectory
from sumo3dviz_pt.motion import laws
from sumo3dviz_pt.motion.lanes import LaneGraph
from sumo3dviz_pt.motion.laws import LaneKeeping
from sumo3dviz_pt.motion.setting import body_length, is_euler
from sumo3dviz_pt.pipeline.production import life_of, read
from sumo3dviz_pt.report.motion import (
    WORST,
    Extreme,
    MotionFinding,
    MotionReport,
    PopUps,
    UserGroup,
    in_words,
)
from sumo3dviz_pt.shot.cameras.aiming import Camera, build_camera
from sumo3dviz_pt.world.build import season_of

_BESIDE = 3.0
"""A body whose front is this far beside the picture can still reach into it [m]."""

_FARTHEST = 1000.0
"""Beyond this distance nobody notices: a car is only a few pixels high [m]."""


def pop_ups(
    job: Job,
    scenario: Scenario,
    trajectories: Sequence[Trajectory],
    *,
    births: Sequence[MotionFinding],
    deaths: Sequence[MotionFinding],
) -> tuple[PopUps, ...]:
    """Return the road users that appear or vanish in the pictures of a job's shots.

    If the job has no shots, each of its cameras is one. What stands between the eye and a road
    user is not considered.

    Args:
        job: The scene file.
        scenario: The simulation.
        trajectories: Its smoothed motion.
        births: Where and when road users appear in the log.
        deaths: Where and when they vanish from it.

    Raises:
        ConfigError: If a camera rides with an unknown road user.
    """
    shots = [(shot.camera, shot.start, shot.end) for shot in job.shots]
    if not shots:
        lives = tuple(trajectories)
        shots = [(name, *life_of(camera, lives)) for name, camera in job.cameras.items()]
    aspect = job.output.size[1] / job.output.size[0]
    location = scenario.network.location
    rows = []
    for name, start, end in shots:
        camera = _camera(job.cameras[name], job, scenario, trajectories)
        seen = [
            tuple(_seen(camera, _between(events, start, end), location, aspect=aspect))
            for events in (births, deaths)
        ]
        nearest = [tuple(sorted(some, key=lambda each: each.value)) for some in seen]
        rows.append(PopUps(name, start, end, *nearest))
    return tuple(rows)


def _between(events: Sequence[MotionFinding], start: float, end: float) -> list[MotionFinding]:
    """Return the events within a time [s]."""
    return [event for event in events if start < event.time < end]


def _camera(
    settings: CameraSettings, job: Job, scenario: Scenario, trajectories: Sequence[Trajectory]
) -> Camera:
    """Build a camera with no body but that of the road user it rides with."""
    riders: tuple[Trajectory, ...] = ()
    if settings.rides_with:
        riders = tuple(t for t in trajectories if settings.rides_with in (t.id, t.key))
    air = Air.in_season(season_of(job))
    fleet = build_fleet(riders, scenario.vehicle_types, job.vehicles, seed=job.seed, air=air)
    fleet = replace(fleet, location=scenario.network.location)
    return build_camera(settings, fleet=fleet, left_hand=scenario.network.left_hand)


def _seen(
    camera: Camera, events: Sequence[MotionFinding], location: Location, *, aspect: float
) -> Iterator[MotionFinding]:
    """Yield the events that lie in the picture; their value is the distance from the eye [m]."""
    for event in events:
        try:
            view = camera.view_at(event.time)
        except ConfigError:
            # The camera's own vehicle is not there then, so there is no picture.
            continue
        place = location.inside([event.x, event.y, event.z])
        distance = _distance(view, place, aspect=aspect)
        if distance is not None:
            yield replace(event, value=distance)


def _distance(view: View, place: Floats, *, aspect: float) -> float | None:
    """Return the distance from the eye to a place [m]; None if it is outside the picture."""
    place = place - view.position
    local = place @ view.world_from_camera.matrix[:3, :3]
    inside = bool(view.lens.sees(local, aspect, margin=_BESIDE))
    distance = float(np.linalg.norm(place))
    return distance if inside and distance < _FARTHEST else None


_JUMP = "jump beyond the logged speed"
_STRAY = "farther from the lane's centre than logged"
_STRAY_STEP = 0.2
"""Time between places that are compared with their lanes, which takes long [s]."""
_UNITS: Mapping[str, str] = {
    "acceleration": "m/s2",
    "sideways acceleration": "m/s2",
    "jerk": "m/s3",
    "heading rate": "deg/s",
    "sideways speed of the rear axle": "m/s",
    _JUMP: "m",
    _STRAY: "m",
}
"""Measures and their units."""

_BINS: Floats = np.geomspace(1e-4, 1e6, 1001)
"""Borders of the bins in which sizes are counted; each bin is 2.3 % wide."""


@dataclass(slots=True)
class _MeasureTally:
    """Collects one measure over all road users without keeping every frame.

    Attributes:
        counts: Number of sizes in each bin, (bins + 1,).
        worst: The largest value of each road user.
    """

    counts: Ints = field(default_factory=lambda: np.zeros(len(_BINS) + 1, dtype=np.int64))
    worst: list[MotionFinding] = field(default_factory=list)

    def add(self, values: Floats) -> None:
        """Count the sizes of values, (n,); NaN does not count."""
        sizes = np.abs(values[np.isfinite(values)])
        self.counts += np.bincount(np.searchsorted(_BINS, sizes), minlength=len(_BINS) + 1)

    def p99(self) -> float:
        """Return the size that 99 % stay below, to 2 %; NaN if nothing was counted."""
        total = int(self.counts.sum())
        if not total:
            return float("nan")
        place = int(np.searchsorted(np.cumsum(self.counts), 0.99 * total))
        return float(_BINS[min(place, len(_BINS) - 1)]) if place else 0.0

    def extreme(self, name: str) -> Extreme:
        """Return the result, with the worst road users only."""
        worst = sorted(self.worst, key=lambda each: -abs(each.value))[:WORST]
        return Extreme(name, _UNITS[name], self.p99(), tuple(worst))


@dataclass(slots=True)
class _KindCensus:
    """What was measured of one kind of road users.

    Attributes:
        users: Number of road users.
        seconds: Time for which all of them are shown together [s].
        jumps: Frames that move further than the logged speed explains.
        broken: Frames with a value that is not a number.
        tallies: Measures by name.
    """

    users: int = 0
    seconds: float = 0.0
    jumps: int = 0
    broken: int = 0
    tallies: dict[str, _MeasureTally] = field(
        default_factory=lambda: {name: _MeasureTally() for name in _UNITS}
    )

    def group(self, kind: str) -> UserGroup:
        """Return the result."""
        extremes = tuple(tally.extreme(name) for name, tally in self.tallies.items())
        return UserGroup(kind, self.users, self.seconds, extremes, self.jumps, self.broken)


@dataclass(frozen=True, slots=True, eq=False)
class User:
    """A road user as logged and as shown.

    Attributes:
        trace: The samples.
        trajectory: The motion.
        length: Length of the body [m].
        lane_names: Lane ids; the lane numbers of samples index them.
        location: From where places are counted; what is found is told in SUMO's coordinates.
    """

    trace: Trace
    trajectory: Trajectory
    length: float
    lane_names: Sequence[str]
    location: Location = UNPLACED

    def finding(
        self, kind: str, time: float, value: float, *, end: float | None = None
    ) -> MotionFinding:
        """Return a finding about it, at the position of the sample nearest in time.

        Args:
            kind: What was found.
            time: When it begins or is worst [s].
            value: How large it is; the unit depends on the kind.
            end: When it ends [s]; None for a moment.
        """
        trace = self.trace
        nearest = int(np.argmin(np.abs(trace.times - time)))
        lane = int(trace.lanes[nearest])
        place = self.location.outside(trace.positions[nearest])
        return MotionFinding(
            id=self.trajectory.id,
            kind=kind,
            time=float(time),
            value=float(value),
            lane=self.lane_names[lane] if lane >= 0 else "",
            **dict(zip("xyz", place.tolist(), strict=True)),
            end=float(time if end is None else end),
        )

    def speeds_around(self, times: Floats) -> Floats:
        """Return the larger speed of the samples around times, (n,) [m/s].

        Where no speed is logged, the distance between the samples gives it.
        """
        trace = self.trace
        if len(trace.times) < 2:
            return np.zeros(len(times))
        lengths = np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1)
        logged = np.fmax(trace.speeds[:-1], trace.speeds[1:])
        logged = np.where(np.isfinite(logged), logged, lengths / np.diff(trace.times))
        place = np.searchsorted(trace.times, times, side="right") - 1
        return np.asarray(logged[np.clip(place, 0, len(logged) - 1)])


def check_motion(job: Job) -> MotionReport:
    """Smooth a whole log as the scene file says, and measure the motion.

    Raises:
        ConfigError: If a setting is wrong.
        InputError: If a file is wrong.
    """
    _, scenario, trajectories = read(job)
    log = scenario.traffic
    users = users_of(scenario, trajectories)
    births, deaths = _ends(log, users)
    return MotionReport(
        smoother=job.motion.smoother,
        fps=float(job.output.fps),
        begin=log.begin,
        end=log.end,
        step=log.step,
        groups=_groups(users, scenario.network, step=1.0 / float(job.output.fps)),
        births=len(births),
        deaths=len(deaths),
        pop_ups=pop_ups(job, scenario, trajectories, births=births, deaths=deaths),
        speeds=_speeds(log),
        remarks=tuple(_remarks(users)),
    )


def motion_report(job: Job, *, as_json: bool = False) -> str:
    """Return what `check_motion` finds, in words or as JSON."""
    report = check_motion(job)
    return json.dumps(report.as_dict(), indent=1) if as_json else in_words(report)


def users_of(scenario: Scenario, trajectories: Sequence[Trajectory]) -> list[User]:
    """Return all road users in the log's order."""
    names, types = scenario.traffic.lane_names, scenario.vehicle_types
    location = scenario.network.location
    return [
        User(trace, trajectory, body_length(trace, types), names, location)
        for trace, trajectory in zip(scenario.traffic.traces, trajectories, strict=True)
    ]


def frame_grid(piece: MotionPiece, *, step: float) -> Floats:
    """Return the times of a piece's frames, counted from its begin, (n,) [s]."""
    count = int((piece.end - piece.begin) / step + 1e-6) + 1
    return np.asarray(np.minimum(piece.begin + step * np.arange(count), piece.end))


def _groups(users: Sequence[User], network: Network, *, step: float) -> tuple[UserGroup, ...]:
    """Measure all road users; `step` is the time between frames [s]."""
    kinds: dict[str, _KindCensus] = {}
    keeping = LaneKeeping(LaneGraph(network), users[0].lane_names) if users else None
    for number, user in enumerate(users):
        announce(Doing.MEASURE, number, len(users))
        census = kinds.setdefault(user.trajectory.kind, _KindCensus())
        # People do not keep to the centres of lanes.
        drives = user.trajectory.kind == "vehicle"
        _count(census, user, keeping if drives else None, step=step)
    return tuple(kinds[kind].group(kind) for kind in sorted(kinds, reverse=True))


def _count(census: _KindCensus, user: User, keeping: LaneKeeping | None, *, step: float) -> None:
    """Measure one road user and add the result.

    Args:
        census: What was measured of its kind; it changes.
        user: The road user.
        keeping: The lanes; None if it does not keep to lanes.
        step: Time between frames [s].
    """
    peaks: dict[str, laws.Peak] = {}
    census.users += 1
    for piece in user.trajectory.pieces:
        times = frame_grid(piece, step=step)
        census.seconds += piece.end - piece.begin
        motion = piece.sample(times)
        curves = _curves(census, user, motion, times, step=step)
        if keeping is not None:
            curves[_STRAY] = _strays(user, keeping, motion, times, step=step)
        for name, values in curves.items():
            census.tallies[name].add(values)
            highest = laws.largest(values, times)
            old = [peaks[name]] if name in peaks else []
            if highest:
                peaks[name] = max(*old, *highest, key=_size) if old else highest[0]
    for name, peak in peaks.items():
        if name not in (_JUMP, _STRAY) or peak.value > 0.0:
            census.tallies[name].worst.append(user.finding(name, peak.time, peak.value))


def _size(peak: laws.Peak) -> float:
    return abs(peak.value)


def _curves(
    census: _KindCensus, user: User, motion: Motion, times: Floats, *, step: float
) -> dict[str, Floats]:
    """Return measures of a piece by name, (n,) each.

    Args:
        census: What was measured of its kind; broken frames and jumps are added.
        user: The road user.
        motion: Its motion at the times.
        times: Times of frames, (n,) [s].
        step: Time between frames [s].
    """
    finite = np.isfinite(motion.positions).all(axis=1) & np.isfinite(motion.yaws)
    census.broken += int((~finite).sum())
    known = laws.measure(motion, step=step, length=user.length)
    # A move into a parking place is no jump: the log does not say how a car gets there.
    parking = [remark for remark in user.trajectory.remarks if remark.kind == "parking"]
    aside = np.zeros(len(times), dtype=np.bool_)
    for remark in parking:
        aside |= (times >= remark.begin - step) & (times <= remark.end)
    beyond = laws.excess(known.jumps, user.speeds_around(times), step=step)
    beyond = np.where(aside, np.nan, np.maximum(beyond, 0.0))
    census.jumps += int((beyond > 0.0).sum())
    return {
        "acceleration": known.accelerations,
        "sideways acceleration": known.sideways,
        "jerk": known.jerks,
        "heading rate": np.degrees(known.heading_rates),
        "sideways speed of the rear axle": known.crabs,
        _JUMP: beyond,
    }


def _strays(
    user: User, keeping: LaneKeeping, motion: Motion, times: Floats, *, step: float
) -> Floats:
    """Return how much farther from the lane's centre it is than logged, (n,) [m].

    As this takes long, most times are left out; they are NaN.
    """
    every = max(1, round(_STRAY_STEP / step))
    strays = np.full(len(times), np.nan)
    places = motion.positions[::every, :2]
    strays[::every] = keeping.strays(user.trace, user.trajectory, times[::every], places)
    return strays


def _ends(
    log: TrafficLog, users: Sequence[User]
) -> tuple[list[MotionFinding], list[MotionFinding]]:
    """Return all births and deaths within the log, those at gaps and teleports included."""
    births, deaths = [], []
    margin = 0.5 * log.step
    for user in users:
        for piece in user.trajectory.pieces:
            if piece.begin > log.begin + margin:
                births.append(user.finding("birth", piece.begin, 0.0))
            if piece.end < log.end - margin:
                deaths.append(user.finding("death", piece.end, 0.0))
    return births, deaths


def _speeds(log: TrafficLog) -> str:
    """Return what the log's speeds mean, as a key of the report's `SPEEDS`."""
    if not any(np.isfinite(trace.speeds).any() for trace in log.traces):
        return "none"
    verdict = is_euler(log.traces)
    return "unknown" if verdict is None else "last step" if verdict else "instant"


def _remarks(users: Sequence[User]) -> Iterator[MotionFinding]:
    """Yield everything that was noticed while smoothing."""
    for user in users:
        for remark in user.trajectory.remarks:
            yield user.finding(remark.kind, remark.begin, remark.value, end=remark.end)
