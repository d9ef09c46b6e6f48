"""Makes the sound at a listener of sources that move, block by block.

Every sample is a function of the scene and of its time alone, so that any part of a film sounds as
it does in the whole. For a sample at time t, each source is heard as it was at the time s when that
sound left it: s + |source(s) - listener(t)| / c = t, solved by Newton's method. So sound comes late
by the way that it goes, and pitch rises and falls as sources come and go (Doppler), without steps.

Levels, ways and directions are found at 3 kHz and lie on straight lines between; times of leaving
lie on cubics. Waves are read between their samples by a polynomial of six points.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.sound.ears import Ears, Tap
from sumo3dviz_pt.sound.emission import A_WEIGHTS, Emission
from sumo3dviz_pt.sound.propagation import (
    BODY_LOSS,
    CABIN_LOSS,
    HALF_SPACE,
    SPEED_OF_SOUND,
    gain_of,
    path_gains,
)
from sumo3dviz_pt.sound.signals import (
    RATE,
    NoiseBank,
    starts_of,
    tone_shares,
    tones,
    turns_of,
)

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

STEP = 0.02
"""Between samples of motion [s]."""

HEIGHT = 0.05
"""Of sources above the road [m]; CNOSSOS-EU, 2.2.1."""

BLOCK = 12_000
"""Samples that are made at once; a multiple of those between which ways are found."""

_FINE = 16  # samples between which ways are found
_EDGE = 0.1  # share of the radius over which sources fade
_NEWTON = 4  # iterations; each squares an error that begins at a hundredth of a second
_BEFORE, _BEHIND = 1, 3  # points at 3 kHz before and behind a block

_SEAT = np.array([0.8, 0.0, -0.6]) / np.linalg.norm([0.8, 0.0, -0.6])
"""Where the own vehicle sounds from: ahead and below, in the camera's frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Something that sounds.

    Attributes:
        name: Unique; chooses its noise.
        places: Where it is, (n, 3) [m]; also known while it does not exist.
        there: How much of it exists, (n,), [0, 1]; it fades in and out.
        emission: Its power, of n samples.
        screens: What buildings take of it, (n, 8) [dB]; None is nothing.
        own: Whether the listener sits in it.
        tone: A pure tone of this frequency and of all the power of its bands is sent instead of
            noise, to measure by [Hz]; 0 for none.
    """

    name: str
    places: Floats
    there: Floats
    emission: Emission
    screens: Floats | None = None
    own: bool = False
    tone: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Bed:
    """A steady sound from everywhere.

    Attributes:
        name: Unique; chooses its noise.
        levels: Of its bands at the listener, (n, 8) [dB].
    """

    name: str
    levels: Floats


@dataclass(frozen=True, slots=True, eq=False)
class SoundScene:
    """Everything that is heard, sampled every `STEP` seconds.

    Attributes:
        begin: Time of the first sample of motion, which is a whole number of steps [s].
        places: Where the listener is, (n, 3) [m].
        frames: How it is turned: columns ahead, left and up, (n, 3, 3).
        sources: Who sounds.
        beds: What sounds from everywhere.
        radius: Beyond which nobody is heard [m].
        soft: Share of ground that swallows sound, [0, 1].
        enclosed: Whether the listener sits in a closed vehicle.
        full_scale: Level of a sine that is as large as samples can be [dB].
        seed: The film's.
    """

    begin: float
    places: Floats
    frames: Floats
    sources: Sequence[Source] = ()
    beds: Sequence[Bed] = ()
    radius: float = 150.0
    soft: float = 0.0
    enclosed: bool = False
    full_scale: float = 100.0
    seed: int = 0

    @property
    def reach(self) -> float:
        """How long sound takes from the farthest that is heard [s]."""
        return self.radius / SPEED_OF_SOUND


def bed_levels(shape: Floats, weighted: Floats) -> Floats:
    """Return levels of bands of a spectrum at A-weighted levels, (n, 8) [dB].

    Args:
        shape: Of the spectrum, (8,) [dB].
        weighted: Levels, (n,) [dB(A)].
    """
    own = 10.0 * np.log10((10.0 ** (0.1 * (shape + A_WEIGHTS))).sum())
    return np.asarray(shape - own + np.asarray(weighted)[:, None])


@dataclass(frozen=True, eq=False)
class _Path:
    """A source, ready to be heard."""

    scene: SoundScene
    source: Source

    @cached_property
    def spline(self) -> CubicSpline:
        """Where it is."""
        return _spline(self.scene.begin, self.source.places)

    @cached_property
    def starts(self) -> list[int]:
        """Where its noise begins."""
        return starts_of(self.scene.seed, self.source.name)

    @cached_property
    def powers(self) -> Floats:
        """Of wheels and of the engine at 1 m over full scale, (n, 16)."""
        levels = np.hstack([self.source.emission.rolling, self.source.emission.propulsion])
        loss = np.tile(BODY_LOSS, 2) if self.source.own else HALF_SPACE
        # A sine at full scale has a root mean square of 1 / sqrt(2).
        return np.asarray(0.5 * 10.0 ** (0.1 * (levels - loss - self.scene.full_scale)))

    @cached_property
    def shares(self) -> tuple[Floats, Floats]:
        """What of its engine is harmonics, (n, 12, 3), and what is noise, (n, 8)."""
        return tone_shares(self.source.emission.firing)

    @cached_property
    def turns(self) -> Floats:
        """How often its engine has fired, (n,)."""
        return turns_of(self.source.emission.firing, STEP)

    @cached_property
    def starting(self) -> float:
        """At which turn its engine begins, so that equal cars do not hum as one."""
        return self.starts[0] % 997 / 997.0

    def fired(self, times: Floats) -> Floats:
        """Return how often its engine has fired at times [s], (n,): the integral of its rate."""
        rates = self.source.emission.firing
        at, share = _places_in(self.scene.begin, times, len(rates))
        dt, rise = share * STEP, (rates[at + 1] - rates[at]) / STEP
        return np.asarray(self.starting + self.turns[at] + rates[at] * dt + 0.5 * rise * dt * dt)


def _spline(begin: float, values: Floats) -> CubicSpline:
    """Return a smooth curve through samples of motion."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(begin + STEP * np.arange(len(values)), values)


