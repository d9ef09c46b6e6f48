"""How bright drops and flakes are: what they take from sky and ground, sun and lamps.

A drop is a ball of clear water. It shows, upside down and small, nearly all of the half space
behind it, so by even light it is about as bright as the mean of sky and ground there. Of a lamp it
shows one glint; averaged over its face and over some time that is the lamp's irradiance times the
phase function of a ball of water, which we compute from Fresnel's equations for rays that are
reflected, go through, or are reflected once inside. Light bent around drops is left to the lamp's
halo. Flakes scatter alike into all directions.

Sums of vectors are written out: a library of linear algebra would wake threads for each of them,
and add in another order on another processor.

References:
    Garg, K. and Nayar, S. K., Photometric model of a rain drop, Columbia University, 2003: a drop
    shows 165 degrees of what is behind it, and .94 of its light.
    van de Hulst, H. C., Light scattering by small particles, 1957, chapter 12.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sumo3dviz_pt.model.falling import Falling, Glows, SkyLight, Throws
from sumo3dviz_pt.model.geometry import Floats


def local(places: Floats, frame: Floats) -> Floats:
    """Return places in the world, (n, 3) [m], in a rigid frame, (4, 4)."""
    apart = [places[:, axis] - frame[axis, 3] for axis in range(3)]
    turned = np.empty_like(places)
    for column in range(3):
        turned[:, column] = sum(apart[axis] * frame[axis, column] for axis in range(3))
    return turned


def along(vectors: Floats, axis: Floats) -> Floats:
    """Return how long vectors, (n, k), are along an axis, (k,)."""
    return np.asarray(sum(vectors[:, k] * float(part) for k, part in enumerate(axis)))


WATER = 1.333
"""Refractive index."""

CLEAR = 0.94
"""Share of light that goes straight through a drop."""

WHITE = 0.95
"""Share of light that a flake scatters."""

_STEPS, _RAYS = 180, 40_000
_SPREAD = 3  # steps over which glints are spread: drops are not quite round
_LAMPLIT = 0.5  # drops lit by lamps are seen against the dark: there a strength counts by its root
CLOSEST = 0.25
"""Lamps are not points nearer than this [m]."""


@cache
def phase_table() -> Floats:
    """Return the phase function of a ball of water by steps of the angle from straight on, [1/sr].

    Its integral over all directions is what leaves the ball by at most one reflection inside,
    about .99.
    """
    # Rays that meet the ball's face evenly, by the square of their distance from its axis.
    sine = np.sqrt((np.arange(_RAYS) + 0.5) / _RAYS)
    entry, inside = np.arcsin(sine), np.arcsin(sine / WATER)
    reflected = _reflected(entry, inside)
    passed = (1.0 - reflected) ** 2
    ways = (
        (np.pi - 2.0 * entry, reflected),
        (2.0 * (entry - inside), passed),
        (np.pi + 2.0 * entry - 4.0 * inside, passed * reflected),
    )
    power = np.zeros(_STEPS)
    for angle, share in ways:
        folded = np.arccos(np.cos(angle))
        step = np.minimum((folded / np.pi * _STEPS).astype(int), _STEPS - 1)
        power += np.bincount(step, weights=share / _RAYS, minlength=_STEPS)
    smooth = np.convolve(np.pad(power, _SPREAD, mode="reflect"), np.ones(2 * _SPREAD + 1), "valid")
    smooth *= power.sum() / smooth.sum()
    edges = np.cos(np.linspace(0.0, np.pi, _STEPS + 1))
    return np.asarray(smooth / (2.0 * np.pi * (edges[:-1] - edges[1:])))


def _reflected(entry: Floats, inside: Floats) -> Floats:
    """Return the share of unpolarised light that a face of water reflects, by Fresnel."""
    one, other = np.cos(entry), np.cos(inside)
    across = ((one - WATER * other) / (one + WATER * other)) ** 2
    along = ((WATER * one - other) / (WATER * one + other)) ** 2
    return np.asarray(0.5 * (across + along))


def phase(cosine: Floats) -> Floats:
    """Return the phase function of drops by the cosine of the angle from straight on, [1/sr]."""
    table = phase_table()
    steps = np.arccos(np.clip(cosine, -1.0, 1.0)) * (_STEPS / np.pi)
    return np.asarray(table[np.minimum(steps.astype(np.int64), _STEPS - 1)])


def even_light(up: Floats, light: SkyLight, ground: float, *, flakes: bool) -> Floats:
    """Return the radiance of drops by sky and ground, (n, 3).

    Args:
        up: Upward part of the unit vectors from the eye to them, (n,).
        light: From above.
        ground: Share of light that the ground reflects.
        flakes: Whether they are flakes.
    """
    sky = np.array(light.sky)
    below = ground * (sky + np.array(light.sun) * max(light.towards[2], 0.0) / np.pi)
    if flakes:
        mean = WHITE * 0.5 * (sky + below)
        return np.asarray(np.broadcast_to(mean, (len(up), 3)))
    above = 0.5 * (1.0 + up)[:, None]
    return np.asarray(CLEAR * (above * sky + (1.0 - above) * below))


def lit(
    places: Floats,
    falling: Falling,
    light: SkyLight,
    *,
    eye: Floats,
    flakes: bool,
    closest: float = CLOSEST,
) -> Floats:
    """Return the radiance of drops or flakes towards the eye, (n, 3).

    Args:
        places: Where they are, (n, 3) [m].
        falling: Says which lamps there are.
        light: Of the sky.
        eye: (3,) [m].
        flakes: Whether they are flakes.
        closest: Distance of lamps that counts at least [m].
    """
    to_eye = eye - places
    to_eye /= np.linalg.norm(to_eye, axis=1, keepdims=True)
    radiance = even_light(-to_eye[:, 2], light, falling.ground, flakes=flakes).copy()
    if max(light.sun) > 0.0:
        straight = -along(to_eye, np.array(light.towards))
        radiance += _scattered(straight, flakes)[:, None] * np.array(light.sun)
    less = 1.0 if flakes else max(falling.strength, 1.0) ** -_LAMPLIT
    for number in range(len(falling.glows.at)):
        radiance += less * _by_glow(
            places, to_eye, falling.glows, number, flakes=flakes, closest=closest
        )
    for number in range(len(falling.throws.frames)):
        radiance += less * _by_throw(
            places, to_eye, falling.throws, number, flakes=flakes, closest=closest
        )
    return radiance


def _scattered(cosine: Floats, flakes: bool) -> Floats:
    """Return the phase function times what is scattered at all, [1/sr]."""
    if flakes:
        return np.full(len(cosine), WHITE / (4.0 * np.pi))
    return phase(cosine)


def _by_glow(
    places: Floats, to_eye: Floats, glows: Glows, number: int, *, flakes: bool, closest: float
) -> Floats:
    """Return the radiance that a lamp gives to drops, (n, 3)."""
    way = places - glows.at[number]
    away = np.linalg.norm(way, axis=1)
    way /= np.maximum(away, 1e-9)[:, None]
    cosine = along(way, glows.axes[number])
    floor, sharpness = glows.lobes[number]
    share = np.maximum(cosine, 0.0) * (floor + (1.0 - floor) * np.exp(sharpness * (cosine - 1.0)))
    share *= _scattered((way * to_eye).sum(axis=1), flakes) / (away**2 + closest**2)
    return np.asarray(share[:, None] * glows.intensity[number])


def _by_throw(
    places: Floats, to_eye: Floats, throws: Throws, number: int, *, flakes: bool, closest: float
) -> Floats:
    """Return the radiance that head lamps give to drops, (n, 3)."""
    frame = throws.frames[number]
    seen = local(places, frame)
    away = np.linalg.norm(seen, axis=1)
    ahead = np.maximum(seen[:, 0], 1e-6)
    count = len(throws.pattern)
    column = (0.5 - 0.5 * seen[:, 1] / (ahead * throws.edge)) * count - 0.5
    row = (0.5 - 0.5 * seen[:, 2] / (ahead * throws.edge)) * count - 0.5
    inside = (seen[:, 0] > 0.0) & (np.abs(column - 0.5 * count) < 0.5 * count)
    inside &= np.abs(row - 0.5 * count) < 0.5 * count
    where = np.flatnonzero(inside)
    share = np.zeros(len(places))
    if len(where):
        way = (places[where] - frame[:3, 3]) / np.maximum(away[where], 1e-9)[:, None]
        scattered = _scattered((way * to_eye[where]).sum(axis=1), flakes)
        rows = np.clip(np.rint(row[where]), 0, count - 1).astype(int)
        columns = np.clip(np.rint(column[where]), 0, count - 1).astype(int)
        arriving = throws.pattern[rows, columns] / (away[where] ** 2 + closest**2)
        share[where] = arriving * scattered
    return np.asarray(share[:, None] * throws.intensity[number])
