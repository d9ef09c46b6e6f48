"""`study`: from a design to films that differ in one thing, and the files of survey tools."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import (
    add_overrides,
    add_overwrite,
    add_variant,
    command_in,
    frame_range,
    overrides_of,
    progress,
)
from sumo3dviz_pt.errors import ConfigError, InputError, InstallationError, RenderError

if TYPE_CHECKING:
    from sumo3dviz_pt.studies.certificate.certificate import Certificate
    from sumo3dviz_pt.studies.plan import StudyPlan
    from sumo3dviz_pt.studies.run import FilmTask, StudyOrder


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("study", help="make the films and files of a designed study")
    sub.add_argument("study", type=Path, help="study file (.yaml)")
    sub.add_argument(
        "-o", "--output", type=Path, required=True, help="folder of all that comes out"
    )
    sub.add_argument(
        "--dry-run", action="store_true", help="only say what would be shown, and its cost"
    )
    sub.add_argument(
        "--trial",
        action="store_true",
        help="small, coarse films, to try the way: quality draft, 320 pixels wide at most, 5 frames"
        " per second; --set wins over it",
    )
    sub.add_argument("--film", metavar="NAME", help="make only this film, beside other machines")
    sub.add_argument(
        "--frames", type=frame_range, help="A:B renders only these frames of --film, no film"
    )
    sub.add_argument(
        "--resume", action="store_true", help="keep films and frames that match, render the others"
    )
    add_overwrite(sub, "replace films and frames that exist")
    sub.add_argument(
        "--discard-frames", action="store_true", help="keep frames only while others need them"
    )
    add_variant(sub)
    add_overrides(sub)
    sub.set_defaults(run=run)
    add_verify(sub)
    add_packs(sub)
    _add_gaze(sub)
    _add_presses(sub)


def add_verify(study: Any) -> None:
    """Say what `study verify` takes."""
    sub = study.add_word("verify", "follow the proof of a study's folder, without rendering")
    sub.add_argument("folder", type=Path, help="the study's, as `study` wrote it")
    sub.add_argument(
        "--replay", type=int, default=0, metavar="N", help="draw N frames by lot, render them anew"
    )
    sub.add_argument("--seed", type=int, default=0, metavar="S", help="draws others [0]")
    sub.add_argument(
        "--published", default="", metavar="DIGEST", help="what the certificate's digest should be"
    )
    sub.add_argument(
        "--quick", action="store_true", help="develop no frame again: hold films against prints"
    )
    sub.add_argument("--json", action="store_true", help="print it as JSON")
    sub.set_defaults(run=verify)


def verify(options: argparse.Namespace) -> int:
    """Say what is wrong with a study's folder; 1 if anything is.

    Raises:
        InputError: If the folder is no study's, or what a replay needs is missing or cannot be
            loaded.
    """
    from sumo3dviz_pt.model.progress import Doing
    from sumo3dviz_pt.pipeline.steps import WorkStep
    from sumo3dviz_pt.studies.certificate.verify import VerifyOrder, verify_study

    if options.replay < 0:
        raise ConfigError("a number of frames is 0 or more", key="replay")
    names = ("folder", "replay", "seed", "published", "quick")
    order = VerifyOrder(**{name: getattr(options, name) for name in names})
    with progress(f"verify {options.folder}", (WorkStep(Doing.MEASURE, 1.0),)):
        try:
            verified = verify_study(order)
        except (InstallationError, RenderError) as error:
            # Exit code 1 would say that something is wrong with the folder.
            why = f"nothing was verified: {error}; --quick without --replay needs no renderer"
            raise InputError(why, file=options.folder) from error
    if options.json:
        print(json.dumps(verified.as_plain(), indent=1))
        return 1 if verified.faults else 0
    for fault in verified.faults:
        print(fault)
    for note in verified.notes:
        print(f"note: {note}")
    print(verified)
    return 1 if verified.faults else 0


def add_packs(study: Any) -> None:
    """Say what `study pack` and `study unpack` take."""
    sub = study.add_word("pack", "write a finished study and all it was made from into one file")
    sub.add_argument("folder", type=Path, help="the study's, as `study` wrote it")
    sub.add_argument("-o", "--output", type=Path, required=True, help="pack (.zip)")
    sub.add_argument("--frames", action="store_true", help="with stored frames and layers")
    add_overwrite(sub)
    sub.set_defaults(run=pack)
    sub = study.add_word("unpack", "check a pack, and write its files into a new folder")
    sub.add_argument("pack", type=Path, help="pack (.zip)")
    sub.add_argument("-o", "--output", type=Path, required=True, help="new folder")
    sub.set_defaults(run=unpack)


def pack(options: argparse.Namespace) -> int:
    """Write a study's folder into one file."""
    from sumo3dviz_pt.pipeline.costs import space_in_words
    from sumo3dviz_pt.studies.folder import pack_study

    made = pack_study(
        options.folder, options.output, frames=options.frames, overwrite=options.overwrite
    )
    print(f"wrote {made.file}: {made.files} files, {space_in_words(made.size / 1e6)}")
    if made.beside:
        beside = f"frames and layers of {space_in_words(made.beside / 1e6)}"
        print(
            f"{beside} are in it" if options.frames else f"{beside} stay out; --frames packs them"
        )
    return 0


