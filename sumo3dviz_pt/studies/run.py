"""Renders the films of a study that are not there yet, one by one, and writes what goes with them.

What a study shows and what is to be done for it is said in words before. When all films are there,
`finish_study` measures them (certificate, stimulus report), writes the files of tools and the
digests of all that lies in the folder.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

from pydantic import Field

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.errors import settle
from sumo3dviz_pt.job.values import Target
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.pipeline.costs import time_in_words
from sumo3dviz_pt.pipeline.films.film import check_output, check_rides, prepared, render_film
from sumo3dviz_pt.pipeline.films.frames import frame_file, frame_numbers, frames_folder
from sumo3dviz_pt.pipeline.films.orders import FilmOrder, ShotFilm
from sumo3dviz_pt.pipeline.films.reuse import discard
from sumo3dviz_pt.pipeline.production import Request, check_choices
from sumo3dviz_pt.pipeline.reading import check_known, scenario_files
from sumo3dviz_pt.studies.certificate.acts import key_of
from sumo3dviz_pt.studies.certificate.certificate import Certificate, certify, seal_folder
from sumo3dviz_pt.studies.certificate.evidence import compared_frames
from sumo3dviz_pt.studies.designs.profiles import in_words as design_in_words
from sumo3dviz_pt.studies.folder import check_study_inputs, write_study_inputs
from sumo3dviz_pt.studies.foresight import foresight
from sumo3dviz_pt.studies.measured.report import report_study
from sumo3dviz_pt.studies.methods import write_methods
from sumo3dviz_pt.studies.offers import offer_lines, offer_notes, offers_of
from sumo3dviz_pt.studies.outputs import cards_of, write_outputs
from sumo3dviz_pt.studies.plan import StudyPlan, cost_of_film, forecast, frames_of
from sumo3dviz_pt.studies.records import (
    MATERIALS,
    FilmRecord,
    film_path,
    finished_films,
    lacking_layers,
    read_film_account,
    record_of,
    why_anew,
    write_part,
    write_record,
)
from sumo3dviz_pt.studies.stimuli import Stimulus, possible_pairs

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class StudyOrder:
    """What `study` is to make.

    Attributes:
        folder: Of all that comes out.
        resume: Whether films and frames that fit are kept, and all others replaced.
        overwrite: Whether films and frames that exist are replaced.
        discard_frames: Whether frames go as soon as nothing needs them; those that a certificate
            or a report measures stay.
        variant: The renderer's.
        command: The command line; empty from Python.
    """

    folder: Target
    resume: bool = False
    overwrite: bool = False
    discard_frames: bool = False
    variant: str = "llvm"
    command: Annotated[str, Field(max_length=1_000_000)] = ""

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)


@dataclass(frozen=True, slots=True)
class FilmTask:
    """A film to render.

    Attributes:
        stimulus: What it shows.
        request: The renderer's variant.
        order: Where it goes.
    """

    stimulus: Stimulus
    request: Request
    order: FilmOrder


def check_study(plan: StudyPlan, order: StudyOrder) -> None:
    """Refuse a study that cannot be carried out, before any film is rendered.

    Raises:
        ConfigError: If a choice of some level does not exist, a film cannot be encoded, a ride's
            road user is not there, films would be overwritten, or the variant has no layers for
            a certificate or a report.
        InputError: If there is no log.
    """
    if order.folder.exists() and not order.folder.is_dir():
        raise ConfigError(f"{order.folder} is a file; give a folder", key="output")
    if order.variant == "scalar" and plan.measured:
        raise ConfigError(
            "the variant scalar traces no layers, which certificates and reports measure: take"
            " llvm, or say certificate: {write: false} and report: {write: false} in the study"
            " file",
            key="certificate" if plan.file.settings.certificate.write else "report",
        )
    rides = set()
    for stimulus in plan.stimuli:
        path = film_path(order.folder, plan, stimulus)
        request = Request(variant=order.variant)
        check_choices(stimulus.job, request)
        # The study's folder need not be there yet; the study file's is.
        there = plan.file.path.absolute().with_name(path.name)
        check_output(stimulus.job, there, fps=stimulus.job.output.fps)
        camera = stimulus.job.cameras[stimulus.shot.camera]
        if camera.rides_with:
            ride = (camera.rides_with, stimulus.shot, stimulus.job.scenario)
            if repr(ride) not in rides:
                rides.add(repr(ride))
                check_rides(stimulus.job, FilmOrder(path), [ShotFilm(stimulus.shot, path)])
    _check_observers(plan)
    _check_places(plan, order)
    check_study_inputs(order.folder, plan)


def film_tasks(plan: StudyPlan, order: StudyOrder) -> list[FilmTask]:
    """Return the films that are to be rendered; with `resume`, only those that are not there."""
    done = finished_films(order.folder, plan, variant=order.variant) if order.resume else {}
    if all(stimulus.name in done for stimulus in plan.stimuli):
        return []
    if order.resume:
        _tell_lacking(lacking_layers(order.folder, plan, variant=order.variant))
    request = shared_request(plan, order)
    return [
        FilmTask(
            stimulus,
            request,
            FilmOrder(
                film_path(order.folder, plan, stimulus),
                resume=not order.overwrite,
                overwrite=order.overwrite,
                # Frames that are measured stay until all films are there.
                discard_frames=order.discard_frames and not plan.measured,
            ),
        )
        for stimulus in plan.stimuli
        if stimulus.name not in done
    ]


def _tell_lacking(films: Mapping[str, Sequence[str]]) -> None:
    """Say that films are rendered again for nothing but their layers."""
    if films:
        names, layers = sorted(films), dict.fromkeys(one for some in films.values() for one in some)
        log.warning(
            "%s (the first is %s): rendered again for %s, which the study asks for now and which"
            " do not lie beside them; the films stay as they are",
            f"{len(names)} films" if len(names) > 1 else "1 film",
            names[0],
            " and ".join(filter(None, [", ".join([*layers][:-1]), [*layers][-1]])),
        )


def shared_request(plan: StudyPlan, order: StudyOrder) -> Request:
    """Return the request of all films of a study: one exposure, where they share one.

    Args:
        plan: Of all films, because the first of them that wants it is metered.
        order: The renderer's variant.
    """
    request = Request(variant=order.variant, command=order.command)
    return replace(request, metered=_shared_exposure(plan, request))


def _shared_exposure(plan: StudyPlan, request: Request) -> float | None:
    """Return the exposure that all films of a study share [EV]; None where none is to be metered.

    It is metered on the first film whose camera wants that, whatever films are there already.
    """
    if plan.file.settings.exposure != "shared":
        return None
    for stimulus in plan.stimuli:
        exposure = stimulus.job.cameras[stimulus.shot.camera].exposure
        if exposure is not None and exposure.mode == "auto":
            order = FilmOrder(Path("metered.mp4"))
            return prepared(stimulus.job, request, order).metered
    return None


def render_task(plan: StudyPlan, order: StudyOrder, task: FilmTask) -> FilmRecord:
    """Render one film, and note it in the study's record, so that nothing is lost.

    Raises:
        ConfigError, InputError, RenderError: As `render_film`; finished films and frames are kept.
    """
    folder = order.folder
    (folder / MATERIALS).mkdir(parents=True, exist_ok=True)
    films = finished_films(folder, plan, variant=order.variant, hashed=False)
    films.pop(task.stimulus.name, None)
    write_record(folder, plan, films)
    render_film(task.stimulus.job, task.request, task.order)
    record = record_of(task.order.path, task.stimulus, variant=order.variant)
    write_record(folder, plan, {**films, task.stimulus.name: record})
    return record


def film_part(
    plan: StudyPlan, order: StudyOrder, name: str, frames: tuple[int, int] | None
) -> FilmTask:
    """Return what is to be rendered of one film of a study: the same as with all others.

    Args:
        plan: Of all films.
        order: Where it goes, and what may be kept or replaced.
        name: The film's.
        frames: First and after-last frame; None makes the film.

    Raises:
        ConfigError: If there is no film of that name.
    """
    (stimulus,) = plan.only(name).stimuli
    return FilmTask(
        stimulus,
        shared_request(plan, order),
        FilmOrder(
            film_path(order.folder, plan, stimulus),
            frames=frames,
            resume=order.resume,
            overwrite=order.overwrite,
        ),
    )


def render_part(order: StudyOrder, task: FilmTask) -> None:
    """Render some frames of a film, or make it and note it, beside others on other machines.

    Raises:
        ConfigError, InputError, RenderError: As `render_film`; finished frames are kept.
    """
    (order.folder / MATERIALS).mkdir(parents=True, exist_ok=True)
    render_film(task.stimulus.job, task.request, task.order)
    if task.order.frames is None:
        record = record_of(task.order.path, task.stimulus, variant=order.variant)
        write_part(order.folder, task.stimulus.name, record)


@dataclass(frozen=True, slots=True)
class FinishedStudy:
    """What goes with the films of a study.

    Attributes:
        files: All files that were written.
        certificate: What was found on its pairs; None where none was wanted.
    """

    files: tuple[Path, ...]
    certificate: Certificate | None


def finish_study(plan: StudyPlan, order: StudyOrder) -> FinishedStudy:
    """Measure finished films, and write all that goes with them.

    Raises:
        ConfigError: If a film is missing.
    """
    folder = order.folder
    films = finished_films(folder, plan, variant=order.variant)
    missing = [stimulus.name for stimulus in plan.stimuli if stimulus.name not in films]
    if missing:
        raise ConfigError(
            f"{len(missing)} films are missing, the first is {missing[0]}; go on with --resume",
            key="output",
        )
    plan = replace(plan, notes=(*plan.notes, *_unseen(plan, films)))
    record = write_record(folder, plan, films)
    inputs = write_study_inputs(folder, plan, variant=order.variant)
    cards = cards_of(folder, plan, films)
    wanted = plan.file.settings.certificate.write
    certificate = certify(folder, plan, cards=[*cards.values()]) if wanted else None
    measured = certificate.files if certificate else ()
    if plan.file.settings.report.write:
        measured += report_study(folder, plan)
    methods = write_methods(folder, plan, films, certificate=certificate)
    if order.discard_frames:
        _discard_frames(folder, plan)
    seal = None if certificate is None else partial(seal_folder, folder, certificate)
    also = [record, *inputs, *measured, methods]
    files = write_outputs(folder, plan, films, cards=cards, also=also, seal=seal)
    return FinishedStudy(tuple(files), certificate)


def _discard_frames(folder: Path, plan: StudyPlan) -> None:
    """Remove the frames of films, but those that are measured: that may be done again."""
    compared = plan.file.settings.certificate.frames
    for stimulus in plan.stimuli:
        film = film_path(folder, plan, stimulus)
        frames = frames_folder(film)
        numbers = frame_numbers(frames)
        # Pictures that overlays put before and after a film are no frames of it.
        count = len(read_film_account(film)["frames"])
        kept = compared_frames(count, compared) if plan.measured else []
        if kept:
            for number in {*numbers} - {*kept}:
                frame_file(frames, number).unlink()
        elif numbers:
            discard(frames, numbers)


def _unseen(plan: StudyPlan, films: Mapping[str, FilmRecord]) -> list[str]:
    """Return which pairs are the same film, byte by byte: what differs is not in the picture."""
    notes = [
        f"{pair.one} and {pair.other} are the same film: what {pair.factor} changes is not seen"
        for pair in plan.pairs
        if films[pair.one].sha256 == films[pair.other].sha256
    ]
    for note in notes:
        log.warning("%s", note)
    return notes


def _check_observers(plan: StudyPlan) -> None:
    """Refuse observers of the report that no log ever has."""
    report = plan.file.settings.report
    for name, each in report.observers.items() if report.write else ():
        if each.road_user is not None:
            with plan.file.blamed("report", "observers", name, "road_user"):
                check_known(each.road_user, scenario_files(plan.stimuli[0].job).trajectories)


def _check_places(plan: StudyPlan, order: StudyOrder) -> None:
    """Refuse to overwrite films that exist, unless the order says so."""
    if order.resume or order.overwrite:
        return
    for stimulus in plan.stimuli:
        path = film_path(order.folder, plan, stimulus)
        if path.exists() or path.with_suffix(".frames").exists():
            raise ConfigError(
                f"{path} exists already, or frames of it: --resume keeps what fits, --overwrite"
                " replaces all",
                key="output",
            )


_MOST_ROWS = 40
"""Most films, and pairs of a factor, that are listed one by one."""


def in_words(plan: StudyPlan, order: StudyOrder) -> str:
    """Return what a study shows, what is there of it, and what the rest costs."""
    done = finished_films(order.folder, plan, variant=order.variant)
    todo = [stimulus for stimulus in plan.stimuli if stimulus.name not in done]
    there = f"there    {len(done)} of {_many(len(plan.stimuli), 'film')} in {order.folder}"
    anew = why_anew(order.folder, plan, variant=order.variant)
    again = [f"anew     {name}: {why}" for name, why in anew.items()]
    rest = [f"anew     and {len(again) - _MOST_ROWS} more"] if len(again) > _MOST_ROWS else []
    return plan_in_words(plan, todo, there, *again[:_MOST_ROWS], *rest)


def plan_in_words(plan: StudyPlan, todo: Sequence[Stimulus], *more: str) -> str:
    """Return what a study shows, what differs between its films, and what they cost.

    Args:
        plan: The study's.
        todo: The films that are to be rendered.
        more: Lines before the cost.
    """
    names = {stimulus.name for stimulus in todo}
    offers = offers_of(plan)
    design = plan.file.settings.design
    kind = design if isinstance(design, str) else f"{design.form} table {design.table.name}"
    several = max(len(trial.alternatives) for trial in plan.trials)
    choice = f" of up to {several} alternatives" if several > 1 else ""
    lines = [
        f"{plan.file.path}: design {kind}, {_many(len(plan.profiles), 'profile')} in"
        f" {_many(len(plan.trials), 'trial')}{choice}, {_many(len(plan.playlists), 'playlist')}",
        "",
        "factors",
        *(f"  {name:<16} {', '.join(levels)}" for name, levels in plan.file.levels.items()),
        "",
        *design_in_words(plan.file.levels, plan.designed, plan.priors),
        "",
        "films",
        *(_film(each, there=each.name not in names) for each in plan.listed[:_MOST_ROWS]),
        *_rest(len(plan.stimuli)),
        "",
        f"pairs that are compared, {len(plan.pairs)} of {possible_pairs(plan.stimuli)}, and in what"
        " they differ",
        *_pairs(plan),
        "",
        *offer_lines(offers),
        *(f"note: {note}" for note in (*plan.notes, *foresight(plan), *offer_notes(offers))),
        *more,
        f"cost     {forecast(plan, todo)}",
    ]
    return "\n".join(lines)


def _film(stimulus: Stimulus, *, there: bool) -> str:
    """Return a row about a film."""
    width, height = stimulus.job.output.size
    shot = f"{stimulus.shot.camera} {stimulus.shot.start:.12g} to {stimulus.shot.end:.12g} s"
    work = (
        "is there"
        if there
        else f"about {time_in_words(3600 * cost_of_film(stimulus).cpu_hours)} of CPU time"
    )
    return (
        f"  {stimulus.name:<32} {shot}, {counted(frames_of(stimulus), 'frame')}, {width}x{height},"
        f" {stimulus.job.quality}; {work}"
    )


def _pairs(plan: StudyPlan) -> list[str]:
    """Return rows about pairs: by factor, how many, and the settings that differ."""
    lines = []
    for factor in plan.factors:
        own = [pair for pair in plan.pairs if pair.factor == factor]
        more = sum(factor in pair.factors for pair in plan.pairs) - len(own)
        keys = dict.fromkeys(key_of(change) for pair in own for change in pair.changed)
        words = [f"{_many(len(own), 'pair')}: {', '.join(keys) or 'nothing'}"] if own else []
        words += [f"{_many(more, 'pair')} together with others"] if more else []
        lines.append(f"  {factor:<16} {', '.join(words) or '0 pairs: nothing'}")
    return lines


def _rest(count: int) -> list[str]:
    """Return how many rows are left out."""
    return [f"  and {count - _MOST_ROWS} more"] if count > _MOST_ROWS else []


def _many(count: int, what: str) -> str:
    """Return a number of things in words."""
    return f"1 {what}" if count == 1 else f"{count} {what}s"
