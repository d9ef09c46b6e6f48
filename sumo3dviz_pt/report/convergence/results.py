"""Draws and describes what `converge` measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.report.convergence.measure import Subject, halves_flip
from sumo3dviz_pt.report.convergence.page import PageNotes, write_page
from sumo3dviz_pt.report.convergence.reference import Reference
from sumo3dviz_pt.report.convergence.scores import PictureLook
from sumo3dviz_pt.report.convergence.table import DEPTH, LADDER, TableRow, Value, cost, grouped
from sumo3dviz_pt.report.films.galleries import crops_plot, flip_maps
from sumo3dviz_pt.report.plots import depth_plot, error_plot

PICTURES = "pictures"
"""Folder of each group's first picture."""

REFERENCE = "reference"


def write_results(
    folder: Path,
    subject: Subject,
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


def road_users(subject: Subject) -> int:
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
