"""Plain XML of our own: nodes, edges and connections that netconvert turns into a network."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Road:
    """An edge, or two in opposite directions.

    Attributes:
        start: Id of the node where it begins.
        end: Id of the node where it ends.
        lanes: Number of lanes.
        more: Further attributes, as XML.
        lane_xml: What stands inside the element, such as lanes of their own width.
        back: Whether there is an edge in the other direction too.
        name: Id of the edge; made of the nodes' ids where empty.
    """

    start: str
    end: str
    lanes: int = 1
    more: str = 'speed="13.8"'
    lane_xml: str = ""
    back: bool = True
    name: str = ""

    def xml(self) -> str:
        """Return the elements of its edges."""
        name = self.name or f"{self.start}{self.end}"
        ways = [(name, self.start, self.end)]
        ways += [(f"-{name}", self.end, self.start)] * self.back
        return "\n".join(
            f'<edge id="{key}" from="{a}" to="{b}" numLanes="{self.lanes}" {self.more}>'
            f"{self.lane_xml}</edge>"
            for key, a, b in ways
        )


@dataclass(frozen=True, slots=True)
class Plain:
    """A network before netconvert.

    Attributes:
        nodes: Places of nodes, (x, y) or (x, y, z) [m], by id.
        roads: Edges.
        kinds: Types of nodes that are not `priority`, by id.
        links: Further elements of the file of connections, as XML.
        degrees: Whether places are longitudes and latitudes [deg].
    """

    nodes: Mapping[str, Sequence[float]]
    roads: Sequence[Road]
    kinds: Mapping[str, str]
    links: str = ""
    degrees: bool = False

    def files(self) -> dict[str, str]:
        """Return the files' contents by name."""
        nodes = "\n".join(
            f'<node id="{key}" '
            + " ".join(f'{name}="{v:.6f}"' for name, v in zip("xyz", place, strict=False))
            + f' type="{self.kinds.get(key, "priority")}"/>'
            for key, place in self.nodes.items()
        )
        roads = "\n".join(road.xml() for road in self.roads)
        return {
            "n.nod.xml": f"<nodes>\n{nodes}\n</nodes>",
            "n.edg.xml": f"<edges>\n{roads}\n</edges>",
            "n.con.xml": f"<connections>\n{self.links}\n</connections>",
        }


def star(count: int, reach: float, *, kind: str = "priority", turn: float = 0.0) -> Plain:
    """Return a junction in the middle of some roads.

    Args:
        count: Number of roads.
        reach: Their length [m].
        kind: Type of the junction.
        turn: Direction of the first road [rad].
    """
    nodes: dict[str, Sequence[float]] = {"m": (0.0, 0.0)}
    for number in range(count):
        angle = turn + 2 * math.pi * number / count
        nodes[f"n{number}"] = (reach * math.cos(angle), reach * math.sin(angle))
    roads = [Road(f"n{number}", "m") for number in range(count)]
    return Plain(nodes, roads, {"m": kind})


def chain(places: Sequence[Sequence[float]], *, lanes: int = 1, more: str = "", back: bool = True):
    """Return a road through places, as plain XML.

    Args:
        places: (x, y) or (x, y, z) [m].
        lanes: Number of lanes.
        more: Further attributes of its edges, as XML.
        back: Whether there are lanes in the other direction.
    """
    names = [f"p{number}" for number in range(len(places))]
    ends = itertools.pairwise(names)
    more = more or 'speed="13.8"'
    roads = [Road(a, b, lanes=lanes, more=more, back=back) for a, b in ends]
    return Plain(dict(zip(names, places, strict=True)), roads, {})


def ring(radius: float, arms: int, *, left: bool = False) -> Plain:
    """Return a roundabout with roads that lead to it.

    Args:
        radius: Of the circle [m].
        arms: Number of roads.
        left: Whether traffic keeps left, and so turns clockwise.
    """
    nodes: dict[str, Sequence[float]] = {}
    roads = []
    for number in range(arms):
        angle = 2 * math.pi * number / arms
        c, s = math.cos(angle), math.sin(angle)
        nodes[f"r{number}"] = (radius * c, radius * s)
        nodes[f"o{number}"] = ((radius + 90) * c, (radius + 90) * s)
        roads.append(Road(f"o{number}", f"r{number}"))
        ahead = (number + 1) % arms
        first, last = (ahead, number) if left else (number, ahead)
        begin = 2 * math.pi * first / arms
        step = (-1 if left else 1) * 2 * math.pi / arms / 6
        shape = " ".join(
            f"{radius * math.cos(begin + k * step):.2f},{radius * math.sin(begin + k * step):.2f}"
            for k in range(7)
        )
        more = f'speed="8.3" priority="9" shape="{shape}"'
        roads.append(Road(f"r{first}", f"r{last}", more=more, back=False))
    return Plain(nodes, roads, {})
