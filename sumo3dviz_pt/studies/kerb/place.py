"""Where a person stands who wants to cross: a place beside the road, and the way across it."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.inspection.roster import point_of
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Edge, Lane, Network
from sumo3dviz_pt.studies.measured.observer import height_at, nearest_lane, way_across

_BESIDE = 0.5
"""How far beside the carriageway a place is put that was on it [m]."""

_STANDS = 8.0
"""A place nearer than this to the carriageway stays where it is [m]."""

_ON_FOOT = frozenset({"pedestrian"})


@dataclass(frozen=True, slots=True, eq=False)
class Kerb:
    """A place beside a road, in SUMO's coordinates.

    Attributes:
        position: (2,) [m].
        across: Both ends of the way over the road, (2, 2) [m]; it begins at `position`.
        height: Of the road there [m].
        words: How the place was found.
    """

    position: Floats
    across: Floats
    height: float
    words: str


def kerb_at(job: Job, network: Network, text: str) -> Kerb:
    """Return a kerb that is named by a place, a camera, a crossing, an edge or a lane.

    Args:
        job: Of the cameras.
        network: The roads.
        text: `X,Y` or `X,Y,R` [m], a standing camera, or the id of a crossing, edge or lane. A
            place on the road, or farther from it than people stand, is moved to its edge.

    Raises:
        ConfigError: If there is no such place, or no road for cars is near.
    """
    edge = network.edges.get(text)
    if edge is not None and edge.function == "crossing":
        return _of_crossing(edge, network)
    lane = network.lanes.get(text) or (edge.lanes[0] if edge is not None else None)
    if lane is not None:
        line = network.location.outside(lane.shape)[:, :2]
        return _beside(_middle(line), network, f"beside the middle of {text}", radius=np.inf)
    if "," not in text and text not in job.cameras:
        like = get_close_matches(text, [*job.cameras, *network.edges], 1)
        hint = f"; did you mean {like[0]!r}?" if like else ""
        raise ConfigError(
            f"{cut(text)!r} is no place{hint}; write X,Y or X,Y,RADIUS [m], or the name of a"
            " standing camera, a crossing, an edge or a lane",
            key="kerb",
        )
    point = point_of(job, text, key="kerb")
    return _beside(np.array([point.x, point.y]), network, "", radius=point.radius)


def _of_crossing(edge: Edge, network: Network) -> Kerb:
    """Return the end of a crossing that is nearer to the lanes where its network begins it."""
    line = network.location.outside(edge.lanes[0].shape)
    across = line[[0, -1], :2]
    return Kerb(across[0], across, float(line[0, 2]), f"at an end of crossing {edge.id}")


def _middle(line: Floats) -> Floats:
    """Return the point half way along a line, (2,) [m]."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    return np.array([np.interp(way[-1] / 2.0, way, line[:, axis]) for axis in (0, 1)])


def _beside(place: Floats, network: Network, words: str, *, radius: float) -> Kerb:
    """Return the kerb that is meant by a place on or near a road."""
    nearest = nearest_lane(place, network)
    if nearest is None or nearest[0] > radius:
        away = "there is none" if nearest is None else f"the nearest is {nearest[0]:.0f} m away"
        raise ConfigError(
            f"no lane for cars is near {place[0]:.1f}, {place[1]:.1f}: {away}", key="kerb"
        )
    _, middle, along, lane = nearest
    left = np.array([-along[1], along[0]])
    low, high = _carriageway(lane, network, middle, left)
    aside = float((place - middle) @ left)
    # On the road, people stand where its outermost lane is.
    outer = -1.0 if not network.left_hand else 1.0
    side = np.sign(aside) if not low <= aside <= high else outer
    edge = high if side > 0 else -low
    if not edge < side * aside <= edge + _STANDS:
        along_road = float((place - middle) @ along)
        place = middle + along_road * along * (abs(along_road) < 1.0)
        place = place + side * (edge + _BESIDE) * left
        words = words or "moved to the edge of the road"
    way = way_across(place, network)
    assert way is not None
    return Kerb(place, way, height_at(place, network), words)


def _carriageway(lane: Lane, network: Network, middle: Floats, left: Floats) -> tuple[float, float]:
    """Return how far an edge's lanes for vehicles reach from a point to the right and left [m]."""
    reach = []
    for each in network.edges[lane.edge_id].lanes:
        if not each.allowed or each.allowed <= _ON_FOOT:
            continue
        line = network.location.outside(each.shape)[:, :2]
        aside = float((_nearest_point(line, middle) - middle) @ left)
        reach += [aside - each.width / 2.0, aside + each.width / 2.0]
    return min(reach), max(reach)


def _nearest_point(line: Floats, place: Floats) -> Floats:
    """Return the point of a line that is nearest to a place, (2,) [m]."""
    steps = np.diff(line, axis=0)
    sizes = np.maximum((steps**2).sum(axis=1), 1e-12)
    shares = np.clip(((place - line[:-1]) * steps).sum(axis=1) / sizes, 0.0, 1.0)
    points = line[:-1] + shares[:, None] * steps
    return np.asarray(points[np.argmin(np.linalg.norm(points - place, axis=1))])
