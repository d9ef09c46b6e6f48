"""Find when a road user is in a vehicle log by a quick search of the whole log, for messages."""

from __future__ import annotations

import html
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import GAP_FACTOR
from sumo3dviz_pt.sumo.formats import format_of


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """When a road user is in a log, and who else is in it.

    Attributes:
        spans: First and last time of each stay without a gap [s].
        ids: Ids of all road users in the log.
        end: Last time of the log [s]; minus infinity if it is empty.
    """

    spans: tuple[tuple[float, float], ...]
    ids: frozenset[str]
    end: float


@dataclass(slots=True)
class _Sightings:
    """What was found in the part of the log that was searched.

    Attributes:
        steps: Times of all steps [s].
        there: Times at which the road user is there [s].
        ids: Ids of everyone, as they are written in the file.
    """

    steps: set[float] = field(default_factory=set)
    there: set[float] = field(default_factory=set)
    ids: set[bytes] = field(default_factory=set)


def whereabouts(paths: Iterable[Path], name: str) -> Whereabouts:
    """Look for a road user in vehicle logs.

    A log that breaks off or is damaged is read as far as it goes.

    Args:
        paths: Logs that belong together.
        name: SUMO's id, with or without its kind, such as `person:walker_1`. An ending such as
            `#2`, by which our ids tell road users of one id apart, is ignored.
    """
    kind, _, own = name.partition(":")
    plain, _, number = name.rpartition("#")
    wanted = {_written(name), *([_written(plain)] if number.isdecimal() else [])}
    keyed = (_written(kind), _written(own))
    look = _Sightings()
    for path in paths:
        time = np.nan
        # The reader of the log reports what is wrong with it.
        with suppress(InputError):
            for step, kind_of_user, user in format_of(path).sightings(path):
                if step is not None:
                    time = step
                    look.steps.add(time)
                    continue
                look.ids.add(user)
                if user in wanted or (kind_of_user, user) == keyed:
                    look.there.add(time)
    ids = frozenset(html.unescape(each.decode("utf-8", errors="replace")) for each in look.ids)
    return Whereabouts(_spans(look), ids, max(look.steps, default=-np.inf))


def _written(name: str) -> bytes:
    """Return an id as SUMO writes it into XML."""
    return html.escape(name).encode()


def _spans(look: _Sightings) -> tuple[tuple[float, float], ...]:
    """Return first and last time of each stay without a gap [s]."""
    times = np.array(sorted(look.there))
    if not len(times):
        return ()
    steps = np.diff(sorted(look.steps))
    step = float(np.median(steps)) if len(steps) else np.inf
    cuts = np.flatnonzero(np.diff(times) > GAP_FACTOR * step)
    firsts, lasts = times[[0, *(cuts + 1)]], times[[*cuts, len(times) - 1]]
    return tuple(zip(firsts.tolist(), lasts.tolist(), strict=True))
