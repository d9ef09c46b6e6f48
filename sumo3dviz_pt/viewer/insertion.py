"""Adds an entry to the `cameras:` of a YAML text without touching anything else in it.

The parser's events say where the last camera ends, to the character; comments, blank lines
and line ends stay as they are. Whether the result says what it should is for the caller to
check: this module only finds the place.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from sumo3dviz_pt.errors import ConfigError

_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
"""Line breaks as YAML's scanner sees them."""

_STEP = 2
"""Spaces of each level, in what is inserted and where the file itself shows no level."""


@dataclass(frozen=True, slots=True)
class _InsertionPlace:
    """Where an entry goes.

    Attributes:
        index: Of the character before which it is inserted; a line begins there, or the
            text ends.
        column: Of `cameras`.
        step: Spaces by which each level is indented.
        head: Whether `cameras:` itself is missing.
    """

    index: int
    column: int
    step: int
    head: bool = False


def inserted(text: str, entry: str, *, file: Path | None = None) -> tuple[str, int]:
    """Return a scene file's text with one more camera after the others.

    Args:
        text: Valid YAML.
        entry: The camera's name and settings, indented by twos.
        file: For messages.

    Returns:
        The new text, and the line of it in which the camera's name stands, from 1.

    Raises:
        ConfigError: If cameras are not written line by line; names the line.
    """
    place = _place(text, file)
    before, after = text[: place.index], text[place.index :]
    newline = _newline(text, place.index)
    lines = textwrap.dedent(entry).splitlines()
    added = ["cameras:"] if place.head else []
    added = [" " * place.column + line for line in added]
    added += [_indented(line, place) for line in lines]
    # The last line of the file may lack its end.
    gap = newline if before and not _BREAK.fullmatch(before[-1]) else ""
    line = len(_BREAK.findall(before + gap)) + (2 if place.head else 1)
    return before + gap + newline.join([*added, ""]) + after, line


def _indented(line: str, place: _InsertionPlace) -> str:
    """Return a line of an entry at the depth that the file's other cameras have."""
    words = line.lstrip(" ")
    level = 1 + (len(line) - len(words)) // _STEP
    return " " * (place.column + place.step * level) + words


def _newline(text: str, index: int) -> str:
    """Return the last line end before a place, or else in the text."""
    ends = _BREAK.findall(text[:index]) or _BREAK.findall(text)
    return ends[-1] if ends and ends[-1] in ("\r\n", "\r") else "\n"


def _place(text: str, file: Path | None) -> _InsertionPlace:
    """Find where the next camera goes."""
    events = list(yaml.parse(text, Loader=yaml.SafeLoader))
    root = next((event for event in events if isinstance(event, yaml.NodeEvent)), None)
    if not isinstance(root, yaml.MappingStartEvent) or root.flow_style:
        raise _by_hand("the file is written in braces", root, file)
    number = events.index(root) + 1
    column = _start(events[number]).column
    while not isinstance(events[number], yaml.MappingEndEvent):
        key, value = number, _after(events, number)
        number = _after(events, value)
        name = events[key]
        if isinstance(name, yaml.ScalarEvent) and name.value == "cameras":
            return _within(text, name, events[value:number], file)
    return _InsertionPlace(_foot(text, events), column, _STEP, head=True)


def _after(events: Sequence[yaml.Event], number: int) -> int:
    """Return the number of the event after a node."""
    depth = 0
    while True:
        event = events[number]
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        number += 1
        if not depth:
            return number


def _within(
    text: str, key: yaml.Event, value: Sequence[yaml.Event], file: Path | None
) -> _InsertionPlace:
    """Return where the next camera goes under `cameras:`."""
    first, column = value[0], _start(key).column
    if isinstance(first, yaml.ScalarEvent) and _start(first).index == _end(first).index:
        index = _after_comments(text, _line_after(text, _end(key).index), column + 1)
        return _InsertionPlace(index, column, _STEP)
    if not isinstance(first, yaml.MappingStartEvent) or first.flow_style or len(value) < 3:
        raise _by_hand("cameras are not written line by line", key, file)
    entries = _start(value[1]).column
    # Block collections end where the next token begins, after any comments.
    ends = [
        _end(event).index
        for event in value
        if not (_ends_a_block(event) or isinstance(event, yaml.CollectionStartEvent))
    ]
    index = _after_comments(text, _line_after(text, max(ends)), entries)
    return _InsertionPlace(index, column, entries - column)


def _ends_a_block(event: yaml.Event) -> bool:
    """Return whether an event ends a collection without a bracket."""
    ends = isinstance(event, yaml.CollectionEndEvent)
    return bool(ends and _start(event).index == _end(event).index)


def _line_after(text: str, index: int) -> int:
    """Return where the line after a place starts, or its own line if nothing stands before it."""
    begin = max((found.end() for found in _BREAK.finditer(text, 0, index)), default=0)
    if not text[begin:index].strip(" "):
        return begin
    found = _BREAK.search(text, index)
    return len(text) if found is None else found.end()


def _after_comments(text: str, index: int, column: int) -> int:
    """Skip comments that are indented at least as far as a column: they belong to cameras."""
    here = index
    while here < len(text):
        found = _BREAK.search(text, here)
        following = len(text) if found is None else found.end()
        line = text[here:following]
        words = line.strip()
        if words.startswith("#") and len(line) - len(line.lstrip(" ")) >= column:
            index = following
        elif words:
            break
        here = following
    return index


def _foot(text: str, events: Sequence[yaml.Event]) -> int:
    """Return where a further key goes: at the end of the document."""
    end = next(event for event in events if isinstance(event, yaml.DocumentEndEvent))
    return _start(end).index if end.explicit else len(text)


def _start(event: yaml.Event) -> yaml.Mark:
    """Return where an event begins."""
    assert isinstance(event.start_mark, yaml.Mark)
    return event.start_mark


def _end(event: yaml.Event) -> yaml.Mark:
    """Return where an event ends."""
    assert isinstance(event.end_mark, yaml.Mark)
    return event.end_mark


def _by_hand(reason: str, event: yaml.Event | None, file: Path | None) -> ConfigError:
    """Return an error that says what to do instead."""
    line = _start(event).line + 1 if event is not None else None
    message = f"{reason}; paste the camera's text there by hand"
    return ConfigError(message, key="cameras", file=file, line=line)
