"""Stored frames become films or numbered pictures."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.pipeline.accounts.provenance import versions
from sumo3dviz_pt.pipeline.films.sequences import is_sequence, write_sequence
from sumo3dviz_pt.pipeline.films.traced import Shelf


def encode_frames(
    files: Sequence[Path],
    path: Path,
    *,
    job: Job,
    fps: Fraction,
    key: str,
    masters: Path | None = None,
) -> None:
    """Develop stored frames and encode them in constant memory.

    Args:
        files: EXR frames, in order.
        path: The film, or its numbered pictures.
        job: Size, codec, tone and glare.
        fps: Frames per second.
        key: That all frames have.
        masters: Folder for the finished frames' radiance, or None.

    Raises:
        InputError: If a frame is of another film by now, missing or damaged.
    """
    from sumo3dviz_pt.video import encode

    pictures = developed(
        files, tone=job.output.tone, glare=job.output.glare, key=key, masters=masters
    )
    if is_sequence(path):
        write_sequence(path, files, pictures)
        return
    encode(
        pictures,
        path,
        size=job.output.size,
        fps=fps,
        codec=job.output.codec,
        comment={"made_by": "sumo3dviz_pt", "versions": versions()},
    )


def developed(
    files: Sequence[Path],
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
    from sumo3dviz_pt.image.tonemap import develop_float

    shelf = Shelf()
    for file in files:
        radiance, account = shelf.finished(file)
        if key is not None and account.get("key") != key:
            raise InputError("has become a frame of another film", file=file)
        if masters is not None:
            text = {PROVENANCE: json.dumps(account, sort_keys=True)}
            half = bool(account.get("scene", {}).get("output", {}).get("half", True))
            write_exr(masters / file.name, {"radiance": radiance}, half=half, attributes=text)
        yield develop_float(
            radiance,
            exposure=float(account.get("exposure", 0.0)) if exposure is None else exposure,
            tone=tone or str(account.get("tone", "neutral")),
            glare=float(account.get("glare", 0.0)) if glare is None else glare,
        )
