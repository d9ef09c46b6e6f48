"""Cryptomatte: ids with coverage, by which compositing programs pick things.

References:
    Friedman and Jones, "Fully automatic ID mattes with support for motion blur and transparency",
        SIGGRAPH 2015 posters, doi:10.1145/2787626.2787629.
    Cryptomatte specification 1.2.0 (https://github.com/Psyop/Cryptomatte).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Image, Ints
from sumo3dviz_pt.model.things import murmur3

_NAME = "CryptoThing"
_RANKS = 6
"""Things of a pixel that are stored, those that cover most first."""


def id_number(name: str) -> np.float32:
    """Return the floating-point number that stands for a name; never NaN or denormal."""
    bits = murmur3(name.encode())
    exponent = bits >> 23 & 255
    if exponent in (0, 255):
        bits ^= 1 << 23
    return np.uint32(bits).view(np.float32)


def mattes(owners: Sequence[Ints], names: Sequence[str]) -> dict[str, Image]:
    """Return the channels of a Cryptomatte, (h, w) each, by name.

    Args:
        owners: Number of the name at some places of every pixel, (h, w) each; 0 is nothing.
        names: By number; the first does not count.
    """
    shape, samples = owners[0].shape, np.stack([one.ravel() for one in owners], axis=-1)
    ranks = min(_RANKS, len(owners))
    which = np.zeros((len(samples), ranks), np.int64)
    share = np.zeros((len(samples), ranks), np.float32)
    # Most pixels show one thing alone.
    which[:, 0] = samples[:, 0]
    share[:, 0] = samples[:, 0] > 0
    mixed = (samples != samples[:, :1]).any(axis=1)
    which[mixed], share[mixed] = _ranked(samples[mixed], ranks)
    numbers = np.array([0.0, *(id_number(name) for name in names[1:])], np.float32)
    ids = numbers[which]
    channels: dict[str, Image] = {}
    for rank in range(ranks):
        level, pair = divmod(rank, 2)
        for channel, values in zip(("RG", "BA")[pair], (ids, share), strict=True):
            channels[f"{_NAME}{level:02d}.{channel}"] = values[:, rank].reshape(shape)
    return channels


def _ranked(samples: Ints, ranks: int) -> tuple[Ints, Image]:
    """Return what covers pixels most, and its shares, (n, ranks) each; 0 where there is no more.

    Args:
        samples: Numbers at places of pixels, (n, places); 0 is nothing.
        ranks: How many are wanted, at most as many as there are places.
    """
    samples = np.sort(samples, axis=-1)
    count = samples.shape[1]
    # A run of equal numbers is counted at its first place; other places get nothing.
    first = np.ones(samples.shape, dtype=np.bool_)
    first[:, 1:] = samples[:, 1:] != samples[:, :-1]
    run = np.cumsum(first, axis=-1) - 1 + np.arange(len(samples))[:, None] * count
    lengths = np.bincount(run.ravel(), minlength=samples.size)
    covered = np.where(first & (samples > 0), lengths[run], 0)
    order = np.argsort(-covered, axis=-1, kind="stable")[:, :ranks]
    share = np.take_along_axis(covered, order, axis=-1).astype(np.float32) / np.float32(count)
    return np.where(share > 0.0, np.take_along_axis(samples, order, axis=-1), 0), share


def header(names: Sequence[str]) -> Mapping[str, str]:
    """Return the strings of a Cryptomatte's header, with the manifest of some names."""
    key = f"cryptomatte/{murmur3(_NAME.encode()):08x}"[:19]
    manifest = {name: f"{id_number(name).view(np.uint32):08x}" for name in sorted(names)}
    return {
        f"{key}/name": _NAME,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps(manifest),
    }
