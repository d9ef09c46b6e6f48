"""Writes what goes with the finished films of a study: tables, tools' files, pictures, digests.

There is a small picture of every film, and all of them on one sheet. A choice card is one film with
the alternatives of a task, side by side, with their letters.

For a photometer there is a clip of grey steps, a checker and a frame counter.
`calibration/clip.mp4` begins with a chart, then fills the picture with one grey after the other.
Every frame has its number, and a square in a corner that is white in even frames and black in odd
ones, so that a photodiode counts what a screen drops. `calibration/clip.json` says when which grey
is seen, and its luminance on a screen with the assumed white and sRGB's curve.

References:
    IEC 61966-2-1:1999 (sRGB's curve).
"""

from __future__ import annotations

import hashlib
import json
import logging
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.image.png import write_png
from sumo3dviz_pt.job.settings import OutputSettings
from sumo3dviz_pt.job.study import CalibrationSettings, StudySettings
from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.pipeline.films.frames import account_file
from sumo3dviz_pt.pipeline.films.heard import has_soundtrack, is_heard
from sumo3dviz_pt.pipeline.films.overlays import extra_files
from sumo3dviz_pt.pipeline.films.sound import recording_file, sound_folder
from sumo3dviz_pt.pipeline.provenance import versions
from sumo3dviz_pt.studies.designs.trials import Trial
from sumo3dviz_pt.studies.file import session_of, texts_of, words_of
from sumo3dviz_pt.studies.folder import FOLDER
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.records import MATERIALS, FilmRecord, film_path
from sumo3dviz_pt.studies.stimuli import Stimulus, told_only
from sumo3dviz_pt.studies.tools.content import (
    WRITERS,
    Clip,
    Screen,
    StudyContent,
    letter,
    trial_name,
)
from sumo3dviz_pt.studies.tools.datasets import (
    CHECKSUMS,
    digest_of,
    read_digests,
    write_checksums,
    write_citation,
    write_inputs,
)
from sumo3dviz_pt.studies.tools.pages import write_sheet
from sumo3dviz_pt.studies.tools.surveys import write_tools

if TYPE_CHECKING:
    from sumo3dviz_pt.overlays.canvas import Canvas


CALIBRATION_FOLDER = "calibration"
GREYS = (0, 16, 32, 48, 64, 96, 128, 160, 192, 224, 240, 255)
"""sRGB codes that fill the picture, one after the other."""

_CHART_SECONDS = 3.0
_WEDGE = 16  # steps of the chart's wedge
_COLOURS = ((255, 0, 0), (0, 255, 0), (0, 0, 255), (0, 255, 255), (255, 0, 255), (255, 255, 0))
_CALIBRATION_GREY = 94  # between two steps of the wedge
_CHECKS = (12, 2, 1)  # widths of the checkers' squares [px]
_FLAG = 0.08  # of the square for a photodiode, share of the picture's height
_CALIBRATION_LETTERS = 0.035

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

    place = folder / CALIBRATION_FOLDER
    place.mkdir(exist_ok=True)
    clip, picture, note = place / "clip.mp4", place / "chart.png", place / "clip.json"
    encode(clip_frames(wanted, output.size, output.fps), clip, size=output.size, fps=output.fps)
    write_png(picture, chart(output.size), level=6)
    write_atomically(note, json.dumps(account(wanted, output.size, output.fps), indent=1) + "\n")
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
    begin = _calibration_frames(_CHART_SECONDS, rate)
    for code in GREYS:
        count = _calibration_frames(wanted.seconds, rate)
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
        "chart": {"first_frame": 0, "last_frame": _calibration_frames(_CHART_SECONDS, rate) - 1},
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
    pixels = np.full((height, width, 3), _CALIBRATION_GREY, dtype=np.uint8)
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
    yield chart(size), _calibration_frames(_CHART_SECONDS, rate)
    width, height = size
    for code in GREYS:
        grey = np.full((height, width, 3), code, dtype=np.uint8)
        yield grey, _calibration_frames(wanted.seconds, rate)


