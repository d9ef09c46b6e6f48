"""Continuous motion, as the smoothers make it of a trace, and where wheels have passed.

`DrivenWays` holds what the log says of tracks in snow, and of vehicles that left none.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Bools, Floats, frozen


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Sampled motion at n times.

    Attributes:
        alive: Where the road user exists, (n,).
        positions: Front bumper's middle on the ground, (n, 3) [m]; NaN where not alive.
        yaws: Counter-clockwise from east, (n,) [rad]; NaN where not alive.
        pitches: Nose up, (n,) [rad]; NaN where not alive.
        speeds: Along the path, (n,) [m/s]; NaN where not alive.
        travelled: Distance that the front drove in its piece, (n,) [m]; NaN where not alive.
    """

    alive: Bools
    positions: Floats
    yaws: Floats
    pitches: Floats
    speeds: Floats
    travelled: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where a road user is at one time.

    Attributes:
        position: Front bumper's middle on the ground, (3,) [m].
        yaw: Counter-clockwise from east [rad].
        pitch: Nose up [rad].
        speed: [m/s].
    """

    position: Floats
    yaw: float
    pitch: float
    speed: float


class MotionPiece(Protocol):
    """One unbroken stretch of motion; made by a smoother."""

    @property
    def begin(self) -> float:
        """First time at which the road user exists [s]."""

    @property
    def end(self) -> float:
        """Last time at which it exists [s]."""

    def sample(self, times: Floats) -> Motion:
        """Motion at times within [begin, end], (n,) [s]; all alive."""

    def trail(self, times: Floats, distances: Floats) -> Floats:
        """Return points of the path behind the front.

        Args:
            times: Within [begin, end], (n,) [s].
            distances: Behind the front along the path that it drove, (k,) [m], >= 0.

        Returns:
            Points on the ground, (n, k, 3) [m]; further back than the log tells they lie
            straight behind.
        """


@dataclass(frozen=True, slots=True)
class Remark:
    """Something in a log that could not be shown as it is, or that a user should know.

    Attributes:
        kind: `gap`, `teleport`, `no lanes`, `no route`, `off lane`, `parking`, `reversing`,
            `lane change`, `steep` or `unlike the log`.
        begin: [s].
        end: [s].
        value: How large: seconds for a gap, metres or radians else.
    """

    kind: str
    begin: float
    end: float
    value: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """The smoothed motion of one road user.

    Attributes:
        id: SUMO's id.
        kind: `vehicle`, `person` or `container`.
        type_id: Its vType, may be empty.
        pieces: In time order, disjoint; gaps and teleports lie between them.
        remarks: What was noticed in its log, in time order.
    """

    id: str
    kind: str
    type_id: str
    pieces: tuple[MotionPiece, ...]
    remarks: tuple[Remark, ...] = ()

    @property
    def key(self) -> str:
        """Unique among road users: a person may share a vehicle's id."""
        return f"{self.kind}:{self.id}"

    def sample(self, times: Floats) -> Motion:
        """Motion at any times, (n,) [s]; not alive outside its pieces."""
        times = np.asarray(times, dtype=np.float64)
        motion = Motion(
            np.zeros(times.shape, dtype=np.bool_),
            np.full((*times.shape, 3), np.nan),
            *(np.full(times.shape, np.nan) for _ in range(4)),
        )
        for piece in self.pieces:
            inside = (times >= piece.begin - 1e-9) & (times <= piece.end + 1e-9)
            if not inside.any():
                continue
            part = piece.sample(np.clip(times[inside], piece.begin, piece.end))
            motion.alive[inside] = True
            for name in ("positions", "yaws", "pitches", "speeds", "travelled"):
                getattr(motion, name)[inside] = getattr(part, name)
        return motion

    def at(self, time: float) -> Pose | None:
        """Return the pose at a time [s], or None outside its life."""
        motion = self.sample(np.array([time]))
        if not motion.alive[0]:
            return None
        return Pose(
            motion.positions[0],
            float(motion.yaws[0]),
            float(motion.pitches[0]),
            float(motion.speeds[0]),
        )


_STILL = 0.5
"""Who never comes farther than this from where it was first stands [m]."""

_LONG = 60.0
"""Who stands for less time than this may only wait [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class TyreTracks:
    """Paths of wheels on the ground.

    Attributes:
        begins: Where a straight piece begins, (n, 2) [m].
        ends: Where it ends, (n, 2) [m].
    """

    begins: Floats
    ends: Floats

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("begins", "ends"):
            object.__setattr__(self, name, frozen(getattr(self, name)).reshape(-1, 2))
        if len(self.begins) != len(self.ends):
            raise ValueError(f"{len(self.begins)} begins for {len(self.ends)} ends of tracks")


@dataclass(frozen=True, slots=True, eq=False)
class DrivenWay:
    """Where one vehicle was over the whole log, as logged.

    Attributes:
        key: Unique among road users of the log.
        vclass: SUMO's vClass.
        width: Of its type [m].
        times: Ascending, (n,) [s].
        places: Of the middle of its front, (n, 2) [m].
        yaws: (n,) [rad].
        speeds: (n,) [m/s]; NaN where the log has none.
    """

    key: str
    vclass: str
    width: float
    times: Floats
    places: Floats
    yaws: Floats
    speeds: Floats

    @property
    def stands(self) -> bool:
        """Whether it is parked: it never moves, and for longer than one waits."""
        away = np.abs(self.places - self.places[0]).max()
        return bool(away < _STILL and self.times[-1] - self.times[0] >= _LONG)


@dataclass(frozen=True, slots=True, eq=False)
class DrivenWays:
    """Where all vehicles of a log were.

    Attributes:
        step: Median time between steps of the log [s].
        ways: Of each vehicle.
    """

    step: float
    ways: tuple[DrivenWay, ...] = ()

    @property
    def parked(self) -> frozenset[str]:
        """Keys of those that stand all the time."""
        return frozenset(way.key for way in self.ways if way.stands)


def find_trajectory(trajectories: Sequence[Trajectory], name: str) -> Trajectory:
    """Return a trajectory by SUMO's id, or by its key.

    Raises:
        ConfigError: If there is none of that name; the message names some.
    """
    known = {trajectory.key: trajectory for trajectory in trajectories}
    for key in (f"vehicle:{name}", f"person:{name}", f"container:{name}", name):
        if key in known:
            return known[key]
    raise ConfigError(f"no vehicle or person is called {name!r}{_suggested(name, trajectories)}")


def _suggested(name: str, trajectories: Sequence[Trajectory]) -> str:
    """End of a sentence that names near ids and some that exist."""
    ids = list(dict.fromkeys(trajectory.id for trajectory in trajectories))
    if not ids:
        return "; there is nobody in this time window"
    near = difflib.get_close_matches(name, ids, n=3, cutoff=0.6)
    some = [each for each in ids if each not in near][:3]
    meant = f"; did you mean {', '.join(map(repr, near))}?" if near else ""
    return f"{meant}; for example {', '.join(map(repr, some))} exist" if some else meant
