"""Says in words what a study shows and what is to be done for it."""

from __future__ import annotations

from collections.abc import Sequence

from sumo3dviz_pt.experiments.designs.efficiency import in_words as design_in_words
from sumo3dviz_pt.pipeline.certificate.acts import key_of
from sumo3dviz_pt.pipeline.progress.costs import time_in_words
from sumo3dviz_pt.pipeline.studies.anew import why_anew
from sumo3dviz_pt.pipeline.studies.forecast import cost_of_film, forecast, frames_of
from sumo3dviz_pt.pipeline.studies.foresight import foresight
from sumo3dviz_pt.pipeline.studies.offers import offer_lines, offer_notes, offers_of
from sumo3dviz_pt.pipeline.studies.pairs import possible_pairs
from sumo3dviz_pt.pipeline.studies.plan import StudyPlan
from sumo3dviz_pt.pipeline.studies.records import finished_films
from sumo3dviz_pt.pipeline.studies.run import StudyOrder
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus

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
        f"  {stimulus.name:<32} {shot}, {frames_of(stimulus)} frames, {width}x{height},"
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