def _calibration_frames(seconds: float, rate: Fraction) -> int:
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
        share=_CALIBRATION_LETTERS,
        colour=rgba("#000000" if bright else "#ffffff"),
        plate=None,
    )
    drawn = canvas.over(np.asarray(picture / 255, dtype=np.float32))
    marked = (drawn * 255 + 0.5).astype(np.uint8)
    marked[height - side :, :side] = 0 if number % 2 else 255
    return marked


_WIDTH = 320
_THUMBNAILS_GAP = 8
_THUMBNAILS_GREY = 119
"""sRGB of the sheet's ground: between films, as light as the page that shows them."""

_LEAST_PLACE = 240
"""Width of a picture's place on the sheet, at least: most names fit into a line [px]."""

_CAPITALS, _LINE = 11, 20
"""Heights of the names' capitals and of a line [px]."""

THUMBNAILS_FOLDER = "thumbnails"
SHEET = "contact_sheet.png"


def write_thumbnails(folder: Path, clips: Sequence[Clip]) -> list[Path]:
    """Write the middle picture of each film, and the sheet of all; return the files.

    Args:
        folder: The study's.
        clips: Its films, in the order of the sheet.
    """
    from sumo3dviz_pt.video.ffmpeg import film_picture

    (folder / THUMBNAILS_FOLDER).mkdir(exist_ok=True)
    pictures, files = [], []
    for clip in clips:
        width, height = clip.size
        size = (min(width, _WIDTH), max(round(height * min(width, _WIDTH) / width), 1))
        pixels = film_picture(folder / clip.file, _middle(clip), size=size)
        files.append(folder / THUMBNAILS_FOLDER / f"{clip.name}.png")
        write_png(files[-1], pixels, level=6)
        pictures.append(pixels)
    write_png(folder / SHEET, sheet(pictures, [clip.name for clip in clips]), level=6)
    return [*files, folder / SHEET]


def sheet(pictures: Sequence[Pixels], names: Sequence[str]) -> Pixels:
    """Return pictures side by side in rows, each with its name below it, (h, w, 3).

    Args:
        pictures: (h, w, 3) each; smaller ones stand at the upper left of their places.
        names: Of each; what is too long for its place goes on in the next line.
    """
    from sumo3dviz_pt.overlays.canvas import Canvas

    columns = math.ceil(math.sqrt(len(pictures)))
    rows = math.ceil(len(pictures) / columns)
    widest = max(_LEAST_PLACE, *(picture.shape[1] for picture in pictures))
    below = [_lines(name, widest) for name in names]
    letters = max(map(len, below)) * _LINE
    highest = max(len(picture) for picture in pictures)
    high, wide = highest + letters + _THUMBNAILS_GAP, widest + _THUMBNAILS_GAP
    size = (columns * wide + _THUMBNAILS_GAP, rows * high + _THUMBNAILS_GAP)
    canvas = Canvas(size)
    whole = np.full((*size[::-1], 3), _THUMBNAILS_GREY, dtype=np.uint8)
    for place, (picture, lines) in enumerate(zip(pictures, below, strict=True)):
        top = _THUMBNAILS_GAP + place // columns * high
        left = _THUMBNAILS_GAP + place % columns * wide
        whole[top : top + len(picture), left : left + picture.shape[1]] = picture
        for k, line in enumerate(lines):
            at = (top + len(picture) + (k + 0.5) * _LINE, left)
            canvas.text(line, at, share=_CAPITALS / size[1], plate=None, anchor="lm")
    return np.asarray(
        (canvas.over(np.asarray(whole / 255, dtype=np.float32)) * 255 + 0.5).astype(np.uint8)
    )


def _lines(name: str, width: int) -> list[str]:
    """Return a name in lines that fit a width [px], broken after a `_` where that can be."""
    from sumo3dviz_pt.overlays.canvas import Canvas

    canvas = Canvas((width, width))
    lines, rest = [], name
    while rest:
        fit = len(rest)
        while fit > 1 and canvas.text_size(rest[:fit], share=_CAPITALS / width)[0] > width:
            fit -= 1
        cut = rest.rfind("_", 1, fit) + 1 if fit < len(rest) else fit
        lines.append(rest[: cut or fit])
        rest = rest[cut or fit :]
    return lines


