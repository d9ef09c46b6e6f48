"""Checks the choices of commands and programs as a scene file is checked.

The types of a dataclass's fields say what each may be; nothing wrong gets further than its
making, and what is wrong is one of our errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, get_type_hints

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, create_model

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.errors import Source, explained, reason
from sumo3dviz_pt.job.plain import plain
from sumo3dviz_pt.job.values import MOST_TEXT

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
    given = {item.name: getattr(choices, item.name) for item in fields(choices)}
    given = {
        name: value if is_dataclass(value) else plain(value, key=name)
        for name, value in given.items()
    }
    try:
        found = model.model_validate(given)
    except ValidationError as error:
        raise explained(error, model, _NOWHERE) from error
    for name in given:
        object.__setattr__(choices, name, getattr(found, name))


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
    found, _ = split(kind, kind, choices)
    return found


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