def unpack(options: argparse.Namespace) -> int:
    """Write a pack's files into a new folder."""
    from sumo3dviz_pt.studies.folder import FOLDER, README, unpack_study

    count = unpack_study(options.pack, options.output)
    print(f"wrote {options.output}: {count} files, as they were packed; see {FOLDER}/{README}")
    return 0


def _add_gaze(study: Any) -> None:
    """Say what `study gaze` takes."""
    sub = study.add_word("gaze", "which things people look at in a study's films, as tables")
    sub.add_argument("folder", type=Path, help="the study's, or one that holds films with layers")
    sub.add_argument(
        "samples",
        type=Path,
        nargs="?",
        help="table (.csv) with film, time [s], x and y [px], maybe participant; without it only"
        " boxes.csv is written",
    )
    sub.add_argument("-o", "--output", type=Path, required=True, help="folder of the tables")
    sub.add_argument(
        "--start", type=float, default=0.0, metavar="T", help="time of the first frame there [0 s]"
    )
    sub.add_argument(
        "--fixation", type=float, default=0.1, metavar="T", help="shortest fixation [0.1 s]"
    )
    sub.add_argument(
        "--radius",
        type=float,
        default=0.0,
        metavar="PX",
        help="gaze so near to a thing with an outline hits it, for the tracker's error [0 px]",
    )
    add_overwrite(sub)
    sub.set_defaults(run=gaze)


def gaze(options: argparse.Namespace) -> int:
    """Write which things people look at."""
    from sumo3dviz_pt.model.progress import Doing
    from sumo3dviz_pt.pipeline.steps import WorkStep
    from sumo3dviz_pt.studies.measured.gaze import GazeOrder, write_gaze

    names = ("folder", "samples", "output", "start", "fixation", "radius", "overwrite")
    order = GazeOrder(**{name: getattr(options, name) for name in names})
    with progress(f"gaze {options.folder}", (WorkStep(Doing.MEASURE, 1.0),)):
        files = write_gaze(order)
    print(f"wrote {', '.join(str(file) for file in files)}")
    return 0


def _add_presses(study: Any) -> None:
    """Say what `study presses` takes."""
    sub = study.add_word("presses", "join presses during films with the vehicles that arrive")
    sub.add_argument("data", type=Path, help="what the page saved (.csv), or a folder of it")
    sub.add_argument("--study", type=Path, required=True, metavar="OUT", help="the study's folder")
    sub.add_argument("-o", "--output", type=Path, required=True, help="table (.csv)")
    sub.add_argument(
        "--observer", default="camera", metavar="NAME", help="for whom vehicles arrive [camera]"
    )
    sub.add_argument(
        "--early",
        type=float,
        default=0.0,
        metavar="SECONDS",
        help="a press so long before a vehicle has left accepts the gap behind it [0 s]",
    )
    add_overwrite(sub)
    sub.set_defaults(run=presses)


