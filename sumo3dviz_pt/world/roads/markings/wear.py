"""Paint near the camera: soft rims, and thin where wheels run over it.

How paint flakes and cracks between these points is the material's business.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.world.roads.cells import Polygons, quad_polygons
from sumo3dviz_pt.world.roads.graded import Graded, columns, graded_on, joined, whole_quads
from sumo3dviz_pt.world.roads.wear.noise import patchy
from sumo3dviz_pt.world.roads.wear.traffic import wheels_at

_RIM, _RIM_SHARE = 0.03, 0.30
"""Width of the worn rim of paint [m], and the share of paint at the very edge."""

_STEP, _LONG_STEP, _THIN = 0.45, 2.5, 0.3
"""Distance of rows and columns, of rows along lines, and what counts as a line [m]."""

_THINNED, _PATCHY = 0.42, 0.12
"""Share of paint that wheels have taken, and by how much that differs from place to place."""

_DIRT = 0.16
"""Brightness that paint has lost to rubber and dust at the most."""


@dataclass(frozen=True, slots=True, eq=False)
class Coats:
    """Quads of paint that have one age and colour each.

    Attributes:
        quads: Corners, their borders along the paint, (n, 4, 3) [m].
        polygons: What is left of each quad from above, (n,).
        fresh: Share of paint that age has left, (n,).
        yellow: 1 for yellow paint, (n,).
        loose: Whether no other quad begins or ends at its beginning and at its end, (n, 2).
    """

    quads: Floats
    polygons: Polygons
    fresh: Floats
    yellow: Floats
    loose: Bools

    def __getitem__(self, chosen: slice | Bools) -> Coats:
        """Some of them."""
        return Coats(*(getattr(self, field.name)[chosen] for field in fields(self)))


def worn_paint(coats: Coats, ways: shapely.STRtree) -> Graded:
    """Paint with rows and columns of worn points.

    Args:
        coats: The paint.
        ways: Of motor vehicles; see `way_lines`.
    """
    quads = coats.quads
    width = _length(quads[:, [3, 2]] - quads[:, [0, 1]])
    length = _length(quads[:, [1, 2]] - quads[:, [0, 3]])
    loose = coats.loose
    whole = whole_quads(quads, coats.polygons)
    pieces = []
    for k, quad in enumerate(quads):
        # Cut the quad into rows and columns, with narrow rims where paint ends.
        step = _STEP if width[k] > _THIN else _LONG_STEP
        across, share = _stations(width[k], (True, True), _STEP)
        along, ending = _stations(length[k], (bool(loose[k, 0]), bool(loose[k, 1])), step)
        rows = _cut_along(quad, along)
        shares = np.tile(across, (len(rows), 1))
        # Wear its points down.
        points = columns(rows, shares)
        rim = np.stack([np.minimum.outer(ending[:-1], share), np.minimum.outer(ending[1:], share)])
        wear = _wear_at(points, ways)
        wear[..., 1] *= coats.fresh[k] * rim.transpose(1, 0, 2)
        wear[..., 2] = coats.yellow[k]
        left = quad_polygons(rows)
        if not whole[k]:
            left = shapely.intersection(left, coats.polygons[k])
        pieces.append(graded_on(rows, shares, wear, polygons=left))
    return joined(pieces)


def _wear_at(points: Floats, ways: shapely.STRtree) -> Floats:
    """Brightness and share of fresh paint at points, (n, 2, k, 3), as wear."""
    wheels = wheels_at(points, ways)
    spots = 0.6 * patchy(points, 1.3, salt=1) + 0.4 * patchy(points, 0.5, salt=2)
    wear = np.zeros(points.shape)
    wear[..., 0] = 1.0 - _DIRT * np.clip(0.45 * wheels + 0.4 + 0.6 * spots, 0.0, 1.0)
    wear[..., 1] = np.clip(1.0 - _THINNED * wheels + _PATCHY * (spots - 0.3), 0.0, 1.0)
    return wear


def _length(sides: Floats) -> Floats:
    """The longer of two sides, (n, 2, 3) [m], as (n,)."""
    return np.asarray(np.linalg.norm(sides[..., :2], axis=-1).max(axis=1))


def _stations(length: float, loose: tuple[bool, bool], step: float) -> tuple[Floats, Floats]:
    """Places from one end (0) to the other (1), and shares of paint there.

    Args:
        length: [m].
        loose: Whether paint ends at either end.
        step: About the distance of places [m].
    """
    rim = min(_RIM / max(length, 1e-3), 0.3)
    first, last = (rim if end else 0.0 for end in loose)
    inner = np.linspace(first, 1.0 - last, max(2, round(length / step) + 1))
    at = np.concatenate([[0.0] * loose[0], inner, [1.0] * loose[1]])
    share = np.ones(len(at))
    share[[0, -1]] = [_RIM_SHARE if end else 1.0 for end in loose]
    return at, share


def _cut_along(quad: Floats, at: Floats) -> Floats:
    """A quad, (4, 3), cut across at places along it, (k,), as (k - 1, 4, 3)."""
    right = quad[0] + at[:, None] * (quad[1] - quad[0])
    left = quad[3] + at[:, None] * (quad[2] - quad[3])
    return np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)


def loose_ends(quads: Floats) -> Bools:
    """Return whether no other quad begins or ends where one begins and ends, (n, 2)."""
    ends = 0.5 * np.stack([quads[:, 0] + quads[:, 3], quads[:, 1] + quads[:, 2]], axis=1)
    _, place, count = np.unique(
        np.round(settled(ends.reshape(-1, 3)), 2), axis=0, return_inverse=True, return_counts=True
    )
    return np.asarray((count[place.reshape(-1)] < 2).reshape(-1, 2))
