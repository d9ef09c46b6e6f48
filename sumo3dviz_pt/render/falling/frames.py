"""Places as a camera or a lamp sees them.

Sums are written out: a library of linear algebra would wake threads for each of them, and add in
another order on another processor.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats


def local(places: Floats, frame: Floats) -> Floats:
    """Return places in the world, (n, 3) [m], in a rigid frame, (4, 4)."""
    apart = [places[:, axis] - frame[axis, 3] for axis in range(3)]
    found = np.empty_like(places)
    for column in range(3):
        found[:, column] = sum(apart[axis] * frame[axis, column] for axis in range(3))
    return found


def along(vectors: Floats, axis: Floats) -> Floats:
    """Return how long vectors, (n, k), are along an axis, (k,)."""
    return np.asarray(sum(vectors[:, k] * float(part) for k, part in enumerate(axis)))
