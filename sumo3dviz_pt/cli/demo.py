"""`demo`: renders the bundled example, with nothing to prepare."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sumo3dviz_pt.cli.options import add_overwrite, add_size, add_variant, command_in
from sumo3dviz_pt.cli.progress import cpu_in_words, progress
from sumo3dviz_pt.cli.render import print_films, render_films


@dataclass(frozen=True, slots=True)
class _Extent:
    """How much the demo renders without other options.

    Attributes:
        size: Width, height [px].
        seconds: Of the film.
        quality: A preset's name.
    """

    size: tuple[int, int]
    seconds: float
    quality: str


_COMPILED = _Extent((640, 360), 2.0, "preview")
_SCALAR = _Extent((480, 270), 1.0, "draft")
"""The extent where there is no libLLVM: it takes four minutes on two cores."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("demo", help="render the bundled example: demo.mp4 and demo.png")
    sub.add_argument("-o", "--output", type=Path, default=Path(), help="folder [.]")
    sub.add_setting("--quality", "quality", after=f" [{_COMPILED.quality}]")
    add_variant(sub)
    add_size(sub, after=" [{}x{}]".format(*_COMPILED.size))
    add_overwrite(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Render the bundled example, less of it where rendering is slow."""
    from sumo3dviz_pt.pipeline.films.build import FilmOrder
    from sumo3dviz_pt.pipeline.production import Request, example, ready_renderer
    from sumo3dviz_pt.pipeline.progress.costs import spent
    from sumo3dviz_pt.pipeline.progress.expectations import still_steps
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.pipeline.stills.open_shot import render_still
    from sumo3dviz_pt.pipeline.stills.still import check_free, check_target

    folder = options.output
    check_target(folder / "demo.png", suffixes=(".png",), overwrite=options.overwrite)
    if not options.overwrite:
        check_free(folder / "demo.mp4", folder / "demo.json")
    job = load_job(example("ronda"))
    extent = _extent(options, compiled=ready_renderer(options.variant).jit)
    request = Request(
        quality=extent.quality,
        size=extent.size,
        variant=options.variant,
        command=command_in(options.words),
    )
    shot = job.shots[0]
    order = FilmOrder(
        folder / "demo.mp4",
        start=shot.start,
        end=min(shot.end, shot.start + extent.seconds),
        resume=True,
        discard_frames=True,
    )
    films = render_films(job, replace(request, camera=shot.camera), order)
    print_films(films, cpu=spent())
    picture = replace(request, camera="overview")
    filmed = spent()
    with progress("demo.png", still_steps(job, picture)):
        still = render_still(job, picture, shot.start)
    still.save(folder / "demo.png")
    print(f"wrote {folder / 'demo.png'} ({cpu_in_words(spent() - filmed)})")
    return 0


def _extent(options: argparse.Namespace, *, compiled: bool) -> _Extent:
    """Return how much to render; a slow machine is told what it leaves out."""
    usual = _COMPILED if compiled else _SCALAR
    chosen = replace(
        usual, size=options.size or usual.size, quality=options.quality or usual.quality
    )
    if not compiled:
        print(
            "without compiled kernels the demo is smaller and shorter:"
            f" {_in_words(chosen)} instead of {_in_words(_COMPILED)}",
            flush=True,
        )
    return chosen


def _in_words(extent: _Extent) -> str:
    """Such as `2 s at 640x360, preview`."""
    width, height = extent.size
    return f"{extent.seconds:g} s at {width}x{height}, {extent.quality}"
