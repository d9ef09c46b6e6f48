"""Recipes of vehicles as values, what bodies consist of, and vehicles that vary another one.

Recipes are read as frozen values whose types are checked. One vehicle can vary another one: a taxi
is an estate with a sign. Bodies consist of meshes by material, and wheels in their places.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.model.geometry import Mesh

_MORE = "more_"


def varied(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Complete the content of an `asset.yaml` that names another asset as its `base`.

    Args:
        base: Content of the other one.
        own: What differs: its keys replace those of the base, its `recipe` does so key by
            key, and there `more_panels`, `more_strips` and the like go after the base's.

    Returns:
        A whole recipe; `base` is still the name of the other asset.
    """
    recipe = dict(base.get("recipe", {}))
    for key, value in own.get("recipe", {}).items():
        plain = key.removeprefix(_MORE)
        recipe[plain] = value if plain == key else [*recipe.get(plain, ()), *value]
    return {**base, **own, "recipe": recipe}


Meshes = Mapping[str, Mesh]
"""Meshes by material."""

MaterialMesh = tuple[str, Mesh]
"""Material and mesh."""


@dataclass(frozen=True, slots=True)
class WheelPlace:
    """Where a wheel turns.

    Attributes:
        at: Its centre in the body's frame [m].
        radius: Of the tyre [m]; `at` lies as high, so that it stands on the ground.
        steered: Whether it steers.
        reversed: Whether the wheel is mounted inside out, as the outer one of a twin pair is.
    """

    at: tuple[float, float, float]
    radius: float
    steered: bool = False
    reversed: bool = False


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
        why = "too few values" if isinstance(place[-1], int) else f"key {place[-1]!r} is missing"
        return ConfigError(why, key=_key(place[:-1]))
    if kind == "dataclass_type":
        return ConfigError("must be a mapping", key=_key(place))
    return ConfigError(f"{first['msg']}, not {cut(repr(first['input']))}", key=_key(place))


def _key(place: tuple[int | str, ...]) -> str:
    """A place as messages name it."""
    return "recipe" + "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in place)
