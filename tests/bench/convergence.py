"""Error against run time of a scene: a reference, a ladder of spp, raw and denoised.

Run from the repository's root, on a quiet machine:

    python tests/bench/convergence.py -o docs/_bench

The reference uses other seeds and no cap, and its own error (half against half) is
printed. Errors are those of facts/denoising.md: RMSE capped at 4 x white, relative MSE
without its worst 0.1 %, PSNR and FLIP of the developed pictures.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.image import metrics
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.jobfile import load_job
from sumo3dviz_pt.pipeline import Production, Request, opened, prepare

LADDER = (1, 4, 16, 64, 256)
SEEDS = (1, 2, 3, 4, 5)


def rendered(
    production: Production, seeds: Sequence[int], **changes: Any
) -> Iterator[tuple[np.ndarray, float]]:
    """One frame for each seed: radiance and CPU-seconds, compilation and loading apart."""
    quality = production.quality.model_copy(update=changes)
    state = production.shot.frame_at(float(production.times[0]))
    with opened(replace(production, quality=quality), film=False) as session:
        for number, seed in enumerate([seeds[0], *seeds]):
            session.settings = replace(session.settings, seed=seed)
            result = session.render(state)
            if number:
                spent = sum(result.cpu[key] for key in ("render", "guides", "denoise"))
                yield result.radiance, spent


def reference(production: Production, spp: int) -> tuple[np.ndarray, float]:
    """A picture without cap from its own seeds, and the error of its mean."""
    options = {"spp": spp // 4, "pass_spp": 64, "cap": None, "denoise": "none", "haze": False}
    quarters = [image for image, _ in rendered(production, (1001, 1002, 1003, 1004), **options)]
    halves = (quarters[0] + quarters[1]) / 2, (quarters[2] + quarters[3]) / 2
    return (halves[0] + halves[1]) / 2, metrics.capped_rmse(*halves, cap=4.0) / 2


def errors(picture: np.ndarray, truth: np.ndarray, exposure: float) -> dict[str, float]:
    """All error measures of one picture."""
    shown, wanted = (develop_float(image, exposure=exposure) for image in (picture, truth))
    return {
        "rmse_capped": metrics.capped_rmse(picture, truth, cap=4.0),
        "relmse_trim": metrics.relative_mse(picture, truth, trim=0.001),
        "psnr": metrics.psnr(shown, wanted),
        "flip": metrics.flip(shown, wanted),
        "mean_bias": metrics.mean_bias(picture, truth),
    }


def measure(production: Production, truth: np.ndarray, spp: int) -> Iterator[dict[str, Any]]:
    """One step of the ladder, raw and denoised, for all seeds."""
    for kind, denoiser in (("raw", "none"), ("oidn", "high")):
        options = {"spp": spp, "pass_spp": min(spp, 16), "haze": False, "denoise": denoiser}
        for seed, (image, cost) in zip(SEEDS, rendered(production, SEEDS, **options), strict=True):
            values = errors(image, truth, production.exposure)
            yield {"kind": kind, "spp": spp, "seed": seed, "cpu": cost, **values}


def summary(rows: list[dict[str, Any]]) -> list[str]:
    """A Markdown table of medians over seeds."""
    lines = [
        "| spp | kind | CPU-s | capped RMSE | relMSE (trimmed) | PSNR [dB] | FLIP |",
        "|---|---|---|---|---|---|---|",
    ]
    for spp in sorted({row["spp"] for row in rows}):
        for kind in ("raw", "oidn"):
            some = [row for row in rows if row["spp"] == spp and row["kind"] == kind]
            keys = [key for key in some[0] if key != "kind"]
            middle = {key: float(np.median([row[key] for row in some])) for key in keys}
            lines.append(
                f"| {spp} | {kind} | {middle['cpu']:.2f} | {middle['rmse_capped']:.4f} |"
                f" {middle['relmse_trim']:.4f} | {middle['psnr']:.1f} | {middle['flip']:.3f} |"
            )
    return lines


def slope(rows: list[dict[str, Any]], error: str, over: str) -> float:
    """Of the logarithm of an error over that of a column, raw."""
    raw = [row for row in rows if row["kind"] == "raw"]
    x, y = (np.log([float(row[key]) for row in raw]) for key in (over, error))
    return float(np.polyfit(x, y, 1)[0])


def conclusion(rows: list[dict[str, Any]], spp: int, own: float) -> str:
    """Slopes and the reference's own error, in words."""
    # A mean square falls twice as fast as its root.
    relative = slope(rows, "relmse_trim", "spp") / 2
    capped = slope(rows, "rmse_capped", "spp")
    return (
        f"Slopes over samples, raw: {relative:.2f} for the root of the trimmed relative MSE,"
        f" {capped:.2f} for capped RMSE, which flattens where it meets the reference's own"
        f" error: {own:.4f} at {spp} spp (half against half / 2) and the glints that the"
        " reference, unlike a picture, does not cap."
    )


def plot(rows: list[dict[str, Any]], path: Path) -> None:
    """Log-log error over CPU-seconds with a -0.5 guide."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for axis, key in zip(axes, ("rmse_capped", "flip"), strict=True):
        for kind, marker in (("raw", "o"), ("oidn", "s")):
            some = [row for row in rows if row["kind"] == kind]
            axis.loglog([r["cpu"] for r in some], [r[key] for r in some], marker, ms=4, label=kind)
        times = np.array(sorted(row["cpu"] for row in rows if row["kind"] == "raw"))
        first = np.median([r[key] for r in rows if r["kind"] == "raw" and r["spp"] == LADDER[0]])
        axis.loglog(times, first * (times / times[0]) ** -0.5, "k:", lw=1, label="slope -0.5")
        axis.set(xlabel="CPU-seconds a frame", ylabel=key)
        axis.grid(visible=True, which="both", alpha=0.25)
        axis.legend()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Run the ladder and write table, CSV and plot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path, nargs="?", default=Path("examples/ronda/scene.yaml"))
    parser.add_argument("--camera", default="overview")
    parser.add_argument("--time", type=float, default=492.0)
    parser.add_argument("--size", type=int, nargs=2, default=(384, 216))
    parser.add_argument("--reference", type=int, default=1024, help="spp of the reference")
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    request = Request(camera=options.camera, quality="preview", size=tuple(options.size))
    production = prepare(load_job(options.scene), request, np.array([options.time]))
    truth, own = reference(production, options.reference)
    rows = [row for spp in LADDER for row in measure(production, truth, spp)]
    options.output.mkdir(parents=True, exist_ok=True)
    with (options.output / "convergence.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    lines = [*summary(rows), "", conclusion(rows, options.reference, own)]
    (options.output / "convergence.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    plot(rows, options.output / "convergence.png")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
