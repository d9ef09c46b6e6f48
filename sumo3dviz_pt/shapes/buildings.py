"""Family houses, shops, apartment blocks and buildings over any footprint.

Body frame: origin on the ground in the middle of the footprint, the front looks to +x.
Walls reach 1 m below the ground, so that nothing floats on a slope.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Colour
from sumo3dviz_pt.shapes.facade import FAR, NEAR, Facade, storey, wall, windows
from sumo3dviz_pt.shapes.roofs import flat_roof, gable_roof
from sumo3dviz_pt.shapes.shell import Palette, Shell, box, joined, rectangles, stood_up

FOUNDATION = -1.0
"""How deep walls reach [m]."""


@dataclass(frozen=True, slots=True)
class Style:
    """A kind of building with its colours.

    Attributes:
        build: Makes the shell of a seed and a level of detail.
        walls: Wall colours to draw from.
        roofs: Roof colours to draw from.
        accents: Colours of doors, signs and blinds to draw from.
        variants: How many shells are told apart.
    """

    build: Callable[[int, int], Shell]
    walls: tuple[Colour, ...]
    roofs: tuple[Colour, ...]
    accents: tuple[Colour, ...]
    variants: int = 5


def rectangle(depth: float, width: float) -> Floats:
    """Plan of a building with its front at +x, counter-clockwise, (4, 2) [m]."""
    x, y = depth / 2, width / 2
    return np.array([[x, -y], [x, y], [-x, y], [-x, -y]])


def home(seed: int, level: int, facade: Facade | None = None) -> Shell:
    """A two-storey family house under a gabled roof; about 10 x 9 m."""
    rng = np.random.default_rng(seed)
    width, depth = rng.uniform(9.0, 11.5), rng.uniform(8.2, 9.6)
    eaves, pitch = rng.uniform(5.0, 5.8), rng.uniform(0.66, 0.9)
    facade = facade or Facade(bay=2.7, width=1.1, height=1.3, sill=0.95, inset=0.14)
    plan, floors = rectangle(depth, width), np.array([0.3, 0.3 + eaves / 2, eaves + 0.1])
    parts: list[Shell] = [_plinth(plan, 0.3)]
    for i in range(4):
        parts.append(_home_wall(plan[i], plan[(i + 1) % 4], floors, facade, (level, i == 0, rng)))
    along_front = bool(rng.random() < 0.65)
    parts.append(
        gable_roof(plan, floors[-1], pitch=pitch, ridge_along_first=along_front, level=level)
    )
    if level != FAR:
        ridge = floors[-1] + np.tan(pitch) * (depth if along_front else width) / 2
        x, y = (0.5, width * 0.28) if along_front else (-depth * 0.2, 0.6)
        chimney = box((x - 0.3, y - 0.3, floors[-1]), (x + 0.3, y + 0.3, ridge + 0.7))
        parts.append({"chimney": chimney})
    return joined(parts)


def _home_wall(
    a: Floats, b: Floats, floors: Floats, facade: Facade, how: tuple[int, bool, np.random.Generator]
) -> Shell:
    """A wall of a house; the front has a door, a step and a canopy."""
    level, front, rng = how
    length = float(np.linalg.norm(b - a))
    if level == FAR or not front:
        return stood_up(wall(length, floors, facade, level=level, rng=rng), a, b)
    openings = facade.openings(length, floors[0])
    door = openings[len(openings) // 2].copy()
    door[2:] = floors[0], floors[0] + 2.15
    others = np.delete(openings, len(openings) // 2, axis=0)
    row = np.concatenate([others, door[None]])
    parts: list[Shell] = [
        {"wall": storey(length, floors[0], floors[1], row[np.argsort(row[:, 0])])},
        windows(others, facade, level=level, rng=rng),
        wall(length, floors[1:], facade, level=level, rng=rng),
        _door(door, level),
    ]
    return stood_up(joined(parts), a, b)


def _door(opening: Floats, level: int) -> Shell:
    """A door leaf set back, a step and a canopy, in wall coordinates."""
    u0, u1, z0, z1 = opening
    leaf = {"door": rectangles(u0, u1, z0, z1, inward=0.1 if level == NEAR else 0.0)}
    if level != NEAR:
        return leaf
    sides = rectangles([u0, u1], [u0, u1], z0, z1)
    sides[:, 1:3, 1] = 0.1
    sides[1] = sides[1, ::-1]
    step = box((u0 - 0.3, -1.1, FOUNDATION), (u1 + 0.3, 0.0, z0), skip="bY")
    canopy = box((u0 - 0.4, -1.0, z1 + 0.25), (u1 + 0.4, 0.0, z1 + 0.37), skip="Y")
    return {**leaf, "reveal": sides, "plinth": step, "trim": canopy}


def shop(seed: int, level: int) -> Shell:
    """A single-storey shop with a glazed front and a sign band; 12-16 x 12 m."""
    rng = np.random.default_rng(seed)
    width, depth, height = rng.uniform(12.0, 16.0), rng.uniform(11.0, 13.0), rng.uniform(4.4, 5.2)
    plan, floors = rectangle(depth, width), np.array([0.0, height])
    side = Facade(bay=4.2, width=1.6, height=0.9, sill=2.2, blinds=0.0)
    parts: list[Shell] = [_plinth(plan, 0.0), flat_roof(plan, height, parapet=0.7, level=level)]
    for i in range(1, 4):
        a, b = plan[i], plan[(i + 1) % 4]
        made = wall(float(np.linalg.norm(b - a)), floors, side, level=level, rng=rng)
        parts.append(stood_up(made, a, b))
    parts.append(stood_up(_shop_front(width, height, level, rng), plan[0], plan[1]))
    if level != FAR:
        x, y = -depth * 0.2, width * rng.uniform(-0.3, 0.3)
        low, high = (x - 1.2, y - 0.9, height), (x + 1.2, y + 0.9, height + 1.3)
        parts.append({"metal": box(low, high)})
    return joined(parts)


def _shop_front(width: float, height: float, level: int, rng: np.random.Generator) -> Shell:
    """Glazing between piers, the sign band above it and an awning."""
    count = max(int(width / 2.6), 3)
    edges = np.linspace(0.5, width - 0.5, count + 1)
    openings = np.stack([edges[:-1] + 0.12, edges[1:] - 0.12], axis=1)
    low, high = np.full(count, 0.35), np.full(count, height - 1.5)
    low[count // 2] = 0.05
    openings = np.column_stack([openings, low, high])
    glazing = Facade(inset=0.22, blinds=0.0, divided=False)
    sign = box((0.4, -0.14, height - 1.25), (width - 0.4, 0.0, height - 0.3), skip="Y")
    band = {"sign": sign if level != FAR else sign[[1]]}
    front: Shell = {"wall": storey(width, 0.0, height, openings)}
    if level == FAR:
        u0, u1 = openings[0, 0], openings[-1, 1]
        one = np.array([[u0, u1, 0.35, height - 1.5]])
        return joined(
            [
                {"wall": storey(width, 0.0, height, one)},
                band,
                {"band": rectangles(u0, u1, 0.35, height - 1.5)},
            ]
        )
    shade = rectangles(0.4, width - 0.4, height - 1.75, height - 1.35)
    shade[:, :2, 1], shade[:, 2:, 1] = -1.3, -0.14
    panes = windows(openings, glazing, level=level, rng=rng)
    letters = _letters(width, height, rng) if level == NEAR else {}
    return joined([front, panes, band, {"awning": shade}, letters])


def _letters(width: float, height: float, rng: np.random.Generator) -> Shell:
    """Pale blocks on the sign band that read as a name from the road."""
    count = int(rng.integers(5, 10))
    u0 = width / 2 + (np.arange(count) - count / 2) * 0.5
    tall, wide = rng.choice([0.34, 0.5], count), rng.uniform(0.24, 0.38, count)
    z0 = np.full(count, height - 1.0)
    return {"letter": rectangles(u0, u0 + wide, z0, z0 + tall, inward=-0.15)}


def block(seed: int, level: int, facade: Facade | None = None) -> Shell:
    """An apartment block of five to nine storeys; about 16 x 14 m."""
    rng = np.random.default_rng(seed)
    width, depth = rng.uniform(15.0, 18.0), rng.uniform(12.5, 14.5)
    storeys, tall = int(rng.integers(5, 10)), rng.uniform(2.85, 3.1)
    facade = facade or Facade(bay=rng.uniform(3.0, 3.5), width=1.35, height=1.55)
    plan = rectangle(depth, width)
    ground = 3.6
    floors: Floats = ground + tall * np.arange(float(storeys))
    low = replace(facade, sill=1.0, height=1.9, width=1.7, blinds=0.1)
    parts: list[Shell] = [_plinth(plan, 0.0)]
    for i in range(4):
        a, b = plan[i], plan[(i + 1) % 4]
        length = float(np.linalg.norm(b - a))
        base = wall(length, np.array([0.0, ground]), low, level=level, rng=rng)
        base["base"] = base.pop("wall")
        upper = wall(length, floors, facade, level=level, rng=rng)
        extras = [] if i % 2 else [_balconies(length, floors, facade, (level, rng))]
        parts.append(stood_up(joined([base, upper, *extras]), a, b))
    parts.append(flat_roof(plan, floors[-1], parapet=0.9, level=level))
    parts.append(_cornice(plan, ground, level))
    if level != FAR:
        top = floors[-1]
        parts.append({"wall": box((-2.2, -1.8, top), (1.8, 2.2, top + 2.4))})
        parts.append({"metal": box((2.6, 2.5, top), (4.0, 3.7, top + 1.1))})
    return joined(parts)


def _balconies(
    length: float, floors: Floats, facade: Facade, how: tuple[int, np.random.Generator]
) -> Shell:
    """Slabs and parapets in front of every third bay, from the second storey up."""
    level, rng = how
    openings = facade.openings(length, 0.0)
    if level == FAR or not len(openings) or rng.random() < 0.25:
        return {}
    solid = bool(rng.random() < 0.5)
    parts: list[Shell] = []
    for u0, u1, *_ in openings[int(rng.integers(0, 2)) :: 3]:
        for z in floors[1:-1]:
            parts.append(
                {"trim": box((u0 - 0.55, -1.15, z - 0.08), (u1 + 0.55, 0, z + 0.1), skip="Y")}
            )
            rail = "blind" if solid else "rail"
            z0 = z + (0.1 if solid else 0.95)
            parts.append(
                {
                    rail: box(
                        (u0 - 0.55, -1.15, z0),
                        (u1 + 0.55, 0, z + 1.02),
                        skip="Ybt" if solid else "Y",
                    )
                }
            )
            if not solid and level == NEAR:
                parts.append({"rail": _bars(u0 - 0.53, u1 + 0.53, z)})
    return joined(parts)


def _bars(u0: float, u1: float, z: float) -> Floats:
    """Flat upright bars of a balcony's front, (n, 4, 3)."""
    u = np.linspace(u0, u1, 9)
    return rectangles(u - 0.02, u + 0.02, z + 0.1, z + 0.95, inward=-1.13)


