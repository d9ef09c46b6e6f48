"""`farm`: films and studies on many machines that share a folder."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import PROGRAM, overrides_of, progress, request_of
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.numbers import counted

if TYPE_CHECKING:
    from sumo3dviz_pt.farm.making import FarmOrder
    from sumo3dviz_pt.farm.plan import FarmPlan
    from sumo3dviz_pt.farm.state import FarmState


_OUT = "film.mp4, also with {shot} or {frame}, or a study's folder"


def add(commands: Any) -> None:
    """Say what it takes."""
    from sumo3dviz_pt.cli.render import add_film

    sub = commands.add_parser(
        "farm", help="render a film or a study on many machines", allow_abbrev=False
    )
    sub.add_argument(
        "scene",
        type=Path,
        help="scene or study file; or status, stop, resume or work, followed by the output",
    )
    sub.add_argument("place", type=Path, nargs="?", help="output of a farm that was begun")
    _add_own(sub)
    add_film(sub, output=_OUT, required=False)
    sub.set_defaults(run=run)


def _add_own(sub: argparse.ArgumentParser) -> None:
    """Add the options that only `farm` has."""
    sub.add_argument("--engine", metavar="NAME", help="local, dask or slurm [local]")
    sub.add_argument("--workers", type=int, metavar="N", help="how many work at once")
    sub.add_argument(
        "--cpus-per-task", type=int, metavar="N", help="threads of each worker [Slurm: 16]"
    )
    sub.add_argument(
        "--task-minutes", type=float, metavar="M", help="length of a task [20 min, or less]"
    )
    sub.add_argument("--task-frames", type=int, metavar="N", help="frames of a task instead")
    sub.add_argument(
        "--tries", type=int, default=3, metavar="N", help="then a frame is set aside [3]"
    )
    sub.add_argument(
        "--lease", type=float, default=180.0, metavar="T", help="silence of the dead [180 s]"
    )
    sub.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, or its file .json")
    sub.add_argument(
        "--gres", metavar="GPUS", help="Slurm's GPUs of a job [gpu:1 with --variant cuda]"
    )
    sub.add_argument("--partition", metavar="NAME", help="Slurm's")
    sub.add_argument("--account", metavar="NAME", help="Slurm's")
    sub.add_argument("--time", metavar="H:MM:SS", help="Slurm's limit for a job")
    sub.add_argument("--mem", metavar="SIZE", help="Slurm's, such as 6G")
    sub.add_argument(
        "--detach", action="store_true", help="submit Slurm's jobs, and do not follow them"
    )
    sub.add_argument("--task", type=int, metavar="N", help="work at this task only")
    sub.add_argument("--json", action="store_true", help="status as JSON")


def run(options: argparse.Namespace) -> int:
    """Begin a farm, or do something with one."""
    do = _ACTIONS.get(str(options.scene))
    if do is None:
        return _begin(options)
    if options.place is None:
        raise ConfigError(f"say which: {PROGRAM} farm {options.scene} OUTPUT", key="output")
    return do(options)


def _begin(options: argparse.Namespace) -> int:
    """Plan a farm and run it."""
    from sumo3dviz_pt.farm.making import clear
    from sumo3dviz_pt.farm.plan import PLAN

    if options.place is not None:
        raise ConfigError(f"{str(options.place)!r} is one file too many", key="scene")
    if options.output is None:
        raise ConfigError("say what comes out: -o film.mp4", key="output")
    plan = _planned(options, _farm_order(options))
    if options.dry_run:
        print(_in_words(plan))
        return 0
    if (plan.folder / PLAN).exists() and not options.overwrite:
        raise ConfigError(
            f"{plan.folder} is there already: `{PROGRAM} farm resume {options.output}` goes on"
            " with it, --overwrite begins anew",
            key="output",
        )
    if options.overwrite:
        clear(plan)
    return _run(plan, options.output)


def _planned(options: argparse.Namespace, farm: FarmOrder) -> FarmPlan:
    """Return the plan of a scene's films, or of a study's."""
    words = plain_words(options.words)
    if _is_study(options.scene):
        return _planned_study(options, farm, words)
    from sumo3dviz_pt.cli.render import order_of
    from sumo3dviz_pt.farm.making import plan_films
    from sumo3dviz_pt.pipeline.scene_file import load_job

    options.frames, options.resume = None, False
    order = order_of(options, options.scene)
    job = load_job(options.scene, overrides_of(options))
    shot = () if options.shot is None else ("--shot", str(options.shot))
    return plan_films(job, request_of(options), order, words=("render", *words, *shot), farm=farm)


def _planned_study(options: argparse.Namespace, farm: FarmOrder, words: Sequence[str]) -> FarmPlan:
    """Return the plan of a study's films."""
    from sumo3dviz_pt.farm.making import plan_study_films
    from sumo3dviz_pt.pipeline.scene_file import override_values
    from sumo3dviz_pt.studies.file import load_study
    from sumo3dviz_pt.studies.plan import plan_study
    from sumo3dviz_pt.studies.run import StudyOrder

    # What only films of a scene have, `study` refuses by itself.
    options.parser.parse_args(["study", *words, "-o", str(options.output)])
    order = StudyOrder(
        options.output,
        overwrite=options.overwrite,
        discard_frames=options.discard_frames,
        variant=options.variant,
    )
    plan = plan_study(load_study(options.scene), override_values(overrides_of(options)))
    return plan_study_films(plan, order, words=("study", *words), farm=farm)


