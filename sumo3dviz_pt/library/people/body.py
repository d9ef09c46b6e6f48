"""Arms, legs and trunk of a figure, bare or clothed.

A trunk wears tops, coats, dresses or skirts; patches such as collars and bags are sewn to them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.mesh.planar import grid_faces
from sumo3dviz_pt.library.people.cloth import Folds, banded, bulges, creased, pressed
from sumo3dviz_pt.library.people.drapery import (
    Drapery,
    draped,
    pushed,
    sleeve_folds,
    trouser_folds,
    trunk_folds,
    with_folds,
)
from sumo3dviz_pt.library.people.posture import SIDES, BodyMeasures, joints
from sumo3dviz_pt.library.people.skin import (
    Cloth,
    Counts,
    Crease,
    SkinPart,
    Stack,
    arm_weights,
    hemmed,
    interpolated,
    leg_weights,
    sewn,
    skirt_weights,
    spaced,
    swollen,
    trunk_weights,
    tube_piece,
    turns,
)
from sumo3dviz_pt.model.geometry import Floats, unit

_ARM = ((-0.012, 0.012), (-0.006, 0.021), (0.006, 0.0275), (0.030, 0.0305), (0.06, 0.0290))
_ARM_BARE = (*_ARM, (0.10, 0.027), (0.16, 0.0245), (0.185, 0.0235), (0.22, 0.0245), (0.328, 0.0150))
_ARM_CLAD = (
    *((-0.012, 0.012), (-0.006, 0.0195), (0.006, 0.0255), (0.030, 0.0290), (0.06, 0.0290)),
    *((0.10, 0.0275), (0.16, 0.0255), (0.185, 0.0250), (0.22, 0.0240), (0.29, 0.0190)),
    (0.328, 0.0180),
)
"""Radius of an arm along its length, both as shares of the stature."""

_LEG_BARE = (
    *((0.560, 0.030), (0.535, 0.048), (0.50, 0.0515), (0.45, 0.050), (0.40, 0.045)),
    *((0.34, 0.037), (0.285, 0.0315), (0.25, 0.0300), (0.20, 0.0330), (0.16, 0.0300)),
    *((0.10, 0.0220), (0.06, 0.0195), (0.03, 0.0205)),
)
_LEG_CLAD = (
    *((0.560, 0.028), (0.535, 0.045), (0.50, 0.0505), (0.45, 0.0505), (0.40, 0.0475)),
    *((0.34, 0.0425), (0.285, 0.039), (0.25, 0.0375), (0.20, 0.0365), (0.16, 0.0355)),
    *((0.10, 0.0345), (0.06, 0.0345), (0.024, 0.0345)),
)
"""Radius of a leg by height, both as shares of the stature."""


@dataclass(frozen=True, slots=True)
class GarmentCut:
    """How a sleeve or a trouser leg is cut.

    Attributes:
        end: Where it ends, as a share of the limb: 0 at its root, 1 at wrist or ankle.
        start: Where it begins, as a share of the limb.
        ease: How far it stands off the skin [m].
        flare: Further distance at its open end [m].
        loose: 0 follows the limb, 1 hangs straight.
        folds: Depth of its creases [m].
        seed: Of the creases.
    """

    end: float = 1.0
    ease: float = 0.0
    flare: float = 0.0
    loose: float = 1.0
    folds: float = 0.015
    seed: int = 0
    start: float = 0.0


BARE = GarmentCut(loose=0.0, folds=0.0)
"""Skin."""


def arm(body: BodyMeasures, side: str, cut: GarmentCut, cloth: Cloth, counts: Counts) -> SkinPart:
    """Make a sleeve, or the skin of an arm down to the wrist.

    Args:
        body: Measures of the person.
        side: `l` or `r`.
        cut: How it is cut.
        cloth: What it is made of.
        counts: Rings, and points of a ring.
    """
    h, rest = body.height, joints(body)
    points = np.stack([rest[f"{name}_{side}"] for name in ("upper_arm", "forearm", "hand")])
    bones = np.linalg.norm(np.diff(points, axis=0), axis=1)
    full = float(bones.sum())
    end = cut.end * full
    # More rings where the elbow bends.
    first = -0.012 * h + cut.start * full
    fine = counts.points > 4
    clad = fine and cut.folds > 0.0
    along = np.linspace(first, end, counts.rings)
    if fine:
        along = spaced(first, end, counts.rings, joint=bones[0], near=0.05 * h)
    middle = _along_arm(points, bones, along)
    radius = _arm_radius(body, along * 0.328 * h / full / h, cut) + cut.flare * smoothstep(
        end - 0.25 * full, end, along
    )
    rings = _around(middle, radius * 1.06, radius * 0.96, counts.points)
    depth = cut.folds * (
        0.40
        + 0.35 * np.exp(-(((along - bones[0]) / (0.05 * h)) ** 2))
        + 0.3 * (along > 0.88 * full)
    )
    depth = (_AT_RANDOM if clad else 1.0) * depth * smoothstep(0.0, 0.06 * h, along)
    rings = creased(rings, Folds.of(cut.seed, slant=0.25), depth)
    lies = sleeve_folds(float(bones[0]), end, high=0.5 * cut.folds)
    hung = Drapery.of(lies, 2.0 * np.pi * float(radius.mean()), seed=cut.seed)
    rings = (pushed(rings, along, hung) if clad else rings)[::-1]
    outer = _shouldered(rings, along[::-1], points[0, 1], h)
    rings = hemmed(outer, depth=0.008) if fine else outer
    weights = arm_weights(body, rings.reshape(-1, 3), side)
    made = tube_piece(rings, weights, cloth, lids="top")
    if not clad:
        return made
    down = np.append(along[-1:], along[::-1])
    folds = bulges(rings, down, joint=bones[0], wide=0.06 * h, deep=0.011, seed=cut.seed)
    made = with_folds(made, draped(outer, along[::-1], hung), first=1)
    made = banded(made, counts.points)
    return _creased_at(made, folds, (f"upper_arm_{side}", f"forearm_{side}"))


def _shouldered(rings: Floats, along: Floats, root: float, height: float) -> Floats:
    """Let rings of an arm, whose joint has a y, take up the slope of the shoulder at its root."""
    near, side = smoothstep(0.055 * height, -0.012 * height, along)[:, None], np.sign(root)
    drop = near * (0.85 * side * (rings[..., 1] - root) + 0.012 * height)
    lower = rings.copy()
    lower[..., 1] -= near * side * 0.012 * height
    lower[..., 2] -= drop
    return lower


def _along_arm(points: Floats, bones: Floats, along: Floats) -> Floats:
    """Return points of the middle of an arm, (k, 3) [m], at distances from the shoulder."""
    upper, lower = np.minimum(along, bones[0]), np.clip(along - bones[0], 0.0, None)
    return np.asarray(
        points[0]
        + np.outer(upper / bones[0], points[1] - points[0])
        + np.outer(lower / bones[1], points[2] - points[1])
    )


def _creased_at(made: SkinPart, folds: Floats, bones: tuple[str, str]) -> SkinPart:
    """Let a piece throw folds, (k, m, 3), as two bones bend; lids stay as they are."""
    offsets = np.zeros_like(made.vertices)
    offsets[: folds.shape[0] * folds.shape[1]] = folds.reshape(-1, 3)
    return replace(made, creases=(*made.creases, Crease(bones, offsets)))


def _arm_radius(body: BodyMeasures, along: Floats, cut: GarmentCut) -> Floats:
    """Return the radius of an arm or sleeve at shares of the stature from the shoulder [m]."""
    bare, clad = interpolated(along, _ARM_BARE), interpolated(along, _ARM_CLAD)
    girth = body.build**0.6 * (1.0 - 0.14 * body.woman) * (1.0 + 0.10 * body.child)
    grown = smoothstep(-0.012, 0.04, along)
    radius = body.height * girth * (bare + cut.loose * (clad - bare))
    # Sleeves are wide above and end in a cuff.
    cuff = 1.0 - 0.45 * smoothstep(0.24, 0.328, along)
    return np.asarray(radius + cut.ease * grown * cuff)


def leg(body: BodyMeasures, side: str, cut: GarmentCut, cloth: Cloth, counts: Counts) -> SkinPart:
    """Make a trouser leg, or the skin of a leg down to the foot.

    Args:
        body: Measures of the person.
        side: `l` or `r`.
        cut: How it is cut.
        cloth: What it is made of.
        counts: Rings, and points of a ring.
    """
    h = body.height
    lowest = 0.535 + cut.end * (0.028 - 0.535)
    highest = 0.555 + cut.start * (0.028 - 0.555)
    level = np.linspace(lowest, highest, counts.rings)
    fine = counts.points > 4
    if fine:
        level = spaced(highest, lowest, counts.rings, joint=0.285, near=0.05)[::-1]
    middle = _along_leg(body, side, level, loose=cut.loose)
    z = middle[:, 2]
    bare, clad = interpolated(level, _LEG_BARE[::-1]), interpolated(level, _LEG_CLAD[::-1])
    girth = body.build**0.55 * (1.0 + 0.03 * body.woman) * (1.0 + 0.06 * body.child)
    radius = h * girth * (bare + cut.loose * (clad - bare)) + cut.ease
    radius += cut.flare * smoothstep(lowest + 0.18, lowest, level)
    rings = _around(middle, radius * 1.05, radius * 0.96, counts.points)
    depth = cut.folds * (
        0.35
        + 0.55 * np.exp(-(((level - 0.285) / 0.035) ** 2))
        + 0.8 * np.exp(-(((level - 0.46) / 0.03) ** 2))
        + 1.0 * smoothstep(0.11, 0.04, level)
    )
    hangs = fine and cut.folds > 0.0
    rings = creased(rings, Folds.of(cut.seed, slant=0.2), (_AT_RANDOM if hangs else 1.0) * depth)
    high = 0.52 * cut.folds * (0.45 + 0.55 * cut.loose)
    lies = trouser_folds(h, end=float(z[0]), side=SIDES[side], high=high)
    hung = Drapery.of(lies, 2.0 * np.pi * float(radius.mean()), seed=cut.seed)
    rings = pushed(rings, z, hung) if hangs else rings
    if cut.end > 0.95 and cut.loose > 0.5:
        rings[0, :, 2] += 0.012 * np.maximum(np.cos(turns(counts.points)), 0.0)
    outer = rings
    rings = hemmed(rings, depth=0.010) if fine else rings
    weights = leg_weights(body, rings.reshape(-1, 3), side, foot=0.6 - 0.25 * cut.loose)
    made = tube_piece(rings, weights, cloth, lids="top")
    if not hangs:
        return made
    made = with_folds(made, draped(outer, z, hung), first=1)
    return _bending(banded(made, counts.points), rings, h * np.append(level[:1], level), side, cut)


def _along_leg(body: BodyMeasures, side: str, level: Floats, *, loose: float) -> Floats:
    """Return points of the middle of a leg, (k, 3) [m], at shares of the stature."""
    h, rest = body.height, joints(body)
    places = np.stack([rest[f"{name}_{side}"] for name in ("foot", "shank", "thigh")])
    z = np.asarray(body.z(level))
    middle = np.column_stack([np.interp(z, places[:, 2], places[:, k]) for k in range(2)] + [z])
    middle[:, 0] -= 0.006 * h * np.exp(-(((level - 0.20) / 0.07) ** 2)) * (1.0 - 0.5 * loose)
    # Trousers fall behind the ankle and break over the instep.
    middle[:, 0] += loose * 0.004 * h * smoothstep(0.12, 0.03, level)
    return middle


def _bending(made: SkinPart, rings: Floats, up: Floats, side: str, cut: GarmentCut) -> SkinPart:
    """Let a trouser leg, whose rings are at heights [m], crease as knee and hip bend."""
    h, deep = float(up[-1]) / 0.555, 0.4 * (cut.folds + 0.008)
    knee = bulges(rings, up, joint=0.285 * h, wide=0.055 * h, deep=deep, seed=cut.seed)
    groin = bulges(rings, up, joint=0.50 * h, wide=0.05 * h, deep=0.5 * deep, seed=cut.seed + 1)
    made = _creased_at(made, knee, (f"thigh_{side}", f"shank_{side}"))
    return _creased_at(made, groin, ("pelvis", f"thigh_{side}"))


def _around(middle: Floats, deep: Floats, wide: Floats, count: int) -> Floats:
    """Lay level ellipses around points, (k, count, 3) [m]."""
    turn = turns(count)
    offset = np.stack(
        [deep[:, None] * np.cos(turn), wide[:, None] * np.sin(turn), np.zeros((len(deep), count))],
        axis=-1,
    )
    return swollen(middle[:, None] + offset)


_MAN = (
    # level, middle x, front, back, half width, as shares of the stature
    (0.250, 0.000, 0.050, 0.052, 0.080),
    (0.400, 0.000, 0.052, 0.058, 0.086),
    (0.462, 0.000, 0.053, 0.066, 0.088),
    (0.500, 0.000, 0.058, 0.071, 0.0965),
    (0.530, 0.001, 0.059, 0.067, 0.0965),
    (0.560, 0.003, 0.057, 0.057, 0.0915),
    (0.600, 0.004, 0.056, 0.049, 0.0850),
    (0.640, 0.003, 0.059, 0.048, 0.0840),
    (0.680, 0.000, 0.063, 0.053, 0.0890),
    (0.720, -0.003, 0.066, 0.058, 0.0960),
    (0.760, -0.006, 0.063, 0.060, 0.1020),
    (0.790, -0.008, 0.055, 0.058, 0.1040),
    (0.807, -0.009, 0.046, 0.054, 0.1010),
    (0.820, -0.010, 0.038, 0.050, 0.0930),
    (0.831, -0.009, 0.034, 0.046, 0.0790),
    (0.840, -0.008, 0.033, 0.042, 0.0580),
    (0.848, -0.008, 0.034, 0.040, 0.0440),
)
_WOMAN = (
    # as above
    (0.250, 0.000, 0.050, 0.052, 0.078),
    (0.400, 0.000, 0.052, 0.060, 0.088),
    (0.462, 0.000, 0.053, 0.070, 0.094),
    (0.500, 0.000, 0.058, 0.076, 0.1025),
    (0.530, 0.002, 0.058, 0.070, 0.1000),
    (0.560, 0.004, 0.055, 0.057, 0.0910),
    (0.600, 0.005, 0.050, 0.046, 0.0770),
    (0.640, 0.004, 0.052, 0.044, 0.0735),
    (0.680, 0.001, 0.062, 0.048, 0.0775),
    (0.715, -0.001, 0.077, 0.052, 0.0830),
    (0.745, -0.003, 0.072, 0.055, 0.0870),
    (0.775, -0.006, 0.056, 0.056, 0.0920),
    (0.803, -0.008, 0.043, 0.052, 0.0945),
    (0.817, -0.009, 0.036, 0.047, 0.0860),
    (0.829, -0.008, 0.032, 0.043, 0.0690),
    (0.839, -0.008, 0.030, 0.039, 0.0500),
    (0.848, -0.008, 0.031, 0.036, 0.0385),
)
NECK, WAIST, CROTCH = 0.848, 0.60, 0.462
"""Levels of the body, as shares of the stature."""

_INWARD = 0.005
"""How far folds on the trunk press in at most [m]."""

_AT_RANDOM = 0.55
"""Share of the creases that lie anywhere; the others have places."""

_SWAYS = 0.44
"""A garment that reaches below this level sways with the legs."""


@dataclass(frozen=True, slots=True)
class Fit:
    """How a garment sits on the trunk.

    Attributes:
        hem: Level of its lower edge, as a share of the stature.
        top: Level of its upper edge.
        ease: How far it stands off the skin [m].
        drape: 0 follows the body, 1 hangs from the chest.
        flare: Further distance at the hem [m].
        folds: Depth of its creases [m].
        quilted: Depth of level seams, as of a padded jacket [m].
        seed: Of the creases.
    """

    hem: float = 0.47
    top: float = NECK
    ease: float = 0.012
    drape: float = 0.5
    flare: float = 0.0
    folds: float = 0.013
    quilted: float = 0.0
    seed: int = 0


def trunk_stack(body: BodyMeasures, fit: Fit, *, rows: int = 24) -> Stack:
    """Return the shape of a garment on the trunk, without creases.

    Args:
        body: Measures of the person.
        fit: How it sits.
        rows: Of the stack, from the hem to the upper edge.
    """
    levels = np.linspace(fit.hem, fit.top, rows)
    man, woman = (_shape(table, levels) for table in (_MAN, _WOMAN))
    middle, front, back, half = (man + body.woman * (woman - man)).T * body.height
    stout = body.build - 1.0
    belly = np.exp(-(((levels - 0.61) / 0.08) ** 2))
    front = front * (1.0 + stout * (0.5 + 0.9 * belly)) * (1.0 + 0.08 * body.child)
    back = back * (1.0 + 0.5 * stout) * (1.0 + 0.04 * body.child)
    half = half * (1.0 + stout * (0.45 + 0.35 * belly)) * (1.0 + 0.02 * body.child)
    ease = fit.ease * smoothstep(NECK, 0.80, levels) + 0.3 * fit.ease
    ease = ease + fit.flare * smoothstep(max(fit.hem + 0.16, WAIST), fit.hem, levels)
    hang = (fit.drape, fit.drape, 0.35 * fit.drape)
    reach = [_draped(side, d) for side, d in zip((front, back, half), hang, strict=True)]
    reach = [side + share * ease for side, share in zip(reach, (1.0, 1.0, 0.75), strict=True)]
    z = np.asarray(body.z(levels))
    power = np.interp(levels, [0.46, 0.60, 0.70, 0.80, 0.848], [2.35, 2.3, 2.5, 2.6, 2.0])
    return Stack(np.stack([middle, 0.0 * z, *reach, z, z, power], axis=1))


def _shape(table: tuple[tuple[float, ...], ...], levels: Floats) -> Floats:
    """Interpolate middle, front, back and half width at levels, (n, 4)."""
    rows = np.array(table)
    return np.asarray(PchipInterpolator(rows[:, 0], rows[:, 1:], axis=0)(levels))


def _draped(reach: Floats, drape: float) -> Floats:
    """Let cloth hang from what stands out above it; rows go upwards."""
    hung = np.maximum.accumulate(reach[::-1])[::-1]
    return np.asarray(reach + drape * (hung - reach))


@dataclass(frozen=True, slots=True, eq=False)
class Garment:
    """A garment on the trunk, to which patches can be sewn.

    Attributes:
        body: Measures of the person.
        fit: How it sits.
        stack: Its shape without creases.
        folds: Its creases.
        drapery: Its folds.
    """

    body: BodyMeasures
    fit: Fit
    stack: Stack
    folds: Folds
    drapery: Drapery

    @classmethod
    def of(cls, body: BodyMeasures, fit: Fit) -> Garment:
        """Cut a garment."""
        loose = min(fit.folds / 0.013, 1.0) if not fit.quilted else 0.25
        lies = trunk_folds(body.height, hem=fit.hem, loose=loose)
        drapery = Drapery.of(lies, 0.56 * body.height * body.build**0.5, seed=fit.seed)
        return cls(body, fit, trunk_stack(body, fit), Folds.of(fit.seed, slant=0.55), drapery)

    def level(self, share: Floats | float) -> Floats:
        """Return the level in the stack of a share of the stature."""
        span = self.fit.top - self.fit.hem
        return np.asarray((np.asarray(share) - self.fit.hem) / span * self.stack.last)

    def smooth(self, shares: Floats, angles: Floats) -> Floats:
        """Return points without creases, (k, 3) [m], at levels and angles [rad], (k,) each."""
        return self.stack.points(self.level(shares), angles)

    def rings(self, shares: Floats, angles: Floats, *, fine: bool = True) -> Floats:
        """Return points with creases, (k, m, 3) [m].

        Args:
            shares: Levels as shares of the stature, (k,).
            angles: From the front to the left, (m,) or (k, m) [rad].
            fine: Whether there are folds.
        """
        angles = np.broadcast_to(angles, (len(shares), angles.shape[-1]))
        level = np.broadcast_to(self.level(shares)[:, None], angles.shape)
        points = self.stack.points(level, angles)
        away = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
        # Cloth lies smooth over the shoulders and creases at the waist and towards the hem.
        depth = self.fit.folds * (0.45 + 0.55 * smoothstep(0.80, 0.66, shares))
        depth = (_AT_RANDOM if fine else 1.0) * depth * smoothstep(NECK, 0.80, shares)
        push = pressed(self.folds(points)) * depth[:, None]
        if fine:
            along = np.broadcast_to(self.body.height * shares[:, None], angles.shape)
            hung = self.drapery.height(angles / (2.0 * np.pi), along)
            # Bodies leave less room inward than there is outward.
            push = np.maximum(push + self._room(shares)[:, None] * hung, -_INWARD)
        if self.fit.quilted:
            seam = np.abs(np.sin(np.pi * (shares * self.body.height) / 0.085)) ** 0.5
            depth = self.fit.quilted * (seam - 0.6) * smoothstep(NECK, 0.82, shares)
            push = push + depth[:, None]
        return np.asarray(points + push[..., None] * away)

    def _room(self, shares: Floats) -> Floats:
        """Return how much of a fold there is at levels, (k,): none at the neck and at the hem."""
        upper = smoothstep(NECK, 0.79, shares)
        return np.asarray(upper * smoothstep(self.fit.hem - 0.012, self.fit.hem + 0.030, shares))

    def shares(self, count: int) -> Floats:
        """Return the levels of a number of rings, of which the lowest two bound the hem."""
        if count <= 6:
            return np.linspace(self.fit.hem, self.fit.top, count)
        above = np.linspace(self.fit.hem + 0.010, self.fit.top, count - 1)
        return np.append(self.fit.hem, above)

    def piece(self, cloth: Cloth, counts: Counts) -> SkinPart:
        """Make the garment itself; below the hips it sways with the legs."""
        shares, fine = self.shares(counts.rings), counts.rings > 6
        rings = self.rings(shares, turns(counts.points), fine=fine)
        outer = rings
        rings = hemmed(rings) if fine else swollen(rings)
        weights, sway = self._bound(rings.reshape(-1, 3))
        made = tube_piece(rings, weights, cloth, lids="" if self.fit.top > 0.7 else "top")
        if fine:
            h = self.body.height
            up = h * np.append(shares[:1], shares)
            folds = bulges(
                rings, up, joint=WAIST * h, wide=0.07 * h, deep=0.018, seed=self.fit.seed
            )
            hung = draped(outer, h * shares, self.drapery, room=self._room(shares))
            made = banded(with_folds(made, hung, first=1), counts.points)
            made = _creased_at(made, folds, ("pelvis", "chest"))
            for side in SIDES if self.fit.top > 0.7 else ():
                stretched = self._blade(outer, shares, side)
                stretched = np.concatenate([stretched[:1], stretched])
                made = _creased_at(made, stretched, ("chest", f"upper_arm_{side}"))
        if sway is None:
            return made
        # Lids have vertices of their own, which do not sway.
        return replace(made, sway=np.append(sway, np.zeros(len(made.vertices) - len(sway))))

    def _blade(self, rings: Floats, shares: Floats, side: str) -> Floats:
        """Return what the back does as an arm goes forward by a radian, (k, m, 3) [m].

        The shoulder blade stands out, cloth is drawn tight from it to the armpit, and the spine
        lies in a hollow.
        """
        turn = SIDES[side] * 2.0 * np.pi * np.arange(rings.shape[1]) / rings.shape[1]
        away = (turn[None, :] - np.pi * 0.80 + np.pi) % (2.0 * np.pi) - np.pi
        spine = (turn[None, :] + 2.0 * np.pi) % (2.0 * np.pi) - np.pi
        rise = shares[:, None]
        blade = np.exp(-((away / 0.30) ** 2) - ((rise - 0.755 + 0.05 * away) / 0.042) ** 2)
        under = np.exp(-((away / 0.34) ** 2) - ((rise - 0.685 + 0.06 * away) / 0.020) ** 2)
        hollow = np.exp(-((spine / 0.17) ** 2)) * smoothstep(0.59, 0.68, rise)
        hollow = hollow * smoothstep(0.835, 0.79, rise)
        deep = 0.020 * blade - 0.010 * under - 0.011 * hollow
        return np.asarray(deep[..., None] * unit(rings - rings.mean(axis=1, keepdims=True)))

    def _bound(self, points: Floats) -> tuple[Floats, Floats | None]:
        """Return the weights of points, (n, bones), and their sway, (n,), where they have any."""
        if self.fit.hem > _SWAYS:
            return trunk_weights(self.body, points), None
        return skirt_weights(self.body, points)

    def patch(
        self, shares: Floats, right: Floats, left: Floats, cloth: Cloth, *, lift: float = 0.005
    ) -> SkinPart:
        """Make a strip that is sewn on, between two angles at each of some levels.

        Args:
            shares: Levels from low to high, (k,).
            right: Angles where it begins, (k,) [rad].
            left: Angles where it ends, (k,) [rad].
            cloth: What it is made of.
            lift: How far it lies on top [m].
        """
        columns = 4
        across = np.linspace(0.0, 1.0, columns)
        angles = right[:, None] + across * (left - right)[:, None]
        away = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
        rings = self.rings(shares, angles) + lift * away
        points = rings.reshape(-1, 3)
        weights, sway = self._bound(points)
        return replace(sewn((points, grid_faces(len(shares), columns)), weights, cloth), sway=sway)


def seat(body: BodyMeasures, cloth: Cloth, *, counts: Counts, ease: float) -> SkinPart:
    """Make the upper part of trousers, closed below.

    Args:
        body: Measures of the person.
        cloth: What it is made of.
        counts: Rings, and points of a ring.
        ease: How far it stands off the skin [m].
    """
    garment = Garment.of(body, Fit(CROTCH, WAIST + 0.005, ease, 0.15, folds=0.003))
    shares = np.linspace(CROTCH, WAIST + 0.005, counts.rings)
    rings = swollen(garment.rings(shares, turns(counts.points), fine=counts.points > 6))
    floor = rings[0].mean(axis=0) + (rings[0] - rings[0].mean(axis=0)) * [0.75, 0.80, 1.0]
    floor[:, 2] -= 0.010 * body.height
    rings = np.concatenate([floor[None], rings])
    weights = trunk_weights(body, rings.reshape(-1, 3))
    return tube_piece(rings, weights, cloth, lids="bottom")
