"""Estimates how long the steps of long work should take, before any of it is done.

The constants are what two cores of a shared server needed for `ronda`, `crossing`, Barcelona,
Bologna and Bad Hersfeld, see docs/internals/forecasts.md; while work goes on, its own pace
corrects them.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from sumo3dviz_pt.job.settings import Job, Quality
from sumo3dviz_pt.model.news import Doing
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.orders import FilmOrder, shots_of, wanted_frames
from sumo3dviz_pt.pipeline.production import Request, scenario_files
from sumo3dviz_pt.pipeline.progress.build import WorkStep
from sumo3dviz_pt.pipeline.progress.costs import TYPICAL_TRIANGLES, cost_of
from sumo3dviz_pt.pipeline.scene_file import quality_preset

_READ, _READ_PER_MB = 0.5, 0.07
"""Reading logs [s]: always, and for each megabyte of them."""

_BUILD, _BUILD_PER_MB = 9.0, 20.0
"""Building the scene [s]: always, and for each megabyte of the network."""

_REACHED, _LATER = 1.5, 4.0
"""Of a larger network cameras reach no more than so many megabytes; and what each further shot of
a report takes, since shots near each other share what is built [s]."""

_OPEN = 2.5
"""Giving the scene to the renderer [s]."""

_FIRST = 8.0
"""What a first picture takes beyond a later one: all is moved, recorded, compiled [s]."""

_PILOT = 60.0
"""Choosing samples by measured pictures [s]."""

_ENCODE, _ENCODE_PER_MEGAPIXEL = 0.3, 0.05
"""Encoding a film [s]: always, and for each million pixels of all its frames."""

_PACKED = 8.0
"""Length of a log or network, as a multiple of its packed length."""


def film_steps(job: Job, request: Request, order: FilmOrder) -> tuple[WorkStep, ...]:
    """Return the steps of `render_film`, shot by shot.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Raises:
        ConfigError, InputError: As `render_film`.
    """
    applied = request.applied(job)
    size = applied.output.size
    found: list[WorkStep] = []
    for shot, path in shots_of(job, request, order):
        count = len(order.pace(job, shot).times(shot))
        quality = quality_preset(applied.quality, spp=request.spp, together=count > 1)
        wanted = wanted_frames(order.frames, count)
        folder = frames_folder(path)
        missing = [n for n in wanted if not (order.resume and frame_file(folder, n).exists())]
        rendering = _rendering(quality, size, frames=len(missing))
        found += [*opening_steps(job), *_pilot(request), WorkStep(Doing.RENDER, rendering)]
        megapixels = len(wanted) * size[0] * size[1] / 1e6
        found.append(WorkStep(Doing.ENCODE, _ENCODE + _ENCODE_PER_MEGAPIXEL * megapixels))
    return tuple(found)


def still_steps(job: Job, request: Request) -> tuple[WorkStep, ...]:
    """Return the steps of `render_still`.

    Raises:
        ConfigError, InputError: As `render_still`.
    """
    applied = request.applied(job)
    quality = quality_preset(applied.quality, spp=request.spp)
    rendering = _rendering(quality, applied.output.size, frames=1)
    return (*opening_steps(job), *_pilot(request), WorkStep(Doing.RENDER, rendering))


def _pilot(request: Request) -> tuple[WorkStep, ...]:
    """Return the step in which samples are chosen, if a pilot is asked for."""
    return (WorkStep(Doing.MEASURE, _PILOT),) if request.wish else ()


def building_steps(job: Job, *, shots: int = 1) -> tuple[WorkStep, ...]:
    """Return the steps until some shots of a scene are built.

    Raises:
        ConfigError, InputError: If the simulation's files are not there.
    """
    files = scenario_files(job)
    read = _READ + _READ_PER_MB * _megabytes(files.trajectories)
    build = _BUILD + _BUILD_PER_MB * min(_megabytes([files.network]), _REACHED)
    later = (WorkStep(Doing.READ, _READ), WorkStep(Doing.BUILD, _LATER))
    return (WorkStep(Doing.READ, read), WorkStep(Doing.BUILD, build), *(shots - 1) * later)


def opening_steps(job: Job) -> tuple[WorkStep, ...]:
    """Return the steps until a shot can be rendered; errors as in `building_steps`."""
    return (*building_steps(job), WorkStep(Doing.OPEN, _OPEN))


def _rendering(quality: Quality, size: tuple[int, int], *, frames: int) -> float:
    """Return the wall time of a shot's frames [s]."""
    costs = [
        cost_of(quality, size=size, triangles=TYPICAL_TRIANGLES, frames=count)
        for count in (0, frames)
    ]
    later = costs[1].wall_seconds - costs[0].wall_seconds
    return later + (_FIRST if frames else 0.0)


def _megabytes(paths: Iterable[Path]) -> float:
    """Return how long files are when they are unpacked, about."""
    lengths = [
        path.stat().st_size * (_PACKED if path.suffix == ".gz" else 1.0)
        for path in paths
        if path.is_file()
    ]
    return sum(lengths) / 1e6
