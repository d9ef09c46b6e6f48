"""Says what is wrong with a setting, in words that users know and with its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.job.values import mode_of, models_in
from sumo3dviz_pt.job.yaml12 import KeyPath, Places

_MODES = tuple(str(mode_of(model)) for model in models_in(CameraSettings))
"""The words that choose a camera's settings."""

_WORDS: Mapping[str, str] = {
    "missing": "this key is missing",
    "string_type": "this should be text",
    "string_too_long": "this text should have at most {max_length} characters",
    "bool_type": "this should be a boolean, true or false",
    "bool_parsing": "this should be a boolean, true or false",
    "int_type": "this should be a valid integer",
    "int_parsing": "this should be a valid integer",
    "int_parsing_size": "this should be a valid integer",
    "int_from_float": "this should be a valid integer",
    "float_type": "this should be a valid number",
    "float_parsing": "this should be a valid number",
    "path_type": "this should be a file's name",
    "model_type": "this should be keys with values",
    "model_attributes_type": "this should be keys with values",
    "dict_type": "this should be keys with values",
    "tuple_type": "this should be a list, such as [1, 2]",
    "too_long": "this should have at most {max_length} items, and it has {actual_length}",
    "too_short": "this should have at least {min_length} item, and it has {actual_length}",
    "union_tag_invalid": "its mode should be one of {expected_tags}, not '{tag}'",
    "union_tag_not_found": f"the key 'mode' is missing: {', '.join(_MODES[:-1])} or {_MODES[-1]}",
    "invalid_key": "a key should be text",
}
"""Pydantic's kinds of errors in words that users know."""

_SHOULD = "this should be "

_BRANCHES = ("float", "tuple", "TableSettings")
"""Pydantic's names of what a union may be, where they hold no bracket."""


@dataclass(frozen=True, slots=True)
class Source:
    """Where settings came from, for messages."""

    file: Path | None
    places: Places


def explained(error: ValidationError, model: type[BaseModel], source: Source) -> ConfigError:
    """Return the first problem as one sentence, with its place and the number of others.

    Args:
        error: Pydantic's.
        model: What was to be made.
        source: Where the settings stand.
    """
    # A misspelt key that is required is also missing; its spelling explains both.
    problems = sorted(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    first = _deepest(problems)
    path = _path(first)
    message = " or ".join(_alternatives([p for p in problems if _path(p) == path]))
    message += _shown(first)
    if first["type"] == "extra_forbidden":
        hint = catalog.did_you_mean(str(path[-1]), _siblings(model, first["loc"]))
        message = f"this key is unknown{hint}"
    others = len({_path(problem) for problem in problems if not _alike(_path(problem), path)})
    return located(message + (f" (and {others} more)" if others else ""), path, source)


def located(message: str, path: KeyPath, source: Source) -> ConfigError:
    """Return an error with the place of its key in the file, or of the nearest key above.

    Args:
        message: What is wrong.
        path: The keys that lead there.
        source: Where the settings stand.
    """
    place = next(
        (source.places[path[:n]] for n in range(len(path), 0, -1) if path[:n] in source.places),
        (None, None),
    )
    key = ".".join(map(_key_shown, path)) or None
    return ConfigError(message, key=key, file=source.file, line=place[0], column=place[1])


def _key_shown(part: str | int) -> str:
    """Return a key as one line shows it."""
    text = str(part)
    return text if text.isprintable() else repr(text)


def reason(problem: Mapping[str, Any]) -> str:
    """Return one of pydantic's problems in our words."""
    return _words(problem) + _shown(problem)


def _deepest(problems: Sequence[Any]) -> Any:
    """Return the first problem; of branches of a union, the one that came furthest."""
    path = _path(problems[0])
    branches = [problem for problem in problems if _path(problem)[: len(path)] == path]
    return max(branches, key=lambda problem: len(_path(problem)))


def _path(problem: Mapping[str, Any]) -> KeyPath:
    """Return the keys that lead to a problem."""
    return tuple(part for part in problem["loc"] if not _is_branch(part))


def _alike(path: KeyPath, other: KeyPath) -> bool:
    """Return whether one path lies on the other."""
    shared = min(len(path), len(other))
    return path[:shared] == other[:shared]


def _is_branch(part: str | int) -> bool:
    """Return whether a part of pydantic's location names a branch of a union, not a key."""
    return isinstance(part, str) and (part in _MODES or "[" in part or part in _BRANCHES)


def _alternatives(problems: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what a value may be, where it may be several things."""
    said = list(dict.fromkeys(map(_words, problems)))
    return said[:1] + [words.removeprefix(_SHOULD) for words in said[1:]]


def _words(problem: Mapping[str, Any]) -> str:
    """Return what is wrong, without the value."""
    context = problem.get("ctx", {})
    if problem["type"] in _WORDS:
        known = {key: value for key, value in context.items() if not isinstance(value, Exception)}
        return _WORDS[problem["type"]].format(**known)
    text = str(problem["msg"]).removeprefix("Value error, ")
    return text.replace("Input should be ", _SHOULD)


def _shown(problem: Mapping[str, Any]) -> str:
    """Return the value at fault, where it is short and the words do not hold it yet."""
    value = problem.get("input")
    silent = ("value_error", "missing", "too_long", "too_short", "string_too_long")
    if problem["type"] in (*silent, "union_tag_invalid") or not isinstance(
        value, str | int | float | bool | None
    ):
        return ""
    text = "null" if value is None else cut(str(value) if isinstance(value, bool) else repr(value))
    quote = problem["type"] == "string_type" and isinstance(value, int | float)
    return f", not {text}; put it in quotes" if quote else f", not {text}"


# Keys that are known -----------------------------------------------------------------------


def _siblings(model: Any, location: Sequence[str | int]) -> list[str]:
    """Return the keys that are known where an unknown one stands."""
    for part in location[:-1]:
        model = _descend(model, part)
        if model is None:
            return []
    return _keys(model)


def _keys(model: Any) -> list[str]:
    """Return the names that a model takes."""
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        return []
    return [field.alias or name for name, field in model.model_fields.items()]


def _descend(model: Any, part: str | int) -> Any:
    """Return the model behind one part of a location."""
    if isinstance(part, int):
        return model
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        options = models_in(model)
        named = [m for m in options if isinstance(part, str) and mode_of(m) == part]
        return named[0] if named else (options[0] if len(options) == 1 else model)
    field = model.model_fields.get(str(part))
    if field is None:
        return None
    models = models_in(field.annotation)
    if len(models) == 1 and get_origin(field.annotation) is not dict:
        return models[0]
    return get_args(field.annotation) or None
