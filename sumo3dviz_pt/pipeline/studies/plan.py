"""Plans a study: which trials show which films, and what is to be rendered for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.experiments.designs.balance import same_in_words
from sumo3dviz_pt.experiments.designs.build import MOST_PROFILES, build_design, is_excluded
from sumo3dviz_pt.experiments.designs.choices import ChoiceRequest, choice_tasks
from sumo3dviz_pt.experiments.designs.efficiency import Priors, d_error
from sumo3dviz_pt.experiments.designs.parts import uneven
from sumo3dviz_pt.experiments.playlists import (
    TURNED,
    Playlist,
    build_playlists,
    most_placed,
    uneven_groups,
    with_even_places,
)
from sumo3dviz_pt.experiments.tables.build import trials_in
from sumo3dviz_pt.experiments.tables.cells import read_table
from sumo3dviz_pt.experiments.tables.forms import TableRequest
from sumo3dviz_pt.experiments.trials import Profile, Trial, dominated, profiles_of, single_trials
from sumo3dviz_pt.job.study import ChoiceSettings, Patch, TableSettings
from sumo3dviz_pt.pipeline.studies.file import StudyFile
from sumo3dviz_pt.pipeline.studies.pairs import StimulusPair, pairs_of
from sumo3dviz_pt.pipeline.studies.patches import check_patches, told_only
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus, build_stimuli


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
        asked = self.file.settings.choices
        return asked.priors if asked else {}

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
        told = [name for name in self.factors if told_only(self.file, name)]
        return pairs_of(self.file.levels, self.stimuli, told=told)

    def only(self, name: str) -> StudyPlan:
        """Return the plan of one of its films.

        Raises:
            ConfigError: If there is none of that name; suggests one.
        """
        known = {each.name: each for each in self.stimuli}
        if name not in known:
            raise ConfigError(f"no film is called {name!r}{did_you_mean(name, known)}", key="film")
        return replace(self, stimuli=(known[name],))


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
    asked = study.settings.playlists
    with study.blamed():
        even = asked.places == "balanced"
        most = most_placed(trials) if even else 1
        playlists = build_playlists(
            trials,
            order=asked.order,
            count=None if asked.count is None else -(-asked.count // most),
            parts=asked.parts,
            repeat=asked.repeat,
            seed=study.settings.seed,
        )
        if even:
            playlists = with_even_places(playlists, count=asked.count, seed=study.settings.seed)
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


def _chosen(study: StudyFile, asked: ChoiceSettings) -> tuple[tuple[Trial, ...], tuple[str, ...]]:
    """Return choice tasks, and notes on them."""
    ranks = {name: own for name, own in zip(study.levels, study.ranks, strict=False) if own}
    request = ChoiceRequest(asked.tasks, asked.alternatives, asked.none, asked.priors, ranks)
    settings = study.settings
    with study.blamed():
        trials = choice_tasks(study.levels, request, exclude=settings.exclude, seed=settings.seed)
    error = d_error(study.levels, trials, asked.priors)
    told = "the priors" if asked.priors else "utilities of 0"
    return trials, (f"{len(trials)} choice tasks have a D-error of {error:.4g}, for {told}",)


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
    asked, notes = study.settings.playlists, []
    uneven_there = uneven_groups(playlists) if asked.order == "latin" else []
    if uneven_there:
        notes.append(
            f"{len(playlists)} playlists are no multiple of what the order takes, so some trials"
            " stand at some positions more often than others; leave playlists.count out"
        )
    groups = {each.block: list(dict.fromkeys(each.trials)) for each in playlists}
    blocks: dict[str, list[list[Trial]]] = {}
    for name, own in groups.items() if asked.parts > 1 else ():
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
