"""Writes `methods.md`: how a study's films were made, on one page, for the authors' own paper.

It has only what stands in the plan and in records, in the past tense. The certificate covers it, so
that it tells no digest of the certificate.

References:
    docs/measured/quality.md: errors of quality presets (FLIP, Andersson et al. 2020,
        doi:10.1145/3406183), on the bundled motorway at 480x270, against a reference
    docs/measured/motion.md: errors of smoothers, on scenarios that nothing was tuned on
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.pipeline.accounts import weather_report
from sumo3dviz_pt.pipeline.conditions import sun_report
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.studies.certificate.certificate import Certificate
from sumo3dviz_pt.studies.plan import StudyPlan, log_step
from sumo3dviz_pt.studies.records import RECORD, FilmRecord, film_path, read_film_account
from sumo3dviz_pt.studies.stimuli import Stimulus
from sumo3dviz_pt.studies.tools.datasets import digest_of

FILE = "methods.md"

FLIP: Mapping[str, float] = MappingProxyType(
    {"draft": 0.075, "preview": 0.051, "standard": 0.032, "study": 0.023}
)
"""How far a frame of a quality preset is from the reference; a test holds it to the bench."""

RMSE: Mapping[str, float] = MappingProxyType(
    {"lane": 0.015, "hermite": 0.071, "linear": 0.2, "paper": 0.31, "paper_symmetric": 0.234}
)
"""How far a smoother is from SUMO's own motion, of logs with a step of 1 s [m]; held as well."""

_LISTED = 4
"""More names, cameras or skies than these are counted."""


def write_methods(
    folder: Path,
    plan: StudyPlan,
    films: Mapping[str, FilmRecord],
    *,
    certificate: Certificate | None,
) -> Path:
    """Write the page into a study's folder.

    Args:
        folder: The study's.
        plan: What its films show.
        films: All of them, finished.
        certificate: What was found on pairs; None where there is none.
    """
    first = plan.stimuli[0]
    account = read_film_account(film_path(folder, plan, first))
    parts = {
        "Design": _design(plan),
        "Traffic": _traffic(plan),
        "Pictures": _pictures(plan, films, account),
        "Checks": _checks(plan, certificate),
        "Availability": _availability(plan, account, digest_of(folder / RECORD)),
    }
    text = [f"# Methods: {_line(plan.file.settings.about.title)}"]
    text += [f"**{name}.** {' '.join(sentences)}" for name, sentences in parts.items()]
    write_atomically(folder / FILE, "\n\n".join(text) + "\n")
    return folder / FILE


def _design(plan: StudyPlan) -> Iterator[str]:
    """Yield what varied, and who saw what."""
    settings, design = plan.file.settings, plan.file.settings.design
    kinds = {
        "full": "a full factorial design",
        "fraction": "an orthogonal fraction of the full design",
        "fraction_3": "an orthogonal fraction of strength 3",
        "latin": "a Latin square",
        "choices": "choice tasks with a small D-error",
    }
    kind = kinds[design] if isinstance(design, str) else f"a design table ({design.form})"
    count = counted(len(plan.stimuli), "film")
    yield f"Participants were shown films of a simulation of traffic; there were {count}."
    yield f"They followed {kind} of {counted(len(plan.factors), 'factor')}:"
    factors = [
        f"{_about(name, factor.about)} (levels {_some(factor.levels)})"
        for name, factor in settings.factors.items()
    ]
    yield f"{_some(factors, separator='; ')}."
    trials = f"{counted(len(plan.profiles), 'combination')} of levels in"
    yield f"The design had {trials} {counted(len(plan.designed), 'trial')}."
    yield (
        f"{counted(len(plan.playlists), 'playlist')} with the order `{settings.playlists.order}`"
        f" {'was' if len(plan.playlists) == 1 else 'were'} drawn with the seed {settings.seed}."
    )


def _about(name: str, about: str) -> str:
    """Return a factor with its meaning."""
    return f"{name}, {cut(_line(about))}" if about else name


def _traffic(plan: StudyPlan) -> Iterator[str]:
    """Yield where motion came from."""
    logs = {path.name for each in plan.stimuli for path in scenario_files(each.job).trajectories}
    if all(name.lower().endswith((".xml", ".xml.gz")) for name in logs):
        yield (
            "Traffic was simulated with Eclipse SUMO (Alvarez Lopez et al., 2018,"
            " doi:10.1109/ITSC.2018.8569938), and its vehicle log was replayed."
        )
    else:
        yield f"Road users moved as {_some(sorted(logs))} told."
    steps = sorted({log_step(each) for each in plan.stimuli} - {0.0})
    if steps:
        yield f"The log's step was {' or '.join(f'{step:g} s' for step in steps)}."
    for name in dict.fromkeys(each.job.motion.smoother for each in plan.stimuli):
        yield f"Motion between its samples was computed by the smoother `{name}`{_error(name)}."
    changed = sum(each.job.traffic is not None for each in plan.stimuli)
    if changed:
        yield f"Recorded rides were changed in {counted(changed, 'film')}, as the scene file says."


