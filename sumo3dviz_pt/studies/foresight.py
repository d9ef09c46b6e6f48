"""Says of a study, before any pixel is rendered, what its certificate will be able to prove.

A factor is about one subject. What its levels set beside that is a confound; what no rule knows may
change anything; a level that changes nothing that is seen has no effect. All of that can be told
from the scenes and the log.

References:
    Mahy, Van Eycken, Oosterlinck, "Evaluation of uniform color spaces", Color Research and
    Application 19, 1994: the just noticeable difference in CIELAB is 2.3.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase

import numpy as np

from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.studies.certificate.acts import (
    Acts,
    Subject,
    key_of,
    subject_of,
    swaps_log,
)
from sumo3dviz_pt.studies.file import StudyFile
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.stimuli import Stimulus, StimulusPair, leaves

_TOLD_APART = 2.3
"""Colours that are nearer to each other in CIELAB cannot be told apart."""

_COLOURED = re.compile(r"(.*\.)?colour: (#[0-9a-f]{6}) -> (#[0-9a-f]{6})")
_NAMING = re.compile(r"(?:vehicles\.by_id|traffic\.rides)\.(?P<id>.+?)(?:\.[a-z]+)?")
"""Keys that name a road user; ids may hold dots themselves, settings of one are plain words."""

Logs = dict[tuple[str, str], Sequence[tuple[float, float]]]
"""When which road user is in which log [s]."""


def rider_of(stimulus: Stimulus) -> str:
    """Return the id of the vehicle that a film's camera rides in, or nothing."""
    return stimulus.job.cameras[stimulus.shot.camera].rides_with


def subject_of_pair(study: StudyFile, pair: StimulusPair, *, rider: str = "") -> Subject:
    """Return what the factors of a pair are about, together, and what confounds them.

    Args:
        study: The study file.
        pair: Two of its films.
        rider: Id of the vehicle that the camera of the first rides in, if it does.
    """
    whole = Subject(Acts())
    for factor, changes in _by_factor(study, pair).items():
        declared = study.settings.factors[factor].acts_on
        intended = None if declared is None else Acts.asked(declared)
        own = subject_of(changes, intended=intended, rider=rider)
        whole = Subject(
            whole.acts | own.acts,
            (*whole.confounds, *own.confounds),
            (*whole.ruleless, *own.ruleless),
        )
    return whole


def _by_factor(study: StudyFile, pair: StimulusPair) -> dict[str, list[str]]:
    """Return what differs in the scenes of a pair, by the factor whose levels say so.

    Presets and templates say more than their own keys: what no level names belongs to the factor
    that names the most of its words, or else to the one that names a template, or to all.
    """
    owned: dict[str, list[str]] = {factor: [] for factor in pair.factors}
    named = {
        factor: [
            ".".join(map(str, path)).split(".")
            for patch in study.settings.factors[factor].levels.values()
            for path in leaves(patch)
        ]
        for factor in pair.factors
    }
    templates = [factor for factor, some in named.items() if ["template"] in some]
    for change, acting in zip(pair.changed, pair.acting, strict=True):
        words = key_of(change).split(".")
        scores = {
            factor: max((_shared(words, path) for path in some), default=0)
            for factor, some in named.items()
        }
        best = max(scores.values(), default=0)
        owners = [factor for factor, score in scores.items() if score == best]
        for factor in owners if best else (templates or owners):
            owned[factor].append(acting)
    return owned


def _shared(one: Sequence[str], other: Sequence[str]) -> int:
    """Return how many words two keys have in common at their beginnings."""
    unlike = (n for n, (a, b) in enumerate(zip(one, other, strict=False)) if a != b)
    return next(unlike, min(len(one), len(other)))


def foresight(plan: StudyPlan) -> list[str]:
    """Return what can be known of a study's factors without pixels, a sentence each."""
    films = {each.name: each for each in plan.stimuli}
    sentences: dict[str, dict[str, None]] = {factor: {} for factor in plan.factors}
    logs: Logs = {}
    for pair in plan.pairs:
        both = (films[pair.one], films[pair.other])
        for factor, changes in _by_factor(plan.file, pair).items():
            notes = (
                *_beside(plan.file, factor, changes, rider=rider_of(both[0])),
                *_moved(changes, rider=rider_of(both[0])),
                *_another_log(changes),
                *_same_colours(changes),
                *_nobody(changes, both, logs),
            )
            sentences[factor] |= dict.fromkeys(notes)
    return [f"{factor}: {sentence}" for factor, some in sentences.items() for sentence in some]


