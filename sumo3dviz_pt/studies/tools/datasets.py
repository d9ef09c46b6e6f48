"""A study as a data set: Psych-DS, BIDS, and how it is cited and checked.

Its tables and a description make a study's folder a Psych-DS data set. A folder `stimuli` for BIDS
follows a draft (BEP044) that may still change. A set of stimuli has a citation, and digests by
which anybody can check it.

References:
    Psych-DS 1.5, schema: https://psychds-docs.readthedocs.io/ (names of data files; every column
    in variableMeasured, and every variable in a column)
    Its validator 1.5.0, https://github.com/psych-ds/psychds-validator (.psychds-ignore)
    BIDS 1.10: `stim_file` in events.tsv is relative to /stimuli
    BEP044, draft of 2026: https://github.com/bids-standard/bids-specification/pull/2022
    Citation File Format 1.2.0: doi:10.5281/zenodo.5171937
    checksums are in the form of sha256sum: `sha256sum -c checksums.sha256` checks them
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.studies.tools.content import (
    MEANINGS,
    Clip,
    Record,
    StudyContent,
    Words,
    film_rows,
    playlist_rows,
    trial_rows,
    write_table,
    writes,
)

SCHEMA = "1.5.0"

_IGNORED = (
    *("bids/", "calibration/", "certificate/", "inputs/", "node_modules/", "otree/", "psychopy/"),
    *("report/", "scripts/", "thumbnails/", "*.html", "*.js", "*.png", "*.sha256", "*.txt"),
    *("*.yaml", "CITATION.cff", "certificate.json", "methods.md", "report.json", "study.json"),
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


@writes("psychds")
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
        write_atomically(folder / name, text)
    return [folder / name for name in texts]


def _description(content: StudyContent, columns: list[str]) -> Mapping[str, object]:
    """Return the data set's description in JSON-LD."""
    words = content.words
    dataset: dict[str, object] = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": words.title,
        "description": words.description,
        "schemaVersion": f"Psych-DS {SCHEMA}",
        "variableMeasured": [_variable(content, column) for column in columns],
    }
    if words.authors:
        dataset["author"] = [{"@type": "Person", "name": name} for name in words.authors]
    if words.licence:
        dataset["license"] = words.licence
    if words.keywords:
        dataset["keywords"] = list(words.keywords)
    if content.url:
        dataset["url"] = content.url
    return dataset


def _variable(content: StudyContent, column: str) -> Mapping[str, object]:
    """Return what a column means."""
    stem, _, place = column.rpartition("_")
    name = stem if place.isdecimal() and column not in content.factors else column
    where = f" of alternative {place}" if name != column else ""
    variable: dict[str, object] = {"@type": "PropertyValue", "name": column}
    if name in content.factors:
        about = content.factors[name] or "a factor of the design"
        variable["description"] = f"{about}{where}; levels: {', '.join(content.levels[name])}"
        return variable
    variable["description"] = f"{MEANINGS[name]}{where}"
    if name == "duration":
        variable["unitText"] = "s"
    return variable


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
        " factor; `methods.md` says how they were made; `inputs` holds all that they were made"
        " from, and says how to make them again; `checksums.sha256` has the digests of all files.",
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


_DRAFT = "BEP044 (draft of 2026); released BIDS only knows stim_file in events.tsv"
_ABSENT = "n/a"


@writes("bids")
def write_bids(folder: Path, content: StudyContent) -> list[Path]:
    """Write `bids/stimuli`: films under the names of the draft, stimuli.tsv and stimuli.json.

    Films are hard links where the file system has them, and copies elsewhere.
    """
    here = folder / "bids" / "stimuli"
    here.mkdir(parents=True, exist_ok=True)
    films = [_linked(folder / clip.file, here / _film(clip)) for clip in content.films]
    rows = [_row(content, clip) for clip in content.films]
    table = write_table(here / "stimuli.tsv", rows, separator="\t")
    write_atomically(here / "stimuli.json", json.dumps(_columns(content), indent=1) + "\n")
    return [*films, table, here / "stimuli.json"]


def _film(clip: Clip) -> str:
    """Return a film's name: labels have letters and digits only."""
    return f"stim-{clip.code}_video{Path(clip.file).suffix}"


