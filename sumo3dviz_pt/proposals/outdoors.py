"""What stands around a place, and what of it a camera would look at instead of the traffic.

Our code adds terrain on slopes, and rows of houses. Both are found as the world finds them, but
without cameras that keep their view clear: a house that stands in the way here may later be left
out, and never the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from scipy import ndimage

from sumo3dviz_pt.job.settings import GroundSettings, RoadSettings
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.proposals.busiest import Movement
from sumo3dviz_pt.world.land.ground import build_ground
from sumo3dviz_pt.world.objects.houses import height_of
from sumo3dviz_pt.world.objects.kinds import KINDS, kind_of
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.lanes import LaneIndex, build_lane_index
from sumo3dviz_pt.world.placement.surroundings import HeightAt, surroundings
from sumo3dviz_pt.world.roads.layout import RoadLayout, layout_roads
from sumo3dviz_pt.world.rows.fronts import Given, grow_rows, why_none
from sumo3dviz_pt.world.signals.signals import build_signals
from sumo3dviz_pt.world.street.furniture import stop_areas
from sumo3dviz_pt.world.street.lamps import LOW
from sumo3dviz_pt.world.street.lamps import WORDS as LAMPS

GROWN = 130.0
"""What our code adds is found up to this distance from a place, along each axis [m]."""

_ROOF = 16.0  # height of houses in rows, about [m]
_NEAR = 110.0  # houses farther than this from the place hide nothing [m]
_GRID = 2.5  # steps of the heights around the place that are kept [m]
_SEED = 1


@dataclass(frozen=True, slots=True, eq=False)
class Additions:
    """What our code adds.

    Attributes:
        land: Height of the terrain, or None where roads are level.
        houses: Plans of houses.
        roofs: Heights of their roofs above zero, one for each house [m].
    """

    land: HeightAt | None = None
    houses: list[shapely.Geometry] = field(default_factory=list)
    roofs: Floats = field(default_factory=lambda: np.zeros(0))


def additions(scenario: Scenario, network: Network, index: LaneIndex, place: Floats) -> Additions:
    """Return what our code adds around a place.

    Args:
        scenario: What it has put somewhere keeps its place.
        network: The roads near the place.
        index: Their lanes.
        place: (3,) [m].
    """
    if not network.edges:
        return Additions()
    layout = layout_roads(network, RoadSettings())
    land = None
    if not layout.cells.is_flat:
        settings = GroundSettings(horizon="flat")
        ground = build_ground(settings, network, roads=layout, textured=False)
        land = _sampled(ground.height_at, place)
    houses = _houses(scenario, network, layout, index, place)
    roofs = [float(index.heights(np.array(plan.centroid.coords))[0]) + _ROOF for plan in houses]
    return Additions(land, houses, np.array(roofs))


def _sampled(height_at: HeightAt, place: Floats) -> HeightAt:
    """Return the highest of a terrain near points, by a grid around a place, (n, 2) -> (n,) [m].

    Many thousand lines of sight are compared with it, for which the terrain itself is too slow.
    """
    steps = np.arange(-GROWN, GROWN + 0.5 * _GRID, _GRID)
    x, y = np.meshgrid(place[0] + steps, place[1] + steps, indexing="ij")
    heights = np.asarray(height_at(np.column_stack([x.ravel(), y.ravel()])))
    heights = ndimage.maximum_filter(heights.reshape(x.shape), size=3, mode="nearest")

    def land(places: Floats) -> Floats:
        """Return the height of the grid's point next to places, (n, 2) -> (n,) [m]."""
        cell = np.rint((places[:, :2] - place[:2] + GROWN) / _GRID).astype(np.int64)
        row, column = np.clip(cell, 0, len(steps) - 1).T
        return np.asarray(heights[row, column])

    return land


def _houses(
    scenario: Scenario, network: Network, layout: RoadLayout, index: LaneIndex, place: Floats
) -> list[shapely.Geometry]:
    """Plans of houses in rows near a place."""
    if why_none(scenario.polygons) is not None:
        return []
    around = surroundings(index, seed=_SEED, viewpoints=place[None], clearance=Clearance())
    fixed = Given(scenario.pois, (*scenario.polygons, *stop_areas(network, scenario.stops)))
    rows = grow_rows(network, layout.paved, fixed, around=around)
    plans = [shapely.Polygon(house.plan) for house in rows.houses]
    middle = shapely.Point(place[:2])
    return [plan for plan in plans if shapely.dwithin(plan, middle, _NEAR)]