def _beside(study: StudyFile, factor: str, changes: Sequence[str], *, rider: str) -> Iterator[str]:
    """Yield that levels set more than what their factor is about, or what no rule knows."""
    declared = study.settings.factors[factor].acts_on
    acts = None if declared is None else Acts.asked(declared)
    subject = subject_of(changes, intended=acts, rider=rider)
    if subject.confounds:
        keys = ", ".join(sorted({key_of(change) for change in subject.confounds}))
        yield (
            f"levels also set {keys}, beside what the factor is about ({subject.acts}), and such"
            " pairs fail; make it a factor of its own, or say in acts_on where the factor acts"
        )
    if subject.acts.anything:
        keys = ", ".join(sorted(set(subject.ruleless)))
        why = f"no rule knows {keys}, so it" if keys else "it"
        yield f"{why} may change anything, and nothing can be proven; say in acts_on where it acts"


def _moved(changes: Sequence[str], *, rider: str) -> Iterator[str]:
    """Yield that a factor moves the vehicle that the camera rides in."""
    for change in changes:
        named = _NAMING.fullmatch(key_of(change))
        if rider and named and change.startswith("traffic.rides.") and _fits(rider, named["id"]):
            yield (
                f"the camera rides in {rider}, whose ride it changes, so that all is seen from"
                " elsewhere; change another ride instead, or ask for a gap"
            )


def _another_log(changes: Sequence[str]) -> Iterator[str]:
    """Yield that a factor changes all that moves, which no certificate can tell from a gap."""
    if swaps_log(changes):
        yield (
            "levels set another traffic log, so everything that moves may differ, not only what the"
            " factor is called after; to move one vehicle and no other, change its ride in one log"
            " (traffic.rides)"
        )


def _same_colours(changes: Sequence[str]) -> Iterator[str]:
    """Yield colours that nobody can tell apart."""
    for change in changes:
        match = _COLOURED.fullmatch(change)
        if match and _apart(match[2], match[3]) < _TOLD_APART:
            one, other = sorted((match[2], match[3]))
            yield (
                f"{one} and {other} differ by {_apart(one, other):.1f} in CIELAB, and below"
                f" {_TOLD_APART} nobody tells them apart"
            )


def _apart(one: str, other: str) -> float:
    """Return the distance of two colours in CIELAB."""
    first, second = (_lab(colour) for colour in (one, other))
    return float(np.linalg.norm(np.subtract(first, second)))


def _lab(colour: str) -> tuple[float, float, float]:
    """Return a colour, #rrggbb, in CIELAB for the white of sRGB."""
    rgb = [linear_from_srgb(int(colour[k : k + 2], 16) / 255.0) for k in (1, 3, 5)]
    rows = ((0.4124, 0.3576, 0.1805), (0.2126, 0.7152, 0.0722), (0.0193, 0.1192, 0.9505))
    x, y, z = (float(np.dot(row, rgb)) / sum(row) for row in rows)
    f, g, h = (v ** (1 / 3) if v > 0.008856 else 7.787 * v + 16 / 116 for v in (x, y, z))
    return 116 * g - 16, 500 * (f - g), 200 * (g - h)


def _nobody(changes: Sequence[str], films: tuple[Stimulus, Stimulus], logs: Logs) -> Iterator[str]:
    """Yield road users that levels name and that the log does not have while the film runs.

    Args:
        changes: Of a factor's levels.
        films: Two films that differ in it.
        logs: When logs have whom, as far as it was asked for.
    """
    for change in changes:
        named = _NAMING.fullmatch(key_of(change))
        if not named:
            continue
        there = [_spans(film, named["id"], logs) for film in films]
        shot = films[0].shot
        if not any(there):
            yield f"nobody in the log is called {named['id']}, so it has no effect"
        elif change.startswith("vehicles.") and not any(map(_meets, films, there)):
            yield (
                f"{named['id']} is not on the road between {shot.start:.12g} and {shot.end:.12g} s,"
                " so it has no effect"
            )


def _spans(film: Stimulus, id_: str, logs: Logs) -> Sequence[tuple[float, float]]:
    """Return when a film's log has a road user, or those that a pattern means."""
    from sumo3dviz_pt.sumo import whereabouts

    key = (repr(film.job.scenario), id_)
    if key not in logs:
        presence = whereabouts(scenario_files(film.job).trajectories, id_)
        # Of patterns it is only asked whether anybody fits them: each id would read the log again.
        fits = any(_fits(each, id_) for each in presence.ids)
        logs[key] = presence.spans or ([(-np.inf, np.inf)] if fits else [])
    return logs[key]


def _meets(film: Stimulus, spans: Sequence[tuple[float, float]]) -> bool:
    """Return whether some of the times lie within a film."""
    return any(a <= film.shot.end and b >= film.shot.start for a, b in spans)


def _fits(name: str, pattern: str) -> bool:
    """Return whether an id is meant by a pattern of * and ?."""
    return fnmatchcase(name, pattern.replace("[", "[[]"))
