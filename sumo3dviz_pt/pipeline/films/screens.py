"""Finds the buildings that stand between who sounds and who hears.

They are those that a shot draws, by the plan of their walls, and those of polygons that it leaves
out because its camera does not see them. Courts are filled: a source in one is behind walls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import Polygon

if TYPE_CHECKING:
    import shapely

    from sumo3dviz_pt.model.scene import StaticPart
    from sumo3dviz_pt.pipeline.production import Production
    from sumo3dviz_pt.sound.propagation import Building
    from sumo3dviz_pt.sound.render import Source

_FAMILIES = frozenset({"street_fronts", "homes", "shops", "blocks", "buildings"})
_UPRIGHT = 0.2  # largest share of a wall's normal that points up
_SHORTEST = 0.3  # edge of a wall that counts [m]
_APART = 0.4  # walls that are nearer than twice this are of one building [m]

_EVERY = 5  # steps of motion between looks at what stands in between
_AROUND = 2  # such looks over which screens are evened out on either side


@dataclass(frozen=True, slots=True, eq=False)
class Screens:
    """Buildings around a camera.

    Attributes:
        buildings: Those near enough to matter, but for those that the camera is in.
        radius: Beyond which nobody is heard [m].
    """

    buildings: tuple[Building, ...]
    radius: float

    @classmethod
    def of(
        cls,
        production: Production,
        polygons: Sequence[Polygon],
        eyes: Floats,
        *,
        ground: float,
        radius: float,
    ) -> Screens:
        """Find them.

        Args:
            production: The shot.
            polygons: Of the scenario.
            eyes: Where the listener is, (n, 3) [m].
            ground: Height of the roads [m].
            radius: Beyond which nobody is heard [m].
        """
        import shapely

        from sumo3dviz_pt.sound.propagation import Building

        way = shapely.MultiPoint(eyes[::_EVERY, :2])
        heard = way.convex_hull.buffer(radius)
        plans = list(_drawn(production.shot.data.static, heard))
        plans += [
            (plan, ground + height)
            for plan, height in _undrawn(production, polygons, [plan for plan, _ in plans])
        ]
        near = [each for each in plans if each[0].intersects(heard)]
        return cls(
            tuple(
                Building(np.asarray(plan.exterior.coords)[:-1], top)
                for plan, top in near
                if not plan.intersects(way)
            ),
            radius,
        )

    def before(self, source: Source, eyes: Floats) -> Source:
        """Return a source with what buildings take of it; eyes are (n, 3) [m]."""
        from sumo3dviz_pt.sound.propagation import detours, screening

        if source.own or not self.buildings:
            return source
        some = np.unique(np.append(np.arange(0, len(eyes), _EVERY), len(eyes) - 1))
        away = np.linalg.norm(source.places[some] - eyes[some], axis=1)
        near = (away <= self.radius) & (source.there[some] > 0.0)
        lengths = np.zeros(len(some))
        lengths[near] = detours(eyes[some][near], source.places[some][near], self.buildings)
        if not lengths.any():
            return source
        taken, every = screening(lengths, over=_AROUND), np.arange(len(eyes))
        screens = np.column_stack([np.interp(every, some, band) for band in taken.T])
        return replace(source, screens=screens)


def _drawn(
    static: Sequence[StaticPart], heard: shapely.Geometry
) -> Iterator[tuple[shapely.Polygon, float]]:
    """Yield plans and tops [m] of buildings that are drawn."""
    import shapely

    low, high = np.array(heard.bounds).reshape(2, 2)
    walls = [_walls(part) for part in static if part.family in _FAMILIES]
    lines = np.concatenate([line for line, _ in walls] or [np.zeros((0, 2, 2))])
    tops = np.concatenate([top for _, top in walls] or [np.zeros(0)])
    near = ((lines.max(axis=1) >= low) & (lines.min(axis=1) <= high)).all(axis=1)
    lines, tops = lines[near], tops[near]
    if not len(lines):
        return
    strips = shapely.buffer(shapely.linestrings(lines), _APART, quad_segs=1)
    plans = [
        shapely.simplify(shapely.Polygon(part.exterior), _APART)
        for part in shapely.get_parts(shapely.union_all(strips))
    ]
    own, which = shapely.STRtree(plans).query(shapely.points(lines.mean(axis=1)), "intersects")
    for number, plan in enumerate(plans):
        some = tops[own[which == number]]
        if len(some):
            yield plan, float(some.max())


def _walls(part: StaticPart) -> tuple[Floats, Floats]:
    """Return walls on the plan, (n, 2, 2) [m], and how high they reach, (n,) [m]."""
    mesh, name = part.part.mesh, part.part.material
    if name != "wall" and not name.startswith("cladding:"):
        return np.zeros((0, 2, 2)), np.zeros(0)
    corners = np.asarray(mesh.vertices, dtype=np.float64)[np.asarray(mesh.faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upright = np.abs(normals[:, 2]) <= _UPRIGHT * np.linalg.norm(normals, axis=1)
    plan = np.asarray(mesh.vertices, dtype=np.float64)[:, :2][np.asarray(mesh.faces)]
    edges = np.stack([plan, np.roll(plan, -1, axis=1)], axis=2)
    lengths = np.linalg.norm(edges[:, :, 1] - edges[:, :, 0], axis=2)
    longest = edges[np.arange(len(edges)), lengths.argmax(axis=1)]
    keep = upright & (lengths.max(axis=1) >= _SHORTEST)
    # Walls are drawn in many triangles, one above the other: each line once, as high as any.
    keys = np.sort(np.round(longest[keep], 1).view([("x", float), ("y", float)])[..., 0], axis=1)
    lines, which = np.unique(keys, axis=0, return_inverse=True)
    tops = np.full(len(lines), -np.inf)
    np.maximum.at(tops, which.ravel(), corners[keep][:, :, 2].max(axis=1))
    return np.stack([lines["x"], lines["y"]], axis=-1), tops


def _undrawn(
    production: Production, polygons: Sequence[Polygon], drawn: Sequence[shapely.Polygon]
) -> Iterator[tuple[shapely.Polygon, float]]:
    """Yield plans and heights [m] of buildings of polygons that are not drawn."""
    import shapely

    from sumo3dviz_pt.world.objects.houses import height_of
    from sumo3dviz_pt.world.objects.kinds import KINDS, chosen

    settings, seed = production.job.objects.buildings, production.job.seed
    if settings is None:
        return
    kind = next(each for each in KINDS if each.name == "buildings")
    tree = shapely.STRtree(drawn)
    for item in chosen(kind, settings, (), polygons):
        if not isinstance(item, Polygon):
            continue
        for plan in shapely.get_parts(shapely.make_valid(shapely.Polygon(item.shape[:, :2]))):
            if plan.geom_type != "Polygon" or len(tree.query(plan.centroid, "intersects")):
                continue
            yield plan, settings.scale * height_of(item, float(plan.area), seed)
