"""Roofs over any plan, what stands on them, and bands that run around buildings.

Roofs are flat with a parapet, gabled, hipped or mansard roofs. Lift houses, machines, chimneys and
dormers stand on them.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.library.buildings.facade import FAR, NEAR, PROUD, Facade, windows
from sumo3dviz_pt.library.buildings.shell import Shell, box, joined, rectangles, stood_up
from sumo3dviz_pt.library.mesh.planar import triangulate
from sumo3dviz_pt.model.geometry import Floats, settled, unit

EAVES = 0.4
"""How far roofs reach over walls [m]."""

LEAN = 0.45
"""How far mansard slopes lean in, by their rise."""

_SLAB = np.array([0.0, 0.0, 0.16])  # thickness of a roof [m]


def flat_roof(plan: Floats, height: float, *, parapet: float, level: int) -> Shell:
    """Build a deck behind a parapet.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m]; convex or not.
        height: Of the deck and the walls below [m].
        parapet: Height above the deck [m].
        level: Level of detail; from afar only the parapet's outside is kept.
    """
    top = height + parapet
    inner = inset(plan, 0.3) if level != FAR else None
    if inner is None:
        return {"deck": cap(plan, top), "wall": upright(plan, height, top)}
    return {
        "deck": cap(inner, height),
        "wall": upright(plan, height, top),
        "base": upright(inner, height, top)[:, ::-1],
        "coping": _ring(plan, inner, top, top),
    }


def mansard_roof(
    plan: Floats, height: float, *, rise: float, level: int, blind: Collection[int] = ()
) -> Shell:
    """Build steep slopes all around and a deck on top; a flat roof where there is no room.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls [m].
        rise: Of the slopes [m].
        level: Level of detail.
        blind: Numbers of walls to neighbours, which go straight up.
    """
    steep = np.array([i in blind for i in range(len(plan))])
    inner = inset(plan, np.where(steep, 0.0, LEAN * rise))
    if inner is None:
        return flat_roof(plan, height, parapet=0.6, level=level)
    sides = _ring(plan, inner, height, height + rise)
    shell = {"roof": sides[~steep], "wall": sides[steep]}
    return {**shell, "deck": cap(inner, height + rise)}


@dataclass(frozen=True, slots=True, eq=False)
class GableRidge:
    """Where the ridge of a roof of two slopes runs.

    Attributes:
        along: Its direction, (2,).
        aside: Whether it lies over the wall on its left, so that there is one slope only.
    """

    along: Floats
    aside: bool = False


def gable_roof(
    plan: Floats, height: float, *, pitch: float, ridge: GableRidge, level: int
) -> Shell:
    """Build two slopes, or one, with overhanging eaves, and the walls up to them.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m]; convex or not.
        height: Of the eaves [m].
        pitch: Of the slopes [rad].
        ridge: Where the slopes meet.
        level: Level of detail.
    """
    along = ridge.along / np.linalg.norm(ridge.along)
    across = np.array([-along[1], along[0]])
    reach = plan @ across
    middle, half = float(reach.max() + reach.min()) / 2, float(np.ptp(reach)) / 2
    if ridge.aside:
        middle, half = middle + half, 2 * half
    slope = float(np.tan(pitch))

    def lifted(points: Floats) -> Floats:
        """Lift points of the plan, (..., 2), to the roof's underside."""
        z = height + slope * (half - np.abs(points @ across - middle))
        return np.concatenate([points, z[..., None]], axis=-1)

    wide = shapely.orient_polygons(Polygon(plan).buffer(EAVES, join_style="mitre", mitre_limit=1.5))
    wide = shapely.transform(wide, settled)
    quads = []
    for side in (1.0, -1.0):
        for corners in _half(wide, (across * side, middle * side)):
            quads.append(lifted(corners))
    under = np.concatenate(quads)
    ring = split_at(shapely.get_coordinates(wide.exterior)[:-1], across, middle)
    gables = _walls_up(lifted(split_at(plan, across, middle)), height)
    return joined([{"wall": gables}, _slab(under, lifted(ring), level)])


def hip_roof(plan: Floats, height: float, *, pitch: float, level: int) -> Shell:
    """Build one slope per wall of a convex plan, with overhanging eaves.

    Args:
        plan: Counter-clockwise corners, convex, (n, 2) [m].
        height: Of the walls [m].
        pitch: Of the slopes [rad].
        level: Level of detail.
    """
    wide = shapely.orient_polygons(Polygon(plan).buffer(EAVES, join_style="mitre"))
    ring = shapely.get_coordinates(wide.exterior)[:-1]
    inward = _inward(ring)
    slope = float(np.tan(pitch))
    low = height - EAVES * slope
    quads = []
    for i in range(len(ring)):
        facet = ring
        for j in range(len(ring)):
            if j != i and len(facet) > 2:
                # Keep what lies nearer to wall i than to wall j.
                normal = inward[j] - inward[i]
                offset = float((inward[j] * ring[j] - inward[i] * ring[i]).sum())
                facet = _clipped(facet, normal, offset)
        if len(facet) > 2:
            rise = slope * ((facet - ring[i]) @ inward[i])
            quads.append(_fan(np.column_stack([facet, low + rise])))
    edge = np.column_stack([ring, np.full(len(ring), low)])
    return _slab(np.concatenate(quads), edge, level)


