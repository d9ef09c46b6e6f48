"""Lists pairs of vehicles that pass a kerb one after the other on the same lane.

A pair can show people a gap: its second vehicle is moved in time. It is as useful as little stands
against it: no vehicle brakes before the kerb, none comes between on another lane, both are cars.
The way across is the line over the road that a person at the kerb would walk.

* brakes: the vehicle loses so much speed within half a second that brake lamps would shine, or
  stands, from a few seconds before the kerb until soon after it. If a road user is close ahead, it
  is named as the reason; else the reason is a signal, a turn, or not known;
* appears: its ride begins in sight, so that it comes out of nothing in films of long gaps;
* between: another vehicle drives over the way across while the gap is open, that is, after the
  first vehicle's rear has left it and before the second vehicle's front reaches it;
* turns off: another vehicle drives on the second one's lanes while the gap is open, and leaves the
  road before the kerb.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Scenario, Trace
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.motion import LogMotion
from sumo3dviz_pt.pipeline.traffic import motion_of
from sumo3dviz_pt.studies.kerb.place import Kerb
from sumo3dviz_pt.studies.measured.observer import STEP, crossings
from sumo3dviz_pt.studies.measured.traffic import STANDS, leader, traffic_at

APPROACH = 4.0
"""Braking counts from so long before the vehicle's front reaches the way across [s]."""

AFTERWARDS = 2.0
"""Braking counts until so long after its rear has left it, because people see that [s]."""

BRAKES = 1.3
"""Slowing down harder than this lights brake lamps (UN Regulation 13-H, 5.2.22.4) [m/s2]."""

_BLINK = 0.5
"""Speed that is lost in a shorter time is no braking [s]."""

_NEAR = 60.0
"""Vehicles that always stay farther from the kerb are not looked at [m]."""

_LONGEST = 30.0
"""Vehicles that follow each other later than this are no pair [s]."""

_LIKED = 4.5
"""Of two pairs with as little against them, the one with a recorded gap nearer to this is first,
because its films need the least moving [s]."""

SEEN_FAR = 150.0
"""A vehicle that appears farther away is too small to be noticed [m]."""

_KNOWN = 10.0
"""A ride that begins so long before its vehicle arrives is there from the first frame on [s]."""

_CARS = frozenset({"passenger", "private", "taxi", "evehicle", "hov", "custom1", "custom2"})


@dataclass(frozen=True, slots=True, eq=False)
class KerbPassage:
    """A vehicle that comes by the kerb.

    Attributes:
        id: Unique in the log.
        kind: Of its vehicle type: the type's id.
        vclass: SUMO's vClass.
        arrives: When its front reaches the way across [s].
        leaves: When its rear leaves that way [s].
        speed: Of its front then [m/s].
        side: From where it comes, `left` or `right`, as a person sees it who looks across.
        lane: Id of its lane then; empty if the log has none.
        approach: Lanes on which it came within `_NEAR`.
        slows: When it brakes hardest, if it brakes [s]; NaN if it does not.
        stands: Whether it stands.
        ride: Its motion.
        appears: In words, if its ride begins in sight.
    """

    id: str
    kind: str
    vclass: str
    arrives: float
    leaves: float
    speed: float
    side: str
    lane: str
    approach: frozenset[str]
    slows: float
    stands: bool
    ride: Trajectory
    appears: str = ""

    @property
    def brakes(self) -> bool:
        """Whether it brakes or stands near the kerb."""
        return self.stands or math.isfinite(self.slows)

    @property
    def is_car(self) -> bool:
        """Whether people would call it a car."""
        return self.vclass in _CARS


