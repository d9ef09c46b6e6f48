"""Who is in a vehicle log: one line for each road user, without the samples."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Point:
    """A place to look from, and how far.

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
    """A road user's way past a point.

    Attributes:
        begin: First time within the asked radius [s].
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
        length: Of its drive, without gaps and teleports [m].
        mean_speed: Over that drive, waiting included [m/s].
        max_speed: The largest that is logged, or shown where none is [m/s].
        lanes: How many lanes it uses, those on junctions left out.
        edges: That it uses, in order, those on junctions left out.
        place: Where it is at the time that was asked for.
        passage: Its way past the point that was asked for.
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
