"""Signal heads: what they show, what carries them, and places where poles may stand.

SUMO's letters over time become lamps:

| letter | three lamps | two lamps |
|---|---|---|
| `r` red, `s` right turn after a stop | red | red |
| `u` red and yellow | red, yellow | red |
| `y`, `Y` yellow | yellow | red |
| `g`, `G` green | green | green |
| `o` blinking | yellow, on for the first half of every second | dark |
| `O` off, anything else, and before the first entry of the log | dark | dark |

Interpolated yellow (`yellow: auto`): a link whose whole log knows neither `y`, `Y` nor
`u` shows the last `yellow_time` seconds before each change from green to red as
yellow, but at most the later half of that green. So yellow precedes the logged
change, as in the founding paper, and red never begins later than in the log. Two-lamp
heads cannot show yellow and are never changed.

References:
    SUMO user documentation, Simulation/Traffic Lights, "Signal state definitions".
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Literal

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Connection, Network
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.world.placement.lanes import DrivenGround
from sumo3dviz_pt.world.rails.ways import guard_of, only_rails

RED, YELLOW, GREEN = "red", "yellow", "green"

_SAME = {"Y": "y", "g": "G", "s": "r"}
_THREE = {"r": (RED,), "u": (RED, YELLOW), "y": (YELLOW,), "G": (GREEN,), "o": (YELLOW,)}
_TWO = {"r": (RED,), "u": (RED,), "y": (RED,), "G": (GREEN,)}


@dataclass(frozen=True, slots=True)
class AspectCourse:
    """The letters of one link over time, without repetitions.

    Letters that look the same are one: `G` stands for `g`, `y` for `Y`, `r` for `s`.

    Attributes:
        times: When each letter begins, strictly increasing [s].
        letters: As long as `times`.
    """

    times: tuple[float, ...]
    letters: tuple[str, ...]

    def letter_at(self, time: float) -> str:
        """Return the letter at a time [s]; `O` before the log begins."""
        index = bisect_right(self.times, time + 1e-9) - 1
        return self.letters[index] if index >= 0 else "O"

    def seconds_left(self, time: float) -> int | None:
        """Return the seconds until another letter, rounded up; None if the log has no later one."""
        index = bisect_right(self.times, time + 1e-9)
        if index >= len(self.times):
            return None
        return ceil(self.times[index] - time - 1e-6)

    def lit_at(self, time: float, *, lamps: int = 3) -> frozenset[str]:
        """Return which lamps of a head of two or three are lit at a time [s]."""
        letter = self.letter_at(time)
        if letter == "o" and (time + 1e-9) % 1.0 >= 0.5:
            return frozenset()
        return frozenset((_THREE if lamps == 3 else _TWO).get(letter, ()))


def course_of(phases: SignalPhases, link: int) -> AspectCourse:
    """Return the course of one link of a traffic light.

    Args:
        phases: The light's log; entries too short for the link count as off.
        link: Place of its letter in the state strings.
    """
    times: list[float] = []
    letters: list[str] = []
    for time, state in zip(phases.times, phases.states, strict=True):
        letter = state[link] if link < len(state) else "O"
        letter = _SAME.get(letter, letter)
        if not letters or letters[-1] != letter:
            times.append(time)
            letters.append(letter)
    return AspectCourse(tuple(times), tuple(letters))


def with_yellow(course: AspectCourse, duration: float) -> AspectCourse:
    """Return the course with interpolated yellow, if it knows none of its own.

    Args:
        course: As logged.
        duration: Of the yellow [s]; at most half of each green becomes yellow.
    """
    if {"y", "u"} & set(course.letters):
        return course
    times: list[float] = []
    letters: list[str] = []
    following = (*course.letters[1:], "")
    ends = (*course.times[1:], float("inf"))
    for begin, end, letter, after in zip(
        course.times, ends, course.letters, following, strict=True
    ):
        times.append(begin)
        letters.append(letter)
        if (letter, after) == ("G", "r"):
            times.append(end - min(duration, (end - begin) / 2))
            letters.append("y")
    return AspectCourse(tuple(times), tuple(letters))


POLE_BOTTOM, ARM_BOTTOM, WALK_BOTTOM, RAIL_BOTTOM = 2.2, 4.7, 2.1, 3.9
"""Heights of the lower edge of heads on poles, on arms, for people on foot and trains [m]."""

BESIDE, SPACING = 0.7, 0.56
"""From a road's outer border to a pole, and between heads on a crossbar [m]."""

