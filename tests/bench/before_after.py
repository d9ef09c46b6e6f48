"""What films cost and how wrong they are, before and after a change, in one run.

Run from the repository's root, on a quiet machine; the other checkout holds the state before:

    python tests/bench/before_after.py --before ../before -o docs/_bench/before_after.md

Both checkouts render the same seconds in turns, each in a process of its own: `render --frames`,
then `develop` to numbered pictures. CPU-seconds of a frame are the median of the frames after the
third, and developing's share of one frame. Errors are those of the middle frame against a picture
of many samples by the same checkout, which takes hours; `--costs-only` leaves them out. Flicker is
the mean change between the two middle frames of the calmest three quarters of the pixels, in 8-bit
codes, where the camera stands.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

FRAMES = {"draft": 13, "preview": 13, "standard": 13, "study": 9}
"""Frames of a film by preset; windows over neighbours need some on both sides."""

FPS = 25
REFERENCE_SPP = 256


@dataclass(frozen=True)
class Case:
    """A view whose films are compared."""

    name: str
    scene: str
    camera: str
    start: float
    template: str = ""
    size: tuple[int, int] = (1280, 720)
    more: dict[str, Any] = field(default_factory=dict)
    """Further settings that differ from the scene file."""

    @property
    def stands(self) -> bool:
        """Whether the camera does."""
        return self.camera != "driver"

    @property
    def changes(self) -> dict[str, Any]:
        """What differs from the scene file."""
        return {**({"template": self.template} if self.template else {}), **self.more}


CASES = (
    Case("ronda overview", "examples/ronda/scene.yaml", "overview", 492.0),
    Case("ronda driver", "examples/ronda/scene.yaml", "driver", 460.0),
    Case("crossing corner", "examples/crossing/scene.yaml", "corner", 456.0),
    Case("crossing night", "examples/crossing/scene.yaml", "corner", 458.0, "city_night"),
    Case(
        "ronda overview 1140x900",
        "examples/ronda/scene.yaml",
        "overview",
        492.0,
        size=(1140, 900),
    ),
)


def render(case: Case, preset: str, folder: Path) -> dict[str, Any]:
    """Render and develop a film's frames; return what they cost."""
    import sumo3dviz_pt as sv
    from sumo3dviz_pt.pipeline.films.encoding import DevelopOrder, develop_frames

    count = FRAMES[preset]
    stamps = [time.process_time()]

    def note(_: Any) -> None:
        stamps.append(time.process_time())

    frames = sv.load(case.scene, case.changes).render(
        folder / "film.mp4",
        camera=case.camera,
        start=case.start,
        end=case.start + count / FPS,
        fps=FPS,
        frames=(0, count),
        quality=preset,
        size=case.size,
        progress=note,
    )
    seconds = np.diff(stamps)
    began = time.process_time()
    develop_frames(Path(frames[0]), DevelopOrder(folder / "{frame}.png"))
    developing = (time.process_time() - began) / count
    return {
        "first": float(seconds[0]),
        "second": float(seconds[1]),
        "later": float(np.median(seconds[3:])) + developing,
        "developing": developing,
    }


