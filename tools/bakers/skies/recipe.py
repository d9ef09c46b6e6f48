"""What a cloud layer is made from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats


@dataclass(frozen=True, slots=True)
class CloudRecipe:
    """How a cloud layer is made.

    Attributes:
        rows: Rows of the map; it has four times as many columns.
        seed: Of everything random in it.
        sun: Azimuth clockwise from north and elevation of the sun it is lit by [rad].
        cover: Share of the ground plane under cumulus, [0, 1]; 0 leaves it out.
        base: Height of the cloud bases [m].
        depth: Height from bases to the highest tops [m].
        extinction: Of the densest cloud [1/m].
        cell: Two thirds of the largest cloud's width [m].
        span: After how far the cumulus come again [m].
        clumped: How strongly clouds gather in patches; 0 spreads them evenly.
        cirrus: Opacity of the densest cirrus, [0, 1].
        flakes: Opacity of the densest altocumulus, [0, 1].
        mackerel: Opacity of the densest altocumulus of a fair evening, [0, 1].
        backlit: How strongly cirrus and the evening's altocumulus shine around a low sun.
        fades: Elevation up to which air hides clouds [deg].
        stratus: Whether a closed deck hides all else.
        at_sun: How cloudy it is where the sun stands, from the clearest place of the
            field, 0, to its thickest, 1.
        steps: Of the march through the slab.
        texels: Of the billows along each side; details have half as many.
    """

    rows: int
    seed: int
    sun: tuple[float, float]
    cover: float = 0.0
    base: float = 1300.0
    depth: float = 850.0
    extinction: float = 0.06
    cell: float = 2300.0
    span: float = 36_000.0
    clumped: float = 0.8
    cirrus: float = 0.0
    flakes: float = 0.0
    mackerel: float = 0.0
    backlit: float = 0.0
    fades: float = 3.5
    stratus: bool = False
    at_sun: float = 0.0
    steps: int = 160
    texels: int = 128


def towards_of(azimuth: Floats | float, elevation: Floats | float) -> Floats:
    """Return unit vectors (east, north, up), (..., 3), of angles [rad]."""
    level = np.cos(elevation)
    parts = (level * np.sin(azimuth), level * np.cos(azimuth), np.sin(elevation))
    return np.stack(np.broadcast_arrays(*parts), axis=-1)
