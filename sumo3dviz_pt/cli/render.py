"""`render`: renders films."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import (
    Parser,
    add_overwrite,
    add_request,
    add_window,
    frame_range,
    overrides_of,
    request_of,
)
from sumo3dviz_pt.cli.progress import complain, cpu_in_words, progress
from sumo3dviz_pt.errors import ConfigError, InputError, Sumo3dvizError
from sumo3dviz_pt.job.meanings import meaning
from sumo3dviz_pt.pipeline.progress.costs import spent

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job
    from sumo3dviz_pt.pipeline.films.build import FilmOrder, FilmReport
    from sumo3dviz_pt.pipeline.production import Request


FILM_HELP = (
    "film.mp4 (or .mov, .mkv, .webm, .gif) or film_{frame}.png; {scene} and {shot} are filled in"
)


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("render", help="render films; several scenes make a batch")
    sub.add_argument("scene", type=Path, nargs="+")
    sub.add_argument(
        "--resume", action="store_true", help="keep frames that match, render the others anew"
    )
    sub.add_argument("--frames", type=frame_range, help="A:B renders only these frames, no film")
    add_film(sub)
    sub.set_defaults(run=run)


def add_film(sub: Parser, *, output: str = FILM_HELP, required: bool = True) -> None:
    """Say what films are made of; `farm` takes the same.

    Args:
        sub: The command.
        output: What is said of `-o`.
        required: Whether `-o` has to be given.
    """
    add_window(sub, first=meaning("shots.start"), last=meaning("shots.end"))
    sub.add_setting("--fps", "output.fps")
    sub.add_setting("--speed", "shots.speed")
    sub.add_argument("--shot", type=int, metavar="N", help="only this shot of the scene, from 1")
    add_overwrite(sub, "replace the film and all of its frames")
    sub.add_argument(
        "--dry-run", action="store_true", help="only say what would be rendered, and its cost"
    )
    sub.add_argument(
        "--discard-frames", action="store_true", help="keep frames only while others need them"
    )
    sub.add_argument(
        "--final-exr",
        action="store_true",
        help="also write the finished frames' radiance, to film.final/",
    )
    sub.add_argument("-o", "--output", type=Path, required=required, help=output)
    add_request(sub)


def run(options: argparse.Namespace) -> int:
    """Render films; in a batch one failure does not stop the rest."""
    from sumo3dviz_pt.pipeline.films.stopping import stoppable
    from sumo3dviz_pt.pipeline.production import ready_renderer

    if len(options.scene) > 1 and "{scene}" not in options.output.name:
        raise ConfigError("several scenes need {scene} in the name of the output", key="output")
    if len({scene.stem for scene in options.scene}) < len(options.scene):
        raise ConfigError(
            "two scene files have one name, and so would their films; render them one by one",
            key="output",
        )
    request = request_of(options)
    worst, sound = 0, []
    for scene in options.scene:
        try:
            sound.append((scene, *_checked(options, scene, request)))
        except Sumo3dvizError as error:
            worst = max(worst, _told(options, scene, error))
    if sound and not options.dry_run:
        ready_renderer(options.variant)
    began = 0.0
    for scene, job, order in sound:
        try:
            with stoppable():
                _work(options, job, request, order, began)
        except Sumo3dvizError as error:
            worst = max(worst, _told(options, scene, error))
        began = spent()
    return worst


def _work(
    options: argparse.Namespace, job: Job, request: Request, order: FilmOrder, began: float
) -> None:
    """Render a scene's films, or say what would be done."""
    if options.dry_run:
        _print_plans(job, request, order)
        return
    films = render_films(job, request, order)
    print_films(films, cpu=spent() - began)


def _checked(options: argparse.Namespace, scene: Path, request: Request) -> tuple[Job, FilmOrder]:
    """Return a scene and what is to be made of it; refuse what is wrong before any work."""
    from sumo3dviz_pt.pipeline.films.build import check_order, check_places
    from sumo3dviz_pt.pipeline.production import check_choices
    from sumo3dviz_pt.pipeline.progress.room import check_memory
    from sumo3dviz_pt.pipeline.scene_file import load_job

    order = order_of(options, scene)
    job = load_job(scene, overrides_of(options))
    check_choices(job, request)
    check_memory(job, request)
    shots = check_order(job, request, order)
    if not options.dry_run:
        check_places(job, order, shots)
    return job, order


def order_of(options: argparse.Namespace, scene: Path) -> FilmOrder:
    """Return what is to be made of a scene file."""
    from sumo3dviz_pt.pipeline.films.build import FilmOrder

    order = FilmOrder(
        options.output,
        options.start,
        options.end,
        options.fps,
        options.frames,
        options.resume,
        options.discard_frames,
        options.speed,
        options.overwrite,
        options.final_exr,
        options.shot,
    )
    name = options.output.name.replace("{scene}", scene.stem)
    return replace(order, path=options.output.with_name(name))


def _told(options: argparse.Namespace, scene: Path, error: Sumo3dvizError) -> int:
    """Tell what is wrong with one scene of a batch; return the exit code."""
    if len(options.scene) == 1:
        raise error
    return complain(f"{scene}: {error}", 2 if isinstance(error, InputError | ConfigError) else 1)


def render_films(job: Job, request: Request, order: FilmOrder) -> list[FilmReport]:
    """Render films and show how far they are.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.
    """
    from sumo3dviz_pt.pipeline.films.build import render_film
    from sumo3dviz_pt.pipeline.films.orders import shots_of
    from sumo3dviz_pt.pipeline.progress.expectations import film_steps

    films = [path.name for _, path in shots_of(job, request, order)]
    name = films[0] if len(films) == 1 else order.path.name
    with progress(name, film_steps(job, request, order)):
        return render_film(job, request, order)


def _print_plans(job: Job, request: Request, order: FilmOrder) -> None:
    """Say what would be done."""
    from sumo3dviz_pt.pipeline.films.dry_run import plans

    print("\n\n".join(map(str, plans(job, request, order))))


def print_films(reports: list[FilmReport], *, cpu: float) -> None:
    """Say what came out.

    Args:
        reports: Of each film.
        cpu: CPU-seconds of all that was done for them; what no report counts, such as the start
            of the program, is added to the first one's.
    """
    own = [sum(report.cpu.values()) for report in reports]
    own[0] += max(cpu - sum(own), 0.0)
    for report, seconds in zip(reports, own, strict=True):
        place = report.film or report.folder
        print(f"wrote {place}: {report.frames} frames ({cpu_in_words(seconds)})")
