"""Where wheels have passed: what the log says of tracks in snow, and who left none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, frozen

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