REACH = 300.0
"""What stands farther than this from the place is no obstacle [m]."""

_POLE = 0.15  # radius of poles [m]
_HEAD = (0.35, 1.1)  # radius and height of a signal's head [m]
_BESIDE = 6.0  # houses farther than this from an axis are not measured [m]
_STANDS = 2.0  # who drives less than this during the shots is an obstacle [m]
_STEPS = np.linspace(0.06, 0.94, 12)  # shares of a ray at which the ground is compared
_ALONG = np.linspace(0.0, 1.0, 33)  # shares of an axis at which upright things are compared


@dataclass(frozen=True, slots=True, eq=False)
class Outdoors:
    """Everything near a place that may be in the way.

    Attributes:
        index: Lanes that something drives on.
        walls: Plans of buildings, (p,) polygons.
        tops: Heights of their roofs above zero, (p,) [m].
        posts: Upright cylinders: x, y, radius, bottom, top, (m, 5) [m].
        land: Height of the terrain, or None where roads are level.
    """

    index: LaneIndex
    walls: shapely.STRtree
    tops: Floats
    posts: Floats
    land: HeightAt | None = None

    def ground(self, places: Floats) -> Floats:
        """Return the height of road or terrain at places, (n, 2 or more) -> (n,) [m]."""
        road = self.index.heights(places[:, :2])
        return road if self.land is None else np.maximum(road, self.land(places[:, :2]))

    def on_road(self, places: Floats, *, margin: float) -> Bools:
        """Return which places, (n, 2 or more) [m], lie on a road or within a margin [m]."""
        return self.index.covers(places[:, :2], margin=margin)

    def off_road(self, places: Floats) -> Floats:
        """Return how far places, (n, 2 or more), are from the middle of a lane, (n,) [m].

        Where nothing drives, every place is as near.
        """
        if self.index.tree is None:
            return np.zeros(len(places))
        return self.index.nearest(places[:, :2])[1]

    def within(self, places: Floats, *, margin: float) -> Bools:
        """Return which places, (n, 3) [m], lie inside of something or within a margin [m]."""
        inside = np.zeros(len(places), dtype=np.bool_)
        if len(self.walls.geometries):
            spots = shapely.points(places[:, :2])
            place, wall = self.walls.query(spots, predicate="dwithin", distance=margin)
            low = places[place, 2] < self.tops[wall] + margin
            inside[place[low]] = True
        if len(self.posts):
            x, y, radius, bottom, top = self.posts.T
            away = np.hypot(places[:, :1] - x, places[:, 1:2] - y) - radius
            level = (places[:, 2:] > bottom - margin) & (places[:, 2:] < top + margin)
            inside |= ((away < margin) & level).any(axis=1)
        return inside

    def clear(self, eyes: Floats, targets: Floats) -> Floats:
        """Return how free the lines from eyes to targets are, (n,) in [0, 1].

        Args:
            eyes: (n, 3) [m].
            targets: (n, 3) [m].
        """
        free = np.ones(len(eyes))
        free[self._behind_walls(eyes, targets) | self._behind_posts(eyes, targets)] = 0.0
        return free * self.over_land(eyes, targets)

    def room(self, eyes: Floats, ends: Floats) -> Floats:
        """Return the distance between axes of cameras and what stands beside them, (n,) [m].

        Args:
            eyes: Where the axes begin, (n, 3) [m].
            ends: Where they end, (n, 3) [m].
        """
        points = eyes[:, None] + _ALONG[None, :, None] * (ends - eyes)[:, None]
        room = np.full(len(eyes), np.inf)
        if len(self.walls.geometries):
            axes = shapely.linestrings(np.stack([eyes[:, :2], ends[:, :2]], axis=1))
            axis, wall = self.walls.query(axes, predicate="dwithin", distance=_BESIDE)
            spots = shapely.points(points[axis, :, :2])
            aside = shapely.distance(spots, self.walls.geometries[wall][:, None])
            level = np.maximum(points[axis, :, 2] - self.tops[wall][:, None], 0.0)
            np.minimum.at(room, axis, np.hypot(aside, level).min(axis=1))
        for x, y, radius, bottom, top in self.posts.tolist():
            level = np.maximum(np.maximum(bottom - points[..., 2], points[..., 2] - top), 0.0)
            aside = np.maximum(np.hypot(points[..., 0] - x, points[..., 1] - y) - radius, 0.0)
            room = np.minimum(room, np.hypot(level, aside).min(axis=1))
        return room

    def over_land(self, eyes: Floats, targets: Floats) -> Floats:
        """Return how free the lines from eyes to targets are of hills, (n,) in [0, 1].

        Args:
            eyes: (n, 3) [m].
            targets: (n, 3) [m].
        """
        free = np.ones(len(eyes))
        hilly = self.index.tree is not None and float(np.ptp(self.index.points[:, 2])) > 1.0
        if not len(eyes) or not hilly:
            return free
        points = eyes[:, None] + _STEPS[None, :, None] * (targets - eyes)[:, None]
        flat = points.reshape(-1, 3)
        heights = self.index.heights(flat[:, :2]) if self.land is None else self.land(flat)
        above = (flat[:, 2] - heights).reshape(points.shape[:2])
        free[(above < 0.2).any(axis=1)] = 0.0
        return free

    def _behind_walls(self, eyes: Floats, targets: Floats) -> Bools:
        """Which lines a building crosses below its roof."""
        hidden = np.zeros(len(eyes), dtype=np.bool_)
        if not len(self.walls.geometries):
            return hidden
        lines = shapely.linestrings(np.stack([eyes[:, :2], targets[:, :2]], axis=1))
        ray, wall = self.walls.query(lines, predicate="intersects")
        below = np.maximum(eyes[ray, 2], targets[ray, 2]) < self.tops[wall]
        hidden[ray[below]] = True
        # Some begin above a roof and pass it; those that fall are lowest where they leave it.
        ray, wall = ray[~below & ~hidden[ray]], wall[~below & ~hidden[ray]]
        if not len(ray):
            return hidden
        crossed = shapely.intersection(lines[ray], self.walls.geometries[wall])
        ends = shapely.points(targets[ray, :2])
        length = np.maximum(np.hypot(*(targets - eyes)[ray, :2].T), 1e-6)
        share = 1.0 - shapely.distance(crossed, ends) / length
        height = eyes[ray, 2] + share * (targets - eyes)[ray, 2]
        hidden[ray[height < self.tops[wall]]] = True
        return hidden

    def _behind_posts(self, eyes: Floats, targets: Floats) -> Bools:
        """Which lines pass through a cylinder."""
        hidden = np.zeros(len(eyes), dtype=np.bool_)
        way = targets - eyes
        square = np.maximum((way[:, :2] ** 2).sum(axis=1), 1e-9)
        for x, y, radius, bottom, top in self.posts.tolist():
            towards = np.array([x, y]) - eyes[:, :2]
            share = (towards * way[:, :2]).sum(axis=1) / square
            aside = np.abs(towards[:, 0] * way[:, 1] - towards[:, 1] * way[:, 0]) / np.sqrt(square)
            height = eyes[:, 2] + share * way[:, 2]
            between = (share > 0.0) & (share < 0.97)
            hidden |= between & (aside < radius) & (height > bottom) & (height < top)
        return hidden


