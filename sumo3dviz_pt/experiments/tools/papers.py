"""How a set of stimuli is cited, and the digests by which anybody can check it.

References:
    Citation File Format 1.2.0: doi:10.5281/zenodo.5171937
    checksums are in the form of sha256sum: `sha256sum -c checksums.sha256` checks them
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
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
    names = sorted({file.relative_to(folder).as_posix() for file in files} - {CHECKSUMS})
    write_whole(path, _lines({name: digest_of(folder / name) for name in names}))
    return path


def write_inputs(folder: Path, digests: Mapping[str, str]) -> Path:
    """Write the digests of what a study was made from.

    Args:
        folder: The study's.
        digests: SHA-256 by name.
    """
    path = folder / INPUTS
    write_whole(path, _lines(dict(sorted(digests.items()))))
    return path


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _lines(digests: Mapping[str, str]) -> str:
    """Return digests as sha256sum writes them."""
    return "".join(f"{digest}  {name}\n" for name, digest in digests.items())
