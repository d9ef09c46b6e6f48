"""A sheet to draw on, laid over a picture, and what stands before, after and beside a film.

The sheet takes letters, lines and dots, in pixels of the picture. It is drawn at twice the
picture's size, so that lines are smooth, and laid over in full precision: where nothing is drawn,
the picture keeps its values. Letters are Pillow's own (Aileron, CC0). Plain pictures and fades
stand before and after a film, captions beside it.

Colours of speeds go from slow to fast: red, orange, yellow, light blue, blue. People who do not
tell red from green tell these apart; the ends are the traffic engineer's habit that red is slow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.job.overlays import CaptionOverlay, FadeOverlay, SpeedScale, StillOverlay
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.overlays.facts import FilmFacts

if TYPE_CHECKING:
    from sumo3dviz_pt.job.overlays import Place


FINER = 2
"""How many times as fine as the picture the sheet is."""

INK = (255, 255, 255, 255)
PLATE = (12, 14, 18, 168)
"""Ground of letters: dark enough for white ones on a white sky, clear enough to look through."""

_PAD = 0.45  # around letters, in their heights
_GAP = 0.02  # between plates and the picture's border, share of its height
_LEAST = 9  # height of letters [px], below which they cannot be read

Rgba = tuple[int, int, int, int]
Box = tuple[float, float, float, float]
_Points = Sequence[tuple[float, float]]
_Move = Callable[[_Points], list[tuple[float, float]]]


def rgba(colour: str, alpha: float = 1.0) -> Rgba:
    """Return `#rrggbb` with an opacity in [0, 1]."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue, round(255 * alpha)


