"""What moved in the simulation, as logged, and the simulation as read from its files.

`Trace` holds the samples of a road user; `RoadUser` says what the log tells without them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Network


@dataclass(frozen=True, slots=True)
class Point:
    """A place and a radius around it.

    Attributes:
        x: [m].
        y: [m].
        radius: [m].
    """

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class UserPlace:
    """Where a road user is at one time.

    Attributes:
        x: [m].
        y: [m].
        lane: Lane or edge, empty where the log has none.
    """

    x: float
    y: float
    lane: str


@dataclass(frozen=True, slots=True)
class Passage:
    """How a road user passes a point.

    Attributes:
        begin: First time within the given radius [s].
        end: Last time within it [s].
        time: When it comes closest [s].
        distance: Its front's smallest distance, seen from above [m].
    """

    begin: float
    end: float
    time: float
    distance: float


@dataclass(frozen=True, slots=True)
class RoadUser:
    """What a log says about one road user.

    Attributes:
        id: SUMO's id.
        kind: `vehicle`, `person` or `container`.
        type_id: Its vType.
        vclass: SUMO's vClass of that.
        begin: First time in the log [s].
        end: Last time in the log [s].
        length: Distance that it drives, without gaps and teleports [m].
        mean_speed: Mean speed over that distance, waiting included [m/s].
        max_speed: Largest logged speed, or largest speed between samples if none is logged [m/s].
        lanes: Number of lanes that it uses, without those on junctions.
        edges: Edges that it uses, in order, without those on junctions.
        place: Where it is at the given time.
        passage: How it passes the given point.
    """

    id: str
    kind: str
    type_id: str
    vclass: str
    begin: float
    end: float
    length: float
    mean_speed: float
    max_speed: float
    lanes: int
    edges: tuple[str, ...]
    place: UserPlace | None = None
    passage: Passage | None = None

    @property
    def duration(self) -> float:
        """From first to last time [s]."""
        return self.end - self.begin


GAP_FACTOR = 1.5
"""Rows are missing where two samples are more than this many steps of the log apart."""

FASTEST = 100.0
"""Speed that no road or rail vehicle exceeds; used where no speed is logged [m/s]."""

RAIL_CLASSES = frozenset(
    ["tram", "rail_urban", "subway", "cable_car", "rail", "rail_electric", "rail_fast"]
)
"""vClasses that run on rails: they bend bogie by bogie and show no way that they choose."""


@dataclass(frozen=True, slots=True)
class VehicleType:
    """A vType with SUMO's class defaults filled in.

    Attributes:
        id: SUMO's id.
        vclass: SUMO's vClass.
        length: [m], > 0.
        width: [m], > 0.
        height: [m], > 0.
        gui_shape: SUMO's guiShape, or empty.
        colour: Linear sRGB in [0, 1], or None when the file gives none.
        params: `<param>` children and attributes that only drawing and sound need.
    """

    id: str
    vclass: str
    length: float
    width: float
    height: float
    gui_shape: str = ""
    colour: tuple[float, float, float] | None = None
    params: Mapping[str, str] = field(default_factory=dict)


UNKNOWN_TYPES: Mapping[str, VehicleType] = {
    "vehicle": VehicleType("", "passenger", 5.0, 1.8, 1.5),
    "person": VehicleType("", "pedestrian", 0.215, 0.478, 1.719),
    "container": VehicleType("", "container", 6.096, 2.438, 2.591),
}
"""Stand-ins where a road user's type is not known, by kind; sizes are SUMO's (1.28)."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """The logged samples of one road user; raw, in time order, no duplicates.

    Angles are converted: yaw is counter-clockwise from east. The position is the
    middle of the front bumper on the ground.

    Attributes:
        id: SUMO's id.
        kind: `vehicle`, `person` or `container`.
        type_id: Its vType, or empty when the log has none.
        times: Strictly increasing, (n,) [s], n >= 1.
        positions: (n, 3) [m].
        yaws: (n,) [rad], not unwrapped.
        speeds: (n,) [m/s]; NaN where the log has none.
        slopes: Nose up, (n,) [rad]; 0 where the log has none.
        lanes: Index into `TrafficLog.lane_names`, (n,); -1 where the log has none.
        signals: SUMO's signal bits, (n,); -1 where the log has none.
        offsets: Place along the lane, (n,) [m]; NaN where the log has none, empty if unknown.
    """

    id: str
    kind: str
    type_id: str
    times: Floats
    positions: Floats
    yaws: Floats
    speeds: Floats
    slopes: Floats
    lanes: Ints
    signals: Ints
    offsets: Floats = field(default_factory=lambda: np.empty(0))

    @property
    def key(self) -> str:
        """Unique among road users of a log: a person may share a vehicle's id."""
        return f"{self.kind}:{self.id}"


