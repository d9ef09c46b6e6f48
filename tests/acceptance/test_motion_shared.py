"""Displayed motion, bundled and shared scenarios: no jumps, no spins, on the lane, on the ground.

Every n-th vehicle is shown by `lane`, the default, at every frame of a film of 25 fps and
held against what SUMO wrote:

* from frame to frame no front moves further than 1.5 x the logged speed of the samples
  around allows, plus 2 cm (3 cm more in changes of lanes), and no body turns by more than
  180 deg/s, but where SUMO's own angle flips; moves into and out of parking places, which the
  trajectory lists, aside. Where SUMO's places move on faster than its speeds say (lanes whose
  length is not their shape's), the places count;
* at every ninth frame the front is no further from the nearest centre line of the lanes that
  SUMO drove than the log's own samples around are from theirs, plus 0.3 m, and plus half the
  gap where the network's lanes do not join. Lanes between two samples are found here, not by
  the smoother. Changes of lanes are left out while they last:
  two seconds on both sides, or until 13 m (four times a lane's width) have been driven.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.sumo import find_scenario, read_scenario

ROOT = Path(__file__).parents[2]
DATA, EXAMPLES = ROOT.parent / "shared" / "data", ROOT / "examples"
VEHICLES = {  # every n-th vehicle
    "crossing": 3,
    "ronda": 12,
    "barcelona": 19,
    "bologna_acosta": 3,
    "doerpfeldstr": 2,
    "monaco_west_hills": 1,
    "badhersfeld": 4,
}
TIGHTEST = np.degrees(1.0 / 1.6)  # turn by way on the tightest circle [deg/m]
STEP = 1 / 25
EVERY = 9
MOST_HOPS = 8
CHANGE_WAY, CHANGE_TIME, LONGEST_CHANGE = 13.0, 2.0, 8.5

BUNDLED = ("crossing", "ronda")
"""Smaller ones that are always there; fewer vehicles of them are shown."""

absent = pytest.mark.skipif(not DATA.is_dir(), reason="the shared scenarios are not here")
NAMES = [
    name if name in BUNDLED else pytest.param(name, marks=[absent, pytest.mark.slow])
    for name in VEHICLES
]


@cache
def scenario(name):
    return read_scenario(find_scenario((EXAMPLES if name in BUNDLED else DATA) / name))


def many(name, count):
    """How much there must be to compare: of the bundled scenarios a hundredth."""
    return count / 100 if name in BUNDLED else count


class Ways:
    """Centre lines of lanes and of the ways between them."""

    def __init__(self, network):
        self.network, self.lines, self.known = network, {}, {}
        self.next = defaultdict(set)
        onward = {connection.from_lane for connection in network.connections}
        for c in network.connections:
            self.next[c.from_lane].add(c.via or c.to_lane)
            if c.via and c.via not in onward:
                self.next[c.via].add(c.to_lane)

    def between(self, first, last):
        """Lanes from one to the other; None for a lane change."""
        if (first, last) not in self.known:
            self.known[first, last] = self._search(first, last)
        return self.known[first, last]

    def _search(self, first, last):
        edges = [self.network.lanes[name].edge_id for name in (first, last)]
        if first == last or edges[0] == edges[1]:
            return (first,) if first == last else None
        ways = [(first,)]
        for _ in range(MOST_HOPS):
            ways = [(*way, lane) for way in ways for lane in self.next[way[-1]] if lane not in way]
            for way in ways:
                if way[-1] == last:
                    return way
        return None

    def line(self, lanes):
        """One line through the centre lines of lanes that follow one another."""
        if lanes not in self.lines:
            points = np.concatenate([self.network.lanes[lane].shape for lane in lanes])
            self.lines[lanes] = shapely.LineString(points)
        return self.lines[lanes]

    def gap(self, lanes):
        """The widest gap between lanes that follow one another [m]."""
        shapes = [self.network.lanes[lane].shape for lane in lanes]
        apart = [float(np.hypot(*(b[0] - a[-1])[:2])) for a, b in pairwise(shapes)]
        return max(apart, default=0.0)


def angle(difference):
    return np.degrees(np.abs((difference + np.pi) % (2 * np.pi) - np.pi))


@dataclass
class Measured:
    """Of all shown frames; cases are (id, time, by how much)."""

    frames: int = 0
    checked: int = 0
    changing: int = 0
    broken: int = 0
    jumps: list = field(default_factory=list)
    spins: list = field(default_factory=list)
    flips: int = 0
    excess: list = field(default_factory=list)  # beyond the log's own distance [m]
    where: list = field(default_factory=list)
    height: list = field(default_factory=list)  # above the lane [m]
    slope: list = field(default_factory=list)  # of the lane there
    off: list = field(default_factory=list)  # heading against SUMO's own chord rule [deg]
    parked: int = 0
    missed: list = field(default_factory=list)  # distances from samples, remarks aside [m]
    swung: list = field(default_factory=list)  # of standing vehicles [deg]


class Driven:
    """A vehicle's samples held against their own lanes."""

    def __init__(self, trace, log, ways):
        self.trace, self.ways = trace, ways
        self.names = [log.lane_names[index] for index in trace.lanes]
        self.steps = [ways.between(*pair) for pair in pairwise(self.names)]
        self.changed = np.array([way is None for way in self.steps], dtype=bool)
        lines = np.array([ways.line((name,)) for name in self.names], dtype=object)
        self.away = shapely.distance(lines, shapely.points(trace.positions[:, :2]))

    def changing(self, times, travelled):
        """Which times are within a change of lanes."""
        found = np.zeros(len(times), dtype=bool)
        for n in [n for n, way in enumerate(self.steps) if way is None]:
            begin, end = self.trace.times[n], self.trace.times[n + 1]
            ways = np.interp([begin, end], times, travelled)
            near = (travelled > ways[0] - CHANGE_WAY) & (travelled < ways[1] + CHANGE_WAY)
            near &= (times > begin - LONGEST_CHANGE) & (times < end + LONGEST_CHANGE)
            found |= near | ((times > begin - CHANGE_TIME) & (times < end + CHANGE_TIME))
        return found

    def around(self, times):
        """Numbers of the samples before and after times, one more on each side."""
        last = len(self.trace.times) - 1
        first = np.searchsorted(self.trace.times, times, side="right") - 1
        return np.clip(first - 1, 0, last), np.clip(first + 2, 0, last)

    def lanes(self, first, last):
        """The way from one sample to another."""
        steps = self.steps[first:last]
        return tuple(dict.fromkeys(lane for step in steps if step for lane in step)) or (
            self.names[first],
        )


