"""Made-up measurements with known slopes."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.report.convergence.table import COLUMNS, DEPTH, LADDER, TableRow

SLOPES = {"independent": -0.5, "multijitter": -0.6}
RUNGS = (1, 4, 16, 64)
SEEDS = (1, 2, 3, 4, 5)


def row(preset: str, spp: int, error: float, **values: str | int | float) -> TableRow:
    """A measurement with an error; everything else is plausible."""
    known: TableRow = dict.fromkeys(COLUMNS, float("nan"))
    for column in ("variant", "llvm", "quality", "aux", "temporal", "ref_id", "rfilter"):
        known[column] = ""
    known.update(
        scene="ronda", git="12e4567", mitsuba="3.9.1", drjit="1.5.0", oidn="2.5.1",
        cpu="Some | processor", threads=2, W=480, H=270, preset=preset, spp=spp, passes=1,
        sampler="multijitter", max_depth=8, rr_depth=5, seed=1, frame=0, denoise="none",
        t_compile=5.0, t_render_cpu=0.2 + 0.13 * spp, t_denoise_cpu=0.0, ref_spp=4096,
        ref_halves_flip=0.02, rmse_capped=error, relmse=2 * error**2, relmse_trim=error**2,
        psnr=-20 * np.log10(error), ssim=1 - error, flip=error**0.65, flip_p99=error**0.5,
        hdrflip=1.3 * error**0.65, mean_bias=-0.004,
    )  # fmt: skip
    return {**known, **values}


def ladder(noise: float = 0.02) -> list[TableRow]:
    """Raw rungs by both samplers and denoised ones, every seed a little different."""
    rng = np.random.default_rng(3)
    rows = []
    for spp in RUNGS:
        for seed in SEEDS:
            luck = float(np.exp(rng.normal(0, noise)))
            for sampler, slope in SLOPES.items():
                error = 0.2 * spp**slope * luck
                rows.append(row(LADDER, spp, error, sampler=sampler, seed=seed))
            error = 0.06 * spp**-0.35 * luck
            best = {"denoise": "oidn", "quality": "high", "t_denoise_cpu": 1.2}
            rows.append(row(LADDER, spp, error, seed=seed, **best))
    return rows


def presets() -> list[TableRow]:
    """Two presets, one of them with too dark a mean."""
    fast = {"denoise": "oidn", "quality": "fast", "t_denoise_cpu": 0.3}
    best = {"denoise": "oidn", "quality": "high", "t_denoise_cpu": 1.2, "flicker_mc": 1.5}
    return [
        item
        for seed in SEEDS
        for item in (
            row("draft", 2, 0.06, seed=seed, mean_bias=-0.031, max_depth=6, **fast),
            row("standard", 16, 0.02, seed=seed, **best),
        )
    ]


def depths() -> list[TableRow]:
    """Shallow paths lose light."""
    biases = {2: -0.086, 4: -0.028, 8: -0.003, 16: 0.0}
    return [
        row(DEPTH, 32, 0.03, max_depth=depth, mean_bias=bias, flip=0.07 - bias)
        for depth, bias in biases.items()
    ]
