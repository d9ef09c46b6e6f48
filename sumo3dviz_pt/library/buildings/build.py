"""Buildings over any plan: a design says how, a height says how many storeys.

Body frame of those that stand at points: origin on the ground in the middle of the
plan, the front looks to +x. Walls reach 1 m below the ground, so that nothing floats on
a slope. Every wall draws its chances from a stream of its own, so that all levels of
detail show the same windows.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.buildings.balconies import Balconies, balconies, french_doors
from sumo3dviz_pt.library.buildings.bands import band, outward
from sumo3dviz_pt.library.buildings.details import blade_signs, coolers, down_pipe
from sumo3dviz_pt.library.buildings.facade import FAR, NEAR, PROUD, Facade, storey, wall, windows
from sumo3dviz_pt.library.buildings.fronts import FOOT, door, gates, shops
from sumo3dviz_pt.library.buildings.roofs import (
    flat_roof,
    gable_roof,
    gutters,
    hip_roof,
    inset,
    is_convex,
    mansard_roof,
    upright,
)
from sumo3dviz_pt.library.buildings.shell import Shell, joined, rectangles, stood_up
from sumo3dviz_pt.library.buildings.tops import chimneys, dormers, machines
from sumo3dviz_pt.model.geometry import Floats, settled

FOUNDATION = FOOT
"""How deep walls reach [m]."""

_RISE = 2.7  # of mansard slopes [m]


@dataclass(frozen=True, slots=True)
class Design(RecipeValue):
    """How a building looks, whatever its plan and height.

    Attributes:
        upper: Windows above the ground floor.
        low: Windows of the ground floor; None as above.
        sides: Windows of walls that are no fronts; None as on fronts.
        ground: Height of the ground floor [m]; 0 as the others.
        storey: Height of the others, about [m].
        plinth: Height of the foot, and of the floor [m].
        foot: What fronts have at the street.
        unit: Distance between two doors [m].
        roof: Which.
        pitch: Of gabled and hipped roofs [rad].
        parapet: Of flat roofs [m].
        courses: How far bands between storeys reach out [m]; 0 for none.
        cornice: How far the uppermost band reaches out [m]; 0 for none.
        balconies: In front of which bays of fronts and backs.
        dormers: Whether slopes have windows.
        lift: Whether flat roofs carry a lift house.
    """

    upper: Facade
    low: Facade | None = None
    sides: Facade | None = None
    ground: float = 0.0
    storey: float = 3.0
    plinth: float = 0.3
    foot: Literal["door", "shops", "band", "gates"] = "door"
    unit: float = 14.0
    roof: Literal["flat", "gable", "hip", "mansard"] = "flat"
    pitch: float = 0.7
    parapet: float = 0.6
    courses: float = 0.0
    cornice: float = 0.0
    balconies: Balconies = "none"
    dormers: bool = False
    lift: bool = False

    def floors(self, height: float) -> tuple[float, Floats]:
        """Where the ground floor ends, and the storeys above it begin and end [m].

        Args:
            height: Of the walls [m].
        """
        first = self.ground or self.plinth + self.storey
        if height < first + 0.6 * self.storey:
            return height, np.array([height])
        count = max(round((height - first) / self.storey), 1)
        return first, np.linspace(first, height, count + 1)


@dataclass(frozen=True, slots=True)
class Walls:
    """What the walls of a building look at; wall i begins at corner i of the plan.

    Attributes:
        fronts: Numbers of those at a street.
        blind: Numbers of those that a neighbour shares.
    """

    fronts: Collection[int] = (0,)
    blind: Collection[int] = ()


@dataclass(frozen=True, slots=True)
class _Wall:
    """One wall of a building, and what its parts need to know."""

    design: Design
    length: float
    floors: Floats
    first: float
    front: bool
    back: bool
    level: int
    seed: int
    number: int

    def chance(self, salt: int) -> np.random.Generator:
        """A stream of its own for each use."""
        return np.random.default_rng([self.seed, self.number, salt])

    @property
    def upper(self) -> Facade:
        """Its windows above the ground floor."""
        return self.design.upper if self.front or self.back else self.other

    @property
    def other(self) -> Facade:
        """Windows of walls that are no fronts."""
        return self.design.sides or self.design.upper


def rectangle(depth: float, width: float) -> Floats:
    """Plan of a building with its front at +x, counter-clockwise, (4, 2) [m]."""
    x, y = depth / 2, width / 2
    return np.array([[x, -y], [x, y], [-x, y], [-x, -y]])


def raised(
    plan: Floats,
    design: Design,
    *,
    height: float,
    level: int,
    seed: int,
    walls: Walls | None = None,
) -> Shell:
    """A building over a plan.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m]; convex or not.
        design: How it looks.
        height: Of the walls up to the roof [m].
        level: Level of detail.
        seed: Of all chance.
        walls: What they look at; default the first at a street.
    """
    walls = walls or Walls()
    first, floors = design.floors(height)
    after = np.roll(plan, -1, axis=0)
    facing = outward(plan)
    parts: list[Shell] = []
    lengths = settled(np.linalg.norm(after - plan, axis=1)).tolist()
    for i, (a, b, length) in enumerate(zip(plan, after, lengths, strict=True)):
        if i in walls.blind:
            parts.append(stood_up({"wall": rectangles(0.0, length, FOUNDATION, height)}, a, b))
            continue
        back = any(float(facing[i] @ facing[j]) < -0.8 for j in walls.fronts)
        one = _Wall(design, length, floors, first, i in walls.fronts, back, level, seed, i)
        parts.append(stood_up(joined(_wall_parts(one)), a, b))
    parts.append(_bands(plan, design, (first, floors), (level, walls)))
    parts.append(_roof(plan, design, height, (level, seed, walls)))
    return joined(parts)


def _wall_parts(one: _Wall) -> list[Shell]:
    """Ground floor, storeys and balconies of a wall."""
    parts = [_ground(one)]
    sort: Balconies = one.design.balconies if one.front or one.back else "none"
    seed = one.seed * 8 + one.number
    if len(one.floors) > 1:
        rng, french = one.chance(2), french_doors(sort, seed)
        parts.append(
            wall(one.length, one.floors, one.upper, level=one.level, rng=rng, french=french)
        )
        how = (one.level, seed)
        parts.append(balconies(one.length, one.floors, one.upper, sort=sort, how=how))
    return [*parts, *_details(one)]


def _details(one: _Wall) -> list[Shell]:
    """What hangs on a wall: pipes, signs, machines."""
    design, how = one.design, (one.level, one.chance(4))
    if design.foot in ("gates", "band") or len(one.floors) < 3:
        return []
    parts: list[Shell] = []
    if one.front and one.upper.width > 0.0:
        parts.append(down_pipe(float(one.floors[-1]), how, hopper=0.15 + design.cornice))
    if one.front and design.foot == "shops":
        parts.append(blade_signs(one.length, one.first, how))
    if one.upper.width > 0.0 and design.balconies in ("solid", "glass", "gallery", "none"):
        rows = [one.upper.openings(one.length, z) for z in one.floors[:-1].tolist()]
        parts.append(coolers(np.concatenate(rows), how))
    return parts


def _ground(one: _Wall) -> Shell:
    """The ground floor of a wall."""
    design, length = one.design, one.length
    how = (one.level, one.chance(1))
    if one.front and length > 4.0:
        if design.foot in ("shops", "band"):
            return shops(length, one.first, how, sign="band" if design.foot == "band" else "each")
        if design.foot == "gates":
            return gates(length, one.first, how)
    low = (
        (design.low or design.upper) if one.front else (design.sides or design.low or design.upper)
    )
    openings = low.openings(length, design.plinth)
    openings = openings[openings[:, 3] < one.first - 0.1]
    doors = _door_places(one, openings) if one.front else openings[:0]
    clear = np.ones(len(openings), dtype=np.bool_)
    for u0, u1, *_ in doors.tolist():
        clear &= (openings[:, 1] < u0 - 0.2) | (openings[:, 0] > u1 + 0.2)
    row = np.concatenate([openings[clear], doors])
    row = row[np.argsort(row[:, 0], kind="stable")]
    if one.level == NEAR:
        face = storey(length, design.plinth, one.first, row)
    else:
        face = rectangles(0.0, length, design.plinth, one.first)
    role = "base" if design.ground else "wall"
    made = windows(openings[clear], low, level=one.level, rng=one.chance(3))
    leaves = [door(leaf, step=design.plinth, level=one.level) for leaf in doors]
    return joined([{role: face}, made, *leaves])


def _door_places(one: _Wall, openings: Floats) -> Floats:
    """Doors in the place of some windows, (n, 4) as u0, u1, z0, z1 [m]."""
    length, floor = one.length, one.design.plinth
    tall = min(2.15 if one.first < 3.4 else 2.75, one.first - floor - 0.25)
    if length < 2.2 or tall < 1.8:
        return openings[:0]
    count = max(round(length / one.design.unit), 1)
    axes = (np.arange(count) + 0.5) * length / count
    if len(openings):
        middles = openings[:, :2].mean(axis=1)
        nearest = settled(np.abs(axes[:, None] - middles)).argmin(axis=1)
        axes = np.unique(middles[nearest])
    half = np.full(len(axes), 0.55 if tall < 2.3 else 0.8)
    return np.stack([axes - half, axes + half, 0 * axes + floor, 0 * axes + floor + tall], axis=1)


def _bands(
    plan: Floats, design: Design, rows: tuple[float, Floats], how: tuple[int, Walls]
) -> Shell:
    """The plinth, and bands that run around the building, not into neighbours."""
    (first, floors), (level, walls) = rows, how
    apart = np.array([i not in walls.blind for i in range(len(plan))], dtype=np.float64)

    def _belt(plan: Floats, heights: tuple[float, float], out: float, role: str) -> Shell:
        return band(plan, heights, out * apart, role)

    parts: list[Shell] = [{"plinth": upright(plan, FOUNDATION, _foot(design))}]
    shown = level != FAR
    if shown and _foot(design) > 0.1:
        parts.append(_belt(plan, (FOUNDATION, _foot(design)), 0.04, "plinth"))
    if shown and design.ground and len(floors) > 1 and design.courses:
        parts.append(_belt(plan, (first - 0.16, first + 0.1), design.courses + 0.05, "trim"))
    if level == NEAR and design.courses:
        for z in floors[1:-1].tolist():
            parts.append(_belt(plan, (z - 0.1, z + 0.06), design.courses, "trim"))
    if design.cornice:
        top = float(floors[-1])
        parts.append(_belt(plan, (top - 0.3, top + 0.02), design.cornice, "trim"))
        if level == NEAR and design.cornice > 0.2:
            parts.append(_belt(plan, (top - 0.62, top - 0.3), 0.4 * design.cornice, "trim"))
    return joined(parts)


def _foot(design: Design) -> float:
    """Where walls begin [m]."""
    return design.plinth if design.foot == "door" else 0.0


def _roof(plan: Floats, design: Design, height: float, how: tuple[int, int, Walls]) -> Shell:
    """The roof and what stands on it."""
    level, seed, _ = how
    if design.roof == "hip" and is_convex(plan):
        parts = [hip_roof(plan, height, pitch=design.pitch, level=level)]
        return joined([*parts, gutters(plan, height, level)])
    if design.roof in ("gable", "hip"):
        return _gabled(plan, design, height, how)
    if design.roof == "mansard":
        return _mansard(plan, design, height, how)
    flat = flat_roof(plan, height, parapet=design.parapet, level=level)
    return joined([flat, machines(plan, height, lift=design.lift, how=(level, seed))])


def _gabled(plan: Floats, design: Design, height: float, how: tuple[int, int, Walls]) -> Shell:
    """A gabled roof along the longer side of the plan, or the street, with chimneys."""
    level, seed, walls = how
    around = shapely.get_coordinates(Polygon(plan).minimum_rotated_rectangle.exterior)
    sides = around[1:3] - around[:2]
    street = plan[1] - plan[0] if walls.blind else np.zeros(2)
    lengths = settled(np.linalg.norm(sides, axis=1))
    long, short = sides[np.argsort(-lengths, kind="stable")]
    cosines = [abs((side * street).sum()) / np.hypot(*side) for side in (long, short)]
    if settled(cosines[1] - cosines[0]) > 0.0:
        long, short = short, long
    pitch = design.pitch
    parts = [gable_roof(plan, height, pitch=pitch, along=long, level=level)]
    parts.append(gutters(plan, height, level))
    if level != FAR and design.foot != "gates" and float(long @ long) > 30.0:
        ridge = height + np.tan(pitch) * float(np.linalg.norm(short)) / 2
        parts.append(_attic(plan, design, (height, ridge), (level, seed, long)))
        rng = np.random.default_rng([seed, 31])
        middle = around[:4].mean(axis=0)
        count = max(round(float(np.linalg.norm(long)) / design.unit), 1)
        shares = (np.arange(count) + rng.uniform(0.25, 0.75)) / count - 0.5
        spots = middle + shares[:, None] * long + 0.08 * short
        inside = shapely.contains_xy(Polygon(plan).buffer(-0.5), spots[:, 0], spots[:, 1])
        spots = spots[inside]
        parts.append(chimneys(spots, height, np.full(len(spots), ridge + 0.5), level=level))
    return joined(parts)


def _attic(
    plan: Floats, design: Design, heights: tuple[float, float], how: tuple[int, int, Floats]
) -> Shell:
    """A pair of windows in each gable that has room for them."""
    (eaves, ridge), (level, seed, along) = heights, how
    if ridge - eaves < 2.8:
        return {}
    facade = replace(design.upper, width=0.9, height=1.1, inset=-PROUD, mullions=0)
    across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    parts: list[Shell] = []
    for i, (a, b) in enumerate(zip(plan, np.roll(plan, -1, axis=0), strict=True)):
        length = float(np.linalg.norm(b - a))
        if length < 6.0 or abs(float((b - a) @ across)) < 0.97 * length:
            continue
        middle = length / 2 + np.array([-0.85, 0.85])
        low = np.full(2, eaves + 0.45)
        openings = np.stack([middle - 0.45, middle + 0.45, low, low + 1.1], axis=1)
        rng = np.random.default_rng([seed, i, 43])
        parts.append(stood_up(windows(openings, facade, level=level, rng=rng), a, b))
    return joined(parts)


def _mansard(plan: Floats, design: Design, height: float, how: tuple[int, int, Walls]) -> Shell:
    """A mansard roof with dormers and machines."""
    level, seed, walls = how
    parts = [mansard_roof(plan, height, rise=_RISE, level=level, blind=walls.blind)]
    if inset(plan, 0.45 * _RISE) is None:
        return parts[0]
    facade = replace(
        design.upper,
        height=1.35,
        sill=0.35,
        width=1.05,
        inset=0.08,
        hood=False,
        surround=0.0,
        boards=False,
        lintel=False,
    )
    for i, (a, b) in enumerate(zip(plan, np.roll(plan, -1, axis=0), strict=True)):
        rng = np.random.default_rng([seed, i, 41])
        slope = (height, 1 / 0.45, 0.25)
        open_ = i not in walls.blind and float(np.linalg.norm(b - a)) > 5.0
        if design.dormers and open_:
            parts.append(dormers(a, b, slope=slope, facade=facade, how=(level, rng)))
    parts.append(machines(plan, height + _RISE, lift=False, how=(level, seed)))
    return joined(parts)
