"""Read the logs of traffic lights: SaveTLSStates, SaveTLSSwitchStates and SaveTLSSwitchTimes.

SUMO's full output has the states of every step, too. SaveTLSSwitchTimes holds only when links are
green, and no green that lasts to the simulation's end.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.sumo.formats.outputs import FULL
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.values import SIGNAL_LETTERS, parse_time

_ROOTS = ("tlsStates", "tlsSwitches", FULL)


class _Green(NamedTuple):
    """A time in which a link is green.

    Attributes:
        link: The lanes that it joins.
        begin: When it becomes green [s].
        end: When it is green no longer [s].
    """

    link: tuple[str, str]
    begin: float
    end: float


def read_signals(paths: Iterable[Path], network: Network | None = None) -> dict[str, SignalPhases]:
    """Read signal logs of any kind; only changes are kept.

    Args:
        paths: Logs. A light that several logs hold is taken from the first of them,
            so the log with every step should come before that with switches only.
        network: Tells which links the green times of a SaveTLSSwitchTimes log belong to.

    Returns:
        Phases by tls id; the program may change in between. Empty without paths.

    Raises:
        InputError: If a file is damaged or no signal log.
    """
    phases: dict[str, SignalPhases] = {}
    for path in paths:
        for tls, states in _read_log(path, network).items():
            phases.setdefault(tls, _phases(tls, states))
    return phases


def _read_log(path: Path, network: Network | None) -> dict[str, list[tuple[float, str]]]:
    """Return all logged changes of one file, by tls id, in file order."""
    log: dict[str, list[tuple[float, str]]] = {}
    greens: dict[str, list[_Green]] = {}
    time = 0.0
    for element in read_elements(path, root=_ROOTS, what="a log of SUMO's traffic lights"):
        if element.tag == "data":
            time = _time(element, "timestep")
        elif element.tag in ("tlsState", "trafficlight"):
            states = log.setdefault(element.text("id"), [])
            state = _state(element)
            if not states or states[-1][1] != state:
                states.append((_time(element) if element.tag == "tlsState" else time, state))
        elif element.tag == "tlsSwitch":
            link = element.text("fromLane"), element.text("toLane")
            green = _Green(link, _time(element, "begin"), _time(element, "end"))
            greens.setdefault(element.text("id"), []).append(green)
    return log if network is None else log | _changes(greens, network)


def _changes(
    greens: Mapping[str, list[_Green]], network: Network
) -> dict[str, list[tuple[float, str]]]:
    """Return the states of all links over time, by tls id; links that are not green are red."""
    links: dict[str, dict[tuple[str, str], set[int]]] = {}
    for each in network.connections:
        if each.tls and each.link_index >= 0:
            own = links.setdefault(each.tls, {})
            own.setdefault((each.from_lane, each.to_lane), set()).add(each.link_index)
    start = min((green.begin for each in greens.values() for green in each), default=0.0)
    return {
        tls: _states(logged, links[tls], start) for tls, logged in greens.items() if tls in links
    }


def _states(
    greens: list[_Green], links: Mapping[tuple[str, str], set[int]], start: float
) -> list[tuple[float, str]]:
    """Return the states of one traffic light.

    Args:
        greens: When its links are green.
        links: Indices of the links by their lanes.
        start: When the log begins [s].
    """
    steps: dict[float, list[tuple[int, int]]] = {start: []}
    for green in greens:
        for index in links.get(green.link, ()):
            steps.setdefault(green.begin, []).append((index, 1))
            steps.setdefault(green.end, []).append((index, -1))
    # A link may be shared by lanes, so it is green as long as any of them is.
    open_lanes = [0] * (1 + max(index for own in links.values() for index in own))
    states: list[tuple[float, str]] = []
    for time in sorted(steps):
        for index, change in steps[time]:
            open_lanes[index] += change
        states.append((time, "".join("G" if count > 0 else "r" for count in open_lanes)))
    return states


def _phases(tls: str, states: list[tuple[float, str]]) -> SignalPhases:
    """Put changes in order; of two at the same time the later entry counts."""
    by_time = dict(sorted(states, key=lambda entry: entry[0]))
    changes: list[tuple[float, str]] = []
    for time, state in by_time.items():
        if not changes or changes[-1][1] != state:
            changes.append((time, state))
    return SignalPhases(
        tls, tuple(time for time, _ in changes), tuple(state for _, state in changes)
    )


def _state(element: Element) -> str:
    """Return the letters of all links."""
    state = element.text("state")
    odd = state.strip(SIGNAL_LETTERS) and sorted(set(state) - set(SIGNAL_LETTERS))
    if odd:
        raise element.error(
            f'state="{cut(state)}" holds {odd[0]!r}; each letter is one of {SIGNAL_LETTERS}'
        )
    return state


def _time(element: Element, key: str = "time") -> float:
    text = element.text(key)
    try:
        return parse_time(text)
    except ValueError:
        raise element.error(f'{key}="{cut(text)}" must be seconds, h:m:s or d:h:m:s') from None
