"""What stands on roofs: lift houses, machines, chimneys, dormers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.library.buildings.facade import FAR, NEAR, PROUD, Facade, windows
from sumo3dviz_pt.library.buildings.shell import Shell, box, joined, rectangles, stood_up
from sumo3dviz_pt.model.geometry import Floats


def machines(plan: Floats, height: float, *, lift: bool, level: int, seed: int) -> Shell:
    """Build a lift house and machines on a flat roof.

    Args:
        plan: Counter-clockwise corners of the deck, (n, 2) [m].
        height: Of the deck [m].
        lift: Whether there is a lift house.
        level: Of detail.
        seed: Of all chance.
    """
    rng = np.random.default_rng([seed, 23])
    room = Polygon(plan).buffer(-1.2)
    parts: list[Shell] = []
    if lift:
        place = _place(room, 2.4, rng)
        if place is not None:
            (x, y), tall = place, rng.uniform(2.3, 3.0)
            parts.append(
                {"wall": box((x - 2.1, y - 1.8, height), (x + 2.1, y + 1.8, height + tall))}
            )
            lid = box(
                (x - 2.25, y - 1.95, height + tall),
                (x + 2.25, y + 1.95, height + tall + 0.14),
                skip="",
            )
            parts.append({"coping": lid})
    for _ in range(int(rng.integers(2, 6)) if level != FAR else 0):
        place = _place(room, 1.0, rng)
        half = rng.uniform(0.35, 0.9, 2)
        tall = float(rng.uniform(0.6, 1.4))
        if place is None:
            continue
        low, high = place - half, place + half
        parts.append({"metal": box((*low, height + 0.12), (*high, height + tall), skip="")})
        if level == NEAR:
            u0, u1, y = low[0] + 0.1, high[0] - 0.1, float(low[1]) - 0.006
            grille = rectangles(u0, u1, height + 0.3, height + tall - 0.15, inward=y)
            parts.append({"rail": grille})
    return joined(parts)


def chimneys(spots: Floats, base: float, tops: Floats, *, level: int) -> Shell:
    """Build brick chimneys with a cap.

    Args:
        spots: (n, 2) [m].
        base: Where they begin, below the roof [m].
        tops: Their heights, (n,) [m].
        level: Level of detail.
    """
    parts: list[Shell] = []
    for (x, y), top in zip(spots.tolist(), tops.tolist(), strict=True):
        parts.append({"chimney": box((x - 0.32, y - 0.27, base), (x + 0.32, y + 0.27, top))})
        if level == NEAR:
            cap = box((x - 0.4, y - 0.35, top), (x + 0.4, y + 0.35, top + 0.09), skip="")
            pot = box((x - 0.12, y - 0.1, top + 0.09), (x + 0.12, y + 0.1, top + 0.34))
            parts.append({"coping": cap, "rail": pot})
    return joined(parts)


@dataclass(frozen=True, slots=True)
class RoofSlope:
    """A roof's slope above a wall, and where dormers stand in it.

    Attributes:
        base: Height where it begins [m].
        rise: By how much it rises per metre inwards.
        back: How far behind the wall the dormers' fronts stand [m].
    """

    base: float
    rise: float
    back: float


def dormers(
    start: Floats,
    end: Floats,
    *,
    slope: RoofSlope,
    facade: Facade,
    level: int,
    rng: np.random.Generator,
) -> Shell:
    """Build dormer windows in a slope above a wall.

    Args:
        start: Left end of the wall below, (2,) [m].
        end: Its right end.
        slope: Of the roof.
        facade: Says where windows are.
        level: Of detail.
        rng: Chooses rooms and blinds.
    """
    length = float(np.linalg.norm(end - start))
    openings = facade.openings(length, slope.base + slope.back * slope.rise)
    openings = openings[(openings[:, 0] > 1.6) & (openings[:, 1] < length - 1.6)]
    if not len(openings):
        return {}
    # From afar, a dark front in a light box: without it roofs would jump at the limit.
    dark = {"room0": rectangles(*openings.T, inward=-PROUD)}
    parts: list[Shell] = [dark if level == FAR else windows(openings, facade, level=level, rng=rng)]
    for u0, u1, z0, z1 in openings.tolist():
        a, b, low, top = u0 - 0.14, u1 + 0.14, z0 - 0.25, z1 + 0.16
        deep = (top - low) / slope.rise
        cheek = [(a, deep, top), (a, 0.0, low), (a, 0.0, top), (a, 0.0, top)]
        other = [(b, 0.0, low), (b, deep, top), (b, 0.0, top), (b, 0.0, top)]
        parts.append({"dormer": np.array([cheek, other], dtype=np.float64)})
        lid = box((a - 0.1, -0.15, top), (b + 0.1, deep, top + 0.1), skip="Y")
        parts.append({"coping": lid})
        around = [(a, b, low, z0), (a, b, z1, top), (a, u0, z0, z1), (u1, b, z0, z1)]
        if level != NEAR:
            around = [(a, b, low, top)]
        parts.append({"dormer": np.concatenate([rectangles(*edges) for edges in around])})
    across = (end - start) / length
    inward = np.array([-across[1], across[0]]) * slope.back
    return stood_up(joined(parts), start + inward, end + inward)


def _place(room: Polygon, radius: float, rng: np.random.Generator) -> Floats | None:
    """Find a spot in an area with some room around it, (2,) [m], or None."""
    free = room.buffer(-radius)
    if free.is_empty:
        return None
    low, high = np.array(free.bounds).reshape(2, 2)
    for _ in range(12):
        spot: Floats = rng.uniform(low, high)
        if shapely.contains_xy(free, spot[0], spot[1]):
            return spot
    return None