class Canvas:
    """A sheet over a picture; places that are taken by plates fill up one after the other."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Take a clear sheet for a picture of a size, width and height [px]."""
        from PIL import Image as Pictures
        from PIL import ImageDraw

        self.size = size
        self._sheet = Pictures.new("RGBA", (size[0] * FINER, size[1] * FINER), (0, 0, 0, 0))
        self._draw = ImageDraw.Draw(self._sheet, "RGBA")
        self._taken: dict[str, float] = {}
        self._written: list[Box] = []

    # Lines and areas -----------------------------------------------------------------------

    def line(self, points: Floats, colour: Rgba, *, width: float) -> None:
        """Draw a polyline through rows and columns, (n, 2) [px], with a dark border."""
        self.plain_line(points, (0, 0, 0, colour[3] * 3 // 4), width=width + 2.0)
        self.plain_line(points, colour, width=width)

    def plain_line(self, points: Floats, colour: Rgba, *, width: float) -> None:
        """Draw a polyline through rows and columns, (n, 2) [px]."""
        wide = max(round(width * FINER), 1)
        self._draw.line(_flat(points), fill=colour, width=wide, joint="curve")

    def area(self, points: Floats, colour: Rgba, *, over: bool = True) -> None:
        """Fill a polygon of rows and columns, (n, 2) [px].

        Args:
            points: Its corners.
            colour: Of all of it.
            over: Whether what is below shines through; else it is replaced.
        """
        flat = _flat(points)
        if not over:
            self._draw.polygon(flat, fill=colour)
            return
        rows, columns = [y for _, y in flat], [x for x, _ in flat]
        box = min(columns), min(rows), max(columns), max(rows)
        self._lay(box, colour, lambda mask, moved: mask.polygon(moved(flat), fill=255))

    def dot(self, row: float, column: float, colour: Rgba, *, radius: float) -> None:
        """Draw a disc with a dark border."""
        middle = _fine(column), _fine(row)
        for ink, far in (((0, 0, 0, 200), radius + 1.2), (colour, radius)):
            reach = far * FINER
            box = [middle[0] - reach, middle[1] - reach, middle[0] + reach, middle[1] + reach]
            self._draw.ellipse(box, fill=ink)

    def box(
        self,
        row: float,
        column: float,
        size: tuple[float, float],
        colour: Rgba,
        *,
        radius: float = 0.0,
    ) -> None:
        """Fill a rectangle around a middle, with round corners [px]."""
        half = size[0] / 2 * FINER, size[1] / 2 * FINER
        x, y = _fine(column), _fine(row)
        around = (x - half[0], y - half[1], x + half[0], y + half[1])
        self._rounded(around, radius * FINER, colour)

    def _rounded(self, box: Box, radius: float, colour: Rgba) -> None:
        """Fill a rectangle of the sheet, with round corners."""
        ends = [(box[0], box[1]), (box[2], box[3])]
        self._lay(
            box,
            colour,
            lambda mask, moved: mask.rounded_rectangle(moved(ends), radius, fill=255),
        )

    def _lay(self, box: Box, colour: Rgba, shape: Callable[[Any, _Move], None]) -> None:
        """Lay a shape over what is drawn already; Pillow's own drawing replaces it.

        Args:
            box: Left, top, right, bottom of the shape, on the sheet.
            colour: Of the shape.
            shape: Draws it on a mask; its points are moved to the mask's own corner.
        """
        from PIL import Image as Pictures
        from PIL import ImageDraw

        left, top = max(int(box[0]) - 1, 0), max(int(box[1]) - 1, 0)
        width = min(int(box[2]) + 2, self._sheet.width) - left
        height = min(int(box[3]) + 2, self._sheet.height) - top
        if width < 1 or height < 1:
            return
        mask = Pictures.new("L", (width, height), 0)
        shape(ImageDraw.Draw(mask), lambda points: [(x - left, y - top) for x, y in points])
        patch = Pictures.new("RGBA", mask.size, (*colour[:3], 0))
        patch.putalpha(mask.point(lambda value: value * colour[3] // 255))
        self._sheet.alpha_composite(patch, (left, top))

    def paste(self, other: Canvas, *, left: int, top: int) -> None:
        """Lay another sheet over this one, its corner at a column and row [px]."""
        self._sheet.alpha_composite(other._sheet, (left * FINER, top * FINER))

    def round_off(self, radius: float) -> None:
        """Cut the sheet's corners round [px]."""
        from PIL import Image as Pictures
        from PIL import ImageChops, ImageDraw

        mask = Pictures.new("L", self._sheet.size, 0)
        right, bottom = (side - 1 for side in self._sheet.size)
        ImageDraw.Draw(mask).rounded_rectangle((0, 0, right, bottom), radius * FINER, fill=255)
        self._sheet.putalpha(ImageChops.multiply(self._sheet.getchannel("A"), mask))

    def fill(self, colour: Rgba) -> None:
        """Cover all of the sheet."""
        self._draw.rectangle((0, 0, *self._sheet.size), fill=colour)

    # Letters -------------------------------------------------------------------------------

    def text_size(self, words: str, *, share: float) -> tuple[float, float]:
        """Return width and height of words [px], as high as a share of the picture."""
        _, _, right, bottom = self._draw.textbbox((0, 0), words, font=self._font(share))
        return right / FINER, bottom / FINER

    def text(
        self,
        words: str,
        at: tuple[float, float],
        *,
        share: float,
        colour: Rgba = INK,
        plate: Rgba | None = PLATE,
        anchor: str = "mm",
    ) -> None:
        """Write words on a plate.

        Args:
            words: Several lines are centred.
            at: Row and column of their middle, or of what `anchor` says [px].
            share: Height of letters, share of the picture's height.
            colour: Of the letters.
            plate: Under them, or None.
            anchor: Which part of the words stands there, in Pillow's letters.
        """
        middle, font = (_fine(at[1]), _fine(at[0])), self._font(share)
        if plate is not None:
            around = self._around(words, at, share, anchor)
            self._written.append(around)
            radius = 0.8 * _PAD * font.size * 0.6
            self._rounded(around, radius, plate)
        self._draw.multiline_text(
            middle, words, fill=colour, font=font, anchor=anchor, align="center"
        )

    def is_free(self, words: str, at: tuple[float, float], *, share: float) -> bool:
        """Return whether words around a middle would lie on no other words; as in `text`."""
        left, top, right, bottom = self._around(words, at, share, "mm")
        return not any(
            left < other[2] and other[0] < right and top < other[3] and other[1] < bottom
            for other in self._written
        )

    def _around(self, words: str, at: tuple[float, float], share: float, anchor: str) -> Box:
        """Return left, top, right and bottom of the plate under words, on the sheet."""
        middle, font = (_fine(at[1]), _fine(at[0])), self._font(share)
        left, top, right, bottom = self._draw.multiline_textbbox(
            middle, words, font=font, anchor=anchor, align="center"
        )
        pad = _PAD * font.size * 0.6
        return left - pad, top - 0.7 * pad, right + pad, bottom + 0.7 * pad

    def plate(self, words: str, *, place: Place, share: float, colour: Rgba = INK) -> None:
        """Write words at a place of the picture; a second plate there comes beside the first."""
        width, height = self.text_size(words, share=share)
        pad = _PAD * self._font(share).size / FINER
        at = self.room(place, (width + 2 * pad, height + 2 * pad))
        self.text(words, at, share=share, colour=colour)

    def room(self, place: Place, size: tuple[float, float]) -> tuple[float, float]:
        """Return row and column of the middle of a thing at a place, clear of those before [px].

        Args:
            place: Where on the picture.
            size: Its width and height [px].
        """
        width, height = self.size
        gap = _GAP * height
        taken = self._taken.get(place, gap)
        self._taken[place] = taken + size[1] + 0.5 * gap
        row = taken + size[1] / 2
        if place.startswith("bottom"):
            row = height - row
        elif place == "middle":
            row += height / 2 - gap - size[1] / 2
        if place.endswith("left"):
            return row, gap + size[0] / 2
        return row, width - gap - size[0] / 2 if place.endswith("right") else width / 2

    def _font(self, share: float) -> Any:
        """Return the letters of a height."""
        return _letters(max(share * self.size[1], _LEAST) * FINER)

    # The picture ---------------------------------------------------------------------------

    def over(self, picture: Image) -> Image:
        """Return a picture with the sheet laid over it.

        Args:
            picture: sRGB-encoded, (h, w, 3) in [0, 1].
        """
        # Colours count by their opacity, or clear pixels would darken the borders of others.
        small = self._sheet.convert("RGBa").reduce(FINER)
        sheet = np.asarray(small, dtype=np.float32) / np.float32(255)
        return np.asarray(picture * (1.0 - sheet[..., 3:]) + sheet[..., :3], dtype=np.float32)


@lru_cache(maxsize=64)
def _letters(size: float) -> Any:
    """Return Pillow's own letters of a size [px]; the pictures' letters need FreeType."""
    from PIL import ImageFont

    # Capitals are about 0.72 of a letter's size high.
    return ImageFont.load_default(size / 0.72)


def _fine(place: float) -> float:
    """Return a row or column on the sheet; whole numbers are pixel centres."""
    return (place + 0.5) * FINER - 0.5


def _flat(points: Floats) -> list[tuple[float, float]]:
    """Return rows and columns as Pillow's x and y on the sheet."""
    fine: Sequence[Sequence[float]] = ((np.asarray(points) + 0.5) * FINER - 0.5).tolist()
    return [(column, row) for row, column in fine]


_STEPS = np.array(
    # red, green, blue
    [
        [214, 40, 40],
        [247, 127, 0],
        [252, 211, 77],
        [125, 190, 230],
        [40, 110, 200],
    ],
    dtype=np.float64,
)


def speed_colour(speed: float, scale: SpeedScale, *, alpha: float = 1.0) -> Rgba:
    """Return the colour of a speed.

    Args:
        speed: [m/s]; beyond the scale the colours of its ends hold.
        scale: Between which speeds colours run.
        alpha: Opacity, [0, 1].
    """
    share = (speed - scale.slowest) / (scale.fastest - scale.slowest)
    place = float(np.clip(np.nan_to_num(share), 0.0, 1.0)) * (len(_STEPS) - 1)
    red, green, blue = (
        round(float(np.interp(place, np.arange(len(_STEPS)), _STEPS[:, channel])))
        for channel in range(3)
    )
    return red, green, blue, round(255 * alpha)


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
