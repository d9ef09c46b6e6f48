"""Compares frames of two films, and says if they differ where their factor acts, and only there.

Frames are compared pixel by pixel and layer by layer, down to the objects that differ. Three
questions are asked of each pixel. *Shape*: does it show the same thing, as far away, facing the
same way? *Paint*: does that reflect the same light? *Light*: is it as bright? Shape and paint are
of rays through the pixels' centres and hold no noise, so they must agree exactly where a factor
does not act. Light spreads: a tree that is gone takes its shadow with it, and a red car reddens the
road. So light may differ near and far, but a typical pixel elsewhere must not.

The limits of light and picture are measured on clean and on spoilt pairs of `examples/crossing`;
docs/internals/certificate.md has the figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve

from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.model.scene import LENS_THAT_SHINES
from sumo3dviz_pt.studies.certificate.acts import Acts
from sumo3dviz_pt.studies.certificate.evidence import (
    PAINT,
    THINGS,
    USERS,
    Evidence,
    LightDifference,
    Throw,
    around,
    light_difference,
    light_faults,
    lit_shares,
    luminance,
    shares,
)

SAME_DEPTH = 1e-4
"""Share of the distance by which depths may differ and count as one surface."""

SAME_PLACE = 1e-5
"""Share of the distance within which two things are one place if they face the same way: rays are
traced in single precision, whose last bits say which of two surfaces in one plane is met. Nothing
that the world builds is so thin: its thinnest layer has 2 mm."""

SAME_EDGE = 1e-6
"""The same where two faces of one thing meet: which of them is met hangs on last bits, too. Of one
face, depths are the same to the last bit, so that a normal that differs there is another one."""

MOST_CROSSING = 1e-4
"""Share of a picture's pixels that may show one of two things which cross there, so that last bits
say which, or one of two colours at a seam of a texture; one pixel of each kind may in any case."""

LIT_DEPTH = 0.03
"""How far depths may differ where panes, screens and dials shine or go out [m]: they are thin
bodies of their own before those that do not; 9 mm at most were measured."""

SAME_NORMAL = 0.02
"""Components of unit normals may differ by this: they are stored in half precision."""

SAME_TUBE = 0.05
"""The same for normals of opposite sides. Where a ray grazes a spoke, its front and its back are
one place, and which of the two is met hangs on last bits."""

SAME_ALBEDO = 0.004
"""Reflectances may differ by this, for the same reason."""

SEEN_LIGHT = 0.02
"""Light that differs by more than this share, in pixels that are not black, counts as other."""

_SAME_CODES, _OTHER_CODES = 12, 40
"""Pictures that differ by less than the first show the same, and what is drawn over them is another
if that differs by more than the second [8-bit codes]: a codec does neither."""

_ROAD_USERS = ("vehicle:", "person:", "container:")

_REACH = 2
"""Pixels around an object into which its edge is blurred."""


@dataclass(frozen=True, slots=True)
class ThingDifference:
    """How a thing differs between two films, over all compared frames.

    Attributes:
        name: Its name.
        acts: What of it may differ: `shape`, `colour`, `light` or nothing.
        pixels: That show it in either film.
        shape, paint, light: Pixels of those that differ.
        codes: Mean difference of the pictures there [8-bit codes].
    """

    name: str
    acts: str
    pixels: int
    shape: int
    paint: int
    light: int
    codes: float


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """A frame of two films.

    Attributes:
        number: The frame's.
        own: Where the factor acts on what is seen, (h, w).
        shape, paint, light: Where they differ, (h, w).
        wrong: Where shape or paint differ and should not, (h, w).
        elsewhere: By which share light differs away from where the factor acts, (k,).
        elsewhere_codes: Difference of the pictures there, with its sign, (k,) [8-bit codes].
        codes: Mean difference of the pictures' channels, (h, w) [8-bit codes].
        things: Each with its name, what of it may differ, and its pixels in either film, (h, w).
        overlays: Where something else is drawn over one picture, (h, w).
        blocks: How light differs by blocks where the factor does not act; None if a frame is gone,
            or the factor acts on all light.
    """

    number: int
    own: Bools
    shape: Bools
    paint: Bools
    light: Bools
    wrong: Bools
    elsewhere: Floats
    elsewhere_codes: Floats
    codes: Floats
    things: tuple[tuple[str, str, Bools], ...]
    overlays: Bools
    blocks: LightDifference | None


def compare(number: int, one: Evidence, other: Evidence, acts: Acts) -> Comparison:
    """Compare a frame of two films.

    Args:
        number: The frame's.
        one: Of the first film.
        other: Of the second, of the same size.
        acts: Where their factor acts.
    """
    things = _things(one, other)
    users = _where(things, [name.startswith(_ROAD_USERS) for name in things])
    moved, turned = _moved(one, other, users, light=acts.light)
    paint = _paint(one, other)
    labels = {**one.labels, **other.labels}
    reshaped = _where(things, [acts.may_reshape(name, labels.get(name, "")) for name in things])
    repainted = _where(things, [acts.may_look(name, labels.get(name, "")) for name in things])
    own = reshaped | repainted
    slight = own & _is_slight(one, other, users, acts)
    plants = _where(things, [labels.get(name) == "vegetation" for name in things])
    crossing = _crossing(one, other, users, plants) | _at_seams(one, other, paint, users)
    wrong = ((moved | turned) & ~reshaped & ~slight) | (paint & ~own & (not acts.light))
    wrong &= ~crossing
    spread = _spread(one, other)
    near = around(own, reach=_REACH)
    signed = other.picture.astype(np.int16) - one.picture
    return Comparison(
        number,
        own,
        moved | turned,
        paint,
        spread > SEEN_LIGHT,
        wrong,
        spread[~near],
        signed[~near].mean(axis=-1),
        np.abs(signed).mean(axis=-1),
        tuple(
            (name, _may_differ(acts, name, labels.get(name, "")), mask)
            for name, mask in things.items()
        ),
        _overlays(one, other),
        None
        if acts.light or acts.anything or one.radiance is None or other.radiance is None
        else light_difference(
            one, other, near, _thrown(acts, reshaped=reshaped, own=own, users=users)
        ),
    )


def _thrown(acts: Acts, *, reshaped: Bools, own: Bools, users: Bools) -> list[tuple[Bools, Throw]]:
    """Return where a factor acts on what is seen, by what that throws light and shadows as."""
    gone = [pattern.startswith(_ROAD_USERS) for pattern in acts.things]
    masks = (
        (bool(acts.looks), own & ~reshaped, PAINT),
        (acts.motion or any(gone), reshaped & users, USERS),
        (not all(gone), reshaped & ~users, THINGS),
    )
    return [(mask, throw) for there, mask, throw in masks if there]


def differing_things(comparisons: list[Comparison]) -> list[ThingDifference]:
    """Return all things of which something differs, those with most pixels first."""
    sums: dict[str, list[float]] = {}
    may: dict[str, str] = {}
    for each in comparisons:
        for name, acts, mask in each.things:
            counted = [int((layer & mask).sum()) for layer in (each.shape, each.paint, each.light)]
            row = [int(mask.sum()), *counted, float(each.codes[mask].sum())]
            known = sums.setdefault(name, [0.0] * len(row))
            sums[name], may[name] = [a + b for a, b in zip(known, row, strict=True)], acts
    differences = [_difference(name, may[name], row) for name, row in sums.items()]
    differing = [each for each in differences if each.shape or each.paint or each.light]
    return sorted(
        differing,
        key=lambda each: (not each.acts, -(each.shape + each.paint), -each.light, each.name),
    )


def _may_differ(acts: Acts, name: str, label: str) -> str:
    """Return what of a thing may differ, by where the factor acts."""
    if acts.may_reshape(name, label):
        return "shape"
    if acts.may_look(name, label):
        return "colour"
    return "light" if acts.light else ""


def _difference(name: str, acts: str, row: list[float]) -> ThingDifference:
    """Return a thing's difference from its sums over frames."""
    pixels, shape, paint, light, codes = row
    counts = (int(pixels), int(shape), int(paint), int(light))
    return ThingDifference(name, acts, *counts, codes / max(pixels, 1.0))


