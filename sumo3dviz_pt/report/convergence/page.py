"""Writes the page about what `converge` measured: tables, slopes and plots in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.report.convergence.ladder import MeasuredSubject, halves_flip
from sumo3dviz_pt.report.convergence.plan import PictureLook, Reference
from sumo3dviz_pt.report.convergence.table import (
    DEPTH,
    LADDER,
    Slope,
    TableRow,
    Value,
    cost,
    gains,
    grouped,
    markdown,
    numbers,
    plain_title,
    shown_value,
    slope,
    summary,
)
from sumo3dviz_pt.report.plots import crops_plot, depth_plot, error_plot, flip_maps

PAGE = "report.md"
PLOTS: Mapping[str, str] = MappingProxyType(
    {
        "error.png": "Error against run time, both logarithmic: medians over seeds as lines,"
        " seeds as faint points, presets as stars. Only raw pictures should follow the guide.",
        "crops.png": "The same windows of several pictures, with what they cost.",
        "flip.jpg": "Where the pictures differ from the reference: FLIP, on one scale.",
        "depth.png": "What shorter paths change: same seeds, raw.",
    }
)
"""Plots that the page shows if they lie beside it, with their captions."""

SLOPE_RANGE = (-0.55, -0.45)
"""Where the slope of capped RMSE lies if the independent sampler is sound; theory: -0.5."""

BIAS_LIMIT = 0.01
"""Largest difference of the mean radiance that a preset may have by day."""

INDEPENDENT = "independent"
_SLOPES = ("rmse_capped", "relmse_trim", "flip")
_ABOUT = (
    ("scene", "scene"), ("variant", "variant"), ("git", "git"), ("mitsuba", "Mitsuba"),
    ("drjit", "Dr.Jit"), ("llvm", "LLVM"), ("oidn", "OIDN"), ("cpu", "CPU"),
    ("threads", "threads"), ("rfilter", "pixel filter"), ("ref_id", "reference"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class PageNotes:
    """What the page says beside the rows.

    Attributes:
        title: Of the page.
        command: What made it, and goes on if it is incomplete.
        facts: Names and values, such as the camera and the time.
        own: The reference's own error by column, as `error_plot` takes it.
        done: Measurements that were made.
        wanted: Measurements that were asked for.
        stopped: Why some are missing, such as `the budget ended`.
        remarks: More sentences, such as parts that were left out and why.
    """

    title: str
    command: str = ""
    facts: Mapping[str, Value] = field(default_factory=dict)
    own: Mapping[str, float] = field(default_factory=dict)
    done: int = 0
    wanted: int = 0
    stopped: str = "stopped"
    remarks: tuple[str, ...] = ()


def write_page(folder: Path, rows: Sequence[TableRow], notes: PageNotes) -> Path:
    """Write report.md; the same rows, notes and plots give the same page.

    Args:
        folder: Where to; those of `PLOTS` that lie there are shown.
        rows: Measurements.
        notes: What they do not say.

    Returns:
        The page.
    """
    parts = [
        [f"# {notes.title}"],
        _incomplete(notes),
        _about(rows, notes),
        _reference(rows, notes),
        _presets(rows),
        _pictures(folder, ("error.png", "crops.png", "flip.jpg")),
        _gains(rows),
        _slopes(rows),
        _ladder(rows),
        _depth(rows, _pictures(folder, ("depth.png",))),
        _legend(),
    ]
    return write_text(folder / PAGE, [line for part in parts for line in (*part, "") if part])


def write_text(path: Path, lines: Sequence[str]) -> Path:
    """Write lines of text; the file's path."""
    write_atomically(path, "\n".join(lines).rstrip() + "\n")
    return path


def _incomplete(notes: PageNotes) -> list[str]:
    """Return what is missing and how to go on."""
    if notes.done >= notes.wanted:
        return []
    text = f"**Incomplete.** {notes.stopped[:1].upper()}{notes.stopped[1:]}: {notes.done} of"
    return [f"{text} {notes.wanted} measurements; the same command goes on."]


def _about(rows: Sequence[TableRow], notes: PageNotes) -> list[str]:
    """Return what was measured, where and with what."""
    facts = [(name, shown_value(value)) for name, value in notes.facts.items()]
    if rows:
        sizes = sorted({(int(row["W"]), int(row["H"])) for row in rows})
        facts.append(("size", ", ".join(f"{width}x{height}" for width, height in sizes)))
    for column, title in _ABOUT:
        values = sorted({shown_value(row.get(column, "")) for row in rows} - {"-"})
        if values and title not in notes.facts:
            facts.append((title, ", ".join(values)))
    compiled = numbers(rows, "t_compile")
    if compiled.size:
        text = f"{compiled.max():.1f} CPU-s at most"
        facts.append(("compiling and recording, in no table", text))
    made = ["", "Made by:", "", f"    {notes.command}"] if notes.command else []
    return ["## What was measured", "", *markdown(["what", "value"], facts), *made]


