"""The command line: arguments in, one clear sentence or a picture out.

Exit codes: 0 done; 2 wrong input or configuration; 1 failed while working, finished
frames are kept; 130 interrupted.
"""

from __future__ import annotations

import argparse
import logging
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.arguments import PROGRAM, build_parser, overrides_of, request_of
from sumo3dviz_pt.errors import ConfigError, InputError, Sumo3dvizError, interrupted

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from sumo3dviz_pt.film import FilmOrder, FilmReport
    from sumo3dviz_pt.pipeline import Request


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code."""
    _log_to_stderr()
    try:
        options = build_parser().parse_args(arguments)
        options.line = shlex.join([PROGRAM, *(sys.argv[1:] if arguments is None else arguments)])
        return _COMMANDS[options.command](options)
    except (InputError, ConfigError) as error:
        return _complain(error, 2)
    except (Sumo3dvizError, OSError, MemoryError, KeyboardInterrupt) as error:
        stopped = interrupted(error)
        text, code = ("interrupted", 130) if stopped else (error, 1)
        return _complain(text, code, _hint(locals().get("options")))


def _complain(error: object, code: int, hint: str = "") -> int:
    """Print an error as one sentence; the exit code."""
    print(f"{PROGRAM}: {error}{hint}", file=sys.stderr)
    return code


def _hint(options: argparse.Namespace | None) -> str:
    """How to go on after a film broke off."""
    if options is not None and getattr(options, "command", "") == "render":
        return "; finished frames are kept: the same command with --resume goes on"
    return ""


class _Notes(logging.Handler):
    """Prints warnings as plain sentences to whatever stderr is then."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        print(f"{PROGRAM}: note: {record.getMessage()}", file=sys.stderr)


def _log_to_stderr() -> None:
    """Show warnings as plain sentences."""
    logging.basicConfig(level=logging.WARNING, handlers=[_Notes()], force=True)


# Commands ---------------------------------------------------------------------------------


def _demo(options: argparse.Namespace) -> int:
    """Render the bundled example."""
    from sumo3dviz_pt.film import FilmOrder
    from sumo3dviz_pt.jobfile import load_job
    from sumo3dviz_pt.pipeline import Request, example, render_still

    job = load_job(example("ronda"))
    folder = options.output
    request = Request(quality=options.quality, size=options.size, variant=options.variant)
    shot = job.shots[0]
    order = FilmOrder(
        folder / "demo.mp4",
        start=shot.start,
        end=min(shot.end, shot.start + 2),
        discard_frames=True,
    )
    _print_film(_film(job, replace(request, camera=shot.camera), order))
    picture = replace(request, camera="overview")
    with _progress() as show:
        still = render_still(
            job,
            picture,
            shot.start,
            after_pass=partial(show, "demo.png"),
        )
    still.save(folder / "demo.png")
    print(f"wrote {folder / 'demo.png'}")
    return 0


def _init(options: argparse.Namespace) -> int:
    """Write a scene file."""
    from sumo3dviz_pt.initfile import propose
    from sumo3dviz_pt.job import ScenarioSettings

    text, notes = propose(
        options.scenario,
        output=options.output,
        template=options.template,
        own=ScenarioSettings(
            network=options.network,
            trajectories=tuple(options.trajectories),
            signals=tuple(options.signals),
            additional=tuple(options.additional),
        ),
    )
    options.output.write_text(text, encoding="utf-8")
    for note in notes:
        print(note)
    print(f"wrote {options.output}; next: {PROGRAM} check {options.output}")
    return 0


def _check(options: argparse.Namespace) -> int:
    """Validate a scene."""
    import json

    from sumo3dviz_pt.checks import check_scene, in_words
    from sumo3dviz_pt.jobfile import load_job
    from sumo3dviz_pt.motion_checks import motion_report

    if options.stress:
        return _stress(options)
    job = load_job(options.scene, overrides_of(options))
    if options.motion:
        print(motion_report(job, as_json=options.json))
        return 0
    report = check_scene(job)
    print(json.dumps(report, indent=1) if options.json else in_words(report))
    return 0


