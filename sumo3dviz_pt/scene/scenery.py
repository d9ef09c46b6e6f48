"""Static objects of a scene: which, where, how detailed, merged into few parts."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.job import ObjectSettings, ObjectsSettings
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, Transform, merge_meshes
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.scene.chance import share_of
from sumo3dviz_pt.scene.kinds import KINDS, Kind, body_of, checked_models
from sumo3dviz_pt.scene.lane_index import LaneIndex, build_lane_index
from sumo3dviz_pt.scene.outlined import area_parts, line_parts
from sumo3dviz_pt.scene.scenery_choice import chosen

_LOG = logging.getLogger(__name__)

FARTHEST = 4000.0
"""Objects farther than this from every camera are left out [m]."""

BUDGET = 700_000
"""Triangles of all static objects of a shot, at most (about)."""

_SINK = 0.05  # how far objects stand below the nearest road [m]

HeightAt = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class Scenery:
    """The static objects of a scene.

    Attributes:
        static: Few parts per kind, in world coordinates.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...]
    left_out: tuple[LeftOut, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What objects are placed by.

    Attributes:
        index: The network's lanes.
        height_at: Height of the ground at points, (n, 2) [m].
        viewpoints: Where cameras are during the shot, (n, 3) [m]; n may be 0.
        seed: Of all chance.
        keep_clear: Distance that objects keep from cameras [m].
    """

    index: LaneIndex
    height_at: HeightAt
    viewpoints: Floats
    seed: int
    keep_clear: float

    def distances(self, places: Floats) -> Floats:
        """Horizontal distance of places, (n, 2) [m], to the nearest camera; 100 m without any."""
        if not len(self.viewpoints):
            return np.full(len(places), 100.0)
        found: Floats = cKDTree(self.viewpoints[:, :2]).query(places[:, :2])[0]
        return found


def build_scenery(
    pois: Sequence[Poi],
    polygons: Sequence[Polygon],
    settings: ObjectsSettings,
    *,
    network: Network,
    seed: int,
    viewpoints: Floats | None = None,
    keep_clear: float = 1.0,
    height_at: HeightAt | None = None,
    index: LaneIndex | None = None,
    budget: int = BUDGET,
) -> Scenery:
    """Build trees, fences, homes, shops, blocks and buildings.

    Args:
        pois: Points of interest of the scenario.
        polygons: Polygons and lines of the scenario.
        settings: Which kinds, from which files, how large and which colour.
        network: Gives heights and the roads that houses face.
        seed: Of sizes, models and colours; stable per id.
        viewpoints: Cameras of the shot, (n, 3) [m]; None means 100 m from everything.
        keep_clear: Objects that a camera would be in, or closer to than this [m], go.
        height_at: Height of the ground at points, (n, 2) [m]; default the nearest road's.
        index: The network's lanes, if somebody indexed them already.
        budget: Triangles, about; levels of detail come closer until they keep it.

    Raises:
        ConfigError: If a model or colour of the settings does not exist.
    """
    lanes = index or build_lane_index(network)
    cameras = np.zeros((0, 3)) if viewpoints is None else np.asarray(viewpoints).reshape(-1, 3)
    around = Surroundings(
        lanes, height_at or (lambda places: lanes.heights(places) - _SINK), cameras, seed, keep_clear
    )
    left_out: list[LeftOut] = []
    groups = []
    for kind in KINDS:
        own: ObjectSettings | None = getattr(settings, kind.name)
        items = chosen(kind, own, pois, polygons)
        if own is None or not items:
            why = "switched off" if own is None and items else "the scenario has none"
            left_out.append(LeftOut(kind.name, why))
            continue
        checked_models(kind, own)
        kept, gone = _sorted_out(kind, items, around)
        left_out += gone
        groups.append((kind, own, kept))
    shrink = _shrunk_levels([(kind, items) for kind, _, items in groups], around, budget)
    static = []
    for kind, own, items in groups:
        parts = _BUILDERS[kind.form](kind, own, items, (around, shrink))
        static += merged(kind.name, parts)
    return Scenery(tuple(static), tuple(left_out))


def merged(family: str, parts: Sequence[Part]) -> list[StaticPart]:
    """One static part per material of a family."""
    by_material: dict[str, list[Part]] = {}
    for part in parts:
        by_material.setdefault(part.material, []).append(part)
    found = []
    for material, some in sorted(by_material.items()):
        mesh = merge_meshes([part.mesh for part in some])
        tints = [part.tint for part in some if part.tint is not None]
        tint = np.concatenate(tints) if tints else None
        found.append(StaticPart(f"{family}/{material}", family, Part(mesh, material, tint)))
    return found


def levels_of(kind: Kind, distances: Floats, shrink: float) -> Ints:
    """Level of detail at distances [m]; `shrink` in (0, 1] draws the limits in."""
    return np.searchsorted(np.array(kind.levels) * shrink, distances, side="right")


def _places(items: Sequence[Poi] | Sequence[Polygon]) -> Floats:
    """One place per object, (n, 2) [m]."""
    return np.array([
        item.position if isinstance(item, Poi) else item.shape[:, :2].mean(axis=0) for item in items
    ]).reshape(-1, 2)


def _sorted_out(
    kind: Kind, items: Sequence[Poi] | Sequence[Polygon], around: Surroundings
) -> tuple[list[Poi | Polygon], list[LeftOut]]:
    """Objects without those that stand on a road, around a camera or out of sight."""
    places = _places(items)
    reasons: Counter[str] = Counter()
    keep: list[Poi | Polygon] = []
    on_road = around.index.covers(places)
    distances = around.distances(places)
    for item, place, road, distance in zip(items, places, on_road, distances, strict=True):
        if road and kind.form != "line":
            reasons["they stand on a carriageway"] += 1
        elif distance > FARTHEST and kind.form != "line":
            reasons[f"they are farther than {FARTHEST:.0f} m from every camera"] += 1
        elif _blocks_camera(kind, place, around):
            reasons["a camera would be inside them"] += 1
        else:
            keep.append(item)
    for why, count in reasons.items():
        _LOG.warning("left out %d %s: %s", count, kind.name, why)
    return keep, [LeftOut(f"{count} {kind.name}", why) for why, count in reasons.items()]


def _blocks_camera(kind: Kind, place: Floats, around: Surroundings) -> bool:
    """Whether a camera would be inside an object's crown or walls."""
    radius, low, high = kind.body
    if radius <= 0.0 or not len(around.viewpoints):
        return False
    near = np.hypot(*(around.viewpoints[:, :2] - place).T) < radius + around.keep_clear
    if not near.any():
        return False
    above = around.viewpoints[near, 2] - around.height_at(place[None])
    return bool(((above > low) & (above < high + around.keep_clear)).any())


def _shrunk_levels(
    groups: Sequence[tuple[Kind, Sequence[Poi | Polygon]]], around: Surroundings, budget: int
) -> float:
    """How far level limits must be drawn in to keep the triangle budget, (0, 1]."""
    measured = []
    for kind, items in groups:
        pieces = np.ones(len(items))
        if kind.form == "line":
            steps = [np.diff(i.shape[:, :2], axis=0) for i in items if isinstance(i, Polygon)]
            pieces = np.array([np.linalg.norm(s, axis=1).sum() / 40.0 for s in steps])
        measured.append((kind, around.distances(_places(items)), pieces))
    shrink = 1.0
    while shrink > 0.05:
        total = sum(
            float((np.array(kind.cost)[levels_of(kind, distances, shrink)] * pieces).sum())
            for kind, distances, pieces in measured
        )
        if total <= budget:
            break
        shrink *= 0.85
    return shrink


def _point_parts(
    kind: Kind,
    settings: ObjectSettings,
    items: Sequence[Poi],
    how: tuple[Surroundings, float],
) -> list[Part]:
    """Objects at points, placed in the world."""
    around, shrink = how
    if not items:
        return []
    places = _places(items)
    levels = levels_of(kind, around.distances(places), shrink)
    heights = around.height_at(places)
    yaws = _yaws(kind, items, places, around)
    parts = []
    for item, place, level, z, yaw in zip(items, places, levels, heights, yaws, strict=True):
        name = f"{kind.name}:{item.id}"
        spread = settings.variation * (2.0 * share_of(around.seed, name, "size") - 1.0)
        size = settings.scale * (1.0 + spread)
        # Storeys vary less than ground plans; trees keep their shape.
        tall = size if kind.name == "trees" else settings.scale * np.sqrt(1.0 + spread)
        world_from_body = Transform.from_pose((*place, z), yaw=yaw, scale=(size, size, tall))
        body = body_of(kind, settings, seed=around.seed, name=name, level=int(level))
        parts += [Part(world_from_body.mesh(p.mesh), p.material, p.tint) for p in body]
    return parts


def _yaws(kind: Kind, items: Sequence[Poi], places: Floats, around: Surroundings) -> Floats:
    """Where fronts look: as the file says, else at the nearest road; trees at random."""
    if kind.name == "trees":
        turns = [share_of(around.seed, kind.name, item.id, "yaw") for item in items]
        faced = 2 * np.pi * np.array(turns)
    else:
        faced = facing_roads(places, around.index)
    given = np.array([np.nan if item.yaw is None else item.yaw for item in items])
    return np.where(np.isnan(given), faced, given)


def facing_roads(places: Floats, index: LaneIndex) -> Floats:
    """Yaws at a right angle to the nearest lane and towards it, (n,) [rad]."""
    if index.tree is None:
        return np.zeros(len(places))
    nearest, _ = index.nearest(places)
    along = index.directions[nearest]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    side = ((index.points[nearest, :2] - places) * across).sum(axis=1)
    across *= np.where(side < 0, -1.0, 1.0)[:, None]
    yaws: Floats = np.arctan2(across[:, 1], across[:, 0])
    return yaws


_BUILDERS: dict[str, Callable[..., list[Part]]] = {
    "point": _point_parts, "line": line_parts, "area": area_parts,
}


def triangles(static: Sequence[StaticPart]) -> int:
    """Triangles of parts together."""
    return sum(len(_mesh(part).faces) for part in static)


def _mesh(part: StaticPart) -> Mesh:
    return part.part.mesh