def _moved(one: Evidence, other: Evidence, users: Bools, *, light: bool) -> tuple[Bools, Bools]:
    """Return where another thing or the same elsewhere is seen, and where it is turned, (h, w).

    Args:
        one: Of the first film.
        other: Of the second.
        users: Where road users are seen in either.
        light: Whether lamps may be lit in one of them only.
    """
    near = np.minimum(one.layers["depth"], other.layers["depth"])
    room = SAME_DEPTH * near + (LIT_DEPTH if light else 0.0)
    apart = _apart(one, other)
    edge = (apart > 0.0) & (apart <= SAME_EDGE * near) & (one.things == other.things)
    turned = _turned(one, other) & ~edge
    one_place = (apart <= SAME_PLACE * near) & ~turned & ~users
    moved = ((one.things != other.things) & ~one_place) | (apart > room)
    judged = np.asarray(~(_shines(one) | _shines(other)) if light else np.ones_like(moved))
    return moved & judged, turned & judged


def _crossing(one: Evidence, other: Evidence, users: Bools, plants: Bools) -> Bools:
    """Return where two things cross, and last bits say which of them is met, (h, w).

    Two leaves may be at one depth, each with its own normal and colour. They cross along a line, so
    that this is true of few pixels: where it is true of more, it is no chance. Leaves of one plant
    cross, too, in pixels of which none is beside another.

    Args:
        one: Of the first film.
        other: Of the second.
        users: Where road users are seen in either.
        plants: Where plants are seen in either.
    """
    near = np.minimum(one.layers["depth"], other.layers["depth"])
    met = (one.things != 0) & (other.things != 0) & ~users & _turned(one, other)
    met &= _apart(one, other) <= SAME_EDGE * near
    beside = convolve(met.astype(np.uint8), np.ones((3, 3), np.uint8), mode="constant") > 1
    there = np.asarray(met & ((one.things != other.things) | (plants & ~beside)))
    return there if there.sum() <= max(1, MOST_CROSSING * there.size) else np.zeros_like(there)


