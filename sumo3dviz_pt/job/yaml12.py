"""Reads YAML as people expect it, and turns Python's values into what a scene file can hold.

A scene file holds text, numbers, lists and mappings. PyYAML speaks YAML 1.1, in which `12:30` is
750, `on` is true and a repeated key silently wins. This module resolves scalars by the YAML 1.2
core schema instead, and refuses repeated keys. Keys are always text, so that the edge `-12` is one.
Keys keep their places for messages, which say what is wrong with a document and what to do. What a
document can grow to is bounded: nine lists of nine aliases each are 430 bytes, and 4.5 GB when they
are written out.

References:
    YAML 1.2.2, chapter 10.3 (core schema), https://yaml.org/spec/1.2.2/
"""

from __future__ import annotations

import datetime as dt
import os
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from numbers import Integral, Real
from pathlib import Path
from typing import Any, NoReturn

import yaml
from pydantic import BaseModel

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
    message = " ".join(filter(None, (error.context, error.problem)))
    matches = ((re.search(pattern, message, re.S), words) for pattern, words in _WORDS)
    fits = next(((match, words) for match, words in matches if match), None)
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


KeyPath = tuple[str | int, ...]
Places = dict[KeyPath, tuple[int, int]]

MOST_TEXT = 1_000_000
"""Most characters of a document: about 10,000 key frames."""

MOST_VALUES = 100_000
"""Most keys and values of a document, with every alias written out."""

MOST_DEPTH = 40
"""Most levels of a document."""

_LONGEST_NUMBER = 100
_TAG = "tag:yaml.org,2002:"


