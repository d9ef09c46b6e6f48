"""What stands beside the streets: buildings, trees and a park."""

from __future__ import annotations

import numpy as np
import shapely

from examples import sumo_files as sf
from examples.crossing.network import (
    ARMS,
    BIKE,
    CORNERS,
    LANE,
    MEDIAN,
    REACH,
    WALK,
    corner,
    place,
)


def along(arm: str, s: float, left: float) -> tuple[float, float, float]:
    """A place beside an arm, and the direction from there to the arm [deg from north]."""
    (x, y), (a, b) = place(arm, np.array([s]), left)[0], place(arm, np.array([s]), 0.0)[0]
    return float(x), float(y), float(np.degrees(np.arctan2(a - x, b - y)) % 360.0)


def buildings(rng: np.random.Generator) -> list[tuple[str, float, float, float]]:
    """Places for buildings: shops and blocks beyond the park, homes behind the streets.

    Houses along the streets are not written down: closed rows of them grow by themselves.
    """
    found = []
    for arm in ARMS:
        for side in (1.0, -1.0):
            park = (arm, side) in {("W", 1.0), ("S", -1.0)}  # trees stand in this quarter
            rows = [(66.0, "home", 23.0, REACH)]
            if park:
                rows = [(35.0, "shop", 46.0, 250.0), (35.0, "block", 46.0, REACH), *rows]
            for left, kind, pitch, end in rows:
                for s in np.arange(150.0, end, pitch):
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
        along(arm, s + rng.normal(0.0, 0.8), side * (verge + rng.normal(0.0, 0.15)))[:2]
        for arm, (_, _, bike) in ARMS.items()
        for verge in [2.0 * LANE + WALK + BIKE * bike + MEDIAN + 3.6]
        for side in (1.0, -1.0)
        for s in np.arange(42.0, REACH, 13.0)
    ]
    park = park_middle() + rng.uniform(-48.0, 48.0, (130, 2))
    far = np.concatenate([corner(name) + rng.normal(0.0, 60.0, (60, 2)) for name in CORNERS])
    return np.concatenate([np.array(rows), park, far])


def park_middle() -> sf.Floats:
    """The middle of the quarter that is a park, (2,) [m]."""
    return 0.5 * (corner("SW") + place("W", np.array([0.0]), 0.0)[0])


def clear_of_rows(places: sf.Floats, ground: shapely.Geometry) -> sf.Floats:
    """Trees, (n, 2) [m], without those that would take the place of a row of houses."""
    away = shapely.distance(ground, shapely.points(places))
    park = np.abs(places - park_middle()).max(axis=1) < 50.0
    return places[(away < 5.0) | (away > 23.0) | park]
