"""Decides what a shot needs: what some camera can see, or what can cast light into it.

Everything here is a pure function of the whole shot, never of what was rendered
before, so that any part of a film can be rendered alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.scene import View

AROUND = 60.0
"""What is nearer than this is kept even behind the camera: shadows, reflections [m]."""

FAR_END = 3000.0
"""Road users farther than this are smaller than a pixel in haze [m]."""

NEAR_END = 250.0
"""Farther road users are drawn by their stand-ins, through a lens of 50 degrees or wider [m]."""

HERO_END = 32.0
"""Nearer road users are drawn in full detail through a lens of 50 degrees [m]."""

_LENS = float(np.tan(np.radians(25.0)) * np.hypot(1.0, 9 / 16))
_LONGEST = 14.0  # from a front bumper to what else of most bodies may be in the picture [m]
_SHADOW = 40.0  # from a front bumper to what else may be seen of most, shadows at most hours [m]
_CAST = 25.0  # of those beyond the rear of a longer one [m]

MOST_NEAR = 120
"""Road users in detail in one frame, at most."""

MOST_HEROES = 16
"""Road users in full detail in one frame, at most: wheels are parts of their own."""

_CHUNK = 200


@dataclass(frozen=True, slots=True, eq=False)
class Gaze:
    """Where a shot's camera is and looks, over n times.

    Attributes:
        positions: (n, 3) [m].
        forwards: Unit viewing directions, (n, 3).
        half_angles: Half the diagonal opening angle, (n,) [rad].
    """

    positions: Floats
    forwards: Floats
    half_angles: Floats

    @classmethod
    def of(cls, views: Sequence[View], *, aspect: float) -> Gaze:
        """Collect views; `aspect` is height / width."""
        half = np.tan(np.array([view.fov for view in views]) / 2) * np.hypot(1.0, aspect)
        return cls(
            settled([view.position for view in views]),
            np.stack([view.forward for view in views]),
            np.arctan(half),
        )

    @classmethod
    def all_round(cls, positions: Floats) -> Gaze:
        """Eyes at positions, (n, 3) [m], that see in all directions."""
        ahead = np.tile([1.0, 0.0, 0.0], (len(positions), 1))
        return cls(positions, ahead, np.full(len(positions), np.pi))

    def slice(self, part: slice) -> Gaze:
        """Some of the times."""
        return Gaze(self.positions[part], self.forwards[part], self.half_angles[part])


def in_view(gaze: Gaze, points: Floats, *, radius: float | Floats) -> Bools:
    """Which balls can be seen at which times.

    Args:
        gaze: n times.
        points: Centres, (k, 3) or, one for each time, (k, n, 3) [m].
        radius: Of the balls, shadow included; one, or (k, 1) [m].

    Returns:
        (k, n); also true for what is nearer than `AROUND`.
    """
    return _within(gaze, points, radius=radius, around=AROUND + radius)


def in_picture(gaze: Gaze, points: Floats, *, radius: float | Floats) -> Bools:
    """As `in_view`, but what stands nearby beside or behind the camera does not count."""
    return _within(gaze, points, radius=radius, around=radius)


def _within(gaze: Gaze, points: Floats, *, radius: float | Floats, around: float | Floats) -> Bools:
    """Which balls reach into the viewing cone or lie nearer than a distance, (k, n)."""
    centres = points[:, None, :] if points.ndim == 2 else points
    towards = centres - gaze.positions
    distance = np.linalg.norm(towards, axis=-1)
    with np.errstate(invalid="ignore"):
        cosine = np.einsum("knc,nc->kn", towards, gaze.forwards) / np.maximum(distance, 1e-9)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        ball = np.arcsin(np.clip(radius / np.maximum(distance, 1e-9), 0.0, 1.0))
        near = settled(distance - around) < 0.0
        return np.asarray(near | (settled(angle - gaze.half_angles - ball) < 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """Which road users are drawn how, (k, n) each; nobody twice.

    Attributes:
        near: In detail.
        far: By their stand-ins.
        hero: In full detail.
    """

    near: Bools
    far: Bools
    hero: Bools


def choose(
    gaze: Gaze,
    alive: Bools,
    positions: Floats,
    *,
    limit: int,
    heroic: Bools | None = None,
    lengths: Floats | None = None,
) -> Choice:
    """Choose the nearest visible road users for detail and the others for stand-ins.

    Args:
        gaze: n times.
        alive: (k, n).
        positions: (k, n, 3) [m]; anything where not alive.
        limit: How many are drawn in detail at once, at most.
        heroic: Who can be drawn in full detail, (k,); None is nobody.
        lengths: Of their bodies, (k,) [m]: a train is seen long after its front; None is short.
    """
    long = np.zeros(len(alive)) if lengths is None else lengths
    places = np.where(alive[..., None], positions, 1e9)
    # A long one may be near although its front is not.
    beyond = np.maximum(long - _LONGEST, 0.0)[:, None]
    distance = settled(np.maximum(np.linalg.norm(places - gaze.positions, axis=-1) - beyond, 0.0))
    reach = np.maximum(_SHADOW, long + _CAST)[:, None]
    shown = alive & (distance < FAR_END) & in_view(gaze, places, radius=reach)
    near = _nearest(distance, among=shown & (distance < near_end(gaze)), limit=limit)
    able = (
        near
        & (distance < _hero_end(gaze))
        & in_picture(gaze, places, radius=np.maximum(_LONGEST, long)[:, None])
    )
    able &= False if heroic is None else heroic[:, None]
    hero = _nearest(distance, among=able, limit=MOST_HEROES)
    return Choice(near & ~hero, shown & ~near, hero)


def _nearest(distance: Floats, *, among: Bools, limit: int) -> Bools:
    """The nearest few of those that qualify, at each time, (k, n)."""
    ranked = np.where(among, distance, np.inf)
    order = np.argsort(ranked, axis=0, kind="stable")
    rank = np.empty_like(order)
    np.put_along_axis(rank, order, np.arange(len(order))[:, None], axis=0)
    return np.asarray(among & (rank < limit))


def _hero_end(gaze: Gaze) -> Floats:
    """Where full detail ends, (n,) [m]: a telephoto lens shows it from farther away."""
    return np.clip(HERO_END * _LENS / np.tan(gaze.half_angles), 12.0, 120.0)


def near_end(gaze: Gaze) -> Floats:
    """Where the middle level ends at n times, (n,) [m]; likewise."""
    return np.clip(NEAR_END * _LENS / np.tan(gaze.half_angles), NEAR_END, 6.0 * NEAR_END)


def chunks(count: int) -> Iterator[slice]:
    """Stretches of a shot that fit into memory."""
    for first in range(0, count, _CHUNK):
        yield slice(first, min(first + _CHUNK, count))
