"""Smoothers by name: each registers itself where it is defined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sumo3dviz_pt.motion.front import Front
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting

Make = Callable[[LoggedSamples, Setting], Front]
"""A function that makes continuous motion of the front from two or more unbroken samples."""


@dataclass(frozen=True, slots=True)
class Smoother:
    """A way to make continuous motion.

    Attributes:
        make: The function that makes the motion.
        heads: Whether it has its own rule for headings; else bodies follow their fronts.
        blur: Time over which it averages to each side [s].
        raw: Whether it takes samples as they are, also where a road user wiggles at rest.
    """

    make: Make
    heads: bool = False
    blur: float = 0.0
    raw: bool = False


SMOOTHERS: dict[str, Smoother] = {}
"""Smoothers by the name that users choose; filled at import, only read afterwards."""


def register(
    name: str, *, heads: bool = False, blur: float = 0.0, raw: bool = False
) -> Callable[[Make], Make]:
    """Register a smoother under the name that users choose; see `Smoother`."""

    def enter(make: Make) -> Make:
        SMOOTHERS[name] = Smoother(make, heads, blur, raw)
        return make

    return enter
