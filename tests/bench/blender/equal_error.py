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


def _own(rows: Sequence[Row], renderer: str, what: str) -> Floats:
    """Return a number of each of a renderer's pictures that nothing cleaned, (n,)."""
    own = [asdict(row) for row in rows if row.renderer == renderer and not row.denoised]
    return np.array([row[what] for row in own], float)


def per_sample(rows: Sequence[Row], renderer: str) -> float:
    """Return the CPU-seconds of a further sample of all pixels; NaN for a single picture."""
    spp, cpu = _own(rows, renderer, "spp"), _own(rows, renderer, "cpu")
    first, last = spp.argmin(), spp.argmax()
    return float((cpu[last] - cpu[first]) / (spp[last] - spp[first])) if last != first else np.nan


def ratios(rows: Sequence[Row], row: Row, renderer: str, error: str) -> tuple[float, float, float]:
    """Return what a renderer takes to the error of another's picture.

    Returns:
        CPU-seconds, against those of the other, and the same without what a frame costs besides
        its samples; NaN where the renderer has no such error.
    """
    errors, wanted = _own(rows, renderer, error), getattr(row, error)
    whole = cost_at(errors, _own(rows, renderer, "cpu"), wanted)
    samples = cost_at(errors, _own(rows, renderer, "spp"), wanted)
    own, other = per_sample(rows, renderer), per_sample(rows, row.renderer)
    return whole, whole / row.cpu, samples * own / (row.spp * other)


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
    heads = [f"{name} [CPU-s] | against {CYCLES} | by samples alone" for name in others]
    lines = [
        f"| error of {CYCLES} at | {CYCLES} [CPU-s] | {' | '.join(heads)} |",
        "|---|" + "--:|" * (len(others) * 3 + 1),
    ]
    for row in rows:
        if row.renderer != CYCLES or row.denoised:
            continue
        for error, name in (("flip", "FLIP"), ("relmse", "relative MSE")):
            found = [number for other in others for number in ratios(rows, row, other, error)]
            cells = " | ".join(_or_dash(number) for number in (row.cpu, *found))
            samples = f"{row.spp} sample{'s' if row.spp > 1 else ''}"
            lines.append(f"| {samples}: {name} {getattr(row, error):.4f} | {cells} |")
    costs = ", ".join(f"{name} {per_sample(rows, name):.3f}" for name in names)
    return [*lines, "", f"A further sample of all pixels [CPU-s]: {costs}."]


def _or_dash(value: float) -> str:
    """Return a number, or a dash where an error was not reached, or already passed."""
    return f"{value:.2f}" if value == value else "-"
