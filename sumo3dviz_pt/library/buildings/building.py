"""Buildings over any plan: a design says how they look, a height how many storeys they have.

Beside the design, a building is given its plan and what its walls look at. Its roof is slopes or a
deck, as the design says, and what stands on them.

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
from sumo3dviz_pt.library.buildings.facade import (
    FAR,
    NEAR,
    PROUD,
    Balconies,
    Facade,
    balconies,
    french_doors,
    storey,
    wall,
    windows,
)
from sumo3dviz_pt.library.buildings.fronts import (
    FOOT,
    coolers,
    door,
    down_pipe,
    gates,
    shops,
)
from sumo3dviz_pt.library.buildings.roofs import (
    LEAN,
    GableRidge,
    RoofSlope,
    band,
    chimneys,
    dormers,
    flat_roof,
    gable_roof,
    hip_roof,
    inset,
    is_convex,
    machines,
    mansard_roof,
    outward,
    rain_pipes,
    upright,
)
from sumo3dviz_pt.library.buildings.shell import Shell, joined, rectangles, stood_up
from sumo3dviz_pt.library.buildings.shop_words import UNTOLD, Writing
from sumo3dviz_pt.library.buildings.sign_boards import Boards, blade_signs
from sumo3dviz_pt.model.geometry import Floats, settled

RoofKind = Literal["flat", "gable", "hip", "mansard", "skillion"]
"""Of roofs; a skillion is one slope."""


@dataclass(frozen=True, slots=True)
class BuildingDesign(RecipeValue):
    """How a building looks, whatever its plan and height.

    Attributes:
        upper: Windows above the ground floor of walls at a street, and of those behind.
        low: Windows of the ground floor; None for the same as above it.
        sides: Windows of the other walls; None for the same as on fronts.
        ground: Height of the ground floor [m]; 0 for that of the other storeys.
        storey: Height of the other storeys, about [m].
        plinth: Height of the dark foot, and of the floor behind it [m].
        foot: What fronts have at the street: doors, shops, shops under one band, or gates.
        unit: Distance between two doors [m].
        roof: Its kind.
        pitch: Of gabled and hipped roofs [rad].
        parapet: Of flat roofs [m].
        courses: How far bands between storeys reach out [m]; 0 for none.
        cornice: How far the uppermost band reaches out [m]; 0 for none.
        balconies: Kind of the balconies on fronts and backs.
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
    roof: RoofKind = "flat"
    pitch: float = 0.7
    parapet: float = 0.6
    courses: float = 0.0
    cornice: float = 0.0
    balconies: Balconies = "none"
    dormers: bool = False
    lift: bool = False

    def floors(self, height: float) -> Floats:
        """Divide walls of a height [m] into storeys.

        Returns:
            Where the ground floor ends, and where each storey above it does, (n,) [m].
        """
        first = self.ground or self.plinth + self.storey
        if height < first + 0.6 * self.storey:
            return np.array([height])
        count = max(round((height - first) / self.storey), 1)
        return np.linspace(first, height, count + 1)

    @property
    def foot_height(self) -> float:
        """Where walls begin [m]."""
        return self.plinth if self.foot == "door" else 0.0


@dataclass(frozen=True, slots=True)
class Walls:
    """What the walls of a building look at and say; wall i begins at corner i of the plan.

    Attributes:
        fronts: Numbers of those at a street.
        blind: Numbers of those that a neighbour shares.
        writing: What is written on its shops.
    """

    fronts: Collection[int] = (0,)
    blind: Collection[int] = ()
    writing: Writing = UNTOLD


@dataclass(frozen=True, slots=True, eq=False)
class Building:
    """A building to be raised over a plan.

    Attributes:
        plan: Counter-clockwise corners, (n, 2) [m]; convex or not.
        design: How it looks.
        height: Of the walls up to the roof [m].
        level: Level of detail.
        seed: Of all chance.
        walls: What they look at.
    """

    plan: Floats
    design: BuildingDesign
    height: float
    level: int
    seed: int
    walls: Walls


_RISE = 2.7  # of mansard slopes [m]
_MOST = 0.55  # of a building's height, what its roof may take


