"""Says what `render` would do, without building or rendering anything; the log is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from sumo3dviz_pt.job.settings import Job, ShotSettings
from sumo3dviz_pt.model.ratios import in_short
from sumo3dviz_pt.pipeline.films.build import FilmOrder, check_order, check_rides
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.orders import wanted_frames
from sumo3dviz_pt.pipeline.films.pace import Pace
from sumo3dviz_pt.pipeline.films.sequences import is_sequence, numbered
from sumo3dviz_pt.pipeline.production import Request, check_window, within_log
from sumo3dviz_pt.pipeline.progress.conditions import film_cost, forecast_factor
from sumo3dviz_pt.pipeline.progress.costs import (
    TYPICAL_TRIANGLES,
    Cost,
    space_in_words,
    time_in_words,
)
from sumo3dviz_pt.pipeline.progress.room import lacking
from sumo3dviz_pt.pipeline.reading import read_files
from sumo3dviz_pt.pipeline.scene_file import quality_preset


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be done for one shot.

    Attributes:
        path: The film.
        shot: Camera and times.
        pace: Frame rate and speed.
        size: Width, height [px].
        quality: The preset's name.
        wanted: Numbers of the frames that are asked for.
        stored: How many of these lie there already, whatever they show.
        film_exists: Whether the film does.
        cost: Forecast of all frames, as if none were there.
        wish: What a pilot would choose the samples by; empty if the preset does.
    """

    path: Path
    shot: ShotSettings
    pace: Pace
    size: tuple[int, int]
    quality: str
    wanted: range
    stored: int
    film_exists: bool
    cost: Cost
    wish: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        width, height = self.size
        speed = "" if self.pace.speed == 1 else f", speed {in_short(self.pace.speed)}"
        part = "" if self.wanted.start == 0 else f" from number {self.wanted.start}"
        cost = self.cost
        lines = [
            f"{self.path}",
            f"  shot    {self.shot.camera},"
            f" {self.shot.start:.12g} to {self.shot.end:.12g} s{speed}",
            f"  frames  {len(self.wanted)}{part}, {width}x{height},"
            f" {in_short(self.pace.fps)} a second, {self.quality}",
            f"  there   {self.stored} of these frames in {frames_folder(self.path)};"
            f" the film {'exists' if self.film_exists else 'does not exist'}",
            f"  cost    about {time_in_words(3600 * cost.cpu_hours)} of CPU time,"
            f" {time_in_words(cost.wall_seconds)} here, {space_in_words(cost.memory_mb)} of memory,"
            f" {space_in_words(cost.frames_mb)} of frames, {space_in_words(cost.film_mb)} of film",
        ]
        lines += [f"  note    {what}" for what in lacking(cost, self.path)]
        for name, value in self.wish.items():
            lines.append(f"  pilot   chooses other samples than the preset's: {name} {value:g}")
        return "\n".join(lines)


def plans(job: Job, request: Request, order: FilmOrder) -> list[Plan]:
    """Return what would be done, shot by shot.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Raises:
        ConfigError: If something that was asked for is wrong, as `render_film` would.
        InputError: If the simulation's files are not there.
    """
    applied = request.applied(job)
    found = []
    shots = check_order(job, request, order)
    check_rides(job, order, shots)
    for shot, path in shots:
        pace, count = order.pace(job, shot), frames_in_log(job, order, shot)
        wanted = wanted_frames(order.frames, count)
        folder = frames_folder(path)
        film = numbered(path, wanted.start) if is_sequence(path) else path
        cost = film_cost(
            quality_preset(applied.quality, spp=request.spp, together=count > 1),
            applied.output,
            triangles=TYPICAL_TRIANGLES,
            frames=len(wanted),
            factor=forecast_factor(applied),
        )
        found.append(
            Plan(
                path,
                shot,
                pace,
                applied.output.size,
                applied.quality,
                wanted,
                sum(frame_file(folder, number).exists() for number in wanted),
                film.exists(),
                cost,
                request.wish,
            )
        )
    return found


def frames_in_log(job: Job, order: FilmOrder, shot: ShotSettings) -> int:
    """Return how many frames a film has: it ends where the log does, with a note.

    Args:
        job: The scene file.
        order: Which shots, and when.
        shot: One of them.

    Raises:
        ConfigError: If it begins before the log, or all of it lies after that.
        InputError: If a file of the simulation is wrong.
    """
    times = order.pace(job, shot).times(shot)
    _, scenario = read_files(job, begin=float(times[0]), end=float(times[-1]))
    check_window(scenario, times)
    return len(within_log(scenario, times))
