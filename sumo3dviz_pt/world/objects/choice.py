"""Which POIs and polygons are objects of a kind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.kinds import Kind, kind_of


def chosen(
    kind: Kind,
    settings: ObjectSettings | None,
    pois: Sequence[Poi],
    polygons: Sequence[Polygon],
) -> list[Poi] | list[Polygon]:
    """Return the objects of a kind, each id of a file once.

    Args:
        kind: Which kind.
        settings: Its `file`, if given, says alone what belongs to it; None counts as no file.
        pois: All points of interest.
        polygons: All polygons and lines.
    """
    file = None if settings is None else settings.file

    def belongs(item: Poi | Polygon) -> bool:
        if file is not None:
            return _same(Path(item.source), file)
        return kind_of(item.type, item.source) == kind.name

    if kind.form == "point":
        return [poi for poi in pois if belongs(poi)]
    fits = [polygon for polygon in polygons if belongs(polygon) and len(polygon.shape) > 1]
    if kind.form == "area":
        return [polygon for polygon in fits if len(polygon.shape) > 2]
    return fits


def _same(one: Path, other: Path) -> bool:
    """Whether two paths mean the same file."""
    return one == other or one.resolve() == other.resolve()
