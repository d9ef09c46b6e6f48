"""Measurements as rows of a CSV file, and what their numbers say together.

One row is one picture: a rung of the ladder of spp (`preset` is `ladder`), a preset as it is (its
name), or one of the pictures whose path depth varies (`depth`). Seeds are repetitions: tables show
medians over them. What denoising is worth is told by how many raw samples leave the same error.

References:
    B. Efron, "Bootstrap methods: another look at the jackknife", Annals of Statistics
    7(1), 1979, doi:10.1214/aos/1176344552 (intervals of slopes).
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats

Value = str | int | float
TableRow = dict[str, Value]
"""One measurement: a value for each of `COLUMNS`; a number that is not known is NaN."""

LADDER, DEPTH = "ladder", "depth"
"""What `preset` says of rows that do not measure a preset."""

_HEADER = (
    "scene,variant,git,mitsuba,drjit,llvm,oidn,cpu,threads,W,H,preset,spp,passes,sampler,"
    "max_depth,rr_depth,rfilter,seed,frame,denoise,quality,aux,temporal,cap_x_white,"
    "capped_energy_frac,nonfinite_px,neg_px,t_build,t_compile,t_render_wall,t_render_cpu,"
    "t_denoise_cpu,peak_rss_mb,ref_id,ref_spp,ref_halves_flip,rmse_capped,relmse,relmse_trim,"
    "psnr,ssim,flip,flip_p99,hdrflip,mean_bias,flicker_mc"
)
_TEXTS = (
    "scene,variant,git,mitsuba,drjit,llvm,oidn,cpu,preset,sampler,rfilter,denoise,quality,aux,"
    "temporal,ref_id"
)
_COUNTS = "threads,W,H,spp,passes,max_depth,rr_depth,seed,frame,nonfinite_px,neg_px,ref_spp"
_TEXT_COLUMNS, _COUNT_COLUMNS = frozenset(_TEXTS.split(",")), frozenset(_COUNTS.split(","))

COLUMNS = tuple(_HEADER.split(","))
"""Columns of convergence.csv, in order."""

SQUARED = frozenset({"relmse", "relmse_trim"})
"""Mean squares: they fall twice as fast as an error does, so slopes are of their root."""

_RESAMPLES = 4000


@dataclass(frozen=True, slots=True)
class Measure:
    """How a column is shown.

    Attributes:
        column: Its name in the file.
        title: What a reader calls it.
        form: Format of its numbers.
        mean: Whether seeds are averaged: the median of a skewed estimate is biased.
    """

    column: str
    title: str
    form: str
    mean: bool = False


MEASURES = (
    Measure("rmse_capped", "capped RMSE", ".3g"),
    Measure("relmse", "relMSE", ".3g"),
    Measure("relmse_trim", "relMSE trimmed", ".3g"),
    Measure("psnr", "PSNR [dB]", ".1f"),
    Measure("ssim", "SSIM", ".3f"),
    Measure("flip", "FLIP (quartiles)", ".4f"),
    Measure("flip_p99", "FLIP p99", ".3f"),
    Measure("hdrflip", "HDR-FLIP", ".3f"),
    Measure("mean_bias", "bias", "+.2%", mean=True),
    Measure("flicker_mc", "flicker [codes]", ".2f"),
)
"""Errors in the order in which tables show them."""

HEADINGS: Mapping[str, str] = MappingProxyType(
    {"spp": "spp", "max_depth": "depth", "quality": "OIDN quality", "denoise": "denoiser"}
)
"""Headings of grouping columns whose own name says too little."""


@dataclass(frozen=True, slots=True)
class Slope:
    """The slope of the logarithm of an error over the logarithm of spp.

    Attributes:
        value: Least squares over all pictures.
        low: Lower end of its 95 % interval; NaN with one seed.
        high: Upper end.
        seeds: How many repetitions it rests on.
        spp: Smallest and largest rung.
    """

    value: float
    low: float
    high: float
    seeds: int
    spp: tuple[int, int]


def plain_title(column: str) -> str:
    """Return what a reader calls an error, without what tables add to it."""
    titles = {measure.column: measure.title for measure in MEASURES}
    return titles.get(column, column).partition(" (")[0]


def append_row(path: Path, row: Mapping[str, Value]) -> None:
    """Add a measurement; the header is written first if the file is new.

    A line that a killed process left half-written is cut off before.

    Args:
        path: The CSV file; its folder exists.
        row: Values by column; columns left out stay blank.

    Raises:
        ValueError: If a column is unknown or a text holds a line break.
        InputError: If the file has other columns.
    """
    unknown = sorted(set(row) - set(COLUMNS))
    if unknown or any("\n" in value for value in row.values() if isinstance(value, str)):
        raise ValueError(f"unknown columns {unknown}" if unknown else "a value has two lines")
    whole = _whole_lines(path)
    with path.open("r+" if path.exists() else "w", encoding="utf-8", newline="") as stream:
        stream.seek(len(whole))
        stream.truncate()
        writer = csv.DictWriter(stream, COLUMNS, restval="", lineterminator="\n")
        if not whole:
            writer.writeheader()
        # NumPy's own floats may be written short: colour-science sets that, once imported.
        writer.writerow({k: float(v) if isinstance(v, float) else v for k, v in row.items()})
        stream.flush()


def read_rows(path: Path) -> list[TableRow]:
    """Return all whole measurements of a file, in order; none if there is no file.

    Raises:
        InputError: If the file has other columns or a value is no number.
    """
    lines = csv.reader(_whole_lines(path).decode("utf-8").splitlines())
    next(lines, None)
    return [_parsed(line, path, number) for number, line in enumerate(lines, start=2)]


def _whole_lines(path: Path) -> bytes:
    """Return a file's content up to its last line break, after a look at its header."""
    content = path.read_bytes() if path.exists() else b""
    whole = content[: content.rfind(b"\n") + 1]
    if whole and whole.splitlines()[0] != _HEADER.encode():
        raise InputError("has other columns; choose another folder", file=path, line=1)
    return whole