def _reference(rows: Sequence[TableRow], notes: PageNotes) -> list[str]:
    """Return how good the reference itself is."""
    spp, halves = numbers(rows, "ref_spp"), numbers(rows, "ref_halves_flip")
    lines = ["## The reference", ""]
    if spp.size:
        lines.append(
            f"Independent sampler, seeds of its own, no cap, {spp.max():.0f} spp."
            f" FLIP of one half of its samples against the other: {halves.max():.4f}."
            if halves.size
            else f"Independent sampler, seeds of its own, no cap, {spp.max():.0f} spp."
        )
    if len(set(spp)) > 1:
        lines.append(f"It grew: some rows were judged against {spp.min():.0f} spp.")
    lines += [
        f"Its own {plain_title(column)}: {value:.3g}."
        for column, value in notes.own.items()
        if np.isfinite(value)
    ]
    lines += notes.remarks
    return lines if len(lines) > 2 else []


def _presets(rows: Sequence[TableRow]) -> list[str]:
    """Return what each preset costs and leaves."""
    own = [row for row in rows if row["preset"] not in (LADDER, DEPTH)]
    if not own:
        return ["## Presets", "", "Not measured yet."]
    by = ("preset", "spp", "max_depth", "denoise", "quality")
    return ["## Presets", "", *summary(own, by=by), "", *_bias_verdicts(own)]


def _bias_verdicts(rows: Sequence[TableRow]) -> list[str]:
    """Return whether the presets' mean radiance is right."""
    groups = grouped(rows, ["preset", "denoise"])
    biases = [
        (str(key[0]), float(np.mean(numbers(some, "mean_bias")))) for key, some in groups.items()
    ]
    wrong = [f"{name} ({value:+.2%})" for name, value in biases if abs(value) > BIAS_LIMIT]
    if wrong:
        return [f"Mean radiance off by more than {BIAS_LIMIT:.0%}: {', '.join(wrong)}."]
    if not all(np.isfinite(value) for _, value in biases):
        return []
    return [f"The mean radiance of every preset is right within {BIAS_LIMIT:.0%}."]


def _gains(rows: Sequence[TableRow]) -> list[str]:
    """Return what denoising is worth."""
    table = gains(rows)
    text = "Raw spp that leave the same error, interpolated: what denoising saves at most."
    return ["## Denoising", "", *table, "", text] if table else []


def _slopes(rows: Sequence[TableRow]) -> list[str]:
    """Return how fast errors fall with spp."""
    lines = [
        _slope_cells(fit, sampler, column)
        for column in _SLOPES
        for sampler, fit in slope(rows, column).items()
    ]
    head = ["sampler", "error", "slope", "95 % interval", "spp", "seeds", "verdict"]
    if not lines:
        return ["## Slopes", "", "Too few rungs of the ladder are measured for slopes."]
    low, high = SLOPE_RANGE
    return [
        "## Slopes", "", *markdown(head, lines), "",
        f"Of the logarithm of the error over that of spp, raw. Theory asks for -0.5 of capped RMSE"
        f" with the {INDEPENDENT} sampler; the test is [{low}, {high}], and at least as steep with"
        " others. Of mean squares the root is taken. FLIP follows no such law. The reference's own"
        " error flattens slopes a little.",
    ]  # fmt: skip


def _slope_cells(fit: Slope, sampler: str, column: str) -> list[str]:
    """Return a line of the table of slopes."""
    word = verdict(fit, sampler) if column == "rmse_capped" else "-"
    rungs = f"{fit.spp[0]} to {fit.spp[1]}"
    return [sampler, plain_title(column), f"{fit.value:+.3f}", _interval(fit), rungs,
            str(fit.seeds), word]  # fmt: skip


def _interval(fit: Slope) -> str:
    """Return a slope's interval in words."""
    return f"{fit.low:+.3f} to {fit.high:+.3f}" if np.isfinite(fit.low) else "one seed: none"


def verdict(fit: Slope, sampler: str) -> str:
    """Return whether the slope of capped RMSE is what theory asks of a sampler.

    Args:
        fit: The slope.
        sampler: Its sampler; only `independent` can be too steep.
    """
    low, high = SLOPE_RANGE
    if fit.value > high:
        return "**too flat**"
    if sampler != INDEPENDENT:
        return "at least as steep"
    if fit.value < low:
        return "**too steep**"
    sure = fit.low >= low and fit.high <= high
    return "inside" if sure or np.isnan(fit.low) else "inside, the interval is not"


def _ladder(rows: Sequence[TableRow]) -> list[str]:
    """Return every rung."""
    rungs = [row for row in rows if row["preset"] == LADDER]
    table = summary(rungs, by=("denoise", "quality", "sampler", "spp"))
    return ["## Ladder", "", *(table or ["Not measured yet."])]


def _depth(rows: Sequence[TableRow], pictures: Sequence[str]) -> list[str]:
    """Return what path depth changes."""
    some = [row for row in rows if row["preset"] == DEPTH]
    if not some:
        return ["## Path depth", "", "Not measured yet."]
    return ["## Path depth", "", *summary(some, by=("max_depth", "spp")), "", *pictures]


