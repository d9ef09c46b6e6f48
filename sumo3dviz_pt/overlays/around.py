"""What stands before, after and beside a film: plain pictures, fades, captions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sumo3dviz_pt.job.overlays import CaptionOverlay, FadeOverlay, StillOverlay
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.overlays.canvas import Canvas, rgba
from sumo3dviz_pt.overlays.facts import FilmFacts

_CROSS = (0.06, 0.006)  # length and width of the cross's arms, shares of the picture's height
_LETTERS = 0.05
_BRIGHT = 0.18  # luminance from which on a ground takes black letters


def still_count(stills: Sequence[StillOverlay], rate: float) -> int:
    """Return how many frames plain pictures last together, each in whole frames.

    Args:
        stills: Before or after a film.
        rate: Frames per second.
    """
    return sum(_frames(still, rate) for still in stills)


def still_frames(stills: Sequence[StillOverlay], film: FilmFacts) -> Iterator[Image]:
    """Yield the frames of plain pictures, (h, w, 3) in [0, 1], sRGB-encoded."""
    for still in stills:
        picture = still_picture(still, film.size)
        for _ in range(_frames(still, film.rate)):
            yield picture


def still_picture(still: StillOverlay, size: tuple[int, int]) -> Image:
    """Return a plain picture, (h, w, 3) in [0, 1], sRGB-encoded.

    Args:
        still: What it shows.
        size: Width, height [px].
    """
    width, height = size
    ground = np.empty((height, width, 3), dtype=np.float32)
    ground[:] = [channel / 255 for channel in rgba(still.colour)[:3]]
    ink = rgba("#000000" if (ground[0, 0] ** 2.2).mean() > _BRIGHT else "#ffffff")
    canvas = Canvas(size)
    row, column = (height - 1) / 2, (width - 1) / 2
    if still.show == "fixation":
        arm, wide = (share * height for share in _CROSS)
        canvas.box(row, column, (arm, max(wide, 1.0)), ink)
        canvas.box(row, column, (max(wide, 1.0), arm), ink)
    if still.text:
        lower = row + (0.12 * height if still.show == "fixation" else 0.0)
        canvas.text(still.text, (lower, column), share=_LETTERS, colour=ink, plate=None)
    return canvas.over(ground)


def faded(picture: Image, film: FilmFacts, number: int) -> Image:
    """Return a frame's picture as far as it has faded in or out.

    Args:
        picture: sRGB-encoded, (h, w, 3) in [0, 1].
        film: With the fade.
        number: Of the frame.
    """
    fade = film.settings.fade
    if fade is None:
        return picture
    share = np.float32(fade_share(fade, film, number))
    if share == 1.0:
        return picture
    colour = np.array(rgba(fade.colour)[:3], dtype=np.float32) / np.float32(255)
    return np.asarray(colour + share * (picture - colour), dtype=np.float32)


def fade_share(fade: FadeOverlay, film: FilmFacts, number: int) -> float:
    """Return how much of a frame is seen, [0, 1]; the middle of each frame's time counts."""
    now = film.film_time(number) + 0.5 / film.rate
    begun = now / fade.start if fade.start > 0 else 1.0
    left = (film.seconds - now) / fade.end if fade.end > 0 else 1.0
    return float(min(max(min(begun, left), 0.0), 1.0))


def captions_text(captions: Sequence[CaptionOverlay], film: FilmFacts) -> str:
    """Return captions as WebVTT; times count from the film's first frame, plain pictures included.

    References:
        WebVTT: The Web Video Text Tracks Format, https://www.w3.org/TR/webvtt1/
    """
    before = still_count(film.settings.before, film.rate) / film.rate
    cues = ["WEBVTT"]
    for caption in sorted(captions, key=lambda each: each.start):
        end = min(film.seconds, film.seconds if caption.end is None else caption.end)
        if caption.start >= end:
            continue
        words = caption.text.replace("&", "&amp;").replace("<", "&lt;").replace("-->", "--&gt;")
        lines = "\n".join(line for line in words.splitlines() if line.strip())
        cues.append(f"{_stamp(before + caption.start)} --> {_stamp(before + end)}\n{lines}")
    return "\n\n".join(cues) + "\n"


def _stamp(seconds: float) -> str:
    """Return a time as WebVTT writes it."""
    whole = round(seconds * 1000)
    minutes, rest = divmod(whole, 60_000)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{rest // 1000:02d}.{rest % 1000:03d}"


def _frames(still: StillOverlay, rate: float) -> int:
    """Return how many frames a plain picture lasts, one at least."""
    return max(round(still.seconds * rate), 1)
