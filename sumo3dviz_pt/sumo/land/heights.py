"""Reads the land's heights, and puts roads on them that have none.

Height models are GeoTIFF, ESRI's ASCII grids, or tiles of SRTM (.hgt). They become a grid in the
network's coordinates. Roads without z follow them, smoothed until one can drive there. Where z are
heights above the land, as netconvert makes them of the layers of bridges, roads follow it as well
and keep them. Roads with other z keep these, and the land meets them in slopes; a model that counts
from another zero than they do is shifted.

References:
    GeoTIFF's vertical units: OGC 19-008r4, EPSG's codes. No data: GDAL's tag 42113.
"""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.atomic import read_plain
from sumo3dviz_pt.model.geometry import Floats, evenly_along, frozen
from sumo3dviz_pt.model.network import Edge, Heights, Junction, Lane, Network
from sumo3dviz_pt.sumo.land.rasters import DEGREES, VERTICAL, placing_of, way_to

logger = logging.getLogger(__name__)

_AROUND = 4000.0  # land that is kept around a network [m]
_MOST_VALUES = 2000  # of a grid's side
_LARGEST = 2_000_000_000  # bytes of a file
_POINTS = 6.0  # distance of points along roads that follow the land [m]
_SMOOTH = 12.0  # spread of the mean of heights that roads follow, at first [m]
_SMOOTHEST = 80.0
_STEEP = 0.12  # grade that roads keep below, but for one place in a hundred
_LEVEL = 0.3  # share of roads at z = 0 from which on z are heights above the land
_OTHER_ZERO = 20.0  # median height of the land above roads from which on it counts otherwise [m]
_LEAST = 0.5  # share of a network that must lie on known heights

_FEET = {9002: 0.3048, 9003: 1200 / 3937}


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """A height model in its own coordinates, rows going north.

    Attributes:
        corner: x and y of the first value.
        step: Between values, in x and y.
        values: (rows, columns) [m]; NaN where nothing is known.
        system: What its coordinates are, as PROJ names it; empty where it does not say.
    """

    corner: tuple[float, float]
    step: tuple[float, float]
    values: Floats
    system: str


def on_land(network: Network, file: Path) -> Network:
    """Return a network with the land's heights; roads without z are put on them.

    Raises:
        InputError: If the file is damaged, no height model, or lies elsewhere.
        MissingExtraError: If its coordinates differ from the network's and pyproj is not there.
    """
    if not file.exists():
        raise InputError("the file does not exist; check the path", file=file)
    return _on_land(network, file, file.stat().st_mtime_ns)


@lru_cache(maxsize=2)
def _on_land(network: Network, file: Path, changed: int) -> Network:
    """What `on_land` keeps."""
    del changed
    heights = _in_net(_read(file), network, file)
    lanes = np.concatenate([lane.shape for lane in network.lanes.values()])
    covered = np.isfinite(heights.at(lanes))
    if covered.mean() < _LEAST:
        x, y = network.location.outside(lanes[:1, :2])[0]
        raise InputError(
            f"holds heights of only {100 * covered.mean():.0f} % of the roads (the first is at"
            f" {x:.0f}, {y:.0f}); name the height model of this place",
            file=file,
        )
    above = float(np.median(heights.at(lanes[covered]) - lanes[covered, 2]))
    level = float((np.abs(lanes[:, 2]) < 0.01).mean())
    if level < _LEVEL or (level < 1.0 and abs(above) < 1.0):
        return replace(network, heights=_counted_alike(heights, above, file))
    base = float(np.floor(np.nanmin(heights.at(lanes[covered]))))
    heights = replace(heights, values=heights.values - base)
    smooth, spread, grade = _drivable(heights, network)
    logger.warning(
        "%s: roads follow its heights, smoothed over %.0f m, counted from %.0f m; the steepest has"
        " %.0f %%",
        *(file, spread, base, 100 * grade),
        extra={"once": f"heights of {file}"},
    )
    raised = replace(_raised(network, smooth), heights=heights)
    return raised if level == 1.0 else replace(raised, raised_by=smooth)


def _counted_alike(heights: Heights, above: float, file: Path) -> Heights:
    """Return heights that are counted from the same zero as those of roads.

    Args:
        heights: The land's.
        above: Their median above the roads [m].
        file: Of the model, for the note.
    """
    if abs(above) < _OTHER_ZERO:
        return heights
    logger.warning(
        "%s: its heights are counted from another zero than the network's z: %.1f m are taken off",
        *(file, above),
        extra={"once": f"zero of {file}"},
    )
    return replace(heights, values=heights.values - above)


