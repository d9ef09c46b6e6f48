"""Closed rows of houses as parts: their looks, their light, and the paving before them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.buildings.building import BuildingDesign, Walls, raised
from sumo3dviz_pt.library.buildings.facade import FAR, MIDDLE, NEAR
from sumo3dviz_pt.library.buildings.roofs import upright
from sumo3dviz_pt.library.buildings.shell import joined
from sumo3dviz_pt.library.buildings.styles import ROWS, BuildingStyle
from sumo3dviz_pt.library.materials import material_name, surface_material
from sumo3dviz_pt.model.geometry import Floats, belonging, merge_meshes, settled
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.model.scene import Bsdf, LampSet, LeftOut, Part, StaticPart
from sumo3dviz_pt.world.objects.houses import Chance, lamp_sets, painted
from sumo3dviz_pt.world.objects.objects import material_of, merged
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.roads.cells import heights_near
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import PAVING
from sumo3dviz_pt.world.rows.courts import court_meshes, court_sides
from sumo3dviz_pt.world.rows.fronts import House, Rows
from sumo3dviz_pt.world.structures.bridges import MATERIAL, SURFACE, concrete

FAMILY = "street_fronts"
"""What users call the rows."""

BUDGET = 300_000
"""Triangles of all rows of a shot, about."""

_LIMITS = np.array([75.0, 260.0])  # where coarser levels begin [m]
_COST = {NEAR: 190.0, MIDDLE: 48.0, FAR: 13.0}  # triangles per metre of walls, about
_QUARTER = 140.0  # houses in a cell of this size are about equally high [m]


@dataclass(frozen=True, slots=True, eq=False)
class Fronts:
    """Rows of houses, ready for the scene.

    Attributes:
        static: Few parts.
        materials: BSDFs of them by name.
        lamps: Windows and signs that are lit, when it is dark.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...] = ()
    materials: Mapping[str, Bsdf] = field(default_factory=dict)
    lamps: tuple[LampSet, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def build_fronts(
    rows: Rows, layout: RoadLayout, *, around: Surroundings, near: tuple[float, float]
) -> Fronts:
    """Build rows of houses and their forecourts.

    Args:
        rows: Where they stand.
        layout: The roads, which say how high forecourts lie.
        around: Cameras, ground and the seed.
        near: A point of the network [m] near which texture coordinates are small.
    """
    none = (LeftOut(FAMILY, "no city street near the camera has room"),)
    if not rows.houses and not rows.forecourts:
        return Fronts(left_out=none)
    parts = _house_parts(rows, layout, around) if rows.houses else []
    shining = [part for part in parts if part.material.startswith("lamp:")]
    plain = [part for part in parts if not part.material.startswith("lamp:")]
    static = merged(FAMILY, plain)
    materials = {
        name: material_of(name, textured=True) for name in {p.part.material for p in static}
    }
    # Pave the forecourts.
    court = material_name(PAVING)
    materials[court] = surface_material(PAVING, textured=True)
    for number, mesh in enumerate(court_meshes(rows.forecourts, layout, near)):
        static.append(StaticPart(f"{FAMILY}/court/{number}", "roads", Part(mesh, court)))
    if not layout.cells.is_flat:
        sides = merge_meshes(court_sides(rows.forecourts, layout, around.height_at))
        static.append(StaticPart(f"{FAMILY}/sides", "roads", Part(concrete(sides), MATERIAL)))
        materials[MATERIAL] = surface_material(SURFACE, textured=True)
    lamps = tuple(replace(some, id=f"{FAMILY}_{some.id}") for some in lamp_sets(shining))
    return Fronts(tuple(static), materials, lamps, () if rows.houses else none)


def _house_parts(rows: Rows, layout: RoadLayout, around: Surroundings) -> list[Part]:
    """The houses of rows in the world."""
    # Ask for all heights at once: each request for heights of a sloped road is expensive.
    spots = [house.plan[: house.fronts + 1] for house in rows.houses]
    ends = np.cumsum([len(some) for some in spots])[:-1]
    heights = np.split(heights_near(layout.cells, np.concatenate(spots)) + SIDEWALK_HEIGHT, ends)
    # Build the houses.
    levels = _levels(rows.houses, around)
    parts: list[Part] = []
    for house, own, level in zip(rows.houses, heights, levels, strict=True):
        make = partial(house_of_row, house, own, around=around, level=level)
        parts += around.memory.of((FAMILY, *house.name, own.tobytes(), level), make)
    return parts


def house_of_row(
    house: House, heights: Floats, *, around: Surroundings, level: int
) -> tuple[Part, ...]:
    """Build the parts of one house in the world.

    Args:
        house: Its plan and neighbours.
        heights: Of the pavement at its front, (n,) [m].
        around: The seed, and whether it is dark.
        level: Of detail.
    """
    chance = Chance(around.seed, f"{FAMILY}:{house.id}", around.dark, around.language)
    style, design = _look(house, chance)
    middle = house.plan.mean(axis=0)
    low = float(heights.min() + 0.25 * np.ptp(heights))
    fronts = tuple(range(house.fronts))
    shell = raised(
        house.plan - middle,
        design,
        height=_height(house, design, chance),
        level=level,
        seed=int(chance.share("shell") * 2**32),
        walls=Walls(fronts, house.blind, chance.writing),
    )
    if np.ptp(heights) > 0.4:  # on a slope the foot of a house shows
        shell = joined([shell, {"plinth": upright(house.plan - middle, -5.0, -0.9)}])
    shift = np.array([*middle, low])
    placed = {role: quads + shift for role, quads in shell.items()}
    parts = painted(placed, style, ObjectSettings(), chance, level=level)
    thing = f"house:{house.id}"
    return tuple(replace(part, mesh=belonging(part.mesh, thing)) for part in parts)


def _look(house: House, chance: Chance) -> tuple[BuildingStyle, BuildingDesign]:
    """Return style and design of a house; shops are usual at main streets and corners."""
    known = [row for row in ROWS if row.corners or not house.corner]
    style = known[pick([row.share for row in known], chance.share("style"))].style
    shops = chance.share("shops") < (0.8 if house.main or house.corner else 0.35)
    fit = [d for d in style.designs if (d.foot == "shops") == shops] or list(style.designs)
    # Roofs along the street suit straight houses only.
    if house.corner or len(house.blind) < 2:
        fit = [d for d in fit if d.roof not in ("gable", "hip")] or fit
    return style, fit[int(chance.share("design") * len(fit))]


def _height(house: House, design: BuildingDesign, chance: Chance) -> float:
    """Height of a house's walls: as its quarter, a storey more or less [m]."""
    middle = settled(house.plan.mean(axis=0))
    cell = [f"{value:.0f}" for value in np.floor(middle / _QUARTER)]
    usual = 3 + int(3 * share_of(chance.seed, "quarter", *cell))
    usual -= not house.main
    storeys = usual + (-1, 0, 0, 1)[int(4 * chance.share("storeys"))] + house.corner
    first = design.ground or design.plinth + design.storey
    return first + max(storeys, 2) * design.storey * (0.96 + 0.08 * chance.share("storey"))


def _levels(houses: Sequence[House], around: Surroundings) -> list[int]:
    """Level of detail of each house; limits come closer until the budget is kept."""
    corners = np.concatenate([house.plan for house in houses])
    away = around.distances(corners)
    ends = np.cumsum([len(house.plan) for house in houses])[:-1]
    nearest = np.array([part.min() for part in np.split(away, ends)])
    length = np.array([shapely.Polygon(house.plan).length for house in houses])
    middles = np.array([house.plan.mean(axis=0) for house in houses])
    # Beside and behind the camera only shadows and reflections show.
    hidden = ~around.pictured(middles, radius=18.0)
    nearest = np.where(hidden, np.maximum(nearest, _LIMITS[0] + 1.0), nearest)
    cost = np.array([_COST[NEAR], _COST[MIDDLE], _COST[FAR]])
    shrink = 1.5
    levels = np.searchsorted(_LIMITS * shrink, nearest, side="right")
    while (cost[levels] * length).sum() > BUDGET and shrink > 0.1:
        shrink *= 0.85
        levels = np.searchsorted(_LIMITS * shrink, nearest, side="right")
    return [int(level) for level in levels]
