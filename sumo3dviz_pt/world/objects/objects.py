"""Static objects of a scene: which, where, how detailed, merged into few parts."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import ObjectSettings, ObjectsSettings
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.geometry import Floats, Transform, belonging, merge_meshes
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Bsdf, LampSet, LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.houses import (
    STYLES,
    Chance,
    area_parts,
    cladding_material,
    fitted,
    house_parts,
    lamp_sets,
    plan_of,
    rectangles,
)
from sumo3dviz_pt.world.objects.kinds import (
    INVENTED,
    KINDS,
    PLANTS,
    Kind,
    Staging,
    check_extents,
    check_settings,
    chosen,
)
from sumo3dviz_pt.world.objects.lines import hedge_parts, line_parts
from sumo3dviz_pt.world.objects.plants import (
    Gone,
    Item,
    ObjectGroup,
    PlantSpot,
    level_distances,
    places_of,
    plant_parts,
    shrunk_levels,
)
from sumo3dviz_pt.world.objects.stands import Stands, shared
from sumo3dviz_pt.world.placement.clearance import KEEP_CLEAR
from sumo3dviz_pt.world.placement.lanes import facing_roads
from sumo3dviz_pt.world.placement.surroundings import Surroundings, thing_of

_LOG = logging.getLogger(__name__)

FARTHEST = 4000.0
"""Objects farther than this from every camera are left out [m]."""

BUDGET = 700_000
"""Triangles of all static objects of a shot, at most (about)."""

_SHADOW = 40.0  # radius within which an object and its shadow lie [m]
_LEVELS = {"they stand on a carriageway": logging.WARNING}


@dataclass(frozen=True, slots=True)
class Scenery:
    """The static objects of a scene.

    Attributes:
        static: Few parts per kind, in world coordinates.
        materials: BSDFs of all materials of these parts, by name.
        left_out: What was left out, and why.
        lamps: Windows and signs that are lit, when it is dark.
        stands: Plants that share models.
    """

    static: tuple[StaticPart, ...]
    materials: Mapping[str, Bsdf]
    left_out: tuple[LeftOut, ...]
    lamps: tuple[LampSet, ...] = ()
    stands: Stands = field(default_factory=Stands)


def build_scenery(
    pois: Sequence[Poi],
    polygons: Sequence[Polygon],
    settings: ObjectsSettings,
    *,
    around: Surroundings,
    budget: int = BUDGET,
    textured: bool = True,
) -> Scenery:
    """Build trees, shrubs, hedges, fences, homes, shops, blocks and buildings.

    Args:
        pois: Points of interest of the scenario.
        polygons: Polygons and lines of the scenario.
        settings: Which kinds, from which files, how large and which colour.
        around: Roads, ground, cameras and the seed.
        budget: Triangles, about; levels of detail come closer until they keep it.
        textured: False shows plain colours instead of brick, plaster and tiles.

    Raises:
        ConfigError: If a model or colour of the settings does not exist.
        InputError: If a line or outline is longer than anything that is built.
    """
    # Choose what there is of each kind.
    gone: list[Gone] = []
    groups: list[ObjectGroup] = []
    taken = _building_areas(polygons, settings)
    for kind in KINDS:
        own: ObjectSettings | None = getattr(settings, kind.name)
        items = chosen(kind, own, pois, polygons)
        if own is None or not items:
            why = "switched off in the scene file" if items else "the scenario has none"
            gone.append(Gone(LeftOut(kind.name, why), kind, items))
            continue
        check_settings(kind, own)
        check_extents(kind, items)
        stay, unseen = _sorted_out(kind, items, around=around, taken=taken)
        gone += unseen
        groups.append(ObjectGroup(kind, own, stay))
    # Build the parts of each kind.
    shrinks = shrunk_levels(groups, around, budget, each=settings.triangles)
    left_out = [each.weighed(around, shrinks) for each in gone]
    static, shining, stands = _built(groups, Staging(around, shrinks), textured=textured)
    bodies = [part for body in stands.prototypes.values() for part in body.parts]
    names = sorted({part.material for part in (*(each.part for each in static), *bodies)})
    materials = {name: material_of(name, textured=textured) for name in names}
    if not around.dark and any(group.kind.name in {*STYLES, "buildings"} for group in groups):
        left_out.append(LeftOut("lit windows", "it is day"))
    return Scenery(tuple(static), materials, tuple(left_out), lamp_sets(shining), stands)


def _built(
    groups: Sequence[ObjectGroup], staging: Staging, *, textured: bool
) -> tuple[list[StaticPart], list[Part], Stands]:
    """Build what there is of each kind: what stands, what of it shines by night, like plants."""
    static: list[StaticPart] = []
    shining: list[Part] = []
    stands = Stands()
    for group in groups:
        kind = group.kind
        if kind.name in PLANTS:
            spots = _plant_spots(kind, group.settings, group.items, staging)
            if textured:
                some, spots = shared(kind, spots, staging.around)
                stands = stands.joined(some)
            static += merged(kind.name, plant_parts(kind, spots, staging.around))
            continue
        build = _BUILDERS.get(kind.name) or _BUILDERS[kind.form]
        parts = build(kind, group.settings, group.items, staging)
        shining += [part for part in parts if part.material.startswith("lamp:")]
        plain = [part for part in parts if not part.material.startswith("lamp:")]
        static += merged(kind.name, plain)
    return static, shining, stands


def material_of(name: str, *, textured: bool) -> Bsdf:
    """Return a named material, or one that shows a surface."""
    if name.startswith("cladding:"):
        return cladding_material(name, textured=textured)
    return MATERIALS[name]


def merged(family: str, parts: Sequence[Part]) -> list[StaticPart]:
    """Build one static part per material of a family."""
    by_material: dict[str, list[Part]] = {}
    for part in parts:
        by_material.setdefault(part.material, []).append(part)
    meshes = []
    for material, some in sorted(by_material.items()):
        mesh = merge_meshes([part.mesh for part in some])
        tints = [part.tint for part in some if part.tint is not None]
        tint = np.concatenate(tints) if tints else None
        meshes.append(StaticPart(f"{family}/{material}", family, Part(mesh, material, tint)))
    return meshes


def _building_areas(polygons: Sequence[Polygon], settings: ObjectsSettings) -> shapely.STRtree:
    """Footprints of drawn building polygons; single houses are not drawn again in them."""
    kind = next(kind for kind in KINDS if kind.name == "buildings")
    if settings.buildings is None:
        return shapely.STRtree([])
    items = chosen(kind, settings.buildings, (), polygons)
    rings = [item.shape[:, :2] for item in items if isinstance(item, Polygon)]
    return shapely.STRtree([shapely.make_valid(shapely.Polygon(ring)) for ring in rings])


def _sorted_out(
    kind: Kind, items: Sequence[Item], *, around: Surroundings, taken: shapely.STRtree
) -> tuple[list[Item], list[Gone]]:
    """Objects without those that stand on a road, in a camera's way or out of sight.

    Args:
        kind: Theirs.
        items: The objects.
        around: Roads and cameras.
        taken: Footprints of building polygons, in which nothing else stands.
    """
    if kind.form == "line":
        return list(items), []
    # Find what speaks against each object.
    places = places_of(items)
    inside = np.zeros(len(items), dtype=np.bool_)
    if kind.form == "point":
        inside[taken.query(shapely.points(places), predicate="intersects")[0]] = True
    reasons = (
        ("they stand on a carriageway", around.index.covers(places)),
        ("a building polygon covers them", inside),
        (
            f"they are farther than {FARTHEST:.0f} m from every camera",
            around.distances(places) > FARTHEST,
        ),
        ("no camera of the shot sees them", ~around.seen(places, radius=_SHADOW)),
        (
            "a camera would be inside them",
            np.array([_blocks_camera(kind, place, around) for place in places]),
        ),
    )
    # The first reason counts.
    keep = np.ones(len(items), dtype=np.bool_)
    left_out: list[Gone] = []
    for why, gone in reasons:
        these = [item for item, is_gone in zip(items, keep & gone, strict=True) if is_gone]
        keep &= ~gone
        if these:
            left_out.append(Gone(LeftOut(f"{len(these)} {kind.name}", why), kind, these))
    for lost in (each.left_out for each in left_out):
        _LOG.log(_LEVELS.get(lost.why, logging.INFO), "left out %s: %s", lost.what, lost.why)
    return [item for item, stays in zip(items, keep, strict=True) if stays], left_out


def _blocks_camera(kind: Kind, place: Floats, around: Surroundings) -> bool:
    """Whether a camera would be inside an object's crown or walls."""
    space, eyes = kind.space, around.clearance.places
    if space is None or not len(eyes):
        return False
    near = np.hypot(*(eyes[:, :2] - place).T) < space.radius + KEEP_CLEAR
    if not near.any():
        return False
    above = eyes[near, 2] - around.height_at(place[None])
    return bool(((above > space.bottom) & (above < space.top + KEEP_CLEAR)).any())


