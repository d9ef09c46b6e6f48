"""Smoothers by name: each registers itself where it is defined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sumo3dviz_pt.motion.front import Front
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting

Make = Callable[[LoggedSamples, Setting], Front]
"""Makes continuous motion of the front of an unbroken stretch of two samples or more."""


@dataclass(frozen=True, slots=True)
class Smoother:
    """A way to make continuous motion.

    Attributes:
        make: Does it.
        heads: Whether it has a rule of its own for headings; else bodies follow their fronts.
    """

    make: Make
    heads: bool = False


SMOOTHERS: dict[str, Smoother] = {}
"""Filled at import, read afterwards."""


def register(name: str, *, heads: bool = False) -> Callable[[Make], Make]:
    """Offer a smoother under a name that users choose."""

    def enter(make: Make) -> Make:
        SMOOTHERS[name] = Smoother(make, heads)
        return make

    return enter
