"""Forecasts what a film will cost: CPU time, wall time, memory and disk.

The constants are from `ronda` and `crossing` at 640x360 and 1280x720 on a shared server, see
docs/internals/forecasts.md; machines differ by a factor of two. Those of a GPU are of one card.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from sumo3dviz_pt.installation.dependencies import threads
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.numbers import LAYER_KINDS, LayerName

_START = 16.0
"""Reading, building, loading and compiling [CPU-s]; 10 less where a kept place is found."""

_START_PER_MEGATRIANGLE = 3.5
"""The same, for each million triangles [CPU-s]."""


@dataclass(frozen=True, slots=True)
class Rates:
    """What a frame takes of what traces it [CPU-s, or s of a GPU].

    Attributes:
        update: Moving all road users, for each million triangles of the shot: one thread's work.
        sample: For each million samples.
        pixel: For each million pixels.
        neighbour: Averaging with a frame before or after, for each million pixels: one thread's.
        tone: What is done to each million pixels beside the denoiser.
        denoiser: By its quality, for each million pixels.
    """

    update: float
    sample: float
    pixel: float
    neighbour: float
    tone: float
    denoiser: Mapping[str, float]

    def update_of(self, triangles: int) -> float:
        """Return what moving everything takes."""
        return self.update * triangles / 1e6

    def help_of(self, quality: Quality, *, size: tuple[int, int], frames: int) -> float:
        """Return what averaging with frames before and after takes each frame.

        Args:
            quality: How many frames help.
            size: Width, height [px].
            frames: Of the film; a picture alone has no help.
        """
        neighbours = 2 * min(quality.accumulate, frames - 1) if frames > 1 else 0
        return neighbours * self.neighbour * size[0] * size[1] / 1e6


PROCESSOR = Rates(
    update=0.42,
    sample=1.05,
    pixel=1.1,
    neighbour=0.075,
    tone=0.0,
    denoiser={"none": 0.0, "fast": 1.75, "balanced": 2.8, "high": 2.8},
)
"""Of the server's CPU-seconds; the denoiser's include tone."""

GPU = Rates(
    update=0.025,
    sample=0.0065,
    pixel=0.18,
    neighbour=0.001,
    tone=0.25,
    denoiser={"none": 0.0, "fast": 0.02, "balanced": 0.02, "high": 0.02},
)
"""Of one H200's seconds, with the 16 cores beside it (docs/howto/gpu.md).

