"""A clip for a photometer: grey steps, a checker, a frame counter, and what they should measure.

`calibration/clip.mp4` begins with a chart, then fills the picture with one grey after the other.
Every frame has its number, and a square in a corner that is white in even frames and black in odd
ones, so that a photodiode counts what a screen drops. `calibration/clip.json` says when which grey
is seen, and its luminance on a screen with the assumed white and sRGB's curve.

References:
    IEC 61966-2-1:1999 (sRGB's curve).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.files.whole import write_whole
from sumo3dviz_pt.image.png import write_png
from sumo3dviz_pt.job.settings import OutputSettings
from sumo3dviz_pt.job.study import CalibrationSettings
from sumo3dviz_pt.model.colour import linear_from_srgb

FOLDER = "calibration"
GREYS = (0, 16, 32, 48, 64, 96, 128, 160, 192, 224, 240, 255)
"""sRGB codes that fill the picture, one after the other."""

_CHART_SECONDS = 3.0
_WEDGE = 16  # steps of the chart's wedge
_COLOURS = ((255, 0, 0), (0, 255, 0), (0, 0, 255), (0, 255, 255), (255, 0, 255), (255, 255, 0))
_GREY = 94  # between two steps of the wedge
_CHECKS = (12, 2, 1)  # widths of the checkers' squares [px]
_FLAG = 0.08  # of the square for a photodiode, share of the picture's height
_LETTERS = 0.035

Pixels = NDArray[np.uint8]


def write_calibration(
    folder: Path, wanted: CalibrationSettings | None, output: OutputSettings
) -> list[Path]:
    """Write the clip, its chart as a picture, and what they show; return the files.

    Args:
        folder: The study's.
        wanted: The assumed white; None writes nothing.
        output: Size, rate and codec of the study's films, which the clip has, too.
    """
    if wanted is None:
        return []
    from sumo3dviz_pt.video import encode

    place = folder / FOLDER
    place.mkdir(exist_ok=True)
    clip, picture, note = place / "clip.mp4", place / "chart.png", place / "clip.json"
    encode(clip_frames(wanted, output.size, output.fps), clip, size=output.size, fps=output.fps)
    write_png(picture, chart(output.size), level=6)
    write_whole(note, json.dumps(account(wanted, output.size, output.fps), indent=1) + "\n")
    return [clip, picture, note]


def clip_frames(
    wanted: CalibrationSettings, size: tuple[int, int], rate: Fraction
) -> Iterator[Pixels]:
    """Yield the clip's frames, (h, w, 3), sRGB codes."""
    number = 0
    for picture, count in _scenes(wanted, size, rate):
        for _ in range(count):
            yield _marked(picture, number)
            number += 1


def account(
    wanted: CalibrationSettings, size: tuple[int, int], rate: Fraction
) -> dict[str, object]:
    """Return what the clip shows when, and the luminances to expect."""
    steps = []
    begin = _frames(_CHART_SECONDS, rate)
    for code in GREYS:
        count = _frames(wanted.seconds, rate)
        share = linear_from_srgb(code / 255)
        steps.append(
            {
                "code": code,
                "first_frame": begin,
                "last_frame": begin + count - 1,
                "begin": float(begin / rate),
                "relative_luminance": round(share, 6),
                "luminance": round(share * wanted.white, 4),
            }
        )
        begin += count
    return {
        "white": wanted.white,
        "unit": "cd/m2, of a screen whose black gives no light",
        "curve": "IEC 61966-2-1",
        "size": list(size),
        "rate": str(rate),
        "frames": begin,
        "chart": {"first_frame": 0, "last_frame": _frames(_CHART_SECONDS, rate) - 1},
        "wedge": [round(code) for code in np.linspace(0, 255, _WEDGE).tolist()],
        "flag": "the square at the lower left is white in even frames, black in odd ones",
        "steps": steps,
    }


def chart(size: tuple[int, int]) -> Pixels:
    """Return the chart: wedge, colours and checkers on grey, (h, w, 3).

    The checkers' squares are of 0 and 255, one, two and twelve pixels wide: seen from afar, all are
    as bright as the patch of code 188 beside them where a screen is linear in sRGB's sense.

    Args:
        size: Width, height [px].
    """
    width, height = size
    pixels = np.full((height, width, 3), _GREY, dtype=np.uint8)
    left, right = round(0.06 * width), round(0.94 * width)
    for k, code in enumerate(np.linspace(0, 255, _WEDGE)):
        x0, x1 = (left + (right - left) * n // _WEDGE for n in (k, k + 1))
        pixels[round(0.12 * height) : round(0.36 * height), x0:x1] = round(float(code))
    for k, colour in enumerate(_COLOURS):
        x0, x1 = (left + (right - left) * n // len(_COLOURS) for n in (k, k + 1))
        pixels[round(0.40 * height) : round(0.54 * height), x0:x1] = colour
    rows, columns = np.indices((height, width))
    low, high = round(0.58 * height), round(0.82 * height)
    for k, wide in enumerate((*_CHECKS, 0)):
        x0, x1 = (left + (right - left) * n // (len(_CHECKS) + 1) for n in (k, k + 1))
        check = ((rows // max(wide, 1) + columns // max(wide, 1)) % 2 * 255)[low:high, x0:x1]
        pixels[low:high, x0:x1] = check[..., None] if wide else 188
    return pixels


def _scenes(
    wanted: CalibrationSettings, size: tuple[int, int], rate: Fraction
) -> Iterator[tuple[Pixels, int]]:
    """Yield pictures without their marks, and how many frames each lasts."""
    yield chart(size), _frames(_CHART_SECONDS, rate)
    width, height = size
    for code in GREYS:
        grey = np.full((height, width, 3), code, dtype=np.uint8)
        yield grey, _frames(wanted.seconds, rate)


def _frames(seconds: float, rate: Fraction) -> int:
    """Return how many frames a time lasts, one at least."""
    return max(round(seconds * rate), 1)


def _marked(picture: Pixels, number: int) -> Pixels:
    """Return a picture with its number and the square for a photodiode."""
    from sumo3dviz_pt.overlays.canvas import Canvas, rgba

    height, width = picture.shape[:2]
    side = max(round(_FLAG * height), 2)
    bright = picture[height - side // 2, width // 2].mean() > 127
    canvas = Canvas((width, height))
    canvas.text(
        f"{number:05d}",
        (height - side / 2, 0.9 * width),
        share=_LETTERS,
        colour=rgba("#000000" if bright else "#ffffff"),
        plate=None,
    )
    found = canvas.over(np.asarray(picture / 255, dtype=np.float32))
    marked = (found * 255 + 0.5).astype(np.uint8)
    marked[height - side :, :side] = 0 if number % 2 else 255
    return marked
