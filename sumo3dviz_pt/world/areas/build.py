"""Land covers around a shot's cameras: water, woods, parks, fields, squares, car parks, gardens."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.model.scene import Bsdf, LeftOut, StaticPart
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.world.areas.covers import (
    WATER,
    ZONES_FAMILY,
    Area,
    Areas,
    LandCovers,
    Pool,
    areas_of,
    land_covers,
    shore_walls,
    water_parts,
)
from sumo3dviz_pt.world.areas.drape import GroundFaces
from sumo3dviz_pt.world.areas.meshes import (
    LIFT,
    LaidArea,
    coloured,
    cover_material,
    cover_parts,
    is_own,
    pattern_parts,
)
from sumo3dviz_pt.world.areas.patterns import PatternShapes, drawn_on
from sumo3dviz_pt.world.areas.planting import TILE, Grown, Houses, Stand, built_up, grow, houses_of
from sumo3dviz_pt.world.areas.slabs import SlabGround, SlabParts, build_slabs
from sumo3dviz_pt.world.land.cuts import with_hole
from sumo3dviz_pt.world.land.ground import GroundParts
from sumo3dviz_pt.world.objects.objects import merged
from sumo3dviz_pt.world.placement.surroundings import Surroundings, Tile, tiles_seen
from sumo3dviz_pt.world.plants.trees import Plot, why_nowhere
from sumo3dviz_pt.world.roads.cells import heights_near
from sumo3dviz_pt.world.roads.roads import RoadParts
from sumo3dviz_pt.world.roads.strips import BoundsXY
from sumo3dviz_pt.world.street.street import standing_height

REACH = 1900.0
"""Areas nearer to a camera than this are cut out along roads [m]; beyond, none are built."""

FARTHEST = 7000.0
"""Areas farther from every camera than this are left out [m]."""

_DRAWN = 420.0  # lines, tracks and paths lie at most this far from a camera [m]
_HOUSES = 800.0  # and the ground between houses [m]
_COARSE = 3.0  # outlines of far areas are this coarse [m]
_YARDS = 0.006  # how far gardens lie above the ground [m]
_YARD_COVERS = ("pavement", "apron", "built_up")


@dataclass(frozen=True, slots=True, eq=False)
class AreaParts:
    """Land covers, ready for the scene.

    Attributes:
        static: Their meshes.
        materials: Their materials by name.
        ground: The ground, with holes for water.
        grown: Trees and shrubs on them.
        bare: Where no grass grows, polygons.
        mown: Where grass is short, polygons.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...]
    materials: Mapping[str, Bsdf]
    ground: GroundParts
    grown: Grown = field(default_factory=Grown)
    bare: tuple[shapely.Geometry, ...] = ()
    mown: tuple[shapely.Geometry, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Below:
    """What areas lie on, beside and below.

    Attributes:
        roads: They lie on top of areas.
        ground: It lies below them.
        slabs: From `slabs_on`; they take places of areas.
    """

    roads: RoadParts
    ground: GroundParts
    slabs: SlabParts


@dataclass(frozen=True, slots=True, eq=False)
class _Setting:
    """What areas are placed by.

    Attributes:
        covers: The table.
        areas: All of the scenario.
        houses: All footprints.
        paved: Roads and footways.
        around: Cameras, ground, seed and memory.
        name: Begins the names of what is kept: roads are built for one region.
    """

    covers: LandCovers
    areas: Areas
    houses: Houses
    paved: Sequence[shapely.Geometry]
    around: Surroundings
    name: tuple[object, ...]


def build_areas(
    scenario: Scenario,
    job: Job,
    *,
    below: Below,
    around: Surroundings,
    region: BoundsXY | None = None,
) -> AreaParts:
    """Build land covers around the cameras of a shot.

    Args:
        scenario: Its polygons say what covers the ground.
        job: The scene file may switch them off, and shows none in plain colours.
        below: Roads, ground and slabs.
        around: Cameras, seed and memory.
        region: Where roads are built; part of the names of what is kept.

    Raises:
        ConfigError: If the table of land covers is damaged.
    """
    roads, ground, slabs = below.roads, below.ground, below.slabs
    if (why := _why_none(job)) is not None:
        return AreaParts((), {}, ground, left_out=(LeftOut(ZONES_FAMILY, why),))
    covers, memory = land_covers(), around.memory
    areas: Areas = memory.of(
        ("areas",), partial(areas_of, scenario.polygons, covers, seed=around.seed)
    )
    houses: Houses = memory.of(("houses",), partial(houses_of, scenario.polygons))
    paved = [*roads.layout.paved, *slabs.shapes]
    setting = _Setting(covers, areas, houses, paved, around, ("areas", region))
    near, far = _nearest(areas, around)
    pools = [Pool(k.id, areas.visible(k, ())) for k in near if k.cover == WATER]
    pools = [pool for pool in pools if not pool.shape.is_empty]
    laid = _visible(setting, [area for area in near if area.cover != WATER])
    if why_nowhere(job.ground.texture) is None:
        laid += _yards(setting, pools)
    left_out = (*areas.left_out, *slabs.left_out)
    if not (laid or pools or far or slabs.parts):
        none = () if left_out else (LeftOut(ZONES_FAMILY, "the scenario has none in view"),)
        return AreaParts((), {}, ground, left_out=(*left_out, *none))
    laid += _distant(far)
    drawn = _drawn(setting, laid)
    # Lay all of it on the ground, and cut water out of it.
    origin = scenario.network.location.boundary[:2]
    hole = union([pool.shape for pool in pools]) if pools else None
    faces = GroundFaces.of(
        [part.part.mesh for part in ground.static if part.id in ("ground", "ground/far")]
    )
    parts = cover_parts(laid, covers, faces, origin) + pattern_parts(
        drawn, faces, around.height_at, origin
    )
    for pool in pools:
        parts += water_parts(pool, covers.water, height_at=ground.height_at, near=origin)
    parts += shore_walls(
        pools,
        roads.layout.paved,
        depth=covers.water.depth,
        height_at=ground.height_at,
        road_at=partial(heights_near, roads.layout.cells),
    )
    parts += [coloured(part) for part in slabs.parts]
    return AreaParts(
        tuple(merged(ZONES_FAMILY, parts)),
        {
            part.material: cover_material(part.material, covers)
            for part in parts
            if is_own(part.material)
        },
        ground if hole is None else with_hole(ground, hole),
        _grown(setting, laid, pools, drawn, scenario),
        *_grass(covers, laid, [*(pool.shape for pool in pools), *slabs.shapes], drawn),
        left_out,
    )


def slabs_on(
    scenario: Scenario, job: Job, *, roads: RoadParts, ground: GroundParts, around: Surroundings
) -> SlabParts:
    """Build the slabs of a scenario's stops; none where there are no land covers.

    Args:
        scenario: Its stops and parking areas.
        job: The scene file.
        roads: What they lie beside.
        ground: As roads shape it.
        around: Cameras and memory.
    """
    if not covers_ground(job):
        return SlabParts()
    beside = SlabGround(
        roads.layout.paved,
        list(roads.layout.raised),
        standing_height(roads, ground),
        ground.height_at,
        around,
        scenario.network.location.boundary[:2],
    )
    return build_slabs(scenario, beside)


def covers_ground(job: Job) -> bool:
    """Return whether a scene file shows land covers, and so water."""
    return _why_none(job) is None


def _why_none(job: Job) -> str | None:
    """Why there are no land covers, or None."""
    if job.ground.areas == "none":
        return "switched off by `ground.areas`"
    return None if job.textured else "everything is shown in plain colours"


def _nearest(areas: Areas, around: Surroundings) -> tuple[list[Area], list[Area]]:
    """Areas of which a camera may see something: near ones, and far ones."""
    near: list[Area] = []
    far: list[Area] = []
    eyes = shapely.points(np.unique(np.round(around.viewpoints[:, :2]), axis=0))
    for area in areas.all:
        low, high = np.reshape(area.shape.bounds, (2, 2))
        middle = 0.5 * (low + high)[None]
        if not around.seen(middle, radius=float(np.hypot(*(high - low))) / 2.0 + 30.0)[0]:
            continue
        away = float(shapely.distance(area.shape, eyes).min()) if len(eyes) else 0.0
        if away < FARTHEST:
            (near if away < REACH else far).append(area)
    return near, far


def _visible(setting: _Setting, areas: Sequence[Area]) -> list[LaidArea]:
    """What is seen of areas between roads and higher areas."""
    laid = []
    for area in areas:
        make = partial(setting.areas.visible, area, setting.paved)
        shape = setting.around.memory.of((*setting.name, "visible", area.number), make)
        if not shape.is_empty:
            laid.append(LaidArea(area.cover, area.colour, shape, LIFT, area))
    return laid


def _distant(areas: Sequence[Area]) -> list[LaidArea]:
    """Far areas, with coarse outlines."""
    laid = []
    for area in areas:
        shape = shapely.make_valid(area.shape.simplify(_COARSE))
        # Where roads are not built, higher areas lie a little higher.
        lift = LIFT + 0.002 * min(area.number, 100)
        laid.append(LaidArea(area.cover, area.colour, shape, lift, area))
    return laid


def _yards(setting: _Setting, pools: Sequence[Pool]) -> list[LaidArea]:
    """The ground around houses, tile by tile."""
    if not setting.houses.shapes:
        return []
    laid = []
    for tile in tiles_seen(setting.around, size=TILE, reach=_HOUSES, beyond=0.0):
        make = partial(_yard, setting, tile)
        yard = setting.around.memory.of((*setting.name, "built up", tile), make)
        for cover, shape in zip(_YARD_COVERS, yard, strict=True):
            colour = setting.covers.covers[cover].colours[0]
            if not shape.is_empty:
                laid.append(LaidArea(cover, colour, shape, _YARDS))
    return laid


def _yard(setting: _Setting, tile: Tile) -> tuple[shapely.Geometry, ...]:
    """Pavement, apron and lawn of one tile; empty shapes where there are no houses."""
    box = tile.box()
    areas = setting.areas
    covered = [areas.all[k].shape for k in sorted(areas.tree.query(box, "intersects").tolist())
               if areas.all[k].cover not in _YARD_COVERS]  # fmt: skip
    yard = built_up(tile, setting.houses, paved=setting.paved, covered=covered)
    if yard is None:
        return (shapely.Polygon(),) * 3
    return yard.pavement, yard.apron, yard.lawn


def _drawn(setting: _Setting, laid: Sequence[LaidArea]) -> list[PatternShapes]:
    """Lines, tracks and paths on areas near a camera."""
    drawn: list[PatternShapes] = []
    around = setting.around
    eyes = shapely.points(np.unique(np.round(around.viewpoints[:, :2]), axis=0))
    for some in laid:
        pattern = setting.covers.covers[some.cover].pattern
        if pattern is None or some.area is None:
            continue
        if len(eyes) and float(shapely.distance(some.shape, eyes).min()) > _DRAWN:
            continue
        make = partial(drawn_on, pattern, some.area, some.shape, seed=around.seed)
        drawn += around.memory.of((*setting.name, "drawn", some.area.number), make)
    return drawn


def _grown(
    setting: _Setting,
    laid: Sequence[LaidArea],
    pools: Sequence[Pool],
    drawn: Sequence[PatternShapes],
    scenario: Scenario,
) -> Grown:
    """Trees and shrubs on areas; none on paths, in houses or in water."""
    stands = [
        Stand(some.area, cover, some.shape)
        for some in laid
        if some.area is not None
        for cover in [setting.covers.covers[some.cover]]
        if cover.trees or cover.shrubs
    ]
    if not stands:
        return Grown()
    paths = [shape for some in drawn if some.trodden for shape in some.shapes]
    objects = np.array([poi.position for poi in scenario.pois], dtype=np.float64).reshape(-1, 2)
    solid = [*setting.houses.shapes, *(pool.shape for pool in pools)]
    # Walls need no more room here than roads do.
    plot = Plot([*setting.paved, *paths, *solid], (), objects)
    return grow(stands, plot, around=setting.around)


def _grass(
    covers: LandCovers,
    laid: Sequence[LaidArea],
    others: Sequence[shapely.Geometry],
    drawn: Sequence[PatternShapes],
) -> tuple[tuple[shapely.Geometry, ...], tuple[shapely.Geometry, ...]]:
    """Where no grass grows, and where it is short."""
    blades = {name: cover.blades for name, cover in covers.covers.items()}
    bare = [some.shape for some in laid if blades[some.cover] == "none"]
    bare += others
    bare += [shape for some in drawn if some.trodden for shape in some.shapes]
    return tuple(bare), tuple(some.shape for some in laid if blades[some.cover] == "mown")