WIDE = 3
"""Signalled lanes from which an arm reaches over the road."""

UP = np.array([0.0, 0.0, 1.0])
"""Upwards."""

WALKS = ("crossing", "walkingarea")
"""Functions of edges for people on foot."""

_TURN = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN), 0.0 * _TURN])
_FARTHEST = 40.0  # a pole stands at most so far from its usual place [m]
_ROW_REACH = 8.0  # and at most so far only to keep heads off carriageways [m]
_CYCLISTS = frozenset({"bicycle", "scooter"})

HeadKind = Literal["vehicle", "foot", "bicycle", "tram", "rail"]
"""For whom a head is: road vehicles, people on foot, cyclists alone, trams alone, trains."""


@dataclass(frozen=True, slots=True, eq=False)
class Head:
    """A signal head to be built.

    Attributes:
        tls: Id of its traffic light.
        links: Every link whose state it shows; the first names it.
        course: What it shows.
        lamps: 2 or 3.
        position: Below the middle of its housing, (3,) [m].
        yaw: Driving or walking direction of those who see it [rad].
        foot: Where its pole stands, (3,) [m].
        kind: For whom it is.
        counter: Whether it has digits that count seconds.
    """

    tls: str
    links: tuple[int, ...]
    course: AspectCourse
    lamps: int
    position: Floats
    yaw: float
    foot: Floats
    kind: HeadKind = "vehicle"
    counter: bool = False

    @property
    def walks(self) -> bool:
        """Whether it is for people on foot."""
        return self.kind == "foot"

    @property
    def over_road(self) -> bool:
        """Whether it hangs on an arm."""
        return float(self.position[2] - self.foot[2]) > ARM_BOTTOM - 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Support:
    """A pole, or a mast with an arm.

    Attributes:
        position: Its foot, (3,) [m].
        yaw: As its heads' [rad].
        height: [m].
        reach: Length of the arm, to the left positive [m]; 0 for a pole.
        bar: Width of the crossbar that several heads hang on [m]; 0 for none.
        rail: Whether it carries a rail signal.
    """

    position: Floats
    yaw: float
    height: float
    reach: float = 0.0
    bar: float = 0.0
    rail: bool = False

    @property
    def foot(self) -> Floats:
        """Where it stands, (3,) [m]."""
        return self.position


CourseOf = Callable[[Connection, int], AspectCourse]
"""The course of a connection's link as a head with 2 or 3 lamps shows it."""


@dataclass(frozen=True, slots=True)
class SignalGroup:
    """Links of a traffic light that always show the same.

    Attributes:
        tls: Id of the traffic light.
        course: What it shows them.
        links: Their numbers.
        kind: For whom it is.
    """

    tls: str
    course: AspectCourse
    links: tuple[int, ...]
    kind: HeadKind = "vehicle"


@dataclass(frozen=True, slots=True, eq=False)
class HeadDesign:
    """How heads are made, whatever they stand at.

    Attributes:
        network: Says who uses a lane.
        ground: Keeps poles off carriageways.
        course_of: Says what a head for a link shows.
        lamps: Of a head for vehicles, 2 or 3.
        far_side: When a head stands beyond the junction, too; as in `SignalStyle`.
    """

    network: Network
    ground: DrivenGround
    course_of: CourseOf
    lamps: int
    far_side: str = "never"

    def groups(self, links: Sequence[Connection], *, lamps: int) -> list[SignalGroup]:
        """Links that always show the same on heads of 2 or 3 lamps, in the order given."""
        groups: dict[tuple[str, AspectCourse, HeadKind], list[int]] = {}
        for link in links:
            key = (link.tls, self.course_of(link, lamps), kind_of(self.network, link))
            if link.link_index not in groups.setdefault(key, []):
                groups[key].append(link.link_index)
        return [
            SignalGroup(tls, course, tuple(numbers), kind)
            for (tls, course, kind), numbers in groups.items()
        ]


