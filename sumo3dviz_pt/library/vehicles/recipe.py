"""Reads recipes of vehicles as frozen values whose types are checked."""

from __future__ import annotations

from functools import cache
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from sumo3dviz_pt.errors import ConfigError, cut

_T = TypeVar("_T")


def read_value(kind: type[_T], content: Any) -> _T:
    """Read a recipe.

    Args:
        kind: A dataclass, which may hold others; all of them are `RecipeValue`.
        content: What stands under `recipe`.

    Raises:
        ConfigError: If a key is unknown or missing, or a value is of the wrong kind; it names
            the place, such as `recipe.panels[2]`.
    """
    try:
        value: _T = _reader(kind).validate_python(content)  # type: ignore[arg-type]
    except ValidationError as error:
        raise _explained(error) from None
    return value


@cache
def _reader(kind: type[Any]) -> TypeAdapter[Any]:
    """The checks of a kind of value; to make them costs more than to read a recipe."""
    return TypeAdapter(kind)


def _explained(error: ValidationError) -> ConfigError:
    """The first complaint about a recipe, in our words."""
    first = error.errors(include_url=False)[0]
    place, kind = first["loc"], first["type"]
    if kind == "unexpected_keyword_argument":
        return ConfigError(f"unknown key {place[-1]!r}", key=_key(place[:-1]))
    if kind == "missing":
        found = "too few values" if isinstance(place[-1], int) else f"key {place[-1]!r} is missing"
        return ConfigError(found, key=_key(place[:-1]))
    if kind == "dataclass_type":
        return ConfigError("must be a mapping", key=_key(place))
    return ConfigError(f"{first['msg']}, not {cut(repr(first['input']))}", key=_key(place))


def _key(place: tuple[int | str, ...]) -> str:
    """A place as messages name it."""
    return "recipe" + "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in place)
