"""The road users of a vehicle log, one value each, without the samples."""

from __future__ import annotations

from dataclasses import dataclass


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
