"""Our kernel, Mitsuba's `path` and Blender's Cycles on the same frame: CPU time to equal error.

Run from the repository's root, on a quiet machine, with a Python that has `bpy` 4.5 beside ours
(`python3.11 -m venv blender && blender/bin/pip install bpy==4.5.*`):

    python tests/bench/cycles.py --blender-python blender/bin/python -o docs/_bench/cycles.md

`--case` measures one of the cases; the page has all that were measured in `--work`. The scene is
built by our own pipeline and exported as arrays; what does not map is made simpler on both sides
(`blender/export.py` says what). Renderers take turns, and each is compared with its own
reference. CPU-seconds are those of all threads, of a later picture of a scene that stays loaded.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.blender.equal_error import CYCLES, Row, at_equal_error, measured, row_of
from bench.blender.export import DIFFERENT, exported, without_textures

from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.image.metrics import flip, relative_mse
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.pipeline.production import Production, Request, example, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job, quality_preset
from sumo3dviz_pt.report.machine import machine

KERNEL, PATH = "our kernel", "Mitsuba's path"
BRIGHTEST = 4.0
"""Radiance that counts in the relative error, times white."""

RUNS = {1: 3, 4: 3, 16: 2}
"""Pictures of a number of samples; others have one."""

DENOISED = (4, 16)
MOVED = 0.3  # how far bodies move between two pictures [m]


@dataclass(frozen=True)
class Case:
    """A frame that is compared."""

    example: str
    camera: str
    at: float
    template: str | None = None


CASES = {
    "day": Case("ronda", "overview", 492.0),
    "night": Case("crossing", "corner", 458.0, "city_night"),
}


class Ours:
    """Renders by our kernel or by Mitsuba's path tracer."""

    def __init__(self, made: Production, session: Any) -> None:
        self.session, self._quality = session, made.quality
        self._frame = made.shot.frame_at(float(made.times[0]))
        session.show(self._frame)

    def picture(self, name: str, spp: int, seed: int, *, denoise: bool = False) -> Any:
        """Return CPU-seconds and radiance."""
        tracer = "kernel" if name == KERNEL else "path"
        changes = {"spp": spp, "pass_spp": min(spp, 64), "tracer": tracer}
        self.session.retune(self._quality.model_copy(update=changes), seed=seed)
        began = time.process_time()
        samples = self.session.samples(self._frame)
        radiance = samples.layers["radiance"]
        if denoise:
            radiance = self.session.finish(samples, self._frame, denoiser="high")
        return time.process_time() - began, np.asarray(radiance)

    @property
    def updating(self) -> float:
        """CPU-seconds that the last picture took to bring the scene to its frame."""
        return float(self.session.clock.seconds["update"])


class Theirs:
    """Renders by Cycles, in a process of its own."""

    def __init__(self, python: Path, folder: Path, made: Production) -> None:
        script = Path(__file__).parent / "blender" / "script.py"
        self._white, size = 2.0**-made.exposure, made.job.output.size
        self._out = folder / "cycles.exr"
        self._run = subprocess.Popen(
            [str(python), str(script), str(folder), *map(str, size)],
            env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(folder / "blender.log").open("w"),
            text=True,
        )
        self.about = self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._run.stdout is not None
        for line in self._run.stdout:
            if line.startswith("ANSWER "):
                return dict(json.loads(line.removeprefix("ANSWER ")))
        raise RuntimeError("Blender ended; blender.log beside its scene says why")

    def picture(self, spp: int, seed: int, **choices: Any) -> Any:
        """Return CPU-seconds and radiance."""
        assert self._run.stdin is not None
        order = {"spp": spp, "seed": seed, "out": str(self._out), **choices}
        print(json.dumps(order), file=self._run.stdin, flush=True)
        cost = self._answer()["cpu"]
        return cost, self._white * np.asarray(read_exr(self._out)[0])[..., :3]

    def close(self) -> None:
        """End the process."""
        assert self._run.stdin is not None
        self._run.stdin.close()
        self._run.wait()


