"""Layers of films in Python: what `render` wrote beside them, read again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.layers.read import FrameLayers


def read_layers(film: Path | str, frame: int) -> FrameLayers:
    """Return the layers of a film's frame.

    Args:
        film: The film, or its folder of layers.
        frame: The frame's number, from 0.

    Raises:
        InputError: If they are missing, damaged or of another form.
    """
    from sumo3dviz_pt.pipeline.films.sequences import film_name
    from sumo3dviz_pt.pipeline.layers.places import beside
    from sumo3dviz_pt.pipeline.layers.read import read_frame

    path = Path(film)
    return read_frame(path if path.is_dir() else beside(film_name(path)), frame)