def _cornice(plan: Floats, height: float, level: int) -> Shell:
    """A ledge above the ground floor."""
    if level != NEAR:
        return {}
    (x, y), (x1, y1) = plan.min(axis=0), plan.max(axis=0)
    low, high = (x - 0.12, y - 0.12, height - 0.12), (x1 + 0.12, y1 + 0.12, height + 0.12)
    return {"trim": box(low, high, skip="")}


def _plinth(plan: Floats, height: float) -> Shell:
    """Foundation walls below the first storey."""
    after = np.roll(plan, -1, axis=0)
    low, high = np.full((len(plan), 1), FOUNDATION), np.full((len(plan), 1), height)
    corners = [(plan, low), (after, low), (after, high), (plan, high)]
    return {"plinth": np.stack([np.hstack(corner) for corner in corners], axis=1)}


def palette(style: Style, rng: np.random.Generator, wall_colour: Colour | None = None) -> Palette:
    """Colours of one building of a style; all roles that a shell may have."""

    def drawn(colours: tuple[Colour, ...], spread: float = 0.08) -> Colour:
        base = np.array(colours[int(rng.integers(len(colours)))])
        r, g, b = np.clip(base * rng.uniform(1 - spread, 1 + spread), 0.01, 0.8)
        return float(r), float(g), float(b)

    main, roof, accent = drawn(style.walls), drawn(style.roofs), drawn(style.accents)
    main = wall_colour or main
    pale: Colour = (0.55, 0.54, 0.51)

    def mixed(share: float, other: Colour) -> Colour:
        r, g, b = (share * m + (1 - share) * o for m, o in zip(main, other, strict=True))
        return r, g, b

    base = mixed(0.45, (0.3, 0.29, 0.27))
    return {
        "wall": ("wall", main),
        "base": ("wall", base),
        "plinth": ("wall", (0.26, 0.25, 0.24)),
        "reveal": ("wall", mixed(0.9, pale)),
        "trim": ("wall", mixed(0.3, pale)),
        "chimney": ("wall", (0.3, 0.14, 0.1)),
        "roof": ("roof", roof),
        "deck": ("roof", (0.2,) * 3),
        "band": ("sign", mixed(0.3, (0.03, 0.035, 0.04))),
        "window": ("window", None),
        "frame": ("frame", None),
        "sill": ("frame", None),
        "metal": ("metal_sheet", None),
        "rail": ("signal_housing", None),
        "blind": ("wall", mixed(0.2, (0.5, 0.48, 0.44))),
        "door": ("sign", accent),
        "sign": ("sign", accent),
        "awning": ("sign", accent),
        "letter": ("sign", (0.72, 0.72, 0.7)),
    }


