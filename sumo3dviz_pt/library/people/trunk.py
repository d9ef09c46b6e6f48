"""What a figure wears on its trunk: tops, coats, dresses, skirts, collars and bags."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from sumo3dviz_pt.library.mesh.grids import grid_faces
from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.rig import BodyMeasures
from sumo3dviz_pt.library.people.skin import (
    Cloth,
    Folds,
    SkinPart,
    hemmed,
    pressed,
    sewn,
    skirt_weights,
    trunk_weights,
    tube_piece,
)
from sumo3dviz_pt.library.people.stack import Counts, Stack, swollen, turns
from sumo3dviz_pt.model.geometry import Floats

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
    (0.790, -0.008, 0.055, 0.058, 0.1060),
    (0.807, -0.009, 0.046, 0.054, 0.1065),
    (0.820, -0.010, 0.038, 0.050, 0.0980),
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
    folds: float = 0.018
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
    """

    body: BodyMeasures
    fit: Fit
    stack: Stack
    folds: Folds

    @classmethod
    def of(cls, body: BodyMeasures, fit: Fit) -> Garment:
        """Cut a garment."""
        return cls(body, fit, trunk_stack(body, fit), Folds.of(fit.seed, slant=0.55))

    def level(self, share: Floats | float) -> Floats:
        """Return the level in the stack of a share of the stature."""
        span = self.fit.top - self.fit.hem
        return np.asarray((np.asarray(share) - self.fit.hem) / span * self.stack.last)

    def smooth(self, shares: Floats, angles: Floats) -> Floats:
        """Return points without creases, (k, 3) [m], at levels and angles [rad], (k,) each."""
        return self.stack.points(self.level(shares), angles)

    def rings(self, shares: Floats, angles: Floats) -> Floats:
        """Return points with creases, (k, m, 3) [m].

        Args:
            shares: Levels as shares of the stature, (k,).
            angles: From the front to the left, (m,) or (k, m) [rad].
        """
        angles = np.broadcast_to(angles, (len(shares), angles.shape[-1]))
        level = np.broadcast_to(self.level(shares)[:, None], angles.shape)
        points = self.stack.points(level, angles)
        away = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
        # Cloth lies smooth over the shoulders and creases at the waist and towards the hem.
        depth = self.fit.folds * (0.45 + 0.55 * smoothstep(0.80, 0.66, shares))
        depth = depth * smoothstep(NECK, 0.80, shares)
        push = pressed(self.folds(points)) * depth[:, None]
        if self.fit.quilted:
            seam = np.abs(np.sin(np.pi * (shares * self.body.height) / 0.085)) ** 0.5
            depth = self.fit.quilted * (seam - 0.6) * smoothstep(NECK, 0.82, shares)
            push = push + depth[:, None]
        return np.asarray(points + push[..., None] * away)

    def piece(self, cloth: Cloth, counts: Counts) -> SkinPart:
        """Make the garment itself; below the hips it sways with the legs."""
        shares = np.linspace(self.fit.hem, self.fit.top, counts.rings)
        rings = self.rings(shares, turns(counts.points))
        rings = hemmed(rings) if counts.rings > 6 else swollen(rings)
        weights, sway = self._bound(rings.reshape(-1, 3))
        made = tube_piece(rings, weights, cloth, lids="" if self.fit.top > 0.7 else "top")
        if sway is None:
            return made
        # Lids have vertices of their own, which do not sway.
        return replace(made, sway=np.append(sway, np.zeros(len(made.vertices) - len(sway))))

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
    rings = swollen(garment.rings(shares, turns(counts.points)))
    floor = rings[0].mean(axis=0) + (rings[0] - rings[0].mean(axis=0)) * [0.75, 0.80, 1.0]
    floor[:, 2] -= 0.010 * body.height
    rings = np.concatenate([floor[None], rings])
    weights = trunk_weights(body, rings.reshape(-1, 3))
    return tube_piece(rings, weights, cloth, lids="bottom")
