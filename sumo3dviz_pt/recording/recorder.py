"""Recording from Python: follow a simulation in your own loop, and make a scene of it.

The simulation is stepped by libsumo or TraCI; the recorder keeps what a film needs.

References:
    SUMO's FCD output: https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html
"""

from __future__ import annotations

import gzip
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any
from xml.sax.saxutils import quoteattr

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.files.atomic import put_in_place, write_atomically
from sumo3dviz_pt.recording.files import (
    EVENTS,
    LOG,
    SIGNALS,
    LoggedStep,
    SumoSettings,
    configuration,
    events,
)

_CONFIGURATION = "recording.sumocfg"
_NAMELESS = -(2**30)
"""SUMO's values for what it does not know are as low as this, or lower."""


class Recorder:
    """Keeps what is on the road after every step of a simulation.

    It asks and changes nothing, so the simulation runs as it would without it. The log has the rows
    that `record` would keep, but for containers, of which SUMO tells a connection nothing::

        libsumo.start(["sumo", "-c", "city.sumocfg"])
        with Recorder(libsumo, "out") as recorder:
            while libsumo.simulation.getMinExpectedNumber() > 0:
                libsumo.simulationStep()
                recorder.step()
            scene = recorder.scene(cameras={...})

    Args:
        connection: The module `libsumo` or `traci`, or a connection of `traci`.
        folder: Where the recording goes.
        overwrite: Whether a recording that is there is replaced.

    Raises:
        ConfigError: If a recording is there already.
    """

    def __init__(self, connection: Any, folder: str | Path, *, overwrite: bool = False) -> None:
        self.folder = Path(folder)
        there = [self.folder / name for name in (LOG, _CONFIGURATION)]
        known = [path for path in there if path.exists()]
        if known and not overwrite:
            raise ConfigError(f"{known[0]} exists already; overwrite=True replaces it")
        for path in (*there, self.folder / SIGNALS, self.folder / EVENTS):
            path.unlink(missing_ok=True)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._settings = settings_of(connection)
        self._reader = StepReader(connection, self._settings)
        self._log: IO[str] | None = _opened(self._part(LOG), "fcd-export")
        self._lights: IO[str] | None = None
        self._steps = 0

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # What was recorded before something failed is worth keeping, too.
        self.close()

    def step(self) -> LoggedStep:
        """Keep who is where now; call it after every `simulationStep()`.

        Returns:
            What was kept, as lines of the logs.

        Raises:
            ConfigError: If the recording was closed.
        """
        if self._log is None:
            raise ConfigError("the recording is closed; make a new Recorder")
        step = self._reader.read()
        self._log.write(step.text)
        if step.lights and self._lights is None:
            self._lights = _opened(self._part(SIGNALS), "tlsStates")
        if self._lights is not None:
            self._lights.writelines(step.lights)
        self._steps += 1
        return step

    def close(self) -> Path:
        """Finish the recording.

        Returns:
            A configuration that `init` takes.

        Raises:
            InputError: If no step was recorded.
        """
        path = self.folder / _CONFIGURATION
        if self._log is None:
            return path
        _closed(self._log, "fcd-export")
        self._log = None
        if not self._steps:
            self._part(LOG).unlink()
            raise InputError("no step was recorded; call step() after simulationStep()", file=path)
        put_in_place(self._part(LOG), self.folder / LOG)
        if self._lights is not None:
            _closed(self._lights, "tlsStates")
            put_in_place(self._part(SIGNALS), self.folder / SIGNALS)
            write_atomically(self.folder / EVENTS, events(SIGNALS))
        lit = self._lights is not None
        self._lights = None
        write_atomically(path, configuration(self._settings, self.folder, signals=lit))
        return path

    def scene(self, **settings: Any) -> Any:
        """Finish the recording and return a scene of it.

        Args:
            settings: The keys of a scene file, as for `Scene`.

        Returns:
            A `Scene`.
        """
        from sumo3dviz_pt.api import Scene

        return Scene(scenario={"sumocfg": self.close()}, **settings)

    def _part(self, name: str) -> Path:
        """Return where a file is written until it is whole."""
        return self.folder / f"{name}.part"


