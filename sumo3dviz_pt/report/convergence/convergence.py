"""Measures error against run time of one picture of a scene, from beginning to end.

The order is: what the cheapest judged pictures leave of noise, a reference good enough
to judge them, presets, the ladder of spp, path depths. Every group of pictures goes to
`convergence.csv` as soon as it is measured, so that a stopped run goes on where it was.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.image.metrics import capped_rmse
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.metering import metered
from sumo3dviz_pt.pipeline.production import (
    Request,
    opened,
    prepare,
    ready_renderer,
    renderer_names,
)
from sumo3dviz_pt.pipeline.still import check_free
from sumo3dviz_pt.report.convergence import plan
from sumo3dviz_pt.report.convergence.ladder import (
    FLICKER,
    MeasuredSubject,
    film_flicker,
    pictures,
    rows_of,
)
from sumo3dviz_pt.report.convergence.page import (
    PAGE,
    PICTURES,
    PLOTS,
    REFERENCE,
    picture_name,
    write_results,
)
from sumo3dviz_pt.report.convergence.plan import (
    CAP,
    CHUNK,
    Halves,
    Reference,
    chunk_quality,
    finished,
    grow,
)
from sumo3dviz_pt.report.convergence.table import DEPTH, LADDER, TableRow, append_row, read_rows
from sumo3dviz_pt.report.machine import check_extra, machine

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Session


BETTER = 3.0
"""The halves of the reference differ by the error of independent samples of the highest rung,
divided by this. The reference itself, their mean, is then six times better than those samples,
and about three times better than pictures of the default sampler."""

ROWS, PLAN, HALVES = "convergence.csv", "plan.json", "reference.npz"


@dataclass(frozen=True, slots=True)
class ConvergenceOrder:
    """What `converge` is to measure.

    Attributes:
        folder: Where everything goes.
        time: SUMO's time of the picture [s].
        scene: The scene's name in tables.
        command: The command line, for the page.
        budget: Wall time after which no new work begins [s]; None is all it takes.
        top: Highest rung of the ladder [spp].
        overwrite: Whether a report that lies there is replaced, not gone on with.
    """

    folder: Path
    time: float
    scene: str
    command: str = ""
    budget: float | None = None
    top: int = plan.HIGHEST_RUNG
    overwrite: bool = False


@dataclass(slots=True)
class _ConvergenceRun:
    """How far a run is.

    Attributes:
        order: What was asked for.
        started: Clock when the run began [s].
        done: Work behind, that of earlier runs too [spp].
        total: All work [spp].
    """

    order: ConvergenceOrder
    started: float = field(default_factory=time.monotonic)
    done: float = 0.0
    total: float = 1.0

    @property
    def over(self) -> bool:
        """Whether the budget is spent."""
        budget = self.order.budget
        return budget is not None and time.monotonic() - self.started > budget

    def step(self, what: str, samples: float) -> None:
        """Count finished work [spp], and report how far all of it is."""
        self.done += samples
        done = round(min(self.done, self.total))
        announce(Doing.MEASURE, done, round(self.total), what=what)


def converge(job: Job, request: Request, order: ConvergenceOrder) -> Path:
    """Measure error against run time of one picture; return the report's page.

    Args:
        job: The scene file.
        request: Camera, size, variant; quality and spp do not matter.
        order: Where, when, how long.

    Raises:
        ConfigError: If the folder holds the report of something else, or a choice is wrong.
    """
    # Refuse what is wrong before any work.
    check_extra()
    if not 1 <= order.top <= 1024:
        raise ConfigError(f"must lie in 1..1024, not {order.top}", key="top")
    if order.budget is not None and not order.budget > 0:
        raise ConfigError(f"must be more than 0 seconds, not {order.budget:g}", key="budget")
    if not order.folder.parent.is_dir():
        raise ConfigError(f"there is no folder {order.folder.parent}; create it", key="output")
    if not (order.overwrite or (order.folder / PLAN).exists()):
        check_free(*_own(order.folder))
    # Build the shot, and begin anew or go on in the folder.
    together = ready_renderer(request.variant).jit
    # Frames before and after the measured one help it, and its neighbours.
    presets = plan.presets_up_to(order.top, together=together)
    reach = FLICKER + max(quality.accumulate for quality in presets.values())
    frames = order.time + np.arange(-reach, reach + 1) / float(job.output.fps)
    # The scene's own preset does not matter here, and so not for resuming either.
    quality = plan.base_quality(CHUNK).model_copy(update={"accumulate": int(together)})
    production = metered(replace(prepare(job, request, frames), quality=quality))
    order.folder.mkdir(exist_ok=True)
    if order.overwrite:
        for path in _own(order.folder):
            path.unlink(missing_ok=True)
    # Grow a reference, then measure every group against it.
    work = _ConvergenceRun(order)
    with opened(production) as session:
        states = tuple(production.frame_at(float(at)) for at in frames)
        subject = MeasuredSubject(
            order.scene, production, states, {**machine(), **renderer_names(session)}
        )
        made = _plan(session, subject, work)
        halves = _grown(session, subject, work, made)
        reference = finished(session, subject.state, halves)
        _keep_picture(order.folder, REFERENCE, reference.radiance)
        wanted = _groups(subject, made["top"])
        rows = _measured(session, subject, work, wanted, reference)
    count = sum(group.rows for group in wanted)
    return write_results(
        order.folder, subject, reference, rows, wanted=count, command=order.command
    )


def _own(folder: Path) -> list[Path]:
    """Return the files of a report, whether they exist or not."""
    names = (PLAN, ROWS, HALVES, PAGE, *PLOTS)
    return [*(folder / name for name in names), *(folder / PICTURES).glob("*.exr")]


# What to measure ----------------------------------------------------------------------------


def _plan(session: Session, subject: MeasuredSubject, work: _ConvergenceRun) -> dict[str, Any]:
    """Return the highest rung and the reference's target: stored, so that resuming keeps them."""
    path = work.order.folder / PLAN
    presets = plan.digest(_groups(subject, plan.HIGHEST_RUNG))
    what = {"key": subject.production.key, "time": work.order.time, "measured": presets}
    if path.exists():
        made: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if {name: made.get(name) for name in what} != what:
            raise ConfigError(
                f"{work.order.folder} holds the report of another scene, time, size or version;"
                " choose another folder, or --overwrite",
                key="output",
            )
    else:
        top = _affordable_top(session, subject, work)
        noise = _noise(session, subject, top)
        made = {**what, "top": top, "noise": noise, "target": noise / BETTER}
        write_atomically(path, json.dumps(made, indent=1))
    wanted = _groups(subject, made["top"])
    work.total = _samples(wanted) + _REFERENCE_SHARE * made["top"]
    return made