def _plant_spots(
    kind: Kind, settings: ObjectSettings, items: Sequence[Item], staging: Staging
) -> list[PlantSpot]:
    """Return plants where they stand."""
    own = [_own_model(kind, settings, item) for item in items if isinstance(item, Poi)]
    return list(map(PlantSpot, *_placed(kind, settings, items, staging, own)))


def _point_parts(
    kind: Kind, settings: ObjectSettings, items: Sequence[Poi], staging: Staging
) -> list[Part]:
    """Houses at points, placed in the world."""
    around = staging.around
    parts: list[Part] = []
    names, _, levels, placed = _placed(kind, settings, items, staging, [settings] * len(items))
    for name, level, place in zip(names, levels, placed, strict=True):
        chance = Chance(around.seed, name, around.dark, around.language)
        body = house_parts(kind, settings, chance, level=level)
        for part in body:
            mesh = belonging(place.mesh(part.mesh), thing_of(name))
            parts.append(Part(mesh, part.material, part.tint))
    return parts


def _placed(
    kind: Kind,
    settings: ObjectSettings,
    items: Sequence[Item],
    staging: Staging,
    own: list[ObjectSettings],
) -> tuple[list[str], list[ObjectSettings], list[int], list[Transform]]:
    """Return names of objects at points, their settings, levels of detail and places.

    Args:
        kind: Theirs.
        settings: Of the kind.
        items: The objects.
        staging: What they are built by.
        own: Settings of each.
    """
    around = staging.around
    if not items:
        return [], [], [], []
    # Decide where each stands, which way it looks, how large and how detailed it is.
    points = [item for item in items if isinstance(item, Poi)]
    places = places_of(points)
    names = [f"{kind.name}:{item.id}" for item in points]
    levels = staging.levels(kind, level_distances(kind, points, around))
    heights = np.array(around.height_at(places))
    yaws = _yaws(kind, points, places, around)
    sizes = _sizes(names, settings, around.seed)
    # Storeys vary less than ground plans; trees keep their shape.
    tall = sizes if kind.name in PLANTS else np.sqrt(settings.scale * sizes)
    if kind.name in STYLES:
        plans = [plan_of(kind, settings, seed=around.seed, name=name) for name in names]
        sizes = fitted(places, yaws, np.array(plans), sizes, index=around.index)
        made = np.array([item.source == INVENTED for item in points], dtype=np.bool_)
        if made.any():  # slopes: they stand on the lowest corner of the ground
            scaled = np.array(plans)[made] * sizes[made, None, None]
            corners = shapely.get_coordinates(rectangles(places[made], yaws[made], scaled))
            heights[made] = around.height_at(corners).reshape(-1, 5).min(axis=1)
    placed = [
        Transform.from_pose((*places[i], heights[i]), yaw=yaws[i], scale=(size, size, tall[i]))
        for i, size in enumerate(sizes)
    ]
    return names, own, levels.tolist(), placed


