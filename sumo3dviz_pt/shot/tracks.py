"""Puts trains onto rails that lie higher than the road network says."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.scene import Mover
from sumo3dviz_pt.world.rails.guards import TRAINS


def on_tracks(
    parts: Iterable[Mover], vclass: str, rise: Callable[[Floats], Floats] | None
) -> Iterable[Mover]:
    """Lift the parts of a train onto the rails below each of them.

    Args:
        parts: Of one road user.
        vclass: What it is drawn as; all but trains stay where they are.
        rise: How high rails are at points, (n, 2 or 3) -> (n,) [m]; None if all lie flush.
    """
    if rise is None or vclass not in TRAINS:
        return parts
    parts = list(parts)
    heights = rise(np.array([part.world_from_body.position for part in parts]).reshape(-1, 3))
    return [
        replace(part, world_from_body=Transform.from_pose((0.0, 0.0, up)) @ part.world_from_body)
        for part, up in zip(parts, heights.tolist(), strict=True)
    ]
