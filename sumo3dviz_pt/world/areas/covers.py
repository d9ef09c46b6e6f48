"""Land covers: which polygons mean them, and water, which lies below the ground.

Covers, and the types of polygons that mean them, come from `assets/areas`. Areas of a scenario lie
on each other, lowest first. Lakes and rivers are a surface below the ground, a bank around it, and
walls below roads. There is water where ships have lanes, too, as scenarios seldom have a polygon
for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache
from typing import Literal

import numpy as np
import shapely

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_asset
from sumo3dviz_pt.library.materials import KERB, planar_uvs, principled
from sumo3dviz_pt.library.mesh.bands import between
from sumo3dviz_pt.library.mesh.planar import areal, polygon_parts, subtract, triangulate_many, union
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Bsdf, LeftOut, Part
from sumo3dviz_pt.model.traffic import Polygon, Scenario
from sumo3dviz_pt.world.areas.slabs import SOURCE as SLABS
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.surroundings import HeightAt
from sumo3dviz_pt.world.roads.strips import is_skipped

FAMILY, _ASSET = "areas", "land_cover"

WATER = "water"
"""The cover that is cut into the ground."""

AS_IS = "as_is"
"""The cover of types that leave the ground as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cover(RecipeValue):
    """What the ground looks like, and what grows on it.

    Attributes:
        surface: A surface's name; `water`, or `ground` for the ground as it is.
        colours: Mean linear reflectances, one of which an area gets by chance; none leaves
            the surface's own.
        blades: Of grass near cameras.
        pattern: What is drawn on it.
        trees: On a hectare.
        shrubs: On a hectare.
        species: Of its trees, with weights.
    """

    surface: str
    colours: tuple[Colour, ...] = ()
    blades: Literal["none", "mown", "tall"] = "none"
    pattern: Literal["bays", "pitch", "court", "tramlines", "vines", "paths", "graves"] | None = (
        None
    )
    trees: float = 0.0
    shrubs: float = 0.0
    species: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeRow(RecipeValue):
    """A type of polygons and its cover.

    Attributes:
        type: A pattern of lower-case types; `*` and `?` are wildcards.
        cover: The cover's name.
        width: Of lines of this type [m]; lines of other types cover nothing.
        line: Cover of lines, where it is another one.
    """

    type: str
    cover: str
    width: float | None = None
    line: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Waves(RecipeValue):
    """A tile of small waves.

    Attributes:
        filename: Normals of the waves, a picture.
        tile: Width of the picture [m].
    """

    filename: str
    tile: float