def _places_in(begin: float, times: Floats, count: int) -> tuple[Ints, Floats]:
    """Return the sample before each time, and the share of the step since then."""
    steps = np.clip((times - begin) / STEP, 0.0, count - 1.0)
    at = np.minimum(steps.astype(np.int64), count - 2)
    return at, steps - at


def _between(begin: float, times: Floats, values: Floats) -> Floats:
    """Return values at times on straight lines between samples of motion."""
    at, share = _places_in(begin, times, len(values))
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[at] * (1.0 - share) + values[at + 1] * share)


@dataclass(frozen=True, eq=False)
class Renderer:
    """Makes sound of a scene.

    Attributes:
        scene: What is heard.
        ears: How.
        bank: The noise; by default that of the scene's seed.
    """

    scene: SoundScene
    ears: Ears
    bank: NoiseBank | None = field(default=None)

    @cached_property
    def _noise(self) -> NoiseBank:
        return self.bank or NoiseBank.of(self.scene.seed)

    @cached_property
    def _paths(self) -> list[_Path]:
        return [_Path(self.scene, source) for source in self.scene.sources]

    @cached_property
    def _listener(self) -> CubicSpline:
        return _spline(self.scene.begin, self.scene.places)

    def blocks(self, first: int, last: int) -> Iterator[Floats]:
        """Yield samples from one to before another, (n, channels) each; sample 0 is at 0 s."""
        for number in range(first // BLOCK, -(-last // BLOCK)):
            block = self._block(number)
            start = number * BLOCK
            yield block[max(first - start, 0) : max(min(last - start, BLOCK), 0)]

    def _block(self, number: int) -> Floats:
        """Return all samples of a block, (`BLOCK`, channels)."""
        fine = np.arange(-_BEFORE, BLOCK // _FINE + _BEHIND) * _FINE + number * BLOCK
        times = fine / RATE
        scene = self.scene
        eyes = self._listener(times)
        frames = _between(scene.begin, times, scene.frames)
        frames = frames / np.linalg.norm(frames, axis=1, keepdims=True)
        mixed = np.zeros((BLOCK, len(self.ears.names)))
        for path in self._paths:
            if path.source.own:
                self._add_own(mixed, path, times)
            elif self._is_near(path, times):
                self._add(mixed, path, times, (eyes, frames))
        for bed in scene.beds:
            self._add_bed(mixed, bed, times)
        return mixed

    def _is_near(self, path: _Path, times: Floats) -> bool:
        """Return whether anything of a source is heard in a block."""
        scene = self.scene
        span = np.array([times[0] - scene.reach - STEP, times[-1] + STEP])
        low, high = _places_in(scene.begin, span, len(scene.places))[0]
        rows = slice(low, high + 2)
        if not path.source.there[rows].any():
            return False
        seen = path.source.places[rows]
        room = np.ptp(scene.places[rows], axis=0).max() + np.ptp(seen, axis=0).max()
        away = np.linalg.norm(seen - scene.places[rows], axis=1).min()
        return bool(away <= scene.radius + room)

    # Sources -------------------------------------------------------------------------------

    def _add(
        self, mixed: Floats, path: _Path, times: Floats, listener: tuple[Floats, Floats]
    ) -> None:
        """Add what is heard of a source."""
        scene, (eyes, frames) = self.scene, listener
        # When did what is heard leave it?
        left = times - np.linalg.norm(path.spline(times) - eyes, axis=1) / SPEED_OF_SOUND
        for _ in range(_NEWTON):
            way = path.spline(left) - eyes
            far = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
            drift = (way * path.spline(left, 1)).sum(axis=1) / far / SPEED_OF_SOUND
            left = left - (left + far / SPEED_OF_SOUND - times) / (1.0 + np.clip(drift, -0.9, 0.9))
        way = path.spline(left) - eyes
        far = np.maximum(np.linalg.norm(way, axis=1), 1e-9)

        # What is lost on its way, and from where does it come?
        edge = np.clip((scene.radius - far) / (_EDGE * scene.radius), 0.0, 1.0)
        there = _between(scene.begin, left, path.source.there) * edge * edge * (3.0 - 2.0 * edge)
        if not there.any():
            return
        gains = path_gains(far, soft=scene.soft) * there[:, None]
        if path.source.screens is not None:
            gains = gains * gain_of(-_between(scene.begin, times, path.source.screens))
        if scene.enclosed:
            gains = gains * gain_of(-CABIN_LOSS)
        ahead = np.einsum("nij,ni->nj", frames, way / far[:, None])
        # Nearer than an arm's length a body is all around.
        ahead = ahead * (far / np.maximum(far, 0.2))[:, None]
        for tap in self.ears.taps(ahead):
            self._add_tap(mixed, path, Tap(left - tap.delays, gains * tap.bands, tap.channels))

    def _add_own(self, mixed: Floats, path: _Path, times: Floats) -> None:
        """Add what is heard of the vehicle that the listener sits in."""
        there = _between(self.scene.begin, times, path.source.there)
        for tap in self.ears.taps(np.tile(_SEAT, (len(times), 1))):
            own = Tap(times - tap.delays, there[:, None] * tap.bands, tap.channels)
            self._add_tap(mixed, path, own)

    def _add_tap(self, mixed: Floats, path: _Path, tap: Tap) -> None:
        """Add one way of a source into the recording; the tap's delays are times of leaving."""
        scene, left = self.scene, tap.delays
        powers = _between(scene.begin, left, path.powers)
        rolling, engine = np.split(powers * np.tile(tap.bands**2, 2), 2, axis=1)
        first = int(np.floor(left[0] * RATE)) - 3
        sent = np.arange(first, int(np.ceil(left[-1] * RATE)) + 4)
        # All that changes slowly, at the times of the samples that were sent.
        rows = np.interp(sent / RATE, left, np.arange(len(left)))
        at = np.minimum(rows.astype(np.int64), len(left) - 2)
        share = (rows - at).astype(np.float32)[:, None]

        def smooth(values: Floats) -> Floats:
            some = values.astype(np.float32)
            return np.asarray(some[at] + (np.diff(some, axis=0)[at]) * share)

        if path.source.tone:
            size = smooth(np.sqrt(2.0 * (rolling + engine).sum(axis=1))[:, None])[:, 0]
            wave = size * np.sin(2.0 * np.pi * path.source.tone * sent / RATE)
        else:
            harmonic, rest = (_between(scene.begin, left, each) for each in path.shares)
            wave = self._noise.mixed(first, smooth(np.sqrt(rolling + rest * engine)), path.starts)
            if path.source.emission.firing.any():
                shares = (harmonic * engine[:, None, : harmonic.shape[2]]).sum(axis=2)
                wave += tones(path.fired(sent / RATE), smooth(np.sqrt(2.0 * shares)))
        heard = read_between(wave, _upsampled(left) * RATE - first)
        mixed += heard[:, None] * _linear(tap.channels)

    # From everywhere -----------------------------------------------------------------------

    def _add_bed(self, mixed: Floats, bed: Bed, times: Floats) -> None:
        """Add a sound from everywhere: noise of its own in each channel."""
        scene = self.scene
        levels = _between(scene.begin, times, bed.levels) - scene.full_scale
        if scene.enclosed:
            levels = levels - CABIN_LOSS
        gains = _linear(np.sqrt(0.5) * gain_of(levels))
        first = round(times[_BEFORE] * RATE)
        for channel, weight in enumerate(self.ears.weights):
            starts = starts_of(scene.seed, f"{bed.name}/{self.ears.names[channel]}")
            mixed[:, channel] += weight * self._noise.mixed(first, gains, starts)


def _linear(values: Floats) -> Floats:
    """Return values at a block's samples, on straight lines, (`BLOCK`, ...)."""
    now, after = values[_BEFORE:-_BEHIND], values[_BEFORE + 1 : 1 - _BEHIND]
    share = (np.arange(_FINE) / _FINE).reshape(1, -1, *[1] * (values.ndim - 1))
    made = now[:, None] * (1.0 - share) + after[:, None] * share
    return np.asarray(made.reshape(-1, *values.shape[1:]))


def _upsampled(values: Floats) -> Floats:
    """Return values at a block's samples, on cubics through four points each, (`BLOCK`,)."""
    count = len(values) - _BEFORE - _BEHIND
    points = [values[_BEFORE + k : _BEFORE + k + count, None] for k in (-1, 0, 1, 2)]
    weights = _lagrange(np.arange(_FINE) / _FINE, (-1, 0, 1, 2))
    return np.asarray(sum(p * w for p, w in zip(points, weights, strict=True))).ravel()


def read_between(wave: Floats, places: Floats) -> Floats:
    """Return a wave at places between its samples, by polynomials of six points.

    Args:
        wave: (n,).
        places: In samples from the first, each with three on either side.
    """
    whole = np.floor(places).astype(np.int64)
    nodes = (-2, -1, 0, 1, 2, 3)
    weights = _lagrange(places - whole, nodes)
    return np.asarray(sum(w * wave[whole + k] for w, k in zip(weights, nodes, strict=True)))


def _lagrange(shares: Floats, nodes: Sequence[int]) -> list[Floats]:
    """Return the weights of points at whole places, for places in [0, 1)."""
    away = [shares - node for node in nodes]
    weights = []
    for own in nodes:
        weight = np.ones_like(shares)
        for node, gap in zip(nodes, away, strict=True):
            if node != own:
                weight = weight * (gap / (own - node))
        weights.append(weight)
    return weights
