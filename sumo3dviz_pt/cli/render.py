"""`render`, `still`, `demo`, `develop`: the commands that make pictures and films.

`render` makes films, `still` one image. `demo` renders the bundled example, with nothing to
prepare. `develop` makes pictures and films from stored frames.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import (
    Parser,
    add_overwrite,
    add_request,
    add_size,
    add_variant,
    add_window,
    command_in,
    complain,
    cpu_in_words,
    frame_range,
    overrides_of,
    progress,
    request_of,
    sumo_time,
)
from sumo3dviz_pt.errors import ConfigError, InputError, Sumo3dvizError
from sumo3dviz_pt.job.settings import default, meaning
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.pipeline.costs import spent

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job
    from sumo3dviz_pt.pipeline.films.film import FilmOrder, FilmReport
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
        "--mix-devices",
        action="store_true",
        help="keep frames that another kind of processor or GPU traced; their pixels differ a bit",
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
    from sumo3dviz_pt.pipeline.films.rendering import stoppable
    from sumo3dviz_pt.pipeline.production import ready_renderer

    if len(options.scene) > 1 and "{scene}" not in options.output.name:
        raise ConfigError("several scenes need {scene} in the name of the output", key="output")
    if len({scene.stem.casefold() for scene in options.scene}) < len(options.scene):
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
            worst = max(worst, _reported(options, scene, error))
    if sound and not options.dry_run:
        ready_renderer(options.variant)
    began = 0.0
    for scene, job, order in sound:
        try:
            with stoppable():
                _work(options, job, request, order, began)
        except Sumo3dvizError as error:
            worst = max(worst, _reported(options, scene, error))
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
    from sumo3dviz_pt.pipeline.conditions import check_memory
    from sumo3dviz_pt.pipeline.films.film import check_order, check_places
    from sumo3dviz_pt.pipeline.production import check_choices
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
    from sumo3dviz_pt.pipeline.films.film import FilmOrder

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
        options.mix_devices,
    )
    name = options.output.name.replace("{scene}", scene.stem)
    return replace(order, path=options.output.with_name(name))


def _reported(options: argparse.Namespace, scene: Path, error: Sumo3dvizError) -> int:
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
    from sumo3dviz_pt.pipeline.films.film import render_film
    from sumo3dviz_pt.pipeline.films.orders import shots_of
    from sumo3dviz_pt.pipeline.steps import film_steps

    films = [path.name for _, path in shots_of(job, request, order)]
    name = films[0] if len(films) == 1 else order.path.name
    with progress(name, film_steps(job, request, order)):
        return render_film(job, request, order)


def _print_plans(job: Job, request: Request, order: FilmOrder) -> None:
    """Say what would be done."""
    from sumo3dviz_pt.pipeline.films.film import plans

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
        print(f"wrote {place}: {counted(report.frames, 'frame')} ({cpu_in_words(seconds)})")


def add_still(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("still", help="render one image")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--time", type=sumo_time, required=True, help="SUMO's time [s]")
    sub.add_argument("-o", "--output", type=Path, required=True, help="out.png or out.exr")
    add_overwrite(sub)
    add_request(sub)
    sub.set_defaults(run=run_still)


def run_still(options: argparse.Namespace) -> int:
    """Render one image."""
    from sumo3dviz_pt.pipeline.conditions import check_memory
    from sumo3dviz_pt.pipeline.live import render_still
    from sumo3dviz_pt.pipeline.production import check_target, get_ready
    from sumo3dviz_pt.pipeline.reading import spare_inputs
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import still_steps

    check_target(options.output, suffixes=(".png", ".exr"), overwrite=options.overwrite)
    job, request = load_job(options.scene, overrides_of(options)), request_of(options)
    spare_inputs(job, options.output)
    check_memory(job, request)
    get_ready(job, request)
    with progress(options.output.name, still_steps(job, request)):
        still = render_still(job, request, options.time)
    still.save(options.output)
    print(f"wrote {options.output} ({cpu_in_words(spent())})")
    return 0


@dataclass(frozen=True, slots=True)
class _Extent:
    """How much the demo renders without other options.

    Attributes:
        size: Width, height [px].
        seconds: Of the film.
        quality: A preset's name.
    """

    size: tuple[int, int]
    seconds: float
    quality: str


_COMPILED = _Extent((640, 360), 2.0, "preview")
_SCALAR = _Extent((480, 270), 1.0, "draft")
"""The extent where there is no libLLVM: it takes four minutes on two cores."""


def add_demo(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("demo", help="render the bundled example: demo.mp4 and demo.png")
    sub.add_argument("-o", "--output", type=Path, default=Path(), help="folder [.]")
    sub.add_setting("--quality", "quality", after=f" [{_COMPILED.quality}]")
    add_variant(sub)
    add_size(sub, after=" [{}x{}]".format(*_COMPILED.size))
    add_overwrite(sub)
    sub.set_defaults(run=run_demo)


def run_demo(options: argparse.Namespace) -> int:
    """Render the bundled example, less of it where rendering is slow."""
    from sumo3dviz_pt.pipeline.films.film import FilmOrder
    from sumo3dviz_pt.pipeline.live import render_still
    from sumo3dviz_pt.pipeline.production import Request, example, ready_renderer
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.steps import still_steps
    from sumo3dviz_pt.pipeline.still import check_free, check_target

    folder = options.output
    check_target(folder / "demo.png", suffixes=(".png",), overwrite=options.overwrite)
    if not options.overwrite:
        check_free(folder / "demo.mp4", folder / "demo.json")
    job = load_job(example("ronda"))
    extent = _extent(options, compiled=ready_renderer(options.variant).jit)
    request = Request(
        quality=extent.quality,
        size=extent.size,
        variant=options.variant,
        command=command_in(options.words),
    )
    shot = job.shots[0]
    order = FilmOrder(
        folder / "demo.mp4",
        start=shot.start,
        end=min(shot.end, shot.start + extent.seconds),
        resume=True,
        discard_frames=True,
    )
    films = render_films(job, replace(request, camera=shot.camera), order)
    print_films(films, cpu=spent())
    picture = replace(request, camera="overview")
    filmed = spent()
    with progress("demo.png", still_steps(job, picture)):
        still = render_still(job, picture, shot.start)
    still.save(folder / "demo.png")
    print(f"wrote {folder / 'demo.png'} ({cpu_in_words(spent() - filmed)})")
    return 0


def _extent(options: argparse.Namespace, *, compiled: bool) -> _Extent:
    """Return how much to render; a slow machine is told what it leaves out."""
    usual = _COMPILED if compiled else _SCALAR
    chosen = replace(
        usual, size=options.size or usual.size, quality=options.quality or usual.quality
    )
    if not compiled:
        print(
            "without compiled kernels the demo is smaller and shorter:"
            f" {_in_words(chosen)} instead of {_in_words(_COMPILED)}",
            flush=True,
        )
    return chosen


def _in_words(extent: _Extent) -> str:
    """Such as `2 s at 640x360, preview`."""
    width, height = extent.size
    return f"{extent.seconds:g} s at {width}x{height}, {extent.quality}"


def add_develop(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("develop", help="pictures from EXR frames, without rendering again")
    sub.add_argument("frames", type=Path, help="folder of frames, or one .exr")
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        help="film.mp4 (or .mov, .mkv, .webm, .gif), out.png, or name_{frame}.png",
    )
    sub.add_argument(
        "--exposure", type=float, help="EV, the sky's own included, instead of the stored one"
    )
    sub.add_setting("--tone", "output.tone", after=" [the stored one]")
    sub.add_setting("--response", "output.response", after=" [the stored one]")
    sub.add_setting("--fps", "output.fps", after=" [the film's own]")
    codec = default("output.codec")
    sub.add_setting("--codec", "output.codec", default=codec, after=f" [{codec}]")
    sub.add_argument(
        "--final-exr",
        action="store_true",
        help="also write the finished frames' radiance, to a folder beside the output",
    )
    sub.add_argument(
        "--no-overlays", action="store_true", help="without the overlays that the film has"
    )
    add_overwrite(sub)
    sub.set_defaults(run=run_develop)


def run_develop(options: argparse.Namespace) -> int:
    """Develop stored frames."""
    from sumo3dviz_pt.pipeline.films.encoding import DevelopOrder, develop_frames

    order = DevelopOrder(
        options.output,
        options.exposure,
        options.tone,
        options.fps,
        options.codec,
        options.overwrite,
        options.final_exr,
        not options.no_overlays,
        options.response,
    )
    first, *others = develop_frames(options.frames, order)
    print(f"wrote {first}" + (f" to {others[-1].name}" if others else ""))
    return 0
