"""Joins presses during films with the vehicles that arrive in them: margins and accepted gaps.

* a press belongs to the gap in which it lies: it ends when the next vehicle's front comes to the
  observer's way across, by the film's own time;
* margin: from the press until that front comes;
* gap: from when the last rear left the way until that front comes, as `arrivals.csv` has it [s].
  People can judge it only if it begins and ends in the film: others are no offered gap;
* a press shortly before the last rear has left may be said to belong to the gap that follows;
* a row that was saved twice counts once, and films that people went on without do not count;
* an offered gap is accepted by a press within it, and refused where nobody pressed: then it has a
  row of its own, without a press.

References:
    Raff and Hart, "A volume warrant for urban stop signs", Eno Foundation, 1950 (accepted and
    refused gaps and lags).
"""

from __future__ import annotations

import json
import logging
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.job.sessions import CAMERA
from sumo3dviz_pt.studies.measured.report import FOLDER
from sumo3dviz_pt.studies.measured.tables import Cells, film_named, number_in, read_rows
from sumo3dviz_pt.studies.measured.traffic import Row, known
from sumo3dviz_pt.studies.records import RECORD, STUDY_RECORD, read_film_account
from sumo3dviz_pt.studies.tools.content import write_table

log = logging.getLogger(__name__)

_SHOWN = ("answer", "film")
"""Kinds of the page's rows that are about a film that counts."""

_WHO = ("participant", "playlist", "position", "attempt")
"""Columns of the page that are kept where they are there."""

_COLUMNS = ("row_kind", "film", "press_film_times")

_SAME = ("study_digest", "visit", "visit_row")
"""Columns that name a row: browsers save one more table when answers are saved again."""

_Tables = Mapping[Path, Sequence[tuple[Cells, int]]]
"""Rows of what the page saved with the lines at which they end, by table."""

_DIGEST = re.compile(r'"digest": "([0-9a-f]{16})"')

_TINY = 5e-4
"""Tables have thousandths [s]."""


@dataclass(frozen=True, slots=True)
class Coming:
    """A vehicle that arrives in a film.

    Attributes:
        name: Its key, such as `vehicle:car.7`.
        arrives: When its front is at the way across, by the film's time [s].
        leaves: When its rear has left it [s].
        gap: That it ends [s]; NaN if nobody came before.
        is_offered: Whether the gap begins and ends in the film.
        speed: SUMO's time per film's.
    """

    name: str
    arrives: float
    leaves: float
    gap: float
    is_offered: bool = True
    speed: float = 1.0

    @property
    def begins(self) -> float:
        """When the gap begins, by the film's time [s]; NaN if nobody came before."""
        return self.arrives - self.gap / self.speed


def write_presses(
    study: Path,
    data: Path,
    output: Path,
    *,
    observer: str = CAMERA,
    early: float = 0.0,
    overwrite: bool = False,
) -> int:
    """Write a row for each press in a study's films, with the next vehicle; return how many.

    Args:
        study: Its folder.
        data: What the page saved: a table, or a folder of them.
        output: The table to write.
        observer: For whom vehicles arrive.
        early: How long before the last rear has left a press belongs to the gap behind it [s].
        overwrite: Whether a table that exists is replaced.

    Raises:
        ConfigError: If there is no such observer, no data, or the table exists.
        InputError: If a table is wrong.
    """
    if not 0.0 <= early < math.inf:
        raise ConfigError("is 0 s or more", key="early")
    if output.exists() and not overwrite:
        raise ConfigError(f"{output} exists; --overwrite replaces it", key="output")
    tables = _shown_once(_read(data))
    films = _films(study)
    coming = _coming(study, observer, films)
    _same_study(study, tables)
    rows: list[Row] = []
    for table, content in tables.items():
        rows += _rows(table, content, films=films, coming=coming, early=early)
    if not rows:
        raise ConfigError(f"{data} tells of no film of the study", key="data")
    write_table(output, rows)
    return len(rows)


# What the page saved ------------------------------------------------------------------------


def _read(data: Path) -> _Tables:
    """Return the rows of a table, or of all in a folder; there, others are left out with a note.

    Raises:
        ConfigError: If a folder holds no table of the page.
        InputError: If a single file is none.
    """
    needs = "what the page of a study saves"
    if not data.is_dir():
        return {data: list(read_rows(data, _COLUMNS, needs=needs))}
    tables: dict[Path, Sequence[tuple[Cells, int]]] = {}
    for path in sorted(data.glob("*.csv")):
        try:
            tables[path] = list(read_rows(path, _COLUMNS, needs=needs))
        except InputError as error:
            log.warning("%s is left out: %s", path.name, error)
    if not tables:
        raise ConfigError(f"{data} holds no table (.csv) that the page saved", key="data")
    return tables