def _is_study(path: Path) -> bool:
    """Return whether a file is a study's; what is wrong with it is said by whatever reads it."""
    from sumo3dviz_pt.files.atomic import read_plain
    from sumo3dviz_pt.job.yaml12 import MOST_TEXT, parse_yaml

    try:
        text = read_plain(path, most=4 * MOST_TEXT).decode("utf-8")
        content, _ = parse_yaml(text, file=path)
    except (OSError, UnicodeDecodeError):
        return False
    return isinstance(content, dict) and "factors" in content


def plain_words(words: Sequence[str]) -> list[str]:
    """Return the words of a command `farm` that `render` or `study` would have had as well.

    They keep their order, so that pictures tell the same command.

    Args:
        words: Of the whole command.
    """
    own = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    _add_own(own)
    own.add_argument("-o", "--output")
    own.add_argument("--shot")
    for flag in ("--overwrite", "--discard-frames", "--final-exr", "--dry-run"):
        own.add_argument(flag, action="store_true")
    for flags in (("-q", "--quiet"), ("-v", "--verbose")):
        own.add_argument(*flags, action="store_true")
    _, rest = own.parse_known_args(list(words))
    rest.remove("farm")
    return rest


def _farm_order(options: argparse.Namespace) -> FarmOrder:
    """Return how the farm is to be run."""
    from sumo3dviz_pt.farm.making import FarmOrder
    from sumo3dviz_pt.farm.plan import EngineChoice
    from sumo3dviz_pt.farm.run import check_engine

    engine = EngineChoice(
        options.engine or "local",
        options.workers,
        options.cpus_per_task,
        options.scheduler,
        options.partition,
        options.account,
        options.time,
        options.mem,
        options.detach,
        options.gres or ("gpu:1" if options.variant == "cuda" else None),
    )
    return FarmOrder(
        check_engine(engine),
        options.task_minutes,
        options.task_frames,
        options.tries,
        options.lease,
    )


def _in_words(plan: FarmPlan) -> str:
    """Return what a farm would do."""
    from sumo3dviz_pt.pipeline.costs import time_in_words

    lines = [
        f"{plan.folder}: {len(plan.tasks)} tasks,"
        f" about {time_in_words(sum(task.cpu for task in plan.tasks))} of CPU time"
    ]
    for number, task in enumerate(plan.tasks):
        needs = f", after {len(task.needs)} others" if task.needs else ""
        lines.append(f"  {number}  about {task.cpu:.0f} CPU-s{needs}")
        lines.append(f"    {shlex.join([PROGRAM, *task.line()])}")
    return "\n".join(lines)


