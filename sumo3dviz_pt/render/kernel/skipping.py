"""Work that packets of lanes skip where none of them wants it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr


def where(
    active: Any,
    given: tuple[Any, ...],
    found: Callable[..., tuple[Any, ...]],
    otherwise: tuple[Any, ...],
) -> tuple[Any, ...]:
    """Return what a function finds for lanes that want it, and other values for the rest.

    Args:
        active: Which lanes want it.
        given: The function's arguments.
        found: The function; it returns as many values as `otherwise` has.
        otherwise: Values of the other lanes.
    """

    def skipped(*all_given: Any) -> tuple[Any, ...]:
        return all_given[-len(otherwise) :]

    def wanted(*all_given: Any) -> tuple[Any, ...]:
        return found(*all_given[: -len(otherwise)])

    result: tuple[Any, ...] = dr.if_stmt((*given, *otherwise), active, wanted, skipped)
    return result