_REFERENCE_SHARE = 4 * BETTER**2
"""Samples of a reference for each of the highest rung's: the error of a half is that of the whole
times the square root of two, and the difference of two halves is that error times it again."""


def _groups(subject: MeasuredSubject, top: int) -> list[plan.SeedGroup]:
    """Return everything to measure up to a rung."""
    production = subject.production
    course = production.shot.data.weather
    return plan.groups(
        top,
        together=production.quality.accumulate > 0,
        weather=course is not None and course.is_seen,
    )


def _samples(wanted: list[plan.SeedGroup]) -> int:
    """Return the samples per pixel of all groups."""
    return sum(group.samples for group in wanted)


def _affordable_top(session: Session, subject: MeasuredSubject, work: _ConvergenceRun) -> int:
    """Return the highest rung that the budget allows for, by the pace of a few samples."""
    if work.order.budget is None:
        return work.order.top
    probe = plan.base_quality(4)
    for seed in (1, 2, 3):
        session.retune(probe, seed=seed)
        started = time.monotonic()
        session.samples(subject.state)
        pace = (time.monotonic() - started) / probe.spp
    for top in reversed(plan.rungs(work.order.top)):
        samples = _samples(_groups(subject, top)) + _REFERENCE_SHARE * top
        if pace * samples < work.order.budget:
            return top
    return 1


