"""Exchanges the foliage that cameras come near to for leaves as small as real ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.plants.leaves import OUTLINE, cards_of, triangles, wanted, with_leaves
from sumo3dviz_pt.model.camera_path import in_picture
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.world.placement.surroundings import Surroundings

REACH = 55.0
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
    found = list(parts)
    if not near:
        return found
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
            found[k] = replace(parts[k], mesh=mesh, tint=tint)
    return found


def _tint(part: Part) -> Floats:
    """Colours of a part's faces."""
    assert part.tint is not None
    return part.tint


def _comes_near(part: Part, eyes: cKDTree) -> bool:
    """Whether a camera is within reach of a part."""
    low, high = part.mesh.bounds
    radius = 0.5 * float(np.linalg.norm(high - low))
    return bool(eyes.query(0.5 * (low + high))[0] < REACH + radius)


def _shown(places: Floats, away: Floats, around: Surroundings) -> Bools:
    """Which places, (n, 3) [m], lie near enough and in some picture."""
    shown = away < REACH
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
    return REACH if over >= len(order) else float(away[order[over]])
