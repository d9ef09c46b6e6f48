"""Forecasts what a study will cost, before anything starts: films, layers, measurements.

The constants are from `crossing` at 640x360 on a shared server, see docs/internals/forecasts.md;
machines differ by a factor of two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from sumo3dviz_pt.pipeline.films.pace import Pace
from sumo3dviz_pt.pipeline.progress.conditions import film_cost, forecast_factor
from sumo3dviz_pt.pipeline.progress.costs import (
    TYPICAL_TRIANGLES,
    Cost,
    layers_cost,
    space_in_words,
    time_in_words,
)
from sumo3dviz_pt.pipeline.reading import scenario_files, stamps_of
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.pipeline.studies.plan import StudyPlan
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus

_COMPARE, _COMPARE_PER_MEGAPIXEL = 0.08, 1.6
"""Comparing a frame of two films: always, and for each million pixels [CPU-s]."""

_DECODE, _DECODE_PER_MEGAPIXEL = 0.02, 0.02
"""Holding a film against its frames: once, and for each million pixels of each picture [CPU-s]."""

_REPORT, _REPORT_PER_FRAME, _REPORT_PER_MEGAPIXEL = 0.3, 0.01, 0.18
"""Measuring a film: once, for each frame, and for each million pixels of each frame [CPU-s]."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a study will cost.

    Attributes:
        films: How many are to be rendered.
        frames: Of all of them.
        cpu_hours: Of rendering them, with their layers.
        wall_seconds: The same on this machine, if nothing else runs.
        memory_mb: At the peak of the largest.
        frames_mb: Of stored frames on disk.
        film_mb: Of the films.
        layers_mb: Of layers on disk.
        measuring: Of which something is made when all films are there, in words.
        measuring_seconds: What that takes, one thread's work [s].
    """

    films: int
    frames: int
    cpu_hours: float
    wall_seconds: float
    memory_mb: float
    frames_mb: float
    film_mb: float
    layers_mb: float = 0.0
    measuring: tuple[str, ...] = ()
    measuring_seconds: float = 0.0

    def __str__(self) -> str:
        then = [f"then {time_in_words(self.measuring_seconds)} for {' and '.join(self.measuring)}"]
        then = then if self.measuring else []
        if not self.films:
            return ", ".join(["nothing to render", *then])
        layers = [f"{space_in_words(self.layers_mb)} of layers"] if self.layers_mb else []
        parts = [
            f"about {time_in_words(3600 * self.cpu_hours)} of CPU time",
            f"{time_in_words(self.wall_seconds)} here",
            f"{space_in_words(self.memory_mb)} of memory",
            f"{space_in_words(self.frames_mb)} of frames",
            *layers,
            f"{space_in_words(self.film_mb)} of films",
            *then,
        ]
        return f"{self.frames} frames of {self.films} films: {', '.join(parts)}"


def frames_of(stimulus: Stimulus) -> int:
    """Return how many frames a film has, which ends where the log does."""
    times = Pace.of(stimulus.job, stimulus.shot).times(stimulus.shot)
    logs = scenario_files(stimulus.job).trajectories
    return int(np.sum(times <= _end_of(stamps_of(logs)) + 1e-6))


@lru_cache(maxsize=64)
def _end_of(logs: tuple[tuple[str, int, int], ...]) -> float:
    """Return the last time of a simulation's logs [s], which are named with their versions."""
    from sumo3dviz_pt.sumo import whereabouts

    return whereabouts([Path(name) for name, *_ in logs], "").end


def cost_of_film(stimulus: Stimulus) -> Cost:
    """Forecast what one film costs with its layers, as if none of its frames were there."""
    frames, output = frames_of(stimulus), stimulus.job.output
    cost = film_cost(
        quality_preset(stimulus.job.quality, together=frames > 1),
        output,
        triangles=TYPICAL_TRIANGLES,
        frames=frames,
        factor=forecast_factor(stimulus.job),
    )
    # Layers are found and written by one thread.
    seconds = layers_cost(output.layers, size=output.size).cpu_seconds
    return replace(
        cost,
        cpu_seconds_per_frame=cost.cpu_seconds_per_frame + seconds,
        cpu_hours=cost.cpu_hours + frames * seconds / 3600,
        wall_seconds=cost.wall_seconds + frames * seconds,
    )


def layers_of_film(stimulus: Stimulus) -> float:
    """Forecast the space that a film's layers take [MB]."""
    output = stimulus.job.output
    return frames_of(stimulus) * layers_cost(output.layers, size=output.size).megabytes


def forecast(plan: StudyPlan, todo: Sequence[Stimulus]) -> Forecast:
    """Forecast what a study costs whose films are rendered one after the other.

    Args:
        plan: The study's; its certificate and its report are of all films.
        todo: The films that are to be rendered.
    """
    costs = [cost_of_film(stimulus) for stimulus in todo]
    settings = plan.file.settings
    measured = {
        "the certificate": _certificate_seconds(plan) if settings.certificate.write else 0.0,
        "the report": _report_seconds(plan) if settings.report.write else 0.0,
    }
    return Forecast(
        films=len(costs),
        frames=sum(map(frames_of, todo)),
        cpu_hours=sum(cost.cpu_hours for cost in costs),
        wall_seconds=sum(cost.wall_seconds for cost in costs),
        memory_mb=max((cost.memory_mb for cost in costs), default=0.0),
        frames_mb=sum(cost.frames_mb for cost in costs),
        film_mb=sum(cost.film_mb for cost in costs),
        layers_mb=sum(map(layers_of_film, todo)),
        measuring=tuple(what for what, seconds in measured.items() if seconds),
        measuring_seconds=sum(measured.values()),
    )


def _certificate_seconds(plan: StudyPlan) -> float:
    """Return what comparing all pairs takes [CPU-s]."""
    films = {stimulus.name: stimulus for stimulus in plan.stimuli}
    most = plan.file.settings.certificate.frames
    compared = sum(
        min(most, frames_of(films[pair.one]))
        * (_COMPARE + _COMPARE_PER_MEGAPIXEL * _megapixels(films[pair.one]))
        for pair in plan.pairs
    )
    return compared + sum(
        _DECODE + _DECODE_PER_MEGAPIXEL * frames_of(film) * _megapixels(film)
        for film in plan.stimuli
    )


def _report_seconds(plan: StudyPlan) -> float:
    """Return what measuring all films takes [CPU-s]."""
    return sum(
        _REPORT + frames_of(film) * (_REPORT_PER_FRAME + _REPORT_PER_MEGAPIXEL * _megapixels(film))
        for film in plan.stimuli
    )


def _megapixels(stimulus: Stimulus) -> float:
    """Return how many million pixels a frame has."""
    width, height = stimulus.job.output.size
    return width * height / 1e6