def _drivable(heights: Heights, network: Network) -> tuple[Heights, float, float]:
    """Return heights that one can drive on, over how many metres they are smoothed, the grade."""
    spread = _SMOOTH
    while True:
        smooth = _smoothed(heights, spread)
        grades = [_grades(lane.shape, smooth) for lane in network.lanes.values()]
        steep = float(np.quantile(np.concatenate([np.zeros(1), *grades]), 0.99))
        if steep <= _STEEP or spread >= _SMOOTHEST:
            return smooth, spread, steep
        spread = min(1.5 * spread, _SMOOTHEST)


def _grades(shape: Floats, heights: Heights) -> Floats:
    """Return the slopes along a line on the land, without sign."""
    points = _followed(shape * [1.0, 1.0, 0.0], heights)
    lengths = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    rises = np.abs(np.diff(points[:, 2]))
    return np.asarray(rises[lengths > 0.5] / lengths[lengths > 0.5])


def _smoothed(heights: Heights, spread: float) -> Heights:
    """Return heights as means around each place; what is not known has no weight."""
    known = np.isfinite(heights.values)
    sigma = [spread / heights.step[1], spread / heights.step[0]]
    total = gaussian_filter(np.where(known, heights.values, 0.0), sigma, mode="nearest")
    weight = gaussian_filter(known.astype(np.float64), sigma, mode="nearest")
    return replace(
        heights, values=np.where(weight > 1e-3, total / np.maximum(weight, 1e-3), np.nan)
    )


def _followed(shape: Floats, heights: Heights) -> Floats:
    """Return a line on the land, with a point every few metres, (n, 3) [m]."""
    dense = evenly_along([shape], lambda long: np.maximum(np.ceil(long / _POINTS) + 1, 2)).points
    points = np.concatenate([shape, dense])
    along = _place_along(shape, points)
    points = points[np.argsort(along, kind="stable")]
    apart = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1) > 0.05
    points = points[np.concatenate([[True], apart])]
    return lifted(points, heights)


def _place_along(shape: Floats, points: Floats) -> Floats:
    """Return how far along a line points of it lie, (n,) [m]."""
    steps = np.linalg.norm(np.diff(shape, axis=0), axis=1)
    own = np.concatenate([[0.0], np.cumsum(steps)])
    rest = len(points) - len(shape)
    return np.concatenate([own, np.linspace(0.0, own[-1], rest)])


def lifted(points: Floats, heights: Heights) -> Floats:
    """Return points above the land; where it is not known, above the nearest that is.

    Args:
        points: Their z are heights above it, (n, 3) [m].
        heights: The land's.
    """
    z = heights.at(points)
    known = np.isfinite(z)
    if not known.all():
        at = np.arange(len(z))
        z = np.interp(at, at[known], z[known]) if known.any() else np.zeros(len(z))
    return frozen(np.column_stack([points[:, :2], points[:, 2] + z]))


def _raised(network: Network, heights: Heights) -> Network:
    """Return a network whose roads follow the land."""

    def lane(own: Lane, *, line: bool) -> Lane:
        shape = _followed(own.shape, heights) if line else lifted(own.shape, heights)
        outline = None if own.outline is None else lifted(own.outline, heights)
        return replace(own, shape=shape, outline=outline)

    def edge(own: Edge) -> Edge:
        line = own.function != "walkingarea"
        return replace(own, lanes=tuple(lane(each, line=line) for each in own.lanes))

    def junction(own: Junction) -> Junction:
        outline = lifted(own.outline, heights) if len(own.outline) else own.outline
        return replace(own, outline=outline, position=lifted(own.position[None], heights)[0])

    return replace(
        network,
        edges={name: edge(own) for name, own in network.edges.items()},
        junctions={name: junction(own) for name, own in network.junctions.items()},
    )


def _in_net(model: _Model, network: Network, file: Path) -> Heights:
    """Return a height model on a grid of the network's coordinates, around its roads."""
    location = network.location
    lanes = np.concatenate([lane.shape[:, :2] for lane in network.lanes.values()])
    low, high = lanes.min(axis=0) - _AROUND, lanes.max(axis=0) + _AROUND
    to_model = way_to(model.system, location, file)
    step = _metres(model, to_model, (low + high) / 2)
    step = max(step, float((high - low).max()) / _MOST_VALUES)
    count = np.ceil((high - low) / step).astype(int) + 1
    x, y = (low[axis] + step * np.arange(count[axis]) for axis in (0, 1))
    places = np.column_stack([each.ravel() for each in np.meshgrid(x, y)])
    own = Heights(model.corner, model.step, model.values)
    values = own.at(to_model(places)).reshape(count[1], count[0])
    rows, columns = (np.flatnonzero(np.isfinite(values).any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return Heights((x[0], y[0]), (step, step), values)
    part = values[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    corner = (float(x[columns[0]]), float(y[rows[0]]))
    return Heights(corner, (step, step), frozen(part))


def _metres(model: _Model, to_model: Callable[[Floats], Floats], middle: Floats) -> float:
    """Return the distance of a model's values near a place [m]."""
    around = middle + np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]])
    moved = to_model(around)
    per_metre = np.linalg.norm(moved[1:] - moved[0], axis=1) / 100.0
    return float(min(np.array(model.step) / np.maximum(per_metre, 1e-12)))


