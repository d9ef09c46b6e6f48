"""Finds a film's stored frames, and writes the page about them, or about those of two films."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.pipeline.films.film import FILM_SUFFIXES
from sumo3dviz_pt.pipeline.films.frames import frames_folder, read_account, stored_film
from sumo3dviz_pt.pipeline.films.traced import Shelf
from sumo3dviz_pt.report.convergence.page import PAGE, write_text
from sumo3dviz_pt.report.convergence.table import markdown

SAME_TIME = 1e-6
"""Times that differ by less are one [s]."""


@dataclass(frozen=True, slots=True)
class Stored:
    """A stored frame.

    Attributes:
        path: Its file.
        time: SUMO's time [s].
        exposure: EV at which to develop it.
        tone: Tone curve's name.
        camera: Its name.
        seed: Of the scene and its samples; -1 if unknown.
        spp: Samples per pixel.
        quality: Preset's name.
        capped_share: Energy that the firefly cap took over all energy; NaN if unknown.
        nonfinite: Broken values found while rendering; NaN if unknown.
        versions: What rendered it.
        shelf: Finishes it, with its neighbours' help where it is stored as it was traced.
    """

    path: Path
    time: float
    exposure: float
    tone: str
    camera: str
    seed: int
    spp: int
    quality: str
    capped_share: float
    nonfinite: float
    versions: Mapping[str, str]
    shelf: Shelf

    def radiance(self) -> Image:
        """Its finished pixels, (h, w, 3), finite.

        Raises:
            InputError: If the file cannot be read or holds broken values.
        """
        radiance = self.shelf.helped(self.path).finished()
        broken = radiance.size - int(np.count_nonzero(np.isfinite(radiance)))
        if broken:
            raise InputError(f"{broken} values are not finite", file=self.path)
        return radiance


def find_frames(place: Path) -> list[Stored]:
    """Find the frames of a film, in order of time.

    Args:
        place: Their folder, or the film or its .json beside which it lies.

    Raises:
        ConfigError: If there is no such place, or no frame in it.
        InputError: If a frame is damaged, does not say what it is, or is another film's.
    """
    folder = _folder_of(place)
    if not any(folder.glob("*.exr")):
        raise ConfigError(f"{folder} holds no .exr frames", key="frames")
    files = stored_film(folder).files
    shelf = Shelf()
    frames = sorted((_stored(path, shelf) for path in files), key=lambda frame: frame.time)
    for one, other in pairwise(frames):
        if other.time - one.time < SAME_TIME:
            both = f"{one.path.name} and {other.path.name}"
            raise ConfigError(f"{folder}: {both} both show {one.time:.12g} s", key="frames")
    return frames


def _folder_of(place: Path) -> Path:
    """Return the folder of frames that a user means."""
    if place.is_dir():
        return place
    folder = frames_folder(place)
    if place.suffix.lower() in (*FILM_SUFFIXES, ".json") and folder.is_dir():
        return folder
    if place.exists():
        raise ConfigError(f"{place} is no folder of frames, nor lies one beside it", key="frames")
    raise ConfigError(f"there is no {place}", key="frames")


def _stored(path: Path, shelf: Shelf) -> Stored:
    """Read the account that is stored in a frame."""
    account = read_account(path)
    try:
        return Stored(
            path,
            time=float(account["time"]),
            exposure=float(account.get("exposure", 0.0)),
            tone=str(account.get("tone", "neutral")),
            camera=str(account.get("camera", "")),
            seed=int(account.get("seed", -1)),
            spp=int(account.get("spp", 0)),
            quality=str(account.get("quality", "")),
            capped_share=float(account.get("capped_share", "nan")),
            nonfinite=float(account.get("nonfinite", "nan")),
            versions=dict(account.get("versions", {})),
            shelf=shelf,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("does not say which time it shows", file=path) from error


def matched(frames: Sequence[Stored], others: Sequence[Stored]) -> list[tuple[Stored, Stored]]:
    """Pair frames of one time.

    Args:
        frames: Of a film, in order of time, at least one.
        others: Of another.

    Raises:
        ConfigError: If a frame of either has no partner.
    """
    for own, wanted in ((frames, others), (others, frames)):
        lonely = _first_lonely(own, wanted)
        if lonely is not None:
            spans = f"{_span(frames)}, but {_span(others)}"
            alone = f"{lonely.path.name} of {lonely.path.parent.name} has no partner"
            raise ConfigError(f"the films show different times: {spans}; {alone}", key="against")
    return list(zip(frames, others, strict=True))


def _first_lonely(frames: Sequence[Stored], others: Sequence[Stored]) -> Stored | None:
    """Return the first frame without a partner of its time."""
    times = np.array([other.time for other in others])
    return next((frame for frame in frames if np.abs(times - frame.time).min() >= SAME_TIME), None)


def _span(frames: Sequence[Stored]) -> str:
    """Say how many frames there are, from when to when."""
    first, last = frames[0], frames[-1]
    name = first.path.parent.name
    return f"{name} has {len(frames)} frames from {first.time:.12g} s to {last.time:.12g} s"


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
class SharedFacts:
    """What all frames of a film share; several values are listed.

    Attributes:
        facts: Names and values.
    """

    facts: Mapping[str, str]

    @classmethod
    def of(cls, frames: Sequence[Stored]) -> SharedFacts:
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


def write_film_page(folder: Path, films: Sequence[SharedFacts], rows: Sequence[FrameRow]) -> Path:
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


def _about(films: Sequence[SharedFacts]) -> list[str]:
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
