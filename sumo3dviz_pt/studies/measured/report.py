"""Makes the stimulus report of a study: tables by frame and by film, effects, a page.

The page shows what factors do to measures, and each film's numbers.

A measure that differs by levels is confounded with the factor. For each factor and measure, eta
squared is the share of the measure's variance over profiles that lies between the factor's levels:
1 says that the measure tells the level, 0 that it knows nothing of it. With two levels it is the
square of Pearson's correlation. In a design in which factors are not orthogonal, one factor's share
holds some of another's.

References:
    Cohen, "Eta-squared and partial eta-squared in fixed factor ANOVA designs", Educational and
    Psychological Measurement 33, 1973, doi:10.1177/001316447303300111.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.films.frames import write_json
from sumo3dviz_pt.studies.designs.profiles import associations, error_in_words
from sumo3dviz_pt.studies.measured.film import MEASURES, SHARE, TABLES, FilmMeasures, measure_film
from sumo3dviz_pt.studies.measured.safety import flashes_too_often, safety_words
from sumo3dviz_pt.studies.measured.traffic import Row
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.records import film_path, read_film_account
from sumo3dviz_pt.studies.tools.content import write_table

_SAME = 1e-9
"""Measures that differ by less than this share of their size count as constant."""


@dataclass(frozen=True, slots=True)
class Effect:
    """What a factor does to a measure.

    Attributes:
        factor: Its name.
        measure: Its name.
        means: Of the measure, by level.
        eta_squared: Share of its variance between levels, [0, 1]; 0 for a constant.
    """

    factor: str
    measure: str
    means: Mapping[str, float]
    eta_squared: float


def effects(
    levels: Mapping[str, Sequence[str]],
    profiles: Sequence[Sequence[str]],
    measures: Sequence[Mapping[str, float]],
) -> list[Effect]:
    """Return what each factor does to each measure that all profiles have.

    Args:
        levels: Of each factor, in order.
        profiles: A level of each factor.
        measures: Values by name, of the same profiles; NaN where there is none.
    """
    names = [name for name in measures[0] if all(np.isfinite(row[name]) for row in measures)]
    return [
        _effect(
            (factor, name),
            [level for level in levels[factor] if any(p[place] == level for p in profiles)],
            [profile[place] for profile in profiles],
            [row[name] for row in measures],
        )
        for place, factor in enumerate(levels)
        for name in names
    ]


def _effect(
    names: tuple[str, str], order: Sequence[str], levels: Sequence[str], values: Sequence[float]
) -> Effect:
    """Return what a factor does to a measure, by their names, and levels in an order."""
    by_level = {
        level: [value for own, value in zip(levels, values, strict=True) if own == level]
        for level in order
    }
    means = {level: float(np.mean(own)) for level, own in by_level.items()}
    whole = float(np.mean(values))
    total = float(np.sum((np.array(values) - whole) ** 2))
    between = sum(len(own) * (means[level] - whole) ** 2 for level, own in by_level.items())
    size = len(values) * max(abs(whole), _SAME) ** 2
    constant = total <= _SAME**2 * size
    return Effect(*names, means, 0.0 if constant else min(between / total, 1.0))


_STRONG = 0.5
"""A factor that makes more of a measure's variance than this is printed bold."""

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; margin: 2rem auto;
  max-width: 1200px; padding: 0 1rem }
