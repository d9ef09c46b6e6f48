"""Plans a study: which trials show which films, what is to be rendered, and what it costs.

Costs of films, layers and measurements are forecast before anything starts. The constants are from
`crossing` at 640x360 on a shared server, see docs/internals/forecasts.md; machines differ by a
factor of two.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.job.study import ChoiceSettings, Patch, TableSettings
from sumo3dviz_pt.pipeline.conditions import film_cost, forecast_factor
from sumo3dviz_pt.pipeline.costs import (
    TYPICAL_TRIANGLES,
    Cost,
    layers_cost,
    space_in_words,
    time_in_words,
)
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.reading import scenario_files, stamps_of
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.studies.designs.arrays import same_in_words
from sumo3dviz_pt.studies.designs.cells import read_table
from sumo3dviz_pt.studies.designs.profiles import (
    MOST_PROFILES,
    ChoiceRequest,
    Priors,
    build_design,
    choice_tasks,
    d_error,
    is_excluded,
)
from sumo3dviz_pt.studies.designs.tables import TableRequest, trials_in
from sumo3dviz_pt.studies.designs.trials import (
    TURNED,
    Playlist,
    Profile,
    Trial,
    build_playlists,
    dominated,
    most_placed,
    profiles_of,
    single_trials,
    uneven,
    uneven_groups,
    with_even_places,
)
from sumo3dviz_pt.studies.file import StudyFile
from sumo3dviz_pt.studies.stimuli import (
    Stimulus,
    StimulusPair,
    build_stimuli,
    check_patches,
    pairs_of,
    told_only,
)


@dataclass(frozen=True)
class StudyPlan:
    """A study that was thought through; nothing is rendered for it.

    Attributes:
        file: The study file.
        trials: What is seen together, of all blocks.
        stimuli: The films, each once.
        playlists: Who sees what in which order.
        notes: What there is to know of the design, in sentences.
        overrides: Values of the scene file that won over all others, beside the study file's own.
    """

    file: StudyFile
    trials: tuple[Trial, ...]
    stimuli: tuple[Stimulus, ...]
    playlists: tuple[Playlist, ...]
    notes: tuple[str, ...]
    overrides: Patch = field(default_factory=dict)

    @property
    def factors(self) -> tuple[str, ...]:
        """Names, in the order of profiles."""
        return tuple(self.file.settings.factors)

    @property
    def measured(self) -> bool:
        """Whether films are measured when all are there: for a certificate, or a report."""
        return self.file.settings.certificate.write or self.file.settings.report.write

    @property
    def priors(self) -> Priors:
        """Utilities of levels that the study assumes."""
        choices = self.file.settings.choices
        return choices.priors if choices else {}

    @property
    def designed(self) -> tuple[Trial, ...]:
        """Trials as the design has them, without those whose films only changed places."""
        return tuple(trial for trial in self.trials if TURNED not in trial.task)

    @cached_property
    def profiles(self) -> tuple[Profile, ...]:
        """Every combination of levels that is shown, once."""
        return profiles_of(self.trials)

    @cached_property
    def films(self) -> Mapping[Profile, Stimulus]:
        """The film of each profile."""
        return {profile: each for each in self.stimuli for profile in each.profiles}

    @cached_property
    def listed(self) -> tuple[Stimulus, ...]:
        """The films as people read of them: by levels, however the design was shuffled."""
        return tuple(sorted(self.stimuli, key=lambda each: min(map(self.place, each.profiles))))

    def place(self, profile: Profile) -> tuple[int, ...]:
        """Return the place of each of a profile's levels in the study file, by which one sorts."""
        levels = self.file.levels.values()
        return tuple(list(own).index(level) for own, level in zip(levels, profile, strict=True))

    @cached_property
    def pairs(self) -> tuple[StimulusPair, ...]:
        """Films that are compared: they should differ in their factors only."""
        worded = [name for name in self.factors if told_only(self.file, name)]
        return pairs_of(self.file.levels, self.stimuli, worded=worded)

    def only(self, name: str) -> StudyPlan:
        """Return the plan of one of its films.

        Raises:
            ConfigError: If there is none of that name; suggests one.
        """
        known = {each.name: each for each in self.stimuli}
        if name not in known:
            raise ConfigError(f"no film is called {name!r}{did_you_mean(name, known)}", key="film")
        return replace(self, stimuli=(known[name],))


_TRIAL_WIDTH, _TRIAL_RATE = 320, 5
"""Largest width [px] and frames per second of films to try the way with."""


