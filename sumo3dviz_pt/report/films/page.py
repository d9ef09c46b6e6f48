"""Writes the page about a film's frames, or about two films."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.report.convergence.page import PAGE, write_text
from sumo3dviz_pt.report.convergence.table import markdown
from sumo3dviz_pt.report.films.stored import Stored

FrameRow = Mapping[str, str | int | float]

MOST_LINES = 60
"""A longer film's table shows its worst frames only."""

_FORMS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "frame": ("frame", "d"),
        "time": ("time [s]", "g"),
        "capped_share": ("capped share", ".3%"),
        "nonfinite": ("broken values", ".0f"),
        "luminance": ("luminance [white]", ".4g"),
        "other_luminance": ("luminance against", ".4g"),
        "change": ("change [codes]", ".2f"),
        "flip": ("FLIP", ".4f"),
        "flip_p99": ("FLIP p99", ".3f"),
        "psnr": ("PSNR [dB]", ".1f"),
        "ssim": ("SSIM", ".3f"),
        "rmse_capped": ("capped RMSE", ".3g"),
        "relmse_trim": ("relMSE trimmed", ".3g"),
        "mean_bias": ("bias", "+.2%"),
        "flicker": ("flicker [codes]", ".2f"),
    }
)
_UNLIKE: Mapping[str, str] = MappingProxyType(
    {
        "camera": "this compares two views, no errors",
        "seed": "models, colours and scenery depend on it, so most of this is no noise",
        "exposure [EV]": "both are developed as the second",
        "tone curve": "both are developed as the second",
    }
)
"""What two films should share, and what follows if they do not."""

_BETTER_HIGH = frozenset({"psnr", "ssim"})
_NO_WORST = frozenset({"frame", "time", "luminance", "other_luminance"})


@dataclass(frozen=True, slots=True)
class FilmFacts:
    """What all frames of a film share; several values are listed.

    Attributes:
        facts: Names and values.
    """

    facts: Mapping[str, str]

    @classmethod
    def of(cls, frames: Sequence[Stored]) -> FilmFacts:
        """Return what stored frames have in common."""
        versions = sorted({
            f"{name} {number}" for frame in frames for name, number in frame.versions.items()
        })  # fmt: skip
        return cls(
            {
                "frames": f"{len(frames)} of {frames[0].path.parent.name}",
                "time [s]": f"{frames[0].time:.12g} to {frames[-1].time:.12g}",
                "camera": _listed(frame.camera for frame in frames),
                "seed": _listed(str(frame.seed) for frame in frames if frame.seed >= 0),
                "preset": _listed(frame.quality for frame in frames),
                "spp": _listed(str(frame.spp) for frame in frames),
                "exposure [EV]": _listed(f"{frame.exposure:g}" for frame in frames),
                "tone curve": _listed(frame.tone for frame in frames),
                "versions": ", ".join(versions) or "-",
            }
        )


def _listed(values: Iterable[str]) -> str:
    """Return each value once, in words."""
    return ", ".join(sorted({value for value in values if value})) or "-"


def write_film_page(folder: Path, films: Sequence[FilmFacts], rows: Sequence[FrameRow]) -> Path:
    """Write report.md about the frames of one film, or of two.

    Args:
        folder: Where to; its plots are shown.
        films: The film, and what it is compared with.
        rows: Values by frame, at least one; a pair has a column `flip`.

    Returns:
        The page.
    """
    pair = len(films) > 1
    title = "# Two films compared" if pair else "# A film's frames"
    worst = ["", "![The worst frame](worst.png)", "", "The frame of largest FLIP."] if pair else []
    lines = [
        title, "", *_about(films), "",
        "## Over all frames", "", *_overall(rows), "",
        "![Over time](over_time.png)", *worst, "",
        "## Frames", "", *_frames(rows, "flip" if pair else "change"), "",
        *_legend(pair=pair),
    ]  # fmt: skip
    return write_text(folder / PAGE, lines)


def _about(films: Sequence[FilmFacts]) -> list[str]:
    """Return what the films are, and what else than noise may tell them apart."""
    titles = ["what", "frames", "against"][: len(films) + 1]
    names = list(films[0].facts)
    table = markdown(titles, [[name, *(film.facts[name] for film in films)] for name in names])
    if len(films) < 2:
        return table
    one, other = (film.facts for film in films)
    return table + [
        line
        for name, meaning in _UNLIKE.items()
        if one[name] != other[name]
        for line in ("", f"They differ in {name}: {meaning}.")
    ]


def _overall(rows: Sequence[FrameRow]) -> list[str]:
    """Return the median and worst of every measure."""
    lines = []
    for column, (title, form) in _FORMS.items():
        if column not in rows[0] or column in ("frame", "time"):
            continue
        values = np.array([float(row[column]) for row in rows])
        if np.isnan(values).all():
            continue
        middle = f"{np.nanmedian(values):{form}}"
        if column in _NO_WORST:
            lines.append([title, middle, f"{values.min():{form}} to {values.max():{form}}", "-"])
            continue
        place = _worst(values, column)
        lines.append([title, middle, f"{values[place]:{form}}", f"{float(rows[place]['time']):g}"])
    return markdown(["measure", "median", "worst or range", "at [s]"], lines)


def _worst(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]], column: str) -> int:
    """Return the index of the worst frame."""
    if column in _BETTER_HIGH:
        return int(np.nanargmin(values))
    return int(np.nanargmax(np.abs(values)))


def _frames(rows: Sequence[FrameRow], key: str) -> list[str]:
    """Return a line for every frame, or for the worst of a long film."""
    columns = [column for column in rows[0] if any(row[column] == row[column] for row in rows)]
    shown, note = list(rows), []
    if len(rows) > MOST_LINES:
        by_error = sorted(rows, key=lambda row: -np.nan_to_num(float(row[key]), nan=-1.0))
        shown = by_error[: MOST_LINES // 3]
        note = [f"The {len(shown)} worst of {len(rows)} frames; frames.csv holds all.", ""]
    titles = [
        _FORMS[column][0] if column in _FORMS else column.replace("_", " ") for column in columns
    ]
    return [*note, *markdown(titles, [[_cell(row, column) for column in columns] for row in shown])]


def _cell(row: FrameRow, column: str) -> str:
    """Return a value as the table shows it."""
    value = row[column]
    if value != value or value == "":
        return "-"
    return f"{value:{_FORMS[column][1]}}" if column in _FORMS else str(value)


def _legend(*, pair: bool) -> list[str]:
    """Return what the columns mean."""
    about_pair = (
        "FLIP, PSNR and SSIM are of developed pictures, at 67 pixels a degree; capped RMSE (cut"
        " at 4 x white) and relMSE (without its worst 0.1 %) of radiance in units of white. Bias is"
        " that of the mean radiance where neither film is brighter than 40 x white. Flicker is the"
        " mean change of the two pictures' difference from frame to frame, in 8-bit codes: what"
        " truly moves is in both and cancels."
    )
    about_one = (
        "Change is the mean absolute difference of pixels from the frame before, in 8-bit codes:"
        " motion and noise together. Luminance is the mean over the frame, where 1 is white at the"
        " film's exposure. Capped share is the part of the energy that the firefly cap took."
    )
    return ["## Columns", "", about_pair if pair else about_one]
