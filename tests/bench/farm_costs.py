"""Measures what the end of a study costs: python tests/bench/farm_costs.py STUDY.yaml FOLDER

FOLDER holds the finished study, with its frames. CPU-seconds of this program and of those that
it runs; `pipeline/costs.py` has the constants.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

from sumo3dviz_pt.pipeline.costs import spent
from sumo3dviz_pt.studies.certificate.certificate import certify
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.measured.report import report_study
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.records import film_path
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.ffmpeg import film_pictures

REPEATS = 3


def cost(work: Callable[[], object]) -> float:
    """The least that some work took in several goes [CPU-s]."""
    found = []
    for _ in range(REPEATS):
        before = spent()
        work()
        found.append(spent() - before)
    return min(found)


def main() -> None:
    """Print the costs, each for a million pixels."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path)
    parser.add_argument("folder", type=Path)
    asked = parser.parse_args()
    plan = plan_study(load_study(asked.study), {})
    stimulus = plan.stimuli[0]
    size = stimulus.job.output.size
    pictures = list(film_pictures(film_path(asked.folder, plan, stimulus), size=size))
    frames, megapixels = len(pictures), size[0] * size[1] / 1e6
    # What ffmpeg and the start of anything cost is in both, and leaves their difference.
    with tempfile.TemporaryDirectory() as name:
        target = Path(name) / "a.mp4"

        def encoded(times: int) -> float:
            return cost(lambda: encode(times * pictures, target, size=size, fps=25))

        film = (encoded(5) - encoded(1)) / (4 * frames * megapixels)
    pair = cost(lambda: certify(asked.folder, plan)) / (len(plan.pairs) * megapixels)
    report = cost(lambda: report_study(asked.folder, plan))
    report /= len(plan.stimuli) * frames * megapixels
    print(f"{len(plan.stimuli)} films of {frames} frames, {size[0]}x{size[1]}, CPU-s a megapixel:")
    print(
        f"encoding a frame {film:.3f}, comparing a pair {pair:.2f}, measuring a frame {report:.3f}"
    )


if __name__ == "__main__":
    main()
