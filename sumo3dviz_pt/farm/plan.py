"""What a farm does, in `plan.json`: its tasks, and the engine that runs them.

Each task is a plain command line that may be run again.
"""

from __future__ import annotations

import json
import math
import os
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.files.forms import Form
from sumo3dviz_pt.job.errors import settle
from sumo3dviz_pt.job.values import Whole
from sumo3dviz_pt.pipeline.films.frames import film_name, frames_folder, write_json

PROGRAM = (sys.executable, "-P", "-m", "sumo3dviz_pt.cli")
"""How our command is begun; -P, because files of strangers may lie in the folder where it is."""

_ONE_WORD = re.compile(r"[^\s\x00-\x1f\"'`$\\]{1,200}")
"""What may stand in a line of a batch script."""

Workers = Annotated[Whole, Field(ge=1, le=100_000)]


@dataclass(frozen=True, slots=True)
class EngineChoice:
    """An engine, and what it is told.

    Attributes:
        name: A key of `ENGINES`.
        workers: How many work at once; None is the engine's own choice.
        threads: Of each worker; None is all of its machine's.
        scheduler: Of a Dask cluster: an address, or a scheduler file.
        partition: Slurm's.
        account: Slurm's.
        time: Slurm's limit for each job, such as 2:00:00.
        memory: Slurm's, such as 6G.
        gpus: What each of Slurm's jobs gets, as its --gres: gpu:1, or a kind such as gpu:a100:1.
        detach: Whether Slurm's jobs are submitted and not followed.
    """

    name: str = "local"
    workers: Workers | None = None
    threads: Workers | None = None
    scheduler: str | None = None
    partition: str | None = None
    account: str | None = None
    time: str | None = None
    memory: str | None = None
    detach: bool = False
    gpus: str | None = None

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)
        for key in ("scheduler", "partition", "account", "time", "memory", "gpus"):
            value = getattr(self, key)
            if value is not None and not _ONE_WORD.fullmatch(value):
                raise ConfigError(f"this should be one word, not {value!r}", key=key)


PLAN = "plan.json"
"""The plan's file, in the farm's folder."""

PLAN_FILE = Form("farm's plan")
"""Its version, and what makes it of older ones."""

SUFFIX = ".farm"
"""A farm's folder beside its film: film.mp4 has film.farm."""

_MOST_FRAMES = 10_000_000
"""Of a film; more are damage."""

IN_STUDY = "farm"
"""A farm's folder within a study's."""


@dataclass(frozen=True, slots=True)
class FarmFilm:
    """A film that comes out.

    Attributes:
        path: As the command names it.
        frames: How many it has.
    """

    path: str
    frames: int

    @property
    def folder(self) -> Path:
        """Of its frames, as the command would name it."""
        return frames_folder(Path(self.path))


@dataclass(frozen=True, slots=True)
class FarmTask:
    """A command line, and what has to be done before it.

    Attributes:
        words: Of the command, without the program.
        film: Number of the film that it works for; None is all.
        frames: First and after-last frame that it renders; None where it makes films of frames.
        needs: Numbers of tasks that come first.
        cpu: Forecast of what it takes [CPU-s].
    """

    words: tuple[str, ...]
    film: int | None
    frames: tuple[int, int] | None
    needs: tuple[int, ...] = ()
    cpu: float = 0.0

    def line(self, frames: tuple[int, int] | None = None) -> list[str]:
        """Return its command line, for other frames if these are given."""
        words = list(self.words)
        if frames is not None:
            words[words.index("--frames") + 1] = "{}:{}".format(*frames)
        return words


@dataclass(frozen=True, slots=True)
class FarmPlan:
    """All that a farm does.

    Attributes:
        folder: The farm's own.
        tasks: In order; their places are their numbers.
        films: That come out.
        engine: What runs it, and how.
        cwd: Folder that the commands are run in, seen from the farm's own folder.
        tries: How often a frame may fail until it is set aside.
        lease: After this time without a sign of life a worker counts as dead [s].
    """

    folder: Path
    tasks: tuple[FarmTask, ...]
    films: tuple[FarmFilm, ...]
    engine: EngineChoice
    cwd: str
    tries: int = 3
    lease: float = 180.0

    @property
    def place(self) -> Path:
        """The folder that commands are run in, on this machine."""
        return (self.folder / self.cwd).resolve()

    def frames_of(self, task: FarmTask) -> Path:
        """Return the folder of the frames that a task renders."""
        assert task.film is not None
        return self.place / self.films[task.film].folder

    def rendering(self) -> list[int]:
        """Return the numbers of the tasks that render frames."""
        return [number for number, task in enumerate(self.tasks) if task.frames is not None]


