"""Goes over a vehicle log that SUMO has written: what lies near a vehicle, and broken steps.

SUMO writes an element to a line, and people and containers after the vehicles of a step: in a
second element of the same time where its owner wants a log of their own.
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.sax.saxutils import unescape

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.whole import whole

_STEP = re.compile(r'\s*<timestep time="([^"]*)"')
_ROW = re.compile(r'\s*<(vehicle|person|container) id="([^"]*)" x="([^"]*)" y="([^"]*)"')

Keep = Callable[[list[str]], list[str]]
"""Chooses rows of a step."""


def keep_near(log: Path, name: str, *, radius: float) -> None:
    """Leave in a log only what is near a vehicle, while it is there.

    Args:
        log: SUMO's, packed; it is replaced.
        name: Id of the vehicle.
        radius: [m], on the map.

    Raises:
        ConfigError: If no such vehicle is in the log.
    """
    found = {"vehicle": False, "person": False, "container": False}

    def near(rows: list[str]) -> list[str]:
        known = [(row, _ROW.match(row)) for row in rows]
        users = [(row, match) for row, match in known if match is not None]
        own = {match[1]: match for _, match in users if _plain(match[2]) == name}
        found.update(dict.fromkeys(own, True))
        if "vehicle" not in own:
            return []
        x, y = _place(own["vehicle"])
        places = [(row, _place(match)) for row, match in users]
        return [row for row, (e, n) in places if (e - x) ** 2 + (n - y) ** 2 <= radius**2]

    _rewrite(log, near)
    if not found["vehicle"]:
        kind = next((kind for kind, there in found.items() if there), None)
        why = "" if kind is None else f"; it is a {kind}, and only a vehicle can be followed"
        raise ConfigError(f"no vehicle {name!r} drives in this window{why}", key="follow")


def join_steps(log: Path) -> None:
    """Put what a log tells of one time into one element.

    Args:
        log: SUMO's, packed; it is replaced.
    """
    _rewrite(log, list)


def _plain(text: str) -> str:
    """Return an attribute as it was before it was written as XML."""
    return unescape(text, {"&quot;": '"', "&apos;": "'"})


def _place(row: re.Match[str]) -> tuple[float, float]:
    """Return east and north of a row [m]."""
    return float(row[3]), float(row[4])


def _rewrite(log: Path, keep: Keep) -> None:
    """Write a log again, with some rows of each step."""
    with whole(log) as part, gzip.open(part, "wt", encoding="utf-8", newline="\n") as out:
        out.write("<fcd-export>\n")
        for time, rows in _steps(log):
            out.write(f'    <timestep time="{time}">\n{"".join(keep(rows))}    </timestep>\n')
        out.write("</fcd-export>\n")


def _steps(log: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield times and the rows of each, which may stand in several elements."""
    time, rows = "", list[str]()
    with gzip.open(log, "rt", encoding="utf-8") as stream:
        for line in stream:
            step = _STEP.match(line)
            if step is not None and step[1] != time:
                if time:
                    yield time, rows
                time, rows = step[1], []
            elif _ROW.match(line):
                rows.append(line)
    if time:
        yield time, rows
