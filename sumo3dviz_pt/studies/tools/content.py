"""What the files of all tools are made from: films, trials, playlists and words.

Films, trials and playlists are also tables, rows by column, that all tools share.

References:
    OWASP, "CSV Injection": spreadsheets compute cells that begin with =, +, -, @, a tab or a
    carriage return
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from string import ascii_uppercase
from typing import Any, TypeVar

from sumo3dviz_pt.files.atomic import atomic_path
from sumo3dviz_pt.studies.designs.trials import Playlist, Profile, Ranks, Trial


@dataclass(frozen=True, slots=True)
class Clip:
    """A finished film.

    Attributes:
        name: Without an ending.
        code: Short, of letters and digits; it tells nothing.
        file: Relative to the study's folder, with forward slashes.
        duration: Of the film [s].
        size: Width, height [px].
        rate: Frames per second, such as 25 or 30000/1001.
        digest: SHA-256 of the file.
        fov: Horizontal opening angle of its lens [deg]; None where it is not known.
        heard: Whether it has sound.
    """

    name: str
    code: str
    file: str
    duration: float
    size: tuple[int, int]
    rate: str
    digest: str
    fov: float | None = None
    heard: bool = False


@dataclass(frozen=True, slots=True)
class Screen:
    """How films get their right size on a screen.

    Attributes:
        distance: Of the eyes from the screen [m].
        pixels_per_cm: CSS pixels of the screen; None asks people to lay a bank card on it.
        instruction: What people read then.
    """

    distance: float
    pixels_per_cm: float | None
    instruction: str


@dataclass(frozen=True, slots=True)
class Form:
    """Questions on a page of their own.

    Attributes:
        name: Columns of the data are called after it.
        items: Each with `text`, and `answers`, `low` and `high` where it has its own.
        answers: Of all items; none leaves room for free text.
        low, high: What the first and the last answer mean; may be empty.
        intro: Above the items; may be empty.
    """

    name: str
    items: Sequence[Mapping[str, Any]]
    answers: Sequence[str] = ()
    low: str = ""
    high: str = ""
    intro: str = ""


@dataclass(frozen=True, slots=True)
class During:
    """What people press while a film plays.

    Attributes:
        keys: As browsers call them, in small letters; the space bar is `space`.
        button: Its words; None has a button on touch screens only.
        text: Above the film.
        only: Whether no question follows.
    """

    keys: Sequence[str]
    button: str | None = None
    text: str | None = None
    only: bool = False


@dataclass(frozen=True, slots=True)
class StudySession:
    """What surrounds the films on the page of jsPsych.

    Attributes:
        texts: Words of the page by key.
        consent: What people agree to first; None asks nothing.
        before, after: Forms around the films.
        practice: How many trials come first as well.
        attention: How many checks stand between the trials.
        during: What is pressed while films play.
        endpoint: Where answers are sent: kind, url, experiment; None saves a file.
        offline: Folder with jsPsych that is copied beside the page; None leaves it where it is.
    """

    texts: Mapping[str, str]
    consent: str | None = None
    before: Sequence[Form] = ()
    after: Sequence[Form] = ()
    practice: int = 0
    attention: int = 0
    during: During | None = None
    endpoint: Mapping[str, str | None] | None = None
    offline: Path | None = None


@dataclass(frozen=True, slots=True)
class Words:
    """What people are asked, and what is said about the study.

    Attributes:
        question: After a single clip.
        choice: After a task of several clips.
        answers: In order.
        low, high: What the first and the last answer mean.
        none: The answer that chooses nothing.
        language: Of all these, such as `en`.
        title, description: Of the data set.
        authors: Given name, family name.
        licence: Of the films; may be empty.
        keywords: For catalogues.
    """

    question: str
    choice: str
    answers: Sequence[str]
    low: str
    high: str
    none: str
    language: str
    title: str
    description: str
    authors: Sequence[str] = ()
    licence: str = ""
    keywords: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class StudyContent:
    """A study whose films are there.

    Attributes:
        factors: What each factor is, in the order of profiles; may be empty words.
        levels: Of each factor.
        clips: The film of each profile.
        trials: Of all blocks, in the design's order.
        playlists: Who sees what in which order.
        words: For people.
        url: Of the folder online, ending in /; None if it is not known.
        jspsych: Where jsPsych is loaded from, ending in /.
        notes: What a reader of the data should know.
        told: Factors that films do not show, so that words have to.
        screen: How films get their right size on the page; None fits them to the window.
        cards: Films of all alternatives side by side, by the trial's name; else they are shown one
            after the other.
        session: What surrounds films on the page of jsPsych; None is nothing, in English.
        ranks: How good levels are, in the order of factors; empty where nothing is known.
    """

    factors: Mapping[str, str]
    levels: Mapping[str, Sequence[str]]
    clips: Mapping[Profile, Clip]
    trials: Sequence[Trial]
    playlists: Sequence[Playlist]
    words: Words
    url: str | None = None
    jspsych: str = "https://unpkg.com/"
    notes: Sequence[str] = ()
    told: Sequence[str] = ()
    screen: Screen | None = None
    cards: Mapping[str, str] = field(default_factory=dict)
    session: StudySession | None = None
    ranks: Ranks = ()

    @property
    def films(self) -> tuple[Clip, ...]:
        """All films, each once."""
        return tuple({clip.name: clip for clip in self.clips.values()}.values())

    @property
    def most_alternatives(self) -> int:
        """The most alternatives that a trial has, those that choose nothing among them."""
        return max(len(trial.alternatives) for trial in self.trials)

    def named(self, profile: Profile) -> dict[str, str]:
        """Return a profile's levels by the names of their factors."""
        return dict(zip(self.factors, profile, strict=True))

    def told_words(self, profile: Profile) -> str:
        """Return what people read beside a film; nothing if it shows all."""
        levels = self.named(profile)
        return ", ".join(f"{self.factors[name] or name}: {levels[name]}" for name in self.told)