def _stress(options: argparse.Namespace) -> int:
    """Put a scene under stress; 1 if a case fails."""
    import json

    from sumo3dviz_pt.jobfile import load_job
    from sumo3dviz_pt.report.stress import StressOrder, chosen, put_under_stress, without_notes
    from sumo3dviz_pt.report.stress_report import in_words

    cases = chosen(options.only)
    with _progress() as show, without_notes():
        report = put_under_stress(
            load_job(options.scene, overrides_of(options)),
            StressOrder(options.camera, options.time, options.variant),
            cases=cases,
            on_case=lambda news: show(news.name, news.done, news.total, news.seconds_left),
        )
    print(json.dumps(report.as_dict(), indent=1) if options.json else in_words(report))
    failed = report.count("failed")
    if failed:
        return _complain(f"{failed} of {len(report.outcomes)} cases failed", 1)
    return 0


def _still(options: argparse.Namespace) -> int:
    """Render one image."""
    from sumo3dviz_pt.jobfile import load_job
    from sumo3dviz_pt.pipeline import check_target, render_still

    check_target(options.output, suffixes=(".png", ".exr"))
    job = load_job(options.scene, overrides_of(options))
    with _progress() as show:
        still = render_still(
            job,
            request_of(options),
            options.time,
            after_pass=lambda done, total: show(options.output.name, done, total, 0.0),
        )
    still.save(options.output)
    print(f"wrote {options.output} ({_seconds(still.rendered.cpu)})")
    return 0


def _render(options: argparse.Namespace) -> int:
    """Render films; in a batch one failure does not stop the rest."""
    from sumo3dviz_pt.film import FilmOrder
    from sumo3dviz_pt.jobfile import load_job

    if len(options.scene) > 1 and "{scene}" not in options.output.name:
        raise ConfigError("several scenes need {scene} in the name of the output", key="output")
    worst = 0
    for scene in options.scene:
        name = options.output.name.replace("{scene}", scene.stem)
        order = FilmOrder(
            options.output.with_name(name),
            options.start,
            options.end,
            options.fps,
            options.frames,
            options.resume,
            options.discard_frames,
        )
        try:
            _print_film(_film(load_job(scene, overrides_of(options)), request_of(options), order))
        except Sumo3dvizError as error:
            if len(options.scene) == 1:
                raise
            code = 2 if isinstance(error, InputError | ConfigError) else 1
            worst = max(worst, _complain(f"{scene}: {error}", code))
    return worst


def _film(job: Any, request: Request, order: FilmOrder) -> list[FilmReport]:
    """Render films and show how far they are."""
    from sumo3dviz_pt.film import render_film

    with _progress() as show:
        return render_film(
            job,
            request,
            order,
            on_frame=lambda news: show(order.path.name, news.done, news.total, news.seconds_left),
        )


def _print_film(reports: list[FilmReport]) -> None:
    """Say what came out."""
    for report in reports:
        place = report.film or report.folder
        print(f"wrote {place}: {report.frames} frames ({_seconds(report.cpu)})")


def _seconds(cpu: dict[str, float]) -> str:
    """CPU-seconds in words."""
    return f"{sum(cpu.values()):.1f} CPU-seconds"


def _develop(options: argparse.Namespace) -> int:
    """Develop stored frames."""
    from sumo3dviz_pt.develop import develop_frames

    develop_frames(
        options.frames,
        options.output,
        exposure=options.exposure,
        tone=options.tone,
        fps=options.fps,
        codec=options.codec,
    )
    print(f"wrote {options.output}")
    return 0


def _report(options: argparse.Namespace) -> int:
    """Look at a film's frames, or compare two films."""
    from sumo3dviz_pt.report.compare import report_film

    with _progress() as show:
        page = report_film(
            options.frames,
            options.output,
            against=options.against,
            on_frame=lambda *news: show(options.frames.name, *news),
        )
    print(f"wrote {page}")
    return 0