def is_convex(plan: Floats) -> bool:
    """Tell whether no corner of a counter-clockwise plan, (n, 2), turns right."""
    before, after = plan - np.roll(plan, 1, axis=0), np.roll(plan, -1, axis=0) - plan
    return bool((before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] > -1e-9).all())


def inset(plan: Floats, distance: float | Floats) -> Floats | None:
    """Move every wall of a plan inwards, (n, 2); None where that cannot be.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        distance: For all walls or each one, (n,) [m].
    """
    inward = _inward(plan)
    before = np.roll(inward, 1, axis=0)
    turn = 1.0 + (before * inward).sum(axis=1)
    if (turn < 0.3).any():  # a needle's point would run far
        return None
    after_it = np.broadcast_to(np.asarray(distance, dtype=np.float64), (len(plan),))
    before_it = np.roll(after_it, 1)
    mean = 0.5 * (before_it + after_it)
    moved = plan + mean[:, None] * (before + inward) / turn[:, None]
    # Unequal distances shift a corner along the bisector's normal, but not on straight walls.
    bent = np.maximum(2.0 - turn, 1e-9)
    aside = np.where(2.0 - turn > 0.02, 0.5 * (after_it - before_it) / bent, 0.0)
    moved += aside[:, None] * (inward - before)
    old, new = (np.roll(ring, -1, axis=0) - ring for ring in (plan, moved))
    alike = ((old * new).sum(axis=1) > 0.04 * (old * old).sum(axis=1)).all()
    return moved if alike and Polygon(moved).is_valid else None


def upright(plan: Floats, low: float, high: float) -> Floats:
    """Build upright faces along a closed plan.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        low: Where they begin [m].
        high: Where they end [m].

    Returns:
        Quads that look outwards, (n, 4, 3) [m].
    """
    after = np.roll(plan, -1, axis=0)
    return np.stack([_at(plan, low), _at(after, low), _at(after, high), _at(plan, high)], axis=1)


def cap(plan: Floats, height: float) -> Floats:
    """Cover a plan with triangles, quads whose last corners coincide, (n, 4, 3)."""
    if len(plan) == 4 and is_convex(plan):
        return _at(plan, height)[None]
    flat = _fill(Polygon(plan))
    return np.concatenate([flat, np.full((*flat.shape[:2], 1), height)], axis=-1)


def split_at(ring: Floats, across: Floats, middle: float) -> Floats:
    """Add corners to a ring where it crosses a line.

    Args:
        ring: (n, 2) [m].
        across: Unit normal of the line, (2,).
        middle: Distance of the line from the origin [m]: its points p have `across @ p = middle`.

    Returns:
        (m, 2) [m], m >= n.
    """
    points = []
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        points.append(a)
        one, other = (float(settled((p * across).sum() - middle)) for p in (a, b))
        if one * other < -1e-9:
            points.append(a + (b - a) * one / (one - other))
    return np.array(points)


def rain_pipes(plan: Floats, height: float, level: int) -> Shell:
    """Build a pipe down each end of the longest wall.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls [m].
        level: Of detail; there are pipes nearby only.
    """
    if level != NEAR:
        return {}
    after = np.roll(plan, -1, axis=0)
    i = int(np.argmax(settled(np.linalg.norm(after - plan, axis=1))))
    (ax, ay), (bx, by) = plan[i], after[i]
    pipes = [
        box((x - 0.05, y - 0.05, 0.0), (x + 0.05, y + 0.05, height))
        for x, y in ((ax, ay), (bx, by))
    ]
    return {"pipe": np.concatenate(pipes)}


def _slab(under: Floats, ring: Floats, level: int) -> Shell:
    """Build a roof of some thickness from its underside, (n, 4, 3), and its edge, (k, 3)."""
    if level == FAR:
        return {"roof": under + _SLAB}
    after = np.roll(ring, -1, axis=0)
    edge = np.stack([ring, after, after + _SLAB, ring + _SLAB], axis=1)
    return {"roof": under + _SLAB, "eaves": np.concatenate([under[:, ::-1], edge])}


def _walls_up(ring: Floats, height: float) -> Floats:
    """Build upright faces from a height up to a ring, (k, 3), outside out."""
    after = np.roll(ring, -1, axis=0)
    low = [
        np.column_stack([points[:, :2], np.full(len(points), height)]) for points in (ring, after)
    ]
    quads = np.stack([low[0], low[1], after, ring], axis=1)
    return quads[(ring[:, 2] > height + 1e-6) | (after[:, 2] > height + 1e-6)]