@dataclass(frozen=True)
class Judge:
    """Compares pictures with a reference."""

    made: Production

    @property
    def white(self) -> float:
        """Radiance that is shown as white."""
        return float(2.0**-self.made.exposure)

    def shown(self, radiance: Any) -> Any:
        """Develop a picture without glare."""
        tone = self.made.job.output.tone
        return develop_float(radiance, exposure=self.made.exposure, tone=tone)

    def capped(self, radiance: Any) -> Any:
        """Return radiance in whites, cut."""
        return np.minimum(radiance / self.white, BRIGHTEST)

    def errors(self, radiance: Any, reference: Any) -> tuple[float, float]:
        """Return FLIP and the relative mean squared error."""
        relative = relative_mse(self.capped(radiance), self.capped(reference))
        return flip(self.shown(radiance), self.shown(reference)), relative

    def mean(self, radiance: Any) -> float:
        """Return the mean luminance of a capped picture, in whites."""
        return float((self.capped(radiance) @ LUMINANCE).mean())


def simplified(case: Case, size: tuple[int, int]) -> Production:
    """Prepare a frame whose scene maps to Cycles."""
    changes = {"template": case.template} if case.template else {}
    request = Request(camera=case.camera, quality="preview", size=size)
    made = prepare(load_job(example(case.example), changes), request, np.array([case.at]))
    quality = quality_preset("preview").by_itself.model_copy(
        update={"denoise": "none", "haze": False, "max_depth": 8}
    )
    shot = replace(made.shot, data=without_textures(made.shot.data))
    return replace(made, shot=shot, quality=quality)


@contextmanager
def both(made: Production, python: Path, folder: Path) -> Iterator[tuple[Ours, Theirs]]:
    """Open a frame in both renderers."""
    with opened(made) as session:
        ours = Ours(made, session)
        export = exported(session)
        export.said |= {"limit": made.quality.cap, "bounces": made.quality.max_depth - 2}
        export.write(folder)
        for left in export.different:
            print("not told to Cycles:", left, flush=True)
        theirs = Theirs(python, folder, made)
        try:
            yield ours, theirs
        finally:
            theirs.close()