def _at_seams(one: Evidence, other: Evidence, paint: Bools, users: Bools) -> Bools:
    """Return where last bits say which of two colours of a texture is met, (h, w).

    At a seam, as between two stones of a pavement, a ray meets one or the other. It was traced with
    other roundings, and its depth shows it: paint that is changed leaves depths as they are.
    """
    apart, near = _apart(one, other), np.minimum(one.layers["depth"], other.layers["depth"])
    there = paint & (one.things == other.things) & (one.things != 0) & ~users
    there &= (apart > 0.0) & (apart <= SAME_EDGE * near) & ~_turned(one, other)
    return there if there.sum() <= max(1, MOST_CROSSING * there.size) else np.zeros_like(there)


def _overlays(one: Evidence, other: Evidence) -> Bools:
    """Return where something else is drawn over pictures that show the same there, (h, w)."""
    same, drawn = (
        np.abs(first.astype(np.int16) - second).max(axis=-1)
        for first, second in ((one.picture, other.picture), (one.delivered, other.delivered))
    )
    return np.asarray((same < _SAME_CODES) & (drawn > _OTHER_CODES))


def _apart(one: Evidence, other: Evidence) -> Floats:
    """Return how far apart surfaces are along the ray, (h, w) [m]."""
    return np.asarray(np.abs(one.layers["depth"] - other.layers["depth"]))


def _is_slight(one: Evidence, other: Evidence, users: Bools, acts: Acts) -> Bools:
    """Return where shapes differ by no more than a factor that acts there explains, (h, w).

    A surface lies as much higher or lower as a layer on it is thick, and uncovers what stood in it;
    or it leans by no more than water makes it.

    Args:
        one: Of the first film.
        other: Of the second.
        users: Where road users are seen in either.
        acts: Where the factor acts.
    """
    first, second = (each.layers["normals"].astype(np.float64) for each in (one, other))
    facing = [np.abs((each * one.rays).sum(axis=-1)) for each in (first, second)]
    # What is level says how far apart surfaces lie; the other may be a wall that is uncovered.
    across = np.where(first[..., 2] >= second[..., 2], *facing)
    near = np.minimum(one.layers["depth"], other.layers["depth"])
    beside = _apart(one, other) * across <= acts.lift + SAME_DEPTH * near * across
    level = np.minimum(first[..., 2], second[..., 2]) >= np.cos(np.radians(acts.tilt)) - 1e-3
    leans = ~_turned(one, other) | (level & ~users & (acts.tilt > 0.0))
    uncovered = (one.things != other.things) & (acts.lift > 0.0)
    return np.asarray(beside & (uncovered | ((one.things == other.things) & leans)))


