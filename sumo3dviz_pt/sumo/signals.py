"""Read the logs of traffic lights: SaveTLSStates and SaveTLSSwitchStates."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.sumo.bounds import SIGNAL_LETTERS
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.values import parse_time


def read_signals(paths: Iterable[Path]) -> dict[str, SignalPhases]:
    """Read signal logs of either kind; only changes are kept.

    Args:
        paths: Logs. A light that several logs hold is taken from the first of them,
            so the log with every step should come before that with switches only.

    Returns:
        Phases by tls id; the program may change in between. Empty without paths.

    Raises:
        InputError: If a file is damaged or no signal log.
    """
    phases: dict[str, SignalPhases] = {}
    for path in paths:
        for tls, states in _read_log(path).items():
            phases.setdefault(tls, _phases(tls, states))
    return phases


def _read_log(path: Path) -> dict[str, list[tuple[float, str]]]:
    """Return all logged changes of one file, by tls id, in file order."""
    log: dict[str, list[tuple[float, str]]] = {}
    for element in read_elements(path, root="tlsStates", what="a log of SUMO's traffic lights"):
        if element.tag == "tlsState":
            states = log.setdefault(element.text("id"), [])
            state = _state(element)
            if not states or states[-1][1] != state:
                states.append((_time(element), state))
    return log


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


def _time(element: Element) -> float:
    text = element.text("time")
    try:
        return parse_time(text)
    except ValueError:
        raise element.error(f'time="{cut(text)}" must be seconds, h:m:s or d:h:m:s') from None
