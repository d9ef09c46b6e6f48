"""Draws a small picture of every film, and all of them on one sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.experiments.tools.content import Clip
from sumo3dviz_pt.image.png import write_png

_WIDTH = 320
_GAP = 8
_GREY = 119
"""sRGB of the sheet's ground: between films, as light as the page that shows them."""

FOLDER = "thumbnails"
SHEET = "contact_sheet.png"

Pixels = NDArray[np.uint8]


def write_thumbnails(folder: Path, clips: Sequence[Clip]) -> list[Path]:
    """Write the middle picture of each film, and the sheet of all; return the files.

    Args:
        folder: The study's.
        clips: Its films, in the order of the sheet.
    """
    from sumo3dviz_pt.video.picture import film_picture

    (folder / FOLDER).mkdir(exist_ok=True)
    pictures, files = [], []
    for clip in clips:
        width, height = clip.size
        size = (min(width, _WIDTH), max(round(height * min(width, _WIDTH) / width), 1))
        pixels = film_picture(folder / clip.file, _middle(clip), size=size)
        files.append(folder / FOLDER / f"{clip.name}.png")
        write_png(files[-1], pixels, level=6)
        pictures.append(pixels)
    write_png(folder / SHEET, sheet(pictures), level=6)
    return [*files, folder / SHEET]


def sheet(pictures: Sequence[Pixels]) -> Pixels:
    """Return pictures side by side, in rows, (h, w, 3).

    Args:
        pictures: (h, w, 3) each; smaller ones stand at the upper left of their places.
    """
    columns = math.ceil(math.sqrt(len(pictures)))
    rows = math.ceil(len(pictures) / columns)
    high = max(len(picture) for picture in pictures) + _GAP
    wide = max(picture.shape[1] for picture in pictures) + _GAP
    whole = np.full((rows * high + _GAP, columns * wide + _GAP, 3), _GREY, dtype=np.uint8)
    for place, picture in enumerate(pictures):
        top, left = _GAP + place // columns * high, _GAP + place % columns * wide
        whole[top : top + len(picture), left : left + picture.shape[1]] = picture
    return whole


def _middle(clip: Clip) -> float:
    """Return the time of a film's middle picture [s]."""
    from fractions import Fraction

    rate = Fraction(clip.rate)
    frames = max(round(clip.duration * rate), 1)
    return float(Fraction(frames // 2) / rate)