def _parsed(line: Sequence[str], path: Path, number: int) -> TableRow:
    """Return one line's values."""
    try:
        return {name: _value(name, text) for name, text in zip(COLUMNS, line, strict=True)}
    except ValueError as error:
        raise InputError(f"damaged ({error})", file=path, line=number) from error


def _value(column: str, text: str) -> Value:
    """Return a cell's value."""
    if column in _TEXT_COLUMNS:
        return text
    if not text:
        return float("nan")
    return int(text) if column in _COUNT_COLUMNS and text != "nan" else float(text)


def cost(row: Mapping[str, Value]) -> float:
    """Return the CPU-seconds of a frame: rendering with its guides, and denoising."""
    parts = [float(row.get(key, "nan")) for key in ("t_render_cpu", "t_denoise_cpu")]
    return float(np.nansum(parts)) if np.isfinite(parts[0]) else float("nan")


def grouped(rows: Iterable[TableRow], by: Sequence[str]) -> dict[tuple[Value, ...], list[TableRow]]:
    """Return rows that share the values of some columns, sorted by these."""
    groups: dict[tuple[Value, ...], list[TableRow]] = {}
    for row in rows:
        groups.setdefault(tuple(row.get(name, "") for name in by), []).append(row)
    return {key: groups[key] for key in sorted(groups, key=_order)}


def _order(key: tuple[Value, ...]) -> tuple[tuple[bool, Value], ...]:
    """Return numbers before texts, so that both can be sorted."""
    return tuple((isinstance(value, str), value) for value in key)


def numbers(rows: Iterable[TableRow], column: str) -> Floats:
    """Return a column's finite or infinite values, (n,); unknown ones are left out."""
    values = np.array([float(row.get(column, "nan")) for row in rows], dtype=np.float64)
    return np.asarray(values[~np.isnan(values)])


def median(rows: Iterable[TableRow], column: str) -> float:
    """Return the median of a column; NaN if it holds nothing."""
    values = numbers(rows, column)
    return float(np.median(values)) if values.size else float("nan")


def summary(rows: Sequence[TableRow], *, by: Sequence[str]) -> list[str]:
    """Return the lines of a Markdown table: medians over seeds, and quartiles of FLIP.

    Args:
        rows: Measurements.
        by: Columns whose values make a line of their own.

    Returns:
        Lines without line break; empty without rows. Errors that were never measured
        have no column.
    """
    if not rows:
        return []
    shown = [measure for measure in MEASURES if numbers(rows, measure.column).size]
    titles = [HEADINGS.get(name, name) for name in by] + ["seeds", "CPU-s"]
    lines = [
        [*(shown_value(value) for value in key), str(len({row.get("seed") for row in some}))]
        + [f"{np.median([cost(row) for row in some]):.3g}"]
        + [_middle(some, measure) for measure in shown]
        for key, some in grouped(rows, by).items()
    ]
    return markdown([*titles, *(measure.title for measure in shown)], lines)


def _middle(rows: Sequence[TableRow], measure: Measure) -> str:
    """Return a measure's median in words, FLIP with quartiles."""
    values = numbers(rows, measure.column)
    if not values.size:
        return "-"
    text = f"{np.mean(values) if measure.mean else np.median(values):{measure.form}}"
    if measure.column != "flip" or values.size < 2:
        return text
    low, high = np.quantile(values, (0.25, 0.75))
    return f"{text} ({low:{measure.form}} to {high:{measure.form}})"


def shown_value(value: Value) -> str:
    """Return a value that a reader can tell from nothing."""
    return str(value) if value == value and value != "" else "-"


