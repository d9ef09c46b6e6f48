"""What only near cameras see of plants: blades of grass, small leaves, pits of soil.

Foliage that cameras come near to is exchanged for leaves as small as real ones. Trees that stand in
pavements have pits of soil around them, each in a frame of stone.

Blades of grass stand near cameras that pass close to the ground, taller along edges and trees. They
are a pure function of the shot: patches lie on a fixed grid, which one and how it is turned depends
on seed and place only, and how many of its blades are there on how near a camera of the shot comes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.materials import mean_reflectance
from sumo3dviz_pt.library.mesh.planar import sides
from sumo3dviz_pt.library.plants.greenery import (
    PATCH,
    PATCH_BLADES,
    Blades,
    blades_mesh,
    grass_patch,
    laid,
)
from sumo3dviz_pt.library.plants.leaves import OUTLINE, cards_of, triangles, wanted, with_leaves
from sumo3dviz_pt.model.camera import in_picture
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, belonging, merge_meshes
from sumo3dviz_pt.model.random import dice_of, share_of
from sumo3dviz_pt.model.scene import LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.kinds import PLANTS, kind_of
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings

LEAVES_REACH = 55.0
"""Foliage farther from every camera than this stays as it is [m]."""

FINE = 120_000
"""Triangles of leaves near cameras, at most (of one kind of plant)."""

_MOST_VIEWS = 40  # that tell what lies in the picture


def near_leaves(parts: Sequence[Part], *, around: Surroundings, budget: int = FINE) -> list[Part]:
    """Build plants with real leaves where a camera is near.

    Args:
        parts: Of plants, in the world; foliage is what is made of `leaf`.
        around: Cameras and the seed.
        budget: Triangles, at most; the nearest leaves come first.
    """
    if not len(around.viewpoints):
        return list(parts)
    eyes = cKDTree(around.viewpoints)
    near = [
        k for k, part in enumerate(parts) if part.material == "leaf" and _comes_near(part, eyes)
    ]
    leaves = list(parts)
    if not near:
        return leaves
    # Find out how many leaves each card becomes, and up to which distance they keep the budget.
    cards = [cards_of(parts[k].mesh, _tint(parts[k])) for k in near]
    away = [np.asarray(eyes.query(card.centres)[0]) for card in cards]
    counts = [wanted(c, d) * _shown(c.centres, d, around) for c, d in zip(cards, away, strict=True)]
    reach = _reach(np.concatenate(away), np.concatenate(counts), budget)
    # Exchange those cards.
    rng = np.random.default_rng(around.seed + 79)
    for k, count, distance in zip(near, counts, away, strict=True):
        some = np.where(distance < reach, count, 0)
        if some.any():
            outlined = distance < OUTLINE
            mesh, tint = with_leaves(
                parts[k].mesh, _tint(parts[k]), some, outlined=outlined, rng=rng
            )
            leaves[k] = replace(parts[k], mesh=mesh, tint=tint)
    return leaves


def _tint(part: Part) -> Floats:
    """Colours of a part's faces."""
    assert part.tint is not None
    return part.tint


def _comes_near(part: Part, eyes: cKDTree) -> bool:
    """Whether a camera is within reach of a part."""
    low, high = part.mesh.bounds
    radius = 0.5 * float(np.linalg.norm(high - low))
    return bool(eyes.query(0.5 * (low + high))[0] < LEAVES_REACH + radius)


