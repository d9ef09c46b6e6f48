"""Where pictures and height models lie: what GeoTIFFs and world files say, and the way there.

References:
    GeoTIFF 1.1 (OGC 19-008r4): ModelPixelScaleTag 33550, ModelTiepointTag 33922,
    ModelTransformationTag 34264, GeoKeyDirectoryTag 34735.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import InputError, MissingExtraError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.sumo.places import is_projected

DEGREES = "EPSG:4326"
"""Longitude and latitude."""

_POINT, _MODEL, _PROJECTED, _GEOGRAPHIC, VERTICAL = 1025, 1024, 3072, 2048, 4099
_OWN = 32767  # from here on, codes are no EPSG's


@dataclass(frozen=True, slots=True)
class Placing:
    """Where a raster lies.

    Attributes:
        x, y: Of the middle of its first value, in the north-west.
        dx, dy: Between values, to the east and to the south, > 0.
        system: What its coordinates are, as PROJ names it; empty where nothing says.
        keys: Numbers of a GeoTIFF by key.
    """

    x: float
    y: float
    dx: float
    dy: float
    system: str
    keys: dict[int, int]


def placing_of(file: Path, tags: Any) -> Placing:
    """Return where a TIFF lies, by its tags or the world file beside it.

    Raises:
        InputError: If nothing says that, or it is turned.
    """
    keys = _geo_keys(tags.get(34735, ()))
    x, y, dx, dy = _placed(file, tags, centred=keys.get(_POINT) == 2)
    code = keys.get(_PROJECTED) or keys.get(_GEOGRAPHIC)
    system = f"EPSG:{code}" if code and code < _OWN else ""
    system = DEGREES if not system and keys.get(_MODEL) == 2 else system
    return Placing(x, y, dx, dy, system, keys)


def _geo_keys(directory: Any) -> dict[int, int]:
    """Return the keys of a GeoTIFF that hold a number of their own."""
    numbers = [int(number) for number in directory]
    keys = zip(*(numbers[4 + k :: 4] for k in range(4)), strict=False)
    return {key: value for key, where, _, value in keys if where == 0}


def _placed(file: Path, tags: Any, *, centred: bool) -> tuple[float, float, float, float]:
    """Return x and y of the middle of the first value, and the steps to the right and down."""
    scale, tie, matrix = tags.get(33550), tags.get(33922), tags.get(34264)
    if scale and tie:
        dx, dy = float(scale[0]), float(scale[1])
        x, y = tie[3] - tie[0] * dx, tie[4] + tie[1] * dy
    elif matrix and not matrix[1] and not matrix[4]:
        dx, dy, x, y = matrix[0], -matrix[5], matrix[3], matrix[7]
    else:
        return world_file(file)
    if dx <= 0 or dy <= 0:
        raise InputError("its rows do not go south; write it again with gdalwarp", file=file)
    half = 0.0 if centred else 0.5
    return float(x + half * dx), float(y - half * dy), float(dx), float(dy)


WORLD_FILES = (".tfw", ".tifw", ".pgw", ".jgw", ".wld")
"""Endings of world files, which say where the picture beside them lies."""


def world_file(file: Path) -> tuple[float, float, float, float]:
    """Return where a picture lies by the world file beside it."""
    for suffix in WORLD_FILES:
        beside = file.with_suffix(suffix)
        if beside.is_file():
            numbers = [float(word) for word in beside.read_text(encoding="ascii").split()]
            if len(numbers) == 6 and not numbers[1] and not numbers[2]:
                return numbers[4], numbers[5], numbers[0], -numbers[3]
    raise InputError(
        "says nowhere where it lies; write it as GeoTIFF, or give its world file (.tfw)", file=file
    )


def way_to(system: str, location: Location, file: Path) -> Callable[[Floats], Floats]:
    """Return what turns our coordinates into those of a raster.

    Args:
        system: What its coordinates are; empty where they are those of the network.
        location: Of the network.
        file: For messages.

    Raises:
        InputError: If it lies on the Earth and the network does not.
        MissingExtraError: If pyproj is not installed.
    """

    def projected(places: Floats) -> Floats:
        return location.outside(places) - location.net_offset

    if not system or not is_projected(location):
        if system == DEGREES:
            message = (
                "its places are degrees, and the network has no projection; make the network"
                " again with --proj.utm, or give it in the network's coordinates"
            )
            raise InputError(message, file=file)
        return projected
    try:
        from pyproj import CRS, Transformer
    except ImportError as error:
        raise MissingExtraError(
            "pictures and heights on the Earth need pyproj", extra="geo"
        ) from error
    across = Transformer.from_crs(CRS(location.projection), CRS(system), always_xy=True)

    def transformed(places: Floats) -> Floats:
        east, north = projected(places).T
        return np.column_stack(across.transform(east, north))

    return transformed