def _shown_once(tables: _Tables) -> _Tables:
    """Return rows about films that people saw, each once; note what is left out."""
    firsts: dict[Path, Sequence[tuple[Cells, int]]] = {}
    known_rows: set[tuple[str, ...]] = set()
    skipped = 0
    for path, rows in tables.items():
        own: list[tuple[Cells, int]] = []
        twice = 0
        for row, line in rows:
            names = tuple(row.get(name, "").strip() for name in _SAME)
            if all(names[1:]) and names in known_rows:
                twice += 1
                continue
            known_rows.add(names)
            if row["row_kind"] in _SHOWN and row["film"]:
                went_on = row.get("film_skipped", "").strip() == "1"
                skipped += went_on
                own += [] if went_on else [(row, line)]
        if twice:
            log.warning(
                "%s: %d rows were saved twice (visit and visit_row are equal) and count once",
                path,
                twice,
            )
        firsts[path] = own
    if skipped:
        number = "1 film" if skipped == 1 else f"{skipped} films"
        log.warning(
            "%s that people went on without %s left out", number, "is" if skipped == 1 else "are"
        )
    return firsts


# What the study shows -----------------------------------------------------------------------


def _films(study: Path) -> Mapping[str, Mapping[str, Any]]:
    """Return the films of a study by name.

    Raises:
        InputError: If the folder is none of a finished study.
    """
    record = study / RECORD
    try:
        content = STUDY_RECORD.current(json.loads(record.read_bytes()), record)
        films: Mapping[str, Mapping[str, Any]] = content["films"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"is no record of a study ({error})", file=record) from error
    return {name: {**film, **_times(study / str(film["file"]))} for name, film in films.items()}


def _times(film: Path) -> dict[str, float]:
    """Return for how long a film shows a title before its first frame, and its times.

    `before`, `lasts` and, with titles, `ends` are by the film [s]; `speed` is SUMO's time per
    film's.
    """
    account = read_film_account(film)
    fps, count = float(account["fps"]), len(account["frames"])
    over = account.get("overlays", {})
    before, after = (int(over.get(f"frames_{name}", 0)) for name in ("before", "after"))
    return {
        "before": before / fps,
        "lasts": count / fps,
        "ends": (before + count + after) / fps,
        "speed": float(account.get("speed", 1.0)),
    }


def _same_study(study: Path, tables: _Tables) -> None:
    """Note tables that another page than the study's saved: its films may be others."""
    page = study / "index.html"
    match = _DIGEST.search(page.read_text("utf-8")) if page.is_file() else None
    for table, rows in tables.items():
        digests = {row.get("study_digest", "") for row, _ in rows}
        if match and digests - {match[1], ""}:
            log.warning(
                "%s was saved by another page than %s: if its films are others, nothing here is"
                " right; take the folder that people saw",
                table,
                page,
            )


def _coming(
    study: Path, observer: str, films: Mapping[str, Mapping[str, Any]]
) -> Mapping[str, list[Coming]]:
    """Return the vehicles that arrive at an observer, by film, in order.

    Raises:
        ConfigError: If no vehicle ever arrives at an observer of that name.
    """
    path = study / FOLDER / "arrivals.csv"
    columns = ("stimulus", "observer", "road_user", "arrives_in_film", "leaves_in_film")
    needs = "what `study` writes of observers who stand"
    coming: dict[str, list[Coming]] = {}
    names: dict[str, None] = {}
    for row, line in read_rows(path, (*columns, "gap_before"), needs=needs):
        names[row["observer"]] = None
        if row["observer"] == observer and row["stimulus"] in films:
            arrives, leaves, gap = (
                number_in(row[name], name, path=path, line=line)
                for name in ("arrives_in_film", "leaves_in_film", "gap_before")
            )
            film = films[row["stimulus"]]
            each = Coming(row["road_user"], arrives, leaves, gap, speed=film["speed"])
            offered = each.begins >= -_TINY and arrives <= film["lasts"]
            own = coming.setdefault(row["stimulus"], [])
            own.append(replace(each, is_offered=offered))
    if not coming:
        hint = did_you_mean(observer, names)
        raise ConfigError(
            f"nobody arrives at an observer called {observer!r}{hint}", key="observer"
        )
    return coming


# Presses and gaps ---------------------------------------------------------------------------


