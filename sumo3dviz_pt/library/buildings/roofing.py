"""The roof of a building as its design says: slopes or a deck, and what stands on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.library.buildings.design import Building
from sumo3dviz_pt.library.buildings.facade import FAR, PROUD, windows
from sumo3dviz_pt.library.buildings.roofs import (
    LEAN,
    flat_roof,
    gable_roof,
    hip_roof,
    inset,
    is_convex,
    mansard_roof,
    rain_pipes,
)
from sumo3dviz_pt.library.buildings.shell import Shell, joined, stood_up
from sumo3dviz_pt.library.buildings.tops import RoofSlope, chimneys, dormers, machines
from sumo3dviz_pt.model.geometry import Floats, settled

_RISE = 2.7  # of mansard slopes [m]


def roof_of(building: Building) -> Shell:
    """Build the roof and what stands on it."""
    plan, design, height, level = building.plan, building.design, building.height, building.level
    if design.roof == "hip" and is_convex(plan):
        parts = [hip_roof(plan, height, pitch=design.pitch, level=level)]
        return joined([*parts, rain_pipes(plan, height, level)])
    if design.roof in ("gable", "hip"):
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
    parts = [gable_roof(plan, height, pitch=design.pitch, along=long, level=level)]
    parts.append(rain_pipes(plan, height, level))
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