def _own_model(kind: Kind, settings: ObjectSettings, item: Poi) -> ObjectSettings:
    """Settings with the model that an object's parameter `model` names, if it is one."""
    model = item.params.get("model")
    if model not in kind.models or settings.model:
        return settings
    return settings.model_copy(update={"model": (model,)})


def _sizes(names: Sequence[str], settings: ObjectSettings, seed: int) -> Floats:
    """Scale factor of each object, (n,)."""
    shares = np.array([share_of(seed, name, "size") for name in names])
    sizes: Floats = settings.scale * (1.0 + settings.variation * (2.0 * shares - 1.0))
    return sizes


def _yaws(kind: Kind, items: Sequence[Poi], places: Floats, around: Surroundings) -> Floats:
    """Where fronts look: as the file says, else at the nearest road; trees at random."""
    if kind.name in PLANTS:
        turns = [share_of(around.seed, kind.name, item.id, "yaw") for item in items]
        faced = 2 * np.pi * np.array(turns)
    else:
        faced = facing_roads(places, around.index)
    yaws = np.array([np.nan if item.yaw is None else item.yaw for item in items])
    return np.where(np.isnan(yaws), faced, yaws)


_BUILDERS: dict[str, Callable[..., list[Part]]] = {
    "point": _point_parts,
    "line": line_parts,
    "area": area_parts,
    "hedges": hedge_parts,
}