def logged_speeds(trace, times, changed):
    """The largest logged speed of the samples around each step between times, (n - 1,).

    All five logs write the mean speed of the step before a sample (Euler). So at a sample
    the vehicle is on its way from that sample's speed to the next one's.

    Args:
        changed: Steps between samples that change lanes: how far they lead says nothing.
    """
    moved = np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1) / np.diff(trace.times)
    speeds = np.maximum(trace.speeds, np.r_[0.0, np.where(changed, 0.0, moved)])
    last = len(speeds) - 1
    first = np.searchsorted(trace.times, times[:-1] + 1e-9, side="right") - 1
    after = np.minimum(np.searchsorted(trace.times, times[1:] - 1e-9), last)
    late = times[1:] > (trace.times[first] + trace.times[after]) / 2
    following = speeds[np.minimum(after + late, last)]
    return np.maximum(np.maximum(speeds[first], speeds[after]), following)


def flipping(trace, times):
    """Which steps between times lie where SUMO's angle turns by more than 90 degrees a step."""
    flips = np.flatnonzero(angle(np.diff(trace.yaws)) > 90.0)
    found = np.zeros(len(times) - 1, dtype=bool)
    for n in flips:
        found |= (times[1:] > trace.times[n] - 1.0) & (times[:-1] < trace.times[n + 1] + 1.0)
    return found


