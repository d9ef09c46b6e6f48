"""Read points of interest and polygons from SUMO's additional files."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Colour, frozen
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.sumo import bounds
from sumo3dviz_pt.sumo.places.objects import is_geo, poi_position, shape_in_net, unplaced
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.values import (
    parse_colour,
    parse_flag,
    parse_points,
    yaw_from_angle_deg,
)

logger = logging.getLogger(__name__)

_POI_FIELDS = frozenset(
    {"id", "type", "x", "y", "lon", "lat", "lane", "pos", "posLat", "color", "angle"}
)
_POLYGON_FIELDS = frozenset({"id", "type", "shape", "geo", "color", "fill"})
_KINDS = ("poi", "poly")


def read_additional(
    paths: Iterable[Path], network: Network | None = None
) -> tuple[tuple[Poi, ...], tuple[Polygon, ...]]:
    """Read the POIs and polygons of additional files; other elements are ignored.

    POIs and polygons whose place is not known, and polygons with fewer than two points, are
    left out with a warning that counts them.

    Args:
        paths: Additional files, plain or gzipped.
        network: Places what is given by longitude and latitude, or by a lane.

    Returns:
        POIs and polygons in file order.

    Raises:
        InputError: If a file is damaged or an attribute cannot be understood.
    """
    pois: list[Poi] = []
    polygons: list[Polygon] = []
    for path in paths:
        left_out: Counter[str] = Counter()
        for element, params in _objects(path):
            reason = _unusable(element, network)
            if reason:
                left_out[reason] += 1
            elif element.tag == "poi":
                pois.append(_poi(element, params, network))
            else:
                polygons.append(_polygon(element, params, network))
        for reason, count in left_out.items():
            logger.warning("%s: %d %s", path, count, reason)
    return tuple(pois), tuple(polygons)


def _objects(path: Path) -> list[tuple[Element, dict[str, str]]]:
    """Return the POIs and polygons of a file, each with its `<param>` children."""
    objects: list[tuple[Element, dict[str, str]]] = []
    owner: Element | None = None
    for element in read_elements(path, root=(), what="an additional file of SUMO"):
        if element.tag in _KINDS:
            owner = element
            objects.append((element, {}))
        elif owner is not None and element.depth <= owner.depth:
            owner = None
        elif owner is not None and element.tag == "param":
            objects[-1][1][element.text("key")] = element.text("value", "")
    return objects


def _unusable(element: Element, network: Network | None) -> str:
    """Return why an object cannot be placed, or nothing."""
    what = "POIs" if element.tag == "poi" else "polygons"
    reason = unplaced(element, network)
    if not reason and what == "polygons" and len(element.text("shape", "").split()) < 2:
        reason = "they have fewer than two points"
    return reason and f"{what} left out: {reason}"


def _poi(element: Element, params: dict[str, str], network: Network | None) -> Poi:
    given = "angle" in element.attributes
    angle = element.number("angle", within=bounds.ANGLE) if given else None
    return Poi(
        id=element.text("id"),
        type=element.text("type", ""),
        position=poi_position(element, network),
        yaw=None if angle is None else yaw_from_angle_deg(angle),
        colour=colour_of(element),
        source=str(element.file),
        params=_others(element, _POI_FIELDS) | params,
    )


def _polygon(element: Element, params: dict[str, str], network: Network | None) -> Polygon:
    try:
        shape = parse_points(element.text("shape"))[:, :2]
    except ValueError as error:
        raise element.error(f"shape must hold points such as 1.0,2.0, but {error}") from None
    if network is not None:
        location = network.location
        geo = is_geo(element)
        shape = shape_in_net(element, shape, location) if geo else location.inside(shape)
    return Polygon(
        id=element.text("id"),
        type=element.text("type", ""),
        shape=frozen(shape),
        fill=parse_flag(element.text("fill", "false")),
        colour=colour_of(element),
        source=str(element.file),
        params=_others(element, _POLYGON_FIELDS) | params,
    )


def colour_of(element: Element) -> Colour | None:
    """Return the linear sRGB of an element's `color`, or None where it has none.

    Raises:
        InputError: If SUMO would not understand it either.
    """
    text = element.text("color", "")
    try:
        return parse_colour(text)
    except ValueError:
        raise element.error(
            f'color="{cut(text)}" must be a name, #rrggbb or r,g,b with 0-255 or 0-1'
        ) from None


def _others(element: Element, known: frozenset[str]) -> dict[str, str]:
    return {key: value for key, value in element.attributes.items() if key not in known}
