"""How long lines and outlines of objects may be: they are built as a whole, seen or not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.kinds import Kind

LONGEST = 50_000.0
"""Of one fence, hedge or wall of a building [m]."""

LONGEST_TOGETHER = 500_000.0
"""Of all of a kind [m]: ten times what stands along the motorways of a large city."""


def check_extents(kind: Kind, items: Sequence[Poi | Polygon]) -> None:
    """Refuse lines and outlines that are too long to be real.

    Raises:
        InputError: Names the polygon and its file.
    """
    together = 0.0
    for item in items:
        if not isinstance(item, Polygon):
            continue
        way = float(np.linalg.norm(np.diff(item.shape[:, :2], axis=0), axis=1).sum())
        together += way
        if way > LONGEST or together > LONGEST_TOGETHER:
            most = f"at most {LONGEST / 1e3:g} km are drawn, {LONGEST_TOGETHER / 1e3:g} km in all"
            raise InputError(
                f"{together / 1e3:,.0f} km of {kind.name}, and {most}; mend or remove it",
                file=item.source,
                element=f'poly "{cut(item.id)}"',
            )