def reference(case: Case, count: int, target: Path) -> None:
    """Render a film's middle frame with many samples; store it developed."""
    from sumo3dviz_pt.image.tonemap import develop_float
    from sumo3dviz_pt.pipeline.production import Request, frame_times, opened, prepare
    from sumo3dviz_pt.pipeline.scene_file import load_job

    times = frame_times(case.start, case.start + count / FPS, FPS)
    request = Request(camera=case.camera, quality="study", size=case.size, spp=REFERENCE_SPP)
    made = prepare(load_job(Path(case.scene), case.changes), request, times)
    state = made.shot.frame_at(float(times[count // 2]))
    # Checkouts of before our own kernel want to know whether a film is to come.
    choices = {"film": False} if "film" in signature(opened).parameters else {}
    with opened(made, **choices) as session:
        session.retune(made.quality.model_copy(update={"denoise": "none"}), seed=12345)
        radiance = session.render(state).radiance
    output = made.job.output
    picture = develop_float(radiance, exposure=made.exposure, tone=output.tone, glare=output.glare)
    np.save(target, picture.astype(np.float32))


def errors(case: Case, preset: str, folder: Path, truth: Path | None) -> dict[str, float]:
    """Compare a film's middle frames with the reference, if there is one, and with each other."""
    from PIL import Image

    from sumo3dviz_pt.image.metrics import flip, psnr

    count = FRAMES[preset]
    expected = None if truth is None else np.load(truth)

    def shown(number: int) -> Any:
        with Image.open(folder / f"{number:06d}.png") as picture:
            return np.asarray(picture.convert("RGB"), np.float32) / 255

    middle, after = shown(count // 2), shown(count // 2 + 1)
    change = np.abs(middle - after).mean(axis=-1)
    calm = 255 * float(change[change <= np.quantile(change, 0.75)].mean())
    return {
        "flip": float("nan") if expected is None else flip(middle, expected),
        "psnr": float("nan") if expected is None else psnr(middle, expected),
        "flicker": calm if case.stands else float("nan"),
    }


def in_checkout(root: Path, *words: str) -> Any:
    """Run a step of this program with a checkout's package; return what it prints."""
    environment = {**os.environ, "PYTHONPATH": str(root)}
    run = subprocess.run(
        [sys.executable, str(Path(__file__).resolve()), *words],
        cwd=root,
        env=environment,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    return json.loads(run.stdout.splitlines()[-1]) if run.stdout.strip() else None


def compared(options: argparse.Namespace) -> list[dict[str, Any]]:
    """Render all films in both checkouts; return their rows."""
    rows = []
    here = Path(__file__).resolve().parents[2]
    for number, case in enumerate(CASES):
        if options.cases and case.name not in options.cases:
            continue
        options.work.mkdir(parents=True, exist_ok=True)
        for preset in options.presets:
            for state, root in (("before", options.before), ("after", here)):
                truth = options.work / f"reference_{number}_{state}_{FRAMES[preset]}.npy"
                if not (options.costs_only or truth.exists()):
                    in_checkout(root, "--step", "reference", str(number), preset, str(truth))
                with tempfile.TemporaryDirectory(dir=options.work) as name:
                    words = (str(number), preset, name)
                    known = () if options.costs_only else (str(truth),)
                    cost = in_checkout(root, "--step", "render", *words)
                    wrong = in_checkout(here, "--step", "errors", *words, *known)
                row = {"case": case.name, "preset": preset, "state": state, **cost, **wrong}
                print(json.dumps(row), flush=True)
                rows.append(row)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """Return rows as Markdown."""
    columns = ("case", "preset", "state", "first", "second", "later", "developing", "flip", "psnr")
    columns += ("flicker",)
    lines = ["| " + " | ".join(columns) + " |", "|---|---|---|" + "--:|" * (len(columns) - 3)]
    digits = {"flip": 4, "psnr": 1}
    for row in rows:
        cells = [
            row[key] if isinstance(row[key], str) else f"{row[key]:.{digits.get(key, 2)}f}"
            for key in columns
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--work", type=Path, default=Path("build/before_after"))
    parser.add_argument("--cases", nargs="*")
    parser.add_argument("--presets", nargs="*", default=["preview", "standard"])
    parser.add_argument("--costs-only", action="store_true")
    parser.add_argument("--step", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.step:
        step, number, preset, *places = options.step
        case = CASES[int(number)]
        if step == "render":
            print(json.dumps(render(case, preset, Path(places[0]))))
        elif step == "errors":
            truth = Path(places[1]) if len(places) > 1 else None
            print(json.dumps(errors(case, preset, Path(places[0]), truth)))
        else:
            reference(case, FRAMES[preset], Path(places[0]))
        return
    options.work = options.work.resolve()
    options.before = options.before.resolve()
    options.output.write_text(table(compared(options)), encoding="utf-8")


if __name__ == "__main__":
    main()
