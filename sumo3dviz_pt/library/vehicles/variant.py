"""Vehicles that vary another one: a taxi is an estate with a sign."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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
