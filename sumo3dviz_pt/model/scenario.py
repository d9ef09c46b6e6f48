"""A simulation as read from its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import (
    ParkingArea,
    Poi,
    Polygon,
    SignalPhases,
    Stop,
    TrafficLog,
    VehicleType,
)


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
    """

    network: Path
    trajectories: tuple[Path, ...]
    signals: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    vehicle_types: tuple[Path, ...] = ()
    missing: tuple[Path, ...] = ()


@dataclass(frozen=True, slots=True)
class LogChoices:
    """How a log is to be understood where its files leave that open.

    Attributes:
        allow_misfit: Whether what makes a log seem wrong, or of another network, is only noted.
        classes: vClasses by type id or pattern, for types that no file defines.
    """

    allow_misfit: bool = False
    classes: Mapping[str, str] = field(default_factory=dict)


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