def _row(content: StudyContent, clip: Clip) -> Record:
    """Return what is said about a film; levels are those of all profiles that it stands for."""
    profiles = [profile for profile, film in content.clips.items() if film == clip]
    levels = {
        factor: "|".join(dict.fromkeys(profile[place] for profile in profiles))
        for place, factor in enumerate(content.factors)
    }
    address = f"{content.url}{clip.file}" if content.url else _ABSENT
    return {
        "stim_id": f"stim-{clip.code}",
        "type": "video",
        "URL": address,
        "license": content.words.licence or _ABSENT,
        "copyright": ", ".join(content.words.authors) or _ABSENT,
        "description": clip.name,
        "present": "true",
        "stim_file": _film(clip),
        "duration": clip.duration,
        **levels,
    }


def _columns(content: StudyContent) -> Mapping[str, object]:
    """Return what the columns mean."""
    factors = {
        factor: {
            "Description": about or "factor of the design",
            "Levels": {level: level for level in content.levels[factor]},
        }
        for factor, about in content.factors.items()
    }
    return {
        "stim_id": {"Description": f"identifier of the film for events.tsv; {_DRAFT}"},
        "stim_file": {"Description": "file, relative to this folder, as stim_file in events.tsv"},
        "duration": {"Description": MEANINGS["duration"], "Units": "s"},
        **factors,
    }


def _linked(film: Path, place: Path) -> Path:
    """Put a film at another place."""
    place.unlink(missing_ok=True)
    try:
        os.link(film, place)
    except OSError:
        shutil.copyfile(film, place)
    return place


CHECKSUMS = "checksums.sha256"
INPUTS = "inputs.sha256"

_REFERENCES = """\
references:
  - type: software
    title: "sumo3dviz_pt: path-traced stills and films of SUMO traffic simulations"
    authors: [{name: The sumo3dviz_pt developers}]
    version: {version}
    license: BSD-3-Clause
  - type: conference-paper
    title: Microscopic Traffic Simulation using SUMO
    authors: [{family-names: Alvarez Lopez, given-names: Pablo}, {name: and others}]
    conference: {name: IEEE Intelligent Transportation Systems Conference (ITSC)}
    year: 2018
    doi: 10.1109/ITSC.2018.8569938
"""


def write_citation(folder: Path, words: Words, *, version: str) -> Path:
    """Write `CITATION.cff` for the films of a study.

    Args:
        folder: The study's.
        words: Title, authors, licence.
        version: Of this package.
    """
    path = folder / "CITATION.cff"
    write_atomically(path, citation(words, version=version))
    return path


def citation(words: Words, *, version: str) -> str:
    """Return how films are cited, in YAML; text is quoted as JSON, which YAML reads."""
    authors = [_author(name) for name in words.authors]
    lines = [
        "cff-version: 1.2.0",
        "message: If you use these stimuli in your research, please cite them.",
        "type: dataset",
        f"title: {_quoted(words.title)}",
        f"abstract: {_quoted(words.description)}",
        "authors:",
        *(authors or ["  - name: The makers of these stimuli"]),
    ]
    if words.licence:
        lines.append(f"license: {_quoted(words.licence)}")
    if words.keywords:
        lines.append(f"keywords: [{', '.join(map(_quoted, words.keywords))}]")
    return "\n".join(lines) + "\n" + _REFERENCES.replace("{version}", _quoted(version))


def _author(name: str) -> str:
    """Return an author; the last word is the family name."""
    given, _, family = name.strip().rpartition(" ")
    if not given:
        return f"  - name: {_quoted(family)}"
    return f"  - {{family-names: {_quoted(family)}, given-names: {_quoted(given)}}}"


def _quoted(text: str) -> str:
    """Return text as YAML takes it, whatever it holds."""
    return json.dumps(text, ensure_ascii=False)


# Digests -----------------------------------------------------------------------------------


def write_checksums(folder: Path, files: Iterable[Path]) -> Path:
    """Write the digests of files in the study's folder, by relative path.

    Args:
        folder: The study's.
        files: In it.
    """
    path = folder / CHECKSUMS
    write_atomically(path, _digests(folder, [file for file in files if file != path]))
    return path


def write_inputs(folder: Path, files: Iterable[Path]) -> Path:
    """Write the digests of what a study was made from, by relative path.

    Args:
        folder: The study's.
        files: In it.
    """
    path = folder / INPUTS
    write_atomically(path, _digests(folder, files))
    return path


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _digests(folder: Path, files: Iterable[Path]) -> str:
    """Return digests of files in a folder as sha256sum writes them."""
    names = sorted({file.relative_to(folder).as_posix() for file in files})
    return "".join(f"{digest_of(folder / name)}  {name}\n" for name in names)


def read_digests(path: Path) -> dict[str, str]:
    """Return digests by name from a file in the form of sha256sum; none if it is not there."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return {}
    pairs = (line.partition("  ") for line in lines)
    return {name: digest for digest, sign, name in pairs if sign}
