"""Family houses, shops, apartment blocks and buildings over any footprint.

Body frame: origin on the ground in the middle of the footprint, the front looks to +x.
Walls reach 1 m below the ground, so that nothing floats on a slope.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.shapes.facade import FAR, NEAR, Facade, storey, wall, windows
from sumo3dviz_pt.shapes.roofs import flat_roof, gable_roof, upright
from sumo3dviz_pt.shapes.shell import Shell, box, joined, rectangles, stood_up

FOUNDATION = -1.0
"""How deep walls reach [m]."""


def rectangle(depth: float, width: float) -> Floats:
    """Plan of a building with its front at +x, counter-clockwise, (4, 2) [m]."""
    x, y = depth / 2, width / 2
    return np.array([[x, -y], [x, y], [-x, y], [-x, -y]])


def home(seed: int, level: int, facade: Facade | None = None) -> Shell:
    """A two-storey family house under a gabled roof; about 10 x 9 m."""
    rng = np.random.default_rng(seed)
    width, depth = rng.uniform(9.0, 11.5), rng.uniform(8.2, 9.6)
    eaves, pitch = rng.uniform(5.0, 5.8), rng.uniform(0.66, 0.9)
    # Shapes are drawn before windows are, so that all levels of detail agree.
    along_front = bool(rng.random() < 0.65)
    facade = facade or Facade(bay=2.7, width=1.1, height=1.3, sill=0.95, inset=0.14)
    plan, floors = rectangle(depth, width), np.array([0.3, 0.3 + eaves / 2, eaves + 0.1])
    parts: list[Shell] = [{"plinth": upright(plan, FOUNDATION, 0.3)}]
    for i in range(4):
        parts.append(_home_wall(plan[i], plan[(i + 1) % 4], floors, facade, (level, i == 0, rng)))
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
    x, y = -depth * 0.2, width * rng.uniform(-0.3, 0.3)
    plan, floors = rectangle(depth, width), np.array([0.0, height])
    side = Facade(bay=4.2, width=1.6, height=0.9, sill=2.2, blinds=0.0)
    parts: list[Shell] = [
        {"plinth": upright(plan, FOUNDATION, 0.0)},
        flat_roof(plan, height, parapet=0.7, level=level),
    ]
    for i in range(1, 4):
        a, b = plan[i], plan[(i + 1) % 4]
        made = wall(float(np.linalg.norm(b - a)), floors, side, level=level, rng=rng)
        parts.append(stood_up(made, a, b))
    parts.append(stood_up(_shop_front(width, height, level, rng), plan[0], plan[1]))
    if level != FAR:
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
    parts: list[Shell] = [{"plinth": upright(plan, FOUNDATION, 0.0)}]
    for i in range(4):
        a, b = plan[i], plan[(i + 1) % 4]
        length = float(np.linalg.norm(b - a))
        base = wall(length, np.array([0.0, ground]), low, level=level, rng=rng)
        base["base"] = base.pop("wall")
        upper = wall(length, floors, facade, level=level, rng=rng)
        extras = [] if i % 2 else [_balconies(length, floors, facade, (level, seed + i))]
        parts.append(stood_up(joined([base, upper, *extras]), a, b))
    parts.append(flat_roof(plan, floors[-1], parapet=0.9, level=level))
    parts.append(_cornice(plan, ground, level))
    if level != FAR:
        top = floors[-1]
        parts.append({"wall": box((-2.2, -1.8, top), (1.8, 2.2, top + 2.4))})
        parts.append({"metal": box((2.6, 2.5, top), (4.0, 3.7, top + 1.1))})
    return joined(parts)


def _balconies(length: float, floors: Floats, facade: Facade, how: tuple[int, int]) -> Shell:
    """Slabs and parapets in front of every third bay, from the second storey up."""
    level, seed = how
    rng = np.random.default_rng([seed, 1])
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
