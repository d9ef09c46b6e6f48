"""Finds light that was changed after it was traced: painted, scaled, tinted, made grey.

Films of a study have one seed, so a pixel is the same to its last bit unless one of its paths met
what differs. Where one did, it brings light of its own, with noise of its own: what is lit by more
or less by a share *s* differs from pixel to pixel by as much as its noise times *s*. A brush
multiplies light and noise alike. So many pixels of a noisy block that changed by one and the same
share were not traced so; nor were pixels that changed their colour and kept their luminance.
Neither limit hangs on what the factor throws, or how far.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.colour import LUMINANCE
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints

CHANGED = 0.02
"""Logarithm of the share by which a channel of a pixel must differ to count."""

SAME_SHARE = 0.25
"""Share of a block's pixels that must have changed alike."""

_OF_NOISE, _WIDEST, _NARROWEST = 0.15, 0.02, 0.003
"""How far the logarithms of shares lie apart that count as one: this times what noise would make of
them, and at most and at least so much. Light is stored in half precision, which is 0.001 here."""

_SAME_LUMINANCE = 0.004
"""Logarithm of the share by which luminance may differ where colour alone was changed."""

_LEAST = 16
"""Pixels that a block must have to tell anything."""


def touched_blocks(
    one: Image, other: Image, albedo: Image, things: Ints, *, telling: Bools, side: int
) -> Bools:
    """Return which blocks of a picture hold light that was changed by hand, (rows, columns).

    Args:
        one: Light of the first film, (h, w, 3) [white].
        other: Of the second.
        albedo: Reflectance of the first surface, (h, w, 3).
        things: What is seen, (h, w).
        telling: Pixels that are compared, (h, w).
        side: Of blocks [px].
    """
    first, second = one.astype(np.float64), other.astype(np.float64)
    seen = telling & (np.minimum(first, second).min(axis=-1) > 1e-5)
    logs = np.log(np.maximum(second, 1e-9) / np.maximum(first, 1e-9))
    bright = np.log(np.maximum(second @ LUMINANCE, 1e-9) / np.maximum(first @ LUMINANCE, 1e-9))
    tinted = seen & (np.abs(logs).max(axis=-1) > CHANGED) & (np.abs(bright) < _SAME_LUMINANCE)
    noise = _noise(first @ LUMINANCE, np.maximum(albedo @ LUMINANCE, 0.02), things, seen)
    rows, columns = (length // side for length in seen.shape)
    found: Bools = np.zeros((rows, columns), dtype=np.bool_)
    changed = seen & (np.abs(logs).max(axis=-1) > CHANGED)
    for row, column in np.ndindex(rows, columns):
        where = np.s_[row * side : (row + 1) * side, column * side : (column + 1) * side]
        inside = seen[where]
        count = int(inside.sum())
        if count < _LEAST or changed[where].sum() < SAME_SHARE * count:
            continue
        alike = float(tinted[where].sum())
        known = noise[where][np.isfinite(noise[where])]
        typical = float(np.median(known)) if len(known) else 0.0
        for channel in range(3):
            alike = max(alike, _most_alike(logs[where][..., channel][inside], typical))
        found[row, column] = alike > SAME_SHARE * count
    return found


def _most_alike(logs: Floats, noise: float) -> int:
    """Return how many pixels changed by one and the same share, at most.

    Args:
        logs: Logarithms of shares, (n,).
        noise: Of the light there, as the logarithm of a typical share.
    """
    changed = np.sort(logs[np.abs(logs) > CHANGED])
    wide = np.minimum(_OF_NOISE * np.abs(1.0 - np.exp(-changed)) * noise, _WIDEST)
    ends = np.searchsorted(changed, changed + wide, side="right")
    alike = (ends - np.arange(len(changed)))[wide >= _NARROWEST]
    return int(alike.max(initial=0))


def _noise(light: Floats, albedo: Floats, things: Ints, seen: Bools) -> Floats:
    """Return by how much light differs from a pixel to the next of the same thing, (h, w).

    It is the logarithm of the share, without what paint does; NaN where the next is another thing.
    """
    level = np.log(np.maximum(light, 1e-9) / albedo)
    apart = np.abs(np.diff(level, axis=1))
    pairs = (things[:, 1:] == things[:, :-1]) & seen[:, 1:] & seen[:, :-1] & (things[:, 1:] != 0)
    return np.pad(np.where(pairs, apart, np.nan), ((0, 0), (0, 1)), constant_values=np.nan)
