"""How sound comes from a source to a listener: air, ground, buildings in between, a cabin around.

The ground is a mirror: beside the source its image sounds, in energy and not in phase, as sources
of CNOSSOS-EU send into the half space above hard ground and lie 5 cm over it, where source and
image are one. Ground that swallows sound takes the image away, up to 3 dB: the least that
CNOSSOS-EU lets ground do, -3 (1 - G).

A building between both is a screen: what comes around its two sides or over its roof, whichever is
the shortest detour, is lower by the law of diffraction of CNOSSOS-EU, up to 25 dB. Of several
buildings the one with the longest detour counts. Reflections off facades are left out.

References:
    ISO 9613-1:1993, equations 3 to 5 and annex B: absorption of air.
    Commission Directive (EU) 2015/996, Annex, 2.5.15 and after (ground), 2.5.21 (diffraction, after
        Maekawa, Applied Acoustics 1, 1968, doi:10.1016/0003-682X(68)90020-0).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, frozen
from sumo3dviz_pt.sound.emission import BANDS

TEMPERATURE, HUMIDITY = 293.15, 50.0
"""Of the air: [K], [%]. 20 degrees Celsius are those of CNOSSOS-EU's power levels."""

SPEED_OF_SOUND = 343.2
"""At 20 degrees Celsius [m/s]; ISO 9613-1, A.1."""

HALF_SPACE = 10.0 * np.log10(2.0 * np.pi)
"""What the level at 1 m is below the power level, over hard ground [dB]."""

NEAREST = 0.5
"""Nearer than this a source is no louder: it is no point [m]."""

CABIN_LOSS = np.array([8.0, 12.0, 16.0, 20.0, 25.0, 29.0, 32.0, 34.0])
"""By how much a closed vehicle lowers what comes from outside, our own estimate [dB]."""

BODY_LOSS = np.array([25.0, 26.0, 28.0, 32.0, 39.0, 44.0, 48.0, 52.0])
"""Sound power of the own vehicle over the level at its seats, our own estimate [dB]: a car at 50
km/h has about 61 dB(A) inside."""

_MOST = 25.0  # that a screen takes [dB]


def absorption(frequencies: Floats = BANDS) -> Floats:
    """Return what air takes of pure tones, (n,) [dB/m]; ISO 9613-1, 20 degrees, 50 %, 1013 hPa."""
    warm = TEMPERATURE / 293.15
    saturation = 10.0 ** (-6.8346 * (273.16 / TEMPERATURE) ** 1.261 + 4.6151)
    water = HUMIDITY * saturation
    oxygen = 24.0 + 4.04e4 * water * (0.02 + water) / (0.391 + water)
    nitrogen = warm**-0.5 * (9.0 + 280.0 * water * np.exp(-4.170 * (warm ** (-1 / 3) - 1.0)))
    square = np.asarray(frequencies, dtype=np.float64) ** 2
    relaxed = 0.01275 * np.exp(-2239.1 / TEMPERATURE) / (oxygen + square / oxygen)
    relaxed = relaxed + 0.1068 * np.exp(-3352.0 / TEMPERATURE) / (nitrogen + square / nitrogen)
    return np.asarray(8.686 * square * (1.84e-11 * warm**0.5 + warm**-2.5 * relaxed))


_ABSORPTION = absorption()


def path_gains(distances: Floats, *, soft: float) -> Floats:
    """Return the amplitude of each band by distance, over that at 1 m on hard ground, (n, 8).

    Args:
        distances: (n,) [m].
        soft: Share of ground that swallows sound, G, [0, 1].
    """
    spread = (distances**8 + NEAREST**8) ** (-1 / 8)
    air = 10.0 ** (-0.05 * distances[:, None] * _ABSORPTION)
    return np.asarray(10.0 ** (-0.15 * soft) * spread[:, None] * air)


def gain_of(decibels: Floats) -> Floats:
    """Return amplitudes of levels [dB]."""
    return np.asarray(10.0 ** (0.05 * decibels))


# Buildings ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Building:
    """A screen.

    Attributes:
        outline: Its plan, (n, 2) [m], n > 2.
        top: Height of its roof in the world [m].
    """

    outline: Floats
    top: float

    def __post_init__(self) -> None:
        """Make the outline read-only."""
        object.__setattr__(self, "outline", frozen(self.outline).reshape(-1, 2))