@dataclass(frozen=True, slots=True, eq=False)
class KerbPair:
    """Two vehicles that pass a kerb one after the other on one lane.

    Attributes:
        first: The one that comes first.
        then: The one behind it.
        between: Other vehicles that drive over the way across in the gap.
        turning: Ids of vehicles that drive towards it in the gap and turn off before.
        braking: Why each of both brakes, in words; empty if it does not.
    """

    first: KerbPassage
    then: KerbPassage
    between: tuple[KerbPassage, ...]
    turning: tuple[str, ...]
    braking: tuple[str, str]

    @property
    def gap(self) -> float:
        """From the first one's rear to the second one's front [s]."""
        return max(self.then.arrives - self.first.leaves, 0.0)

    @property
    def leave_out(self) -> tuple[str, ...]:
        """Ids of vehicles that would end the gap."""
        return tuple(dict.fromkeys((*(each.id for each in self.between), *self.turning)))

    @property
    def is_proposed(self) -> bool:
        """Whether nothing stands against it that people would see."""
        return not any(self.braking) and all(
            each.is_car and not each.appears for each in (self.first, self.then)
        )

    @property
    def drawback(self) -> float:
        """How much stands against it: less is better."""
        strange = sum(not each.is_car for each in (self.first, self.then))
        away = abs(math.log(max(self.gap, 0.2) / _LIKED))
        strange += 2 * sum(bool(each.appears) for each in (self.first, self.then))
        faults = 8.0 * bool(self.braking[0]) + 4.0 * bool(self.braking[1]) + 2.0 * strange
        return faults + len(self.leave_out) + away

    def notes(self) -> list[str]:
        """Return what there is to say against it, in words."""
        lines = [
            f"{each.id} {why}"
            for each, why in zip((self.first, self.then), self.braking, strict=True)
            if why
        ]
        both = (self.first, self.then)
        lines += [f"{each.id} {each.appears}" for each in both if each.appears]
        lines += [f"{each.id} ({each.vclass}) comes between" for each in self.between]
        return [*lines, *(f"{name} turns off before" for name in self.turning)]


def passages(job: Job, scenario: Scenario, kerb: Kerb) -> list[KerbPassage]:
    """Return the vehicles that come by a kerb, in order.

    Args:
        job: The scene file.
        scenario: As read.
        kerb: The place.
    """
    motion, log = motion_of(job, scenario), scenario.traffic
    near = [_near(trace, kerb, scenario) for trace in log.traces]
    which = np.array([bool(len(some)) for some in near], dtype=np.bool_)
    rides = iter(motion.smooth(which))
    passing: list[KerbPassage] = []
    for trace, some in zip(log.traces, near, strict=True):
        if len(some):
            passing += _passing(trace, next(rides), some, scenario, kerb)
    return sorted(passing, key=lambda each: (each.arrives, each.id))


def _near(trace: Trace, kerb: Kerb, scenario: Scenario) -> Floats:
    """Return when a vehicle is logged near a kerb [s]; nothing for people on foot."""
    if trace.kind != "vehicle":
        return np.empty(0)
    places = scenario.network.location.outside(trace.positions)[:, :2]
    # A second at 50 m/s lies between rows, at most.
    return np.asarray(trace.times[np.linalg.norm(places - kerb.position, axis=1) < _NEAR])


def _passing(
    trace: Trace, ride: Trajectory, near: Floats, scenario: Scenario, kerb: Kerb
) -> Iterator[KerbPassage]:
    """Yield when a vehicle comes by."""
    times = np.arange(near[0] - 1.0, near[-1] + 1.0 + STEP, STEP)
    motion = ride.sample(times)
    kind = scenario.vehicle_types.get(trace.type_id, UNKNOWN_TYPES[trace.kind])
    across = np.broadcast_to(kerb.across, (len(times), 2, 2))
    fronts = scenario.network.location.outside(motion.positions)[:, :2]
    forward = np.stack([np.cos(motion.yaws), np.sin(motion.yaws)], axis=1)
    leaves = [time for time, _ in crossings(across, fronts - kind.length * forward, times)]
    for time, rising in crossings(across, fronts, times):
        left = next((other for other in leaves if other >= time), time)
        slows, stands = _braking(times, motion.speeds, time - APPROACH, left + AFTERWARDS)
        speed = float(np.interp(time, times, motion.speeds))
        lanes = _lanes(trace, scenario, near[0], time)
        yield KerbPassage(
            ride.id, trace.type_id, kind.vclass, time, left, speed,
            "left" if rising else "right", lanes[-1] if lanes else "", frozenset(lanes),
            slows, stands, ride, _appears(ride, scenario, kerb, time),
        )  # fmt: skip


def _appears(ride: Trajectory, scenario: Scenario, kerb: Kerb, time: float) -> str:
    """Return that a ride begins in sight of a kerb soon before it arrives [s], in words."""
    begin = max(piece.begin for piece in ride.pieces if piece.begin <= time)
    pose = ride.at(begin)
    if pose is None or time - begin > _KNOWN:
        return ""
    place = scenario.network.location.outside(pose.position)[:2]
    away = float(np.linalg.norm(place - kerb.position))
    return f"appears {time - begin:.0f} s before, {away:.0f} m away" if away < SEEN_FAR else ""