def markdown(titles: Sequence[str], lines: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table; a bar within a cell is escaped."""
    table = [titles, ["---"] * len(titles), *lines]
    return ["| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |" for cells in table]


def slope(rows: Sequence[TableRow], column: str) -> dict[str, Slope]:
    """Return how fast an error falls with spp, by sampler: raw rungs of the ladder.

    The interval resamples whole seeds, so that pictures of one seed may be alike.
    With few seeds such intervals are somewhat too narrow.

    Args:
        rows: Measurements; others than raw rungs are passed over.
        column: An error; of those in `SQUARED` the root is taken.

    Returns:
        Slopes by sampler; those with fewer than two rungs are left out.
    """
    raw = [row for row in rows if row["preset"] == LADDER and row["denoise"] == "none"]
    fits = {str(key[0]): _fit(some, column) for key, some in grouped(raw, ["sampler"]).items()}
    return {sampler: fit for sampler, fit in fits.items() if fit is not None}


def _fit(rows: Sequence[TableRow], column: str) -> Slope | None:
    """Return least squares through the logarithms of one sampler's rungs."""
    good = [row for row in rows if 0 < float(row.get(column, "nan")) < np.inf]
    rungs = [int(row["spp"]) for row in good]
    if len(set(rungs)) < 2:
        return None
    power = 0.5 if column in SQUARED else 1.0
    seeds = list(grouped(good, ["seed"]).values())
    sums = np.array([_sums(some, column, power) for some in seeds])
    picks = np.random.default_rng(1).multinomial(
        len(seeds), np.full(len(seeds), 1 / len(seeds)), size=_RESAMPLES
    )
    drawn = _steepness(picks @ sums)
    low, high = np.nanquantile(drawn, (0.025, 0.975)) if len(seeds) > 1 else (np.nan, np.nan)
    value = float(_steepness(sums.sum(axis=0)))
    return Slope(value, float(low), float(high), len(seeds), (min(rungs), max(rungs)))


def _sums(rows: Sequence[TableRow], column: str, power: float) -> Floats:
    """Return the moments of log(spp) and log(error) that a line's fit needs: 1, x, y, xx, xy."""
    x = np.log([float(row["spp"]) for row in rows])
    y = power * np.log([float(row[column]) for row in rows])
    return np.array([x.size, x.sum(), y.sum(), (x * x).sum(), (x * y).sum()])


def _steepness(sums: Floats) -> Floats:
    """Return the slopes of the lines with moments (..., 5); NaN where all spp are one."""
    count, x, y, xx, xy = np.moveaxis(sums, -1, 0)
    spread = count * xx - x * x
    return np.asarray((count * xy - x * y) / np.where(spread > 1e-9, spread, np.nan))


_MEASURES = (("flip", "FLIP", ".4f"), ("psnr", "PSNR [dB]", ".1f"))


def gains(rows: Sequence[TableRow]) -> list[str]:
    """Return the lines of a Markdown table: raw and denoised rungs of one sampler side by side.

    Args:
        rows: Measurements; others than rungs of the ladder are passed over.

    Returns:
        Lines without line break; empty if no rung is measured raw and denoised.
    """
    rungs = [row for row in rows if row["preset"] == LADDER]
    lines = []
    for (sampler, quality, spp), some in grouped(
        [row for row in rungs if row["denoise"] != "none"], ("sampler", "quality", "spp")
    ).items():
        raw = [row for row in rungs if row["denoise"] == "none" and row["sampler"] == sampler]
        line = [str(sampler), str(quality), str(spp)]
        for column, _, form in _MEASURES:
            line += _compared(raw, some, column, form, int(spp))
        if raw:
            lines.append(line)
    titles = ["sampler", "OIDN quality", "spp"]
    for _, title, _ in _MEASURES:
        titles += [f"{title} raw", "denoised", "equal raw spp"]
    return markdown(titles, lines) if lines else []


def _compared(
    raw: Sequence[TableRow], some: Sequence[TableRow], column: str, form: str, spp: int
) -> list[str]:
    """Return a measure raw, denoised, and the raw spp that leave it."""
    curve = {int(key[0]): median(rung, column) for key, rung in grouped(raw, ["spp"]).items()}
    own, denoised = curve.get(spp, np.nan), median(some, column)
    return [_shown(own, form), _shown(denoised, form), equal_spp(curve, denoised)]


def _shown(value: float, form: str) -> str:
    """Return a number, or a dash."""
    return f"{value:{form}}" if np.isfinite(value) else "-"


def equal_spp(curve: Mapping[int, float], value: float) -> str:
    """Return the samples per pixel at which a curve reaches a value, in words.

    Args:
        curve: A score by spp, which rises or falls with spp.
        value: The score to reach.

    Returns:
        Interpolated along the logarithm of spp (and of errors); `> 64` beyond the
        curve's ends; a dash if there is no curve.
    """
    known = {spp: score for spp, score in sorted(curve.items()) if np.isfinite(score)}
    if len(known) < 2 or not np.isfinite(value):
        return "-"
    places, scores = np.log(list(known)), np.array(list(known.values()))
    if scores[-1] < scores[0]:
        scores, value = -np.log(np.maximum(scores, 1e-12)), -np.log(max(value, 1e-12))
    # Noise may make a rung no better than the one before; interpolation needs order.
    better = np.diff(np.maximum.accumulate(scores), prepend=-np.inf) > 0
    places, scores = places[better], scores[better]
    if value > scores[-1]:
        return f"> {max(known)}"
    if value < scores[0]:
        return f"< {min(known)}"
    spp = float(np.exp(np.interp(value, scores, places)))
    return f"{spp:.0f}" if spp >= 10 else f"{spp:.2g}"
