"""Says what denoising is worth: how many raw samples leave the same error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sumo3dviz_pt.report.convergence.table import LADDER, TableRow, grouped, markdown, median

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