def _rows(
    table: Path,
    content: Sequence[tuple[Cells, int]],
    *,
    films: Mapping[str, Mapping[str, Any]],
    coming: Mapping[str, Sequence[Coming]],
    early: float,
) -> Iterator[Row]:
    """Yield a row for each press in a table of the page; one for a film without."""
    files = {name: Path(str(film["file"])).name for name, film in films.items()}
    for row, line in content:
        name = film_named(row["film"], files, path=table, line=line)
        film, shown = films[name], _shown(row, name, films[name]["profiles"][0])
        own = coming.get(name, ())
        times = _times_in(row, film, table=table, line=line)
        pressed = [press_row(time, own, early=early) for time in times]
        for number, each in enumerate(pressed):
            if any(
                other["next"] == each["next"] and other["accepted"] == 1
                for other in pressed[:number]
            ):
                each["accepted"] = ""  # a gap is taken once
        refused = list(refused_rows(pressed, own))
        if not pressed and not refused:
            yield {**shown, "press": 0, **dict.fromkeys(_PRESSED, "")}
        for number, each in enumerate(pressed, start=1):
            yield {**shown, "press": number, **each}
        for each in refused:
            yield {**shown, "press": 0, **each}


def _times_in(row: Cells, film: Mapping[str, Any], *, table: Path, line: int) -> list[float]:
    """Return when keys were pressed, by the film's time without a title [s].

    Raises:
        InputError: If a time is no number, or lies after the film.
    """
    times = []
    for text in filter(str.strip, row["press_film_times"].split(";")):
        time = number_in(text, "press_film_times", path=table, line=line)
        if time > film["ends"] + 1.0:
            raise InputError(
                f"press_film_times {text.strip()} lies after the film's end ({film['ends']:g} s);"
                " if a spreadsheet took the point for one between thousands, give the table as"
                " the page saved it",
                file=table,
                line=line,
            )
        times.append(time - film["before"])
    return times


def _shown(row: Cells, name: str, levels: Mapping[str, str]) -> Row:
    """Return cells about who saw which film; a factor that is called like one of them ends in _."""
    own: Row = {**{key: row[key] for key in _WHO if key in row}, "film": name}
    taken = {*own, "press", *_PRESSED}
    named = {f"{key}_" if key in taken else key: level for key, level in levels.items()}
    return {**own, **named}


_PRESSED = (
    *("press_time", "next", "next_arrives", "margin", "gap_offered", "accepted"),
    *("since_last", "on_the_way"),
)
"""Cells about a press, or about a gap that nobody took."""


def press_row(time: float, coming: Sequence[Coming], *, early: float = 0.0) -> Row:
    """Return what a press says: which vehicle is next, the margin, and which gap it accepts.

    Args:
        time: Of the press, by the film's [s].
        coming: The vehicles that arrive, in order.
        early: How long before it begins a press accepts an offered gap, too [s].
    """
    started = next((each for each in coming if _starts_early(time, each, early)), None)
    following = started or next((each for each in coming if each.arrives > time), None)
    gone = [each.leaves for each in coming if each.leaves <= time + _TINY]
    gone += [started.begins] if started else []
    blocked = any(each.arrives <= time < each.leaves - _TINY for each in coming)
    offered = (
        following is not None and following.is_offered and (not blocked or following is started)
    )
    return {
        "press_time": known(time),
        "next": "" if following is None else following.name,
        "next_arrives": "" if following is None else known(following.arrives),
        "margin": "" if following is None else known(following.arrives - time),
        "gap_offered": known(following.gap) if following is not None and offered else "",
        "accepted": 1 if offered else "",
        "since_last": known(time - max(gone)) if gone else "",
        "on_the_way": int(blocked),
    }


def _starts_early(time: float, each: Coming, early: float) -> bool:
    """Return whether a press belongs to an offered gap that begins soon after it."""
    return each.is_offered and each.begins - early - _TINY <= time < each.begins - _TINY


def refused_rows(pressed: Sequence[Row], coming: Sequence[Coming]) -> Iterator[Row]:
    """Yield a row for each gap that a film offers and in which nobody pressed.

    Args:
        pressed: Rows of the presses in the film.
        coming: The vehicles that arrive, in order.
    """
    taken = {(row["next"], row["next_arrives"]) for row in pressed if row["gap_offered"] != ""}
    for each in coming:
        if each.is_offered and (each.name, known(each.arrives)) not in taken:
            yield {
                **dict.fromkeys(_PRESSED, ""),
                "next": each.name,
                "next_arrives": known(each.arrives),
                "gap_offered": known(each.gap),
                "accepted": 0,
            }
