"""The files of a recording: what they are called, and those that lead to the others."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

LOG, SIGNALS, EVENTS = "fcd.xml.gz", "signals.xml.gz", "signals.add.xml"
"""Names of the vehicle log, the signal log, and the file that tells SUMO to write the latter."""


@dataclass(frozen=True, slots=True)
class SumoSettings:
    """What a configuration of SUMO says.

    Attributes:
        path: The configuration.
        network: Its network.
        routes: Its route files, which define vehicle types.
        additional: Its additional files.
        begin: First time of the simulation [s].
        end: Last time [s]; None until nobody is left.
        given: Names of all options that it gives.
    """

    path: Path
    network: Path
    routes: tuple[Path, ...]
    additional: tuple[Path, ...]
    begin: float
    end: float | None
    given: frozenset[str] = frozenset()


def events(dest: str, more: str = "") -> str:
    """Return an additional file that makes SUMO write all changes of signals."""
    event = f'<timedEvent type="SaveTLSStates" dest={quoteattr(dest)}/>'
    return f"<additional>\n    {event}\n{more}</additional>\n"


def configuration(settings: SumoSettings, folder: Path, *, signals: bool) -> str:
    """Return a configuration that names the recording, for `init`."""
    additional = [_seen_from(each, folder) for each in settings.additional]
    additional += [EVENTS] if signals else []
    lines = {
        "net-file": _seen_from(settings.network, folder),
        "route-files": ",".join(_seen_from(each, folder) for each in settings.routes),
        "additional-files": ",".join(additional),
    }
    inputs = [f"        <{key} value={quoteattr(value)}/>" for key, value in lines.items() if value]
    return "\n".join(
        [
            "<configuration>",
            "    <input>",
            *inputs,
            "    </input>",
            f'    <output>\n        <fcd-output value="{LOG}"/>\n    </output>',
            "</configuration>",
            "",
        ]
    )


def _seen_from(path: Path, folder: Path) -> str:
    """Return a file's path as it is written in a folder; whole, where none leads there."""
    try:
        return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    except ValueError:
        # Another drive of Windows.
        return path.absolute().as_posix()
