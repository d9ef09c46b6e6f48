"""Error against run time of eight scenes by `sumo3dviz-pt converge`, for the manual.

Run from the repository's root, on a quiet machine; an interrupted run goes on:

    python tests/bench/curves.py -o docs/_bench

Pictures and references stay under `build/curves`; tables and plots go to the manual.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt.report.convergence.table import Slope, median, numbers, read_rows, slope

WORK = Path("build/curves")
PRESETS = ("draft", "preview", "standard", "study")
MEASURED = ("convergence.csv",)
SHOWN = ("report.md", "error.png", "crops.png", "flip.jpg", "depth.png")
"""What the manual keeps of every scene, and of those with a page: its pictures weigh a megabyte."""


@dataclass(frozen=True)
class Case:
    """One call of `converge`."""

    name: str
    scene: str
    camera: str
    time: float
    size: str = "480x270"
    top: int = 64
    template: str | None = None
    page: bool = False


CASES = (
    Case("ronda", "examples/ronda/scene.yaml", "overview", 492, top=32, page=True),
    Case("crossing", "examples/crossing/scene.yaml", "corner", 456, top=32),
    Case("golden_hour", "tests/bench/scenes/golden_hour.yaml", "overview", 492, top=16),
    Case("glass_queue", "tests/bench/scenes/glass_queue.yaml", "queue", 475, top=16),
    Case("empty_road", "tests/bench/scenes/empty_road.yaml", "overview", 492, top=16),
    Case(
        "crossing_night",
        "examples/crossing/scene.yaml",
        "corner",
        458,
        "240x135",
        top=32,
        template="city_night",
        page=True,
    ),
    Case("overcast", "examples/crossing/scene.yaml", "driver", 492, top=16, template="overcast"),
    Case("wide_trees", "examples/ronda/scene.yaml", "flight", 460, top=16),
)


def arguments(case: Case, work: Path = WORK) -> list[str]:
    """What follows `sumo3dviz-pt`."""
    choices = ["--camera", case.camera, "--time", f"{case.time:g}", "--size", case.size]
    if case.template:
        choices += ["--set", f"template={case.template}"]
    folder = (work / case.name).as_posix()
    return ["converge", case.scene, *choices, "--top", str(case.top), "-o", folder]


def publish(case: Case, target: Path, work: Path = WORK) -> None:
    """Copy what was measured, and tables and plots of a scene that has a page."""
    target.mkdir(parents=True, exist_ok=True)
    for name in (*MEASURED, *(SHOWN if case.page else ())):
        shutil.copyfile(work / case.name / name, target / name)


def overview(folder: Path, cases: Sequence[Case] = CASES) -> list[str]:
    """A Markdown table of all measured cases: slopes, reference, bias, FLIP and flicker."""
    lines = [
        "| scene | reference [spp] | its halves' FLIP | slope, independent | slope, multijitter |"
        " bias of `standard` | FLIP of `draft` | `preview` | `standard` | `study` |"
        " flicker of `standard` |",
        "|---|" + "--:|" * 10,
    ]
    for case in cases:
        rows = read_rows(folder / case.name / "convergence.csv")
        if not rows:
            continue
        own = {name: [row for row in rows if row["preset"] == name] for name in PRESETS}
        fits = slope(rows, "rmse_capped")
        bias = numbers(own["standard"], "mean_bias")
        cells = [
            # Links are read from a page of docs/measured, which includes this table.
            f"[{case.name}](../{folder.name}/{case.name}/{SHOWN[0] if case.page else MEASURED[0]})",
            f"{median(rows, 'ref_spp'):.0f}",
            f"{median(rows, 'ref_halves_flip'):.4f}",
            *(_fit(fits[sampler]) for sampler in ("independent", "multijitter")),
            f"{bias.mean():+.2%}" if bias.size else "-",
            *(_number(median(own[name], "flip"), 3) for name in PRESETS),
            _number(median(own["standard"], "flicker_mc"), 1),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _fit(fit: Slope) -> str:
    """A slope with its interval."""
    return f"{fit.value:.3f} ({fit.low:.3f} to {fit.high:.3f})"


def _number(value: float, digits: int) -> str:
    """A number, or a dash for one that was not measured."""
    return f"{value:.{digits}f}" if value == value else "-"


def main() -> None:
    """Measure what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=[case.name for case in CASES], action="append")
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    for case in CASES:
        if options.only is None or case.name in options.only:
            command = [sys.executable, "-m", "sumo3dviz_pt.cli", *arguments(case)]
            subprocess.run(command, check=True)
            publish(case, options.output / case.name)
    lines = overview(options.output)
    (options.output / "curves.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