@dataclass(frozen=True, slots=True, kw_only=True)
class WaterLook(RecipeValue):
    """How water looks and lies.

    Attributes:
        colour: Linear reflectance of what is seen below its surface.
        roughness: [0, 1].
        specular: Strength of the reflection.
        waves: Their tile.
        depth: How far the surface lies below the ground beside it [m].
        bank: Width of the bank [m].
    """

    colour: Colour
    roughness: float
    specular: float
    waves: Waves
    depth: float
    bank: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LandCovers(RecipeValue):
    """All covers, and the types that mean them.

    Attributes:
        water: How water looks.
        covers: By name.
        types: The first row that fits a type decides.
    """

    water: WaterLook
    covers: Mapping[str, Cover]
    types: Sequence[TypeRow]

    def row_of(self, type_: str) -> TypeRow | None:
        """Return the row of a polygon's type, or None for a type that no row fits."""
        word = type_.strip().lower().replace("=", ".")
        return next((row for row in self.types if fnmatchcase(word, row.type)), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class _LandCoverFile(AssetFile):
    """Content of the `asset.yaml`."""

    kind: Literal["land_cover"]
    recipe: LandCovers


@cache
def land_covers() -> LandCovers:
    """Return the covers that come with the package.

    Raises:
        ConfigError: If the file has an unknown key, or lacks one.
    """
    return read_asset(FAMILY, _ASSET, _LandCoverFile).recipe


def waves_file() -> str:
    """Return where the picture of waves lies."""
    folder = catalog.find(FAMILY, _ASSET).folder
    return str(folder / land_covers().water.waves.filename)


ZONES_FAMILY = "areas"
"""What users call them."""

_MOST_NAMED = 6  # types that a message names
_SMALLEST = 0.5  # smaller areas are left out [m2]


@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """A piece of ground and its cover.

    Attributes:
        id: Unique.
        cover: The cover's name.
        shape: Its outline [m].
        colour: Mean linear reflectance; None leaves the surface's own.
        number: Its place among all areas, lowest first.
    """

    id: str
    cover: str
    shape: shapely.Geometry
    colour: Colour | None = None
    number: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Areas:
    """All areas of a scenario.

    Attributes:
        all: Lowest first.
        tree: Their outlines.
        left_out: Types that nothing is known of.
    """

    all: tuple[Area, ...]
    tree: shapely.STRtree
    left_out: tuple[LeftOut, ...] = ()

    def visible(self, area: Area, paved: Sequence[shapely.Geometry]) -> shapely.Geometry:
        """Return what is seen of an area: without higher areas, and without what is paved.

        Args:
            area: One of them.
            paved: Roads and footways, which lie on top of all areas.
        """
        over = [k for k in self.tree.query(area.shape).tolist() if k > area.number]
        low, high = np.reshape(area.shape.bounds, (2, 2))
        near = shapely.clip_by_rect(list(paved), *(low - 1.0), *(high + 1.0)) if len(paved) else ()
        others = [self.all[k].shape for k in sorted(over)]
        others += [piece for piece in near if not piece.is_empty]
        return subtract(area.shape, [union(others)]) if others else area.shape


@dataclass(frozen=True, slots=True, eq=False)
class _CoverShape:
    """A polygon that covers ground, before areas are ordered.

    Attributes:
        item: The polygon.
        cover: Its cover's name.
        shape: Its outline.
        layer: SUMO's.
    """

    item: Polygon
    cover: str
    shape: shapely.Geometry
    layer: float


def areas_of(polygons: Sequence[Polygon], covers: LandCovers, *, seed: int) -> Areas:
    """Return the areas that polygons mean, in the order in which they lie on each other.

    SUMO's `layer` decides; within a layer an area that lies inside another is on top of it,
    and else the later one.

    Args:
        polygons: All polygons of a scenario; buildings and lines of objects are no areas.
        covers: What their types mean.
        seed: Chooses among the colours of a cover.
    """
    mapped: list[_CoverShape] = []
    unknown: dict[str, int] = {}
    for item in polygons:
        if item.source == SLABS or kind_of(item.type, item.source) is not None:
            continue
        row = covers.row_of(item.type)
        if row is None:
            unknown[item.type or "(none)"] = unknown.get(item.type or "(none)", 0) + 1
        elif (one := _cover(item, row)) is not None:
            mapped.append(one)
    ordered = _ordered(mapped)
    areas = tuple(
        Area(
            f"{number}:{one.item.id}",
            one.cover,
            one.shape,
            colour_for(covers.covers[one.cover], one.item.id, seed),
            number,
        )
        for number, one in enumerate(ordered)
    )
    tree = shapely.STRtree([area.shape for area in areas])
    return Areas(areas, tree, _unknown(unknown))


def colour_for(cover: Cover, name: str, seed: int) -> Colour | None:
    """Return the colour that falls to an area.

    Args:
        cover: Its cover, with the colours.
        name: Of the area.
        seed: Of all chance.
    """
    if not cover.colours:
        return None
    return cover.colours[int(share_of(seed, "area", name) * len(cover.colours))]


def _cover(item: Polygon, row: TypeRow) -> _CoverShape | None:
    """The ground that a polygon covers, or None."""
    points, cover = item.shape[:, :2], row.cover
    closed = len(points) > 3 and bool(np.allclose(points[0], points[-1]))
    if (item.fill or closed) and len(points) > 2:
        shape = areal(shapely.make_valid(shapely.Polygon(points)))
    elif row.width is not None and float(np.ptp(points, axis=0).max()) > 0.0:
        shape = shapely.LineString(points).buffer(row.width / 2.0, quad_segs=4)
        cover = row.line or cover
    else:
        return None
    if cover == AS_IS or shape.area <= _SMALLEST:
        return None
    return _CoverShape(item, cover, shape, _layer(item))


def _layer(item: Polygon) -> float:
    """SUMO's layer of a polygon; 0 where it has none."""
    try:
        return float(item.params.get("layer", "0"))
    except ValueError:
        return 0.0


def _ordered(areas: Sequence[_CoverShape]) -> list[_CoverShape]:
    """Areas by layer, then by how many of their layer they lie in, then as they come."""
    if not areas:
        return []
    tree = shapely.STRtree([one.shape for one in areas])
    inner, outer = tree.query([one.shape for one in areas], predicate="covered_by")
    depth = np.zeros(len(areas), dtype=np.int64)
    for low, high in zip(inner.tolist(), outer.tolist(), strict=True):
        same = areas[low].layer == areas[high].layer
        if same and areas[low].shape.area < areas[high].shape.area - _SMALLEST:
            depth[low] += 1
    order = sorted(range(len(areas)), key=lambda k: (areas[k].layer, int(depth[k]), k))
    return [areas[k] for k in order]


def _unknown(types: dict[str, int]) -> tuple[LeftOut, ...]:
    """Name types that nothing is known of, the most frequent first."""
    if not types:
        return ()
    order = sorted(types, key=lambda name: (-types[name], name))
    names = ", ".join(repr(name) for name in order[:_MOST_NAMED])
    more = f" and {len(order) - _MOST_NAMED} more types" if len(order) > _MOST_NAMED else ""
    what = f"{sum(types.values())} polygons of type {names}{more}"
    return (LeftOut(what, "the table of land covers does not know the type"),)


MATERIAL = "water"
"""The material of its surface."""

_STILL = 4.0  # ground that differs more in height around it lets water flow [m]
_UNDER = 0.5  # how far the surface goes on below banks and walls [m]
_FOOT = 0.15  # depth of the foot of banks below the surface [m]
_STEP = 8.0  # distance of points at which the bank takes the ground's height [m]
_EARTH = np.array([[0.105, 0.095, 0.058], [0.090, 0.098, 0.046], [0.125, 0.108, 0.075]])
_GROUND = 0.03  # how far the ground lies below roads [m]
_BRIDGE = 1.5  # roads that much above the ground are bridges without walls [m]


@dataclass(frozen=True, slots=True, eq=False)
class Pool:
    """A body of water.

    Attributes:
        id: Unique.
        shape: Its outline at the height of the ground [m].
    """

    id: str
    shape: shapely.Geometry


def water_depth() -> float:
    """Return how far water lies below the road beside it [m]."""
    return land_covers().water.depth + _GROUND


def water_parts(
    pool: Pool,
    look: WaterLook,
    *,
    height_at: HeightAt,
    near: tuple[float, float],
) -> list[Part]:
    """Build the surface of water and the bank around it.

    Args:
        pool: The water.
        look: Its depth, and the width of banks.
        height_at: Height of the ground.
        near: A point of the network [m] near which texture coordinates are small.
    """
    shape = shapely.segmentize(pool.shape, _STEP)
    level_at = _levels(shape, look.depth, height_at)
    # The surface goes on below the banks, so that no gap shows.
    wide = polygon_parts(shapely.buffer(shape, _UNDER, join_style="mitre"))
    made = triangulate_many(wide)
    points = np.column_stack([made.vertices, level_at(made.vertices)])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    uvs = planar_uvs(points, tile=look.waves.tile, near=near)
    parts = [Part(Mesh(points, made.faces, up, uvs), MATERIAL)]
    bank = _bank(shape, look.bank, level_at, height_at)
    if len(bank.faces):
        rng = np.random.default_rng(len(bank.faces))
        tint = _EARTH[rng.integers(0, len(_EARTH), len(bank.faces))]
        parts.append(Part(bank, "bark", tint * rng.uniform(0.85, 1.15, (len(tint), 1))))
    return parts


def _levels(
    shape: shapely.Geometry, depth: float, height_at: HeightAt
) -> Callable[[Floats], Floats]:
    """The height of the surface at places: one for still water, else below the ground there."""
    heights = height_at(shapely.get_coordinates(shape))
    if float(np.ptp(heights)) < _STILL:
        level = float(heights.min()) - depth
        return lambda places: np.full(len(places), level)
    return lambda places: height_at(places) - depth


def _bank(
    shape: shapely.Geometry,
    width: float,
    level_at: Callable[[Floats], Floats],
    height_at: HeightAt,
) -> Mesh:
    """A slope from the ground down to below the surface, inside the outline."""
    inner = shapely.buffer(shape, -width, quad_segs=2)
    if inner.area < 0.4 * shape.area:
        inner = shapely.buffer(shape, -0.2 * width, quad_segs=2)
    band = polygon_parts(subtract(shape, [shapely.segmentize(inner, _STEP)]))
    made = triangulate_many(band)
    rim = shapely.distance(shapely.boundary(shape), shapely.points(made.vertices)) < 1e-3
    low = level_at(made.vertices) - _FOOT
    z = np.where(rim, height_at(made.vertices) + 0.01, low)
    return Mesh(np.column_stack([made.vertices, z]), made.faces)


def shore_walls(
    pools: Sequence[Pool],
    outline: Sequence[shapely.Geometry],
    *,
    depth: float,
    height_at: HeightAt,
    road_at: HeightAt,
) -> list[Part]:
    """Build walls from the edges of roads that cross water down into it.

    Args:
        pools: All water.
        outline: What is paved.
        depth: Of the water's surface below the ground [m].
        height_at: Height of the ground.
        road_at: Height of the nearest road.
    """
    meshes = []
    for pool in pools:
        low, high = np.reshape(pool.shape.bounds, (2, 2))
        near = shapely.clip_by_rect(list(outline), *(low - 5.0), *(high + 5.0))
        for area in (area for area in near if not area.is_empty):
            edge = shapely.boundary(shapely.buffer(area, 0.1, join_style="mitre"))
            crossing = shapely.line_merge(shapely.intersection(edge, pool.shape))
            for line in shapely.get_parts(crossing).tolist():
                if line.geom_type == "LineString" and line.length > 0.3:
                    meshes += _walls(line, depth, height_at, road_at)
    return [Part(merge_meshes(meshes), KERB)] if meshes else []


def _walls(
    line: shapely.LineString, depth: float, height_at: HeightAt, road_at: HeightAt
) -> list[Mesh]:
    """A wall along a line, seen from both sides; none below bridges."""
    places = shapely.get_coordinates(shapely.segmentize(line, _STEP))
    ground = height_at(places)
    if float(np.max(road_at(places) - ground)) > _BRIDGE:
        return []
    top = np.column_stack([places, np.maximum(ground + 0.02, road_at(places) - 0.08)])
    foot = np.column_stack([places, ground - depth - 0.5])
    return [between(top, foot), between(top[::-1], foot[::-1])]


def water_material(look: WaterLook, *, textured: bool) -> Bsdf:
    """Describe the surface of water: dark below a reflection that small waves break.

    Args:
        look: Its numbers.
        textured: False leaves the waves out.
    """
    still = principled(look.colour, roughness=look.roughness, specular=look.specular)
    if not textured:
        return still
    waves = {"type": "bitmap", "filename": waves_file(), "raw": True}
    return {"type": "normalmap", "normalmap": waves, "bsdf": still}


_BESIDE = 6.0  # how far water reaches beyond a lane [m]
_LEAST = 20.0  # smaller pieces between water and a polygon of water are left out [m2]
_SOURCE = "waterways of the network"


def with_waterways(scenario: Scenario) -> Scenario:
    """Return a scenario with polygons of water where lanes are for ships alone.

    Polygons of water stay what they are; only what they leave of waterways is added.

    Args:
        scenario: As read.
    """
    ways = _ways(scenario.network)
    if not ways:
        return scenario
    free = subtract(union(ways), _water(scenario.polygons))
    pieces = [part for part in polygon_parts(free) if part.area > _LEAST]
    added = tuple(
        Polygon(f"waterway {k}", "natural.water", _ring(piece), True, None, _SOURCE)
        for k, piece in enumerate(pieces)
    )
    return replace(scenario, polygons=(*scenario.polygons, *added))


def _ways(network: Network) -> list[shapely.Geometry]:
    """What ships need of waterways, from above."""
    return [
        shapely.LineString(lane.shape[:, :2]).buffer(0.5 * lane.width + _BESIDE, quad_segs=4)
        for lane in network.lanes.values()
        if is_skipped(lane)
    ]


def _water(polygons: Sequence[Polygon]) -> list[shapely.Geometry]:
    """Polygons that already are water, grown so that no bank is left between."""
    covers = land_covers()
    water = []
    for item in polygons:
        row = covers.row_of(item.type)
        if row is not None and row.cover == WATER and item.fill and len(item.shape) > 2:
            water.append(shapely.make_valid(shapely.Polygon(item.shape[:, :2])).buffer(_BESIDE))
    return water


def _ring(piece: shapely.Polygon) -> Floats:
    """The outline of a polygon, (n, 2) [m]; holes hang on it by cuts of no width."""
    ring = list(piece.exterior.coords)
    for hole in piece.interiors:
        away = [math.dist(point, hole.coords[0]) for point in ring]
        near = away.index(min(away))
        ring = [*ring[: near + 1], *hole.coords, *ring[near:]]
    return np.array(ring)