def _half(area: Polygon, line: tuple[Floats, float]) -> list[Floats]:
    """Cover the part of an area beyond `across @ p = middle` with triangles, each (n, 4, 2)."""
    across, middle = line
    along = np.array([across[1], -across[0]])
    far = 1.0 + float(np.abs(shapely.get_coordinates(area)).max()) * 3
    start = across * middle
    half = Polygon(
        [
            start - far * along,
            start + far * along,
            start + far * along + far * across,
            start - far * along + far * across,
        ]
    )
    # Where rings begin is the overlay's choice, which hangs on last bits.
    cut = shapely.transform(shapely.intersection(area, half), settled)
    pieces = shapely.get_parts(shapely.normalize(cut)).tolist()
    return [_fill(piece) for piece in pieces if piece.geom_type == "Polygon" and piece.area > 1e-4]


def _fill(area: Polygon) -> Floats:
    """Cover an area with counter-clockwise triangles as quads, (n, 4, 2)."""
    corners, faces = triangulate(area)
    return corners[faces[:, [0, 1, 2, 2]]]


def _fan(corners: Floats) -> Floats:
    """Cover a convex facet, (n, 3), with quads, (m, 4, 3)."""
    quads = [
        corners[[0, i, i + 1, min(i + 2, len(corners) - 1)]] for i in range(1, len(corners) - 1, 2)
    ]
    return np.array(quads)


def _clipped(ring: Floats, normal: Floats, offset: float) -> Floats:
    """Keep the part of a convex ring, (n, 2), where `normal @ p >= offset` (Sutherland-Hodgman)."""
    side = settled((ring * normal).sum(axis=1) - offset)
    points = []
    for k in range(len(ring)):
        a, b, one, other = ring[k - 1], ring[k], side[k - 1], side[k]
        if one * other < 0:
            points.append(a + (b - a) * one / (one - other))
        if other >= 0:
            points.append(b)
    return np.array(points).reshape(-1, 2)


def _inward(ring: Floats) -> Floats:
    """Unit normals of the walls of a counter-clockwise ring, inwards, (n, 2)."""
    along = unit(np.roll(ring, -1, axis=0) - ring)
    return np.column_stack([-along[:, 1], along[:, 0]])


def _ring(outer: Floats, inner: Floats, low: float, high: float) -> Floats:
    """Build faces from an outer ring at one height to an inner one at another, (n, 4, 3)."""
    (a, b), (c, d) = ((ring, np.roll(ring, -1, axis=0)) for ring in (outer, inner))
    return np.stack([_at(a, low), _at(b, low), _at(d, high), _at(c, high)], axis=1)


def _at(plan: Floats, height: float) -> Floats:
    """Lift points of a plan to a height, (n, 3)."""
    return np.column_stack([plan, np.full(len(plan), height)])


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


def band(plan: Floats, heights: tuple[float, float], out: Floats, role: str) -> Shell:
    """Build a band around a building: face, top and underside.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        heights: Where it begins and ends [m].
        out: How far it reaches out of each wall, (n,) [m].
        role: What it is made of.
    """
    outer = inset(plan, -out)
    if outer is None:
        return {}
    low, high = heights
    after, around = np.roll(plan, -1, axis=0), np.roll(outer, -1, axis=0)

    def level(points: Floats, z: float) -> Floats:
        """Lift points of the plan to a height."""
        return np.column_stack([points, np.full(len(points), z)])

    top = np.stack([level(p, high) for p in (outer, around, after, plan)], axis=1)
    under = np.stack([level(p, low) for p in (around, outer, plan, after)], axis=1)
    upright_faces = upright(outer, low, high)
    # Along a wall that it does not reach out of, only its ends beyond the wall show.
    flush = np.asarray(out) == 0.0
    before, behind = _between(outer, plan, low, high), _between(after, around, low, high)
    ends = np.concatenate([before[flush], behind[flush]])
    faces = [upright_faces[~flush], ends, top]
    return {role: np.concatenate(faces if low < 0 else [*faces, under])}


def _between(begins: Floats, ends: Floats, low: float, high: float) -> Floats:
    """Build an upright face from each of some points to each of others, (n, 4, 3)."""
    corners = ((begins, low), (ends, low), (ends, high), (begins, high))
    return np.stack([np.column_stack([p, np.full(len(p), z)]) for p, z in corners], axis=1)


def outward(plan: Floats) -> Floats:
    """Unit normals of the walls of a plan, outwards, (n, 2)."""
    along = unit(np.roll(plan, -1, axis=0) - plan)
    return np.column_stack([along[:, 1], -along[:, 0]])
