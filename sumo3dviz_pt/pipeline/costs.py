"""Forecasts what a film will cost: CPU time, wall time, memory and disk.

The constants are from `ronda` and `crossing` at 640x360 and 1280x720 on a shared server, see
docs/internals/forecasts.md; machines differ by a factor of two.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from sumo3dviz_pt.installation.dependencies import threads
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.numbers import LAYER_KINDS, LayerName

_START = 16.0
"""Reading, building, loading and compiling [CPU-s]; 10 less where a kept place is found."""

_START_PER_MEGATRIANGLE = 3.5
"""The same, for each million triangles [CPU-s]."""

_UPDATE = 0.42
"""Moving all road users, for each million triangles of the shot: one thread's work [CPU-s]."""

_PER_MEGASAMPLE, _PER_MEGAPIXEL = 1.05, 1.1
"""Rendering, for each million samples and for each million pixels [CPU-s]."""

_DENOISER = {"none": 0.0, "fast": 1.75, "balanced": 2.8, "high": 2.8}
"""Denoising and tone, for each million pixels [CPU-s]."""

_NEIGHBOUR = 0.075
"""Averaging with a frame before or after, for each million pixels: one thread's work [CPU-s]."""

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
        frames_mb: Of stored frames on disk.
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
    half: bool = True,
    cores: int | None = None,
) -> Cost:
    """Forecast what a shot costs.

    Args:
        quality: Samples and denoiser.
        size: Width, height [px].
        triangles: That the shot holds.
        frames: How many.
        half: Whether frames are stored in half precision.
        cores: That work; None is all of this machine's.
    """
    cores = cores or threads()
    megapixels = size[0] * size[1] / 1e6
    together = quality.accumulate if frames > 1 else 0
    stages = stages_of(quality, size=size, triangles=triangles, frames=frames)
    frame = stages.trace + stages.develop
    whole = stages.start + frames * (frame + stages.encode)
    return Cost(
        cpu_seconds_per_frame=frame.cpu,
        cpu_hours=whole.cpu / 3600,
        wall_seconds=whole.wall(cores),
        memory_mb=memory_forecast(megapixels, triangles),
        frames_mb=frames * megapixels * (_EXR_TRACED if together else _EXR) * (2 - half),
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
    quality: Quality, *, size: tuple[int, int], triangles: int = TYPICAL_TRIANGLES, frames: int
) -> Stages:
    """Forecast what the stages of a film cost.

    Args:
        quality: Samples and denoiser.
        size: Width, height [px].
        triangles: That the shot holds.
        frames: Of the film; a picture alone has no help.
    """
    megapixels, megatriangles = size[0] * size[1] / 1e6, triangles / 1e6
    start = _START + _START_PER_MEGATRIANGLE * megatriangles
    pixels = megapixels * (_PER_MEGAPIXEL + _PER_MEGASAMPLE * quality.spp)
    denoiser = megapixels * _DENOISER[quality.denoise]
    return Stages(
        Work(_SERIAL_START * start, (1.0 - _SERIAL_START) * start),
        Work(update_cost(triangles), pixels),
        Work(help_cost(quality, size=size, frames=frames), denoiser),
        Work(shared=_ENCODE * megapixels),
    )


def update_cost(triangles: int) -> float:
    """Return what triangles cost whenever everything is moved to its place [CPU-s]."""
    return _UPDATE * triangles / 1e6


def help_cost(quality: Quality, *, size: tuple[int, int], frames: int) -> float:
    """Return what averaging with frames before and after costs each frame [CPU-s].

    Args:
        quality: How many frames help.
        size: Width, height [px].
        frames: Of the film; a picture alone has no help.
    """
    neighbours = 2 * min(quality.accumulate, frames - 1) if frames > 1 else 0
    return neighbours * _NEIGHBOUR * size[0] * size[1] / 1e6


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