def _lanes(trace: Trace, scenario: Scenario, begin: float, end: float) -> list[str]:
    """Return ids of the lanes on which a vehicle was in a span [s], in order."""
    inside = (trace.times >= begin - 1e-9) & (trace.times <= end + 1e-9)
    names = scenario.traffic.lane_names
    return [names[k] for k in trace.lanes[inside].tolist() if k >= 0]


def _braking(times: Floats, speeds: Floats, begin: float, end: float) -> tuple[float, bool]:
    """Return when a vehicle brakes hardest in a span [s], NaN if never, and whether it stands."""
    inside = (times >= begin) & (times <= end) & np.isfinite(speeds)
    own, when = speeds[inside], times[inside]
    steps = round(_BLINK / STEP)
    if len(own) <= steps:
        return math.nan, False
    slowing = (own[:-steps] - own[steps:]) / _BLINK
    worst = int(np.argmax(slowing))
    slows = float(when[worst]) if slowing[worst] > BRAKES else math.nan
    return slows, bool((own < STANDS).any())


# Pairs --------------------------------------------------------------------------------------


def pairs_in(
    job: Job,
    scenario: Scenario,
    kerb: Kerb,
    *,
    came: Sequence[KerbPassage],
    everybody: Sequence[KerbPassage],
) -> list[KerbPair]:
    """Return the pairs that pass a kerb on one lane, the most useful first.

    Args:
        job: The scene file.
        scenario: As read.
        kerb: The place.
        came: Passages that may be of a pair, in order.
        everybody: All passages, in order.
    """
    motion = motion_of(job, scenario)
    near = np.array([bool(len(_near(trace, kerb, scenario))) for trace in scenario.traffic.traces])
    why = {id(each): _why(motion, scenario, kerb, each) if each.brakes else "" for each in came}
    ids = {each.id for each in everybody}
    last: dict[tuple[str, str], KerbPassage] = {}
    pairs = []
    for each in came:
        before = last.get((each.lane, each.side))
        last[each.lane, each.side] = each
        if before is None or before.id == each.id or each.arrives - before.leaves > _LONGEST:
            continue
        between = tuple(
            other
            for other in everybody
            if other.id not in (before.id, each.id)
            and other.leaves > before.leaves
            and other.arrives < each.arrives
        )
        turning = tuple(_turning(motion, scenario, near, (before, each), ids))
        pairs.append(KerbPair(before, each, between, turning, (why[id(before)], why[id(each)])))
    return sorted(pairs, key=lambda pair: (pair.drawback, pair.first.arrives))


def _turning(
    motion: LogMotion,
    scenario: Scenario,
    near: Bools,
    pair: tuple[KerbPassage, KerbPassage],
    passing: set[str],
) -> Iterator[str]:
    """Yield ids of vehicles on the second one's lanes in the gap that turn off before the kerb."""
    first, then = pair
    names = scenario.traffic.lane_names
    wanted = [k for k, name in enumerate(names) if name in then.approach]
    for k in np.flatnonzero(near).tolist():
        trace = scenario.traffic.traces[k]
        if motion.ids[k] in passing:
            continue
        inside = (trace.times >= first.arrives) & (trace.times <= then.arrives)
        if np.isin(trace.lanes[inside], wanted).any() and trace.kind == "vehicle":
            yield motion.ids[k]


def _why(motion: LogMotion, scenario: Scenario, kerb: Kerb, each: KerbPassage) -> str:
    """Return that a vehicle brakes near the kerb, when, and which one is ahead, in words."""
    if not math.isfinite(each.slows):
        return "stands there"
    what = f"{'stops' if each.stands else 'brakes'} at {each.slows:.1f} s"
    ahead = ahead_of(motion, scenario, kerb.position, each.id, each.slows)
    return f"{what} for {ahead}" if ahead else what


def ahead_of(motion: LogMotion, scenario: Scenario, place: Floats, name: str, time: float) -> str:
    """Return the id of the road user straight ahead of another; empty if none is within 4 s.

    Args:
        motion: Of all road users.
        scenario: As read.
        place: Near which, (2,) [m].
        name: Id of the one behind.
        time: When [s].
    """
    traffic = traffic_at(motion, scenario, np.array([time]), near=place[None])
    own = traffic.number(f"vehicle:{name}")
    leading = None if own is None or not traffic.alive[own, 0] else leader(traffic, 0, own)
    if leading is None or own is None:
        return ""
    other, gap = leading
    reach = max(4.0 * float(traffic.speeds[own, 0]), 8.0)
    return traffic.keys[other].partition(":")[2] if gap <= reach else ""