def measure(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Measure a case; return what the page says of it."""
    made = simplified(CASES[name], options.size)
    judge, folder = Judge(made), options.work / name
    with both(made, options.blender_python, folder) as (ours, theirs):
        renderers = {
            KERNEL: lambda spp, seed, **how: ours.picture(KERNEL, spp, seed, **how),
            PATH: lambda spp, seed, **how: ours.picture(PATH, spp, seed, **how),
            CYCLES: theirs.picture,
        }
        first = {who: render(1, 1)[0] for who, render in renderers.items()}
        for who in (KERNEL, PATH):
            renderers[who](1, 2)  # recordings settle
        truths = {who: renderers[who](options.reference, 9)[1] for who in (KERNEL, CYCLES)}
        truths[PATH] = truths[KERNEL]
        _side_by_side(judge, truths, folder / "side_by_side.png")
        rows = list(_rows(options.samples, renderers, truths, judge))
        moving = _moving(ours, theirs)
    about = {
        "machine": machine(),
        "blender": theirs.about["version"],
        "size": list(options.size),
        "reference": options.reference,
        "first": first,
        "means": {who: judge.mean(truths[who]) for who in (KERNEL, CYCLES)},
        "references_flip": judge.errors(truths[KERNEL], truths[CYCLES])[0],
        "moving": moving,
    }
    return about | {"rows": [asdict(row) for row in rows]}


def _rows(
    samples: Sequence[int], renderers: dict[str, Any], truths: dict[str, Any], judge: Judge
) -> Iterator[Row]:
    """Render all pictures, the renderers in turns."""
    for spp in samples:
        found: dict[tuple[str, bool], list[Any]] = {}
        ways = [(who, False) for who in renderers]
        ways += [(who, True) for who in (KERNEL, CYCLES) if spp in DENOISED]
        for run in range(RUNS.get(spp, 1)):
            for who, denoise in ways:
                cpu, picture = renderers[who](spp, 100 + 10 * spp + run, denoise=denoise)
                errors = judge.errors(picture, truths[who])
                found.setdefault((who, denoise), []).append((cpu, *errors))
        for (who, denoise), runs in found.items():
            row = row_of((who, spp), runs, denoised=denoise)
            print(row, flush=True)
            yield row


def _moving(ours: Ours, theirs: Theirs) -> dict[str, float]:
    """Return what it costs more to show moved bodies: our update, and Cycles' difference."""
    updates, still, moved = [], [], []
    for run in range(3):
        ours.picture(KERNEL, 1, 20 + run)
        updates.append(ours.updating)
        still.append(theirs.picture(1, 30 + run)[0])
        moved.append(theirs.picture(1, 30 + run, moved=MOVED * (1 + run))[0])
    return {
        KERNEL: float(np.median(updates)),
        CYCLES: float(np.median(moved) - np.median(still)),
    }


def _side_by_side(judge: Judge, truths: dict[str, Any], target: Path) -> None:
    """Write both references, and which is brighter where."""
    from PIL import Image

    pictures = [judge.shown(truths[who]) for who in (KERNEL, CYCLES)]
    pictures.append(np.clip(0.5 + 2.0 * (pictures[0] - pictures[1]), 0.0, 1.0))
    codes = np.round(255 * np.concatenate(pictures, axis=1)).astype(np.uint8)
    Image.fromarray(codes).save(target)


def page(cases: dict[str, dict[str, Any]]) -> str:
    """Return all that was measured, as Markdown."""
    lines: list[str] = []
    for name, about in cases.items():
        case, rows = CASES[name], [Row(**row) for row in about["rows"]]
        known, means = about["machine"], about["means"]
        width, height = about["size"]
        lines += [
            f"**By {name}**: `{case.example}`, camera `{case.camera}`, {case.at:g} s,"
            f" {width}x{height}. {known['cpu']}, {known['threads']} threads; Mitsuba"
            f" {known['mitsuba']}, Dr.Jit {known['drjit']}, Blender {about['blender']}, commit"
            f" {known['git']}. References of {about['reference']} samples: mean luminance"
            f" {means[KERNEL]:.4f} of white here and {means[CYCLES]:.4f} in Cycles"
            f" ({means[KERNEL] / means[CYCLES] - 1:+.1%}), FLIP between them"
            f" {about['references_flip']:.3f}.",
            "",
            *measured(rows),
            "",
            *at_equal_error(rows),
            "",
            "First picture (1 sample, compiling or building trees, CPU-s): "
            + ", ".join(f"{who} {cost:.1f}" for who, cost in about["first"].items())
            + f". A frame with everyone moved: our update {about['moving'][KERNEL]:.2f} (in the"
            f" figures above), Cycles {about['moving'][CYCLES]:+.2f} (not in them).",
            "",
        ]
    return "\n".join([*lines, "Not the same, or only because both were made simpler:", "",
                      *(f"* {each}" for each in DIFFERENT)]) + "\n"  # fmt: skip


def pair(text: str) -> tuple[int, int]:
    """Read a size such as 640x360."""
    width, height = map(int, text.split("x"))
    return width, height


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blender-python", type=Path, required=True)
    parser.add_argument("--case", choices=sorted(CASES), action="append")
    parser.add_argument("--samples", type=int, nargs="+", default=[1, 4, 16, 64])
    parser.add_argument("--reference", type=int, default=512)
    parser.add_argument("--size", type=pair, default=(640, 360))
    parser.add_argument("--work", type=Path, default=Path("build/cycles"))
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    options.work = options.work.resolve()
    for name in options.case or CASES:
        about = measure(name, options)
        (options.work / f"{name}.json").write_text(json.dumps(about), encoding="utf-8")
    known = {name: options.work / f"{name}.json" for name in CASES}
    found = {k: json.loads(v.read_text("utf-8")) for k, v in known.items() if v.exists()}
    options.output.write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
