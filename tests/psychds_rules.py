"""The rules of Psych-DS that make a data set invalid, and which files it warns of.

Written from the schema and the source of the official validator, 1.5.0, which could not be run
here. It ignores files by patterns as .gitignore has them, but asks for paths that begin with a
slash: a pattern with a slash in its middle matches none of them.

References:
    https://github.com/psych-ds/psychds-validator (MIT): src/setup/defaultSchema.json (rules.files,
    rules.errors, rules.compiled_metadata), src/files/ignore.ts, src/files/csv.ts
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatch
from pathlib import Path

_ALWAYS = (
    *(".git**", "*.DS_Store", ".datalad/", ".reproman/", "sourcedata/", "code/", "stimuli/"),
    *("materials/", "results/", "products/", "analysis/", "documentation/", "log/"),
)
"""What the validator never looks at."""

_NAME = re.compile(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv")
_KEYWORDS = frozenset(
    ("study", "site", "subject", "session", "task", "condition", "trial", "stimulus", "description")
)
_REQUIRED = ("name", "description", "variableMeasured")
_SCHEMA_ORG = re.compile(r"https?://(www\.)?schema\.org/?")
_KNOWN = ("dataset_description.json", "README.md", "CHANGES.md", ".psychds-ignore")


def is_ignored(path: str, patterns: Iterable[str]) -> bool:
    """Return whether a path, relative and with slashes, is left out by patterns."""
    *folders, name = path.split("/")
    for pattern in patterns:
        if "/" in pattern.rstrip("/"):
            continue  # anchored: it is compared with /path, and never matches
        if any(fnmatch(folder, pattern.rstrip("/")) for folder in folders):
            return True
        if not pattern.endswith("/") and fnmatch(name, pattern):
            return True
    return False


def looked_at(folder: Path) -> list[str]:
    """Return all files that are checked, relative to the data set's folder."""
    file = folder / ".psychds-ignore"
    own = file.read_text("utf-8").split("\n") if file.is_file() else []
    patterns = [*_ALWAYS, *(line for line in own if line.strip() and not line.startswith("#"))]
    paths = (path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    return sorted(path for path in paths if not is_ignored(path, patterns))


def data_files(folder: Path) -> list[str]:
    """Return the tables that count as data."""
    return [p for p in looked_at(folder) if p.startswith("data/") and p.endswith("_data.csv")]


def unknown_files(folder: Path) -> list[str]:
    """Return files of which the validator warns that it does not know them."""
    known = {*_KNOWN, *data_files(folder)}
    return [path for path in looked_at(folder) if path not in known]


def problems(folder: Path) -> list[str]:
    """Return what makes a folder no valid data set; nothing if it is valid."""
    if not (folder / "data").is_dir():
        return ["MISSING_DATA_DIRECTORY"]
    files = data_files(folder)
    if not files:
        return ["MISSING_DATAFILE"]
    try:
        said = json.loads((folder / "dataset_description.json").read_text("utf-8"))
    except FileNotFoundError:
        return ["MISSING_DATASET_DESCRIPTION"]
    except ValueError:
        return ["INVALID_JSON_FORMATTING"]
    return [*_of_description(said), *_of_columns(folder, files, said)]


def _of_description(said: dict[str, object]) -> Iterator[str]:
    """Yield what is wrong with the description."""
    if not _SCHEMA_ORG.fullmatch(str(said.get("@context", ""))):
        yield "INVALID_JSONLD_FORMATTING: @context"
    if said.get("@type") != "Dataset":
        yield "INCORRECT_DATASET_TYPE" if "@type" in said else "MISSING_DATASET_TYPE"
    # Expanded by JSON-LD, null and empty lists are gone.
    yield from (f"JSON_KEY_REQUIRED: {key}" for key in _REQUIRED if not said.get(key))


def _of_columns(folder: Path, files: list[str], said: dict[str, object]) -> Iterator[str]:
    """Yield what is wrong with the tables, and where they and the description disagree."""
    measured = said.get("variableMeasured") or ()
    names = [one if isinstance(one, str) else one["name"] for one in measured]
    seen: set[str] = set()
    for file in files:
        if not _NAME.fullmatch(file.rpartition("/")[2]):
            yield f"FILENAME_KEYWORD_FORMATTING_ERROR: {file}"
        with (folder / file).open(newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream, strict=True))
        header = rows[0] if rows else []
        seen |= {*header}
        yield from _of_table(file, rows)
        yield from (
            f"CSV_COLUMN_MISSING_FROM_METADATA: {name}" for name in header if name not in names
        )
    yield from (f"VARIABLE_MISSING_FROM_CSV_COLUMNS: {name}" for name in names if name not in seen)


def _of_table(file: str, rows: list[list[str]]) -> Iterator[str]:
    """Yield what is wrong with a table by itself."""
    if not rows or not rows[0]:
        yield f"CSV_HEADER_MISSING: {file}"
        return
    header = rows[0]
    if len({*header}) < len(header):
        yield f"CSV_HEADER_REPEATED: {file}"
    if any(len(row) != len(header) for row in rows):
        yield f"CSV_HEADER_LENGTH_MISMATCH: {file}"
    elif "row_id" in header:
        ids = [row[header.index("row_id")] for row in rows[1:]]
        if len({*ids}) < len(ids):
            yield f"ROWID_VALUES_NOT_UNIQUE: {file}"


def unofficial_keywords(folder: Path) -> set[str]:
    """Return keywords in names of data files that Psych-DS does not have."""
    names = [Path(file).name for file in data_files(folder)]
    return {part.partition("-")[0] for name in names for part in name.split("_")[:-1]} - _KEYWORDS
