"""From longitude and latitude to net coordinates.

References:
    SUMO's simple projection (`projParameter="-"`) was checked against Eclipse SUMO 1.28.0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sumo3dviz_pt.errors import MissingExtraError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location

_NONE, _SIMPLE = ("!", ""), "-"
_PER_DEGREE = np.array([111_320.0, 111_136.0])  # along a parallel at the equator, a meridian [m]


def is_projected(location: Location) -> bool:
    """Whether places on the Earth have net coordinates."""
    return location.projection not in _NONE


def net_from_geo(degrees: Floats, location: Location) -> Floats:
    """Return net coordinates.

    Args:
        degrees: Longitudes and latitudes, (n, 2) [deg].
        location: Of the network; it must be projected.

    Returns:
        x and y, (n, 2) [m]; infinite where the projection does not reach.

    Raises:
        MissingExtraError: If the package for projections is not installed.
    """
    if location.projection == _SIMPLE:
        metres = degrees * _PER_DEGREE
        metres[:, 0] *= np.cos(np.radians(degrees[:, 1]))
    else:
        projection = _projection(location.projection)
        metres = np.column_stack(projection(degrees[:, 0], degrees[:, 1]))
    return np.asarray(metres + np.array(location.net_offset))


def _projection(parameters: str) -> Any:
    """Return a projection by its PROJ string."""
    try:
        from pyproj import Proj
    except ImportError as error:
        raise MissingExtraError("longitudes and latitudes need pyproj", extra="geo") from error
    return Proj(parameters)
