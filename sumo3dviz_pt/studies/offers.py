"""Says before any pixel is rendered which vehicles arrive in films, and which gaps they offer.

It says so for cameras that stand beside a road and for the observers that the study file names. All
comes from the motion that will be drawn, by the code that measures finished films.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.sessions import CAMERA
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.pipeline.accounts import camera_account
from sumo3dviz_pt.pipeline.changed_traffic import shows
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.traffic import plain_id
from sumo3dviz_pt.shot.cameras.aiming import alone
from sumo3dviz_pt.studies.kerb.pairs import SEEN_FAR, ahead_of, passages
from sumo3dviz_pt.studies.kerb.place import Kerb
from sumo3dviz_pt.studies.measured.observer import Observer, way_across
from sumo3dviz_pt.studies.measured.offered import Watched, watched_by
from sumo3dviz_pt.studies.measured.traffic import Row, Simulated, Traffic, simulated
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.stimuli import Stimulus

_MOST_FILMS, _MOST_ROWS = 40, 12
"""Films, and arrivals of a film, that are listed."""

_FILMS_CAMERA = "the film's camera"
"""What people call the observer that every film has."""

_UNSEEN = 0.5
"""A vehicle that is in the picture for a shorter time before it arrives comes from outside [s]."""


@dataclass(frozen=True, slots=True)
class Offer:
    """What a film offers to people who wait.

    Attributes:
        rows: Vehicles that arrive while it is shown.
        notes: What people would wonder at, in sentences.
    """

    rows: tuple[Row, ...]
    notes: tuple[str, ...]


def offers_of(plan: StudyPlan) -> dict[str, Offer]:
    """Return what films offer to standing observers, by name; of films without any, nothing."""
    known: dict[str, Offer | None] = {}
    offers = {}
    for stimulus in plan.listed[:_MOST_FILMS]:
        job, shot = stimulus.job, stimulus.shot
        key = repr((job.scenario, job.traffic, job.motion, shot, job.cameras[shot.camera]))
        if key not in known:
            try:
                known[key] = _offer(plan, stimulus)
            except InputError as error:  # said again where films are made
                known[key] = Offer((), (f"which vehicles arrive cannot be told: {error}",))
        offer = known[key]
        if offer is not None:
            offers[stimulus.name] = offer
    return offers


def _offer(plan: StudyPlan, stimulus: Stimulus) -> Offer | None:
    """Return what a film offers; None if nobody waits in it."""
    job, settings = stimulus.job, plan.file.settings.report
    camera = job.cameras[stimulus.shot.camera]
    if camera.stands_at is None:
        return None
    times = Pace.of(job, stimulus.shot).times(stimulus.shot)
    also = [each.position for each in settings.observers.values() if each.position is not None]
    near = np.array([camera.stands_at[:2], *also], dtype=float)
    simulation = simulated(stimulus, near, count=len(times))
    network = simulation.scenario.network
    if way_across(near[0], network) is None and not also:
        return None
    speed = float(Pace.of(job, stimulus.shot).speed)
    view = alone(camera, network.location).view_at(float(times[0]))
    frames = [camera_account(view, network.location)] * len(times)
    _, watched = watched_by(simulation, frames, settings, near=near, speed=speed)
    rows = tuple(
        row
        for each in watched
        if each.observer.stands
        for row in each.rows
        if float(row["arrives"]) <= times[-1]
    )
    braking = _braking(job, simulation, watched[0].observer)
    return Offer(rows, (*_unseen(rows), *_popping(simulation.traffic, watched[0], speed), *braking))


def _unseen(rows: Sequence[Row]) -> Iterator[str]:
    """Yield vehicles that come to the camera's way across from outside of the picture."""
    for row in rows:
        if row["observer"] == CAMERA and float(row["in_picture"]) < _UNSEEN:
            yield (
                f"{plain_id(str(row['road_user']))} arrives from the {row['from']} after"
                f" {float(row['arrives_in_film']):.1f} s, from outside of the picture (in it for"
                f" {float(row['in_picture']):.1f} s before): leave it out, take a wider lens, or"
                " turn the camera"
            )