h1 { font-size: 1.7rem } h2 { font-size: 1.2rem; margin: 2.5rem 0 .3rem }
table { border-collapse: collapse; margin: .8rem 0; font-size: .9rem }
caption { text-align: left; color: #444; padding-bottom: .3rem }
th, td { text-align: left; padding: .25rem .8rem; border-bottom: 1px solid #ddd;
  vertical-align: top }
th { font-weight: 600 } tbody th { font-weight: 400; min-width: 17rem }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
td small { display: block; color: #444 } .scroll { overflow-x: auto }
"""

_ABOUT = """<p>Light of the scene is measured in the stored frames that the certificate compares,
before exposure and tone curve. All else is of the films as they are seen, on a display whose white
has {white:g} cd/m<sup>2</sup> and whose curve is sRGB's: set <code>report: {{white: ...}}</code> in
the study file to what a photometer reads. RMS contrast is the standard deviation of luminance over
its mean; edge density the share of pixels that are edges (Mack &amp; Oliva 2004); change is the
mean absolute difference of luminance from the frame before. Gap, headway and time to collision are
those to whoever is straight ahead of the ridden vehicle; speeds are as the film draws them, and
beside that as the log says. The tables lie in the folder <code>report</code>:</p>{tables}"""

_SAFETY = """<p>A film passes if no more than three flashes, and no more than three red flashes,
happen within any second over more than a quarter of any field of view of 10 degrees (WCAG 2.2,
success criterion 2.3.1; see also ITU-R BT.1702). A flash is a pair of opposing changes of a tenth
or more of relative luminance whose darker side is below 0.8; a red flash is a pair of changes into
or out of a saturated red. Films are taken as seen as wide as their lens opens: seen from farther
away, a field holds more of the picture. Colour differences of lights are CIEDE2000, of the lights
as the films show them; people without long (protanopia) or middle wavelength cones (deuteranopia)
are simulated after Machado, Oliveira and Fernandes
(<a href="https://doi.org/10.1109/TVCG.2009.113">2009</a>, severity 1). This is a computation on
pictures and no clinical test: warn people with photosensitive epilepsy all the same.</p>"""

_DESIGN = """<p>Cram\u00e9r's V of any two factors over all that is shown: 0 if one tells nothing of
the other, 1 if they are the same. Factors that tell each other are confounded in this design.
</p>"""

_GAPS = """<p>What <code>traffic.rides</code> asks for, and what the films show. <em>Kept at</em> is
the time from the leader's rear at a place to the follower's front there, at the moment that was
asked for; the others are distances over the follower's speed, frame by frame.</p>"""

_ARRIVALS = """<p>When fronts of vehicles come to the way across of observers who stand, by the
film's time, and the time since the last rear left it, of all lanes and both directions together:
the gaps that are offered. <code>arrivals.csv</code> also has who comes soon after the
film.</p>"""

_MOST_ARRIVALS = 200
"""More are in the table alone."""

_EFFECTS = """<p>Which measures differ between levels of a factor? The number is eta squared, the
share of the measure's variance over all profiles that lies between the levels: 1 says that it
tells the level, 0 that it knows nothing of it. Below it stand the means of the levels. A factor
should show in what it is about; where it also shows in another measure, the two are confounded, and
an answer may be due to either. Look at the means, too: without noise, eta squared is 1 for a
difference that is too small to matter. Measures that are the same in all films are left
out.</p>"""


@dataclass(frozen=True, slots=True)
class ReportPage:
    """What a report says.

    Attributes:
        films: All with the same measures.
        effects: What factors do to measures.
        white: Luminance of the display's white [cd/m2].
        words: What measures mean, in order.
        safety: What the numbers mean that ethics boards ask for, in order.
        associations: Cramer's V of any two factors, by both names.
        design: The design's D-error, in words; empty if it has none.
    """

    films: Sequence[FilmMeasures]
    effects: Sequence[Effect]
    white: float
    words: Mapping[str, str]
    safety: Mapping[str, str]
    associations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    design: str = ""


def write_page(path: Path, page: ReportPage) -> None:
    """Write `report.html`.

    Args:
        path: Where to.
        page: What it says.
    """
    tables = {"films": "measures of whole films", "safety": "what ethics boards ask", **TABLES}
    listed = "".join(f"<li><code>{name}.csv</code>: {word}</li>" for name, word in tables.items())
    wholes = {film.name: film.whole for film in page.films}
    lines = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8"><title>Stimulus report</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{_STYLE}</style></head><body><main><h1>Stimulus report</h1>",
        _ABOUT.format(white=page.white, tables=f"<ul>{listed}</ul>"),
        "<h2>What factors do to measures</h2>",
        _EFFECTS,
        *_effect_table(page.effects, page.words),
        *_design(page),
        *_gaps(page.films),
        *_arrivals(page.films),
        "<h2>What ethics boards ask</h2>",
        *_verdict(page.films),
        _SAFETY,
        *_film_table({film.name: film.safety for film in page.films}, page.safety),
        "<h2>Films</h2>",
        "<p>Measures of whole films; light is the mean over frames.</p>",
        *_film_table(wholes, page.words),
        "</main></body></html>",
        "",
    ]
    write_atomically(path, "\n".join(lines))


def _design(page: ReportPage) -> Iterator[str]:
    """Yield how far factors tell each other in the design, and its D-error."""
    # No factor is called by the empty name.
    rows: list[Row] = [{"": name, **row} for name, row in page.associations.items()]
    heads = {"": "factor", **{name: html.escape(name) for name in page.associations}}
    about = _DESIGN + (f"<p>Choice tasks: {html.escape(page.design)}.</p>" if page.design else "")
    if len(rows) > 1 or page.design:
        yield from _rows("The design", about, heads, rows)


def _verdict(films: Sequence[FilmMeasures]) -> Iterator[str]:
    """Yield which films flash too often."""
    bad = {film.name: often for film in films if (often := flashes_too_often(film.safety))}
    if not bad:
        yield "<p><strong>No film flashes more often than the criterion allows.</strong></p>"
    for name, often in bad.items():
        words = " and ".join(often)
        yield f"<p><strong>{html.escape(name)} has too many {words}.</strong></p>"


def _gaps(films: Sequence[FilmMeasures]) -> Iterator[str]:
    """Yield a table of the gaps that were asked for; nothing if there are none."""
    rows = [{"film": film.name, **row} for film in films for row in film.tables["gaps"]]
    heads = {
        **{"film": "film", "follower": "follower", "leader": "leader", "moved": "moved"},
        **{"at": "at [s]", "asked": "asked [s]", "kept_at": "kept at [s]"},
        **{"time_gap_mean": "mean [s]", "time_gap_min": "least [s]", "time_gap_max": "largest [s]"},
        "gap_mean": "mean [m]",
    }
    yield from _rows("Gaps", _GAPS, heads, rows)


def _arrivals(films: Sequence[FilmMeasures]) -> Iterator[str]:
    """Yield a table of who arrives at observers who stand while a film is shown."""
    rows = [
        {"film": film.name, **row}
        for film in films
        for row in film.tables["arrivals"]
        if row["from"] in ("left", "right")
        and float(row["arrives"]) <= float(film.tables["frames"][-1]["time"])
    ]
    heads = {
        **{"film": "film", "observer": "observer", "road_user": "vehicle", "from": "from the"},
        **{"arrives_in_film": "arrives [s]", "gap_before": "gap before [s]"},
        "speed": "speed [m/s]",
    }
    yield from _rows("Who arrives", _ARRIVALS, heads, rows[:_MOST_ARRIVALS])


def _rows(
    title: str,
    about: str,
    heads: Mapping[str, str],
    rows: Sequence[Mapping[str, str | int | float]],
) -> Iterator[str]:
    """Yield a section with a table of some columns; nothing without rows."""
    if not rows:
        return
    yield f"<h2>{title}</h2>"
    yield about
    yield '<div class="scroll"><table><thead><tr>'
    yield "".join(f'<th scope="col">{word}</th>' for word in heads.values())
    yield "</tr></thead><tbody>"
    for row in rows:
        yield f"<tr>{''.join(f'<td>{_cell(row[name])}</td>' for name in heads)}</tr>"
    yield "</tbody></table></div>"


def _cell(value: str | int | float) -> str:
    """Return a value of a row; a dash where there is none."""
    if isinstance(value, str):
        return html.escape(value) or "-"
    return f"{value:.2f}"


def _effect_table(rows: Sequence[Effect], words: Mapping[str, str]) -> Iterator[str]:
    """Yield a table with a row for each measure and a column for each factor."""
    factors = dict.fromkeys(each.factor for each in rows)
    by_place = {(each.measure, each.factor): each for each in rows}
    yield '<div class="scroll"><table><caption>Eta squared, and means by level; bold above'
    yield f' {_STRONG:g}</caption><thead><tr><th scope="col">measure</th>'
    yield "".join(f'<th scope="col">{html.escape(name)}</th>' for name in factors)
    yield "</tr></thead><tbody>"
    for name, word in words.items():
        row = [by_place.get((name, factor)) for factor in factors]
        if any(each is not None and each.eta_squared > 0.0 for each in row):
            cells = "".join(_effect_cell(each) for each in row)
            yield f'<tr><th scope="row">{_superscript(word)}</th>{cells}</tr>'
    yield "</tbody></table></div>"


def _effect_cell(effect: Effect | None) -> str:
    """Return a cell about a factor and a measure."""
    if effect is None:
        return "<td>-</td>"
    means = ", ".join(
        f"{html.escape(level)} {_value(effect.measure, mean)}"
        for level, mean in effect.means.items()
    )
    share = f"{effect.eta_squared:.2f}"
    strong = f"<strong>{share}</strong>" if effect.eta_squared > _STRONG else share
    return f"<td>{strong}<small>{means}</small></td>"


def _film_table(
    films: Mapping[str, Mapping[str, float]], words: Mapping[str, str]
) -> Iterator[str]:
    """Yield a table with a row for each measure and a column for each film."""
    yield '<div class="scroll"><table><thead><tr><th scope="col">measure</th>'
    for film in films:
        # Long names break where they are joined.
        name = html.escape(film).replace("_", "_<wbr>")
        yield f'<th scope="col" class="n">{name}</th>'
    yield "</tr></thead><tbody>"
    for name, word in words.items():
        cells = "".join(f'<td class="n">{_value(name, own[name])}</td>' for own in films.values())
        yield f'<tr><th scope="row">{_superscript(word)}</th>{cells}</tr>'
    yield "</tbody></table></div>"


def _value(measure: str, value: float) -> str:
    """Return a measure's value; shares are told in percent."""
    shown = _number(100.0 * value if measure.startswith(SHARE) else value)
    return f"{shown} %" if measure.startswith(SHARE) and shown != "-" else shown


def _number(value: float) -> str:
    """Return a number with three digits that count, never as a power of ten; a dash for none."""
    if math.isnan(value):
        return "-"
    size = abs(value)
    whole = size == round(size)
    digits = 0 if whole else max(0, 2 - math.floor(math.log10(size)))
    return f"{value:.{min(digits, 5)}f}"


def _superscript(words: str) -> str:
    """Return words for a page, with the 2 of m2 raised."""
    return html.escape(words).replace("m2]", "m<sup>2</sup>]")


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
    rows = _effects(plan, films)
    page = ReportPage(
        films,
        rows,
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
    matrix = associations(plan.file.levels, plan.designed)
    return {
        name: dict(zip(plan.factors, row, strict=True))
        for name, row in zip(plan.factors, matrix.tolist(), strict=True)
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
            {**asdict(each), "eta_squared": round(each.eta_squared, 6)} for each in page.effects
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