class StepReader:
    """Asks a simulation who is where, after every step; it changes nothing.

    Args:
        connection: The module `libsumo` or `traci`, or a connection of `traci`.
        settings: The simulation's inputs.
    """

    def __init__(self, connection: Any, settings: SumoSettings) -> None:
        self._connection = connection
        self._has = _Has.of(connection, settings)
        self._states: dict[str, str] = {}
        self._sideways: dict[str, float] = {}
        if self._has.sublanes:
            domain = connection.vehicle
            self._sideways = {id_: domain.getLateralSpeed(id_) for id_ in domain.getIDList()}

    @property
    def time(self) -> float:
        """Time of the last step [s]."""
        # A connection's clock already shows the step to come.
        clock = self._connection.simulation
        return float(clock.getTime() - clock.getDeltaT())

    def read(self) -> LoggedStep:
        """Return who is where now, and signals that have changed, as lines of the logs."""
        people, heights, time = self._connection.person, self._has.heights, self.time
        rows = self._vehicles(self._connection.simulation.getDeltaT())
        rows += [_person(people, id_, heights=heights) for id_ in people.getIDList()]
        return LoggedStep(f"{time:.3f}", tuple(rows), tuple(self._changed_signals(time)))

    def _vehicles(self, step: float) -> list[str]:
        """Return the rows of all vehicles.

        Args:
            step: Length of a step [s].
        """
        domain, rows = self._connection.vehicle, []
        ids = domain.getIDList()
        before, self._sideways = self._sideways, {}
        for id_ in ids:
            more = {}
            if self._has.sublanes:
                speed = self._sideways[id_] = domain.getLateralSpeed(id_)
                change = (speed - before.get(id_, 0.0)) / step
                more = {"accelerationLat": f"{change:.3f}"}
            rows.append(_vehicle(domain, id_, more, heights=self._has.heights))
        return rows

    def _changed_signals(self, time: float) -> Iterator[str]:
        """Yield the lines of the signals that have changed."""
        lights = self._connection.trafficlight
        for id_ in lights.getIDList():
            state = lights.getRedYellowGreenState(id_)
            if self._states.get(id_) == state:
                continue
            self._states[id_] = state
            phase, program = lights.getPhase(id_), lights.getProgram(id_)
            yield (
                f'<tlsState time="{time:.3f}" id={quoteattr(id_)} programID={quoteattr(program)}'
                f' phase="{phase}" state="{state}"/>\n'
            )


@dataclass(frozen=True, slots=True)
class _Has:
    """What SUMO writes only of some simulations.

    Attributes:
        heights: Whether the network is not flat.
        sublanes: Whether vehicles share lanes.
    """

    heights: bool
    sublanes: bool

    @classmethod
    def of(cls, connection: Any, settings: SumoSettings) -> _Has:
        """Return what a simulation has."""
        # Here, as a network is read with packages that the first import has to do without.
        from sumo3dviz_pt.recording.command import has_heights

        resolution = float(connection.simulation.getOption("lateral-resolution"))
        return cls(has_heights(settings.network), resolution > 0.0)


def settings_of(connection: Any) -> SumoSettings:
    """Return the inputs of a running simulation."""
    option = connection.simulation.getOption
    base = option("configuration-file")
    place = Path(base).absolute().parent if base else Path.cwd()

    def files(name: str) -> tuple[Path, ...]:
        return tuple(place / each.strip() for each in option(name).split(",") if each.strip())

    return SumoSettings(
        Path(base) if base else place / _CONFIGURATION,
        files("net-file")[0],
        files("route-files"),
        files("additional-files"),
        float(connection.simulation.getTime()),
        None,
    )


def _opened(path: Path, root: str) -> IO[str]:
    """Open a packed log and begin it."""
    stream = gzip.open(path, "wt", encoding="utf-8", newline="\n", compresslevel=4)  # noqa: SIM115
    stream.write(f"<{root}>\n")
    return stream


def _closed(stream: IO[str], root: str) -> None:
    """End a log and close it."""
    stream.write(f"</{root}>\n")
    stream.close()


def _vehicle(domain: Any, id_: str, more: Mapping[str, str], *, heights: bool) -> str:
    """Return a vehicle's row; empty for one that is nowhere."""
    lane = domain.getLaneID(id_) or _stop_lane(domain, id_)
    own = {
        "signals": str(domain.getSignals(id_)),
        "acceleration": f"{domain.getAcceleration(id_):.3f}",
        **more,
    }
    return _row(domain, "vehicle", id_, {"lane": lane}, own, heights=heights)


def _stop_lane(domain: Any, id_: str) -> str:
    """Return the lane beside which a vehicle is parked; it is on none itself."""
    stops = domain.getStops(id_, 1)
    return str(stops[0].lane) if stops else ""


def _person(domain: Any, id_: str, *, heights: bool) -> str:
    """Return a person's row; empty for one who is nowhere."""
    return _row(domain, "person", id_, {"edge": domain.getRoadID(id_)}, {}, heights=heights)


def _row(
    domain: Any,
    kind: str,
    id_: str,
    on: Mapping[str, str],
    own: Mapping[str, str],
    *,
    heights: bool,
) -> str:
    """Return a row of a vehicle log: what all have, with the lane or edge and what is its own."""
    place = domain.getPosition3D(id_)
    if place[0] < _NAMELESS:
        return ""
    more = {
        "type": domain.getTypeID(id_),
        "speed": f"{domain.getSpeed(id_):.3f}",
        "pos": f"{domain.getLanePosition(id_):.3f}",
        **on,
        "slope": f"{domain.getSlope(id_):.3f}",
        **own,
    }
    numbers = dict(zip("xyz" if heights else "xy", place, strict=False))
    numbers["angle"] = domain.getAngle(id_)
    places = "".join(f' {key}="{value:.3f}"' for key, value in numbers.items())
    words = "".join(f" {key}={quoteattr(value)}" for key, value in more.items())
    return f"<{kind} id={quoteattr(id_)}{places}{words}/>\n"