Samples, pixels, update and denoiser were measured; averaging on the card is an estimate.
"""


def rates_of(variant: str) -> Rates:
    """Return what frames take by the variant that traces them."""
    return GPU if variant == "cuda" else PROCESSOR


_ENCODE = 0.09
"""Encoding a frame as H.264, for each million pixels [CPU-s]."""

_SERIAL_START = 0.7
"""Share of the start that one thread does."""

_EXR, _EXR_TRACED, _FILM = 3.8, 9.0, 0.15
"""Bytes a pixel of a stored frame in half precision, finished or traced, and of a film (H.264)."""

_MEMORY, _MEMORY_PER_MEGAPIXEL, _MEMORY_PER_MEGATRIANGLE = 1750.0, 1100.0, 300.0
"""Memory at its peak: always, and for each million pixels and triangles [MB]."""

_RAYS = 0.15
"""One ray through the centre of each pixel, for all layers, for each million pixels [CPU-s]."""

_DAYS = 3
"""From so many on, days are told instead of hours."""

TYPICAL_TRIANGLES = 1_400_000
"""Triangles of a shot of which no more is known."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What a shot costs.

    Attributes:
        cpu_seconds_per_frame: Of later frames.
        cpu_hours: Of the whole shot, its start included.
        wall_seconds: If nothing else runs.
        memory_mb: At its peak.
        frames_mb: Of stored frames on disk; `cost_of` takes half precision.
        film_mb: Of the film.
    """

    cpu_seconds_per_frame: float
    cpu_hours: float
    wall_seconds: float
    memory_mb: float
    frames_mb: float
    film_mb: float

    def as_dict(self) -> dict[str, float]:
        """For JSON, rounded to what is known."""
        return {key: _rounded(value) for key, value in asdict(self).items()}


def cost_of(
    quality: Quality,
    *,
    size: tuple[int, int],
    triangles: int,
    frames: int,
    cores: int | None = None,
    rates: Rates = PROCESSOR,
) -> Cost:
    """Forecast what a shot costs.

    Args:
        quality: Samples and denoiser.
        size: Width, height [px].
        triangles: That the shot holds.
        frames: How many.
        cores: That work; None is all of this machine's.
        rates: Of what traces: `PROCESSOR` or `GPU`.
    """
    cores = cores or threads()
    megapixels = size[0] * size[1] / 1e6
    together = quality.accumulate if frames > 1 else 0
    stages = stages_of(quality, size=size, triangles=triangles, frames=frames, rates=rates)
    frame = stages.trace + stages.develop
    whole = stages.start + frames * (frame + stages.encode)
    return Cost(
        cpu_seconds_per_frame=frame.cpu,
        cpu_hours=whole.cpu / 3600,
        wall_seconds=whole.wall(cores),
        memory_mb=memory_forecast(megapixels, triangles),
        frames_mb=frames * megapixels * (_EXR_TRACED if together else _EXR),
        film_mb=frames * megapixels * _FILM,
    )


@dataclass(frozen=True, slots=True)
class LayersCost:
    """What the layers of one frame cost.

    Attributes:
        cpu_seconds: One thread's work.
        megabytes: On disk.
    """

    cpu_seconds: float
    megabytes: float


def layers_cost(layers: Sequence[LayerName], *, size: tuple[int, int]) -> LayersCost:
    """Forecast what the layers of one frame cost.

    Args:
        layers: That are asked for; none costs nothing.
        size: Width, height [px].
    """
    megapixels = size[0] * size[1] / 1e6
    rays = _RAYS if layers else 0.0
    own = [LAYER_KINDS[layer] for layer in layers]
    return LayersCost(
        megapixels * (rays + sum(kind.cpu for kind in own)),
        megapixels * sum(kind.stored for kind in own),
    )


@dataclass(frozen=True, slots=True)
class Work:
    """Work of one thread alone, and work that all threads share.

    Attributes:
        serial: [CPU-s].
        shared: [CPU-s].
    """

    serial: float = 0.0
    shared: float = 0.0

    def __add__(self, other: Work) -> Work:
        return Work(self.serial + other.serial, self.shared + other.shared)

    def __rmul__(self, times: float) -> Work:
        return Work(times * self.serial, times * self.shared)

    @property
    def cpu(self) -> float:
        """All of it [CPU-s]."""
        return self.serial + self.shared

    def wall(self, cores: int) -> float:
        """Return how long it takes if nothing else runs [s]."""
        return self.serial + self.shared / cores


@dataclass(frozen=True, slots=True)
class Stages:
    """What the stages of a film cost.

    Attributes:
        start: Reading, building, loading and compiling, once in every process.
        trace: Tracing one frame.
        develop: Making a picture of one frame.
        encode: Putting that into the film.
    """

    start: Work
    trace: Work
    develop: Work
    encode: Work = Work()


def stages_of(
    quality: Quality,
    *,
    size: tuple[int, int],
    triangles: int = TYPICAL_TRIANGLES,
    frames: int,
    rates: Rates = PROCESSOR,
) -> Stages:
    """Forecast what the stages of a film cost.

    Args:
        quality: Samples and denoiser.
        size: Width, height [px].
        triangles: That the shot holds.
        frames: Of the film; a picture alone has no help.
        rates: Of what traces: `PROCESSOR` or `GPU`.
    """
    megapixels = size[0] * size[1] / 1e6
    start = _START + _START_PER_MEGATRIANGLE * triangles / 1e6
    pixels = megapixels * (rates.pixel + rates.sample * quality.spp)
    finish = megapixels * (rates.tone + rates.denoiser[quality.denoise])
    helped = rates.help_of(quality, size=size, frames=frames)
    # More cores beside it do not make a GPU faster.
    alone = rates is GPU
    return Stages(
        Work(_SERIAL_START * start, (1.0 - _SERIAL_START) * start),
        Work(rates.update_of(triangles), 0.0) + _work(pixels, alone=alone),
        Work(helped, 0.0) + _work(finish, alone=alone),
        Work(shared=_ENCODE * megapixels),
    )


def _work(seconds: float, *, alone: bool) -> Work:
    """Return work that is of one alone, or shared."""
    return Work(serial=seconds) if alone else Work(shared=seconds)


def memory_forecast(megapixels: float, triangles: int) -> float:
    """Return the memory that a picture needs at its peak [MB]."""
    return _MEMORY + _MEMORY_PER_MEGAPIXEL * megapixels + _MEMORY_PER_MEGATRIANGLE * triangles / 1e6


def spent() -> float:
    """Return the CPU-seconds of this program and of those that it has run, from its start on."""
    return sum(os.times()[:4])


def _rounded(value: float) -> float:
    """Return a number to three digits."""
    return float(f"{value:.3g}")


def time_in_words(seconds: float) -> str:
    """Return a length of time as people say it: 45 s, 12 min, 5 h 20 min, 13 days."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    if minutes < 90:
        return f"{minutes} min"
    if minutes < _DAYS * 24 * 60:
        # Minutes beside many hours are more than anybody knows.
        minutes = 10 * round(minutes / 10) if minutes < 600 else 60 * round(minutes / 60)
        hours, rest = divmod(minutes, 60)
        return f"{hours} h {rest} min" if rest else f"{hours} h"
    return f"{minutes / 60 / 24:,.0f} days"


def space_in_words(megabytes: float) -> str:
    """Return an amount of memory or disk."""
    return f"{megabytes / 1000:.1f} GB" if megabytes >= 1000 else f"{max(megabytes, 1):.0f} MB"