def outdoors(
    scenario: Scenario, place: Floats, movement: Movement, *, textured: bool = True
) -> Outdoors:
    """Return what stands around a place.

    Args:
        scenario: Roads, signals, buildings and plants.
        place: Around which the cameras are, (3,) [m].
        movement: Everyone near, while the shots last; who stands is in the way.
        textured: Whether our code adds houses; none stand where everything is plain.
    """
    network = near_network(scenario.network, place, REACH)
    index = build_lane_index(network)
    walls, tops = _walls(scenario, place, index)
    close = near_network(network, place, GROWN)
    added = additions(scenario, close, index, place) if textured else Additions()
    walls += added.houses
    tops = np.concatenate([tops, added.roofs])
    posts = [*_plants(scenario, place, index), *_signals(scenario, network, index)]
    posts += _standing(scenario, movement)
    upright = np.array(posts, dtype=np.float64).reshape(-1, 5)
    return Outdoors(index, shapely.STRtree(walls), tops, upright, added.land)


def near_network(network: Network, place: Floats, reach: float) -> Network:
    """Return the edges of a network that come near a place, and their connections.

    Args:
        network: Of any size.
        place: (2,) or (3,) [m].
        reach: How near, along each axis [m].
    """
    edges = {name: edge for name, edge in network.edges.items() if edge.lanes}
    shapes = [edge.lanes[0].shape[:, :2] for edge in edges.values()]
    if not shapes:
        return network
    boxes = shapely.bounds(np.array([shapely.LineString(shape) for shape in shapes]))
    near = (boxes[:, :2] <= place[:2] + reach).all(axis=1)
    near &= (boxes[:, 2:] >= place[:2] - reach).all(axis=1)
    edges_near = {name: edges[name] for name, close in zip(edges, near, strict=True) if close}
    lanes = {lane.id for edge in edges_near.values() for lane in edge.lanes}
    links = tuple(c for c in network.connections if c.from_lane in lanes and c.to_lane in lanes)
    return replace(network, edges=edges_near, connections=links)