_BRICK: tuple[Colour, ...] = ((0.30, 0.13, 0.085), (0.36, 0.18, 0.12), (0.27, 0.17, 0.12))
_PLASTER: tuple[Colour, ...] = (
    (0.62, 0.6, 0.55),
    (0.66, 0.65, 0.62),
    (0.58, 0.47, 0.28),
    (0.56, 0.52, 0.44),
    (0.55, 0.4, 0.3),
    (0.48, 0.52, 0.5),
)
_TILES: tuple[Colour, ...] = (
    (0.3, 0.1, 0.055),
    (0.24, 0.085, 0.05),
    (0.07, 0.072, 0.078),
    (0.13, 0.085, 0.065),
)
_DECK: tuple[Colour, ...] = ((0.22, 0.215, 0.21), (0.16, 0.16, 0.165))
_DOORS: tuple[Colour, ...] = (
    (0.06, 0.09, 0.07),
    (0.16, 0.075, 0.035),
    (0.1, 0.02, 0.02),
    (0.04, 0.06, 0.11),
    (0.5, 0.5, 0.48),
)
_SIGNS: tuple[Colour, ...] = (
    (0.42, 0.03, 0.03),
    (0.03, 0.12, 0.34),
    (0.03, 0.24, 0.09),
    (0.55, 0.32, 0.03),
    (0.05, 0.05, 0.055),
    (0.3, 0.04, 0.16),
)

HOMES: Mapping[str, Style] = {
    "plaster": Style(home, _PLASTER[:4], _TILES, _DOORS),
    "brick": Style(home, _BRICK, _TILES[2:], _DOORS),
}
"""Family houses by model."""

SHOPS: Mapping[str, Style] = {"pavilion": Style(shop, (*_PLASTER, _BRICK[1]), _DECK, _SIGNS)}
"""Shops by model."""

BLOCKS: Mapping[str, Style] = {
    "plaster": Style(block, _PLASTER, _DECK, _DOORS, variants=8),
    "brick": Style(block, _BRICK, _DECK, _DOORS, variants=5),
}
"""Apartment blocks by model."""