def _error(smoother: str) -> str:
    """Return how exact a smoother is, where that was measured."""
    if smoother not in RMSE:
        return ""
    return (
        f", which the package's benchmark found {100 * RMSE[smoother]:.1f} cm (root mean square)"
        " from SUMO's own motion at steps of 0.04 s, for logs of 1 s"
    )


def _pictures(
    plan: StudyPlan, films: Mapping[str, FilmRecord], account: Mapping[str, Any]
) -> Iterator[str]:
    """Yield how it was seen, lit and rendered."""
    yield _told(plan, "The camera", _camera)
    yield _told(plan, "The sun stood at", lambda each: str(sun_report(each.job) or "no place"))
    yield _told(plan, "The weather was", lambda each: str(weather_report(each.job)))
    sizes = {f"{film.size[0]}x{film.size[1]} pixels" for film in films.values()}
    rates = {f"{film.rate} frames per second" for film in films.values()}
    times = sorted({film.duration for film in films.values()})
    lasted = f"{times[0]:g} s" if len(times) == 1 else f"{times[0]:g} to {times[-1]:g} s"
    yield f"Films had {_some(sorted(sizes))} at {_some(sorted(rates))} and lasted {lasted}."
    if versions := account.get("versions"):
        yield (
            f"Frames were path-traced by sumo3dviz_pt {versions.get('sumo3dviz_pt', '')} on Mitsuba"
            f" {versions.get('mitsuba', '')} (variant {account.get('variant', '')})."
        )
    for name in dict.fromkeys(each.job.quality for each in plan.stimuli):
        yield f"The quality preset was `{name}`{_flip(name)}."
    yield _told(plan, "The tone curve was", lambda each: f"`{each.job.output.tone}`")


_PAST = MappingProxyType({"stands": "stood", "rides": "rode", "flies": "flew"})


def _camera(stimulus: Stimulus) -> str:
    """Return what a film's camera did."""
    verb, _, rest = stimulus.job.cameras[stimulus.shot.camera].in_words().partition(" ")
    return f"{_PAST.get(verb, verb)} {rest}"


def _flip(preset: str) -> str:
    """Return how exact a preset is, where that was measured."""
    if preset not in FLIP:
        return ""
    return (
        f", whose frames the package's benchmark found a mean FLIP of {FLIP[preset]:g} from a"
        " reference (0 is equal, 1 is black for white)"
    )


def _told(plan: StudyPlan, begin: str, of: Callable[[Stimulus], str]) -> str:
    """Return a sentence of what all films share, or of how many kinds there were."""
    kinds = list(dict.fromkeys(_line(of(each)) for each in plan.stimuli))
    if len(kinds) == 1:
        return f"{begin} {kinds[0]}."
    return f"{begin} (by level) {_some(kinds, separator='; ')}."


def _checks(plan: StudyPlan, certificate: Certificate | None) -> Iterator[str]:
    """Yield what was found on pairs of films."""
    if certificate is None:
        yield "Films were not compared with each other."
        return
    claims = [pair.claim for pair in certificate.pairs]
    pairs = counted(len(claims), "pair")
    yield (
        f"Records of all frames, and pixels of up to {plan.file.settings.certificate.frames} frames"
        f" a film, were compared for {pairs} of films that should differ in one factor only."
    )
    yield f"In {claims.count('proven')} of {pairs} only what the factor acts on differed."
    for claim, words in (("failed", "failed"), ("not judged", "could not be judged")):
        if number := sum(each == claim for each in claims):
            yield f"{counted(number, 'pair')} {words}."
    if certificate.faults:
        yield f"{counted(len(certificate.faults), 'fault')} of files or films stood against this."


def _availability(plan: StudyPlan, account: Mapping[str, Any], digest: str) -> Iterator[str]:
    """Yield what makes the films again, and how they are cited."""
    about = plan.file.settings.about
    yield (
        "All inputs lie beside the films with what was carried out, so that the same versions make"
        " the same films again (`sumo3dviz-pt study inputs/study.yaml -o again`), and `sumo3dviz-pt"
        " study verify` tests the folder."
    )
    yield f"The SHA-256 of `{RECORD}` was {digest}."
    for part, own in account.get("package", {}).items():
        yield f"The digest of the package's {part} was {own}."
    yield f"The scene's seed was {plan.stimuli[0].job.seed}."
    licence = f" under {_line(about.licence)}" if about.licence else ""
    authors = f" by {_some(map(_line, about.authors))}" if about.authors else ""
    yield (
        f"The films{authors} are available{licence} and are cited as `CITATION.cff` says."
        if (licence or authors)
        else "The films are cited as `CITATION.cff` says."
    )


def _some(names: Iterable[str], *, separator: str = ", ") -> str:
    """Return the first of some names, and how many more there are."""
    listed = list(names)
    more = [f"and {len(listed) - _LISTED} more"] if len(listed) > _LISTED else []
    return separator.join([*listed[:_LISTED], *more])


def _line(text: str) -> str:
    """Return text as a single line, which no paragraph ends in."""
    return " ".join(str(text).split())
