"""The road network as SUMO describes it, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sumo3dviz_pt.model.geometry import Floats

_DIGITS = 7
"""Decimals that coordinates keep [m]: those of SUMO's files, which 1e8 m from 0 still hold."""

UNKNOWN_SPEED = 27.78
"""Limit of roads of which SUMO's type map for OpenStreetMap knows none [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Lane:
    """One lane, also internal lanes, crossings and walking areas.

    Attributes:
        id: SUMO's id, `<edge>_<index>`.
        edge_id: The edge it belongs to.
        index: 0 is the outermost lane (right in right-hand traffic).
        shape: Centre line along the driving direction, (n, 3) [m], n >= 2.
            A walking area's shape is its outline.
        width: [m], > 0.
        speed: Limit [m/s].
        length: SUMO's length [m], which may differ from the shape's.
        allowed: vClasses that may use it, with `allow`/`disallow` resolved.
        outline: A crossing's own outline if the file has one, (n, 3) [m].
        up: vClasses that may change to the lane with the next higher index (`changeLeft`).
        down: The same of the next lower index (`changeRight`); None, as of `up`, lets all.
    """

    id: str
    edge_id: str
    index: int
    shape: Floats
    width: float
    speed: float
    length: float
    allowed: frozenset[str]
    outline: Floats | None = None
    up: frozenset[str] | None = None
    down: frozenset[str] | None = None

    def keeps(self, classes: frozenset[str] | None) -> bool:
        """Return whether its traffic may not change lanes: cars, or whoever drives on it.

        Args:
            classes: Who may, such as `up`.
        """
        usual = self.allowed & {"passenger"} or self.allowed
        return classes is not None and bool(usual) and not usual & classes


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """A directed road between two junctions.

    Attributes:
        id: SUMO's id.
        function: `normal`, `internal`, `crossing`, `walkingarea` or `connector`.
        from_junction: Junction at its start; empty for internal edges.
        to_junction: Junction at its end; empty for internal edges.
        lanes: From index 0 up.
        type: SUMO's edge type, such as `highway.motorway`; may be empty.
        priority: SUMO's priority.
        crossed_edges: For a crossing, the edges that it crosses.
        name: Of its street; may be empty.
    """

    id: str
    function: str
    from_junction: str
    to_junction: str
    lanes: tuple[Lane, ...]
    type: str = ""
    priority: int = -1
    crossed_edges: tuple[str, ...] = ()
    name: str = ""

    @property
    def told_speed(self) -> float:
        """Highest limit of its lanes [m/s]; 0 where that tells nothing.

        SUMO's type map gives roads of OpenStreetMap whose limit is unknown 100 km/h. Where people
        walk or cycle on such a road, it may be any street. Who draws a network means its limits.
        """
        fastest = max(lane.speed for lane in self.lanes)
        slow = any(lane.allowed & {"pedestrian", "bicycle"} for lane in self.lanes)
        mapped = self.type.startswith("highway.")
        return 0.0 if mapped and slow and abs(fastest - UNKNOWN_SPEED) < 0.05 else fastest


@dataclass(frozen=True, slots=True, eq=False)
class Junction:
    """A node.

    Attributes:
        id: SUMO's id.
        type: `traffic_light`, `priority`, `dead_end`, `internal`, ...
        position: (3,) [m].
        outline: Polygon, (n, 3) [m]; n may be 0.
        incoming_lanes: Ids of the lanes that lead in.
    """

    id: str
    type: str
    position: Floats
    outline: Floats
    incoming_lanes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Connection:
    """A connection from lane to lane.

    Attributes:
        from_lane: Lane id.
        to_lane: Lane id.
        via: Internal lane id, or empty.
        tls: Id of the traffic light that controls it, or empty.
        link_index: Index of its letter in the state string, or -1.
        direction: SUMO's `dir`: s, r, l, R, L, t (turn), invalid.
        state: SUMO's `state` letter.
    """

    from_lane: str
    to_lane: str
    via: str = ""
    tls: str = ""
    link_index: int = -1
    direction: str = "s"
    state: str = ""


@dataclass(frozen=True, slots=True)
class Location:
    """Where the network lies on the Earth, and from where its coordinates are counted.

    Attributes:
        net_offset: Added to projected coordinates to give ours, (x, y) [m].
        boundary: Our coordinates x0, y0, x1, y1 [m].
        projection: PROJ string, or "!" when there is none.
        place: Latitude and longitude of the boundary's middle [deg]; None if they are not known.
        convergence: How far the y axis points clockwise from true north there [rad].
        origin: Where our coordinates are 0 in SUMO's, whole kilometres, (x, y) [m]. Users and files
            say and hear SUMO's: `inside` and `outside` are the way between both.
    """

    net_offset: tuple[float, float] = (0.0, 0.0)
    boundary: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    projection: str = "!"
    place: tuple[float, float] | None = None
    convergence: float = 0.0
    origin: tuple[float, float] = (0.0, 0.0)

    def inside(self, places: ArrayLike) -> Floats:
        """Return our coordinates of SUMO's, (..., 2) or (..., 3) [m], without rounding errors."""
        moved = np.array(places, dtype=np.float64)
        moved[..., :2] = np.round(moved[..., :2] - self.origin, _DIGITS) + 0.0
        return moved

    def outside(self, places: ArrayLike) -> Floats:
        """Return SUMO's coordinates of ours, (..., 2) or (..., 3) [m]."""
        moved = np.array(places, dtype=np.float64)
        moved[..., :2] += self.origin
        return moved

    def outside_pose(self, matrix: ArrayLike) -> Floats:
        """Return a transform into SUMO's coordinates of one into ours, (4, 4)."""
        moved = np.array(matrix, dtype=np.float64)
        moved[:3, 3] = self.outside(moved[:3, 3])
        return moved