def _run(plan: FarmPlan, output: Path) -> int:
    """Run a farm and say what came out."""
    from sumo3dviz_pt.farm.plan import write_plan
    from sumo3dviz_pt.farm.run import farm_steps, run_farm
    from sumo3dviz_pt.farm.state import read_state
    from sumo3dviz_pt.pipeline.films.rendering import stoppable

    write_plan(plan)
    lines: list[str] = []
    try:
        with stoppable(), progress(output.name, farm_steps(plan, read_state(plan))):
            state = run_farm(plan, tell=lines.append)
    except KeyboardInterrupt:
        hint = "it goes on without this command" if plan.engine.name == "slurm" else "stopped"
        print(f"{hint}: {PROGRAM} farm {_next(plan)} {output}")
        raise
    print(lines[0])
    return _reported(plan, state, output)


def _next(plan: FarmPlan) -> str:
    """Return what to do after an interruption."""
    return "status" if plan.engine.name == "slurm" else "resume"


def _reported(plan: FarmPlan, state: FarmState, output: Path) -> int:
    """Say how a farm ended; return the exit code."""
    from sumo3dviz_pt.farm.run import problems_of

    if state.complete:
        for film in plan.films:
            print(f"wrote {film.path}: {counted(film.frames, 'frame')}")
        return 0
    problems = problems_of(state)
    for problem in problems:
        log = "" if problem.log is None else f" (see {problem.log})"
        print(f"failed: {problem.what}{log}")
    done, total = state.frames
    if state.over:
        print(f"{done} of {total} frames are there; `{PROGRAM} farm resume {output}` tries again")
        return 1
    print(f"{done} of {total} frames are there: {PROGRAM} farm status {output}")
    return 130 if state.stopping else 0


# What is done with a farm that was begun ------------------------------------------------------


def _plan_at(options: argparse.Namespace) -> FarmPlan:
    """Return the plan of the farm that makes an output."""
    from sumo3dviz_pt.farm.plan import farm_folder, read_plan

    return read_plan(farm_folder(options.place))


def _status(options: argparse.Namespace) -> int:
    """Say how far it is."""
    from sumo3dviz_pt.farm.run import status_of
    from sumo3dviz_pt.farm.state import read_state

    status = status_of(read_state(_plan_at(options)))
    print(json.dumps(status.as_dict(), indent=1) if options.json else status)
    return 0


def _stop(options: argparse.Namespace) -> int:
    """Let frames be finished, and begin nothing more."""
    from sumo3dviz_pt.farm.run import stop_farm

    stop_farm(_plan_at(options))
    print(
        "workers finish the frames that they have begun, and end;"
        f" {PROGRAM} farm resume {options.place} goes on"
    )
    return 0


def _resume(options: argparse.Namespace) -> int:
    """Go on, and try again what failed."""
    from dataclasses import replace

    from sumo3dviz_pt.farm.run import renew

    plan = _plan_at(options)
    if options.engine is not None:
        plan = replace(plan, engine=_farm_order(options).engine)
    renew(plan)
    return _run(plan, options.place)


def _work(options: argparse.Namespace) -> int:
    """Work at what is to be done until nothing is left; engines start this."""
    from sumo3dviz_pt.farm.state import TaskState
    from sumo3dviz_pt.farm.worker import listening, work

    plan = _plan_at(options)
    if options.task is not None and not 0 <= options.task < len(plan.tasks):
        raise ConfigError(f"the farm has tasks 0 to {len(plan.tasks) - 1}", key="task")
    with listening() as orders:
        state = work(plan, orders, only=options.task, tell=_say)
    if state.stopping or orders.stop:
        return 130
    own = state.states if options.task is None else [state.states[options.task]]
    return 1 if {TaskState.FAILED, TaskState.ASIDE} & {*own} else 0


def _say(text: str) -> None:
    """Print a line at once."""
    print(text, flush=True)


_ACTIONS: Mapping[str, Callable[[argparse.Namespace], int]] = {
    "status": _status,
    "stop": _stop,
    "resume": _resume,
    "work": _work,
}
"""What can stand in the place of a scene file."""
