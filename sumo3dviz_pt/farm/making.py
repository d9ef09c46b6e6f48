"""Plans a farm: cuts films into tasks of about the same length by the forecast of their cost."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.farm.plan import (
    IN_STUDY,
    EngineChoice,
    FarmFilm,
    FarmPlan,
    FarmTask,
    chunks,
    farm_folder,
    place_from,
)
from sumo3dviz_pt.installation.dependencies import threads
from sumo3dviz_pt.job.errors import settle
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.values import Positive, Whole
from sumo3dviz_pt.pipeline.conditions import film_stages
from sumo3dviz_pt.pipeline.costs import Stages, rates_of
from sumo3dviz_pt.pipeline.films.film import check_order, check_places, frames_in_log
from sumo3dviz_pt.pipeline.films.frames import frame_file, frame_numbers
from sumo3dviz_pt.pipeline.films.orders import FilmOrder
from sumo3dviz_pt.pipeline.production import Request, check_choices
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.studies.plan import StudyPlan, forecast, frames_of
from sumo3dviz_pt.studies.records import film_path
from sumo3dviz_pt.studies.run import StudyOrder, check_study

_USUAL, _SHORTEST = 1200.0, 120.0
"""Length of a task, and the least that it is cut to so that all workers have one [s]."""


@dataclass(frozen=True, slots=True)
class FarmOrder:
    """What `farm` is to do.

    Attributes:
        engine: What runs it.
        minutes: How long a task should take, by the forecast [min]; None is 20, or less where that
            would leave workers without any.
        frames: Frames of a task instead; None goes by the forecast.
        tries: How often a frame may fail until it is set aside.
        lease: After this time without a sign of life a worker counts as dead [s].
    """

    engine: EngineChoice
    minutes: Annotated[Positive, Field(le=24 * 60)] | None = None
    frames: Annotated[Whole, Field(ge=1)] | None = None
    tries: Annotated[Whole, Field(ge=1, le=100)] = 3
    lease: Annotated[Positive, Field(ge=2, le=86_400)] = 180.0

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)

    def longest(self, stages: Stages, *, frames: int) -> int:
        """Return how many frames a task may have at most.

        Args:
            stages: What the film costs.
            frames: Of all films.
        """
        if self.frames is not None:
            return self.frames
        cores = self.engine.threads or threads()
        frame = stages.trace.wall(cores)
        share = frames * frame / (self.engine.workers or 1)
        usual = min(_USUAL, max(_SHORTEST, share))
        seconds = usual if self.minutes is None else 60 * self.minutes
        return max(1, int((seconds - stages.start.wall(cores)) / frame))


@dataclass(frozen=True, slots=True)
class _Film:
    """A film to be cut.

    Attributes:
        path: Where it goes.
        frames: How many it has.
        stages: What it costs.
        words: Of the command that makes it, without output.
    """

    path: Path
    frames: int
    stages: Stages
    words: tuple[str, ...]


def plan_films(
    job: Job, request: Request, order: FilmOrder, *, words: Sequence[str], farm: FarmOrder
) -> FarmPlan:
    """Plan the films of a scene.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.
        words: Of the command `render` that would make them here, without what only says how.
        farm: What runs it.

    Raises:
        ConfigError: If something that was asked for is wrong, or anything would be overwritten.
        InputError: If the simulation's files are wrong.
    """
    if request.wish:
        raise ConfigError(
            "on every machine a pilot would choose other samples; ask for them by --spp, such as"
            " those that `still --time-budget` or `still --target-error` names",
            key=next(iter(request.wish)),
        )
    check_choices(job, request)
    shots = check_order(job, request, order)
    check_places(job, order, shots)
    applied, rates = request.applied(job), rates_of(request.variant)
    films = []
    for shot, path in shots:
        count = frames_in_log(job, order, shot)
        quality = quality_preset(applied.quality, spp=request.spp, together=count > 1)
        stages = film_stages(applied, quality, frames=count, rates=rates)
        which = ("--shot", str(_number(job, shot))) if len(shots) > 1 else ()
        films.append(_Film(path, count, stages, (*words, *which)))
    folder = farm_folder(order.path)
    more = [
        *_flag("--discard-frames", order.discard_frames),
        *_flag("--final-exr", order.final_exr),
    ]
    output = ("-o", str(order.path))
    tasks = _tasks(films, farm, output=output, more=more)
    return _plan(folder, tasks, films, farm)


def _number(job: Job, shot: object) -> int:
    """Return a shot's number in the scene file, from 1."""
    return next(n for n, other in enumerate(job.shots, start=1) if other is shot)


