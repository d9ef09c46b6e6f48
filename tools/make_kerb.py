"""Writes what the manual shows of gap acceptance at a kerb: python tools/make_kerb.py

The pairs, the study and the table of arrivals come from the bundled crossing, by the code that the
commands call. A test says when they are out of date.
"""

from __future__ import annotations

import sys
from pathlib import Path

from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.kerb.proposal import as_study
from sumo3dviz_pt.studies.kerb.vehicles import at_kerb, kerb_lines
from sumo3dviz_pt.studies.offers import offer_lines, offers_of
from sumo3dviz_pt.studies.plan import plan_study

ROOT = Path(__file__).resolve().parents[1]
BENCH = ROOT / "docs" / "_bench"
SCENE = ROOT / "examples" / "crossing" / "scene.yaml"
PLACE = "149.2,270.9"
LISTED = 8
"""Pairs that the page shows."""


def pages(scratch: Path) -> dict[str, str]:
    """Return the files by name.

    Args:
        scratch: A folder for the study file, from which the arrivals come.
    """
    found = at_kerb(load_job(SCENE), PLACE)
    assert found.proposal is not None
    lines = kerb_lines(found)
    cut = ["...", *lines[-1:]]
    study = scratch / "study.yaml"
    study.write_text(as_study(found.proposal, SCENE.as_posix()), encoding="utf-8")
    offers = offer_lines(offers_of(plan_study(load_study(study))))
    told = as_study(found.proposal, "scene.yaml")
    return {
        "kerb_pairs.md": _block("text", [*lines[: LISTED + 2], *cut]),
        "kerb_study.md": _block("yaml", told.splitlines()),
        "kerb_arrivals.md": _block("text", [line for line in offers if line]),
    }


def _block(language: str, lines: list[str]) -> str:
    """Return lines as a block of Markdown."""
    return "\n".join([f"```{language}", *lines, "```", ""])


def main() -> int:
    """Write the files."""
    import tempfile

    with tempfile.TemporaryDirectory() as scratch:
        for name, content in pages(Path(scratch)).items():
            (BENCH / name).write_text(content, encoding="utf-8")
            print(f"wrote {BENCH / name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
