"""Former names of keys of scene files: each is understood, and a note tells its present name."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

log = logging.getLogger(__name__)

Names = Mapping[str, str]
"""What the last word of a key is now, by the dotted key as it was; `*` is any word before that."""

RENAMED: Names = MappingProxyType({})
"""Keys that had another name in a published version; a row stays until the next major version."""


def with_present_names(settings: Mapping[str, Any], *, names: Names = RENAMED) -> dict[str, Any]:
    """Return settings whose keys have their present names; those that had not are noted.

    Args:
        settings: As in a scene file, or values by dotted key that are laid over one.
        names: What was renamed.
    """
    for former, present in names.items():
        words = former.split(".")
        renamed = _renamed(settings, words, present)
        if renamed != settings:
            now = ".".join([*words[:-1], present])
            note = f"the key {former} of scene files is called {now} now; its old name will go"
            log.warning("%s", note, extra={"once": note})
        settings = renamed
    return dict(settings)


def _renamed(here: Any, words: list[str], present: str) -> Any:
    """Return a value with a present name in the place of a former one, wherever it stands below.

    Args:
        here: The value; mappings and lists hold others.
        words: Of the former name, from here on.
        present: What its last word is now.
    """
    if isinstance(here, list | tuple) and words[0] == "*" and words[1:]:
        return [_renamed(item, words[1:], present) for item in here]
    if not isinstance(here, Mapping):
        return here
    result: dict[str, Any] = {}
    for key, value in here.items():
        path = str(key).split(".")
        same = all(word in ("*", part) for word, part in zip(words, path, strict=False))
        if same and len(path) >= len(words):
            path[len(words) - 1] = present
            result[".".join(path)] = value
        else:
            result[key] = _renamed(value, words[len(path) :], present) if same else value
    return result
