"""Renders films: frames are stored one by one, and the film is made from them."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.job.settings import Job, ShotSettings
from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.pipeline.accounts.build import film_account
from sumo3dviz_pt.pipeline.films.encoding import encode_frames
from sumo3dviz_pt.pipeline.films.frames import (
    NOTE,
    account_file,
    frame_file,
    frames_folder,
    masters_folder,
    write_json,
)
from sumo3dviz_pt.pipeline.films.orders import FilmOrder as FilmOrder
from sumo3dviz_pt.pipeline.films.orders import ShotFilm, shots_of, wanted_frames
from sumo3dviz_pt.pipeline.films.pace import Pace
from sumo3dviz_pt.pipeline.films.reuse import alone, check_unused, discard, missing_frames
from sumo3dviz_pt.pipeline.films.sequences import SUFFIX, check_sequence, is_sequence
from sumo3dviz_pt.pipeline.films.traced import write_traced
from sumo3dviz_pt.pipeline.pilot import piloted
from sumo3dviz_pt.pipeline.production import (
    Production,
    Request,
    check_target,
    check_tone,
    get_ready,
    opened,
    prepare,
    scenario_files,
)
from sumo3dviz_pt.pipeline.progress.costs import spent
from sumo3dviz_pt.pipeline.riders import check_companions
from sumo3dviz_pt.video.codecs import FILM_SUFFIXES as FILM_SUFFIXES

if TYPE_CHECKING:
    from sumo3dviz_pt.render.session import Session


@dataclass(frozen=True, slots=True)
class FrameDone:
    """How far a film is after a frame.

    Attributes:
        done: Frames that exist now.
        total: Frames that were asked for.
        seconds_left: Estimate of the wall time left [s].
        kept: True if the frame was there already.
        cpu: CPU-seconds by phase; empty if kept.
    """

    done: int
    total: int
    seconds_left: float
    kept: bool
    cpu: dict[str, float]


@dataclass(frozen=True, slots=True)
class FilmReport:
    """What was rendered for one shot.

    Attributes:
        film: The film, or None if only frames were asked for.
        folder: Where the frames are (were).
        frames: How many frames it has.
        cpu: CPU-seconds by phase; together all that it took.
    """

    film: Path | None
    folder: Path
    frames: int
    cpu: dict[str, float]


def render_film(
    job: Job,
    request: Request,
    order: FilmOrder,
    *,
    on_frame: Callable[[FrameDone], None] | None = None,
) -> list[FilmReport]:
    """Render all shots that were asked for.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.
        on_frame: Called after every frame.

    Raises:
        ConfigError: Before any work, if something that was asked for is wrong.
        InstallationError: Before any work, if the renderer cannot be loaded.
        RenderError: If a frame fails; finished frames are kept.
    """
    shots = check_order(job, request, order)
    check_places(job, order, shots)
    get_ready(job, request)
    if len(shots) > 1:  # a single shot is checked as soon as the log is read
        check_rides(job, order, shots)
    return [_render_shot(job, request, order, shot, path, on_frame) for shot, path in shots]


def check_order(job: Job, request: Request, order: FilmOrder) -> list[ShotFilm]:
    """Refuse an order that cannot be carried out, before any work is done.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Returns:
        Shots to render and where each film goes.

    Raises:
        ConfigError: If something that was asked for is wrong.
    """
    shots = shots_of(job, request, order)
    for shot, path in shots:
        check_target(path, suffixes=(*FILM_SUFFIXES, SUFFIX), overwrite=True)
        check_output(request.applied(job), path, fps=order.pace(job, shot).fps)
    return shots


def check_rides(job: Job, order: FilmOrder, shots: Sequence[ShotFilm]) -> None:
    """Refuse rides with road users that are not there; the log is searched once for each.

    Args:
        job: The scene file.
        order: Frame rate and speed.
        shots: Each with its film.

    Raises:
        ConfigError: Says when the log has them.
        InputError: If there is no log.
    """
    films = [(shot, order.pace(job, shot).times(shot)) for shot, _ in shots]
    check_companions(job, films, scenario_files(job).trajectories)


def check_places(job: Job, order: FilmOrder, shots: Sequence[ShotFilm]) -> None:
    """Refuse to overwrite what exists, unless the order says so.

    Args:
        job: The scene file.
        order: What may be kept or replaced.
        shots: Each with its film.

    Raises:
        ConfigError: If a film is being rendered there, or anything would be overwritten.
    """
    for shot, path in shots:
        check_unused(path, order, count=len(order.pace(job, shot).times(shot)))


def check_output(job: Job, path: Path, *, fps: Fraction) -> None:
    """Refuse what cannot be developed or encoded, before any work is done.

    Args:
        job: The scene file.
        path: The film, or its numbered pictures.
        fps: Frames per second.

    Raises:
        ConfigError: If tone curve, codec, size or frame rate are wrong.
    """
    from sumo3dviz_pt.video import check_film

    check_tone(job.output.tone)
    check_sequence(path)
    if is_sequence(path):
        return
    check_film(path, size=job.output.size, fps=fps, codec=job.output.codec)


def prepared(job: Job, request: Request, order: FilmOrder) -> Production:
    """Return the first shot that was asked for, ready to be rendered.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Raises:
        ConfigError: If something that was asked for is wrong.
        InputError: If a file is wrong.
    """
    shot, _ = shots_of(job, request, order)[0]
    get_ready(job, request)
    return piloted(_production(job, request, order, shot), request)


def _production(job: Job, request: Request, order: FilmOrder, shot: ShotSettings) -> Production:
    """Return a shot, ready to be rendered."""
    times = order.pace(job, shot).times(shot)
    return prepare(job, replace(request, camera=shot.camera), times, film=True)


def _render_shot(
    job: Job,
    request: Request,
    order: FilmOrder,
    shot: ShotSettings,
    path: Path,
    on_frame: Callable[[FrameDone], None] | None,
) -> FilmReport:
    """Render one shot's frames and make its film."""
    started, pace = spent(), order.pace(job, shot)
    wanted_frames(order.frames, len(pace.times(shot)))
    with nullcontext() if order.frames else alone(path):
        folder = frames_folder(path)
        production = _production(job, request, order, shot)
        production = piloted(production, request, folder=folder)
        wanted = wanted_frames(order.frames, len(production.times))
        folder.mkdir(exist_ok=True)
        shared = {**production.account, "shot": _shot(production, pace)}
        missing = missing_frames(production, folder, wanted, order, shared)
        write_json(folder / NOTE, shared, indent=1)
        cpu = _render_frames(production, folder, wanted, missing, shared, on_frame)
        if order.frames is not None:
            return FilmReport(None, folder, len(wanted), _with_rest(cpu, started))
        files = [frame_file(folder, number) for number in wanted]
        announce(Doing.ENCODE)
        masters = masters_folder(path) if order.final_exr else None
        if masters is not None:
            masters.mkdir(exist_ok=True)
        encode_frames(
            files, path, job=production.job, fps=pace.fps, key=production.key, masters=masters
        )
        whole = film_account(production, path.name, shared=shared, pace=pace.account())
        write_json(account_file(path), whole, indent=1)
        if order.discard_frames:
            discard(folder, wanted)
    return FilmReport(path, folder, len(wanted), _with_rest(cpu, started))


