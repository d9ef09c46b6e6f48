"""What a recording has to know of a network, without reading all of it into memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from sumo3dviz_pt.sumo.stream import Element, read_elements


def edge_names(path: Path) -> Iterator[str]:
    """Yield the ids of all edges, those within junctions, too.

    Raises:
        InputError: If the file is damaged or no network.
    """
    return (element.text("id") for element in _elements(path) if element.tag == "edge")


def has_heights(path: Path) -> bool:
    """Return whether SUMO writes heights: whether any lane is elsewhere than at height 0.

    Raises:
        InputError: If the file is damaged or no network.
    """
    return any(
        _is_high(point)
        for element in _elements(path)
        if element.tag == "lane"
        for point in element.text("shape", "").split()
    )


def _is_high(point: str) -> bool:
    """Return whether a point of a shape has a height that is not 0."""
    _, _, height = point.partition(",")[2].partition(",")
    return bool(height.strip("-0."))


def _elements(path: Path) -> Iterator[Element]:
    """Yield the elements of a network."""
    return read_elements(path, root="net", what="a SUMO network")
