"""How far shown motion is from the truth, and how it feels; plain NumPy, no simulator.

Positions are fronts on the ground, (n, 2) [m]; yaws are counter-clockwise from east,
unwrapped, (n,) [rad]; frames are evenly spaced. Values of single frames are pooled over
vehicles and then become percentiles, so that long drives count more than short ones.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints

REAR_AXLE = 0.78
"""Of the length, behind the front."""

SPIKE = 30.0
"""An acceleration that no vehicle has [m/s2]."""

MOVING = 5.0
"""Lane changes are judged above this speed [m/s]."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Motion at evenly spaced times.

    Attributes:
        times: (n,) [s].
        positions: (n, 2) [m].
        yaws: (n,) [rad].
        speeds: (n,) [m/s].
    """

    times: Floats
    positions: Floats
    yaws: Floats
    speeds: Floats

    @property
    def step(self) -> float:
        """Between frames [s]."""
        return float(self.times[-1] - self.times[0]) / max(len(self.times) - 1, 1)

    def part(self, chosen: Bools | Ints) -> Frames:
        """Some of the frames."""
        return Frames(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))


def errors(shown: Frames, true: Frames) -> dict[str, Floats]:
    """Absolute errors of frames, each (n,): m, degrees and m/s."""
    off = shown.positions - true.positions
    ahead = np.column_stack([np.cos(true.yaws), np.sin(true.yaws)])
    turned = np.degrees(shown.yaws - true.yaws)
    return {
        "distance": np.linalg.norm(off, axis=1),
        "along": np.abs((off * ahead).sum(axis=1)),
        "lateral": np.abs(off[:, 1] * ahead[:, 0] - off[:, 0] * ahead[:, 1]),
        "heading": np.abs((turned + 180.0) % 360.0 - 180.0),
        "speed": np.abs(shown.speeds - true.speeds),
    }


def feel(frames: Frames, *, length: float) -> dict[str, Floats]:
    """What passengers and viewers feel, by frame, each (n,); NaN at the ends.

    Args:
        frames: n frames.
        length: Of the vehicle [m].

    Returns:
        `acceleration` and its part across the motion, `across` [m/s2], `jerk` [m/s3],
        `yaw_rate` [deg/s] and `crab`, the speed at which the rear axle slides sideways [m/s].
    """
    step, count = frames.step, len(frames.times)
    found = {name: np.full(count, np.nan) for name in
             ("acceleration", "across", "jerk", "yaw_rate", "crab")}  # fmt: skip
    if count < 4:
        return found
    rates = np.diff(frames.positions, axis=0) / step
    pull = np.diff(rates, axis=0) / step
    going = (rates[1:] + rates[:-1]) / 2.0
    pace = np.linalg.norm(going, axis=1)
    found["acceleration"][1:-1] = np.linalg.norm(pull, axis=1)
    turned = np.abs(pull[:, 0] * going[:, 1] - pull[:, 1] * going[:, 0])
    found["across"][1:-1] = turned / np.maximum(pace, 1e-6)
    found["jerk"][1:-2] = np.linalg.norm(np.diff(pull, axis=0), axis=1) / step
    found["yaw_rate"][1:] = np.degrees(np.abs(np.diff(frames.yaws))) / step
    ahead = np.column_stack([np.cos(frames.yaws), np.sin(frames.yaws)])
    axle = np.diff(frames.positions - REAR_AXLE * length * ahead, axis=0) / step
    middle = (ahead[1:] + ahead[:-1]) / 2.0
    found["crab"][1:] = np.abs(axle[:, 1] * middle[:, 0] - axle[:, 0] * middle[:, 1])
    return found


def excess(frames: Frames, *, times: Floats, speeds: Floats) -> Floats:
    """By how much steps between frames exceed 1.5 x logged speed x step + 2 cm, (n - 1,) [m].

    Args:
        frames: n frames.
        times: Of the log's rows, (k,) [s].
        speeds: Logged there, (k,) [m/s]; the larger of the two around a frame counts.
    """
    later = np.clip(np.searchsorted(times, frames.times[1:] - 1e-9), 1, len(times) - 1)
    earlier = np.clip(np.searchsorted(times, frames.times[:-1] + 1e-9) - 1, 0, len(times) - 2)
    logged = np.maximum(np.maximum(speeds[later], speeds[later - 1]), speeds[earlier])
    steps = np.linalg.norm(np.diff(frames.positions, axis=0), axis=1)
    over: Floats = steps - 1.5 * logged * np.diff(frames.times) - 0.02
    return over


def near(times: Floats, events: Floats, within: float) -> Bools:
    """Which times, (n,), lie within some seconds of one of the events, (k,)."""
    if not len(events):
        return np.zeros(len(times), dtype=np.bool_)
    events = np.sort(events)
    after = np.clip(np.searchsorted(events, times), 0, len(events) - 1)
    gaps = np.minimum(np.abs(events[after] - times), np.abs(times - events[after - 1]))
    return np.asarray(gaps <= within)


def turning(frames: Frames, *, within: float, least: float) -> Bools:
    """Where the heading changes by at least an angle [rad] from before to after, (n,).

    Args:
        frames: n frames.
        within: So long before and after [s].
        least: [rad].
    """
    before, after = (np.interp(frames.times + away, frames.times, frames.yaws)
                     for away in (-within, within))  # fmt: skip
    return np.asarray(np.abs(after - before) >= least)


def lane_distances(positions: Floats, lanes: Sequence[str], shapes: Mapping[str, Floats]) -> Floats:
    """Distance of fronts from the centre of the lane that they are on, (n,) [m].

    A front within a few centimetres of a lane's end may be shown on the next one, so the
    lanes before and after count as well.

    Args:
        positions: (n, 2) [m].
        lanes: The true lane's id of each frame, (n,).
        shapes: Centre lines by lane, (k, 2) [m].
    """
    found = np.full(len(positions), np.nan)
    if not len(positions):
        return found
    names = np.asarray(lanes)
    cuts = np.flatnonzero(names[1:] != names[:-1]) + 1
    bounds = [0, *cuts.tolist(), len(names)]
    chain = [str(names[first]) for first in bounds[:-1]]
    points = shapely.points(positions)
    for number, (first, last) in enumerate(pairwise(bounds)):
        own = [name for name in chain[max(number - 1, 0) : number + 2] if name in shapes]
        if own:
            lines = shapely.multilinestrings([shapely.linestrings(shapes[name]) for name in own])
            found[first:last] = shapely.distance(points[first:last], lines)
    return found


@dataclass(eq=False)
class Pool:
    """Values of many vehicles by name."""

    values: dict[str, list[Floats]] = field(default_factory=lambda: defaultdict(list))

    def add(self, name: str, values: Floats | float) -> None:
        """Add the finite ones of some values."""
        some = np.atleast_1d(np.asarray(values, dtype=np.float64))
        self.values[name].append(some[np.isfinite(some)])

    def of(self, name: str) -> Floats:
        """All values of a name, (n,)."""
        return np.concatenate([*self.values.get(name, []), np.empty(0)])

    def rank(self, name: str, percent: float) -> float:
        """A percentile; NaN of nothing."""
        some = self.of(name)
        return float(np.percentile(some, percent)) if len(some) else float("nan")

    def most(self, name: str) -> float:
        """The largest; NaN of nothing."""
        return self.rank(name, 100.0)

    def root_mean_square(self, name: str) -> float:
        """NaN of nothing."""
        some = self.of(name)
        return float(np.sqrt((some**2).mean())) if len(some) else float("nan")


def summary(pool: Pool) -> dict[str, float]:
    """The table's columns, except for the run time."""
    return {
        "rmse": pool.root_mean_square("distance"),
        "along_p95": pool.rank("along", 95),
        "along_p99": pool.rank("along", 99),
        "lateral_p95": pool.rank("lateral", 95),
        "p99": pool.rank("distance", 99),
        "max": pool.most("distance"),
        "heading_p95": pool.rank("heading", 95),
        "heading_p99": pool.rank("heading", 99),
        "heading_max": pool.most("heading"),
        "speed_rmse": pool.root_mean_square("speed"),
        "acceleration_p99": pool.rank("acceleration", 99),
        "jerk_p99": pool.rank("jerk", 99),
        "yaw_rate_p99": pool.rank("yaw_rate", 99),
        "birth": pool.most("birth"),
        "death": pool.most("death"),
        "jumps": float((pool.of("excess") > 0.0).sum()),
        "jump": pool.most("excess"),
        "lane_p95": pool.rank("lane", 95),
        "lane_max": pool.most("lane"),
        "change_across_p99": pool.rank("change_across", 99),
        "change_yaw_rate_p99": pool.rank("change_yaw_rate", 99),
        "change_crab_p99": pool.rank("change_crab", 99),
        "changes": float(len(pool.of("change_peak"))),
        "spikes": float((pool.of("change_peak") > SPIKE).sum()),
        "bend_spikes": float((pool.of("bend_peak") > SPIKE).sum()),
        "missing": float(pool.of("missing").sum()),
    }
