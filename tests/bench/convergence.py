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
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.image import metrics
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.jobfile import load_job
from sumo3dviz_pt.pipeline import Production, Request, opened, prepare
from sumo3dviz_pt.render.denoise import denoise

LADDER = (1, 4, 16, 64, 256)
SEEDS = (1, 2, 3, 4, 5)


def with_quality(production: Production, seed: int, **changes: Any) -> Production:
    """The same shot with other samples."""
    quality = production.quality.model_copy(update=changes)
    job = production.job.model_copy(update={"seed": seed})
    return replace(production, quality=quality, job=job)


def rendered(production: Production) -> tuple[np.ndarray, float]:
    """Radiance and CPU-seconds of one frame, compilation apart."""
    state = production.shot.frame_at(float(production.times[0]))
    with opened(production, film=False) as session:
        session.render(state)  # compiles
        result = session.render(state)
    return result.radiance, result.cpu["render"]


def reference(production: Production, spp: int) -> tuple[np.ndarray, float]:
    """A picture without cap from its own seeds, and the distance of its halves."""
    options = {"spp": spp // 2, "pass_spp": 64, "cap": None, "denoise": "none", "haze": False}
    halves = [rendered(with_quality(production, seed, **options))[0] for seed in (1001, 1002)]
    return (halves[0] + halves[1]) / 2, metrics.capped_rmse(halves[0], halves[1], cap=4.0) / 2


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


def measure(production: Production, truth: np.ndarray, spp: int, seed: int) -> list[dict[str, Any]]:
    """One point of the ladder, raw and denoised."""
    options = {"spp": spp, "pass_spp": min(spp, 16), "denoise": "none", "haze": False, "guides": False}
    picture, seconds = rendered(with_quality(production, seed, **options))
    start = time.process_time()
    clean = denoise(picture, quality="high")
    denoising = time.process_time() - start
    rows = []
    for kind, image, cost in (("raw", picture, seconds), ("oidn", clean, seconds + denoising)):
        values = errors(image, truth, production.exposure)
        rows.append({"kind": kind, "spp": spp, "seed": seed, "cpu": cost, **values})
    return rows


def summary(rows: list[dict[str, Any]]) -> list[str]:
    """A Markdown table of medians over seeds."""
    lines = [
        "| spp | kind | CPU-s | capped RMSE | relMSE (trimmed) | PSNR [dB] | FLIP |",
        "|---|---|---|---|---|---|---|",
    ]
    for spp in sorted({row["spp"] for row in rows}):
        for kind in ("raw", "oidn"):
            some = [row for row in rows if row["spp"] == spp and row["kind"] == kind]
            middle = {key: float(np.median([row[key] for row in some])) for key in some[0] if key != "kind"}
            lines.append(
                f"| {spp} | {kind} | {middle['cpu']:.2f} | {middle['rmse_capped']:.4f} |"
                f" {middle['relmse_trim']:.4f} | {middle['psnr']:.1f} | {middle['flip']:.3f} |"
            )
    return lines


def slope(rows: list[dict[str, Any]]) -> float:
    """Of log capped RMSE over log CPU-seconds, raw."""
    raw = [row for row in rows if row["kind"] == "raw"]
    x = np.log([row["cpu"] for row in raw])
    return float(np.polyfit(x, np.log([row["rmse_capped"] for row in raw]), 1)[0])


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
    parser.add_argument("--size", type=int, nargs=2, default=(480, 270))
    parser.add_argument("--reference", type=int, default=2048, help="spp of the reference")
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    request = Request(camera=options.camera, quality="preview", size=tuple(options.size))
    production = prepare(load_job(options.scene), request, np.array([options.time]))
    truth, own = reference(production, options.reference)
    rows = [row for spp in LADDER for seed in SEEDS for row in measure(production, truth, spp, seed)]
    options.output.mkdir(parents=True, exist_ok=True)
    with (options.output / "convergence.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    lines = [
        *summary(rows),
        "",
        f"Slope of capped RMSE over CPU-seconds, raw: {slope(rows):.3f}."
        f" The reference ({options.reference} spp) is off by {own:.5f} (half against half / 2).",
    ]
    (options.output / "convergence.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    plot(rows, options.output / "convergence.png")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
