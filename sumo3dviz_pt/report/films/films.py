"""Measures a stored film frame by frame, alone or against another of the same scene.

Pixels are compared in units of white, so that exposure 0 and a lamp-lit night can be
read on one scale. What moves changes both films alike, so flicker of a pair is the
change of their difference: it needs no motion vectors.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import atomic_path
from sumo3dviz_pt.image import metrics
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.still import check_free
from sumo3dviz_pt.report.convergence.page import PAGE
from sumo3dviz_pt.report.convergence.plan import CAP, TRIM, PictureLook
from sumo3dviz_pt.report.films.page import (
    SharedFacts,
    Stored,
    find_frames,
    matched,
    write_film_page,
)
from sumo3dviz_pt.report.machine import check_extra
from sumo3dviz_pt.report.plots import pair_plot, time_plot

EMITTER = 40.0
"""Pixels brighter than this in either film show an emitter; the bias leaves them out [white]."""

ROWS, PLOT, WORST = "frames.csv", "over_time.png", "worst.png"

FrameRow = dict[str, str | int | float]
"""One frame's values by column; unknown is NaN."""

_ALONE_PANELS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "mean luminance [white]": {"luminance": "luminance"},
        "change from the frame before, pixel by pixel [8-bit codes]": {"change": "change"},
        "share of the energy that the firefly cap took [%]": {"capped_share": "capped share"},
    }
)
_BIAS = "difference of the mean radiance [%]"
_PAIR_PANELS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "FLIP": {"flip": "mean", "flip_p99": "99th percentile"},
        _BIAS: {"mean_bias": "bias"},
        "flicker of the difference [8-bit codes]": {"flicker": "flicker"},
        "mean luminance [white]": {"luminance": "frames", "other_luminance": "against"},
    }
)


_PERCENT: Mapping[str, float] = MappingProxyType({"capped_share": 100.0, "mean_bias": 100.0})
"""Columns that the plot shows in percent."""


@dataclass(frozen=True, slots=True, eq=False)
class FramePixels:
    """A frame's pixels.

    Attributes:
        radiance: In units of white, (h, w, 3).
        picture: sRGB-encoded, (h, w, 3) in [0, 1].
    """

    radiance: Image
    picture: Image


def report_film(
    place: Path,
    folder: Path,
    *,
    against: Path | None = None,
    overwrite: bool = False,
) -> Path:
    """Write frames.csv, over_time.png and report.md, and worst.png of a pair.

    Args:
        place: A folder of frames, or the film or its .json beside which it lies.
        folder: Where to; it is made.
        against: Another film that counts as the reference; its frames are matched by
            time, and both are developed as it is.
        overwrite: Whether a report that lies there is replaced.

    Returns:
        The page.

    Raises:
        ConfigError: If there are no frames, times or sizes do not match, a report lies there
            already, or a package of the extra `report` is missing.
        InputError: If a frame is damaged.
    """
    check_extra()
    if not overwrite:
        check_free(*(folder / name for name in (PAGE, ROWS, PLOT, WORST)))
    frames = find_frames(place)
    others = [] if against is None else find_frames(against)
    pairs = matched(frames, others) if others else []
    _make_folder(folder)
    if pairs:
        rows = _watched(_pair_rows(pairs, folder / WORST), len(frames))
    else:
        rows = _watched(alone_rows(frames), len(frames))
    _write_csv(folder / ROWS, rows)
    _draw(rows, _PAIR_PANELS if pairs else _ALONE_PANELS, folder / PLOT)
    films = [SharedFacts.of(some) for some in (frames, others) if some]
    return write_film_page(folder, films, rows)


def _make_folder(folder: Path) -> None:
    """Make the place for the report."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise ConfigError(f"{folder} is a file, not a folder", key="output") from error


def _watched(rows: Iterable[FrameRow], total: int) -> list[FrameRow]:
    """Return all rows; tells how far they are."""
    known: list[FrameRow] = []
    for row in rows:
        known.append(row)
        announce(Doing.MEASURE, len(known), total)
    return known


def alone_rows(frames: Sequence[Stored]) -> Iterator[FrameRow]:
    """Yield a film's frames one by one, each with its change from the one before."""
    before: Image | None = None
    for number, frame in enumerate(frames):
        shown = _shown(frame, frame)
        yield {
            **_identity(number, frame),
            "capped_share": frame.capped_share,
            "nonfinite": frame.nonfinite,
            "luminance": _luminance(shown),
            "change": _change(shown.picture, before),
        }
        before = shown.picture


@dataclass(frozen=True, slots=True, eq=False)
class _Worst:
    """The pair of frames that differ most.

    Attributes:
        flip: Mean FLIP between them.
        picture: The frame, (h, w, 3).
        other: What it is compared with, (h, w, 3).
        titles: Of both.
    """

    flip: float
    picture: Image
    other: Image
    titles: list[str]


