"""Makes a simulation's motion continuous as the scene file asks, and keeps time gaps between rides.

A time gap is the time from the one ahead's rear at a place to the other's front there. To keep one,
a ride is moved in time. Where a camera rides with the one behind, its drive is the film's point of
view: then the one ahead moves.

References:
    SAE J2944, "Operational definitions of driving performance measures and statistics", 2015.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.surroundings import MOST_DELAY, RideEdit
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Scenario
from sumo3dviz_pt.model.trajectory import Trajectory

if TYPE_CHECKING:
    from sumo3dviz_pt.motion import LogMotion
    from sumo3dviz_pt.world.outlook import Outlook


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What the shots of a report share; it counts and does not render.

    Attributes:
        outlook: Of the cameras that share a place.
        motion: Of everyone in the log.
    """

    outlook: Outlook
    motion: LogMotion


def motion_of(job: Job, scenario: Scenario, survey: Survey | None = None) -> LogMotion:
    """Return what makes continuous motion of a simulation's log.

    Args:
        job: The scene file.
        scenario: As read, all or a window of it.
        survey: Has the motion of the whole log; what it has smoothed is taken from it.
    """
    from sumo3dviz_pt.motion import LogMotion

    motion = LogMotion.of(
        scenario.traffic,
        smoother=job.motion.smoother,
        network=scenario.network,
        types=scenario.vehicle_types,
        heading=job.motion.heading,
    )
    return motion if survey is None else motion.sharing(survey.motion)


_STEP = 0.05
"""Time between moments at which a passage is looked for [s]."""

_BESIDE = 2.5
"""How far a ride may pass beside the place where a gap begins [m]."""

_KINDS = ("vehicle:", "person:", "container:")


@dataclass(frozen=True, slots=True, eq=False)
class GapDelay:
    """What keeps a gap.

    Attributes:
        mover: Id of the ride that is moved in time.
        delay: By how much [s].
        words: What is kept then, for people, such as `, 0.80 s behind v2 at 5 s`.
    """

    mover: str
    delay: float
    words: str


def mover_of(job: Job, name: str, edit: RideEdit) -> str:
    """Return the id of the ride that a gap moves: the one ahead where a camera rides with this.

    Args:
        job: The scene file.
        name: Of the ride, as `traffic.rides` has it.
        edit: What is asked for it.
    """
    if edit.gap is None or edit.behind is None or edit.moves == "self":
        return name
    moved = edit.moves == "behind" or plain_id(name) in ridden_ids(job)
    return edit.behind if moved else name


def ridden_ids(job: Job) -> set[str]:
    """Return the ids of all with whom a camera of the scene rides, whichever one looks."""
    cameras = job.cameras.values()
    return {plain_id(each.rides_with) for each in cameras if each.rides_with}


def as_moved(change: str, jobs: Iterable[Job]) -> str:
    """Return what differs between scenes under the ride that it moves.

    A key such as `traffic.rides.car.7.gap` moves car.6 where a camera rides with car.7.

    Args:
        change: Begins with a dotted key.
        jobs: The scenes.
    """
    for job in jobs:
        for name, edit in ({} if job.traffic is None else job.traffic.rides).items():
            begin = f"traffic.rides.{name}"
            mover, rest = mover_of(job, name, edit), change.removeprefix(begin)
            own = edit.pace is not None and rest.startswith((".pace", ".around"))
            if mover != name and change.startswith((f"{begin}.", f"{begin}:")) and not own:
                return f"traffic.rides.{mover}{rest}"
    return change


def plain_id(name: str) -> str:
    """Return SUMO's id of a road user that is named by its id or by its key."""
    kind = next((kind for kind in _KINDS if name.startswith(kind)), "")
    return name.removeprefix(kind)


def delay_for(job: Job, scenario: Scenario, name: str, edit: RideEdit) -> GapDelay:
    """Return which ride is to come by how much later so that a gap is kept.

    Args:
        job: The scene file.
        scenario: As recorded around that time.
        name: Of the one behind.
        edit: The gap, and of whom.

    Raises:
        ConfigError: If one of them is not there, or does not come by.
    """
    assert edit.behind is not None and edit.gap is not None and edit.at is not None
    pair = _Pair.of(job, scenario, name, edit)
    mover, after = mover_of(job, name, edit), edit.at + edit.gap
    if mover == name:
        passes = _passing(pair.own, pair.place_ahead(edit.at), edit.at)
        who, where = name, f"the rear of {edit.behind} is at {edit.at:g} s"
    else:
        passes = _passing(pair.ahead, pair.own_place(after), edit.at, back=pair.length)
        who, where = f"the rear of {edit.behind}", f"{name} is at {after:.12g} s"
    if passes is None:
        message = f"{who} does not come by where {where}, within {MOST_DELAY:g} s"
        raise ConfigError(message, key=pair.key)
    moved_late = mover == name
    delay = (after if moved_late else edit.at) - passes
    recorded = edit.gap - delay if moved_late else edit.gap + delay
    rider = "" if moved_late else f", so that {name} keeps its drive"
    gap = f"{edit.gap:.2f} s behind {edit.behind} at {edit.at:g} s ({recorded:.2f} s in the log)"
    return GapDelay(mover, delay, f"{rider}, {gap}" if moved_late else f"{rider} and is {gap}")