def trial_name(trial: Trial) -> str:
    """Return a name of a trial that no other has."""
    return f"b{trial.block}t{trial.task}"


def letter(place: int) -> str:
    """Return what people call an alternative, from A on; from 27 on a number."""
    return ascii_uppercase[place] if place < len(ascii_uppercase) else str(place + 1)


Record = Mapping[str, str | int | float]
"""Cells by column."""

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.I)
_COMPUTED = ("=", "+", "-", "@", "\t", "\r")

MEANINGS: Mapping[str, str] = {
    "stimulus": "name of the film; the same for profiles that look the same",
    "stim_id": "short code of the film, the same in all tables",
    "film": "file of the film, relative to the study's folder",
    "duration": "length of the film [s]",
    "block": "block, version or respondent of the design",
    "task": "choice task within the block",
    "alternative": "place of the alternative within the task, from 1",
    "none": "1 where the alternative is to choose nothing",
    "playlist": "who sees the trial: the playlist's name",
    "position": "place of the trial in its playlist, from 1",
}
"""What the columns of the tables mean; the other columns are factors."""


def film_rows(content: StudyContent) -> Iterator[Record]:
    """Yield a row for each profile: its levels and its film."""
    for profile, clip in content.clips.items():
        yield {
            "stimulus": clip.name,
            "stim_id": clip.code,
            **content.named(profile),
            "film": clip.file,
            "duration": clip.duration,
        }


def trial_rows(content: StudyContent) -> Iterator[Record]:
    """Yield a row for each alternative of each trial."""
    for trial in content.trials:
        yield from _alternatives(content, trial)


def playlist_rows(content: StudyContent) -> Iterator[Record]:
    """Yield a row for each trial of each playlist, with its alternatives side by side."""
    several, known = content.most_alternatives > 1, dict[Trial, Record]()
    for playlist in content.playlists:
        for position, trial in enumerate(playlist.trials, start=1):
            if trial not in known:
                known[trial] = _wide_row(content, trial, several=several)
            yield {"playlist": playlist.name, "position": position, **known[trial]}


def wide_rows(content: StudyContent) -> Iterator[Record]:
    """Yield all trials, each in one row; with several alternatives, columns end in _1, _2, ..."""
    several = content.most_alternatives > 1
    return (_wide_row(content, trial, several=several) for trial in content.trials)


def _wide_row(content: StudyContent, trial: Trial, *, several: bool) -> Record:
    """Return a trial in one row; `several` says whether any trial has several alternatives."""
    row: dict[str, str | int | float] = {"block": trial.block, "task": trial.task}
    for place, cells in enumerate(_alternatives(content, trial), start=1):
        rest = {key: cell for key, cell in cells.items() if key not in ("block", "task")}
        if several:
            row |= {f"{key}_{place}": cell for key, cell in rest.items() if key != "alternative"}
        else:
            row |= {key: cell for key, cell in rest.items() if key not in ("alternative", "none")}
    return row


def _alternatives(content: StudyContent, trial: Trial) -> Iterator[Record]:
    """Yield a row for each alternative of a trial; one that chooses nothing has no levels."""
    for place, profile in enumerate(trial.alternatives, start=1):
        clip = None if profile is None else content.clips[profile]
        yield {
            "block": trial.block,
            "task": trial.task,
            "alternative": place,
            "none": int(profile is None),
            "stimulus": clip.name if clip else "",
            "stim_id": clip.code if clip else "",
            **(
                content.named(profile)
                if profile is not None
                else dict.fromkeys(content.factors, "")
            ),
            "film": clip.file if clip else "",
            "duration": clip.duration if clip else "",
        }


def _safe(cell: str | int | float) -> str | int | float:
    """Return a cell that is no formula."""
    if isinstance(cell, str) and cell.startswith(_COMPUTED) and not _NUMBER.fullmatch(cell):
        return f"'{cell}"
    return cell


def write_table(
    path: Path, rows: Iterable[Record], *, separator: str = ",", mark: str = ""
) -> Path:
    """Write a table with the columns of its first row as text in UTF-8, row by row.

    Text that a spreadsheet would take for a formula gets an apostrophe before it; numbers stay,
    whatever their sign.

    Args:
        path: The file.
        rows: At least one.
        separator: Between cells.
        mark: What the file begins with.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    coming = iter(rows)
    first = next(coming)
    columns = list(first)
    with atomic_path(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        stream.write(mark)
        writer = csv.writer(stream, delimiter=separator, lineterminator="\n")
        writer.writerow(columns)
        for row in chain([first], coming):
            writer.writerow([_safe(row[column]) for column in columns])
    return path


@dataclass(frozen=True, slots=True)
class Writer:
    """What writes the files of a tool.

    Attributes:
        write: Writes them into the study's folder, and returns them.
        online: Whether the tool can only show films from an address.
    """

    write: Callable[[Path, StudyContent], list[Path]]
    online: bool


WRITERS: dict[str, Writer] = {}
"""Writers by the tools' names in study files; modules of this folder add theirs by `writes`."""

_Write = TypeVar("_Write", bound=Callable[[Path, StudyContent], list[Path]])


def writes(tool: str, *, online: bool = False) -> Callable[[_Write], _Write]:
    """Return what enters a function as the writer of a tool; see `Writer`."""

    def enter(write: _Write) -> _Write:
        WRITERS[tool] = Writer(write, online)
        return write

    return enter