def _pair_rows(pairs: Sequence[tuple[Stored, Stored]], worst_path: Path) -> Iterator[FrameRow]:
    """Yield a pair's frames one by one; draw the worst at last."""
    before: Image | None = None
    worst: _Worst | None = None
    for number, (frame, other) in enumerate(pairs):
        shown, wanted = _shown(frame, other), _shown(other, other)
        row, difference = pair_row(shown, wanted, before)
        if worst is None or float(row["flip"]) > worst.flip:
            titles = [f"{_label(some)} at {some.time:.12g} s" for some in (frame, other)]
            worst = _Worst(float(row["flip"]), shown.picture, wanted.picture, titles)
        yield {
            **_identity(number, frame),
            "other_quality": other.quality,
            "other_spp": other.spp,
            **row,
        }
        before = difference
    if worst is not None:
        pair_plot(worst.picture, worst.other, worst_path, titles=worst.titles)


def pair_row(
    shown: FramePixels, wanted: FramePixels, before: Image | None
) -> tuple[dict[str, float], Image]:
    """Return how far a frame is from its partner, and their difference.

    Args:
        shown: The frame.
        wanted: What it is compared with.
        before: The difference of the pair before, (h, w, 3); None at the first.

    Returns:
        Values by column, and the difference of the pictures, (h, w, 3).

    Raises:
        ConfigError: If the sizes differ.
    """
    _same_size(shown, wanted)
    errors = metrics.flip_map(shown.picture, wanted.picture)
    bright = np.maximum(shown.radiance, wanted.radiance).max(axis=-1) > EMITTER
    difference = shown.picture - wanted.picture
    values = {
        "luminance": _luminance(shown),
        "other_luminance": _luminance(wanted),
        "flip": float(errors.mean()),
        "flip_p99": float(np.percentile(errors, 99)),
        "psnr": metrics.psnr(shown.picture, wanted.picture),
        "ssim": metrics.ssim(shown.picture, wanted.picture),
        "rmse_capped": metrics.capped_rmse(shown.radiance, wanted.radiance, cap=CAP),
        "relmse_trim": metrics.relative_mse(shown.radiance, wanted.radiance, trim=TRIM),
        "mean_bias": metrics.mean_bias(shown.radiance, wanted.radiance, exempt=bright),
        "flicker": _change(difference, before),
    }
    return values, difference


def _same_size(shown: FramePixels, wanted: FramePixels) -> None:
    """Refuse to compare what cannot be laid one over the other."""
    if shown.picture.shape != wanted.picture.shape:
        (height, width), (tall, wide) = shown.picture.shape[:2], wanted.picture.shape[:2]
        raise ConfigError(
            f"the films differ in size: {width}x{height} and {wide}x{tall}", key="against"
        )


def _shown(frame: Stored, like: Stored) -> FramePixels:
    """Return a frame's pixels, developed as another one is."""
    radiance = frame.radiance()
    look = PictureLook(like.exposure, like.tone)
    return FramePixels(np.asarray(radiance / np.float32(look.white)), look.develop(radiance))


def _identity(number: int, frame: Stored) -> FrameRow:
    """Return what tells a frame from others."""
    return {"frame": number, "time": frame.time, "quality": frame.quality, "spp": frame.spp}


def _label(frame: Stored) -> str:
    """Return a film in a word or two."""
    return f"{frame.path.parent.name} ({frame.quality}, {frame.spp} spp)"


def _luminance(shown: FramePixels) -> float:
    """Return the mean luminance [white]."""
    return float((shown.radiance.reshape(-1, 3).mean(axis=0, dtype=np.float64)) @ LUMINANCE)


def _change(now: Image, before: Image | None) -> float:
    """Return the mean absolute change of pixels [8-bit codes]; NaN if there is nothing before."""
    if before is None:
        return float("nan")
    if now.shape != before.shape:
        raise ConfigError("the frames of a film differ in size", key="frames")
    return float(255.0 * np.abs(now - before).mean(dtype=np.float64))


def _write_csv(path: Path, rows: Sequence[FrameRow]) -> None:
    """Write all rows."""
    with atomic_path(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _draw(rows: Sequence[FrameRow], panels: Mapping[str, Mapping[str, str]], path: Path) -> None:
    """Draw the plot over time; series of which nothing is known are left out."""
    series = {
        title: {
            name: [_PERCENT.get(column, 1.0) * float(row[column]) for row in rows]
            for column, name in columns.items()
            if any(row[column] == row[column] for row in rows)
        }
        for title, columns in panels.items()
    }
    known = {title: named for title, named in series.items() if named}
    time_plot([float(row["time"]) for row in rows], known, path, signed=[_BIAS])
