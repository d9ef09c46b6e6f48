"""Smoothers by name: each registers itself where it is defined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.front import Front

Make = Callable[[LoggedSamples, Setting], Front]
"""A function that makes continuous motion of the front from two or more unbroken samples."""


@dataclass(frozen=True, slots=True)
class Smoother:
    """A way to make continuous motion.

    Attributes:
        make: The function that makes the motion.
        heads: Whether it has its own rule for headings; else bodies follow their fronts.
    """

    make: Make
    heads: bool = False


SMOOTHERS: dict[str, Smoother] = {}
"""Smoothers by the name that users choose; filled at import, only read afterwards."""


def register(name: str, *, heads: bool = False) -> Callable[[Make], Make]:
    """Register a smoother under the name that users choose."""

    def enter(make: Make) -> Make:
        SMOOTHERS[name] = Smoother(make, heads)
        return make

    return enter