def step_by_step(trajectory, driven, begin, into):
    """Hold every frame against the one before; returns times, motion and what is listed."""
    trace = driven.trace
    first = np.ceil((trace.times[0] - begin) / STEP)
    times = begin + STEP * np.arange(first, np.floor((trace.times[-1] - begin) / STEP) + 1)
    motion = trajectory.sample(times)
    listed = within(trajectory, "parking", times)
    both = motion.alive[1:] & motion.alive[:-1] & ~(listed[1:] & listed[:-1])
    into.parked += int(listed.sum())
    moved = np.linalg.norm(np.diff(motion.positions[:, :2], axis=0), axis=1)
    # Who changes lanes in a bend passes on its outside, where the way is longer.
    outside = 0.03 * within(trajectory, "lane change", times)[1:]
    beyond = moved - outside - 1.5 * logged_speeds(trace, times, driven.changed) * STEP - 0.02
    turned = angle(np.diff(motion.yaws)) / STEP
    flips = flipping(trace, times)
    into.flips += int((both & flips & (turned > 180.0)).sum())
    for found, bad, size in (
        (into.jumps, both & (beyond > 1e-6), beyond),
        (into.spins, both & ~flips & (turned > 180.0), turned),
    ):
        found += [(trace.id, round(times[k], 2), round(size[k], 3)) for k in np.flatnonzero(bad)]
    still = np.hypot(*np.diff(trace.positions[:, :2], axis=0).T) < 1e-9
    still = np.r_[False, still[:-1] & still[1:], False][np.searchsorted(trace.times, times[:-1])]
    # A stop ends, and a start begins, within a step whose samples are equal: millimetres of way.
    swung = np.maximum(angle(np.diff(motion.yaws)) - TIGHTEST * moved, 0.0)
    into.swung.append(swung[still & both])
    values = np.column_stack([motion.positions, motion.yaws, motion.pitches, motion.speeds])
    into.broken += int((~np.isfinite(values[motion.alive])).sum())
    into.frames += int(motion.alive.sum())
    return times, motion, listed


def within(trajectory, kind, times):
    """Which times are within remarks of a kind; of all kinds if it is empty."""
    found = np.zeros(len(times), dtype=bool)
    for remark in trajectory.remarks:
        if kind in ("", remark.kind):
            found |= (times >= remark.begin - STEP) & (times <= remark.end + STEP)
    return found


def follow(trajectory, trace, log, ways, into):
    """Hold one vehicle's frames against the log and its lanes."""
    driven = Driven(trace, log, ways)
    met = trajectory.sample(trace.times).positions[:, :2] - trace.positions[:, :2]
    into.missed.append(np.hypot(*met.T)[~within(trajectory, "", trace.times)])
    times, motion, listed = step_by_step(trajectory, driven, log.begin, into)
    alive = np.flatnonzero(motion.alive)
    if len(alive) < 2:
        return
    steps = np.linalg.norm(np.diff(motion.positions[alive, :2], axis=0), axis=1)
    changing = np.zeros(len(times), dtype=bool)
    changing[alive] = driven.changing(times[alive], np.r_[0.0, np.cumsum(steps)])
    chosen = alive[(-alive) % EVERY == 0]
    changing |= within(trajectory, "lane change", times)
    into.changing += int((changing & ~listed)[chosen].sum())
    chosen = chosen[~(changing | listed)[chosen]]
    if not len(chosen):
        return
    into.checked += len(chosen)
    first, last = driven.around(times[chosen])
    around = [driven.lanes(*pair) for pair in zip(first, last, strict=True)]
    lines = np.array([ways.line(lanes) for lanes in around], dtype=object)
    spots = shapely.points(motion.positions[chosen, :2])
    own = np.array([driven.away[i : j + 1].max() for i, j in zip(first, last, strict=True)])
    excess = shapely.distance(lines, spots) - own
    excess -= [ways.gap(lanes) / 2.0 if len(lanes) > 1 else 0.0 for lanes in around]
    into.excess.append(excess)
    into.where += [(trace.id, round(t, 2)) for t in times[chosen]]
    into.height.append(motion.positions[chosen, 2] - heights(lines, spots))
    into.slope.append(grades(lines, spots))
    logged = np.interp(times[chosen], trace.times, np.unwrap(trace.yaws))
    into.off.append(angle(motion.yaws[chosen] - logged))


def heights(lines, spots):
    """Height of lines nearest to points, (n,) [m]."""
    return heights_at(lines, shapely.line_locate_point(lines, spots))


def grades(lines, spots):
    """Steepest grade of lines within 4 m of points, (n,)."""
    place = shapely.line_locate_point(lines, spots)
    around = [heights_at(lines, place + away) for away in np.arange(-4, 4.5, 1.0)]
    return np.abs(np.diff(around, axis=0)).max(axis=0)


def heights_at(lines, places):
    """Heights of lines at places along them, (n,) [m]."""
    return shapely.get_z(shapely.line_interpolate_point(lines, np.maximum(places, 0.0)))


@cache
def measured(name):
    read, found = scenario(name), Measured()
    log = read.traffic
    vehicles = [t for t in log.traces if t.kind == "vehicle" and len(t.times) > 1]
    some = replace(log, traces=tuple(vehicles[:: VEHICLES[name]]))
    ways = Ways(read.network)
    shown = smooth_log(
        some, smoother="lane", network=read.network, types=read.vehicle_types, heading="chord"
    )
    for trajectory, trace in zip(shown, some.traces, strict=True):
        follow(trajectory, trace, log, ways, found)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_no_frame_is_broken(name):
    found = measured(name)
    assert found.frames > many(name, 150_000)
    assert found.broken == 0