def _shines(one: Evidence) -> Bools:
    """Return where a vehicle's lamp shines, (h, w).

    It is a body of its own before the one that does not, known by its paint, which is nobody
    else's.
    """
    return np.asarray((one.layers["albedo"] == LENS_THAT_SHINES).all(axis=-1) & (one.things != 0))


def _turned(one: Evidence, other: Evidence) -> Bools:
    """Return where the first surface faces another way, and is not the back of the same, (h, w)."""
    first, second = one.layers["normals"], other.layers["normals"]
    same = _largest(first, second) <= SAME_NORMAL
    return np.asarray(~same & (_largest(first, -second) > SAME_TUBE))


def _paint(one: Evidence, other: Evidence) -> Bools:
    """Return where the first surface reflects another light, (h, w)."""
    return np.asarray(_largest(one.layers["albedo"], other.layers["albedo"]) > SAME_ALBEDO)


def _largest(one: Image, other: Image) -> Image:
    """Return the largest difference of any channel, (h, w)."""
    return np.asarray(np.abs(one.astype(np.float32) - other).max(axis=-1))


def _spread(one: Evidence, other: Evidence) -> Floats:
    """Return by which share luminances differ, (h, w); 0 where a frame is gone."""
    if one.radiance is None or other.radiance is None:
        return np.zeros(one.things.shape)
    return np.abs(shares(luminance(one), luminance(other)))


def _things(one: Evidence, other: Evidence) -> dict[str, Bools]:
    """Return where each thing is seen in either film, by name."""
    names = {**one.names, **other.names}
    shown = np.unique(np.concatenate([np.unique(one.things), np.unique(other.things)]))
    masks: dict[str, Bools] = {}
    for number in shown.tolist():
        mask = (one.things == number) | (other.things == number)
        name = names.get(number, str(number))
        masks[name] = masks[name] | mask if name in masks else mask
    return masks


def _where(things: dict[str, Bools], chosen: list[bool]) -> Bools:
    """Return where chosen things are seen, (h, w)."""
    masks = [mask for mask, wanted in zip(things.values(), chosen, strict=True) if wanted]
    shape: tuple[int, ...] = next(iter(things.values())).shape
    whole: NDArray[np.bool_] = np.zeros(shape, dtype=np.bool_)
    for mask in masks:
        whole |= mask
    return whole


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
        moving: How many road users differ, in words, if the factor may change all traffic.
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
    moving: str = ""

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
        (acts.develops, "exposure, tone curve, glare and response, which belong to the level"),
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
        f" pixel{'s' if pixels > 1 else ''} of {counted(len(wrong), 'frame')}, the first is"
        f" {wrong[0].number}: {', '.join(names[:_FEW])}{more}"
    ]


def _overdrawn(comparisons: Sequence[Comparison]) -> list[str]:
    """Return that something else is drawn over pictures that show the same."""
    unlike = [each for each in comparisons if each.overlays.mean() > MOST_OVERDRAWN]
    if not unlike:
        return []
    pixels = sum(int(each.overlays.sum()) for each in unlike)
    return [
        f"something else is drawn over the film, in {pixels} pixels of"
        f" {counted(len(unlike), 'frame')}, the first is {unlike[0].number}"
    ]


def _unlike(light: float, codes: float) -> list[str]:
    """Return that the whole picture differs."""
    where = "a typical pixel where the factor does not act"
    faults = []
    if light > TYPICAL_LIGHT:
        faults.append(f"{where} differs in light by {light:.1%}, more than {TYPICAL_LIGHT:.0%}")
    if codes > TYPICAL_CODES:
        faults.append(
            f"{where} is brighter or darker by {codes:.1f} of 255 codes, more than"
            f" {TYPICAL_CODES:g}"
        )
    return faults
