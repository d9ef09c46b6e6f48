"""The tables of a study, and the description that makes its folder a Psych-DS data set.

References:
    Psych-DS 1.5, schema: https://psychds-docs.readthedocs.io/ (names of data files; every column
    in variableMeasured, and every variable in a column)
    Its validator 1.5.0, https://github.com/psych-ds/psychds-validator (.psychds-ignore)
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import StudyContent
from sumo3dviz_pt.experiments.tools.rows import (
    MEANINGS,
    Record,
    film_rows,
    playlist_rows,
    trial_rows,
    write_table,
)
from sumo3dviz_pt.files.whole import write_whole

SCHEMA = "1.5.0"

_IGNORED = (
    *("bids/", "calibration/", "certificate/", "inputs/", "node_modules/", "otree/", "psychopy/"),
    *("report/", "scripts/", "thumbnails/", "*.html", "*.js", "*.png", "*.sha256", "*.txt"),
    *("*.yaml", "CITATION.cff", "certificate.json", "report.json", "study.json"),
    *("package.json", "package-lock.json"),
)
"""What the data set holds beside what Psych-DS knows. The validator compares patterns with paths
that begin with a slash, so that one with a slash inside (`report/*`) would match nothing."""


def tables(content: StudyContent) -> dict[str, Iterator[Record]]:
    """Return the tables of a study, row by row, by the names of their files."""
    study = _keyword(content.words.title)
    return {
        f"study-{study}_description-{name}_data.csv": rows(content)
        for name, rows in (
            ("stimuli", film_rows),
            ("trials", trial_rows),
            ("playlists", playlist_rows),
        )
    }


def write_data(folder: Path, content: StudyContent) -> list[Path]:
    """Write the tables into the folder `data`; return their files."""
    return [write_table(folder / "data" / name, rows) for name, rows in tables(content).items()]


def write_psychds(folder: Path, content: StudyContent) -> list[Path]:
    """Write what makes a folder with tables and films a Psych-DS data set."""
    columns = dict.fromkeys(name for rows in tables(content).values() for name in next(iter(rows)))
    texts = {
        "dataset_description.json": _json(_description(content, list(columns))),
        "README.md": _readme(content),
        "CHANGES.md": "# Changes\n\n* 1.0.0: stimuli and trials, before any answers.\n",
        ".psychds-ignore": "\n".join(_IGNORED) + "\n",
    }
    for name, text in texts.items():
        write_whole(folder / name, text)
    return [folder / name for name in texts]


def _description(content: StudyContent, columns: list[str]) -> Mapping[str, object]:
    """Return the data set's description in JSON-LD."""
    words = content.words
    found: dict[str, object] = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": words.title,
        "description": words.description,
        "schemaVersion": f"Psych-DS {SCHEMA}",
        "variableMeasured": [_variable(content, column) for column in columns],
    }
    if words.authors:
        found["author"] = [{"@type": "Person", "name": name} for name in words.authors]
    if words.licence:
        found["license"] = words.licence
    if words.keywords:
        found["keywords"] = list(words.keywords)
    if content.url:
        found["url"] = content.url
    return found


def _variable(content: StudyContent, column: str) -> Mapping[str, object]:
    """Return what a column means."""
    stem, _, place = column.rpartition("_")
    name = stem if place.isdecimal() and column not in content.factors else column
    where = f" of alternative {place}" if name != column else ""
    found: dict[str, object] = {"@type": "PropertyValue", "name": column}
    if name in content.factors:
        about = content.factors[name] or "a factor of the design"
        found["description"] = f"{about}{where}; levels: {', '.join(content.levels[name])}"
        return found
    found["description"] = f"{MEANINGS[name]}{where}"
    if name == "duration":
        found["unitText"] = "s"
    return found


def _readme(content: StudyContent) -> str:
    """Return a page for people who find the folder."""
    words = content.words
    lines = [f"# {words.title}", "", words.description, "", "| factor | levels |", "|---|---|"]
    lines += [f"| {name} | {', '.join(content.levels[name])} |" for name in content.factors]
    films, lists = len(content.films), len(content.playlists)
    lines += [
        "",
        f"{films} films in `materials`, {len(content.trials)} trials, {lists} playlists. Tables are"
        " in `data`; `study.json` says what every film was made from and which pairs differ in one"
        " factor; `inputs` holds all that they were made from, and says how to make them again;"
        " `checksums.sha256` has the digests of all files.",
        "",
        *(f"* {note}" for note in content.notes),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _keyword(text: str) -> str:
    """Return a title as the value of a keyword in a file's name: letters and digits."""
    words = re.findall(r"[A-Za-z0-9]+", text)
    return "".join(word[:1].upper() + word[1:] for word in words)[:40] or "Study"


def _json(content: object) -> str:
    """Return JSON as text."""
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
