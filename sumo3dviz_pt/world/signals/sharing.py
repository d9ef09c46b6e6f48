"""Heads for people on foot hang on a pole that stands beside theirs anyway."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.world.signals.heads import Head, Support

_NEAR = 2.6  # a pole this near is shared [m]
_LEVEL = 0.6  # poles whose feet differ by more in height are not shared [m]
_APART = np.cos(np.radians(50.0))  # heads on one pole look into directions that differ by more


@dataclass(slots=True)
class _Pole:
    """A support with its heads.

    Attributes:
        support: What carries them.
        heads: Their numbers.
    """

    support: Support
    heads: list[int]


def with_shared_poles(
    heads: Sequence[Head], supports: Sequence[Support]
) -> tuple[list[Head], list[Support]]:
    """Return heads and supports with few poles where people cross.

    A pole with a single head for people on foot is left out where another pole stands near,
    and no head on that looks into a similar direction; the head hangs on it instead.

    Args:
        heads: All of them, each at the foot of its support.
        supports: All of them.
    """
    made = list(heads)
    by_foot: dict[bytes, list[int]] = {}
    for number, head in enumerate(heads):
        by_foot.setdefault(head.foot.tobytes(), []).append(number)
    poles = [_Pole(support, by_foot.get(support.foot.tobytes(), [])) for support in supports]
    kept = [pole for pole in poles if not _may_move(pole, heads)]
    for pole in poles:
        if not _may_move(pole, heads):
            continue
        other = _host(pole, kept, made)
        if other is None:
            kept.append(pole)
            continue
        (number,) = pole.heads
        foot = other.support.foot
        hung = made[number].position - made[number].foot + foot
        made[number] = replace(made[number], position=hung, foot=foot)
        other.heads.append(number)
    return made, [pole.support for pole in poles if any(pole is one for one in kept)]


def _may_move(pole: _Pole, heads: Sequence[Head]) -> bool:
    """Whether a pole carries nothing but one head for people on foot."""
    return len(pole.heads) == 1 and heads[pole.heads[0]].walks


def _host(pole: _Pole, others: Sequence[_Pole], heads: Sequence[Head]) -> _Pole | None:
    """The nearest pole that can take a pole's head, or None."""
    yaw = heads[pole.heads[0]].yaw
    found = []
    for other in others:
        step = other.support.foot - pole.support.foot
        similar = any(np.cos(heads[k].yaw - yaw) > _APART for k in other.heads)
        away = round(float(np.hypot(step[0], step[1])), 6)
        if away <= _NEAR and abs(step[2]) <= _LEVEL and not similar and not other.support.rail:
            found.append((away, other))
    return min(found, key=lambda one: one[0])[1] if found else None
