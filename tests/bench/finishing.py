"""What it costs to make a finished picture of traced frames, part by part.

Run from the repository's root, on a quiet machine:

    python tests/bench/finishing.py -o docs/_bench

Eleven frames of the bundled motorway are traced at 1280x720 with `preview` (or taken from
`--frames`, a folder of a film), for a camera that stands and for one that moves. Then everything
from there to the encoded film is timed by itself: CPU-seconds of all threads and wall seconds,
medians of three. Load inflates both; compare two versions alternating, or by their ratios.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.image.traced import packed, unpacked
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.pipeline.films.traced import FINISHING, TRACED, StoredFrame, _finishing_of
from sumo3dviz_pt.pipeline.provenance import versions
from sumo3dviz_pt.render.averaging.average import Averager
from sumo3dviz_pt.render.averaging.motion import motion_between
from sumo3dviz_pt.render.passes.finish import Finishing, denoise, finished, hazed, mixed
from sumo3dviz_pt.report.machine import machine
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.encoder import yuv709

SCENE = Path("examples/ronda/scene.yaml")
CAMERAS = {"overview": 493.0, "driver": 465.0}
SIZE, WINDOW = (1280, 720), 4
Row = tuple[str, float, float]


def timed(name: str, work: Callable[[], Any], *, runs: int = 3) -> Row:
    """Median CPU-seconds, with those of programs that have ended, and wall seconds."""
    work()
    cpu, wall = [], []
    for _ in range(runs):
        before, start = sum(os.times()[:4]), time.perf_counter()
        work()
        cpu.append(sum(os.times()[:4]) - before)
        wall.append(time.perf_counter() - start)
    return name, float(np.median(cpu)), float(np.median(wall))


def trace(
    film: tuple[str, float], folder: Path, *, scene: Path = SCENE, size: tuple[int, int] = SIZE
) -> Path:
    """Trace eleven frames of a camera from a time on; their folder."""
    import sumo3dviz_pt as sv

    camera, start = film
    films = sv.load(scene).render(
        folder / f"{camera}.mp4", camera=camera, start=start, end=start + 11 / 25, fps=25,
        frames=(0, 11), quality="preview", size=size,
    )  # fmt: skip
    return Path(films[0])


def storing(path: Path) -> Iterator[Row]:
    """Time what lies between a traced frame and its file."""
    stored = StoredFrame.read(path)
    frame = unpacked(stored.layers, stored.strings[TRACED])
    layers, text = packed(frame)
    with tempfile.TemporaryDirectory() as place:
        target = Path(place) / "frame.exr"
        yield timed("packing", lambda: packed(frame))
        yield timed("writing", lambda: write_exr(target, layers, attributes={TRACED: text}))
    yield timed("reading", lambda: StoredFrame.read(path))
    yield timed("unpacking", lambda: unpacked(stored.layers, text))


def helping(centre: TracedFrame, others: list[TracedFrame]) -> Iterator[Row]:
    """Time what neighbours do: all of it, and by part."""
    averager = Averager()
    yield timed("8 neighbours", lambda: averager.accumulated(centre, others))
    fresh = iter([replace(centre) for _ in range(8)])
    yield timed("  with a frame that is new", lambda: averager.accumulated(next(fresh), others))
    yield timed("  motion of one", lambda: motion_between(centre, others[0]))


def finishing(frame: TracedFrame, how: Finishing) -> Iterator[Row]:
    """Time what makes a picture of a frame that was helped."""
    layers = frame.layers
    raw, hit = layers["radiance"], layers["hit"]
    guides = {"albedo": layers["albedo"], "normal": layers["normal"]}
    for quality in ("fast", "balanced", "high"):
        yield timed(f"denoiser {quality}", lambda q=quality: denoise(raw, quality=q, **guides))
    yield timed("denoiser high, no guides", lambda: denoise(raw, quality="high"))
    smooth = denoise(raw, quality="fast", **guides)
    yield timed("raw share", lambda: mixed(smooth, raw, hit=hit, share=how.raw_share))
    yield timed("haze", lambda: hazed(layers, frame.view, how))
    for quality in ("fast", "high"):
        own = replace(how, denoiser=quality)
        yield timed(f"all of these, {quality}", lambda o=own: finished(layers, frame.view, o))


def encoding(radiance: np.ndarray) -> Iterator[Row]:
    """Time what makes a film of finished frames."""
    for name, glare in (("tone", 0.0), ("tone with glare", 0.05)):
        yield timed(name, lambda g=glare: develop_float(radiance, glare=g))
    picture, size = develop_float(radiance), (radiance.shape[1], radiance.shape[0])
    yield timed("planes", lambda: yuv709(picture, rng=np.random.default_rng(0)))
    with tempfile.TemporaryDirectory() as place:
        film = Path(place) / "film.mp4"
        name, cpu, wall = timed(
            "encoder, 10 frames", lambda: encode([picture] * 10, film, size=size, fps=25), runs=3
        )
    yield name, cpu, wall


def measured(folder: Path) -> list[Row]:
    """Time everything for the middle one of a folder's first frames."""
    paths = sorted(folder.glob("*.exr"))[: 2 * WINDOW + 1]
    stored = [StoredFrame.read(path) for path in paths]
    frames = [unpacked(each.layers, each.strings[TRACED]) for each in stored]
    centre, others = frames[WINDOW], frames[:WINDOW] + frames[WINDOW + 1 :]
    how = _finishing_of(stored[WINDOW].strings[FINISHING])
    averager = Averager()
    helped = replace(centre, layers=averager.accumulated(centre, others).layers)
    radiance = finished(helped.layers, centre.view, replace(how, denoiser="fast"))
    return [
        *storing(paths[WINDOW]),
        *helping(centre, others),
        *finishing(helped, how),
        *encoding(radiance),
    ]


def main() -> None:
    """Measure both cameras and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=Path, action="append", help="a folder of stored frames")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/_bench"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folders = options.frames or [trace(film, Path(place)) for film in CAMERAS.items()]
        found = [measured(folder) for folder in folders]
    names = [folder.parent.name if options.frames else folder.stem for folder in folders]
    print("| [CPU-s (wall s)] | " + " | ".join(names) + " |\n|---|" + "--:|" * len(names))
    for rows in zip(*found, strict=True):
        print(f"| {rows[0][0]} | " + " | ".join(f"{c:.3f} ({w:.3f})" for _, c, w in rows) + " |")
    options.output.mkdir(parents=True, exist_ok=True)
    record = {
        "machine": machine(),
        "versions": versions(),
        "parts": {
            name: {part: {"cpu": cpu, "wall": wall} for part, cpu, wall in rows}
            for name, rows in zip(names, found, strict=True)
        },
    }
    text = json.dumps(record, indent=1)
    (options.output / "finishing.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
