"""Says what is wrong with a setting or a choice, in words that users know and with its place.

Choices of commands and programs are checked as a scene file is. They are dataclasses, and the types
of their fields say what each may be. So nothing wrong gets further than its making, and what is
wrong is one of our errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, create_model

from sumo3dviz_pt import catalog
from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.job.values import MOST_TEXT, mode_of, models_in
from sumo3dviz_pt.job.yaml12 import KeyPath, Places, plain

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

_OF_KEY = "[key]"
"""What pydantic adds to the location of a key of a mapping that is wrong itself."""


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
    paths = [_followed(model, _location(problem))[0] for problem in problems]
    path, first = _deepest(paths, problems)
    same = [each for each, its in zip(problems, paths, strict=True) if its == path]
    message = " or ".join(_alternatives(same)) + _shown(first)
    if first["type"] == "extra_forbidden":
        siblings = _keys(_followed(model, first["loc"][:-1])[1])
        message = f"this key is unknown{catalog.did_you_mean(str(path[-1]), siblings)}"
    elif _takes_preset(_followed(model, first["loc"])[1], first):
        message += f"; a preset is named by {'.'.join(map(str, path))}.preset={first['input']}"
    others = len({other for other in paths if not _alike(other, path)})
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
    key = ".".join(map(str, path)) or None
    return ConfigError(message, key=key, file=source.file, line=place[0], column=place[1])


def reason(problem: Mapping[str, Any]) -> str:
    """Return one of pydantic's problems in our words."""
    return _words(problem) + _shown(problem)


def _deepest(paths: Sequence[KeyPath], problems: Sequence[Any]) -> tuple[KeyPath, Any]:
    """Return the first problem and its path; of branches of a union, the one that came furthest."""
    start = paths[0]
    branches = [
        each for each in zip(paths, problems, strict=True) if each[0][: len(start)] == start
    ]
    return max(branches, key=lambda each: len(each[0]))


def _alike(path: KeyPath, other: KeyPath) -> bool:
    """Return whether one path lies on the other."""
    shared = min(len(path), len(other))
    return path[:shared] == other[:shared]


def _alternatives(problems: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what a value may be, where it may be several things."""
    sentences = list(dict.fromkeys(map(_words, problems)))
    return sentences[:1] + [words.removeprefix(_SHOULD) for words in sentences[1:]]


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


def _location(problem: Mapping[str, Any]) -> tuple[str | int, ...]:
    """Return where a problem is, for pydantic; a key that is wrong itself stands there, too."""
    location: tuple[str | int, ...] = problem["loc"]
    of_key = location[-1:] == (_OF_KEY,) and problem["type"] != "extra_forbidden"
    return location[:-1] if of_key else location


def _followed(kind: Any, location: Sequence[str | int]) -> tuple[KeyPath, Any]:
    """Follow one of pydantic's locations, whose parts are keys and names of branches of unions.

    Args:
        kind: The type in which it begins.
        location: As pydantic tells it.

    Returns:
        The keys alone, and the type that stands there; None where there is none.
    """
    path: list[str | int] = []
    for part in location:
        options = _options(kind)
        if len(options) > 1:
            named = (option for option in options if part in _names(option))
            kind = next(named, None)
        else:
            path.append(part)
            kind = _inner(options[0], part)
    return tuple(path), kind


def _options(kind: Any) -> list[Any]:
    """Return the types that a union may be; the type itself if it is none."""
    if get_origin(kind) is Annotated:
        return _options(get_args(kind)[0])
    if get_origin(kind) in (Union, UnionType):
        return [option for option in get_args(kind) if option is not NoneType]
    return [kind]


def _names(option: Any) -> tuple[str | None, ...]:
    """Return what pydantic may call a branch that is a model."""
    return tuple(name for model in _models(option) for name in (mode_of(model), model.__name__))


def _models(kind: Any) -> list[type[BaseModel]]:
    """Return a type, without what is said about it, in a list if it is a model."""
    (kind, *others) = _options(kind)
    return [kind] if not others and isinstance(kind, type) and issubclass(kind, BaseModel) else []


def _inner(kind: Any, part: str | int) -> Any:
    """Return the type of what stands under a key or in a place of a list."""
    for model in _models(kind):
        fields = model.model_fields.items()
        named = (field for name, field in fields if part in (name, field.alias))
        return next((field.annotation for field in named), None)
    inner = [each for each in get_args(kind) if each is not Ellipsis]
    if isinstance(part, int) and part < len(inner):
        return inner[part]
    return inner[-1] if inner else None


def _keys(kind: Any) -> list[str]:
    """Return the names that a type takes, if it is a model."""
    return [
        field.alias or name for model in _models(kind) for name, field in model.model_fields.items()
    ]


def _takes_preset(kind: Any, problem: Mapping[str, Any]) -> bool:
    """Return whether one word stands where a model with a key `preset` should."""
    return isinstance(problem["input"], str) and "preset" in _keys(kind)


_T = TypeVar("_T")
_U = TypeVar("_U")

_NOWHERE = Source(None, {})


def settle(choices: Any) -> None:
    """Check the fields of a frozen dataclass, and give each its own type.

    Args:
        choices: Just made; call this in its `__post_init__`.

    Raises:
        ConfigError: If one is of a wrong type or out of range; names it.
    """
    model = _model_of(choices.__class__)
    values = {item.name: getattr(choices, item.name) for item in fields(choices)}
    values = {
        name: value if is_dataclass(value) else plain(value, key=name)
        for name, value in values.items()
    }
    try:
        settled = model.model_validate(values)
    except ValidationError as error:
        raise explained(error, model, _NOWHERE) from error
    for name in values:
        object.__setattr__(choices, name, getattr(settled, name))


def asked(kind: Any, value: Any, *, key: str) -> Any:
    """Return a single value of a type, such as `Seconds`.

    Args:
        kind: The type.
        value: What was given for it.
        key: What messages call it.

    Raises:
        ConfigError: If it is none.
    """
    try:
        return TypeAdapter(kind).validate_python(plain(value, key=key))
    except ValidationError as error:
        raise ConfigError(reason(error.errors()[0]), key=key) from error


def made(kind: type[_T], choices: Mapping[str, Any]) -> _T:
    """Return a dataclass from choices by name.

    Raises:
        ConfigError: If a name is unknown, and suggests one, or a value is wrong.
    """
    value, _ = split(kind, kind, choices)
    return value


def split(one: type[_T], other: type[_U], choices: Mapping[str, Any]) -> tuple[_T, _U]:
    """Return two dataclasses from choices by name, each with those of its own fields.

    Args:
        one: A dataclass.
        other: Another one, or the same.
        choices: Values by name of a field.

    Raises:
        ConfigError: If a name is unknown, and suggests one, or a value is wrong.
    """
    names = [[item.name for item in fields(kind)] for kind in (one, other)]  # type: ignore[arg-type]
    known = dict.fromkeys([*names[0], *names[1]])
    for name in choices:
        if name not in known:
            raise ConfigError(f"this choice is unknown{did_you_mean(name, known)}", key=name)
    first, second = ({name: choices[name] for name in own if name in choices} for own in names)
    return one(**first), other(**second)


@cache
def _model_of(kind: type) -> type[BaseModel]:
    """Return a pydantic model with the fields of a dataclass."""
    hints = get_type_hints(kind, include_extras=True)
    types: dict[str, Any] = {item.name: (hints[item.name], ...) for item in fields(kind)}
    config = ConfigDict(arbitrary_types_allowed=True, str_max_length=MOST_TEXT)
    return create_model(kind.__name__, __config__=config, **types)