def kept_gap(job: Job, scenario: Scenario, name: str, edit: RideEdit) -> float | None:
    """Return the time gap where the one ahead is `at` [s]; None where the other never passes.

    Args:
        job: The scene file.
        scenario: With changed traffic.
        name: Of the one behind.
        edit: The gap that was asked for.

    Raises:
        ConfigError: If one of them is not there.
    """
    assert edit.at is not None
    pair = _Pair.of(job, scenario, name, edit)
    passes = _passing(pair.own, pair.place_ahead(edit.at), edit.at)
    return None if passes is None else passes - edit.at


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Two rides, one behind the other.

    Attributes:
        names: Of the one behind and of the one ahead, as the scene file has them.
        own: Motion of the one behind.
        ahead: Motion of the one ahead.
        length: Of the one ahead [m].
    """

    names: tuple[str, str]
    own: Trajectory
    ahead: Trajectory
    length: float

    @classmethod
    def of(cls, job: Job, scenario: Scenario, name: str, edit: RideEdit) -> _Pair:
        """Return the rides that a gap is about.

        Raises:
            ConfigError: If one of them is not there.
        """
        assert edit.behind is not None
        motion = motion_of(job, scenario)
        pair = []
        for each in (name, edit.behind):
            numbers = np.flatnonzero(motion.named(each))
            if not numbers.size:
                raise ConfigError(
                    f"nobody near {edit.at:g} s is called {each!r}", key=f"traffic.rides.{name}"
                )
            pair.append(int(numbers[0]))
        own, ahead = (motion.smooth(np.arange(len(motion.ids)) == k)[0] for k in pair)
        trace = scenario.traffic.traces[pair[1]]
        kind = scenario.vehicle_types.get(trace.type_id, UNKNOWN_TYPES[trace.kind])
        return cls((name, edit.behind), own, ahead, kind.length)

    @property
    def key(self) -> str:
        """The key of the scene file that asks for the gap."""
        return f"traffic.rides.{self.names[0]}"

    def own_place(self, time: float) -> Floats:
        """Return where the front of the one behind is at a time [s], (2,) [m]."""
        return self._place(0, time)

    def place_ahead(self, time: float) -> Floats:
        """Return where the rear of the one ahead is at a time [s], (2,) [m]."""
        return self._place(1, time)

    def _place(self, which: int, time: float) -> Floats:
        """Return the front of the one behind, or the rear of the one ahead, (2,) [m]."""
        pose = (self.own, self.ahead)[which].at(time)
        if pose is None:
            message = f"{self.names[which]} is not on the road at {time:.12g} s"
            raise ConfigError(message, key=self.key)
        back = self.length if which else 0.0
        return pose.position[:2] - back * np.array([np.cos(pose.yaw), np.sin(pose.yaw)])


def _passing(ride: Trajectory, place: Floats, near: float, *, back: float = 0.0) -> float | None:
    """Return when a ride passes a place, the time that is nearest to another [s].

    Args:
        ride: Its motion.
        place: (2,) [m].
        near: [s].
        back: How far behind the front the point is that passes [m].
    """
    times = np.arange(near - MOST_DELAY, near + MOST_DELAY, _STEP)
    motion = ride.sample(times)
    forward = np.stack([np.cos(motion.yaws), np.sin(motion.yaws)], axis=1)
    towards = place - motion.positions[:, :2] + back * forward
    along = (towards * forward).sum(axis=1)
    away = np.linalg.norm(towards, axis=1)
    # It passes between two moments at which the place lies ahead and behind.
    here = np.flatnonzero(
        motion.alive[:-1] & motion.alive[1:] & (along[:-1] >= 0.0) & (along[1:] < 0.0)
        & (np.minimum(away[:-1], away[1:]) < _BESIDE)
    )  # fmt: skip
    if not here.size:
        return None
    shares = along[here] / (along[here] - along[here + 1])
    moments = times[here] + shares * (times[here + 1] - times[here])
    return float(moments[np.argmin(np.abs(moments - near))])