def _shown(places: Floats, away: Floats, around: Surroundings) -> Bools:
    """Which places, (n, 3) [m], lie near enough and in some picture."""
    shown = away < LEAVES_REACH
    camera_path = around.camera_path
    if camera_path is None or not shown.any():
        return shown
    every = max(1, -(-len(camera_path.positions) // _MOST_VIEWS))
    sparse = camera_path.slice(slice(None, None, every))
    shown[shown] = in_picture(sparse, places[shown], radius=0.4).any(axis=1)
    return shown


def _reach(away: Floats, counts: Ints, budget: int) -> float:
    """Up to which distance leaves keep the budget [m]."""
    order = np.argsort(away, kind="stable")
    spent = np.cumsum(triangles(counts, away)[order])
    over = int(np.searchsorted(spent, budget))
    return LEAVES_REACH if over >= len(order) else float(away[order[over]])


PITS_REACH = 130.0
"""Pits farther from every camera than this are left out [m]."""

_WIDE = 1.5  # width of a pit [m]
_STONE = 0.12  # width of its frame [m]
_RISE = 0.025  # how high the frame stands over the pavement [m]
_CELLS = 9  # patches of its soil along a side
_SOIL = np.array([[0.075, 0.056, 0.038], [0.055, 0.042, 0.030], [0.10, 0.075, 0.045]])
_GROWTH = np.array([0.07, 0.105, 0.032])


def tree_pits(
    pois: Sequence[Poi],
    paved: Sequence[shapely.Polygon],
    *,
    standing: HeightAt,
    around: Surroundings,
) -> tuple[StaticPart, ...]:
    """Build pits around the trees that stand in pavements.

    Args:
        pois: All points of interest.
        paved: Pavements.
        standing: Height of pavements at places, (n, 2) -> (n,) [m].
        around: Lanes, cameras and the seed.
    """
    # Choose the trees.
    trees = [poi for poi in pois if kind_of(poi.type, poi.source) == "trees"]
    places = np.array([poi.position for poi in trees], dtype=np.float64).reshape(-1, 2)
    inside = np.zeros(len(places), dtype=np.bool_)
    if len(places) and len(paved):
        spots = shapely.points(places)
        inside[shapely.STRtree(list(paved)).query(spots, predicate="within")[0]] = True
    inside &= (around.distances(places) < PITS_REACH) & around.pictured(places, radius=2.0)
    if not inside.any():
        return ()
    # Build a pit at each, square to the road beside it.
    places = places[inside]
    names = [tree.id for tree, stays in zip(trees, inside, strict=True) if stays]
    along = np.tile([1.0, 0.0], (len(places), 1))
    if around.index.tree is not None:
        along = around.index.directions[around.index.nearest(places)[0]]
    soils, frames, tints = [], [], []
    for name, place, level, way in zip(names, places, standing(places), along, strict=True):
        rng = dice_of(around.seed, "pit", name)
        soil, frame = _pit(np.array([*place, level]), way, rng)
        soils.append(belonging(soil, f"pit:{name}"))
        frames.append(belonging(frame, f"pit:{name}"))
        tints.append(_soil_tints(len(soil.faces), rng))
    return (
        StaticPart("pits/soil", "trees", Part(merge_meshes(soils), "bark", np.concatenate(tints))),
        StaticPart("pits/frame", "trees", Part(merge_meshes(frames), "kerb")),
    )


def _pit(place: Floats, way: Floats, rng: np.random.Generator) -> tuple[Mesh, Mesh]:
    """Heaped soil and its frame, square to a direction."""
    x, y = np.array([*way, 0.0]), np.array([-way[1], way[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    line = np.linspace(-0.5, 0.5, _CELLS + 1) * _WIDE
    a, b = (grid.ravel() for grid in np.meshgrid(line, line))
    # Soil: a grid that is heaped a little towards the stem.
    rise = 0.008 + 0.05 * np.clip(1.0 - np.hypot(a, b) / (0.5 * _WIDE), 0.0, 1.0)
    rise = rise + rng.uniform(0.0, 0.012, len(a)) * (np.maximum(abs(a), abs(b)) < 0.49 * _WIDE)
    points = place + a[:, None] * x + b[:, None] * y + rise[:, None] * up
    n = _CELLS + 1
    i = (np.arange(_CELLS) + n * np.arange(_CELLS)[:, None]).ravel()
    faces = np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])
    # The frame: four rings, joined by walls and a top.
    half, outer = 0.5 * _WIDE, 0.5 * _WIDE + _STONE
    rings = []
    for size, level in ((half, 0.0), (half, _RISE), (outer, _RISE), (outer, -0.02)):
        ring = [(-size, -size), (size, -size), (size, size), (-size, size)]
        rings += [place + u * x + v * y + level * up for u, v in ring]
    k = np.arange(4)
    sides = []
    for low in (0, 4, 8):
        p, q = low + k, low + (k + 1) % 4
        sides += [np.stack([p, q + 4, q], 1), np.stack([p, p + 4, q + 4], 1)]
    return Mesh(points, faces), Mesh(np.array(rings), np.concatenate(sides))


def _soil_tints(count: int, rng: np.random.Generator) -> Floats:
    """Reflectance of soil with some growth, (count, 3)."""
    tint = _SOIL[rng.integers(0, len(_SOIL), count)] * rng.uniform(0.8, 1.2, (count, 1))
    green = rng.random(count) < 0.15
    tint[green] = _GROWTH * rng.uniform(0.8, 1.2, (int(green.sum()), 1))
    return tint


BLADES_REACH = 32.0
"""Blades stand at most this far from a camera [m]."""

HIGHEST = 6.5
"""Cameras higher above the ground than this see none [m]."""

BUDGET = 140_000
"""Triangles of all blades, at most."""

KEEP_OFF = 0.06
"""Distance of blades' feet from everything paved [m]."""

GRASSY = ("grass", "meadow")
"""Words in the names of grounds that bear blades."""

_VARIANTS = 3
_WHOLE = 6.0  # up to this distance patches are whole [m]
_BENT = 5.0  # up to this distance blades are bent [m]
_GAIN = 1.75  # dense blades shade each other, so each is brighter than the lawn as a whole
_FADE = 0.6  # share of the reach within which they thin out
_SHORT = 0.5  # height of a lawn's blades by that of a meadow's
_EDGE = 0.4  # within this distance of edges and stems grass is not mown [m]


@dataclass(frozen=True, slots=True, eq=False)
class Lawn:
    """Where blades may grow.

    Attributes:
        surface: The ground's name.
        mean: Its mean reflectance, (3,).
        paved: Roads, footways and buildings: polygons, (n,).
        stems: Trees and posts, which are mown around, (k, 2) [m].
        mown: Lawns, on which blades are short: polygons, (m,).
        covered: Where paving lies over the ground: polygons, (k,).
    """

    surface: str
    mean: Floats
    paved: Sequence[shapely.Geometry]
    stems: Floats
    mown: Sequence[shapely.Geometry] = ()
    covered: Sequence[shapely.Geometry] = ()


@dataclass(frozen=True, slots=True)
class Meadow:
    """Blades of a shot.

    Attributes:
        static: Two parts at most.
        left_out: Why there are none.
    """

    static: tuple[StaticPart, ...]
    left_out: tuple[LeftOut, ...] = ()


def lawn_of(
    surface: str,
    *,
    paved: Sequence[shapely.Geometry],
    pois: Sequence[Poi],
    polygons: Sequence[Polygon],
    eyes: Floats,
    mown: Sequence[shapely.Geometry] = (),
) -> Lawn:
    """Return where blades may grow near the cameras of a shot.

    Args:
        surface: The ground's name.
        paved: Outlines of roads and footways.
        pois: All points of interest: trees are mown around.
        polygons: All polygons: nothing grows in buildings.
        eyes: Cameras, (n, 3) [m].
        mown: Lawns, on which blades are short.
    """
    stems = [poi.position for poi in pois if kind_of(poi.type, poi.source) in PLANTS]
    plans = [
        shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
        for item in polygons
        if kind_of(item.type, item.source) == "buildings" and len(item.shape) > 2
    ]
    near, short = near_eyes([*paved, *plans], eyes), near_eyes(mown, eyes)
    places = np.array(stems, dtype=np.float64).reshape(-1, 2)
    return Lawn(surface, mean_reflectance(surface), near, places, short)


def near_eyes(areas: Sequence[shapely.Geometry], eyes: Floats) -> list[shapely.Geometry]:
    """Return what of areas lies where blades may be seen from cameras, (n, 3) [m]."""
    if not len(eyes) or not len(areas):
        return []
    low, high = (
        eyes[:, :2].min(axis=0) - BLADES_REACH - 5.0,
        eyes[:, :2].max(axis=0) + BLADES_REACH + 5.0,
    )
    some = shapely.clip_by_rect(list(areas), *low, *high)
    return [area for area in some if not area.is_empty]


def build_meadow(lawn: Lawn, *, around: Surroundings, budget: int = BUDGET) -> Meadow:
    """Grow blades where the shot's cameras come near the ground.

    Args:
        lawn: Where they may grow.
        around: Ground, cameras and seed.
        budget: Triangles, at most.
    """
    if not any(word in lawn.surface for word in GRASSY):
        return Meadow((), (LeftOut("grass blades", f"{lawn.surface} is no meadow"),))
    # Choose patches, and how many blades each has.
    eyes = _low_eyes(around)
    cells = _cells(eyes, around)
    if not len(cells):
        return Meadow((), (LeftOut("grass blades", "no camera comes near the ground"),))
    away, _ = cKDTree(eyes[:, :2]).query(cells)
    away = np.maximum(np.asarray(away) - 0.5 * PATCH, 0.0)
    counts, coarse = _thinned(away, budget)
    blades = _joined(_planted(cells, counts, coarse, away, around.seed))
    blades = _mown(_free(blades, lawn), lawn, eyes)
    # Put them on the ground; only near ones are bent.
    static = []
    near = np.asarray(cKDTree(eyes[:, :2]).query(blades.feet[:, :2])[0], dtype=np.float64)
    for name, some, fine in (("near", near < _BENT, True), ("far", ~(near < _BENT), False)):
        part = _chosen(blades, some)
        feet = np.column_stack([part.feet[:, :2], around.height_at(part.feet[:, :2])])
        mesh, tint = blades_mesh(
            Blades(feet, part.turns, part.heights, part.widths, part.leans, part.tints), fine=fine
        )
        if len(mesh.faces):
            static.append(StaticPart(f"ground/blades/{name}", "ground", Part(mesh, "leaf", tint)))
    return Meadow(tuple(static))


def _low_eyes(around: Surroundings) -> Floats:
    """Cameras near the ground, (n, 3) [m]."""
    eyes = around.viewpoints
    if not len(eyes):
        return eyes
    return np.asarray(eyes[eyes[:, 2] - around.height_at(eyes[:, :2]) < HIGHEST])


def _cells(eyes: Floats, around: Surroundings) -> Floats:
    """Middles of grid cells near low cameras and in their pictures, (n, 2) [m]."""
    if not len(eyes):
        return np.zeros((0, 2))
    steps = int(np.ceil(BLADES_REACH / PATCH))
    own = np.unique(np.floor(eyes[:, :2] / PATCH).astype(np.int64), axis=0)
    dx, dy = np.meshgrid(*[np.arange(-steps, steps + 1)] * 2)
    near = np.column_stack([dx.ravel(), dy.ravel()])
    near = near[(near**2).sum(axis=1) <= steps**2]
    index = np.unique((own[:, None] + near).reshape(-1, 2), axis=0)
    middles = (index + 0.5) * PATCH
    return np.asarray(middles[around.pictured(middles, radius=PATCH)])


def _thinned(away: Floats, budget: int) -> tuple[Ints, Floats]:
    """Blades of each cell, (n,), and how much wider they are, (n,): fewer far away."""
    coarse = np.maximum(away / _WHOLE, 1.0)
    # Towards the end they thin out, so that no edge shows.
    fade = np.clip((BLADES_REACH - away) / (_FADE * BLADES_REACH), 0.0, 1.0)
    wanted = PATCH_BLADES * coarse**-1.5 * fade
    triangles = (wanted * np.where(away < _BENT, 3, 1)).sum()
    counts = wanted * min(1.0, budget / max(float(triangles), 1.0))
    return counts.astype(np.int64), coarse


def _planted(cells: Floats, counts: Ints, coarse: Floats, away: Floats, seed: int) -> list[Blades]:
    """Patches on cells."""
    patches = [grass_patch(variant) for variant in range(_VARIANTS)]
    planted = []
    for cell, count, wide, distance in zip(cells, counts, coarse, away, strict=True):
        if not count:
            continue
        chance = share_of(seed, "grass", str(int(cell[0])), str(int(cell[1])))
        variant, quarter = divmod(int(chance * 4 * _VARIANTS), 4)
        blades = laid(patches[variant], count, place=cell, quarter=quarter, coarse=float(wide))
        low = 1.0 - 0.6 * np.clip((distance - 0.5 * BLADES_REACH) / (0.5 * BLADES_REACH), 0.0, 1.0)
        planted.append(replace(blades, heights=blades.heights * low))
    return planted


def _free(blades: Blades, lawn: Lawn) -> Blades:
    """Blades that stand on nothing paved."""
    free = np.ones(len(blades.feet), dtype=np.bool_)
    for area in (*lawn.paved, *lawn.covered):
        wide = shapely.buffer(area, KEEP_OFF)
        shapely.prepare(wide)
        free &= ~shapely.contains_xy(wide, blades.feet[:, :2])
    return _chosen(blades, free)


def _mown(blades: Blades, lawn: Lawn, eyes: Floats) -> Blades:
    """Blades in their colour, taller where no mower comes: along edges and around stems."""
    feet = blades.feet[:, :2]
    edge = np.full(len(feet), _EDGE)
    if len(lawn.paved) and len(feet):
        tree = shapely.STRtree(sides(lawn.paved))
        (near, _), distance = tree.query_nearest(
            shapely.points(feet), max_distance=_EDGE, return_distance=True, all_matches=False
        )
        edge[near] = distance
    if len(lawn.stems) and len(feet):
        distance, _ = cKDTree(lawn.stems).query(feet)
        edge = np.minimum(edge, np.maximum(np.asarray(distance) - 0.15, 0.0))
    wild = 1.0 - np.clip(edge / _EDGE, 0.0, 1.0)
    # Nothing stands up before a lens that lies in the grass.
    close, _ = cKDTree(eyes[:, :2]).query(feet) if len(feet) else (np.zeros(0), None)
    short = np.zeros(len(feet), dtype=np.bool_)
    for area in lawn.mown:
        shapely.prepare(area)
        short |= shapely.contains_xy(area, feet)
    heights = (
        blades.heights
        * np.where(short, _SHORT, 1.0 + 1.6 * wild)
        * np.clip(np.asarray(close) / 0.8, 0.2, 1.0)
    )
    # Single ones stand in full light: they may not be brighter than the lawn around them.
    dense = np.clip((BLADES_REACH - np.asarray(close)) / (_FADE * BLADES_REACH), 0.0, 1.0)
    gain = 1.0 + (_GAIN - 1.0) * dense[:, None]
    tints = gain * blades.tints * lawn.mean * (1.0 + 0.1 * wild[:, None])
    return Blades(blades.feet, blades.turns, heights, blades.widths, blades.leans, tints)


def _joined(some: Sequence[Blades]) -> Blades:
    """All in one."""
    empty = grass_patch(0)
    some = some or [_chosen(empty, np.zeros(len(empty.feet), dtype=np.bool_))]
    return Blades(*(np.concatenate([getattr(b, f.name) for b in some]) for f in fields(Blades)))


def _chosen(blades: Blades, keep: Bools) -> Blades:
    """Some of the blades."""
    return Blades(*(getattr(blades, field.name)[keep] for field in fields(Blades)))
