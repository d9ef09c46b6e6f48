"""Choice cards: the alternatives of a task as one film, side by side, with their letters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.experiments.tools.content import Clip, StudyContent, letter, trial_name
from sumo3dviz_pt.pipeline.studies.records import MATERIALS

if TYPE_CHECKING:
    from sumo3dviz_pt.overlays.canvas import Canvas

FOLDER = "cards"
_GREY = 119
_GAP = 0.02  # between films, share of the card's width
_STRIP = 0.09  # above films, for the letters, share of the card's width
_LETTERS = 0.5  # height of letters, share of the strip's

Pixels = NDArray[np.uint8]


def write_cards(folder: Path, content: StudyContent) -> Mapping[str, str]:
    """Write a card for each task of several films.

    Args:
        folder: The study's, with its films.
        content: Trials, and their films.

    Returns:
        The card's file by the trial's name, relative to the folder.
    """
    found = {}
    for trial in content.trials:
        clips = [None if each is None else content.clips[each] for each in trial.alternatives]
        if sum(clip is not None for clip in clips) < 2:
            continue
        file = f"{MATERIALS}/{FOLDER}/{trial_name(trial)}.mp4"
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        write_card(folder, clips, folder / file)
        found[trial_name(trial)] = file
    return found


def write_card(folder: Path, clips: Sequence[Clip | None], path: Path) -> None:
    """Write one card; a film that ends before the others keeps its last picture.

    Args:
        folder: The study's.
        clips: By place; None, which chooses nothing, has no film but counts for the letters.
        path: The card.
    """
    from sumo3dviz_pt.video import encode

    shown = [(letter(place), clip) for place, clip in enumerate(clips) if clip is not None]
    first = shown[0][1]
    size, cell = card_size(first.size, len(shown))
    ground = _ground([name for name, _ in shown], size, cell)
    frames = _frames([folder / clip.file for _, clip in shown], ground, cell)
    encode(frames, path, size=size, fps=first.rate)


def card_size(size: tuple[int, int], count: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the size of a card and of each film on it [px], all even.

    Args:
        size: Of the films; a card is as wide as two of them beside a gap would be, at most.
        count: Films on the card.
    """
    width = 2 * size[0] if count > 1 else size[0]
    gap = _even(_GAP * width)
    wide = _even((width - (count + 1) * gap) / count)
    cell = (wide, _even(wide * size[1] / size[0]))
    return (count * wide + (count + 1) * gap, _even(_STRIP * width) + cell[1] + gap), cell


def _even(value: float) -> int:
    """Return the nearest even number, 2 at least."""
    return max(2 * round(value / 2), 2)


def _places(size: tuple[int, int], cell: tuple[int, int], count: int) -> list[tuple[int, int]]:
    """Return the row and column of the upper left corner of each film."""
    gap = (size[0] - count * cell[0]) // (count + 1)
    top = size[1] - cell[1] - gap
    return [(top, gap + place * (cell[0] + gap)) for place in range(count)]


def _ground(names: Sequence[str], size: tuple[int, int], cell: tuple[int, int]) -> Pixels:
    """Return a card without its films, (h, w, 3)."""
    from sumo3dviz_pt.overlays.canvas import Canvas

    width, height = size
    canvas: Canvas = Canvas(size)
    for name, (top, left) in zip(names, _places(size, cell, len(names)), strict=True):
        middle = (top / 2, left + cell[0] / 2)
        canvas.text(name, middle, share=_LETTERS * top / height, plate=None)
    plain = np.full((height, width, 3), _GREY / 255, dtype=np.float32)
    return np.asarray((canvas.over(plain) * 255 + 0.5).astype(np.uint8))


def _frames(films: Sequence[Path], ground: Pixels, cell: tuple[int, int]) -> Iterator[Pixels]:
    """Yield the card's frames."""
    from sumo3dviz_pt.video.picture import film_pictures

    height, width = ground.shape[:2]
    places = _places((width, height), cell, len(films))
    card = ground.copy()
    for pictures in zip_longest(*(film_pictures(film, size=cell) for film in films)):
        for (top, left), picture in zip(places, pictures, strict=True):
            if picture is not None:
                card[top : top + cell[1], left : left + cell[0]] = picture
        yield card.copy()