class _Loader(yaml.SafeLoader):
    """A safe loader with the core schema's resolvers only."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012

    _in_plain = False

    def scan_plain(self) -> yaml.ScalarToken:
        """Scan text without quotes; in YAML 1.2, a question mark in it ends it nowhere."""
        self._in_plain = True
        try:
            return super().scan_plain()
        finally:
            self._in_plain = False

    def peek(self, index: int = 0) -> str:
        """Look at a character ahead."""
        char = str(super().peek(index))
        return "." if self._in_plain and char == "?" else char


_CORE = (
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF"),
    ("int", r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$", "-+0123456789"),
    (
        "float",
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
        "-+.0123456789",
    ),
    ("null", r"^(?:~|null|Null|NULL|)$", "~nN\0"),
    ("merge", r"^<<$", "<"),
)
for _name, _pattern, _first in _CORE:
    _Loader.add_implicit_resolver(
        _TAG + _name,
        re.compile(_pattern),
        ["" if char == "\0" else char for char in _first],
    )

_FORMS = {_TAG + name: re.compile(pattern) for name, pattern, _ in _CORE}
"""What scalars of a tag look like, also where the tag is written out."""

_KINDS: dict[str, type[yaml.Node]] = {
    **dict.fromkeys([*_FORMS, f"{_TAG}str"], yaml.ScalarNode),
    f"{_TAG}seq": yaml.SequenceNode,
    f"{_TAG}map": yaml.MappingNode,
}
"""What a tag can stand at; there are no others in the core schema."""


def _core_int(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    """Read an integer; a leading zero is decimal in YAML 1.2."""
    text = str(loader.construct_scalar(node))
    return int(text, 0) if text.startswith(("0o", "0x")) else int(text)


def _core_float(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    """Read a real number."""
    return float(
        re.sub(r"^([-+]?)\.(inf|nan)$", r"\1\2", str(loader.construct_scalar(node)).lower())
    )


_Loader.add_constructor(f"{_TAG}int", _core_int)
_Loader.add_constructor(f"{_TAG}float", _core_float)


def parse_yaml(text: str, *, file: str | Path | None = None) -> tuple[Any, Places]:
    """Parse a document.

    Returns:
        The value, in which nothing is shared, and for every key path the line and column,
        from 1, of its key.

    Raises:
        ConfigError: If it is no YAML, a key occurs twice, or it is longer, deeper or larger
            than the bounds of this module.
    """
    if len(text) > MOST_TEXT:
        raise ConfigError(
            f"this is {len(text):,} characters long, and at most {MOST_TEXT:,} are read", file=file
        )
    try:
        return _parsed(text, file)
    except yaml.YAMLError as error:
        raise explained(error, text, file=file) from error
    except RecursionError as error:
        raise ConfigError("this YAML is nested too deeply, or in itself", file=file) from error


def _parsed(text: str, file: str | Path | None) -> tuple[Any, Places]:
    """Return the value and the places of its keys."""
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        walk = _Walk(file)
        if node is not None:
            walk.visit(node, ())
        value = None if node is None else loader.construct_document(node)
        return _apart(value), walk.places
    finally:
        loader.dispose()


class _Walk:
    """A look at all nodes of a document before values are made of them.

    Attributes:
        places: Of all keys.
    """

    def __init__(self, file: str | Path | None) -> None:
        self.places: Places = {}
        self._file = file
        self._count = 0

    def visit(self, node: yaml.Node, path: KeyPath) -> None:
        """Note where every key stands; refuse duplicates, odd tags and too much of anything."""
        self._count += 1
        if self._count > MOST_VALUES or len(path) > MOST_DEPTH:
            self._refuse(
                f"this YAML holds more than {MOST_VALUES:,} values, with its aliases written out"
                if self._count > MOST_VALUES
                else "this YAML is nested too deeply, or in itself",
                node,
            )
        self._check_tag(node)
        if isinstance(node, yaml.SequenceNode):
            for index, item in enumerate(node.value):
                self.places[(*path, index)] = _place(item)
                self.visit(item, (*path, index))
        elif isinstance(node, yaml.MappingNode):
            for key, value in node.value:
                self._enter(key, value, path)

    def _enter(self, key: yaml.Node, value: yaml.Node, path: KeyPath) -> None:
        """Look at a key and its value."""
        if not isinstance(key, yaml.ScalarNode):
            self._refuse("a key is a word, not a list or a mapping; is a quote missing?", key)
        self._check_tag(key)
        if key.tag != f"{_TAG}merge":
            key.tag = f"{_TAG}str"
        here = (*path, str(key.value))
        if here in self.places:
            self._refuse(
                f"the key stands twice, first in line {self.places[here][0]}; remove one", key, here
            )
        self.places[here] = _place(key)
        self.visit(value, here)

    def _check_tag(self, node: yaml.Node) -> None:
        """Refuse what the core schema does not have, or what is not what its tag says."""
        name = node.tag.removeprefix(_TAG)
        if not isinstance(node, _KINDS.get(node.tag, ())):
            self._refuse(
                f"this is not valid YAML: the tag {cut(name)!r} has no meaning here; remove it",
                node,
            )
        if not isinstance(node, yaml.ScalarNode):
            return
        text = str(node.value)
        if any("\ud800" <= char <= "\udfff" for char in text):
            self._refuse("half a character stands here (\\uD800 to \\uDFFF); write it whole", node)
        if node.tag in _FORMS and not _FORMS[node.tag].match(text):
            self._refuse(
                f"this is not valid YAML: {cut(text)!r} is not what its tag {name!r} says", node
            )
        if name in ("int", "float") and len(text) > _LONGEST_NUMBER:
            self._refuse(
                f"a number of {len(text)} characters stands here;"
                f" at most {_LONGEST_NUMBER} are read",
                node,
            )

    def _refuse(self, message: str, node: yaml.Node, path: KeyPath = ()) -> NoReturn:
        """Say what is wrong, and where."""
        line, column = _place(node)
        key = ".".join(map(str, path)) or None
        raise ConfigError(message, key=key, file=self._file, line=line, column=column)


def _place(node: yaml.Node) -> tuple[int, int]:
    """Return the line and column, from 1."""
    return node.start_mark.line + 1, node.start_mark.column + 1


def _apart(value: Any) -> Any:
    """Return a copy in which aliases share nothing: each can be changed alone."""
    if isinstance(value, dict):
        return {key: _apart(item) for key, item in value.items()}
    return [_apart(item) for item in value] if isinstance(value, list) else value


def plain(value: Any, *, key: str | None = None) -> Any:
    """Return a value that may hold tuples, paths, dates, numbers of NumPy and settings.

    Args:
        value: Of any depth.
        key: Where it stands, for messages.

    Raises:
        ConfigError: If it holds what no scene file can hold, or holds itself.
    """
    return _Copy().of(value, () if key is None else (key,))


def as_path(value: Any, *, key: str) -> Path:
    """Return a file's name.

    Raises:
        ConfigError: If it is none.
    """
    if isinstance(value, str | os.PathLike):
        text = os.fspath(value)
        if isinstance(text, str) and text and "\0" not in text:
            return Path(text)
    raise ConfigError(f"this should be a file's name, not {cut(repr(value))}", key=key)


class _Copy:
    """Copies a value, and counts what it holds."""

    def __init__(self) -> None:
        self._count = 0

    def of(self, value: Any, path: tuple[str, ...]) -> Any:
        """Return a copy of a value that stands at a path of keys."""
        self._count += 1
        if self._count > MOST_VALUES or len(path) > MOST_DEPTH:
            raise ConfigError("this holds too much, or itself", key=".".join(path[:3]))
        if isinstance(value, BaseModel):
            value = value.model_dump(by_alias=True, exclude_unset=True)
        if isinstance(value, Mapping):
            return {self._key(k, path): self.of(v, (*path, str(k))) for k, v in value.items()}
        if hasattr(value, "dtype") and hasattr(value, "tolist"):
            value = value.tolist()
        if isinstance(value, Sequence) and not isinstance(value, str | bytes | bytearray):
            return [self.of(item, (*path, str(n))) for n, item in enumerate(value)]
        return self._single(value, path)

    def _key(self, key: Any, path: tuple[str, ...]) -> str:
        """Return a key, which is text; numbers are taken for it."""
        if isinstance(key, int) and not isinstance(key, bool):
            return str(int(key))
        if not isinstance(key, str):
            raise ConfigError(f"a key should be text, not {cut(repr(key))}", key=".".join(path))
        return self._text(key, path)

    def _single(self, value: Any, path: tuple[str, ...]) -> Any:
        """Return a single value."""
        if value is None or isinstance(value, bool | dt.date | dt.time):
            return value
        if isinstance(value, str | os.PathLike):
            return self._text(os.fspath(value), path)
        if isinstance(value, Integral):
            return int(value)
        if isinstance(value, Fraction):
            return value
        if isinstance(value, Real | Decimal):
            return float(value)
        raise self._odd(value, path)

    def _text(self, text: Any, path: tuple[str, ...]) -> str:
        """Return text without halves of characters, which nothing can print or open."""
        if not isinstance(text, str) or any("\ud800" <= char <= "\udfff" for char in text):
            raise self._odd(text, path)
        return str(text)

    def _odd(self, value: Any, path: tuple[str, ...]) -> ConfigError:
        """Return what no scene file can hold."""
        return ConfigError(
            f"no setting can be {cut(ascii(value))} ({type(value).__name__})",
            key=".".join(path) or None,
        )
