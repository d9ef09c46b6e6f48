"""Makes the stimulus report of a study: tables by frame and by film, effects, a page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from sumo3dviz_pt.experiments.designs.efficiency import associations, error_in_words
from sumo3dviz_pt.experiments.tools.rows import write_table
from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.pipeline.films.frames import write_json
from sumo3dviz_pt.pipeline.measured.effects import Effect, effects
from sumo3dviz_pt.pipeline.measured.film import (
    MEASURES,
    SHARE,
    TABLES,
    FilmMeasures,
    measure_film,
)
from sumo3dviz_pt.pipeline.measured.page import ReportPage, write_page
from sumo3dviz_pt.pipeline.measured.safety import flashes_too_often, safety_words
from sumo3dviz_pt.pipeline.studies.plan import StudyPlan
from sumo3dviz_pt.pipeline.studies.records import film_path, read_film_account

REPORT, PAGE, FOLDER = "report.json", "report.html", "report"


def report_study(folder: Path, plan: StudyPlan) -> tuple[Path, ...]:
    """Measure all films of a study, and write `report.html`, `report.json` and tables.

    Args:
        folder: The study's, with all films.
        plan: What they show.

    Returns:
        All files.

    Raises:
        InputError: If a film, its account or a frame is damaged.
    """
    settings = plan.file.settings
    films = []
    for number, stimulus in enumerate(plan.listed, start=1):
        film = film_path(folder, plan, stimulus)
        account = read_film_account(film)
        films.append(
            measure_film(
                film,
                stimulus,
                account,
                settings=settings.report,
                compared=settings.certificate.frames,
            )
        )
        announce(Doing.MEASURE, number, len(plan.stimuli))
    films = _filled(films)
    found = _effects(plan, films)
    page = ReportPage(
        films,
        found,
        settings.report.white,
        _words(films),
        safety_words(settings.report.connections),
        _associations(plan),
        error_in_words(plan.file.levels, plan.designed, plan.priors),
    )
    record = _write(folder, page)
    write_page(folder / PAGE, page)
    return (record, folder / PAGE, *_tables(folder / FOLDER, plan, films))


def _filled(films: Sequence[FilmMeasures]) -> list[FilmMeasures]:
    """Return films that all have the same measures: a class that one never shows has share 0."""
    names = dict.fromkeys(name for film in films for name in film.whole)
    return [
        replace(film, whole={name: film.whole.get(name, 0.0) for name in names}) for film in films
    ]


def _effects(plan: StudyPlan, films: Sequence[FilmMeasures]) -> list[Effect]:
    """Return what factors do to measures, over all profiles."""
    whole = {film.name: film.whole for film in films}
    measures = [whole[plan.films[profile].name] for profile in plan.profiles]
    return effects(plan.file.levels, plan.profiles, measures)


def _associations(plan: StudyPlan) -> dict[str, dict[str, float]]:
    """Return how far any two factors tell each other."""
    found = associations(plan.file.levels, plan.designed)
    return {
        name: dict(zip(plan.factors, row, strict=True))
        for name, row in zip(plan.factors, found.tolist(), strict=True)
    }


def _words(films: Sequence[FilmMeasures]) -> dict[str, str]:
    """Return what measures mean, in the order in which they are shown."""
    return {
        name: MEASURES.get(name) or f"share of the picture that shows {name.removeprefix(SHARE)}"
        for name in films[0].whole
    }


def _tables(folder: Path, plan: StudyPlan, films: Sequence[FilmMeasures]) -> list[Path]:
    """Write a table of all films and one of each kind of rows; those without rows are left out."""
    folder.mkdir(exist_ok=True)
    levels = {
        stimulus.name: dict(zip(plan.factors, stimulus.profiles[0], strict=True))
        for stimulus in plan.stimuli
    }
    rows: dict[str, list[Mapping[str, Any]]] = {
        "films": [_film_row(film, levels[film.name]) for film in films],
        "safety": [{"stimulus": film.name, **_blank(film.safety)} for film in films],
    }
    for name in TABLES:
        rows[name] = [
            {"stimulus": film.name, **_blank(row)} for film in films for row in film.tables[name]
        ]
    return [write_table(folder / f"{name}.csv", some) for name, some in rows.items() if some]


def _film_row(film: FilmMeasures, levels: Mapping[str, str]) -> dict[str, Any]:
    """Return a film's row: its levels, then measures; one called like a factor is renamed."""
    measured = _blank(film.whole).items()
    named = {f"{name}_measured" if name in levels else name: value for name, value in measured}
    return {"stimulus": film.name, **levels, **named}


def _blank(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row in which unknown numbers are empty cells and others have six digits."""
    return {key: "" if value != value else _short(value) for key, value in row.items()}


def _short(value: Any) -> Any:
    """Return a number with six digits that count."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _write(folder: Path, page: ReportPage) -> Path:
    """Write `report.json`; unknown numbers are null."""
    content = {
        "white": page.white,
        "measures": dict(page.words),
        "films": {film.name: _null(film.whole) for film in page.films},
        "effects": [
            {**asdict(each), "eta_squared": round(each.eta_squared, 6)} for each in page.found
        ],
        "gaps": {
            film.name: [{name: _short(value) for name, value in row.items()} for row in gaps]
            for film in page.films
            if (gaps := film.tables["gaps"])
        },
        "safety": {
            "measures": dict(page.safety),
            "films": {
                film.name: {"too_often": flashes_too_often(film.safety), **_null(film.safety)}
                for film in page.films
            },
        },
    }
    path = folder / REPORT
    write_json(path, content, indent=1)
    return path


def _null(row: Mapping[str, float]) -> dict[str, Any]:
    """Return numbers for JSON: unknown ones are null and others have six digits."""
    return {name: None if math.isnan(value) else _short(value) for name, value in row.items()}
