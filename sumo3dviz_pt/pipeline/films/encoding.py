"""Stored frames become films or numbered pictures."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.settings import OutputSettings
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.random import frame_seed
from sumo3dviz_pt.pipeline.accounts.provenance import versions
from sumo3dviz_pt.pipeline.films.frames import intact
from sumo3dviz_pt.pipeline.films.proof import delivered
from sumo3dviz_pt.pipeline.films.sequences import is_sequence, write_sequence
from sumo3dviz_pt.pipeline.films.traced import Shelf
from sumo3dviz_pt.pipeline.overlays.files import overlaid, plain_twin, read_facts, write_captions
from sumo3dviz_pt.pipeline.overlays.twins import write_both
from sumo3dviz_pt.pipeline.production import Production
from sumo3dviz_pt.video.spherical import ENDINGS, Spherical, spherical_of, write_boxes


def encode_frames(
    files: Sequence[Path],
    path: Path,
    *,
    production: Production,
    fps: Fraction,
    turns: Iterable[Path],
    masters: Path | None = None,
) -> dict[str, Any]:
    """Develop stored frames and encode them in constant memory; with overlays, also without them.

    Args:
        files: EXR frames, in order.
        path: The film, or its numbered pictures.
        production: What the frames show; says size, codec, tone, glare and overlays.
        fps: Frames per second.
        turns: The same files, each when it can be developed.
        masters: Folder for the finished frames' radiance, or None.

    Returns:
        What each film that was written can be held against, by its name.

    Raises:
        InputError: If a frame is of another film by now, missing or damaged.
    """
    output = production.job.output
    pictures = developed(
        turns,
        tone=output.tone,
        glare=output.glare,
        key=production.key,
        masters=masters,
    )
    film = None if production.job.overlays is None else read_facts(files[0].parent)
    lens = production.shot.frame_at(float(production.times[0])).view.lens
    found: dict[str, Any] = {}

    def write(pictures: Iterable[Image], path: Path) -> None:
        if is_sequence(path):
            write_sequence(path, files, pictures)
            return
        found[path.name] = _film(pictures, path, output, fps=fps, spherical=spherical_of(lens))

    if film is None:
        write(pictures, path)
    elif is_sequence(path):
        both = _with_plain(pictures, files, plain_twin(path))
        write(overlaid(both, files, film, whole=False), path)
    else:
        write_both(
            pictures,
            lambda some: write(overlaid(some, files, film, whole=True), path),
            lambda some: write(some, plain_twin(path)),
        )
    if film is not None:
        write_captions(film, path)
    return found


def _with_plain(pictures: Iterable[Image], files: Sequence[Path], path: Path) -> Iterator[Image]:
    """Yield pictures, each when it lies under its number, too; its frame may go at the next."""
    for picture, file in zip(pictures, files, strict=True):
        write_sequence(path, [file], [picture])
        yield picture


def _film(
    pictures: Iterable[Image],
    path: Path,
    output: OutputSettings,
    *,
    fps: Fraction,
    spherical: Spherical | None,
) -> dict[str, Any]:
    """Write developed pictures as a film; return what it can be held against."""
    from sumo3dviz_pt.video import encode

    prints = encode(
        pictures,
        path,
        size=output.size,
        fps=fps,
        codec=output.codec,
        comment={"made_by": "sumo3dviz_pt", "versions": versions()},
    )
    if spherical is not None and path.suffix.lower() in ENDINGS:
        write_boxes(path, spherical)
    return delivered(path, prints, codec=output.codec, size=output.size)


def developed(
    files: Iterable[Path],
    *,
    tone: str | None = None,
    exposure: float | None = None,
    glare: float | None = None,
    key: str | None = None,
    masters: Path | None = None,
) -> Iterator[Image]:
    """Develop stored frames to display-encoded pictures; None takes what is stored with them.

    Args:
        files: EXR frames, in order.
        tone: Tone curve's name.
        exposure: EV.
        glare: Share of light that the lens spreads.
        key: That all frames must have.
        masters: Folder for the finished frames' radiance, or None.

    Raises:
        InputError: If a frame is missing, damaged or has another key.
    """
    from sumo3dviz_pt.image.exr import PROVENANCE, write_exr
    from sumo3dviz_pt.image.optics import Optics
    from sumo3dviz_pt.image.tonemap import develop_float

    shelf = Shelf()

    def picture(file: Path) -> Image:
        radiance, account = shelf.finished(file)
        if key is not None and account.get("key") != key:
            raise InputError("has become a frame of another film", file=file)
        if masters is not None:
            text = {PROVENANCE: json.dumps(account, sort_keys=True)}
            half = bool(account.get("scene", {}).get("output", {}).get("half", True))
            write_exr(masters / file.name, {"radiance": radiance}, half=half, attributes=text)
        at = float(account.get("exposure", 0.0)) if exposure is None else exposure
        optics = Optics.from_dict(account.get("optics"))
        if optics is not None:
            seed = frame_seed(int(account.get("seed", 0)), float(account.get("time", 0.0)))
            radiance = optics.on(radiance, exposure=at, seed=seed)
        return develop_float(
            radiance,
            exposure=at,
            tone=tone or str(account.get("tone", "neutral")),
            glare=float(account.get("glare", 0.0)) if glare is None else glare,
        )

    for file in files:
        with intact(file):
            found = picture(file)
        yield found
