"""What stands beside the streets: buildings, trees and a park."""

from __future__ import annotations

import numpy as np

from examples import sumo_files as sf
from examples.crossing.network import ARMS, CORNERS, REACH, corner, place


def along(arm: str, s: float, left: float) -> tuple[float, float, float]:
    """A place beside an arm, and the direction from there to the arm [deg from north]."""
    (x, y), (a, b) = place(arm, np.array([s]), left)[0], place(arm, np.array([s]), 0.0)[0]
    return float(x), float(y), float(np.degrees(np.arctan2(a - x, b - y)) % 360.0)


def buildings(rng: np.random.Generator) -> list[tuple[str, float, float, float]]:
    """Places for buildings: shops near the lights, blocks along the streets, homes behind."""
    found = []
    for arm in ARMS:
        for side in (1.0, -1.0):
            park = (arm, side) in {("W", 1.0), ("S", -1.0)}  # trees stand in this quarter
            rows = [(31.0, "shop", 27.0, 95.0), (35.0, "block", 38.0, REACH)]
            rows += [(66.0, "block", 39.0, 100.0), (68.0, "home", 23.0, REACH)]
            for left, kind, pitch, end in rows:
                for s in np.arange(125.0 if park else 40.0, end, pitch):
                    found.append(
                        (
                            kind,
                            *along(
                                arm, s + rng.normal(0.0, 1.0), side * (left + rng.normal(0.0, 0.6))
                            ),
                        )
                    )
    return found


def trees(rng: np.random.Generator) -> sf.Floats:
    """Places for trees: rows along the streets, and the park."""
    rows = [
        along(arm, s + rng.normal(0.0, 0.8), side * (18.0 + rng.normal(0.0, 0.3)))[:2]
        for arm in ARMS
        for side in (1.0, -1.0)
        for s in np.arange(24.0, REACH, 11.0)
    ]
    middle = 0.5 * (corner("SW") + place("W", np.array([0.0]), 0.0)[0])
    park = middle + rng.uniform(-48.0, 48.0, (130, 2))
    far = np.concatenate([corner(name) + rng.normal(0.0, 60.0, (60, 2)) for name in CORNERS])
    return np.concatenate([np.array(rows), park, far])