def below_roof(
    plan: Floats, design: BuildingDesign, top: float, *, rise: float | None = None
) -> tuple[BuildingDesign, float]:
    """Return a design whose roof ends at a height, and the height of the walls below it [m].

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        design: How the building looks.
        top: Of its roof [m].
        rise: Of the roof [m]; None for what the design's pitch gives. A mansard has its own.
    """
    if design.roof == "flat":
        return design, top
    if design.roof == "mansard":
        return (design, top - _RISE) if _MOST * top > _RISE else (replace(design, roof="flat"), top)
    around = shapely.get_coordinates(Polygon(plan).minimum_rotated_rectangle.exterior)
    span = float(np.linalg.norm(np.diff(around[:3], axis=0), axis=1).min())
    span = span if design.roof == "skillion" else span / 2
    rise = min(span * float(np.tan(design.pitch)) if rise is None else rise, _MOST * top)
    return replace(design, pitch=float(np.arctan2(rise, span))), top - rise


def roof_of(building: Building) -> Shell:
    """Build the roof and what stands on it."""
    plan, design, height, level = building.plan, building.design, building.height, building.level
    if design.roof == "hip" and is_convex(plan):
        parts = [hip_roof(plan, height, pitch=design.pitch, level=level)]
        return joined([*parts, rain_pipes(plan, height, level)])
    if design.roof in ("gable", "hip", "skillion"):
        return _gabled(building)
    if design.roof == "mansard":
        return _mansard(building)
    flat = flat_roof(plan, height, parapet=design.parapet, level=level)
    tops = machines(plan, height, lift=design.lift, level=level, seed=building.seed)
    return joined([flat, tops])


def _gabled(building: Building) -> Shell:
    """Build a gabled roof along the longer side of the plan, or the street, with chimneys."""
    plan, design, height, level = building.plan, building.design, building.height, building.level
    # The ridge runs along one side of the smallest rectangle around the plan.
    around = shapely.get_coordinates(Polygon(plan).minimum_rotated_rectangle.exterior)
    sides = around[1:3] - around[:2]
    street = plan[1] - plan[0] if building.walls.blind else np.zeros(2)
    lengths = settled(np.linalg.norm(sides, axis=1))
    long, short = sides[np.argsort(-lengths, kind="stable")]
    cosines = [abs((side * street).sum()) / np.hypot(*side) for side in (long, short)]
    if settled(cosines[1] - cosines[0]) > 0.0:
        long, short = short, long
    line = GableRidge(long, aside=design.roof == "skillion")
    parts = [gable_roof(plan, height, pitch=design.pitch, ridge=line, level=level)]
    parts.append(rain_pipes(plan, height, level))
    if line.aside:
        return joined(parts)
    if level != FAR and design.foot != "gates" and float(long @ long) > 30.0:
        ridge = height + np.tan(design.pitch) * float(np.linalg.norm(short)) / 2
        parts.append(_attic(building, ridge, long))
        # Chimneys stand beside the ridge, about one for each door below.
        rng = np.random.default_rng([building.seed, 31])
        middle = around[:4].mean(axis=0)
        count = max(round(float(np.linalg.norm(long)) / design.unit), 1)
        shares = (np.arange(count) + rng.uniform(0.25, 0.75)) / count - 0.5
        spots = middle + shares[:, None] * long + 0.08 * short
        inside = shapely.contains_xy(Polygon(plan).buffer(-0.5), spots[:, 0], spots[:, 1])
        spots = spots[inside]
        parts.append(chimneys(spots, height, np.full(len(spots), ridge + 0.5), level=level))
    return joined(parts)


def _attic(building: Building, ridge: float, along: Floats) -> Shell:
    """Build a pair of windows in each gable that has room for them below the ridge [m]."""
    plan, eaves = building.plan, building.height
    if ridge - eaves < 2.8:
        return {}
    upper = building.design.upper
    facade = replace(upper, width=0.9, height=1.1, inset=-PROUD, mullions=0)
    across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    parts: list[Shell] = []
    for i, (a, b) in enumerate(zip(plan, np.roll(plan, -1, axis=0), strict=True)):
        length = float(np.linalg.norm(b - a))
        if length < 6.0 or abs(float((b - a) @ across)) < 0.97 * length:
            continue
        middle = length / 2 + np.array([-0.85, 0.85])
        low = np.full(2, eaves + 0.45)
        openings = np.stack([middle - 0.45, middle + 0.45, low, low + 1.1], axis=1)
        rng = np.random.default_rng([building.seed, i, 43])
        made = windows(openings, facade, level=building.level, rng=rng)
        parts.append(stood_up(made, a, b))
    return joined(parts)