def _scene_name(scene: Path) -> str:
    """What tables call a scene: its file's name, or its folder's if that says nothing."""
    return scene.stem if scene.stem != "scene" else scene.resolve().parent.name


def _converge(options: argparse.Namespace) -> int:
    """Measure error against run time."""
    from sumo3dviz_pt.jobfile import load_job
    from sumo3dviz_pt.pipeline import Request
    from sumo3dviz_pt.report.converge import Order, converge

    job = load_job(options.scene, overrides_of(options))
    request = Request(options.camera, size=options.size, variant=options.variant)
    order = Order(
        options.output,
        options.time,
        scene=_scene_name(options.scene),
        command=options.line,
        budget=options.budget,
        top=options.top,
    )
    with _progress() as show:
        page = converge(job, request, order, on_step=show)
    print(f"wrote {page}")
    return 0


def _motion(options: argparse.Namespace) -> int:
    """Draw how one road user moves."""
    from sumo3dviz_pt.jobfile import load_job
    from sumo3dviz_pt.motion_drawing import Wanted, draw_motion

    job = load_job(options.scene, overrides_of(options))
    draw_motion(job, Wanted(options.vehicle, options.output, options.start, options.end))
    print(f"wrote {options.output}")
    return 0


def _view(options: argparse.Namespace) -> int:
    """Walk through a scene in the browser."""
    from sumo3dviz_pt.viewer.command import view

    view(options, announce=lambda address: print(address, flush=True))
    return 0


def _doctor(_: argparse.Namespace) -> int:
    """Look at the installation."""
    from sumo3dviz_pt.doctor import examine

    healthy, lines = examine()
    print("\n".join(lines))
    return 0 if healthy else 1


@contextmanager
def _progress() -> Iterator[Callable[..., None]]:
    """A line that says how far the work is and how long it will take."""
    import time

    live = sys.stderr.isatty()
    last = [0.0]

    def show(name: str, done: int, total: int, left: float = 0.0) -> None:
        now = time.monotonic()
        if not live and done < total and now - last[0] < 10:
            return
        last[0] = now
        minutes, seconds = divmod(round(left), 60)
        text = f"{name}: {done} of {total}, {minutes}:{seconds:02d} left"
        print(
            f"\r{text:<60}" if live else text, end="" if live else "\n", file=sys.stderr, flush=True
        )

    try:
        yield show
    finally:
        if live and last[0]:
            print(file=sys.stderr)


def _assets(options: argparse.Namespace) -> int:
    """List, draw or rebuild the library."""
    from sumo3dviz_pt.library import build, listing

    if options.action == "sheet":
        return _sheets(options)
    if options.action == "list":
        print("\n".join(listing(options.chosen)))
        return 0
    with _progress() as show:
        for name, done, total in build(options.chosen, into=options.output):
            show(name, done, total)
    return 0


def _sheets(options: argparse.Namespace) -> int:
    """Draw contact sheets."""
    from pathlib import Path

    from sumo3dviz_pt.sheets import SheetOrder, draw_sheet, sheet_names

    folder = options.output or Path()
    for name in options.chosen or sheet_names():
        order = SheetOrder(name, folder / f"sheet_{name}.png", options.size, options.quality)
        with _progress() as show:
            draw_sheet(order, progress=partial(show, name))
        print(f"wrote {order.path}")
    return 0


_COMMANDS: Mapping[str, Callable[[argparse.Namespace], int]] = {
    "demo": _demo,
    "init": _init,
    "check": _check,
    "still": _still,
    "render": _render,
    "develop": _develop,
    "converge": _converge,
    "report": _report,
    "motion": _motion,
    "view": _view,
    "assets": _assets,
    "doctor": _doctor,
}

if __name__ == "__main__":
    sys.exit(main())
