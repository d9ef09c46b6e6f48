"""What `record` is asked to keep, the files of a recording, and those that lead to the others.

A recording grows by steps.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

from sumo3dviz_pt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class RecordOrder:
    """What `record` is to keep.

    Attributes:
        folder: Where it goes.
        start: First time that a film may show [s]; None is the simulation's.
        end: Last time that a film may show [s]; None is the simulation's.
        around: East, north and radius of the place to keep [m]; None is everywhere.
        follow: Id of a vehicle around which is kept; None is everywhere.
        radius: How far around the one that is followed [m].
        seed: SUMO's, instead of the configuration's.
        overwrite: Whether a recording that is there is replaced.
    """

    folder: Path
    start: float | None = None
    end: float | None = None
    around: tuple[float, float, float] | None = None
    follow: str | None = None
    radius: float = 300.0
    seed: int | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no choice.

        Raises:
            ConfigError: If the window ends before it begins, or a radius is none.
        """
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise ConfigError(
                f"--to ({self.end:.12g}) must be later than --from ({self.start:.12g})"
            )
        if self.around is not None and self.follow is not None:
            raise ConfigError("give either --around or --follow")
        radius = self.radius if self.around is None else self.around[2]
        if not 0.0 < radius < math.inf:
            raise ConfigError(f"a radius must be above 0 m, not {radius:g}")


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


@dataclass(frozen=True, slots=True)
class LoggedStep:
    """What the logs say of one step.

    Attributes:
        time: As it is written [s].
        rows: Lines of the vehicle log.
        lights: Lines of the signal log.
    """

    time: str
    rows: tuple[str, ...]
    lights: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The step as an element of a vehicle log."""
        rows = "".join(self.rows)
        return f"    <timestep time={quoteattr(self.time)}>\n{rows}    </timestep>\n"