def _with_rest(cpu: Mapping[str, float], started: float) -> dict[str, float]:
    """Return the CPU-seconds by phase, and what no phase counts: files, the encoder's program."""
    return {**cpu, "rest": max(spent() - started - sum(cpu.values()), 0.0)}


def _shot(production: Production, pace: Pace) -> dict[str, Any]:
    """Return a film's window as its frames tell it."""
    times = production.times
    return {"from": float(times[0]), **pace.account(), "frames": len(times)}


def _render_frames(
    production: Production,
    folder: Path,
    wanted: Sequence[int],
    missing: Sequence[int],
    shared: Mapping[str, Any],
    on_frame: Callable[[FrameDone], None] | None,
) -> dict[str, float]:
    """Render the frames that are missing; CPU-seconds by phase."""
    total: dict[str, float] = {"read": production.reading}
    kept = len(wanted) - len(missing)
    if kept and on_frame is not None:
        on_frame(FrameDone(kept, len(wanted), 0.0, kept=True, cpu={}))
    if not missing:
        return total
    with opened(production, together=len(production.times) > 1) as session:
        started = time.monotonic()
        announce(Doing.RENDER, kept, len(wanted))
        for count, number in enumerate(missing, start=1):
            cpu = _render_frame(production, session, folder, number, shared)
            for phase, seconds in cpu.items():
                total[phase] = total.get(phase, 0.0) + seconds
            announce(Doing.RENDER, kept + count, len(wanted))
            if on_frame is not None:
                pace = (time.monotonic() - started) / count
                left = pace * (len(missing) - count)
                on_frame(FrameDone(kept + count, len(wanted), left, kept=False, cpu=cpu))
    return total


def _render_frame(
    production: Production, session: Session, folder: Path, number: int, shared: Mapping[str, Any]
) -> dict[str, float]:
    """Render and store one frame; CPU-seconds by phase."""
    from sumo3dviz_pt.image.exr import PROVENANCE, write_exr

    at = float(production.times[number])
    frame, path = production.shot.frame_at(at), frame_file(folder, number)
    half = production.job.output.half
    samples = session.samples(frame)
    account = {
        **shared,
        "frame": number,
        "time": at,
        "capped_share": round(samples.tally.capped_share, 6),
        "nonfinite": samples.tally.nonfinite,
        "stored": "traced" if "ids" in samples.layers else "finished",
    }
    if "ids" in samples.layers:
        write_traced(path, samples, frame, session=session, account=account, half=half)
    else:
        finished = {"radiance": session.finish(samples, frame)}
        text = json.dumps(account, sort_keys=True)
        write_exr(path, finished, half=half, attributes={PROVENANCE: text})
    return dict(session.clock.seconds)