def unique_ids(traces: Iterable[Trace | RoadUser]) -> Iterator[str]:
    """Return an id for each trace, unique among those of its kind.

    Where an id comes back with another type, `#2` (and so on) is appended to the later one's.
    """
    seen: set[tuple[str, str]] = set()
    for trace in traces:
        name, number = trace.id, 1
        while (trace.kind, name) in seen:
            number += 1
            name = f"{trace.id}#{number}"
        seen.add((trace.kind, name))
        yield name


@dataclass(frozen=True, slots=True, eq=False)
class TrafficLog:
    """All traces of a window of the vehicle log (FCD).

    An id that comes back with another type is another trace.

    Attributes:
        traces: In order of first appearance.
        lane_names: Lane (or edge) ids that the traces refer to.
        begin: First time step of the whole log that was seen [s].
        end: Last time step of the whole log that was seen [s].
        step: Median time between steps [s]; 0 for fewer than two steps.
        euler: Whether speeds are means of the step before; None is to be found from the traces.
        changed: When something about a road user changed, as trains split or join, by key [s].
        taken: When people ride in a vehicle, first and last time of each ride, by key [s].
    """

    traces: tuple[Trace, ...]
    lane_names: tuple[str, ...]
    begin: float
    end: float
    step: float
    euler: bool | None = None
    changed: Mapping[str, float] = field(default_factory=dict)
    taken: Mapping[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SignalPhases:
    """The states of one traffic light over time.

    Attributes:
        id: SUMO's tls id.
        times: When each state begins, strictly increasing [s].
        states: State strings, one letter per link.
    """

    id: str
    times: tuple[float, ...]
    states: tuple[str, ...]

    def state_at(self, time: float) -> str | None:
        """Return the state string at a time [s], or None before the first entry."""
        index = bisect_right(self.times, time + 1e-9) - 1
        return self.states[index] if index >= 0 else None


@dataclass(frozen=True, slots=True)
class Poi:
    """A point of interest.

    Attributes:
        id: SUMO's id.
        type: SUMO's type, may be empty.
        position: (x, y) [m].
        yaw: Counter-clockwise from east [rad], or None when the file gives no angle.
        colour: Linear sRGB in [0, 1], or None.
        source: The file it came from.
        params: Other attributes and `<param>` children.
    """

    id: str
    type: str
    position: tuple[float, float]
    yaw: float | None
    colour: tuple[float, float, float] | None
    source: str
    params: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Polygon:
    """A polygon or polyline of an additional file.

    Attributes:
        id: SUMO's id.
        type: SUMO's type, such as `building`; may be empty.
        shape: (n, 2) [m].
        fill: True for an area, False for a line.
        colour: Linear sRGB in [0, 1], or None.
        source: The file it came from.
        params: Other attributes and `<param>` children.
    """

    id: str
    type: str
    shape: Floats
    fill: bool
    colour: tuple[float, float, float] | None
    source: str
    params: Mapping[str, str] = field(default_factory=dict)


StopKind = Literal["bus", "train", "container", "charging"]
"""What a stop is for."""


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop of buses or trains, a place for containers or a charging station beside a lane.

    Attributes:
        id: SUMO's id.
        lane: Lane id.
        start: Where it begins on the lane [m], negative from the lane's end; None at its begin.
        end: Where it ends; None at the lane's end.
        kind: What it is for.
        lines: Names of the lines that stop there.
    """

    id: str
    lane: str
    start: float | None = None
    end: float | None = None
    kind: StopKind = "bus"
    lines: tuple[str, ...] = ()

    def span(self, length: float) -> tuple[float, float]:
        """Begin and end as shares of a lane of a length [m], in order, in [0, 1]."""
        ends = (self.start or 0.0, length if self.end is None else self.end)
        from_start = sorted(at + length if at < 0.0 else at for at in ends)
        low, high = (min(max(at / max(length, 1e-9), 0.0), 1.0) for at in from_start)
        return low, high


@dataclass(frozen=True, slots=True)
class Loop:
    """An induction loop in a lane, or one end of a lane area detector.

    Attributes:
        id: SUMO's id of the detector.
        lane: Lane id.
        at: Its place on the lane [m], negative from the lane's end.
    """

    id: str
    lane: str
    at: float


@dataclass(frozen=True, slots=True)
class Bay:
    """A place for one parked vehicle.

    Attributes:
        front: Middle of its front end, where SUMO puts the middle of a front bumper, x, y [m].
        yaw: Direction that the vehicle looks to [rad].
        length: [m].
        width: [m].
    """

    front: tuple[float, float]
    yaw: float
    length: float
    width: float

    def corners(self) -> Floats:
        """Front right, front left, rear left and rear right, (4, 2) [m]."""
        way = np.array([math.cos(self.yaw), math.sin(self.yaw)])
        left = 0.5 * self.width * np.array([-way[1], way[0]])
        front = np.array(self.front)
        rear = front - self.length * way
        return np.array([front - left, front + left, rear + left, rear - left])


@dataclass(frozen=True, slots=True)
class ParkingArea:
    """Where vehicles park, beside a lane or anywhere.

    Attributes:
        id: SUMO's id.
        lane: Lane id.
        bays: Along the lane, then those that have places of their own.
        roadside: How many of them lie along the lane.
    """

    id: str
    lane: str
    bays: tuple[Bay, ...]
    roadside: int


@dataclass(frozen=True, slots=True)
class ScenarioFiles:
    """Where a scenario's files lie.

    Attributes:
        network: The .net.xml(.gz).
        trajectories: FCD files, in order (SUMO can write persons apart).
        signals: Logs of SaveTLSStates, SaveTLSSwitchStates or SaveTLSSwitchTimes.
        additional: POIs, polygons, vTypes.
        vehicle_types: Route or additional files that hold vTypes.
        missing: Files that a .sumocfg names but that do not exist.
        tables: What some of the files were made of.
    """

    network: Path
    trajectories: tuple[Path, ...]
    signals: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    vehicle_types: tuple[Path, ...] = ()
    missing: tuple[Path, ...] = ()
    tables: tuple[MadeOfTable, ...] = ()


@dataclass(frozen=True, slots=True)
class TableColumn:
    """A column of a table of trajectories.

    Attributes:
        name: Its name in the table.
        unit: What its numbers are in; empty where names and values tell.
        zero: Where an angle of 0 points: `east` or `north`; empty where motion tells.
        turn: Whether angles grow to the `left` or to the `right`; empty where motion tells.
    """

    name: str
    unit: str = ""
    zero: str = ""
    turn: str = ""


@dataclass(frozen=True, slots=True)
class TableChoices:
    """How tables of trajectories are to be understood where they leave that open.

    Attributes:
        columns: Their columns, by what they hold, one of `model.numbers.TableRole`.
        point: Where on the body x and y are, one of `model.numbers.TablePoint`; empty
            where the form tells.
        downwards: Whether y grows downwards; None where the form tells.
        rate: Frames in a second [Hz]; None where the form tells.
        classes: vClasses by the words, or numbers, of the table.
    """

    columns: Mapping[str, TableColumn] = field(default_factory=dict)
    point: str = ""
    downwards: bool | None = None
    rate: float | None = None
    classes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MadeOfTable:
    """SUMO's files that were made of a table of trajectories.

    Attributes:
        table: The table.
        files: What was made of it.
        choices: How it was understood; nothing is left open.
        told: Whether its own form told that.
    """

    table: Path
    files: tuple[Path, ...]
    choices: TableChoices = field(compare=False)
    told: bool


@dataclass(frozen=True, slots=True)
class LandFiles:
    """Files that tell what the land is like.

    Attributes:
        heights: A height model.
        picture: What it looks like from above.
        corners: South-western and north-eastern corner of the picture in SUMO's coordinates [m];
            None where its file says where it lies.
    """

    heights: Path | None = None
    picture: Path | None = None
    corners: tuple[tuple[float, float], tuple[float, float]] | None = None


@dataclass(frozen=True, slots=True)
class LogChoices:
    """How a simulation is to be understood where its files leave that open.

    Attributes:
        allow_misfit: Whether what makes a log seem wrong, or of another network, is only noted.
        classes: vClasses by type id or pattern, for types that no file defines.
        land: What tells what the land is like.
    """

    allow_misfit: bool = False
    classes: Mapping[str, str] = field(default_factory=dict)
    land: LandFiles = field(default_factory=LandFiles)


@dataclass(frozen=True, slots=True)
class TypeGuess:
    """The vClass of a vehicle type that no file defines.

    Attributes:
        type_id: SUMO's id; empty for vehicles without a type.
        count: Number of its vehicles.
        vclass: What they are drawn as; empty where nothing tells.
        why: What tells it, as a clause.
    """

    type_id: str
    count: int
    vclass: str = ""
    why: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Scenario:
    """Everything that a simulation's files say about a time window.

    Attributes:
        network: The roads.
        traffic: What moved.
        vehicle_types: By id.
        signals: By tls id; empty when there is no log.
        pois: Of all additional files.
        polygons: Of all additional files.
        stops: Of buses, trains and containers, and charging stations, of all additional files.
        guesses: Types that no file defines, of vehicles in the window.
        parking: Parking areas of all additional files.
        loops: Of the detectors of all additional files.
        unseen: How many things of additional files have no body on a street, by their name.
    """

    network: Network
    traffic: TrafficLog
    vehicle_types: Mapping[str, VehicleType] = field(default_factory=dict)
    signals: Mapping[str, SignalPhases] = field(default_factory=dict)
    pois: tuple[Poi, ...] = ()
    polygons: tuple[Polygon, ...] = ()
    stops: tuple[Stop, ...] = ()
    guesses: tuple[TypeGuess, ...] = ()
    parking: tuple[ParkingArea, ...] = ()
    loops: tuple[Loop, ...] = ()
    unseen: Mapping[str, int] = field(default_factory=dict)