def _noise(session: Session, subject: MeasuredSubject, top: int) -> float:
    """Return the capped RMSE of independent samples, from two pictures that share nothing."""
    quality = plan.base_quality(top).model_copy(update={"sampler": "independent"})
    pair = []
    for seed in (901, 902):
        session.retune(quality, seed=seed)
        pair.append(session.samples(subject.state).layers["capped"])
    return float(capped_rmse(pair[0], pair[1], cap=np.inf) / np.sqrt(2.0))


# The reference ------------------------------------------------------------------------------


def _grown(
    session: Session, subject: MeasuredSubject, work: _ConvergenceRun, made: dict[str, Any]
) -> Halves:
    """Return the reference's halves: what is stored, and what is still missing."""
    path = work.order.folder / HALVES
    halves = Halves.load(path) if path.exists() else Halves()
    rest = _samples(_groups(subject, made["top"]))
    work.done = CHUNK * halves.chunks

    def on_chunk(chunks: int, difference: float) -> bool:
        needed = chunks * max(1.0, (difference / made["target"]) ** 2)
        work.total = rest + CHUNK * max(needed, chunks)
        work.step(f"reference, {CHUNK * chunks} spp", 2 * CHUNK)
        # Half of a budget at most: a reference alone says nothing.
        budget = work.order.budget
        return budget is None or time.monotonic() - work.started < 0.5 * budget

    session.retune(chunk_quality(plan.base_quality(CHUNK), depth=plan.DEEPEST, cap=CAP), seed=0)
    grow(session, subject.state, halves, target=made["target"], path=path, on_chunk=on_chunk)
    work.done = CHUNK * halves.chunks
    work.total = work.done + rest
    return halves


# Pictures -----------------------------------------------------------------------------------


def _measured(
    session: Session,
    subject: MeasuredSubject,
    work: _ConvergenceRun,
    wanted: list[plan.SeedGroup],
    reference: Reference,
) -> list[TableRow]:
    """Return the rows of all groups: what is stored, and what is still missing and affordable."""
    path = work.order.folder / ROWS
    rows = _whole_groups(path, wanted)
    for group in wanted:
        if any(group.owns(row) for row in rows):
            work.done += group.samples
            continue
        if work.over:
            break
        measured = _rows_of_group(session, subject, work, group, reference)
        for row in measured:
            append_row(path, row)
        rows += measured
    return rows


def _whole_groups(path: Path, wanted: list[plan.SeedGroup]) -> list[TableRow]:
    """Return the stored rows; drop those of an interrupted group from the file."""
    rows = read_rows(path)
    whole = [
        row
        for group in wanted
        if len(own := [row for row in rows if group.owns(row)]) == group.rows
        for row in own
    ]
    if len(whole) < len(rows):
        path.unlink()
        for row in whole:
            append_row(path, row)
    return whole


def _rows_of_group(
    session: Session,
    subject: MeasuredSubject,
    work: _ConvergenceRun,
    group: plan.SeedGroup,
    reference: Reference,
) -> list[TableRow]:
    """Measure one group."""
    label = f"{group.label} {group.quality.spp} spp"
    shown = pictures(session, subject, group, on_picture=lambda samples: work.step(label, samples))
    rows = list(rows_of(shown, subject, group, reference))
    _keep_picture(work.order.folder, picture_name(rows[0]), shown[0].radiance)
    if group.label not in (LADDER, DEPTH):
        rows[0]["flicker_mc"] = film_flicker(session, subject, group)
    return rows


def _keep_picture(folder: Path, name: str, radiance: Image) -> None:
    """Store a picture for crops and maps."""
    place = folder / PICTURES
    place.mkdir(exist_ok=True)
    write_exr(place / f"{name}.exr", {"radiance": radiance}, half=True)
