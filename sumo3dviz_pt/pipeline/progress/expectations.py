"""Estimates how long the steps of long work should take, before any of it is done.

The constants are what two cores of a shared server needed for `ronda`, `crossing`, Barcelona,
Bologna and Bad Hersfeld, see docs/internals/forecasts.md; those of `check` follow from what a bench
measured (`tests/bench/checks.py`). While work goes on, its own pace corrects them.
"""

from __future__ import annotations

import json
import os
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

REACHED = 1.5
"""Of a larger network cameras reach no more than so many megabytes."""

CHECKS = Path(__file__).with_name("checks.json")
"""What `check` takes [CPU-s]: always, and for each megabyte of the network; a bench writes it."""

_LATER = 0.25
"""Share of that which all shots but the first take: those near each other share a place."""

_OPEN = 2.5
"""Giving the scene to the renderer [s]."""

_FIRST = 8.0
"""What a first picture takes beyond a later one: all is moved, recorded, compiled [s]."""

_PILOT = 60.0
"""Choosing samples by measured pictures [s]."""

_ENCODE, _ENCODE_PER_MEGAPIXEL = 0.3, 0.05
"""Encoding a film [s]: always, and for each million pixels of all its frames."""

_LEAST_PACKED = 18
"""A file of gzip has at least a head and a tail of so many bytes."""


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


def reading_step(job: Job) -> WorkStep:
    """Return the step in which a simulation is read; errors as in `building_steps`."""
    logs = scenario_files(job).trajectories
    return WorkStep(Doing.READ, _READ + _READ_PER_MB * _megabytes(logs))


def building_steps(job: Job) -> tuple[WorkStep, ...]:
    """Return the steps until a shot of a scene is built.

    Raises:
        ConfigError, InputError: If the simulation's files are not there.
    """
    build = _BUILD + _BUILD_PER_MB * min(network_megabytes(job), REACHED)
    return (reading_step(job), WorkStep(Doing.BUILD, build))


def checking_steps(job: Job) -> tuple[WorkStep, ...]:
    """Return the steps of `check_scene`; errors as in `building_steps`."""
    constants = json.loads(CHECKS.read_text(encoding="utf-8"))
    reached = min(network_megabytes(job), REACHED)
    whole = constants["always"] + constants["per_megabyte"] * reached
    # What is read and built first, then a step or two for each further shot.
    shots = len(job.shots or job.cameras)
    later = _LATER * whole / max(shots - 1, 1) if shots > 1 else 0.0
    first = whole - later * (shots - 1)
    read = min(reading_step(job).seconds, 0.5 * first)
    again = (WorkStep(Doing.READ, 0.0), WorkStep(Doing.BUILD, later))
    return (WorkStep(Doing.READ, read), WorkStep(Doing.BUILD, first - read), *(shots - 1) * again)


def network_megabytes(job: Job) -> float:
    """Return how long a scene's network is as text; errors as in `building_steps`."""
    return _megabytes([scenario_files(job).network])


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
    """Return how long files are when they are unpacked."""
    return sum(_length(path) for path in paths if path.is_file()) / 1e6


def _length(path: Path) -> int:
    """Return how many bytes a file has when it is unpacked.

    The last four bytes of gzip say it of its last member, up to 4 GB; it is no shorter than it is
    packed.
    """
    packed = path.stat().st_size
    if path.suffix != ".gz" or packed < _LEAST_PACKED:
        return packed
    with path.open("rb") as stream:
        stream.seek(-4, os.SEEK_END)
        return max(int.from_bytes(stream.read(4), "little"), packed)