UNPLACED = Location()
"""For what is built without a network: all coordinates are SUMO's."""


@dataclass(frozen=True, slots=True, eq=False)
class Heights:
    """Heights of the land, on a grid whose rows go north.

    Attributes:
        corner: x and y of the first value, in our coordinates [m].
        step: Between values, in x and y [m].
        values: (rows, columns) [m]; NaN where nothing is known.
    """

    corner: tuple[float, float]
    step: tuple[float, float]
    values: Floats

    def at(self, places: ArrayLike) -> Floats:
        """Return heights at places, (n, 2) or (n, 3) -> (n,) [m]; NaN where nothing is known."""
        flat = np.asarray(places, dtype=np.float64)[:, :2]
        column, row = ((flat - self.corner) / self.step).T
        rows, columns = self.values.shape
        inside = (row >= 0) & (row <= rows - 1) & (column >= 0) & (column <= columns - 1)
        i = np.clip(np.floor(np.nan_to_num(row)).astype(np.int64), 0, max(rows - 2, 0))
        j = np.clip(np.floor(np.nan_to_num(column)).astype(np.int64), 0, max(columns - 2, 0))
        up, right = row - i, column - j
        above, beside = np.minimum(i + 1, rows - 1), np.minimum(j + 1, columns - 1)
        low = self.values[i, j] * (1 - right) + self.values[i, beside] * right
        high = self.values[above, j] * (1 - right) + self.values[above, beside] * right
        return np.where(inside, low * (1 - up) + high * up, np.nan)

    def share(self, places: ArrayLike, *, fade: float) -> Floats:
        """Return how much heights count at places, (n, 2) -> (n,), in [0, 1].

        Args:
            places: [m].
            fade: Distance to the grid's edge within which they count less [m].
        """
        flat = np.asarray(places, dtype=np.float64)[:, :2]
        extent = (np.array(self.values.shape[::-1]) - 1) * self.step
        from_low, from_high = flat - self.corner, self.corner + extent - flat
        away = np.minimum(from_low, from_high).min(axis=1)
        known = np.isfinite(self.at(flat))
        return np.where(known, np.clip(away / fade, 0.0, 1.0), 0.0)


@dataclass(frozen=True, slots=True)
class GroundPicture:
    """What the land looks like from above.

    Attributes:
        file: A picture; its upper edge lies in the north.
        box: x0, y0, x1, y1 of its edges, in our coordinates [m].
    """

    file: Path
    box: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """A road network.

    Attributes:
        edges: By id, of every function.
        junctions: By id.
        connections: All of them, also from internal lanes.
        location: Its place on the Earth.
        left_hand: True where traffic keeps left.
        heights: Of the land, where they are known.
        raised_by: How far roads with heights above the land were raised onto it, and so are road
            users whose log has heights; None where they were not.
        picture: Of the land from above, if there is one.
        lanes: By id, of every edge.
    """

    edges: Mapping[str, Edge]
    junctions: Mapping[str, Junction]
    connections: tuple[Connection, ...]
    location: Location
    left_hand: bool = False
    heights: Heights | None = None
    raised_by: Heights | None = None
    picture: GroundPicture | None = None
    lanes: Mapping[str, Lane] = field(init=False)

    def __post_init__(self) -> None:
        """Index the lanes."""
        lanes = {lane.id: lane for edge in self.edges.values() for lane in edge.lanes}
        object.__setattr__(self, "lanes", lanes)