def _walls(
    scenario: Scenario, place: Floats, index: LaneIndex
) -> tuple[list[shapely.Geometry], Floats]:
    """Plans of buildings near a place, and the heights of their roofs above zero [m]."""
    plans, tops = [], []
    for item in scenario.polygons:
        low, high = item.shape[:, :2].min(axis=0), item.shape[:, :2].max(axis=0)
        near = (low < place[:2] + REACH).all() and (high > place[:2] - REACH).all()
        if not near or len(item.shape) < 3:
            continue
        if kind_of(item.type, item.source) == "buildings":
            plan = shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
            plans.append(plan)
            # Roofs rise above walls.
            height = height_of(item, float(plan.area), 1) + 2.0
            tops.append(float(index.heights(item.shape[:, :2]).min()) + height)
    return plans, np.array(tops)


def _plants(scenario: Scenario, place: Floats, index: LaneIndex) -> list[tuple[float, ...]]:
    """Trees, shrubs, houses at points and lamps of the scenario, as cylinders."""
    spaces = {kind.name: kind.space for kind in KINDS}
    posts: list[tuple[float, ...]] = []
    for poi in scenario.pois:
        x, y = poi.position
        if abs(x - place[0]) > REACH or abs(y - place[1]) > REACH:
            continue
        ground = float(index.heights(np.array([[x, y]]))[0])
        space = spaces.get(kind_of(poi.type, poi.source) or "")
        if space is not None:
            posts.append((x, y, space.radius, ground + space.bottom, ground + space.top))
        elif poi.type.lower().split(".")[0] in LAMPS:
            posts.append((x, y, _POLE, ground, ground + LOW + 0.5))
    return posts


def _signals(scenario: Scenario, network: Network, index: LaneIndex) -> list[tuple[float, ...]]:
    """Poles and heads of traffic lights, as cylinders."""
    from sumo3dviz_pt.job.settings import SignalSettings
    from sumo3dviz_pt.world.placement.surroundings import Surroundings

    around = Surroundings(index, index.heights, np.zeros((0, 3)), 1)
    heads = build_signals(network, scenario.signals, SignalSettings(), around=around).heads
    posts: list[tuple[float, ...]] = []
    for head in heads:
        x, y, low = head.position.tolist()
        foot_x, foot_y, foot = head.foot.tolist()
        posts.append((foot_x, foot_y, _POLE, foot, max(low + _HEAD[1], foot + 3.2)))
        posts.append((x, y, _HEAD[0], low, low + _HEAD[1]))
        # The arm that it hangs on.
        length = float(np.hypot(x - foot_x, y - foot_y))
        for share in np.arange(0.5, length, 1.0) / max(length, 1e-9) if head.over_road else ():
            x_at, y_at = foot_x + share * (x - foot_x), foot_y + share * (y - foot_y)
            posts.append((x_at, y_at, 0.5, low + 0.7, low + _HEAD[1]))
    # Heads share poles and arms.
    return sorted({tuple(np.round(post, 2).tolist()) for post in posts})


def _standing(scenario: Scenario, movement: Movement) -> list[tuple[float, ...]]:
    """Vehicles that stand all the time, as three cylinders each."""
    posts: list[tuple[float, ...]] = []
    users, driven = movement.distances()
    for user in users[driven < _STANDS].tolist():
        trace = movement.traces[user]
        kind = scenario.vehicle_types.get(trace.type_id)
        if kind is None or trace.kind != "vehicle":
            continue
        row = int(np.flatnonzero(movement.users == user)[0])
        x, y, z = movement.places[row].tolist()
        yaw = float(movement.yaws[row])
        for share in (0.15, 0.5, 0.85):
            back = share * kind.length
            x_at, y_at = x - back * np.cos(yaw), y - back * np.sin(yaw)
            posts.append((x_at, y_at, 0.5 * kind.width, z, z + kind.height))
    return posts