def presses(options: argparse.Namespace) -> int:
    """Write presses with the next arrival, the margin and the gap."""
    from sumo3dviz_pt.pipeline.production import check_target
    from sumo3dviz_pt.studies.measured.presses import write_presses

    output, again = options.output, options.overwrite
    check_target(output, suffixes=(".csv",), overwrite=again)
    count = write_presses(
        options.study,
        options.data,
        output,
        observer=options.observer,
        early=options.early,
        overwrite=again,
    )
    print(f"wrote {output}: {count} rows")
    return 0


def run(options: argparse.Namespace) -> int:
    """Make the films of a study, or say what would be done."""
    from sumo3dviz_pt.pipeline.films.rendering import stoppable
    from sumo3dviz_pt.pipeline.scene_file import override_values
    from sumo3dviz_pt.studies.file import load_study
    from sumo3dviz_pt.studies.plan import plan_study, trial_values
    from sumo3dviz_pt.studies.run import check_study, in_words

    if options.frames is not None and options.film is None:
        raise ConfigError("say by --film NAME which film's frames", key="frames")
    order = _order(options)
    study, wanted = load_study(options.study), override_values(overrides_of(options))
    plan = plan_study(study, trial_values(study, wanted) if options.trial else wanted)
    if options.dry_run:
        plan = plan if options.film is None else plan.only(options.film)
        check_study(plan, replace(order, resume=True))
        print(in_words(plan, order))
        return 0
    with stoppable():
        return _part(options, plan, order) if options.film else _whole(options, plan, order)


def _part(options: argparse.Namespace, plan: StudyPlan, order: StudyOrder) -> int:
    """Render one film, or some of its frames; what all films share is left to another call."""
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.steps import film_steps
    from sumo3dviz_pt.studies.run import check_study, film_part, render_part

    # Frames of this film that others render meanwhile are no reason to refuse; its own are, later.
    check_study(plan.only(options.film), replace(order, resume=True))
    ready_renderer(options.variant)
    task = film_part(plan, order, options.film, options.frames)
    steps = film_steps(task.stimulus.job, task.request, task.order)
    with progress(task.order.path.name, steps):
        render_part(order, task)
    print(f"wrote {task.order.path if options.frames is None else _frames_of(task)}")
    return 0


def _frames_of(task: FilmTask) -> str:
    """Return which frames were rendered."""
    first, after = task.order.frames or (0, 0)
    return f"frames {first} to {after - 1} of {task.order.path}"


def _whole(options: argparse.Namespace, plan: StudyPlan, order: StudyOrder) -> int:
    """Make all films that are not there, and what goes with them."""
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.steps import film_steps
    from sumo3dviz_pt.studies.run import check_study, film_tasks, finish_study, render_task

    check_study(plan, order)
    tasks = film_tasks(plan, order)
    if tasks:
        ready_renderer(options.variant)
    for number, task in enumerate(tasks, start=1):
        name = f"{task.order.path.name} ({number} of {len(tasks)})"
        with progress(name, film_steps(task.stimulus.job, task.request, task.order)):
            render_task(plan, order, task)
    finished = finish_study(plan, order)
    for note in plan.notes:
        print(f"note: {note}")
    print(
        f"wrote {options.output}: {len(plan.stimuli)} films ({len(tasks)} rendered),"
        f" {len(plan.trials)} trials, {len(plan.playlists)} playlists, {len(finished.files)} files"
    )
    return 0 if finished.certificate is None else say(finished.certificate)


def say(certificate: Certificate) -> int:
    """Print what a certificate found; return the exit code."""
    for pair in certificate.failed:
        more = f" (and {len(pair.faults) - 1} more)" if len(pair.faults) > 1 else ""
        print(f"failed: {pair}: {pair.faults[0]}{more}")
    for fault in certificate.faults:
        print(f"failed: {fault}")
    print(f"{certificate}; see certificate.html")
    return 0 if certificate.passed else 1


def _order(options: argparse.Namespace) -> StudyOrder:
    """Return what is to be made."""
    from sumo3dviz_pt.studies.run import StudyOrder

    return StudyOrder(
        options.output,
        options.resume,
        options.overwrite,
        options.discard_frames,
        options.variant,
        command_in(options.words),
    )
