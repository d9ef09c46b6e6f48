"""Reads the values of recipes from YAML, checking their keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar

from sumo3dviz_pt.errors import ConfigError

_T = TypeVar("_T")


def read_values(kind: type[_T], items: Any, place: str) -> tuple[_T, ...]:
    """Build recipe values from a list of mappings.

    Args:
        kind: The dataclass.
        items: Mappings of its fields.
        place: What messages call the list, such as `recipe.panels`.

    Raises:
        ConfigError: If a key is unknown or missing, or an item is no mapping.
    """
    return tuple(read_value(kind, item, f"{place}[{k}]") for k, item in enumerate(items))


def read_value(kind: type[_T], content: Any, place: str) -> _T:
    """Build a recipe value, a dataclass, from a mapping.

    Args:
        kind: The dataclass.
        content: A mapping of its fields.
        place: What messages call it, such as `recipe.panels[2]`.

    Raises:
        ConfigError: If a key is unknown or missing, or there is no mapping.
    """
    if not isinstance(content, Mapping):
        raise ConfigError("must be a mapping", key=place)
    known: dict[str, Any] = {field.name: field for field in fields(kind)}  # type: ignore[arg-type]
    unknown = sorted(set(content) - set(known))
    needed = {n for n, f in known.items() if f.default is MISSING}
    missing = sorted(needed - set(content))
    if unknown or missing:
        word = f"unknown key {unknown[0]!r}" if unknown else f"key {missing[0]!r} is missing"
        raise ConfigError(word, key=place)
    return kind(**{name: _tuples(value) for name, value in content.items()})


def _tuples(value: Any) -> Any:
    """Turn lists into tuples, all the way down."""
    return tuple(_tuples(item) for item in value) if isinstance(value, list | tuple) else value
