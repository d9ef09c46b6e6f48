"""Makes the viewer's pictures in the manual: python tools/make_viewer.py

A copy of the bundled crossing is opened with `sumo3dviz-pt view`, headless Chromium does
what a user would do, and its window is photographed.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from viewer.browser import Browser, Page
from viewer.program import Program

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
SIZE = "960x540"
WINDOW = (1000, 690)
SPAN = ("--from", "440", "--to", "480")
TIME = 458.0
SAMPLES = 32


def refined(page: Page, *, samples: int = SAMPLES) -> None:
    """Wait for a good picture."""
    page.wait_for(f"viewer.frame.spp >= {samples} && viewer.frame.size[0] === 960", seconds=900.0)


def to_time(page: Page, time: float) -> None:
    """Move the slider."""
    page.choose("#time", time)
    page.focus("#picture")
    page.wait_for(f"Math.abs(viewer.frame.time - {time}) < 0.05", seconds=60.0)


def photographed(page: Page, name: str) -> None:
    """Keep what the window shows."""
    refined(page)
    page.screenshot(IMAGES / f"viewer_{name}.jpg")


def visit(page: Page) -> None:
    """Look at the crossing, ride with somebody, lay a path."""
    page.wait_for("!!window.viewer && !!viewer.frame", seconds=600.0)
    page.click("#denoise")
    to_time(page, TIME)
    photographed(page, "page")

    page.click("[data-panel=path]")
    for key, seconds, time in (("KeyD", 0.7, 450.0), ("KeyR", 0.4, 454.0), ("KeyA", 0.9, 458.0)):
        to_time(page, time)
        page.hold(key, seconds=seconds)
        page.click("#keyframe-add")
        page.focus("#picture")
    page.wait_for("viewer.keyframes.length === 3")
    photographed(page, "path")
    page.click("[data-panel=path]")

    page.focus("#picture")
    page.press("Digit1")
    to_time(page, TIME + 0.5)
    refined(page, samples=8)
    for x, y in ((0.42, 0.55), (0.5, 0.5), (0.3, 0.55), (0.6, 0.6), (0.7, 0.6), (0.2, 0.5)):
        if page.evaluate("viewer.frame.riding === null"):
            page.click("#picture", x=x, y=y)
            page.evaluate("new Promise(done => setTimeout(done, 3000))")
    page.wait_for("viewer.frame.riding !== null", seconds=60.0)
    photographed(page, "ride")


def main() -> None:
    """Open, visit, photograph."""
    from sumo3dviz_pt.pipeline.production import example

    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(example("crossing").parent, Path(folder, "crossing")))
        with (
            Program(copy / "scene.yaml", "--size", SIZE, *SPAN, seconds=900.0) as program,
            Browser(size=WINDOW) as browser,
        ):
            page = browser.open(program.address)
            visit(page)
            assert not page.errors, page.errors


if __name__ == "__main__":
    main()