def _popping(traffic: Traffic, watched: Watched, speed: float) -> Iterator[str]:
    """Yield vehicles that appear in the picture out of nothing, or vanish there."""
    for k, shown in watched.shown.items():
        alive = np.flatnonzero(traffic.alive[k])
        if not alive.size:
            continue
        ends = (
            ("appears", alive[0], alive[0] > 0),
            ("vanishes", alive[-1], not traffic.alive[k, -1]),
        )
        for what, n, is_within in ends:
            away = float(np.linalg.norm(traffic.fronts[k, n] - watched.observer.eyes[n]))
            if is_within and shown[n] and away < SEEN_FAR:
                when = float(traffic.times[n] - traffic.times[0]) / speed
                yield (
                    f"{plain_id(traffic.keys[k])} {what} in sight after {when:.1f} s, {away:.0f} m"
                    " away: its ride begins or ends there; take another pair, or a place farther"
                    " from where rides begin"
                )


def _braking(job: Job, simulation: Simulated, observer: Observer) -> Iterator[str]:
    """Yield vehicles of a changed gap that brake, and what people will see them brake for."""
    if job.traffic is None or observer.across is None:
        return
    names = {plain_id(name) for name in job.traffic.rides}
    names |= {plain_id(edit.behind) for edit in job.traffic.rides.values() if edit.behind}
    if not names:
        return
    recorded = job.model_copy(update={"traffic": None})
    _, scenario = read_files(recorded)
    way = np.array(observer.across[0])
    kerb = Kerb(way[0], way, 0.0, "")
    motion, shown = motion_of(recorded, scenario), shows(job)
    for each in passages(recorded, scenario, kerb):
        if each.id not in names or not each.brakes:
            continue
        moment = each.slows if np.isfinite(each.slows) else each.arrives
        ahead = ahead_of(motion, scenario, kerb.position, each.id, moment)
        yield f"{each.id} brakes near the kerb{_reason(ahead, names, shown('vehicle', ahead))}"


def _reason(ahead: str, names: set[str], is_shown: bool) -> str:
    """Return which vehicle another one brakes for, and why people would wonder."""
    if not ahead:
        return ", with no vehicle ahead: for a signal or a turn, or as its driver likes"
    if not is_shown:
        return f" for {ahead}, which is left out: people see no reason why it brakes"
    if ahead in names:
        return f" for {ahead}, and it is as far behind as the gap says, not as recorded"
    return f" for {ahead}"


def offer_lines(offers: Mapping[str, Offer]) -> list[str]:
    """Return a table of the vehicles that arrive in films, for people; nothing without offers.

    Where they arrive is told row by row only if that is not the film's camera alone.
    """
    observers = {str(row["observer"]) for offer in offers.values() for row in offer.rows}
    if not observers:
        return []
    several = observers != {CAMERA}
    head = ("film", "at", "vehicle", "from", "arrives", "leaves", "gap before", "in picture")
    cells: list[tuple[str, ...]] = [head]
    for name, offer in offers.items():
        cells += [_cells(name, row) for row in offer.rows[:_MOST_ROWS]]
        if len(offer.rows) > _MOST_ROWS:
            more = f"and {len(offer.rows) - _MOST_ROWS} more"
            cells.append((name, "", more, *[""] * 5))
    cells = cells if several else [(first, *rest) for first, _, *rest in cells]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [f"  {'  '.join(map(str.ljust, row, widths)).rstrip()}" for row in cells]
    where = "" if several else f" at {_FILMS_CAMERA}"
    title = f"vehicles that arrive{where}, by the film's time, and the gap over all lanes [s]"
    return [title, *lines, ""]


def _cells(name: str, row: Row) -> tuple[str, ...]:
    """Return a row's cells."""
    numbers = ("arrives_in_film", "leaves_in_film", "gap_before", "in_picture")
    cells = ["-" if row[key] == "" else f"{float(row[key]):.2f}" for key in numbers]
    vehicle = plain_id(str(row["road_user"]))
    observer = _FILMS_CAMERA if row["observer"] == CAMERA else str(row["observer"])
    return (name, observer, vehicle, str(row["from"]), *cells)


def offer_notes(offers: Mapping[str, Offer]) -> list[str]:
    """Return what people would wonder at, each once, with the films in which it is."""
    where: dict[str, list[str]] = {}
    for name, offer in offers.items():
        for note in offer.notes:
            where.setdefault(note, []).append(name)
    return [f"{note} (film {', '.join(films)})" for note, films in where.items()]
