"""The waves that sources send out: noise in octave bands, and the tones of an engine.

Noise of each band is drawn once from the film's seed and repeats after 11 s, which nobody hears in
noise; each source begins elsewhere in each band, by its id. So what a source sends at a time hangs
on that time alone.

Tones are a model of our own: harmonics of the rate of ignitions take a share of the propulsion
noise of the bands up to 250 Hz, spread over those that lie near the band's centre; the rest of the
band is noise. So a band has the power that it should have at any rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.random import dice_of, seed_of
from sumo3dviz_pt.sound.emission import BANDS

RATE = 48_000
"""Samples in a second [Hz]."""

PERIOD = 2**19
"""Samples after which noise repeats."""

TONES = 12
"""Harmonics of the rate of ignitions."""

_SHARES = np.array([0.9, 0.8, 0.6])
"""Share of the power of the lowest bands that is tones where harmonics lie in them."""

_SCARCE = 0.05  # sum of weights of harmonics at which half of that share is noise


@dataclass(frozen=True, slots=True, eq=False)
class NoiseBank:
    """Noise of each octave band, of a root mean square of 1.

    Attributes:
        waves: (8, `PERIOD`).
    """

    waves: np.ndarray[tuple[int, int], np.dtype[np.float32]]

    @classmethod
    def of(cls, seed: int) -> NoiseBank:
        """Draw it."""
        frequencies = np.fft.rfftfreq(PERIOD, 1.0 / RATE)
        octaves = np.log2(np.maximum(frequencies, 1.0) / BANDS[:, None])
        made = []
        for number, away in enumerate(octaves):
            rng = dice_of(seed, "sound", str(number))
            phases = rng.uniform(0.0, 2.0 * np.pi, len(frequencies))
            # Bands overlap a little, and their powers add up to that of one.
            edge = np.clip((0.55 - np.abs(away)) / 0.1, 0.0, 1.0)
            wave = np.fft.irfft(np.sin(0.5 * np.pi * edge) * np.exp(1j * phases), PERIOD)
            made.append((wave / wave.std()).astype(np.float32))
        return cls(np.stack(made))

    def mixed(self, first: int, gains: Floats, starts: list[int]) -> Floats:
        """Return noise with changing levels of its bands, (n,).

        Args:
            first: Number of the first sample.
            gains: Amplitudes, (n, 8).
            starts: Where each band begins, as `starts_of` says.
        """
        count = len(gains)
        wave = np.zeros(count, dtype=np.float32)
        for band, (own, start) in enumerate(zip(self.waves, starts, strict=True)):
            at = (first + start) % PERIOD
            some = own[at : at + count]
            if len(some) < count:  # it begins anew
                some = np.concatenate([some, np.resize(own, count - len(some))])
            wave += gains[:, band] * some
        return np.asarray(wave, dtype=np.float64)


def starts_of(seed: int, name: str) -> list[int]:
    """Return where a source begins in each band of the noise."""
    return [seed_of(seed, "sound", name, str(band)) % PERIOD for band in range(len(BANDS))]


def tone_shares(rates: Floats) -> tuple[Floats, Floats]:
    """Return what share of a band's propulsion noise each harmonic, and noise, are.

    Args:
        rates: Of ignitions, (n,) [Hz]; 0 is no engine.

    Returns:
        Of harmonics, (n, `TONES`, 3), and of noise, (n, 8).
    """
    low = len(_SHARES)
    heights = np.maximum(rates, 1e-3)[:, None] * np.arange(1, TONES + 1)
    away = np.abs(np.log2(heights[:, :, None] / BANDS[:low]))
    weights = np.maximum(1.0 - away, 0.0)
    shares = _SHARES * weights / (weights.sum(axis=1, keepdims=True) + _SCARCE)
    noise = np.ones((len(rates), len(BANDS)))
    noise[:, :low] -= shares.sum(axis=1)
    return shares, noise


def turns_of(rates: Floats, step: float) -> Floats:
    """Return how often an engine has fired since the first sample, (n,): rates are linear between.

    Args:
        rates: Of ignitions, (n,) [Hz].
        step: Between samples [s].
    """
    return np.concatenate([[0.0], np.cumsum(0.5 * step * (rates[1:] + rates[:-1]))])


def tones(turns: Floats, amplitudes: Floats) -> Floats:
    """Return harmonics with changing amplitudes, (n,).

    Args:
        turns: How often the engine has fired, (n,).
        amplitudes: (n, `TONES`).
    """
    base = np.exp(2j * np.pi * np.mod(turns, 1.0))
    base = base.astype(np.complex64)
    now, wave = base.copy(), np.zeros(len(turns), dtype=np.float32)
    for number in range(TONES):
        wave += amplitudes[:, number] * now.imag
        now *= base
    return np.asarray(wave, dtype=np.float64)
