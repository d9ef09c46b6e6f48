"""How a set of stimuli is cited, and the digests by which anybody can check it.

References:
    Citation File Format 1.2.0: doi:10.5281/zenodo.5171937
    checksums are in the form of sha256sum: `sha256sum -c checksums.sha256` checks them
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import Words
from sumo3dviz_pt.files.whole import write_whole

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
    write_whole(path, citation(words, version=version))
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
    write_whole(path, _digests(folder, [file for file in files if file != path]))
    return path


def write_inputs(folder: Path, files: Iterable[Path]) -> Path:
    """Write the digests of what a study was made from, by relative path.

    Args:
        folder: The study's.
        files: In it.
    """
    path = folder / INPUTS
    write_whole(path, _digests(folder, files))
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
