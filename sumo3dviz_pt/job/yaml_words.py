"""Says what is wrong with a document that is no YAML, and what to do."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from sumo3dviz_pt.errors import ConfigError, cut

_QUOTE = "put the text in quotes"

_WORDS: tuple[tuple[str, str], ...] = (
    (
        "mapping values are not allowed",
        "a ':' may not stand here; indent the line as those above, end every key with ': ',"
        " and put text that holds ': ' in quotes",
    ),
    (
        "could not find expected ':'",
        "no ': ' follows this key; add it with a value, or indent the line like those above",
    ),
    ("character '\\\\t' that cannot start", "a tab stands here; indent with spaces"),
    ("tab character", "a tab stands here; indent with spaces"),
    (
        "character '(.+)' that cannot start",
        f"no text begins with {{0}} without quotes; {_QUOTE}",
    ),
    ("expected <block end>", "this line does not fit those above; indent it as they are"),
    ("expected ',' or '(.)'", "a bracket is not closed by {0}, or a comma is missing"),
    (
        "while scanning a quoted scalar.*end of",
        "a quote is opened here and closed nowhere; close it",
    ),
    ("undefined alias '(.*)'", "*{0} stands for what is marked by &{0}, and nothing is; mark it"),
    ("duplicate anchor '(.*)'", "&{0} marks two things; rename one"),
    (
        "scanning an (?:alias|anchor)",
        f"a * or & has a meaning of its own in YAML; {_QUOTE} if it is none",
    ),
    ("for merging", "<< lays a mapping into this one; give it a mapping"),
    (
        "escape",
        "after a backslash in double quotes stands no letter that YAML knows;"
        " use single quotes, or / in paths",
    ),
    ("sequence entries are not allowed", "a list's '-' may not stand here; begin a new line"),
    ("expected the node content", "a value is missing here; add one"),
    ("single document|<document start>", "a second document begins here; keep one"),
    ("scanning a block scalar", f"after | or > stands no text in the same line; {_QUOTE}"),
    ("directive|incompatible YAML", "a line that begins with % is a directive; remove it"),
    ("tag", f"a ! begins a tag; remove it, or {_QUOTE}"),
)
"""Patterns of PyYAML's messages and what they mean; the first that fits counts."""

_OTHERWISE = "look at the indentation, quotes and brackets here"

_AT_BEGIN = re.compile("simple key|quoted scalar|flow sequence|flow mapping|alias|anchor|tag")
"""Things whose fault lies where they begin, not where PyYAML noticed it."""


def explained(error: yaml.YAMLError, text: str, *, file: str | Path | None) -> ConfigError:
    """Return PyYAML's error as one of ours, with its place.

    Args:
        error: PyYAML's.
        text: The document.
        file: Where it stands, for messages.
    """
    if isinstance(error, yaml.reader.ReaderError):
        return _unreadable(error, text, file)
    assert isinstance(error, yaml.MarkedYAMLError)
    said = " ".join(filter(None, (error.context, error.problem)))
    found = ((re.search(pattern, said, re.S), words) for pattern, words in _WORDS)
    fits = next(((match, words) for match, words in found if match), None)
    words = _OTHERWISE if fits is None else fits[1].format(*map(cut, fits[0].groups()))
    mark = error.problem_mark
    if error.context_mark is not None and _AT_BEGIN.search(error.context or ""):
        mark = error.context_mark
    return ConfigError(
        f"this is not valid YAML: {words}",
        file=file,
        line=mark.line + 1 if mark else None,
        column=mark.column + 1 if mark else None,
    )


def _unreadable(error: yaml.reader.ReaderError, text: str, file: str | Path | None) -> ConfigError:
    """Return a character that no text holds."""
    before = text[: error.position]
    return ConfigError(
        f"this is not valid YAML: the character {text[error.position]!a} stands here;"
        " remove it, or save the file as plain text",
        file=file,
        line=before.count("\n") + 1,
        column=len(before) - before.rfind("\n"),
    )
