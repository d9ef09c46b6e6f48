"""Makes houses small enough to stand beside roads and each other, not in them."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.world.placement.lane_index import LaneIndex

_LOG = logging.getLogger(__name__)

_STEP, _SMALLEST, _ROUNDS = 0.93, 0.5, 10
_APART = 0.3  # gap that is kept to roads and other houses [m]


def fitted(
    places: Floats, yaws: Floats, plans: Floats, sizes: Floats, *, index: LaneIndex
) -> Floats:
    """Shrink houses that reach over a carriageway or into another house.

    Args:
        places: Middle of each plan, (n, 2) [m].
        yaws: Where fronts look, (n,) [rad].
        plans: Lowest and highest corner of each plan, (n, 2, 2) [m], in its own frame.
        sizes: Wanted scale factors, (n,).
        index: The network's lanes.

    Returns:
        Scale factors, (n,), at least half of the wanted ones.
    """
    found = np.array(sizes, dtype=np.float64)
    for _ in range(_ROUNDS):
        tight = _in_the_way(rectangles(places, yaws, plans * found[:, None, None]), index)
        tight &= found > _SMALLEST * sizes
        if not tight.any():
            break
        found[tight] = np.maximum(found[tight] * _STEP, _SMALLEST * sizes[tight])
    shrunk = int((found < sizes).sum())
    if shrunk:
        _LOG.info("%d buildings are drawn smaller, so that they do not overlap", shrunk)
    return found


def rectangles(places: Floats, yaws: Floats, plans: Floats) -> Sequence[shapely.Polygon]:
    """Return plans in the world, (n,) polygons.

    Args:
        places: Middle of each, (n, 2) [m].
        yaws: Where fronts look, (n,) [rad].
        plans: Lowest and highest corner of each in its own frame, (n, 2, 2) [m].
    """
    (x0, y0), (x1, y1) = plans[:, 0].T, plans[:, 1].T
    corners = np.stack([np.stack([x, y], -1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
    cos, sin = np.cos(yaws), np.sin(yaws)
    x = places[:, 0] + corners[..., 0] * cos - corners[..., 1] * sin
    y = places[:, 1] + corners[..., 0] * sin + corners[..., 1] * cos
    polygons: Sequence[shapely.Polygon] = shapely.polygons(
        np.stack([x, y], axis=-1).transpose(1, 0, 2)
    )
    return polygons


def _in_the_way(plans: Sequence[shapely.Polygon], index: LaneIndex) -> Bools:
    """Which plans come too near to a carriageway or another plan, (n,)."""
    tight = np.zeros(len(plans), dtype=np.bool_)
    if len(index.areas.geometries):
        tight[index.areas.query(plans, predicate="dwithin", distance=_APART)[0]] = True
    one, other = shapely.STRtree(plans).query(plans, predicate="dwithin", distance=_APART)
    tight[one[one != other]] = True
    return tight