def _middle(clip: Clip) -> float:
    """Return the time of a film's middle picture [s]."""
    from fractions import Fraction

    rate = Fraction(clip.rate)
    frames = max(round(clip.duration * rate), 1)
    return float(Fraction(frames // 2) / rate)


CARDS_FOLDER = "cards"
_NO_NAME = re.compile(r"[^A-Za-z0-9._-]+")
_CARDS_GREY = 119
_CARDS_GAP = 0.02  # between films, share of the card's width
_STRIP = 0.09  # above films, for the letters, share of the card's width
_CARDS_LETTERS = 0.5  # height of letters, share of the strip's


def write_cards(folder: Path, content: StudyContent) -> Mapping[str, str]:
    """Write a card for each task of several films.

    Args:
        folder: The study's, with its films.
        content: Trials, and their films.

    Returns:
        The card's file by the trial's name, relative to the folder.
    """
    files, names = {}, card_names(content.trials)
    for trial in content.trials:
        clips = [None if each is None else content.clips[each] for each in trial.alternatives]
        if sum(clip is not None for clip in clips) < 2:
            continue
        file = f"{MATERIALS}/{CARDS_FOLDER}/{names[trial_name(trial)]}.mp4"
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        write_card(folder, clips, folder / file)
        files[trial_name(trial)] = file
    return files


_LONGEST_CARD = 80
"""Characters of a task that stand in its card's name."""


def card_names(trials: Sequence[Trial]) -> dict[str, str]:
    """Return what cards are called, by the trial's name, which another tool's table may say.

    Names are letters, digits, hyphens, dots and underscores that no other name has, in whatever
    capitals: some systems know no others. What was changed for that has a digest.
    """
    names = [trial_name(trial) for trial in trials]
    plain = {name: _NO_NAME.sub("-", name)[:_LONGEST_CARD].rstrip(".") for name in names}
    lowered = Counter(each.lower() for each in plain.values())
    return {
        name: each
        if each == name and lowered[each.lower()] == 1
        else f"{each}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
        for name, each in plain.items()
    }


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
    frames = _cards_frames([folder / clip.file for _, clip in shown], ground, cell)
    encode(frames, path, size=size, fps=first.rate)


def card_size(size: tuple[int, int], count: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the size of a card and of each film on it [px], all even.

    Args:
        size: Of the films; a card is as wide as two of them beside a gap would be, at most.
        count: Films on the card.
    """
    width = 2 * size[0] if count > 1 else size[0]
    gap = _even(_CARDS_GAP * width)
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
        canvas.text(name, middle, share=_CARDS_LETTERS * top / height, plate=None)
    plain = np.full((height, width, 3), _CARDS_GREY / 255, dtype=np.float32)
    return np.asarray((canvas.over(plain) * 255 + 0.5).astype(np.uint8))


def _cards_frames(films: Sequence[Path], ground: Pixels, cell: tuple[int, int]) -> Iterator[Pixels]:
    """Yield the card's frames."""
    from sumo3dviz_pt.video.ffmpeg import film_pictures

    height, width = ground.shape[:2]
    places = _places((width, height), cell, len(films))
    card = ground.copy()
    for pictures in zip_longest(*(film_pictures(film, size=cell) for film in films)):
        for (top, left), picture in zip(places, pictures, strict=True):
            if picture is not None:
                card[top : top + cell[1], left : left + cell[0]] = picture
        yield card.copy()


log = logging.getLogger(__name__)


def cards_of(folder: Path, plan: StudyPlan, films: Mapping[str, FilmRecord]) -> Mapping[str, str]:
    """Write the choice cards of a study, if it wants any; return their files by trial.

    Args:
        folder: The study's.
        plan: What its films show.
        films: All of them, finished.
    """
    wanted = plan.file.settings.tools.cards
    return write_cards(folder, content_of(plan, films)) if wanted else {}


def write_outputs(
    folder: Path,
    plan: StudyPlan,
    films: Mapping[str, FilmRecord],
    *,
    cards: Mapping[str, str] = MappingProxyType({}),
    also: Sequence[Path] = (),
    seal: Callable[[Sequence[Path]], None] | None = None,
) -> list[Path]:
    """Write all files that go with films; files of an earlier run that are no more are removed.

    Args:
        folder: The study's.
        plan: What its films show.
        films: All of them, finished.
        cards: Its choice cards, as `cards_of` wrote them.
        also: Further files that count among its outputs.
        seal: Is called with all files before their digests are written, and may change some.

    Returns:
        All files of the study.
    """
    before = read_digests(folder / CHECKSUMS)
    content = replace(content_of(plan, films), cards=cards)
    files = [*also, *_film_files(folder, plan)]
    files += [folder / card for card in content.cards.values()]
    files += write_thumbnails(folder, content.films)
    pictures = {clip.name: f"{THUMBNAILS_FOLDER}/{clip.name}.png" for clip in content.films}
    files.append(write_sheet(folder, content, pictures))
    files += write_tools(folder, content, plan.file.settings.tools.write)
    files += write_calibration(folder, plan.file.settings.calibration, plan.stimuli[0].job.output)
    files.append(write_citation(folder, content.words, version=versions()["sumo3dviz_pt"]))
    files.append(
        write_inputs(folder, [path for path in also if path.is_relative_to(folder / FOLDER)])
    )
    if content.url is None and any(WRITERS[tool].online for tool in plan.file.settings.tools.write):
        log.info("files of LimeSurvey and Qualtrics need tools.url, where the films lie online")
    if seal is not None:
        seal(files)
    files.append(write_checksums(folder, files))
    _remove_stale(folder, before, files)
    return files


def content_of(plan: StudyPlan, films: Mapping[str, FilmRecord]) -> StudyContent:
    """Return what the files of tools are made from.

    Args:
        plan: The study's.
        films: All of them, finished.
    """
    settings = plan.file.settings
    url = settings.tools.url
    clips = {
        stimulus.name: _clip(plan, films[stimulus.name], stimulus) for stimulus in plan.stimuli
    }
    shown = sorted(plan.profiles, key=plan.place)
    return StudyContent(
        factors={name: factor.about for name, factor in settings.factors.items()},
        levels=plan.file.levels,
        clips={profile: clips[plan.films[profile].name] for profile in shown},
        trials=plan.trials,
        playlists=plan.playlists,
        words=words_of(settings),
        url=None if url is None else f"{url.rstrip('/')}/",
        jspsych=settings.tools.jspsych,
        notes=plan.notes,
        screen=_screen(settings),
        session=session_of(settings, plan.file.path.parent),
        ranks=plan.file.ranks,
        told=tuple(name for name in settings.factors if told_only(plan.file, name)),
    )


def _clip(plan: StudyPlan, film: FilmRecord, stimulus: Stimulus) -> Clip:
    """Return a film as tools know it."""
    name = stimulus.name
    file = f"{MATERIALS}/{name}{plan.file.settings.film}"
    return Clip(
        name,
        stimulus.code,
        file,
        film.duration,
        film.size,
        film.rate,
        film.sha256,
        film.fov,
        has_soundtrack(stimulus.job, Path(file)),
    )


def _screen(settings: StudySettings) -> Screen | None:
    """Return how films get their right size."""
    wanted = settings.tools.screen
    if wanted is None:
        return None
    instruction = wanted.instruction or texts_of(settings).page["screen"]
    return Screen(wanted.distance, wanted.pixels_per_cm, instruction)


def _film_files(folder: Path, plan: StudyPlan) -> list[Path]:
    """Return the films and all that lies beside them, but for their frames."""
    files: list[Path] = []
    for stimulus in plan.stimuli:
        path = film_path(folder, plan, stimulus)
        files += [path, account_file(path), *extra_files(path, stimulus.job.overlays)]
        if stimulus.job.output.sound is not None:
            files += sorted(sound_folder(path).iterdir())
        files += [recording_file(path)] if is_heard(stimulus.job) else []
    return files


def _remove_stale(folder: Path, before: Mapping[str, str], files: Sequence[Path]) -> None:
    """Remove what an earlier run wrote, this one did not and nobody changed; films stay."""
    now = {file.relative_to(folder).as_posix() for file in files}
    for name, digest in before.items():
        path = folder / name
        inside = path.resolve().is_relative_to(folder.resolve())
        if name in now or not inside or not path.is_file():
            continue
        if name.startswith(f"{MATERIALS}/"):
            if path.suffix != ".json":
                log.warning("%s: the study shows this film no longer; it is kept", path)
        elif digest_of(path) == digest:
            path.unlink()
