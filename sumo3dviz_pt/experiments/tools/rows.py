"""The tables that all tools share: films, trials and playlists, as rows by column.

References:
    OWASP, "CSV Injection": spreadsheets compute cells that begin with =, +, -, @, a tab or a
    carriage return
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import StudyContent
from sumo3dviz_pt.experiments.trials import Trial
from sumo3dviz_pt.files.whole import whole

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
        kept = {key: cell for key, cell in cells.items() if key not in ("block", "task")}
        if several:
            row |= {f"{key}_{place}": cell for key, cell in kept.items() if key != "alternative"}
        else:
            row |= {key: cell for key, cell in kept.items() if key not in ("alternative", "none")}
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
    with whole(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        stream.write(mark)
        writer = csv.writer(stream, delimiter=separator, lineterminator="\n")
        writer.writerow(columns)
        for row in chain([first], coming):
            writer.writerow([_safe(row[column]) for column in columns])
    return path