def trial_values(study: StudyFile, overrides: Patch) -> dict[str, Any]:
    """Return values of the scene file for coarse films that cost little; overrides win over them.

    Args:
        study: The study file.
        overrides: As `plan_study` takes them.

    Raises:
        ConfigError, InputError: As `plan_study`.
    """
    width, height = plan_study(study, overrides).stimuli[0].job.output.size
    if width > _TRIAL_WIDTH:
        width, height = _TRIAL_WIDTH, max(2 * round(height * _TRIAL_WIDTH / width / 2), 2)
    size, rate = [width, height], _TRIAL_RATE
    return {"quality": "draft", "output.size": size, "output.fps": rate, **overrides}


def plan_study(study: StudyFile, overrides: Patch | None = None) -> StudyPlan:
    """Return what a study shows.

    Args:
        study: The study file.
        overrides: Values of the scene file that win over all others.

    Raises:
        ConfigError: If a level or the design is wrong; names its place in the study file.
        InputError: If a table is wrong, or the simulation's files are not there.
    """
    check_patches(study, overrides)
    trials, notes = _trials(study)
    stimuli = build_stimuli(study, profiles_of(trials), overrides)
    settings = study.settings.playlists
    with study.blamed():
        even = settings.places == "balanced"
        most = most_placed(trials) if even else 1
        playlists = build_playlists(
            trials,
            order=settings.order,
            count=None if settings.count is None else -(-settings.count // most),
            parts=settings.parts,
            repeat=settings.repeat,
            seed=study.settings.seed,
        )
        if even:
            playlists = with_even_places(playlists, count=settings.count, seed=study.settings.seed)
    notes = (*notes, *_hidden(study, stimuli), *_playlist_notes(study, playlists))
    # Tasks whose films changed places are trials of their own.
    shown = (trial for playlist in playlists for trial in playlist.trials)
    return StudyPlan(
        study,
        tuple(dict.fromkeys((*trials, *shown))),
        stimuli,
        playlists,
        notes,
        dict(overrides or {}),
    )


def _trials(study: StudyFile) -> tuple[tuple[Trial, ...], tuple[str, ...]]:
    """Return the trials of a design, and notes on it."""
    settings = study.settings
    if isinstance(settings.design, TableSettings):
        return _tabled(study, settings.design)
    if settings.choices is not None:
        return _chosen(study, settings.choices)
    with study.blamed():
        design = build_design(
            settings.design, study.levels, exclude=settings.exclude, seed=settings.seed
        )
    gone = (f"{design.excluded} profiles are excluded",) if design.excluded else ()
    return single_trials(design.profiles), (*gone, *design.notes)


def _chosen(study: StudyFile, wanted: ChoiceSettings) -> tuple[tuple[Trial, ...], tuple[str, ...]]:
    """Return choice tasks, and notes on them."""
    ranks = {name: own for name, own in zip(study.levels, study.ranks, strict=False) if own}
    request = ChoiceRequest(wanted.tasks, wanted.alternatives, wanted.none, wanted.priors, ranks)
    settings = study.settings
    with study.blamed():
        trials = choice_tasks(study.levels, request, exclude=settings.exclude, seed=settings.seed)
    error = d_error(study.levels, trials, wanted.priors)
    basis = "the priors" if wanted.priors else "utilities of 0"
    return trials, (f"{len(trials)} choice tasks have a D-error of {error:.4g}, for {basis}",)


def _tabled(study: StudyFile, table: TableSettings) -> tuple[tuple[Trial, ...], tuple[str, ...]]:
    """Return the trials of another tool's table, and notes on it."""
    request = TableRequest(
        form=table.form,
        columns=table.columns,
        codes=table.codes,
        alternatives=table.alternatives,
        task=table.task,
        alternative=table.alternative,
        block=table.block,
        none=table.none,
        coding=table.coding,
    )
    with study.blamed():
        read = read_table(table.table, separator=table.separator, sheet=table.sheet)
        trials = trials_in(read, study.levels, request)
    profiles = profiles_of(trials)
    if len(profiles) > MOST_PROFILES:
        raise InputError(
            f"shows {len(profiles):,} combinations of levels, and a study has at most"
            f" {MOST_PROFILES:,}; leave rows out, or share them out over several studies",
            file=table.table,
        )
    for profile in profiles:
        if is_excluded(profile, study.levels, study.settings.exclude):
            words = _in_words(study, profile)
            raise InputError(f"shows {words}, which the study file excludes", file=table.table)
    return trials, tuple(_table_notes(study, profiles, trials))


def _table_notes(
    study: StudyFile, profiles: tuple[Profile, ...], trials: tuple[Trial, ...]
) -> list[str]:
    """Return what a table leaves out or repeats."""
    notes = []
    for place, (factor, levels) in enumerate(study.levels.items()):
        missing = [name for name in levels if name not in {p[place] for p in profiles}]
        notes += [f"the table never shows {factor} {name}" for name in missing]
    numbers = [{name: n for n, name in enumerate(some)} for some in study.levels.values()]
    rows = np.array([[own[n] for own, n in zip(numbers, p, strict=True)] for p in profiles])
    notes += same_in_words(rows, study.levels)
    seen: set[tuple[str, frozenset[Profile | None]]] = set()
    again = []
    for trial in trials:
        key = (trial.block, frozenset(trial.alternatives))
        again += [trial] if key in seen else []
        seen.add(key)
    twice = [t for t in trials if len(set(t.alternatives)) < len(t.alternatives)]
    beaten = [t for t in trials if study.ranks and dominated(t, study.ranks)]
    for some, what in (
        (twice, "show one profile twice"),
        (again, "show what another of their block does"),
        (beaten, "hold a profile that another one beats in everything"),
    ):
        if some:
            first = f"the first is task {some[0].task} of block {some[0].block}"
            notes.append(f"{len(some)} of {len(trials)} tasks {what}, {first}")
    return notes


def _playlist_notes(study: StudyFile, playlists: Sequence[Playlist]) -> list[str]:
    """Return what playlists do not balance, in sentences."""
    settings, notes = study.settings.playlists, []
    uneven_there = uneven_groups(playlists) if settings.order == "latin" else []
    if uneven_there:
        notes.append(
            f"{len(playlists)} playlists are no multiple of what the order takes, so some trials"
            " stand at some positions more often than others; leave playlists.count out"
        )
    groups = {each.block: list(dict.fromkeys(each.trials)) for each in playlists}
    blocks: dict[str, list[list[Trial]]] = {}
    for name, own in groups.items() if settings.parts > 1 else ():
        blocks.setdefault(name.rpartition(".")[0], []).append(own)
    for name, parts in blocks.items():
        confounded = uneven(parts, tuple(study.settings.factors))
        if confounded:
            notes.append(
                f"parts of block {name} do not share {', '.join(confounded[:3])} evenly:"
                " who sees which part is confounded with that"
            )
    return notes


def _in_words(study: StudyFile, profile: Profile) -> str:
    """Return a profile as people read it."""
    return ", ".join(f"{name} {level}" for name, level in zip(study.levels, profile, strict=True))


def _hidden(study: StudyFile, stimuli: tuple[Stimulus, ...]) -> list[str]:
    """Return which profiles should look different and are the same film."""
    shown = [not told_only(study, factor) for factor in study.settings.factors]
    notes = []
    for stimulus in stimuli:
        looks = {
            tuple(level for level, seen in zip(profile, shown, strict=True) if seen)
            for profile in stimulus.profiles
        }
        if len(looks) > 1:
            one, other = [_in_words(study, profile) for profile in stimulus.profiles[:2]]
            notes.append(f"{one} is the same film as {other}; one level hides the other")
    return notes


_COMPARE, _COMPARE_PER_MEGAPIXEL = 0.08, 1.6
"""Comparing a frame of two films: always, and for each million pixels [CPU-s]."""

_DECODE, _DECODE_PER_MEGAPIXEL = 0.02, 0.02
"""Holding a film against its frames: once, and for each million pixels of each picture [CPU-s]."""

_REPORT, _REPORT_PER_FRAME, _REPORT_PER_MEGAPIXEL = 0.3, 0.01, 0.18
"""Measuring a film: once, for each frame, and for each million pixels of each frame [CPU-s]."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a study will cost.

    Attributes:
        films: How many are to be rendered.
        frames: Of all of them.
        cpu_hours: Of rendering them, with their layers.
        wall_seconds: The same on this machine, if nothing else runs.
        memory_mb: At the peak of the largest.
        frames_mb: Of stored frames on disk.
        film_mb: Of the films.
        layers_mb: Of layers on disk.
        measuring: Of which something is made when all films are there, in words.
        measuring_seconds: What that takes, one thread's work [s].
    """

    films: int
    frames: int
    cpu_hours: float
    wall_seconds: float
    memory_mb: float
    frames_mb: float
    film_mb: float
    layers_mb: float = 0.0
    measuring: tuple[str, ...] = ()
    measuring_seconds: float = 0.0

    def __str__(self) -> str:
        then = [f"then {time_in_words(self.measuring_seconds)} for {' and '.join(self.measuring)}"]
        then = then if self.measuring else []
        if not self.films:
            return ", ".join(["nothing to render", *then])
        layers = [f"{space_in_words(self.layers_mb)} of layers"] if self.layers_mb else []
        parts = [
            f"about {time_in_words(3600 * self.cpu_hours)} of CPU time",
            f"{time_in_words(self.wall_seconds)} here",
            f"{space_in_words(self.memory_mb)} of memory",
            f"{space_in_words(self.frames_mb)} of frames",
            *layers,
            f"{space_in_words(self.film_mb)} of films",
            *then,
        ]
        return f"{self.frames} frames of {self.films} films: {', '.join(parts)}"


def frames_of(stimulus: Stimulus) -> int:
    """Return how many frames a film has, which ends where the log does."""
    times = Pace.of(stimulus.job, stimulus.shot).times(stimulus.shot)
    logs = scenario_files(stimulus.job).trajectories
    return int(np.sum(times <= _end_and_step(stamps_of(logs))[0] + 1e-6))


def log_step(stimulus: Stimulus) -> float:
    """Return the usual time from a step of a film's log to the next [s]; 0 if it has one only."""
    return _end_and_step(stamps_of(scenario_files(stimulus.job).trajectories))[1]


@lru_cache(maxsize=64)
def _end_and_step(logs: tuple[tuple[str, int, int], ...]) -> tuple[float, float]:
    """Return a simulation's last time and step [s], of logs that are named with their versions."""
    from sumo3dviz_pt.sumo import whereabouts

    found = whereabouts([Path(name) for name, *_ in logs], "")
    return found.end, found.step


def cost_of_film(stimulus: Stimulus) -> Cost:
    """Forecast what one film costs with its layers, as if none of its frames were there."""
    frames, output = frames_of(stimulus), stimulus.job.output
    cost = film_cost(
        quality_preset(stimulus.job.quality, together=frames > 1),
        output,
        triangles=TYPICAL_TRIANGLES,
        frames=frames,
        factor=forecast_factor(stimulus.job),
    )
    # Layers are found and written by one thread.
    seconds = layers_cost(output.layers, size=output.size).cpu_seconds
    return replace(
        cost,
        cpu_seconds_per_frame=cost.cpu_seconds_per_frame + seconds,
        cpu_hours=cost.cpu_hours + frames * seconds / 3600,
        wall_seconds=cost.wall_seconds + frames * seconds,
    )


def layers_of_film(stimulus: Stimulus) -> float:
    """Forecast the space that a film's layers take [MB]."""
    output = stimulus.job.output
    return frames_of(stimulus) * layers_cost(output.layers, size=output.size).megabytes


def forecast(plan: StudyPlan, todo: Sequence[Stimulus]) -> Forecast:
    """Forecast what a study costs whose films are rendered one after the other.

    Args:
        plan: The study's; its certificate and its report are of all films.
        todo: The films that are to be rendered.
    """
    costs = [cost_of_film(stimulus) for stimulus in todo]
    settings = plan.file.settings
    measured = {
        "the certificate": _certificate_seconds(plan) if settings.certificate.write else 0.0,
        "the report": _report_seconds(plan) if settings.report.write else 0.0,
    }
    return Forecast(
        films=len(costs),
        frames=sum(map(frames_of, todo)),
        cpu_hours=sum(cost.cpu_hours for cost in costs),
        wall_seconds=sum(cost.wall_seconds for cost in costs),
        memory_mb=max((cost.memory_mb for cost in costs), default=0.0),
        frames_mb=sum(cost.frames_mb for cost in costs),
        film_mb=sum(cost.film_mb for cost in costs),
        layers_mb=sum(map(layers_of_film, todo)),
        measuring=tuple(what for what, seconds in measured.items() if seconds),
        measuring_seconds=sum(measured.values()),
    )


def _certificate_seconds(plan: StudyPlan) -> float:
    """Return what comparing all pairs takes [CPU-s]."""
    films = {stimulus.name: stimulus for stimulus in plan.stimuli}
    most = plan.file.settings.certificate.frames
    compared = sum(
        min(most, frames_of(films[pair.one]))
        * (_COMPARE + _COMPARE_PER_MEGAPIXEL * _megapixels(films[pair.one]))
        for pair in plan.pairs
    )
    return compared + sum(
        _DECODE + _DECODE_PER_MEGAPIXEL * frames_of(film) * _megapixels(film)
        for film in plan.stimuli
    )


def _report_seconds(plan: StudyPlan) -> float:
    """Return what measuring all films takes [CPU-s]."""
    return sum(
        _REPORT + frames_of(film) * (_REPORT_PER_FRAME + _REPORT_PER_MEGAPIXEL * _megapixels(film))
        for film in plan.stimuli
    )


def _megapixels(stimulus: Stimulus) -> float:
    """Return how many million pixels a frame has."""
    width, height = stimulus.job.output.size
    return width * height / 1e6