@dataclass(frozen=True, slots=True, eq=False)
class HeadStand:
    """Where some heads hang side by side.

    Attributes:
        foot: Of their pole, (3,) [m].
        bottom: Of the middle of their row, (3,) [m].
        inward: Direction of the row, from the outer lanes' heads on, (3,).
        along: Driving or walking direction of those who see them, (3,).
        yaw: The same as an angle [rad].
    """

    foot: Floats
    bottom: Floats
    inward: Floats
    along: Floats
    yaw: float

    def row(self, groups: Sequence[SignalGroup], *, lamps: int) -> list[Head]:
        """Return one head of so many lamps for each group."""
        offsets = row_offsets(len(groups))
        return [
            Head(
                group.tls,
                group.links,
                group.course,
                lamps,
                self.bottom + offset * self.inward - 0.19 * self.along,
                self.yaw,
                self.foot,
                group.kind,
            )
            for group, offset in zip(groups, offsets, strict=True)
        ]


def kind_of(network: Network, link: Connection) -> HeadKind:
    """Return for whom a head is that shows the state of a connection."""
    lane = network.lanes[link.from_lane]
    if network.edges[lane.edge_id].function in WALKS:
        return "foot"
    if guard_of(network, link) == "rail signal":
        return "rail"
    if only_rails(lane):
        return "tram" if "tram" in lane.allowed else "rail"
    return "bicycle" if lane.allowed and lane.allowed <= _CYCLISTS else "vehicle"


def row_offsets(count: int) -> Floats:
    """Where heads side by side hang along their row, from its middle, (count,) [m]."""
    return np.asarray(SPACING * (np.arange(count) - (count - 1) / 2))


def freest(
    candidates: Floats,
    row: Sequence[Floats],
    ground: DrivenGround,
    *,
    wishes: Sequence[Floats] = (),
    margin: float = 0.3,
) -> Floats:
    """Return the first place that is most clear of carriageways, and none on one if possible.

    Args:
        candidates: Places for a pole, best first, (n, 3) [m].
        row: Vectors from the pole to the heads that it carries low above the ground, (3,) each.
        ground: Where vehicles drive.
        wishes: Vectors from the pole to what had better lie off carriageways, too, (3,) each.
        margin: Between a pole's middle and a carriageway, at least [m].
    """
    # A pole on a carriageway is worst, heads over one come next, then wishes.
    hard = _counted(candidates, (np.zeros(3), *row), ground, margin=margin)
    worst = ground.covers(candidates[:, :2], margin=margin)
    soft = _counted(candidates, wishes, ground, margin=margin)
    order = np.lexsort((soft, hard, worst))
    best: Floats = candidates[int(order[0])]
    if not hard[order[0]]:
        return best
    # In joined junctions all usual places may lie on asphalt: take the nearest that does not.
    rings = best + np.concatenate([r * _CIRCLE for r in np.arange(0.5, _FARTHEST, 0.5)])
    off = ~ground.covers(rings[:, :2], margin=margin)
    if len(row) and off.any():
        reach = np.linalg.norm(rings - best, axis=1)
        near = np.flatnonzero(off & (reach < _ROW_REACH))
        clear = near[_counted(rings[near], row, ground, margin=margin) == 0]
        if len(clear):
            return np.asarray(rings[clear[0]])
    if not worst[order[0]]:
        return best
    return np.asarray(rings[int(np.argmax(off))] if off.any() else best)


def _counted(
    places: Floats, vectors: Sequence[Floats], ground: DrivenGround, *, margin: float
) -> Ints:
    """How many of the vectors from places, (n, 3) [m], end over a carriageway, (n,)."""
    count = np.zeros(len(places), dtype=np.int64)
    for vector in vectors:
        count += ground.covers((places + vector)[:, :2], margin=margin)
    return count


def direction_at_end(shape: Floats) -> tuple[Floats, float]:
    """Horizontal unit direction at a polyline's end, (3,), and its yaw [rad]."""
    away = np.linalg.norm(shape[:, :2] - shape[-1, :2], axis=1)
    far = np.flatnonzero(away > 1.0)
    step = shape[-1] - shape[far[-1] if len(far) else 0]
    length = float(np.hypot(step[0], step[1]))
    if length < 1e-9:
        return np.array([1.0, 0.0, 0.0]), 0.0
    return np.array([step[0], step[1], 0.0]) / length, float(np.arctan2(step[1], step[0]))


def leftward(along: Floats) -> Floats:
    """The horizontal direction to the left of another."""
    return np.array([-along[1], along[0], 0.0])