def _read(file: Path) -> _Model:
    """Read a height model.

    Raises:
        InputError: If it is damaged, or none.
    """
    head = read_plain(file, most=_LARGEST)[:64]
    if head[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return _geotiff(file)
    if file.name.lower().endswith(".hgt"):
        return _srtm(file)
    if head.lstrip().lower().startswith(b"ncols"):
        return _ascii_grid(file)
    raise InputError(
        "is no height model; give a GeoTIFF, an .asc grid or a tile of SRTM", file=file
    )


def _geotiff(file: Path) -> _Model:
    """Read a GeoTIFF."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Pillow, on damage and on large pictures
            with Image.open(file) as picture:
                tags: Any = picture.tag_v2  # type: ignore[attr-defined]
                values = np.array(picture, dtype=np.float64)
    except Image.DecompressionBombError:
        raise InputError("is too large; cut it to the place with gdalwarp -te", file=file) from None
    except (OSError, ValueError, UnidentifiedImageError) as error:
        message = f"cannot be read ({error}); write it again as GeoTIFF with one band"
        raise InputError(message, file=file) from None
    if values.ndim != 2:
        raise InputError("has several bands; give one band of heights", file=file)
    place = placing_of(file, tags)
    empty = re.search(r"[-+0-9.eE]+", str(tags.get(42113, "")))
    if empty:
        values[np.isclose(values, float(empty[0]))] = np.nan
    values[values < -1e4] = np.nan
    values *= _FEET.get(place.keys.get(VERTICAL, 0), 1.0)
    south = place.y - place.dy * (len(values) - 1)
    return _Model((place.x, south), (place.dx, place.dy), values[::-1], place.system)


def _srtm(file: Path) -> _Model:
    """Read a tile of SRTM: 1201 or 3601 values a side, named by its south-western corner."""
    match = re.match(r"([NS])(\d{1,2})([EW])(\d{1,3})", file.name.upper())
    data = np.frombuffer(read_plain(file, most=_LARGEST), dtype=">i2")
    side = round(len(data) ** 0.5)
    if match is None or side * side != len(data) or side < 2:
        message = "is no tile of SRTM such as N41E002.hgt; name it by its corner, or give a GeoTIFF"
        raise InputError(message, file=file)
    values = data.reshape(side, side)[::-1].astype(np.float64)
    south = float(match[2]) * (1 if match[1] == "N" else -1)
    west = float(match[4]) * (1 if match[3] == "E" else -1)
    step = 1.0 / (side - 1)
    return _Model((west, south), (step, step), np.where(values < -1e4, np.nan, values), DEGREES)


def _ascii_grid(file: Path) -> _Model:
    """Read an ASCII grid of ESRI; it does not say what its coordinates are."""
    try:
        words = read_plain(file, most=_LARGEST).decode("ascii").split()
        head: dict[str, float] = {}
        while words[2 * len(head)][:1].isalpha():
            at = 2 * len(head)
            head[words[at].lower()] = float(words[at + 1])
        values = np.array(words[2 * len(head) :], dtype=np.float64)
        rows, columns = int(head["nrows"]), int(head["ncols"])
        if len(values) != rows * columns:
            promised = f"{rows * columns} ({rows} rows of {columns})"
            raise ValueError(f"it has {len(values)} heights, and its head promises {promised}")
        values = values.reshape(rows, columns)[::-1].copy()
        step = head["cellsize"]
        corner = tuple(
            head[f"{axis}llcenter"]
            if f"{axis}llcenter" in head
            else head[f"{axis}llcorner"] + step / 2
            for axis in "xy"
        )
    except (KeyError, IndexError, ValueError) as error:
        raise InputError(f"is no ASCII grid ({error}); write it again", file=file) from None
    values[values == head.get("nodata_value", -9999.0)] = np.nan
    return _Model((corner[0], corner[1]), (step, step), values, "")
