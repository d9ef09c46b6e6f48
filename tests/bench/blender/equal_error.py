"""CPU time to equal error: curves of measured rows, and their table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats

CYCLES = "Cycles"


@dataclass(frozen=True, slots=True)
class Row:
    """What one renderer's pictures of one number of samples cost, and how wrong they are.

    Attributes:
        renderer: Its name.
        spp: Samples per pixel.
        denoised: Whether OIDN cleaned the picture.
        runs: How many pictures.
        cpu: CPU-seconds of all threads for a later picture, the median.
        flip: FLIP against the renderer's own reference, the mean.
        relmse: Relative mean squared error of capped radiance, likewise.
    """

    renderer: str
    spp: int
    denoised: bool
    runs: int
    cpu: float
    flip: float
    relmse: float


def row_of(
    what: tuple[str, int], runs: Sequence[tuple[float, float, float]], *, denoised: bool = False
) -> Row:
    """Sum pictures up.

    Args:
        what: Renderer, and samples.
        runs: CPU-seconds, FLIP and relative error of each picture.
        denoised: As in `Row`.
    """
    cpu, flips, errors = np.array(runs).T
    means = float(np.median(cpu)), float(flips.mean()), float(errors.mean())
    return Row(*what, denoised, len(runs), *means)


def cost_at(errors: Floats, costs: Floats, wanted: float) -> float:
    """Return the cost of an error, between measured ones, both logarithmic; NaN beyond them.

    Args:
        errors: Measured ones, (n,), any order.
        costs: Of the same pictures, (n,).
        wanted: The error.
    """
    order = np.argsort(errors)
    x, y = np.log(np.asarray(errors)[order]), np.log(np.asarray(costs)[order])
    return float(np.exp(np.interp(np.log(wanted), x, y, left=np.nan, right=np.nan)))


def curve(rows: Sequence[Row], renderer: str, error: str) -> tuple[Floats, Floats]:
    """Return errors and costs of a renderer's pictures that nothing cleaned."""
    own = [asdict(row) for row in rows if row.renderer == renderer and not row.denoised]
    return np.array([row[error] for row in own]), np.array([row["cpu"] for row in own])


def measured(rows: Sequence[Row]) -> list[str]:
    """Return the rows as a Markdown table."""
    lines = [
        "| renderer | samples | runs | CPU-s | FLIP | relative MSE |",
        "|---|--:|--:|--:|--:|--:|",
    ]
    for row in rows:
        name = row.renderer + (" + OIDN" if row.denoised else "")
        errors = f"{row.flip:.4f} | {row.relmse:.4f}"
        lines.append(f"| {name} | {row.spp} | {row.runs} | {row.cpu:.2f} | {errors} |")
    return lines


def at_equal_error(rows: Sequence[Row]) -> list[str]:
    """Return what each renderer takes to the errors that Cycles has, as a Markdown table."""
    names = list(dict.fromkeys(row.renderer for row in rows))
    others = [name for name in names if name != CYCLES]
    lines = [
        f"| error of {CYCLES} at | " + " | ".join(f"{n} [CPU-s]" for n in (CYCLES, *others)) + " | "
        + " | ".join(f"{n} / {CYCLES}" for n in others) + " |",
        "|---|" + "--:|" * (len(others) * 2 + 1),
    ]  # fmt: skip
    for row in rows:
        if row.renderer != CYCLES or row.denoised:
            continue
        for error in ("flip", "relmse"):
            wanted = getattr(row, error)
            costs = [cost_at(*curve(rows, name, error), wanted) for name in others]
            shown = " | ".join(_or_dash(cost) for cost in (row.cpu, *costs))
            ratios = " | ".join(_or_dash(cost / row.cpu) for cost in costs)
            name = "FLIP" if error == "flip" else "relative MSE"
            lines.append(f"| {row.spp} samples: {name} {wanted:.4f} | {shown} | {ratios} |")
    return lines


def _or_dash(value: float) -> str:
    """Return a number, or a dash where an error was not reached, or already passed."""
    return f"{value:.2f}" if value == value else "-"
