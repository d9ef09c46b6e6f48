"""Smoothers by name: each registers itself where it is defined."""

from __future__ import annotations

from collections.abc import Callable

from sumo3dviz_pt.model.trajectory import Piece
from sumo3dviz_pt.motion.samples import Samples

Smoother = Callable[[Samples], Piece]
"""Makes continuous motion of an unbroken stretch of two samples or more."""

SMOOTHERS: dict[str, Smoother] = {}
"""Filled at import, read afterwards."""


def register(name: str) -> Callable[[Smoother], Smoother]:
    """Offer a smoother under a name that users choose."""

    def enter(smoother: Smoother) -> Smoother:
        SMOOTHERS[name] = smoother
        return smoother

    return enter
