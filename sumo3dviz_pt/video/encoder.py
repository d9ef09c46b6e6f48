"""Encodes frames as a film, one at a time.

The colour tags go in by ffmpeg's `setparams` filter: as output options they are
silently lost (measured).
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.video.codecs import Codec, codec_named, frame_rate
from sumo3dviz_pt.video.ffmpeg import Ffmpeg
from sumo3dviz_pt.video.yuv import yuv709

Picture = NDArray[Any]
"""sRGB-encoded frame, (h, w, 3): uint8, or float in [0, 1]."""

_TAGS = "color_primaries=bt709:color_trc=bt709:colorspace=bt709:range=tv:chroma_location=center"


def encode(
    frames: Iterable[Picture],
    path: Path,
    *,
    size: tuple[int, int],
    fps: float | Fraction,
    codec: str = "h264",
    comment: Mapping[str, Any] | None = None,
) -> int:
    """Encode a film in constant memory; it appears under its name only when complete.

    Pictures of floats are dithered when the codec has 8 bits, seeded by frame index.

    Args:
        frames: sRGB-encoded pictures, (h, w, 3), uint8 or float in [0, 1].
        path: The film.
        size: Width and height, both even [px].
        fps: Frames per second; see `frame_rate`.
        codec: A name in `CODECS`.
        comment: Stored as JSON in the film's comment.

    Returns:
        How many frames the film has.

    Raises:
        ConfigError: If codec, ending, size, rate or folder do not fit.
        RenderError: If a frame is of the wrong size, there is none, or ffmpeg fails.
    """
    kind, rate = check_film(path, size=size, fps=fps, codec=codec)
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    count = 0
    try:
        with Ffmpeg(_arguments(kind, size=size, rate=rate, comment=comment, part=part)) as ffmpeg:
            for count, frame in enumerate(frames, start=1):
                for plane in _planes(frame, index=count - 1, kind=kind, size=size):
                    ffmpeg.write(plane.tobytes())
            if not count:
                raise RenderError("a film needs at least one frame")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return count


def check_film(
    path: Path, *, size: tuple[int, int], fps: float | Fraction, codec: str
) -> tuple[Codec, Fraction]:
    """Refuse what cannot become a film, before any frame is rendered.

    Returns:
        The codec and the exact frame rate.

    Raises:
        ConfigError: If codec, ending, size, rate or folder do not fit.
    """
    kind = codec_named(codec, path=path)
    if any(side <= 0 or side % 2 for side in size):
        raise ConfigError(
            f"a film's width and height must be even, not {size[0]} x {size[1]}", key="output.size"
        )
    if not path.parent.is_dir():
        raise ConfigError(f"the folder {str(path.parent)!r} does not exist")
    return kind, fps if isinstance(fps, Fraction) else frame_rate(fps)


def _planes(
    frame: Picture, *, index: int, kind: Codec, size: tuple[int, int]
) -> tuple[NDArray[Any], ...]:
    """One frame's planes."""
    if frame.shape != (size[1], size[0], 3):
        raise RenderError(f"frame {index} is {frame.shape}, not ({size[1]}, {size[0]}, 3)")
    is_bytes = frame.dtype == np.uint8
    rgb = frame / np.float32(255) if is_bytes else np.clip(frame, 0.0, 1.0)
    # Bytes are rounded already; more noise would not bring their steps back.
    rng = np.random.default_rng(index) if kind.bits == 8 and not is_bytes else None
    return yuv709(rgb, bits=kind.bits, halved=kind.halved, rng=rng)


def _arguments(
    kind: Codec,
    *,
    size: tuple[int, int],
    rate: Fraction,
    comment: Mapping[str, Any] | None,
    part: Path,
) -> list[str]:
    """What ffmpeg is told."""
    source = ["-f", "rawvideo", "-pix_fmt", kind.pixels, "-s", f"{size[0]}x{size[1]}"]
    source += ["-r", f"{rate.numerator}/{rate.denominator}", "-i", "pipe:0"]
    target = ["-vf", f"setparams={_TAGS}", *kind.options, "-pix_fmt", kind.pixels]
    if part.suffix.lower() != ".mkv":
        # The index goes to the front, so that browsers can start at once.
        target += ["-movflags", "+faststart"]
    if comment:
        target += ["-metadata", "comment=" + json.dumps(dict(comment), sort_keys=True)]
    return ["-y", *source, *target, str(part)]
