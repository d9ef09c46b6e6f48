"""What a signal head shows: SUMO's letters over time as lamps.

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
from dataclasses import dataclass
from math import ceil

from sumo3dviz_pt.model.traffic import SignalPhases

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