def _mansard(building: Building) -> Shell:
    """Build a mansard roof with dormers and machines."""
    plan, design, height = building.plan, building.design, building.height
    level, seed, blind = building.level, building.seed, building.walls.blind
    parts = [mansard_roof(plan, height, rise=_RISE, level=level, blind=blind)]
    if inset(plan, LEAN * _RISE) is None:
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
    slope = RoofSlope(height, 1 / LEAN, 0.25)
    for i, (a, b) in enumerate(zip(plan, np.roll(plan, -1, axis=0), strict=True)):
        if design.dormers and i not in blind and float(np.linalg.norm(b - a)) > 5.0:
            rng = np.random.default_rng([seed, i, 41])
            parts.append(dormers(a, b, slope=slope, facade=facade, level=level, rng=rng))
    parts.append(machines(plan, height + _RISE, lift=False, level=level, seed=seed))
    return joined(parts)


FOUNDATION = FOOT
"""How deep walls reach [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Wall:
    """One wall of a building, and what its parts need to know.

    Attributes:
        building: To which it belongs.
        number: In the plan.
        length: [m].
        floors: As `BuildingDesign.floors` gives them [m].
        front: Whether it stands at a street.
        back: Whether it looks away from one.
    """

    building: Building
    number: int
    length: float
    floors: Floats
    front: bool
    back: bool

    @property
    def design(self) -> BuildingDesign:
        """How the building looks."""
        return self.building.design

    @property
    def level(self) -> int:
        """Level of detail."""
        return self.building.level

    @property
    def first(self) -> float:
        """Where the ground floor ends [m]."""
        return float(self.floors[0])

    @property
    def upper(self) -> Facade:
        """Its windows above the ground floor."""
        design = self.design
        return design.upper if self.front or self.back else design.sides or design.upper

    @property
    def low(self) -> Facade:
        """Its windows on the ground floor."""
        design = self.design
        low = design.low or design.upper
        return low if self.front else design.sides or low

    @property
    def boards(self) -> Boards:
        """What is written over its shops."""
        seed = (self.building.seed, self.number)
        writing = self.building.walls.writing
        return Boards(writing, seed, whole=self.design.foot == "band")

    def chance(self, use: int) -> np.random.Generator:
        """Give a stream of its own to each use."""
        return np.random.default_rng([self.building.seed, self.number, use])


def rectangle(depth: float, width: float) -> Floats:
    """Return the plan of a building with its front at +x, counter-clockwise, (4, 2) [m]."""
    x, y = depth / 2, width / 2
    return np.array([[x, -y], [x, y], [-x, y], [-x, -y]])


def raised(
    plan: Floats,
    design: BuildingDesign,
    *,
    height: float,
    level: int,
    seed: int,
    walls: Walls | None = None,
) -> Shell:
    """Raise a building over a plan.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m]; convex or not.
        design: How it looks.
        height: Of the walls up to the roof [m].
        level: Level of detail.
        seed: Of all chance.
        walls: What they look at; default the first at a street.
    """
    building = Building(plan, design, height, level, seed, walls or Walls())
    floors = design.floors(height)
    return joined([*_walls(building, floors), _bands(building, floors), roof_of(building)])


def _walls(building: Building, floors: Floats) -> list[Shell]:
    """Build all walls; those that a neighbour shares are plain."""
    plan, walls = building.plan, building.walls
    after = np.roll(plan, -1, axis=0)
    facing = outward(plan)
    lengths = settled(np.linalg.norm(after - plan, axis=1)).tolist()
    parts: list[Shell] = []
    for i, (a, b, length) in enumerate(zip(plan, after, lengths, strict=True)):
        if i in walls.blind:
            plain = rectangles(0.0, length, building.design.foot_height, building.height)
            parts.append(stood_up({"wall": plain}, a, b))
            continue
        back = any(float(facing[i] @ facing[j]) < -0.8 for j in walls.fronts)
        one = _Wall(building, i, length, floors, i in walls.fronts, back)
        parts.append(stood_up(joined(_wall_parts(one)), a, b))
    return parts


def _wall_parts(one: _Wall) -> list[Shell]:
    """Build ground floor, storeys, balconies and details of a wall."""
    parts = [_ground(one)]
    sort: Balconies = one.design.balconies if one.front or one.back else "none"
    seed, level = one.building.seed * 8 + one.number, one.level
    if len(one.floors) > 1:
        rng, french = one.chance(2), french_doors(sort, seed)
        parts.append(wall(one.length, one.floors, one.upper, level=level, rng=rng, french=french))
        parts.append(
            balconies(one.length, one.floors, one.upper, sort=sort, level=level, seed=seed)
        )
    return [*parts, *_details(one)]


def _details(one: _Wall) -> list[Shell]:
    """Build what hangs on a wall: pipes, signs, machines."""
    design, level, rng = one.design, one.level, one.chance(4)
    if design.foot in ("gates", "band") or len(one.floors) < 3:
        return []
    parts: list[Shell] = []
    if one.front and one.upper.width > 0.0:
        top, hopper = float(one.floors[-1]), 0.15 + design.cornice
        parts.append(down_pipe(top, level=level, rng=rng, hopper=hopper))
    if one.front and design.foot == "shops":
        parts.append(blade_signs(one.length, one.first, one.boards, level=level, rng=rng))
    if one.upper.width > 0.0 and design.balconies in ("solid", "glass", "gallery", "none"):
        rows = [one.upper.openings(one.length, z) for z in one.floors[:-1].tolist()]
        parts.append(coolers(np.concatenate(rows), level=level, rng=rng))
    return parts


def _ground(one: _Wall) -> Shell:
    """Build the ground floor of a wall."""
    design, length, level = one.design, one.length, one.level
    if one.front and length > 4.0:
        if design.foot in ("shops", "band"):
            return shops(length, one.first, level=level, rng=one.chance(1), boards=one.boards)
        if design.foot == "gates":
            return gates(length, one.first, level=level)
    openings = one.low.openings(length, design.plinth)
    openings = openings[openings[:, 3] < one.first - 0.1]
    doors = _door_places(one, openings) if one.front else openings[:0]
    # Where a door stands there is no window.
    clear = np.ones(len(openings), dtype=np.bool_)
    for u0, u1, *_ in doors.tolist():
        clear &= (openings[:, 1] < u0 - 0.2) | (openings[:, 0] > u1 + 0.2)
    row = np.concatenate([openings[clear], doors])
    row = row[np.argsort(row[:, 0], kind="stable")]
    role = "base" if design.ground else "wall"
    face: Shell = {role: rectangles(0.0, length, design.plinth, one.first)}
    if level == NEAR:
        face = storey(length, design.plinth, one.first, row, role)
    made = windows(openings[clear], one.low, level=level, rng=one.chance(3))
    leaves = [door(leaf, step=design.plinth, level=level) for leaf in doors]
    return joined([face, made, *leaves])


def _door_places(one: _Wall, openings: Floats) -> Floats:
    """Place doors instead of some windows, (n, 4) as u0, u1, z0, z1 [m]."""
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


def _bands(building: Building, floors: Floats) -> Shell:
    """Build the plinth, and bands that run around the building, but not into neighbours."""
    plan, design, level = building.plan, building.design, building.level
    blind, foot = building.walls.blind, design.foot_height
    apart = np.array([i not in blind for i in range(len(plan))], dtype=np.float64)

    def belt(low: float, high: float, out: float, role: str = "trim") -> Shell:
        """Build a band between two heights that reaches out by a distance [m]."""
        return band(plan, (low, high), out * apart, role)

    parts: list[Shell] = [{"plinth": upright(plan, FOUNDATION, foot)}]
    if level != FAR and foot > 0.1:
        parts.append(belt(FOUNDATION, foot, 0.04, "plinth"))
    if level != FAR and design.ground and len(floors) > 1 and design.courses:
        first = float(floors[0])
        parts.append(belt(first - 0.16, first + 0.1, design.courses + 0.05))
    if level == NEAR and design.courses:
        parts += [belt(z - 0.1, z + 0.06, design.courses) for z in floors[1:-1].tolist()]
    if design.cornice:
        top = float(floors[-1])
        parts.append(belt(top - 0.3, top + 0.02, design.cornice))
        if level == NEAR and design.cornice > 0.2:
            parts.append(belt(top - 0.62, top - 0.3, 0.4 * design.cornice))
    return joined(parts)
