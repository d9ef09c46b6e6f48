"""What reaches the channels of a recording from one direction, and what is the same from all.

All directions are in the camera's frame: x ahead, y to the left, z up.

`stereo` is for loudspeakers: two channels that share a source's energy by how far it is to the
side, with the difference of time of two points 17 cm apart. Their powers add up to that at the
listener's place. Front and back are not told apart.

`binaural` is for headphones: a head that is a rigid sphere, without anybody's measured ears. Each
ear hears a source later by the way around the sphere (Woodworth) and through a head shadow that
turns low-pass behind the head, by the structural model of Brown and Duda. The shadow's magnitude
counts band by band; its phase is left out, so that the difference of time is Woodworth's. There is
no pinna, so up and down, and front and back, sound alike while nothing moves.

`ambisonics` is of first order in AmbiX: channels W, Y, Z, X (ACN) in SN3D.

References:
    Brown, C. P. and Duda, R. O., "A structural model for binaural sound synthesis", IEEE
        Transactions on Speech and Audio Processing 6, 1998, doi:10.1109/89.709673.
    Woodworth, R. S. and Schlosberg, H., Experimental Psychology, 1962.
    Nachbar, C. et al., "AmbiX - a suggested Ambisonics format", Ambisonics Symposium, 2011.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.sound.emission import BANDS
from sumo3dviz_pt.sound.propagation import SPEED_OF_SOUND

HEAD = 0.0875
"""Radius of the head [m]."""

_APART = 0.17  # of the two points of stereo [m]
_DEEPEST, _DARKEST = 0.1, np.radians(150.0)  # of the head's shadow, and where that is


@dataclass(frozen=True, slots=True, eq=False)
class Tap:
    """One way from a source into a recording.

    Attributes:
        delays: Beyond that to the middle of the head, (n,) [s]; may be negative.
        bands: Amplitudes, (n, 8).
        channels: What each channel gets of it, (n, channels).
    """

    delays: Floats
    bands: Floats
    channels: Floats


class Ears(Protocol):
    """A kind of recording."""

    @property
    def names(self) -> tuple[str, ...]:
        """Its channels."""

    @property
    def weights(self) -> Floats:
        """What each channel gets of a sound from everywhere whose level is 1, (channels,)."""

    @property
    def meters(self) -> Mapping[str, tuple[int, ...]]:
        """Channels whose powers add up to one that is told, by its name."""

    def taps(self, directions: Floats) -> tuple[Tap, ...]:
        """Return the ways from directions, unit, (n, 3)."""


class Stereo:
    """Two loudspeakers."""

    names = ("left", "right")
    weights = np.sqrt(np.array([0.5, 0.5]))
    meters: Mapping[str, tuple[int, ...]] = MappingProxyType({"listener": (0, 1)})

    def taps(self, directions: Floats) -> tuple[Tap, ...]:
        """Return the ways to the left and to the right point."""
        left, flat = directions[:, 1], np.ones((len(directions), len(BANDS)))
        angle = 0.25 * np.pi * (1.0 - left)
        lag = 0.5 * _APART / SPEED_OF_SOUND * left
        return tuple(
            Tap(delay, flat, share[:, None] * np.eye(2)[channel])
            for channel, (delay, share) in enumerate([(-lag, np.cos(angle)), (lag, np.sin(angle))])
        )


class Binaural:
    """Two ears of a spherical head."""

    names = ("left ear", "right ear")
    weights = np.ones(2)
    meters: Mapping[str, tuple[int, ...]] = MappingProxyType({"left ear": (0,), "right ear": (1,)})

    def taps(self, directions: Floats) -> tuple[Tap, ...]:
        """Return the ways to both ears."""
        made = []
        for channel, side in enumerate((1.0, -1.0)):
            angles = np.arccos(np.clip(side * directions[:, 1], -1.0, 1.0))
            only = np.tile(np.eye(2)[channel], (len(directions), 1))
            made.append(Tap(ear_delays(angles), head_shadow(angles), only))
        return tuple(made)


def ear_delays(angles: Floats) -> Floats:
    """Return how much later an ear hears a source than the head's middle would, (n,) [s].

    Args:
        angles: Between the source and the ear's axis, (n,) [rad].
    """
    lit = -np.cos(np.minimum(angles, 0.5 * np.pi))
    return np.asarray(HEAD / SPEED_OF_SOUND * (lit + np.maximum(angles - 0.5 * np.pi, 0.0)))


def head_shadow(angles: Floats) -> Floats:
    """Return the amplitudes of bands at an ear, (n, 8); Brown and Duda, equations 3 to 5.

    Args:
        angles: Between the source and the ear's axis, (n,) [rad].
    """
    half = 0.5 * _DEEPEST
    alpha = (1.0 + half) + (1.0 - half) * np.cos(angles / _DARKEST * np.pi)
    bend = 2.0 * np.pi * BANDS * HEAD / (2.0 * SPEED_OF_SOUND)
    return np.asarray(np.sqrt((1.0 + (alpha[:, None] * bend) ** 2) / (1.0 + bend**2)))


class Ambisonics:
    """First order, AmbiX."""

    names = ("W", "Y", "Z", "X")
    weights = np.array([1.0, *[np.sqrt(1.0 / 3.0)] * 3])
    meters: Mapping[str, tuple[int, ...]] = MappingProxyType({"listener": (0,)})

    def taps(self, directions: Floats) -> tuple[Tap, ...]:
        """Return the one way, and what the channels get of it."""
        count = len(directions)
        channels = np.column_stack([np.ones(count), directions[:, [1, 2, 0]]])
        return (Tap(np.zeros(count), np.ones((count, len(BANDS))), channels),)


EARS: Mapping[str, Ears] = MappingProxyType(
    {"stereo": Stereo(), "binaural": Binaural(), "ambisonics": Ambisonics()}
)
"""Kinds of recordings, by the name that users choose."""
