"""Forecasts what the films of a study will cost, before anything starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sumo3dviz_pt.pipeline.films.pace import Pace
from sumo3dviz_pt.pipeline.progress.costs import (
    TYPICAL_TRIANGLES,
    Cost,
    cost_of,
    space_in_words,
    time_in_words,
)
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus


@dataclass(frozen=True, slots=True)
class Forecast:
    """What films will cost together.

    Attributes:
        films: How many are to be rendered.
        frames: Of all of them.
        cpu_hours: Of all of them.
        wall_seconds: On this machine, if nothing else runs.
        memory_mb: At the peak of the largest.
        frames_mb: Of stored frames on disk.
        film_mb: Of the films.
    """

    films: int
    frames: int
    cpu_hours: float
    wall_seconds: float
    memory_mb: float
    frames_mb: float
    film_mb: float

    def __str__(self) -> str:
        if not self.films:
            return "nothing to render"
        return (
            f"{self.frames} frames of {self.films} films: about {self.cpu_hours:.2g} CPU-hours,"
            f" {time_in_words(self.wall_seconds)} here, {space_in_words(self.memory_mb)} of memory,"
            f" {space_in_words(self.frames_mb)} of frames, {space_in_words(self.film_mb)} of films"
        )


def frames_of(stimulus: Stimulus) -> int:
    """Return how many frames a film has."""
    return len(Pace.of(stimulus.job, stimulus.shot).times(stimulus.shot))


def cost_of_film(stimulus: Stimulus) -> Cost:
    """Forecast what one film costs, as if none of its frames were there."""
    frames = frames_of(stimulus)
    return cost_of(
        quality_preset(stimulus.job.quality, together=frames > 1),
        size=stimulus.job.output.size,
        triangles=TYPICAL_TRIANGLES,
        frames=frames,
        half=stimulus.job.output.half,
    )


def forecast(stimuli: Sequence[Stimulus]) -> Forecast:
    """Forecast what films cost that are rendered one after the other."""
    costs = [cost_of_film(stimulus) for stimulus in stimuli]
    return Forecast(
        films=len(costs),
        frames=sum(map(frames_of, stimuli)),
        cpu_hours=sum(cost.cpu_hours for cost in costs),
        wall_seconds=sum(cost.wall_seconds for cost in costs),
        memory_mb=max((cost.memory_mb for cost in costs), default=0.0),
        frames_mb=sum(cost.frames_mb for cost in costs),
        film_mb=sum(cost.film_mb for cost in costs),
    )
