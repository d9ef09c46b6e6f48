"""Writes a recording as a WAV file, and says how loud it is.

Samples are floats of 32 bits, so that nothing is cut off. Levels are those of a sound level meter:
A-weighted, and for the maximum with the time weighting F, settled on the first 125 ms.

References:
    IEC 61672-1: A-weighting (annex E) and time weighting F, 125 ms.
    Multimedia Programming Interface and Data Specifications 1.0, 1991; Microsoft, "Multiple channel
        audio data and WAVE files", 2007: 3 is a float.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.sound.render import BLOCK, Renderer
from sumo3dviz_pt.sound.signals import RATE

_FAST = 0.125  # [s]
_LARGEST = 2**32 - 2**16  # that a WAV file can hold [bytes]


@dataclass(frozen=True, slots=True)
class Loudness:
    """How loud a recording is.

    Attributes:
        equivalent: LAeq by meter [dB(A)].
        maximum: LAFmax by meter [dB(A)].
        peak: The largest sample, over full scale [dB].
    """

    equivalent: Mapping[str, float]
    maximum: Mapping[str, float]
    peak: float

    def as_dict(self) -> dict[str, Any]:
        """For accounts, in dB of two decimals; None is silence."""
        return {
            "LAeq": {name: _rounded(value) for name, value in self.equivalent.items()},
            "LAFmax": {name: _rounded(value) for name, value in self.maximum.items()},
            "peak_dbfs": _rounded(self.peak),
        }


def _rounded(level: float) -> float | None:
    """Return a level as accounts tell it."""
    return round(level, 2) if np.isfinite(level) else None


class Meter:
    """Measures a recording as it passes.

    Args:
        meters: Channels whose powers add up to one that is told, by its name.
        full_scale: Level of a sine that is as large as samples can be [dB].
    """

    def __init__(self, meters: Mapping[str, tuple[int, ...]], full_scale: float) -> None:
        self._meters, self._full_scale = meters, full_scale
        self._states: dict[int, Floats] = {}
        self._fast: dict[str, Floats] = {}
        self._sums = dict.fromkeys(meters, 0.0)
        self._most = dict.fromkeys(meters, 0.0)
        self._count, self._peak = 0, 0.0

    def heard(self, block: Floats) -> None:
        """Take the next samples, (n, channels)."""
        from scipy.signal import lfilter, sosfilt

        if not len(block):
            return
        keep = np.exp(-1.0 / (_FAST * RATE))
        self._count += len(block)
        self._peak = max(self._peak, float(np.abs(block).max()))
        for name, channels in self._meters.items():
            power = np.zeros(len(block))
            for channel in channels:
                state = self._states.get(channel, np.zeros((len(_a_weighting()), 2)))
                weighted, self._states[channel] = sosfilt(
                    _a_weighting(), block[:, channel], zi=state
                )
                power += weighted**2
            if name not in self._fast:
                # As if it had sounded so before: a meter that starts from silence shows too little.
                settled = float(power[: round(_FAST * RATE)].mean())
                self._fast[name], self._most[name] = np.array([keep * settled]), settled
            fast, self._fast[name] = lfilter([1.0 - keep], [1.0, -keep], power, zi=self._fast[name])
            self._sums[name] += float(power.sum())
            self._most[name] = max(self._most[name], float(fast.max()))

    def read(self) -> Loudness:
        """Return how loud all of it was."""
        count = max(self._count, 1)
        return Loudness(
            {name: self._level(value / count) for name, value in self._sums.items()},
            {name: self._level(value) for name, value in self._most.items()},
            float(20.0 * np.log10(self._peak)) if self._peak > 0.0 else -np.inf,
        )

    def _level(self, power: float) -> float:
        """Return the level of a mean square of samples [dB]."""
        return float(10.0 * np.log10(2.0 * power)) + self._full_scale if power > 0.0 else -np.inf


@cache
def _a_weighting() -> Floats:
    """Return A-weighting as sections of a digital filter, (k, 6)."""
    from scipy.signal import bilinear_zpk, zpk2sos

    poles = -2.0 * np.pi * np.array([20.598997, 20.598997, 107.65265, 737.86223] + [12194.217] * 2)
    zeros = np.zeros(4)
    at = 2j * np.pi * 1000.0
    gain = abs(np.prod(at - poles) / np.prod(at - zeros))
    return np.asarray(zpk2sos(*bilinear_zpk(zeros, poles, gain, RATE)))


def record(renderer: Renderer, path: Path, count: int) -> Loudness:
    """Write a recording.

    Args:
        renderer: Makes it.
        path: The WAV file.
        count: How many samples.

    Raises:
        ValueError: If it would be larger than WAV files can be.
    """
    meter = Meter(renderer.ears.meters, renderer.scene.full_scale)

    def measured() -> Iterator[Floats]:
        total = -(-count // BLOCK)
        for number, block in enumerate(renderer.blocks(0, count)):
            announce(Doing.HEAR, number, total)
            meter.heard(block)
            yield block

    write_wav(path, measured(), channels=len(renderer.ears.names), count=count)
    return meter.read()


def write_wav(path: Path, blocks: Iterable[Floats], *, channels: int, count: int) -> None:
    """Write samples as a WAV file of floats.

    Args:
        path: The file.
        blocks: Of samples, (n, channels) each.
        channels: How many.
        count: How many samples there are in each.

    Raises:
        ValueError: If it would be larger than WAV files can be.
    """
    size = 4 * channels * count
    if size > _LARGEST:
        raise ValueError(f"{size / 1e9:.1f} GB are more than a WAV file can hold")
    form = struct.pack("<HHIIHHH", 3, channels, RATE, 4 * channels * RATE, 4 * channels, 32, 0)
    fact = struct.pack("<4sII", b"fact", 4, count)
    head = b"WAVE" + struct.pack("<4sI", b"fmt ", len(form)) + form + fact
    with path.open("wb") as file:
        file.write(struct.pack("<4sI", b"RIFF", len(head) + 8 + size) + head)
        file.write(struct.pack("<4sI", b"data", size))
        for block in blocks:
            file.write(block.astype("<f4").tobytes())