def plan_study_films(
    plan: StudyPlan, order: StudyOrder, *, words: Sequence[str], farm: FarmOrder
) -> FarmPlan:
    """Plan the films of a study, and what goes with them.

    Args:
        plan: The study's.
        order: Where it goes.
        words: Of the command `study` that would make it here, without what only says how.
        farm: What runs it.

    Raises:
        ConfigError: If something that was asked for is wrong, or films would be overwritten.
    """
    check_study(plan, order)
    films = []
    for stimulus in plan.stimuli:
        job, count = stimulus.job, frames_of(stimulus)
        quality = quality_preset(job.quality, together=count > 1)
        stages = film_stages(job, quality, frames=count, rates=rates_of(order.variant))
        path = film_path(order.folder, plan, stimulus)
        films.append(_Film(path, count, stages, (*words, "--film", stimulus.name)))
    output = ("-o", str(order.folder))
    tasks = _tasks(films, farm, output=output, more=())
    more = _flag("--discard-frames", order.discard_frames)
    made = tuple(n for n, task in enumerate(tasks) if task.frames is None)
    line = (*words, "--resume", *more, *output)
    tasks.append(FarmTask(line, None, None, made, round(forecast(plan, ()).measuring_seconds, 1)))
    return _plan(order.folder / IN_STUDY, tasks, films, farm)


def _tasks(
    films: Sequence[_Film],
    farm: FarmOrder,
    *,
    output: tuple[str, ...],
    more: Sequence[str],
) -> list[FarmTask]:
    """Return the tasks that render frames, film by film, and then those that make the films."""
    tasks: list[FarmTask] = []
    needs: list[list[int]] = []
    frames = sum(film.frames for film in films)
    for number, film in enumerate(films):
        needs.append([])
        longest = farm.longest(film.stages, frames=frames)
        for first, after in chunks(film.frames, longest=longest):
            words = (*film.words, "--frames", f"{first}:{after}", "--resume", *output)
            cost = film.stages.start + (after - first) * film.stages.trace
            needs[-1].append(len(tasks))
            tasks.append(FarmTask(words, number, (first, after), (), round(cost.cpu, 1)))
    for number, film in enumerate(films):
        cost = film.stages.start + film.frames * (film.stages.develop + film.stages.encode)
        words = (*film.words, "--resume", *more, *output)
        tasks.append(FarmTask(words, number, None, tuple(needs[number]), round(cost.cpu, 1)))
    return tasks


def _plan(
    folder: Path, tasks: Iterable[FarmTask], films: Sequence[_Film], farm: FarmOrder
) -> FarmPlan:
    """Return a plan of tasks."""
    return FarmPlan(
        folder,
        tuple(tasks),
        tuple(FarmFilm(str(film.path), film.frames) for film in films),
        farm.engine,
        place_from(folder),
        farm.tries,
        farm.lease,
    )


def _flag(name: str, on: bool) -> tuple[str, ...]:
    """Return an option that has no value."""
    return (name,) if on else ()


def clear(plan: FarmPlan) -> None:
    """Remove the frames and films that a plan makes anew, and what an older farm left."""
    for film in plan.films:
        folder = plan.place / film.folder
        for number in frame_numbers(folder):
            frame_file(folder, number).unlink(missing_ok=True)
        (plan.place / film.path).unlink(missing_ok=True)
    for name in ("tries", "logs", "slurm", "workers"):
        shutil.rmtree(plan.folder / name, ignore_errors=True)