def _pictures(folder: Path, names: Sequence[str]) -> list[str]:
    """Return those plots that exist, with their captions."""
    shown = [name for name in names if (folder / name).is_file()]
    lines = [(f"![{PLOTS[name].partition(':')[0]}]({name})", "", PLOTS[name], "") for name in shown]
    return [line for group in lines for line in group][:-1]


def _legend() -> list[str]:
    """Return what the columns mean."""
    return [
        "## Columns",
        "",
        "CPU-s: CPU-seconds a frame, all threads: rendering with guides, and denoising; loading"
        " and compiling are not in it. Capped RMSE: of radiance, cut at 4 x white. relMSE: squared"
        " error over squared reference; trimmed: without its worst 0.1 %. PSNR, SSIM, FLIP and its"
        " 99th percentile: of developed pictures, at 67 pixels a degree. HDR-FLIP: worst over"
        " exposures. Bias: of the mean radiance, visible emitters left out. Flicker: mean change"
        " between frames that motion does not explain, in 8-bit codes. Medians over seeds,"
        " of bias the mean.",
    ]


PICTURES = "pictures"
"""Folder of each group's first picture."""

REFERENCE = "reference"


def write_results(
    folder: Path,
    subject: MeasuredSubject,
    reference: Reference,
    rows: Sequence[TableRow],
    *,
    wanted: int,
    command: str,
) -> Path:
    """Write plots and page; return the page.

    Args:
        folder: Where rows and pictures lie.
        subject: What was measured.
        reference: What it was judged against.
        rows: Measurements.
        wanted: How many were asked for.
        command: What made them.
    """
    own = own_errors(reference, subject.look)
    if rows:
        error_plot(rows, folder / "error.png", own=own)
        _galleries(folder, rows, subject.look)
    if any(row["preset"] == DEPTH for row in rows):
        depth_plot(rows, folder / "depth.png")
    production = subject.production
    facts: dict[str, Value] = {"camera": production.camera, "time [s]": float(production.times[-1])}
    notes = PageNotes(
        title=f"Error against run time: {subject.name}",
        command=command,
        facts={**facts, "road users in view": road_users(subject)},
        own=own,
        done=len(rows),
        wanted=wanted,
        stopped="the budget ended",
    )
    return write_page(folder, rows, notes)


def road_users(subject: MeasuredSubject) -> int:
    """Return how many the measured frame shows."""
    return len(subject.state.users)


def own_errors(reference: Reference, look: PictureLook) -> dict[str, float]:
    """Return the reference's own error by column: of its halves against each other, halved.

    The mean of two independent halves is off by half of what they differ by; for FLIP,
    which is no root of a square, it is a guess on the safe side.
    """
    return {
        "rmse_capped": reference.halves_rmse / look.white / 2,
        "flip": halves_flip(reference, look) / 2,
    }


def picture_name(row: TableRow) -> str:
    """Return what a row's picture is called in the folder of pictures."""
    if row["preset"] not in (LADDER, DEPTH):
        return str(row["preset"])
    kind = row["sampler"] if row["denoise"] == "none" else f"oidn-{row['quality']}"
    return f"{row['preset']}_{kind}_{row['spp']}_depth{row['max_depth']}"


def _galleries(folder: Path, rows: Sequence[TableRow], look: PictureLook) -> None:
    """Draw crops and maps of the presets, each with the raw picture of equal time."""
    presets = grouped((r for r in rows if r["preset"] not in (LADDER, DEPTH)), ["preset"])
    raw = [row for row in rows if _is_plain(row)]
    shown: dict[str, Image] = {}
    costs: dict[str, float] = {}
    # With more than three presets, columns would be too narrow to read.
    for (name,), own in sorted(presets.items(), key=lambda item: _cost(item[1]))[-3:]:
        for some in (*_nearest(raw, _cost(own)), own):
            label = f"raw, {some[0]['spp']} spp" if some is not own else str(name)
            shown[label] = _picture(folder, some[0], look)
            costs[label] = _cost(some)
    if not presets:
        return
    shown["reference"] = look.develop(read_exr(folder / PICTURES / f"{REFERENCE}.exr")[0])
    crops_plot(shown, folder / "crops.png", costs=costs)
    flip_maps(shown, folder / "flip.jpg", costs=costs)


def _is_plain(row: TableRow) -> bool:
    """Return whether a row is a raw rung of the default sampler."""
    return row["preset"] == LADDER and row["denoise"] == "none" and row["sampler"] != "independent"


def _cost(rows: Sequence[TableRow]) -> float:
    """Return the median CPU-seconds."""
    return float(np.median([cost(row) for row in rows]))


def _nearest(raw: Sequence[TableRow], seconds: float) -> list[list[TableRow]]:
    """Return the raw rung that costs most nearly the same, if there is any yet."""
    rungs = grouped(raw, ["spp"]).values()
    return sorted(rungs, key=lambda rows: abs(np.log(_cost(rows) / seconds)))[:1]


def _picture(folder: Path, row: TableRow, look: PictureLook) -> Image:
    """Return a stored picture, developed."""
    return look.develop(read_exr(folder / PICTURES / f"{picture_name(row)}.exr")[0])