def farm_folder(output: Path) -> Path:
    """Return a farm's folder, by what comes out of it: a film, a study's folder, or the farm's.

    Args:
        output: As `-o` takes it.
    """
    if output.suffix == SUFFIX or output.name == IN_STUDY:
        return output
    if not output.suffix or output.is_dir():
        return output / IN_STUDY
    name = output.name.replace("{shot}", "shots")
    return film_name(output.with_name(name)).with_suffix(SUFFIX)


def chunks(frames: int, *, longest: int) -> list[tuple[int, int]]:
    """Return parts of a film, nearly alike, each first and after-last frame.

    Args:
        frames: Of the film, at least one.
        longest: Most frames of a part, at least one.
    """
    count = math.ceil(frames / longest)
    ends = [round(frames * part / count) for part in range(count + 1)]
    return list(pairwise(ends))


def write_plan(plan: FarmPlan) -> None:
    """Write a plan to its folder."""
    plan.folder.mkdir(parents=True, exist_ok=True)
    content = {**PLAN_FILE.stamp, **asdict(plan)}
    del content["folder"]
    write_json(plan.folder / PLAN, content, indent=1)


def read_plan(folder: Path) -> FarmPlan:
    """Return the plan of a farm.

    Raises:
        ConfigError: If there is none, or a newer version wrote it.
        InputError: If it is damaged.
    """
    path = folder / PLAN
    try:
        content = json.loads(path.read_bytes())
    except FileNotFoundError as error:
        raise ConfigError(
            f"there is no farm {folder}; `sumo3dviz-pt farm SCENE.yaml -o FILM.mp4` makes one",
            key="output",
        ) from error
    except OSError as error:
        raise InputError(f"the farm's plan cannot be read ({error})", file=path) from error
    except (RecursionError, ValueError) as error:
        raise _damaged(path, error) from error
    content = PLAN_FILE.current(content, path) if isinstance(content, dict) else content
    try:
        plan = _plan_of(folder, content)
        _check(plan)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise _damaged(path, error) from error
    except ConfigError as error:
        raise _damaged(path, error) from error
    return plan


def _damaged(path: Path, error: Exception) -> InputError:
    """Return what is said of a plan that makes no sense."""
    return InputError(
        f"the farm's plan is damaged, or another version wrote it ({cut(str(error))}); plan anew"
        " with --overwrite",
        file=path,
    )


def _check_names(names: Iterable[str]) -> None:
    """Refuse what no file can be called.

    Raises:
        ValueError: Also for half a character, which cannot be encoded.
    """
    for name in names:
        if b"\0" in name.encode():
            raise ValueError(f"the name {name!r}")


def _check(plan: FarmPlan) -> None:
    """Refuse a plan whose parts do not fit.

    Raises:
        ValueError: Says which.
    """
    if not (plan.films and plan.tasks and plan.tries > 0 and 0.0 < plan.lease < math.inf):
        raise ValueError("films, tasks, tries or lease")
    if not all(0 < each.frames <= _MOST_FRAMES and Path(each.path).name for each in plan.films):
        raise ValueError("a film's frames or name")
    _check_names((plan.cwd, *(film.path for film in plan.films)))
    for number, task in enumerate(plan.tasks):
        film = task.film
        known = film is None or (type(film) is int and 0 <= film < len(plan.films))
        if not known or any(not 0 <= need < number for need in task.needs):
            raise ValueError(f"film or needs of task {number}")
        if not 0.0 <= task.cpu < math.inf:
            raise ValueError(f"cpu of task {number}")
        if task.frames is not None:
            first, after = task.frames
            most = 0 if film is None else plan.films[film].frames
            if not 0 <= first < after <= most or "--frames" not in task.words[:-1]:
                raise ValueError(f"frames of task {number}")


def _plan_of(folder: Path, content: Mapping[str, Any]) -> FarmPlan:
    """Return a plan from its JSON."""
    tasks = [
        FarmTask(
            tuple(map(str, task["words"])),
            task["film"],
            None if task["frames"] is None else (int(task["frames"][0]), int(task["frames"][1])),
            tuple(map(int, task["needs"])),
            float(task["cpu"]),
        )
        for task in content["tasks"]
    ]
    return FarmPlan(
        folder,
        tuple(tasks),
        tuple(FarmFilm(str(film["path"]), int(film["frames"])) for film in content["films"]),
        EngineChoice(**content["engine"]),
        str(content["cwd"]),
        int(content["tries"]),
        float(content["lease"]),
    )


def place_from(folder: Path) -> str:
    """Return this process's folder as seen from a farm's, so that both may be mounted elsewhere."""
    here = Path.cwd().resolve()
    try:
        return Path(os.path.relpath(here, folder.resolve())).as_posix()
    except ValueError:  # on another drive of Windows
        return here.as_posix()
