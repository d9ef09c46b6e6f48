"""Says whether a pair of films differs where its factor acts, and nowhere else.

The limits of light and picture are measured on clean and on spoilt pairs of `examples/crossing`;
docs/certificate.md has the figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.pipeline.certificate.acts import Acts
from sumo3dviz_pt.pipeline.certificate.comparison import (
    Comparison,
    ThingDifference,
    differing_things,
)
from sumo3dviz_pt.pipeline.certificate.light import light_faults, lit_shares
from sumo3dviz_pt.pipeline.films.frames import counted

TYPICAL_LIGHT = 0.02
"""Share by which the light of a typical pixel may differ where a factor does not act."""

TYPICAL_CODES = 2.0
"""By how much a typical pixel of the pictures may be brighter or darker there [8-bit codes]; the
sign counts, so that what an encoder does to single pixels cancels."""

MOST_OVERDRAWN = 5e-4
"""Share of a picture over which something else may be drawn, where it shows the same."""

_FEW = 3

Claim = Literal["proven", "failed", "not judged"]
"""What is claimed of a pair: that it differs where its factors act and nowhere else, that it does
not, or nothing."""


@dataclass(frozen=True, slots=True)
class PairVerdict:
    """What the certificate says of two films.

    Attributes:
        factor: In which they should differ.
        levels: Of the first and the second.
        one, other: Names of the films.
        acts: Where the factor acts, in words.
        faults: What is wrong, a sentence each; none if the pair is clean.
        named: What belongs to the level beside what it is about, such as exposure.
        frames: Numbers of the frames that were compared pixel by pixel.
        differing: Share of their pixels that differ in shape, paint or light.
        wrong: Share of their pixels that differ in shape or paint and should not.
        light: Share by which the light of a typical pixel differs elsewhere; NaN if the factor acts
            on all light.
        codes: By how much a typical pixel of the pictures is brighter or darker there [8-bit
            codes]; NaN if the factor acts on all pictures.
        lit: Shares of the pictures' blocks that are lit otherwise, that are so out of the factor's
            reach, and that may be lit otherwise; NaN if the factor acts on all light.
        things: What differs, object by object.
        picture: File with the two and where they differ, relative to the study's folder; or empty.
        confounds: Which settings the levels change beside what their factor is about.
        not_judged: Why what should be judged cannot be, a sentence each.
        told: How many of the faults accounts tell; pixels tell the others.
        not_tested: What is not looked at, because the factor acts on all of it, a sentence each.
    """

    factor: str
    levels: tuple[str, str]
    one: str
    other: str
    acts: str
    faults: tuple[str, ...]
    named: tuple[str, ...] = ()
    frames: tuple[int, ...] = ()
    differing: float = 0.0
    wrong: float = 0.0
    light: float = 0.0
    codes: float = 0.0
    lit: tuple[float, float, float] = (0.0, 0.0, 0.0)
    things: tuple[ThingDifference, ...] = ()
    picture: str = ""
    confounds: tuple[str, ...] = ()
    not_judged: tuple[str, ...] = ()
    not_tested: tuple[str, ...] = ()
    told: int = 0

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.faults

    @property
    def claim(self) -> Claim:
        """What is claimed of the pair."""
        if self.faults:
            return "failed"
        return "not judged" if self.not_judged else "proven"

    def __str__(self) -> str:
        return f"{self.factor} {self.levels[0]} and {self.levels[1]}: {self.one} and {self.other}"


@dataclass(frozen=True, slots=True)
class PixelVerdict:
    """What pixels say of two films; the attributes are those of `PairVerdict`."""

    faults: tuple[str, ...]
    named: tuple[str, ...]
    differing: float
    wrong: float
    light: float
    codes: float
    lit: tuple[float, float, float]
    things: tuple[ThingDifference, ...]


def untested(acts: Acts) -> tuple[str, ...]:
    """Return what is not looked at in a pair, because its factors act on it, a sentence each."""
    own = "light on what the factor itself acts on, and how it is reflected there"
    cases = (
        (bool(acts.things or acts.looks) and not acts.light, own),
        (bool(acts.things), f"shape and place of {', '.join(acts.things)}"),
        (bool(acts.looks), f"colour of {', '.join(acts.looks)}"),
        (acts.light, "light, shadows and reflections, anywhere: the factor acts on all of them"),
        (acts.develops, "exposure, tone curve and glare, which belong to the level"),
        (acts.motion, "where road users are, and when"),
    )
    return tuple(words for true, words in cases if true)


def pixel_verdict(comparisons: Sequence[Comparison], acts: Acts) -> PixelVerdict:
    """Return what the compared frames of two films say.

    Args:
        comparisons: One for each frame, at least one.
        acts: Where the factor acts.
    """
    things = tuple(differing_things(list(comparisons)))
    nan, free = float("nan"), acts.light or acts.anything
    light = nan if free else _typical([each.elsewhere for each in comparisons])
    signed = [each.elsewhere_codes for each in comparisons]
    codes = nan if acts.develops else abs(_typical(signed))
    wrong = float(np.mean([each.wrong.mean() for each in comparisons]))
    differing = [(each.shape | each.paint | each.light).mean() for each in comparisons]
    blocks = [each.blocks for each in comparisons if each.blocks is not None]
    faults = [*_misplaced(comparisons, things), *light_faults(blocks), *_unlike(light, codes)]
    faults += [] if acts.overlays or acts.motion else _overdrawn(comparisons)
    unseen = (acts.things or acts.looks) and not any(each.own.any() for each in comparisons)
    named = ("what the factor acts on is not seen in the compared frames",) if unseen else ()
    return PixelVerdict(
        tuple(faults),
        named,
        float(np.mean(differing)),
        wrong,
        light,
        codes,
        lit_shares(blocks),
        things,
    )


def _typical(values: Sequence[Floats]) -> float:
    """Return the median of all values; 0 where there are none."""
    whole = np.concatenate(values)
    return float(np.median(whole)) if whole.size else 0.0


def _misplaced(comparisons: Sequence[Comparison], things: Sequence[ThingDifference]) -> list[str]:
    """Return which objects have another shape or colour and should not."""
    wrong = [each for each in comparisons if each.wrong.any()]
    if not wrong:
        return []
    shown = {
        name: sum(int((each.wrong & mask).sum()) for each in wrong for own, _, mask in each.things
                  if own == name)
        for name in (thing.name for thing in things)
    }  # fmt: skip
    names = sorted((name for name in shown if shown[name]), key=lambda name: -shown[name])
    more = f" and {len(names) - _FEW} more" if len(names) > _FEW else ""
    pixels = sum(int(each.wrong.sum()) for each in wrong)
    return [
        f"shape or colour differs where the factor does not act, in {pixels}"
        f" pixel{'s' if pixels > 1 else ''} of {counted(len(wrong))}, the first is"
        f" {wrong[0].number}: {', '.join(names[:_FEW])}{more}"
    ]


def _overdrawn(comparisons: Sequence[Comparison]) -> list[str]:
    """Return that something else is drawn over pictures that show the same."""
    unlike = [each for each in comparisons if each.overlays.mean() > MOST_OVERDRAWN]
    if not unlike:
        return []
    pixels = sum(int(each.overlays.sum()) for each in unlike)
    return [
        f"something else is drawn over the film, in {pixels} pixels of {counted(len(unlike))}, the"
        f" first is {unlike[0].number}"
    ]


def _unlike(light: float, codes: float) -> list[str]:
    """Return that the whole picture differs."""
    where = "a typical pixel where the factor does not act"
    found = []
    if light > TYPICAL_LIGHT:
        found.append(f"{where} differs in light by {light:.1%}, more than {TYPICAL_LIGHT:.0%}")
    if codes > TYPICAL_CODES:
        found.append(
            f"{where} is brighter or darker by {codes:.1f} of 255 codes, more than"
            f" {TYPICAL_CODES:g}"
        )
    return found
