"""Measures a film's pictures as they are seen, and the light of the scene behind them.

A display is assumed: its white has a luminance that the study file says, its curve is sRGB's. Then
luminance is white x (0.2126 R + 0.7152 G + 0.0722 B) of decoded channels. RMS contrast is the
standard deviation of luminance over its mean. Motion energy is the mean absolute change of
luminance from the frame before, per pixel: it holds what moves, the camera's own motion and noise.

References:
    IEC 61966-2-1 (sRGB); Peli, "Contrast in complex images", JOSA A 7, 1990,
    doi:10.1364/JOSAA.7.002032 (RMS contrast).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.clutter import edge_density
from sumo3dviz_pt.model.colour import LUMINANCE, linear_from_srgb
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.lamps import CANDELAS_PER_UNIT
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder

_LINEAR = np.array([linear_from_srgb(code / 255.0) for code in range(256)])
"""Linear light of each 8-bit code."""

_ENDS = (1, 99)
"""Percentiles that are told of luminance."""

Row = dict[str, float]


def picture_rows(pictures: Iterable[NDArray[np.uint8]], *, white: float) -> Iterator[Row]:
    """Yield what each picture of a film measures, in order.

    Args:
        pictures: Of the film, (h, w, 3), sRGB codes.
        white: Luminance of the display's white [cd/m2].
    """
    before: Floats | None = None
    for picture in pictures:
        shown = white * (_LINEAR[picture] @ LUMINANCE)
        mean = float(shown.mean())
        yield {
            **_spread("shown", shown),
            "shown_peak": float(shown.max()),
            "contrast": float(shown.std()) / mean if mean > 0.0 else 0.0,
            "motion_energy": float("nan")
            if before is None
            else float(np.abs(shown - before).mean()),
            "clutter": edge_density(_luma(picture)),
        }
        before = shown


def scene_row(film: Path, number: int) -> Row:
    """Return the luminance of the scene in a stored frame [cd/m2]; NaN if the frame is gone.

    The frame is taken as it was traced: with few samples, noise widens the percentiles.

    Args:
        film: The film.
        number: The frame's.

    Raises:
        InputError: If the frame is damaged.
    """
    from sumo3dviz_pt.image.exr import read_layers

    path = frame_file(frames_folder(film), number)
    if not path.is_file():
        return _spread("scene", np.array([np.nan]))
    layers, _ = read_layers(path)
    # Light of lamps that are seen directly is stored apart where frames help each other.
    radiance = layers["radiance"] + layers.get("excess", np.float32(0.0))
    return _spread("scene", CANDELAS_PER_UNIT * (radiance.astype(np.float64) @ LUMINANCE))


def _spread(name: str, luminance: Floats) -> Row:
    """Return mean and ends of luminances, under names that begin with a word."""
    low, high = np.percentile(luminance, _ENDS)
    return {
        f"{name}_mean": float(luminance.mean()),
        f"{name}_p1": float(low),
        f"{name}_p99": float(high),
    }


def _luma(picture: NDArray[np.uint8]) -> Floats:
    """Return encoded luma, (h, w) in [0, 1]."""
    return np.asarray((picture / 255.0) @ LUMINANCE)
