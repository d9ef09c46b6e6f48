"""Which things people look at: gaze samples over films become hits, dwell and first fixations.

The layer `instance` of the stored frames says whose a pixel is, so nothing is guessed:

* a sample hits the thing whose pixel it lies on, in the frame that is shown then; where a radius is
  asked for, for what the eye tracker may be off, the nearest thing with an outline within it;
* it lasts until the next sample of the same person and film, at most a tenth of a second;
* dwell: how long all samples last that hit a thing;
* a fixation is taken as gaze that rests on one thing for at least a tenth of a second (another
  time may be asked for), without longer breaks than that. It is one of areas of interest: eye
  movements within a thing end none, as those that speed finds would.

References:
    Holmqvist and Andersson, "Eye tracking: A comprehensive guide to methods, paradigms and
    measures", 2nd edition, 2017 (dwells, hits and fixations of areas of interest).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.image.layers import SURFACES, boxes_2d
from sumo3dviz_pt.job.errors import settle
from sumo3dviz_pt.job.values import Finite, Seconds
from sumo3dviz_pt.model.layers import Thing
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.films.frames import frames_folder
from sumo3dviz_pt.pipeline.films.layers import beside, said_file
from sumo3dviz_pt.pipeline.films.stored_layers import FrameLayers, read_frame
from sumo3dviz_pt.studies.certificate.evidence import COUNTED
from sumo3dviz_pt.studies.measured.tables import Cells, film_named, number_in, read_rows
from sumo3dviz_pt.studies.measured.traffic import Row
from sumo3dviz_pt.studies.records import MATERIALS, read_film_account
from sumo3dviz_pt.studies.tools.content import write_table

LONGEST = 0.1
"""A sample lasts no longer than this, whenever the next one comes [s]."""

NOWHERE, OUTSIDE = "", "outside"
"""Names of what samples hit that have no place, and that lie beside the picture or the film."""

_FILMS = (".mp4", ".webm", ".mov")
_COLUMNS = ("film", "time", "x", "y")

_Length = Annotated[Finite, Field(ge=0, le=10_000)]


@dataclass(frozen=True, slots=True)
class GazeOrder:
    """What is asked of a study's films.

    Attributes:
        folder: The study's, or one that holds films with their layers.
        samples: Table with film, time, x and y, maybe participant; None writes boxes only.
        output: Folder of the tables.
        start: When the film's first frame is shown, by the table's clock [s].
        fixation: How long gaze rests at least where it fixes [s].
        radius: How far from a thing with an outline gaze still hits it [px].
        overwrite: Whether tables that exist are replaced.
    """

    folder: Path
    samples: Path | None
    output: Path
    start: Seconds = 0.0
    fixation: _Length = 0.1
    radius: _Length = 0.0
    overwrite: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)


@dataclass(frozen=True, slots=True)
class Sample:
    """Where somebody looks.

    Attributes:
        participant: Who; empty where the table has no such column.
        film: The film's name.
        time: From the film's first frame [s].
        x: Column, 0 at the left edge of the picture [px]; NaN where gaze is lost.
        y: Row, 0 at the upper edge [px].
    """

    participant: str
    film: str
    time: float
    x: float
    y: float


def write_gaze(order: GazeOrder) -> list[Path]:
    """Write what people look at, and the boxes of all things, as tables.

    Raises:
        ConfigError: If there are no films, none of a name, or tables exist.
        InputError: If a table, an account or a layer is wrong.
    """
    films = _films(order.folder)
    names = ("boxes", "samples", "things") if order.samples else ("boxes",)
    paths = {name: order.output / f"{name}.csv" for name in names}
    for path in paths.values():
        if path.exists() and not order.overwrite:
            raise ConfigError(f"{path} exists; --overwrite replaces it", key="output")
    samples = [] if order.samples is None else _read(order.samples, films, order.start)
    boxes: list[Row] = []
    hits: list[tuple[Sample, Row]] = []
    for number, (name, film) in enumerate(films.items(), start=1):
        own = [sample for sample in samples if sample.film == name]
        more, some = _film(name, film, own, radius=order.radius)
        hits += more
        boxes += some
        announce(Doing.MEASURE, number, len(films))
    rows: dict[str, Sequence[Row]] = {"boxes": boxes}
    if order.samples is not None:
        rows |= {
            "samples": [row for _, row in hits],
            "things": list(thing_rows(hits, order.fixation)),
        }
    order.output.mkdir(parents=True, exist_ok=True)
    return [write_table(paths[name], rows[name]) for name in names if rows[name]]


# Films and samples --------------------------------------------------------------------------


def _films(folder: Path) -> dict[str, Path]:
    """Return films that have layers, by name.

    Raises:
        ConfigError: If there are none.
    """
    places = (folder / MATERIALS, folder)
    films = {
        path.stem: path
        for place in places
        if place.is_dir()
        for path in sorted(place.iterdir())
        if path.suffix in _FILMS and said_file(beside(frames_folder(path)), 0).is_file()
    }
    if not films:
        raise ConfigError(
            f"{folder} holds no film with layers; `study` writes them, and `render` with"
            " output.layers: [instance]",
            key="folder",
        )
    return films


def _read(path: Path, films: Mapping[str, Path], start: float) -> list[Sample]:
    """Return the samples of a table.

    Raises:
        InputError: If a column is missing, or a row is wrong.
    """
    rows = read_rows(path, _COLUMNS, needs="film, time, x and y")
    return [_sample(row, path, line, films, start) for row, line in rows]


def _sample(row: Cells, path: Path, line: int, films: Mapping[str, Path], start: float) -> Sample:
    """Return the sample of a row."""
    names = {name: file.name for name, file in films.items()}
    film = film_named(row["film"], names, path=path, line=line)
    time, x, y = (number_in(row[name], name, path=path, line=line) for name in ("time", "x", "y"))
    if math.isnan(time):
        raise InputError("has no time", file=path, line=line)
    return Sample(row.get("participant", "").strip(), film, time - start, x, y)


# Hits ---------------------------------------------------------------------------------------


def _film(
    name: str, film: Path, samples: Sequence[Sample], *, radius: float
) -> tuple[list[tuple[Sample, Row]], list[Row]]:
    """Return what samples of a film hit, and the boxes of its things."""
    account = read_film_account(film)
    times = [float(frame["time"]) for frame in account["frames"]]
    by_frame: dict[int, list[Sample]] = {}
    for sample in samples:
        number = math.floor(sample.time * float(account["fps"]) + 1e-6)
        by_frame.setdefault(number if 0 <= number < len(times) else -1, []).append(sample)
    hits = [(sample, _hit(sample, None, radius)) for sample in by_frame.pop(-1, ())]
    boxes: list[Row] = []
    folder = beside(frames_folder(film))
    for number, time in enumerate(times):
        seen = read_frame(folder, number) if said_file(folder, number).is_file() else None
        hits += [(sample, _hit(sample, seen, radius)) for sample in by_frame.get(number, ())]
        boxes += [] if seen is None else box_rows(name, round(time, 6), seen)
    hits.sort(key=lambda hit: (hit[0].participant, hit[0].time))
    return hits, boxes


def _hit(sample: Sample, seen: FrameLayers | None, radius: float) -> Row:
    """Return a row about a sample, and what it hits in the frame that is shown, if one is."""
    name, label, frame = OUTSIDE, "", ""
    if math.isnan(sample.x) or math.isnan(sample.y):
        name = NOWHERE
    elif seen is not None:
        owners = seen.layers[COUNTED]
        row, column = math.floor(sample.y), math.floor(sample.x)
        if 0 <= row < owners.shape[0] and 0 <= column < owners.shape[1]:
            thing = _near(sample, seen, radius) or seen.things.get(int(owners[row, column]))
            name, label = ("sky", "sky") if thing is None else (thing.name, thing.label)
    return {
        **({"participant": sample.participant} if sample.participant else {}),
        "film": sample.film,
        "time": round(sample.time, 6),
        "frame": frame if seen is None else seen.frame,
        "x": "" if math.isnan(sample.x) else sample.x,
        "y": "" if math.isnan(sample.y) else sample.y,
        "thing": name,
        "label": label,
    }


def _near(sample: Sample, seen: FrameLayers, radius: float) -> Thing | None:
    """Return the nearest thing with an outline that is not farther than a radius [px], if any."""
    owners = seen.layers[COUNTED]
    low = np.maximum(np.floor([sample.y - radius, sample.x - radius]), 0).astype(int)
    part = owners[low[0] : int(sample.y + radius) + 1, low[1] : int(sample.x + radius) + 1]
    rows, columns = np.indices(part.shape)
    away = np.hypot(rows + low[0] + 0.5 - sample.y, columns + low[1] + 0.5 - sample.x)
    outlined = [key for key, thing in seen.things.items() if _has_outline(thing)]
    away = np.where(np.isin(part, outlined) & (away <= radius), away, np.inf)
    if radius <= 0.0 or not np.isfinite(away).any():
        return None
    return seen.things[int(part.ravel()[np.argmin(away)])]


def _has_outline(thing: Thing) -> bool:
    """Return whether a thing has an outline of its own, as road users and trees have."""
    return ":" in thing.name and thing.label not in SURFACES


def box_rows(film: str, time: float, seen: FrameLayers) -> Iterator[Row]:
    """Yield the box around each thing that has an outline of its own in a frame.

    Args:
        film: The film's name.
        time: SUMO's [s].
        seen: The frame's layers.
    """
    numbers, owners = np.unique(seen.layers[COUNTED], return_inverse=True)
    things = [seen.things.get(int(number)) for number in numbers]
    names = ["" if thing is None else thing.name for thing in things]
    outlined = {thing.name: thing for thing in things if thing and _has_outline(thing)}
    # The first is numbered 1, as 0 has no box.
    for box in boxes_2d(owners.reshape(seen.layers[COUNTED].shape) + 1, ["", *names]):
        if box.name in outlined:
            yield {
                "film": film,
                "frame": seen.frame,
                "time": time,
                "thing": box.name,
                "label": outlined[box.name].label,
                **{"x0": box.left, "y0": box.top, "x1": box.right, "y1": box.bottom},
                "pixels": box.pixels,
            }


# Dwell --------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Dwell:
    """What is known of one thing that somebody looked at."""

    label: str
    hits: int = 0
    seconds: float = 0.0
    first: float = math.nan
    fixed: float = math.nan
    fixations: int = 0


def thing_rows(hits: Sequence[tuple[Sample, Row]], fixation: float) -> Iterator[Row]:
    """Yield a row for each person, film and thing: hits, dwell, first look and first fixation.

    Args:
        hits: By film, person and time.
        fixation: How long gaze rests at least where it fixes [s].
    """
    views: dict[tuple[str, str], list[tuple[Sample, Row]]] = {}
    for sample, row in hits:
        views.setdefault((sample.participant, sample.film), []).append((sample, row))
    for (participant, film), own in sorted(views.items()):
        lasts = _lasting([sample.time for sample, _ in own])
        dwells: dict[str, _Dwell] = {}
        for begin, end in _runs(own, lasts):
            name = str(own[begin][1]["thing"])
            if name == NOWHERE:
                continue
            dwell = dwells.setdefault(name, _Dwell(str(own[begin][1]["label"])))
            start = own[begin][0].time
            dwell.hits += end - begin
            dwell.seconds += sum(lasts[begin:end])
            dwell.first = start if math.isnan(dwell.first) else dwell.first
            if own[end - 1][0].time + lasts[end - 1] - start >= fixation - 1e-9:
                dwell.fixations += 1
                dwell.fixed = start if math.isnan(dwell.fixed) else dwell.fixed
        for name, dwell in sorted(dwells.items(), key=lambda item: (-item[1].seconds, item[0])):
            yield {
                **({"participant": participant} if participant else {}),
                **{"film": film, "thing": name, "label": dwell.label, "hits": dwell.hits},
                "dwell": round(dwell.seconds, 6),
                "first_look": round(dwell.first, 6),
                "first_fixation": "" if math.isnan(dwell.fixed) else round(dwell.fixed, 6),
                "fixations": dwell.fixations,
            }


def _lasting(times: Sequence[float]) -> list[float]:
    """Return how long samples last [s]: until the next one, the last as long as is usual."""
    steps = np.diff(times)
    usual = float(np.median(steps)) if len(steps) else 0.0
    return [min(max(float(step), 0.0), LONGEST) for step in (*steps, usual)]


def _runs(hits: Sequence[tuple[Sample, Row]], lasts: Sequence[float]) -> Iterator[tuple[int, int]]:
    """Yield first and after-last number of samples that follow each other on one thing."""
    begin = 0
    for k in range(1, len(hits) + 1):
        if k < len(hits):
            (before, row), (after, other) = hits[k - 1], hits[k]
            near = after.time - before.time <= lasts[k - 1] + 1e-9
            if near and row["thing"] == other["thing"]:
                continue
        yield begin, k
        begin = k