def detours(listeners: Floats, sources: Floats, buildings: Sequence[Building]) -> Floats:
    """Return how much longer the way around or over buildings is, (n,) [m]; 0 where one sees.

    Args:
        listeners: (n, 3) [m].
        sources: (n, 3) [m].
        buildings: Between them, or anywhere.
    """
    longest = np.zeros(len(listeners))
    low = np.minimum(listeners, sources)[:, :2]
    high = np.maximum(listeners, sources)[:, :2]
    for each in buildings:
        near = (low <= each.outline.max(axis=0)) & (high >= each.outline.min(axis=0))
        rows = np.flatnonzero(near.all(axis=1))
        if len(rows):
            longest[rows] = np.maximum(longest[rows], _around(listeners[rows], sources[rows], each))
    return longest


def _around(eyes: Floats, sources: Floats, building: Building) -> Floats:
    """Return the detour that one building makes, (n,) [m]."""
    enters, leaves, hit = _crossing(eyes[:, :2], sources[:, :2], building.outline)
    # It is in the way where the straight line is below its roof.
    way = sources - eyes
    first, last = (eyes + share[:, None] * way for share in (enters, leaves))
    hit &= np.minimum(first[:, 2], last[:, 2]) < building.top
    straight = np.linalg.norm(way, axis=1)
    roofs = [np.maximum(each[:, 2], building.top) for each in (first, last)]
    over = [
        np.column_stack([each[:, :2], high])
        for each, high in zip((first, last), roofs, strict=True)
    ]
    legs = pairwise([eyes, *over, sources])
    roof = np.sum([np.linalg.norm(after - one, axis=1) for one, after in legs], axis=0)
    # Around a side, the corner that makes the way longest is the one that it turns about.
    corners = building.outline
    ways = np.linalg.norm(corners - eyes[:, None, :2], axis=2)
    ways = ways + np.linalg.norm(corners - sources[:, None, :2], axis=2)
    to = corners - eyes[:, None, :2]
    side = way[:, None, 0] * to[..., 1] - way[:, None, 1] * to[..., 0]
    flat = np.linalg.norm(way[:, :2], axis=1)
    sides = [np.where(side * sign >= 0.0, ways, flat[:, None]).max(axis=1) for sign in (1, -1)]
    detour = np.minimum(np.minimum(*sides) - flat, roof - straight)
    return np.where(hit, np.maximum(detour, 1e-6), 0.0)


def _crossing(starts: Floats, ends: Floats, ring: Floats) -> tuple[Floats, Floats, Bools]:
    """Return the shares of ways at which they first and last cross a ring, and which do."""
    way = (ends - starts)[:, None, :]
    edge = np.roll(ring, -1, axis=0) - ring
    gap = ring - starts[:, None, :]
    area = way[..., 0] * edge[:, 1] - way[..., 1] * edge[:, 0]
    safe = np.where(np.abs(area) < 1e-12, np.inf, area)
    along = (gap[..., 0] * edge[:, 1] - gap[..., 1] * edge[:, 0]) / safe
    across = (gap[..., 0] * way[..., 1] - gap[..., 1] * way[..., 0]) / safe
    met = (along > 0.0) & (along < 1.0) & (across >= 0.0) & (across <= 1.0) & np.isfinite(safe)
    first = np.where(met, along, 1.0).min(axis=1)
    last = np.where(met, along, 0.0).max(axis=1)
    return first, last, np.asarray(met.any(axis=1))


def screening(lengths: Floats, *, over: int) -> Floats:
    """Return what buildings take, (n, 8) [dB]: smooth in time.

    Args:
        lengths: Detours, (n,) [m]; 0 where one sees the source.
        over: Samples on either side over which it is smoothed.
    """
    waves = SPEED_OF_SOUND / BANDS
    taken = np.where(
        lengths[:, None] > 0.0,
        np.minimum(10.0 * np.log10(3.0 + 40.0 * lengths[:, None] / waves), _MOST),
        0.0,
    )
    if not taken.any():
        return taken
    weights = np.bartlett(2 * over + 3)[1:-1]
    padded = np.pad(taken, ((over, over), (0, 0)), mode="edge")
    columns = [np.convolve(band, weights / weights.sum(), mode="valid") for band in padded.T]
    return np.asarray(np.column_stack(columns))