@pytest.mark.parametrize("name", NAMES)
def test_no_front_jumps(name):
    assert measured(name).jumps == []


@pytest.mark.parametrize("name", NAMES)
def test_no_body_spins(name):
    found = measured(name)
    assert found.spins == []
    assert found.flips <= 10


@pytest.mark.parametrize("name", NAMES)
def test_who_stands_does_not_turn(name):
    swung = np.concatenate(measured(name).swung)
    assert len(swung) > many(name, 1000) or name in ("barcelona", "ronda")
    assert swung.max(initial=0.0) <= 0.05


@pytest.mark.parametrize("name", NAMES)
def test_fronts_are_on_their_lanes(name):
    excess = np.concatenate(measured(name).excess)
    assert len(excess) > many(name, 15_000)
    assert excess.max() <= 0.3
    assert np.percentile(excess, 99) <= 0.2


@pytest.mark.parametrize("name", NAMES)
def test_samples_are_met(name):
    missed = np.concatenate(measured(name).missed)
    assert len(missed) > many(name, 5000)
    # SUMO leaves its lane where lanes do not join, and at kinks of 90 degrees; and who stops
    # in a step of an Euler log is up to v dt / 8 short of its place at that sample.
    assert (missed > 0.3).mean() <= 2e-3
    assert np.percentile(missed, 99) <= 0.15
    assert missed.max() <= 1.1


@pytest.mark.parametrize("name", NAMES)
def test_bodies_head_as_in_sumo(name):
    # Against straight lines between SUMO's angles, which bends are not.
    off = np.concatenate(measured(name).off)
    assert np.percentile(off, 50) <= 0.3
    assert np.percentile(off, 95) <= 3.0
    assert np.percentile(off, 99) <= 6.0


@pytest.mark.parametrize("name", NAMES)
def test_few_frames_are_left_out(name):
    found = measured(name)
    assert found.changing < 0.1 * found.checked
    assert found.parked < 0.01 * found.frames


@pytest.mark.parametrize("name", NAMES)
def test_nothing_on_wheels_floats_or_sinks(name):
    found = measured(name)
    height, slope = np.abs(np.concatenate(found.height)), np.concatenate(found.slope)
    if name != "monaco_west_hills":
        assert height.max() == 0.0
        return
    assert height.max() <= 0.35  # bumps of up to 57 degrees from slope to slope
    assert height[slope < 0.4].max() <= 0.2


@pytest.mark.slow
@absent
def test_no_walker_floats_or_sinks():
    read = scenario("monaco_west_hills")
    log, ways = read.traffic, Ways(read.network)
    some = [t for t in log.traces if t.kind == "person" and len(t.times) > 1][::2]
    shown = smooth_log(replace(log, traces=tuple(some)), smoother="lane", network=read.network)
    excess, drift = [], []
    for trace, trajectory in zip(some, shown, strict=True):
        first = np.ceil((trace.times[0] - log.begin) / STEP / EVERY)
        times = log.begin + EVERY * STEP * np.arange(
            first, (trace.times[-1] - log.begin) / STEP / EVERY
        )
        motion = trajectory.sample(times)
        edges = {log.lane_names[index] for index in trace.lanes}
        lanes = [lane.id for edge in sorted(edges) for lane in read.network.edges[edge].lanes]
        lines = np.array([ways.line((lane,)) for lane in lanes], dtype=object)[:, None]
        own = above(lines, trace.positions)
        after = np.searchsorted(trace.times, times)[motion.alive]
        places = motion.positions[motion.alive]
        limit = np.maximum(own[np.maximum(after - 1, 0)], own[np.minimum(after, len(own) - 1)])
        excess.append(above(lines, places) - limit)
        logged = np.interp(times[motion.alive], trace.times, trace.positions[:, 2])
        drift.append(places[:, 2] - logged)
    excess, drift = np.concatenate(excess), np.abs(np.concatenate(drift))
    assert len(excess) > 5000
    assert (excess <= 0.3).mean() >= 0.999
    assert drift.max() <= 0.2


def above(lines, places):
    """How far points are above or below the nearest of some lines, (n,) [m]."""
    spots = shapely.points(places[:, :2])[None, :]
    nearest = shapely.distance(lines, spots).argmin(axis=0)
    return np.abs(places[:, 2] - heights(lines[nearest, 0], spots[0]))
